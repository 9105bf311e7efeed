//! Undo and redo of settings. Camera moves and the choice of a model are not undone.

use crate::app::state::wanted::Wanted;
use crate::render::RenderSettings;

/// Maximum number of steps that can be undone.
const MAX_STEPS: usize = 200;

/// Stacks of earlier and later settings.
#[derive(Debug, Clone, Default)]
pub struct UndoStack {
    past: Vec<Wanted>,
    future: Vec<Wanted>,
    /// The settings at the end of the last step.
    settled: Option<Wanted>,
}

impl UndoStack {
    /// Records a step where the settings have changed; called once a UI frame. All changes while `dragging` make one step.
    pub fn observe(&mut self, wanted: &Wanted, dragging: bool) {
        let Some(settled) = &mut self.settled else {
            self.settled = Some(wanted.clone());
            return;
        };
        if dragging {
            return;
        }
        if !same_settings(settled, wanted) {
            self.past.push(std::mem::replace(settled, wanted.clone()));
            if self.past.len() > MAX_STEPS {
                self.past.remove(0);
            }
            self.future.clear();
        }
    }

    /// Adopts the settings without recording a step: the program itself has changed them.
    pub fn settle(&mut self, wanted: &Wanted) {
        self.settled = Some(wanted.clone());
    }

    /// Goes back one step. Returns whether there was one.
    pub fn undo(&mut self, wanted: &mut Wanted) -> bool {
        let Some(earlier) = self.past.pop() else { return false };
        self.future.push(wanted.clone());
        self.apply(&earlier, wanted);
        true
    }

    /// Goes forward one step that was undone. Returns whether there was one.
    pub fn redo(&mut self, wanted: &mut Wanted) -> bool {
        let Some(later) = self.future.pop() else { return false };
        self.past.push(wanted.clone());
        self.apply(&later, wanted);
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

    fn apply(&mut self, from: &Wanted, to: &mut Wanted) {
        to.build = from.build;
        to.threads = from.threads;
        // The background is the theme's.
        to.render = RenderSettings { background: to.render.background, ..from.render };
        to.overlay = from.overlay;
        self.settled = Some(to.clone());
    }
}

/// Whether all settings that undo restores are equal.
fn same_settings(a: &Wanted, b: &Wanted) -> bool {
    let render = RenderSettings { background: a.render.background, ..b.render };
    a.build == b.build && a.threads == b.threads && a.render == render && a.overlay == b.overlay
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
        undo.observe(&wanted, false);
        for threshold in 7..20 {
            wanted.build.threshold = threshold;
            undo.observe(&wanted, true);
        }
        undo.observe(&wanted, false);
        assert!(undo.undo(&mut wanted));
        assert_eq!(wanted, before);
        assert!(!undo.can_undo());
        assert!(undo.redo(&mut wanted));
        assert_eq!(wanted.build.threshold, 19);
        assert!(!undo.can_redo());
    }

    #[test]
    fn a_change_after_undo_discards_redo() {
        let mut wanted = Wanted::new(SceneSource::default_builtin());
        let mut undo = UndoStack::default();
        undo.observe(&wanted, false);
        wanted.threads = 3;
        undo.observe(&wanted, false);
        assert!(undo.undo(&mut wanted));
        wanted.threads = 4;
        undo.observe(&wanted, false);
        assert!(!undo.can_redo());
    }
}
