//! Undo and redo of settings and hidden nodes. Camera moves, which have a history of their own, the choice of a model and its moment
//! are not undone.
//!
//! `egui::util::undoer` does not serve here: it begins a step once nothing has changed for a second, where one drag is one step; and
//! its steps cannot be edited, where the nodes that are hidden in them belong to the model on the screen.

use crate::app::state::selection::{Chosen, HiddenNodes, SelectionState};
use crate::app::state::wanted::Wanted;
use crate::camera::Camera;
use crate::render::RenderSettings;
use crate::scene::SceneSource;

/// Maximum number of steps that can be undone.
const MAX_STEPS: usize = 200;

/// Stacks of earlier and later states.
#[derive(Debug, Clone, Default)]
pub struct UndoStack {
    past: Vec<Snapshot>,
    future: Vec<Snapshot>,
    /// The state at the end of the last step.
    settled: Option<Snapshot>,
    /// Earlier and later cameras.
    pub cameras: CameraHistory,
}

/// The cameras from which a model was looked at.
#[derive(Debug, Clone, Default)]
pub struct CameraHistory {
    source: Option<SceneSource>,
    past: Vec<Camera>,
    future: Vec<Camera>,
    /// The camera at the end of the last move.
    settled: Option<Camera>,
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
                push(&mut self.past, std::mem::replace(settled, Snapshot::new(wanted, selection)));
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
        self.cameras.settle(wanted);
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
        let moment = step.wanted.moment;
        let before = std::mem::replace(wanted, step.over(wanted));
        // Nodes have the same numbers only in the same tree.
        let is_same_tree = before.build == wanted.build
            && before.tree_files == wanted.tree_files
            && before.unfolded == wanted.unfolded
            && before.moment == moment;
        if is_same_tree && selection.hidden != step.hidden {
            selection.choose(step.chosen);
        }
        selection.hidden = step.hidden;
        self.settled = Some(Snapshot::new(wanted, selection));
    }
}

impl CameraHistory {
    /// Records a move that has ended. All changes while `moving` make one move.
    pub fn observe(&mut self, camera: &Camera, moving: bool) {
        if moving {
            return;
        }
        if let Some(before) = self.settled.replace(*camera).filter(|before| before != camera) {
            push(&mut self.past, before);
            self.future.clear();
        }
    }

    /// Adopts the camera of a new scene, which the program chose. The cameras of another model are forgotten, those before a reload
    /// kept.
    fn settle(&mut self, wanted: &Wanted) {
        if self.source.as_ref() != Some(&wanted.source) {
            *self = Self { source: Some(wanted.source.clone()), ..Self::default() };
        }
        self.settled = Some(wanted.camera);
    }

    /// Goes back to the camera before the last move, if there was one.
    pub fn back(&mut self, camera: &mut Camera) {
        self.observe(camera, false);
        if let Some(earlier) = self.past.pop() {
            push(&mut self.future, std::mem::replace(camera, earlier));
            self.settled = Some(earlier);
        }
    }

    /// Goes forward to the camera that was left last, unless it has moved since.
    pub fn forward(&mut self, camera: &mut Camera) {
        self.observe(camera, false);
        if let Some(later) = self.future.pop() {
            push(&mut self.past, std::mem::replace(camera, later));
            self.settled = Some(later);
        }
    }

    /// Whether there is a camera before `camera`, the present one.
    pub fn can_go_back(&self, camera: &Camera) -> bool {
        !self.past.is_empty() || self.settled.is_some_and(|settled| settled != *camera)
    }

    /// Whether there is one after it.
    pub fn can_go_forward(&self, camera: &Camera) -> bool {
        !self.future.is_empty() && self.settled == Some(*camera)
    }
}

/// Adds a step, and forgets the first where there are too many.
fn push<T>(steps: &mut Vec<T>, step: T) {
    steps.push(step);
    if steps.len() > MAX_STEPS {
        steps.remove(0);
    }
}

impl Snapshot {
    fn new(wanted: &Wanted, selection: &SelectionState) -> Self {
        Self { wanted: wanted.clone(), hidden: selection.hidden.clone(), chosen: selection.chosen() }
    }

    /// The settings of the step, but what is not undone as in `now`. The background is the theme's.
    fn over(&self, now: &Wanted) -> Wanted {
        // Copies have numbers in their own model.
        let of_model = if self.wanted.source == now.source { &self.wanted } else { now };
        Wanted {
            unfolded: of_model.unfolded.clone(),
            source: now.source.clone(),
            moment: now.moment,
            camera: now.camera,
            render: RenderSettings { background: now.render.background, ..self.wanted.render },
            ..self.wanted.clone()
        }
    }

    /// Equality of everything that undo restores.
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

    fn camera_at(x: f32) -> Camera {
        let camera = Wanted::new(SceneSource::default_builtin()).camera;
        Camera { eye: camera.eye + glam::Vec3::X * x, ..camera }
    }

    #[test]
    fn one_drag_of_the_camera_is_one_move() {
        let mut cameras = CameraHistory::default();
        let mut camera = camera_at(0.0);
        cameras.observe(&camera, false);
        assert!(!cameras.can_go_back(&camera));
        for x in 1..9 {
            camera = camera_at(x as f32);
            cameras.observe(&camera, true);
        }
        // Not even the end of the drag has been observed.
        assert!(cameras.can_go_back(&camera));
        cameras.back(&mut camera);
        assert_eq!(camera, camera_at(0.0));
        assert!(!cameras.can_go_back(&camera) && cameras.can_go_forward(&camera));
        cameras.forward(&mut camera);
        assert_eq!(camera, camera_at(8.0));
        cameras.back(&mut camera);
        camera = camera_at(20.0);
        assert!(!cameras.can_go_forward(&camera), "the camera has moved since");
        cameras.forward(&mut camera);
        assert_eq!(camera, camera_at(20.0));
    }

    #[test]
    fn cameras_are_bounded_and_belong_to_one_model() {
        let mut wanted = Wanted::new(SceneSource::default_builtin());
        let mut undo = UndoStack::default();
        undo.settle(&wanted);
        for x in 0..MAX_STEPS as u32 * 2 {
            undo.cameras.observe(&camera_at(x as f32 + 1.0), false);
        }
        assert_eq!(undo.cameras.past.len(), MAX_STEPS);
        undo.settle(&wanted);
        assert!(undo.cameras.can_go_back(&wanted.camera), "the same model was read again");
        wanted.source = SceneSource::Builtin { name: "sphere".to_owned(), size: None };
        undo.settle(&wanted);
        assert!(!undo.cameras.can_go_back(&wanted.camera));
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
