//! Putting a tree on the screen: tree, overlay table, picture and numbers are swapped as a unit.

use std::sync::Arc;

use crate::app::state::comparison::Counted;
use crate::app::state::{AppState, Presented};
use crate::app::viewport::picking;
use crate::app::work::background_drop::drop_in_background;
use crate::app::work::build_job::BuiltTree;
use crate::render::Frame;

/// Presents `tree` with its picture. The selection moves to the corresponding node of the new tree, or is cleared with a new
/// scene. Returns whether the scene is a new one.
pub(crate) fn present_tree(tree: BuiltTree, frame: &Arc<Frame>, frame_id: u64, state: &mut AppState) -> bool {
    let old_scene = state.model.presented.as_ref().map(|presented| Arc::clone(&presented.accel.scene));
    let same_scene = old_scene.is_some_and(|scene| Arc::ptr_eq(&scene, &tree.accel.scene));
    let selected = picking::portable_selection(state);
    state.selection.hover = None;
    state.selection.nodes.hovered = None;
    state.selection.nodes.hidden.clear();
    state.selection.nodes.isolated = None;
    let before = state.model.presented.as_ref().filter(|_| same_scene).and_then(Presented::reference);
    let presented = Presented::new(tree.accel, tree.table, Arc::clone(frame), frame_id, tree.threads);
    let old = state.model.presented.replace(Presented { before, ..presented });
    drop_in_background(old);
    if same_scene {
        picking::restore_selection(state, selected);
    } else {
        picking::pick(state, None);
        // A plane that misses the new model would hide all of it or nothing.
        let bounds = state.model.bounds();
        let section = &mut state.wanted.render.section;
        *section = section.filter(|plane| bounds.is_some_and(|bounds| !plane.outline(&bounds).is_empty()));
    }
    !same_scene
}

/// Replaces the picture of the presented tree by `frame`, which was traced through the same tree. `hides` tells whether it
/// leaves triangles out.
pub(crate) fn present_frame(presented: &mut Presented, frame: &Arc<Frame>, frame_id: u64, hides: bool) {
    presented.frame = Arc::clone(frame);
    presented.frame_id = frame_id;
    // Nothing is counted while the settings change; the last counts of this tree remain.
    presented.tests_per_ray = frame.stats.tests_per_ray().or(presented.tests_per_ray);
    Counted::observe(&mut presented.counted, frame, hides);
}
