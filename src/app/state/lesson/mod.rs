//! Lessons: guided tours in steps, each a state of the window with a caption whose numbers are measured, and the one
//! that is being read.

mod step;

mod text;

pub use step::{Check, LessonStep, Numbers};
pub use text::Lesson;

use std::sync::Arc;

use crate::app::state::model::Presented;
use crate::app::state::second_tree::TreeSide;
use crate::app::state::state_line::SharedState;
use crate::camera::Camera;

/// The built-in lessons, in the order of the menu.
pub const LESSONS: [&str; 9] = [
    include_str!("../../../../assets/lessons/1-what-a-tree-saves.txt"),
    include_str!("../../../../assets/lessons/2-two-phases.txt"),
    include_str!("../../../../assets/lessons/3-threshold-and-reduction.txt"),
    include_str!("../../../../assets/lessons/4-box-or-sphere.txt"),
    include_str!("../../../../assets/lessons/5-when-sah-lies.txt"),
    include_str!("../../../../assets/lessons/6-why-here.txt"),
    include_str!("../../../../assets/lessons/7-refit-or-rebuild.txt"),
    include_str!("../../../../assets/lessons/8-blade-of-grass.txt"),
    include_str!("../../../../assets/lessons/9-where-the-houses-stop.txt"),
];

/// The lesson that is being read.
#[derive(Debug, Clone)]
pub struct Reading {
    /// The lesson.
    pub lesson: Arc<Lesson>,
    /// Index of the step that is shown.
    pub step: usize,
    /// The reader's own state, which comes back at the end.
    pub put_aside: Box<SharedState>,
    /// The numbers of each step that was reached.
    measured: Vec<Option<Numbers>>,
}

impl Reading {
    /// Begins a lesson. `put_aside` is shown again at its end.
    pub fn new(lesson: Arc<Lesson>, put_aside: SharedState) -> Self {
        let measured = vec![None; lesson.steps.len()];
        Self { lesson, step: 0, put_aside: Box::new(put_aside), measured }
    }

    /// The step that is shown.
    pub fn current(&self) -> &LessonStep {
        &self.lesson.steps[self.step]
    }

    /// Takes the numbers of the present step from what is presented, once that is the step's own tree and view, in a window whose
    /// camera is `camera`.
    pub fn measure(&mut self, shown: &Presented, camera: &Camera) {
        let state = &self.current().state;
        let same = shown.accel.file.is_none()
            && shown.accel.settings == state.wanted.build
            && state.wanted.is_of(&shown.accel.scene)
            && shown.accel.scene.has_form(state.copies)
            && shown.accel.follow == state.wanted.follow_at(TreeSide::A, state.wanted.moment)
            && shown.frame.settings.shading == state.wanted.render.shading
            && shown.frame.camera == *camera
            && (state.has_own_view() || state.wanted.camera == *camera);
        if same && let Some(numbers) = Numbers::of(shown, state.has_own_view()) {
            self.measured[self.step] = Some(numbers);
        }
    }

    /// The numbers of the present step and of the one before; `None` until they are measured.
    pub fn numbers(&self) -> (Option<&Numbers>, Option<&Numbers>) {
        let of = |step: usize| self.measured.get(step).and_then(Option::as_ref);
        (of(self.step), self.step.checked_sub(1).and_then(of))
    }

    /// The caption with its numbers; those that are not measured yet are an ellipsis.
    pub fn caption(&self) -> String {
        let (now, before) = self.numbers();
        text::fill(&self.current().caption, now, before)
    }
}
