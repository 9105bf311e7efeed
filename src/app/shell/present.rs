//! Putting a tree on the screen: tree, overlay table, picture and numbers are swapped as a unit. Large values that this
//! replaces are freed off the UI thread.

use std::sync::Arc;

use crate::app::shell::build_job::BuiltTree;
use crate::app::state::comparison::Counted;
use crate::app::state::{AppState, Difference, Presented};
use crate::app::viewport::picking;
use crate::lab::diff::DifferenceMap;
use crate::render::Frame;

/// Presents `tree` with its picture. `hides` states whether that leaves triangles out. Selected and hidden nodes move to the
/// corresponding nodes of the new tree, or are cleared with a new model. Returns whether the model is a new one.
pub(crate) fn present_tree(
    tree: BuiltTree,
    frame: &Arc<Frame>,
    hides: bool,
    frame_id: u64,
    state: &mut AppState,
) -> bool {
    let old_scene = state.model.presented.as_ref().map(|presented| Arc::clone(&presented.accel.scene));
    let same_model = old_scene.as_ref().is_some_and(|scene| scene.is_same_model(&tree.accel.scene));
    let same_scene = old_scene.is_some_and(|scene| Arc::ptr_eq(&scene, &tree.accel.scene));
    let selected = picking::portable_selection(state);
    state.record_hidden();
    state.selection.hover = None;
    state.selection.nodes.hovered = None;
    let before = state.model.presented.as_ref().filter(|_| same_scene).and_then(Presented::reference);
    if let Some(old) = &state.model.presented {
        state.model.cut.carry_price(&old.accel, &tree.accel);
    }
    let presented = Presented::new(tree.accel, tree.table, Arc::clone(frame), hides, frame_id, tree.threads);
    let old = state.model.presented.replace(Presented { before, ..presented });
    drop_in_background(old);
    if same_model {
        picking::restore_selection(state, selected);
        state.restore_hidden();
    } else {
        remove_second_tree(state);
        state.selection.show_all();
        picking::pick(state, None);
        // A plane that misses the new model would hide all of it or nothing.
        let bounds = state.model.bounds();
        let section = &mut state.wanted.render.section;
        *section = section.filter(|plane| bounds.is_some_and(|bounds| !plane.outline(&bounds).is_empty()));
    }
    !same_model
}

/// Replaces the picture of the presented tree by `frame`, which was traced through the same tree. `hides` states whether it
/// leaves triangles out.
pub(crate) fn present_frame(presented: &mut Presented, frame: &Arc<Frame>, frame_id: u64, hides: bool) {
    if Arc::ptr_eq(&presented.frame, frame) {
        return;
    }
    presented.frame = Arc::clone(frame);
    presented.frame_id = frame_id;
    // Nothing is counted while the settings change; the last counts of this tree remain.
    presented.tests_per_ray = frame.stats.tests_per_ray().or(presented.tests_per_ray);
    Counted::observe(&mut presented.counted, frame, hides);
}

/// Presents the second tree with its picture.
pub(crate) fn present_second_tree(
    tree: BuiltTree,
    frame: &Arc<Frame>,
    hides: bool,
    frame_id: u64,
    state: &mut AppState,
) {
    let presented = Presented::new(tree.accel, tree.table, Arc::clone(frame), hides, frame_id, tree.threads);
    drop_in_background(state.model.second.replace(presented));
}

/// Presents the difference of the two pictures on the screen.
pub(crate) fn present_difference(map: &Arc<DifferenceMap>, picture_id: u64, state: &mut AppState) {
    if state.model.difference.as_ref().is_none_or(|shown| !Arc::ptr_eq(&shown.map, map)) {
        drop_in_background(state.model.difference.replace(Difference { map: Arc::clone(map), picture_id }));
    }
}

/// Takes the second tree, its picture and the difference from the screen, and gives their memory back.
pub(crate) fn remove_second_tree(state: &mut AppState) {
    if state.model.second.is_some() || state.model.difference.is_some() {
        drop_in_background((state.model.second.take(), state.model.difference.take()));
    }
}

/// Drops `value` on a thread of its own: freeing a tree of hundreds of megabytes takes longer than a UI frame.
pub(crate) fn drop_in_background(value: impl Send + 'static) {
    // Where no thread can be started, the closure is dropped here, and the value with it.
    let _ = std::thread::Builder::new().name("drop".to_owned()).spawn(move || drop(value));
}
