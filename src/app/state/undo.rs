//! Undo and redo of settings and hidden nodes. Camera moves and the choice of a model are not undone.
//!
//! `egui::util::undoer` does not serve here: it begins a step once nothing has changed for a second, where one drag is one step; and
//! its steps cannot be edited, where the nodes that are hidden in them belong to the model on the screen.

use crate::app::state::selection::{Chosen, HiddenNodes, SelectionState};
use crate::app::state::wanted::Wanted;
use crate::render::RenderSettings;

/// Maximum number of steps that can be undone.
const MAX_STEPS: usize = 200;

/// Stacks of earlier and later states.
#[derive(Debug, Clone, Default)]
pub struct UndoStack {
    past: Vec<Snapshot>,
    future: Vec<Snapshot>,
    /// The state at the end of the last step.
    settled: Option<Snapshot>,
}

/// The state between two steps.
#[derive(Debug, Clone)]
struct Snapshot {
    wanted: Wanted,
    hidden: HiddenNodes,
    /// The selection, which is no step of its own: it comes back with the nodes that were hidden or isolated by it.
    chosen: Chosen,
}

impl UndoStack {
    /// Records a step where settings or hidden nodes have changed; called once a UI frame. All changes while `dragging` make one
    /// step.
    pub fn observe(&mut self, wanted: &Wanted, selection: &SelectionState, dragging: bool) {
        match &mut self.settled {
            None => self.settled = Some(Snapshot::new(wanted, selection)),
            Some(settled) if !dragging && !settled.is_same(wanted, &selection.hidden) => {
                self.past.push(std::mem::replace(settled, Snapshot::new(wanted, selection)));
                if self.past.len() > MAX_STEPS {
                    self.past.remove(0);
                }
                self.future.clear();
            }
            Some(settled) => settled.chosen = selection.chosen(),
        }
    }

    /// Adopts the settings of a new scene without recording a step: the program itself has changed them. Hidden nodes of the old
    /// scene are forgotten.
    pub fn settle(&mut self, wanted: &Wanted) {
        let now = Snapshot::new(wanted, &SelectionState::default());
        for steps in [&mut self.past, &mut self.future] {
            for step in steps.iter_mut() {
                (step.hidden, step.chosen) = (HiddenNodes::default(), Chosen::default());
                step.wanted.tree_files.clone_from(&wanted.tree_files);
            }
            steps.dedup_by(|a, b| a.is_same(&b.wanted, &b.hidden));
            // A step that only hid nodes would now change nothing.
            while steps.last().is_some_and(|step| step.is_same(&now.wanted, &now.hidden)) {
                steps.pop();
            }
        }
        self.settled = Some(now);
    }

    /// Goes back one step, if there is one.
    pub fn undo(&mut self, wanted: &mut Wanted, selection: &mut SelectionState) {
        if let Some(earlier) = self.past.pop() {
            self.future.push(Snapshot::new(wanted, selection));
            self.adopt(earlier, wanted, selection);
        }
    }

    /// Goes forward one step that was undone, if there is one.
    pub fn redo(&mut self, wanted: &mut Wanted, selection: &mut SelectionState) {
        if let Some(later) = self.future.pop() {
            self.past.push(Snapshot::new(wanted, selection));
            self.adopt(later, wanted, selection);
        }
    }

    /// Whether there is a step to undo.
    pub fn can_undo(&self) -> bool {
        !self.past.is_empty()
    }

    /// Whether there is a step to redo.
    pub fn can_redo(&self) -> bool {
        !self.future.is_empty()
    }

    fn adopt(&mut self, step: Snapshot, wanted: &mut Wanted, selection: &mut SelectionState) {
        let before = std::mem::replace(wanted, step.over(wanted));
        // Nodes have the same numbers only in the same tree.
        let is_same_tree = before.build == wanted.build && before.tree_files == wanted.tree_files;
        if is_same_tree && selection.hidden != step.hidden {
            selection.choose(step.chosen);
        }
        selection.hidden = step.hidden;
        self.settled = Some(Snapshot::new(wanted, selection));
    }
}

impl Snapshot {
    fn new(wanted: &Wanted, selection: &SelectionState) -> Self {
        Self { wanted: wanted.clone(), hidden: selection.hidden.clone(), chosen: selection.chosen() }
    }

    /// The settings of the step, but what is not undone as in `now`. The background is the theme's.
    fn over(&self, now: &Wanted) -> Wanted {
        Wanted {
            source: now.source.clone(),
            camera: now.camera,
            render: RenderSettings { background: now.render.background, ..self.wanted.render },
            ..self.wanted.clone()
        }
    }

    /// Whether all that undo restores is equal.
    fn is_same(&self, wanted: &Wanted, hidden: &HiddenNodes) -> bool {
        self.hidden == *hidden && self.over(wanted) == *wanted
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SceneSource;

    #[test]
    fn one_drag_is_one_step() {
        let mut wanted = Wanted::new(SceneSource::default_builtin());
        let before = wanted.clone();
        let mut undo = UndoStack::default();
        undo.observe(&wanted, &SelectionState::default(), false);
        for threshold in 7..20 {
            wanted.build.threshold = threshold;
            undo.observe(&wanted, &SelectionState::default(), true);
        }
        undo.observe(&wanted, &SelectionState::default(), false);
        undo.undo(&mut wanted, &mut SelectionState::default());
        assert_eq!(wanted, before);
        assert!(!undo.can_undo());
        undo.redo(&mut wanted, &mut SelectionState::default());
        assert_eq!(wanted.build.threshold, 19);
        assert!(!undo.can_redo());
    }

    #[test]
    fn a_change_after_undo_discards_redo() {
        let mut wanted = Wanted::new(SceneSource::default_builtin());
        let mut undo = UndoStack::default();
        undo.observe(&wanted, &SelectionState::default(), false);
        wanted.threads = 3;
        undo.observe(&wanted, &SelectionState::default(), false);
        undo.undo(&mut wanted, &mut SelectionState::default());
        wanted.threads = 4;
        undo.observe(&wanted, &SelectionState::default(), false);
        assert!(!undo.can_redo());
    }
}
