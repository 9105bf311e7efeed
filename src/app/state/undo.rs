//! Undo and redo of settings and hidden nodes. Camera moves and the choice of a model are not undone.
//!
//! `egui::util::undoer` does not serve here: it begins a step once nothing has changed for a second, where one drag is one step; and
//! its steps cannot be edited, where the nodes that are hidden in them belong to the model on the screen.

use crate::app::state::selection::HiddenNodes;
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
}

impl UndoStack {
    /// Records a step where settings or hidden nodes have changed; called once a UI frame. All changes while `dragging` make one
    /// step.
    pub fn observe(&mut self, wanted: &Wanted, hidden: &HiddenNodes, dragging: bool) {
        match &mut self.settled {
            None => self.settled = Some(Snapshot::new(wanted, hidden)),
            Some(settled) if !dragging && !settled.is_same(wanted, hidden) => {
                self.past.push(std::mem::replace(settled, Snapshot::new(wanted, hidden)));
                if self.past.len() > MAX_STEPS {
                    self.past.remove(0);
                }
                self.future.clear();
            }
            Some(_) => {}
        }
    }

    /// Adopts the settings of a new scene without recording a step: the program itself has changed them. Hidden nodes of the old
    /// scene are forgotten.
    pub fn settle(&mut self, wanted: &Wanted) {
        let now = Snapshot::new(wanted, &HiddenNodes::default());
        for steps in [&mut self.past, &mut self.future] {
            for step in steps.iter_mut() {
                step.hidden = HiddenNodes::default();
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
    pub fn undo(&mut self, wanted: &mut Wanted, hidden: &mut HiddenNodes) {
        if let Some(earlier) = self.past.pop() {
            self.future.push(Snapshot::new(wanted, hidden));
            self.adopt(&earlier, wanted, hidden);
        }
    }

    /// Goes forward one step that was undone, if there is one.
    pub fn redo(&mut self, wanted: &mut Wanted, hidden: &mut HiddenNodes) {
        if let Some(later) = self.future.pop() {
            self.past.push(Snapshot::new(wanted, hidden));
            self.adopt(&later, wanted, hidden);
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

    fn adopt(&mut self, step: &Snapshot, wanted: &mut Wanted, hidden: &mut HiddenNodes) {
        *wanted = step.over(wanted);
        hidden.clone_from(&step.hidden);
        self.settled = Some(Snapshot::new(wanted, hidden));
    }
}

impl Snapshot {
    fn new(wanted: &Wanted, hidden: &HiddenNodes) -> Self {
        Self { wanted: wanted.clone(), hidden: hidden.clone() }
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
        undo.observe(&wanted, &HiddenNodes::default(), false);
        for threshold in 7..20 {
            wanted.build.threshold = threshold;
            undo.observe(&wanted, &HiddenNodes::default(), true);
        }
        undo.observe(&wanted, &HiddenNodes::default(), false);
        undo.undo(&mut wanted, &mut HiddenNodes::default());
        assert_eq!(wanted, before);
        assert!(!undo.can_undo());
        undo.redo(&mut wanted, &mut HiddenNodes::default());
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
        undo.undo(&mut wanted, &mut HiddenNodes::default());
        wanted.threads = 4;
        undo.observe(&wanted, &HiddenNodes::default(), false);
        assert!(!undo.can_redo());
    }
}
