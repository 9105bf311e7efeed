//! Undo and redo of settings and hidden nodes. Camera moves and the choice of a model are not undone.

use crate::app::state::hidden_nodes::HiddenNodes;
use crate::app::state::wanted::Wanted;
use crate::render::RenderSettings;

/// Maximum number of steps that can be undone.
const MAX_STEPS: usize = 200;

/// Stacks of earlier and later states.
#[derive(Debug, Clone, Default)]
pub struct UndoStack {
    past: Vec<Step>,
    future: Vec<Step>,
    /// The state at the end of the last step.
    settled: Option<Step>,
}

/// The state between two steps.
#[derive(Debug, Clone)]
struct Step {
    wanted: Wanted,
    hidden: HiddenNodes,
}

impl UndoStack {
    /// Records a step where settings or hidden nodes have changed; called once a UI frame. All changes while `dragging` make one
    /// step.
    pub fn observe(&mut self, wanted: &Wanted, hidden: &HiddenNodes, dragging: bool) {
        let Some(settled) = &mut self.settled else {
            self.settled = Some(Step { wanted: wanted.clone(), hidden: hidden.clone() });
            return;
        };
        if dragging {
            return;
        }
        if !settled.is_same(wanted, hidden) {
            let now = Step { wanted: wanted.clone(), hidden: hidden.clone() };
            self.past.push(std::mem::replace(settled, now));
            if self.past.len() > MAX_STEPS {
                self.past.remove(0);
            }
            self.future.clear();
        }
    }

    /// Adopts the settings of a new scene without recording a step: the program itself has changed them. Hidden nodes of the old
    /// scene are forgotten.
    pub fn settle(&mut self, wanted: &Wanted) {
        for steps in [&mut self.past, &mut self.future] {
            for step in steps.iter_mut() {
                step.hidden = HiddenNodes::default();
                step.wanted.tree_files.clone_from(&wanted.tree_files);
            }
            steps.dedup_by(|a, b| a.is_same(&b.wanted, &b.hidden));
            // A step that only hid nodes would now change nothing.
            while steps.last().is_some_and(|step| step.is_same(wanted, &HiddenNodes::default())) {
                steps.pop();
            }
        }
        self.settled = Some(Step { wanted: wanted.clone(), hidden: HiddenNodes::default() });
    }

    /// Goes back one step. Returns whether there was one.
    pub fn undo(&mut self, wanted: &mut Wanted, hidden: &mut HiddenNodes) -> bool {
        let Some(earlier) = self.past.pop() else { return false };
        self.future.push(Step { wanted: wanted.clone(), hidden: hidden.clone() });
        self.apply(earlier, wanted, hidden);
        true
    }

    /// Goes forward one step that was undone. Returns whether there was one.
    pub fn redo(&mut self, wanted: &mut Wanted, hidden: &mut HiddenNodes) -> bool {
        let Some(later) = self.future.pop() else { return false };
        self.past.push(Step { wanted: wanted.clone(), hidden: hidden.clone() });
        self.apply(later, wanted, hidden);
        true
    }

    /// Whether there is a step to undo.
    pub fn can_undo(&self) -> bool {
        !self.past.is_empty()
    }

    /// Whether there is a step to redo.
    pub fn can_redo(&self) -> bool {
        !self.future.is_empty()
    }

    fn apply(&mut self, step: Step, to: &mut Wanted, hidden: &mut HiddenNodes) {
        let from = &step.wanted;
        to.build = from.build;
        to.threads = from.threads;
        // The background is the theme's.
        to.render = RenderSettings { background: to.render.background, ..from.render };
        to.overlay = from.overlay;
        to.second = from.second;
        to.tree_files.clone_from(&from.tree_files);
        *hidden = step.hidden.clone();
        self.settled = Some(Step { wanted: to.clone(), hidden: step.hidden });
    }
}

impl Step {
    /// Whether all that undo restores is equal.
    fn is_same(&self, wanted: &Wanted, hidden: &HiddenNodes) -> bool {
        let a = &self.wanted;
        let render = RenderSettings { background: a.render.background, ..wanted.render };
        a.build == wanted.build
            && a.tree_files == wanted.tree_files
            && a.threads == wanted.threads
            && a.render == render
            && a.overlay == wanted.overlay
            && a.second == wanted.second
            && self.hidden == *hidden
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
        undo.observe(&wanted, &HiddenNodes::default(), false);
        for threshold in 7..20 {
            wanted.build.threshold = threshold;
            undo.observe(&wanted, &HiddenNodes::default(), true);
        }
        undo.observe(&wanted, &HiddenNodes::default(), false);
        assert!(undo.undo(&mut wanted, &mut HiddenNodes::default()));
        assert_eq!(wanted, before);
        assert!(!undo.can_undo());
        assert!(undo.redo(&mut wanted, &mut HiddenNodes::default()));
        assert_eq!(wanted.build.threshold, 19);
        assert!(!undo.can_redo());
    }

    #[test]
    fn a_change_after_undo_discards_redo() {
        let mut wanted = Wanted::new(SceneSource::default_builtin());
        let mut undo = UndoStack::default();
        undo.observe(&wanted, &HiddenNodes::default(), false);
        wanted.threads = 3;
        undo.observe(&wanted, &HiddenNodes::default(), false);
        assert!(undo.undo(&mut wanted, &mut HiddenNodes::default()));
        wanted.threads = 4;
        undo.observe(&wanted, &HiddenNodes::default(), false);
        assert!(!undo.can_redo());
    }
}
