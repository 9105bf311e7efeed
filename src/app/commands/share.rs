//! Copies the whole state as one line of text, and shows the state of such a line.

use std::collections::BTreeSet;

use super::camera;
use crate::app::state::{AppState, Request, Severity, SharedNodes, SharedState};
use crate::scene::SceneSource;
use crate::view::NamedView;

/// Everything that another person needs to see what this window shows.
pub fn shared_state(state: &AppState) -> SharedState {
    let nodes = &state.selection.nodes;
    let mut wanted = state.wanted.clone();
    wanted.source = wanted.source.absolute();
    for file in wanted.tree_files.iter_mut().flatten() {
        *file = std::path::absolute(&*file).unwrap_or_else(|_| file.clone());
    }
    let tree = state.presented_tree();
    SharedState {
        wanted,
        show_geometry: state.preferences.show_geometry,
        show_containers: state.preferences.show_containers,
        dock: state.preferences.dock.open.clone(),
        nodes: SharedNodes {
            selected: nodes.selected,
            triangle: state.selection.picked.as_ref().map(|picked| picked.primitive),
            hidden: nodes.hidden.iter().copied().collect::<BTreeSet<_>>(),
            isolated: nodes.isolated,
            only: nodes.only.as_ref().map(|only| only.ranges()),
            topmost: tree.as_ref().map_or(0, |tree| state.lab.icicle.top_of(tree)),
            unfolded: tree.as_ref().map_or_else(|| BTreeSet::from([0]), |tree| state.lab.outline.unfolded(tree)),
        },
        lab: state.lab.shared(),
        paper: state.preferences.paper.clone(),
    }
}

/// Shows the state of a line that was pasted; says so where that is not possible, and changes nothing then.
pub fn paste_state(state: &mut AppState, text: &str) {
    match SharedState::parse(text).and_then(|shared| with_model_here(state, shared)) {
        Ok((shared, note)) => {
            state.messages.notify(Severity::Info, note);
            show_state(state, shared);
        }
        Err(reason) => {
            state.messages.notify(Severity::Warning, format!("What was pasted is not shown: {reason}"));
        }
    }
}

/// The state with its model as it is found here, and what to say about it. A file that is elsewhere on this machine is taken to
/// be the open one where that has the same name.
fn with_model_here(state: &AppState, mut shared: SharedState) -> Result<(SharedState, String), String> {
    let source = &shared.wanted.source;
    let label = source.label();
    let missing = source.path().is_some_and(|path| !path.exists());
    if !missing {
        return Ok((shared, format!("The pasted state of {label} is shown; Ctrl+Z undoes its settings")));
    }
    if state.wanted.source.label() != label {
        return Err(format!("its model {source} is not here; open a copy of {label} first, then paste again"));
    }
    let note = format!("The pasted state is shown on the open {label}, because {source} is not here");
    shared.wanted.source = state.wanted.source.clone();
    Ok((shared, note))
}

/// Shows a state. What it selects is selected once its tree is there.
pub fn show_state(state: &mut AppState, shared: SharedState) {
    let own_view = shared.has_own_view();
    let SharedState { wanted, show_geometry, show_containers, dock, nodes, lab, paper } = shared;
    let before = std::mem::replace(&mut state.wanted, wanted);
    let new = std::mem::replace(&mut state.wanted.source, before.source);
    let is_open = is_same(&new, &state.wanted.source);
    if own_view {
        state.wanted.camera = before.camera;
    }
    match (is_open, own_view) {
        (true, true) => camera::reset(state, NamedView::Default),
        (true, false) => {}
        (false, own_view) => {
            let camera = (!own_view).then_some(state.wanted.camera);
            state.activity.requests.push(Request::OpenShared(new, state.wanted.tree_files.clone(), camera));
        }
    }
    state.preferences.show_geometry = show_geometry;
    state.preferences.show_containers = show_containers;
    state.preferences.dock.open = dock;
    state.selection.pasted = Some(nodes);
    state.lab.show_shared(lab);
    state.preferences.paper = paper;
}

fn is_same(a: &SceneSource, b: &SceneSource) -> bool {
    a.absolute() == b.absolute()
}
