//! The view "Motion": what is plotted over the frames of the clip, and what was measured of each policy.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::accel::Accel;
use crate::app::state::{Study, ViewState};
use crate::lab::motion::MotionRow;
use crate::lab::population::ViewRays;
use crate::scene::Scene;
use bvhscope_engine::follow::Policy;
use bvhscope_engine::settings::BuildSettings;

/// Quantity over the frames of a clip.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum MotionQuantity {
    /// Time until rays can be traced.
    Update,
    /// SAH cost of the tree.
    #[default]
    SahCost,
    /// End-point overlap of the tree.
    Epo,
    /// Tests of a ray of the chosen population.
    Tests,
    /// Time of the update and of the rays of a frame.
    Frame,
}

impl MotionQuantity {
    /// All, in the order of their list, with name and meaning.
    pub const ALL: [(Self, &'static str, &'static str); 5] = [
        (Self::Update, "Update (ms)", "Time until rays can be traced: of the binary tree and of the wide one"),
        (Self::SahCost, "SAH cost", "What the surface area heuristic predicts a ray to cost in the tree of the frame"),
        (Self::Epo, "EPO", "End-point overlap: what nodes cost that enclose a ray's end but not the surface there"),
        (
            Self::Tests,
            "Tests per ray",
            "Containers and triangles that a ray of the chosen kind is tested against, on average over all",
        ),
        (Self::Frame, "Frame (ms)", "Time of the update and of the rays of a frame together"),
    ];

    /// Its name, with the unit.
    pub fn label(self) -> &'static str {
        Self::ALL.into_iter().find(|(quantity, ..)| *quantity == self).map_or("", |(_, label, _)| label)
    }

    /// The value of a tree in a frame with `rays` rays; `None` where it is unknown.
    pub fn of(self, row: &MotionRow, rays: f64) -> Option<f64> {
        match self {
            Self::Update => Some(row.ready_ms()),
            Self::SahCost => Some(f64::from(row.stats.sah_cost)),
            Self::Epo => row.epo.map(|epo| f64::from(epo.value)),
            Self::Tests => row.tests_per_ray(),
            Self::Frame => Some(row.cost().time_ms(rays)),
        }
    }
}

/// Inputs of the measurements.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionInputs {
    /// Index of the clip.
    pub clip: usize,
    /// Number of frames.
    pub frames: u32,
    /// How trees are built.
    pub build: BuildSettings,
    /// The rays that are traced in each frame.
    pub rays: ViewRays,
}

/// The measurements of a policy, frame by frame.
#[derive(Debug)]
pub struct PolicyCurve {
    /// The policy.
    pub policy: Policy,
    /// One row for each frame.
    pub rows: Vec<MotionRow>,
}

/// The measurements of all policies that take the settings; an error states why there are none.
pub type MotionCurves = Result<Vec<PolicyCurve>, String>;

/// The view "Motion".
#[derive(Debug)]
pub struct MotionView {
    /// The quantity of the plot.
    pub quantity: MotionQuantity,
    /// Policies that are not drawn.
    pub hidden: Vec<Policy>,
    /// Rays of a frame.
    pub rays: f64,
    /// The measured curves.
    pub study: Study<MotionInputs, MotionCurves>,
    /// The model that was measured, by its tree when that was begun, which the study keeps its value with; and the rays of the view then.
    basis: Option<(Arc<Accel>, ViewRays)>,
}

/// The part of a shared state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SharedMotion {
    quantity: MotionQuantity,
    hidden: Vec<Policy>,
    rays: f64,
}

impl Default for SharedMotion {
    fn default() -> Self {
        MotionView::default().shared(None)
    }
}

impl Default for MotionView {
    fn default() -> Self {
        Self {
            quantity: MotionQuantity::default(),
            // Its costs are so much higher that the other curves would be one line.
            hidden: vec![Policy::Keep],
            rays: 1e6,
            study: Study::default(),
            basis: None,
        }
    }
}

impl ViewState for MotionView {
    const NAME: &'static str = "Motion";
    type Shared = SharedMotion;

    fn shared(&self, _: Option<&Arc<Accel>>) -> SharedMotion {
        let Self { quantity, hidden, rays, study: _, basis: _ } = self;
        SharedMotion { quantity: *quantity, hidden: hidden.clone(), rays: *rays }
    }

    fn show_shared(&mut self, SharedMotion { quantity, hidden, rays }: SharedMotion) {
        (self.quantity, self.hidden) = (quantity, hidden);
        self.rays = if rays.is_finite() { rays.clamp(Self::RAYS[0], Self::RAYS[1]) } else { Self::default().rays };
    }

    #[cfg(test)]
    fn changed() -> Self {
        Self { quantity: MotionQuantity::Epo, hidden: vec![Policy::Refit], rays: 2e5, ..Self::default() }
    }
}

impl MotionView {
    /// Least and largest number of rays of a frame.
    pub const RAYS: [f64; 2] = [1e3, 1e9];

    /// The model that is measured, by a tree of it; that of `accel` from now on where another one was, seen by the rays of the view then.
    pub fn basis(&mut self, accel: &Arc<Accel>, present: ViewRays) -> (Arc<Accel>, ViewRays) {
        let kept = self.basis.take().filter(|(basis, _)| basis.scene.is_same_model(&accel.scene));
        let basis = kept.unwrap_or_else(|| (Arc::clone(accel), present));
        self.basis.insert(basis).clone()
    }

    /// Measures by the rays of the present view from now on.
    pub fn measure_by(&mut self, present: ViewRays) {
        if let Some((_, rays)) = &mut self.basis {
            *rays = present;
        }
        self.study.resume();
    }

    /// The rays of the view that measurements are made by, if that was begun.
    pub fn view_rays(&self) -> Option<ViewRays> {
        self.basis.as_ref().map(|(_, rays)| rays.clone())
    }

    /// Forgets what was measured of another model.
    pub fn follow(&mut self, scene: Option<&Arc<Scene>>) {
        let is_same =
            |(basis, _): &mut (Arc<Accel>, ViewRays)| !scene.is_some_and(|scene| basis.scene.is_same_model(scene));
        drop(self.basis.take_if(is_same));
    }

    /// The latest measurement of the present model, by whichever inputs.
    pub fn curves(&self) -> Option<&Arc<MotionCurves>> {
        self.study.of_tree(&self.basis.as_ref()?.0)
    }
}
