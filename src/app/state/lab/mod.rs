//! State of the dock's views: parameters that the user chose, and data derived from the presented tree. The
//! curve through the primitives' centres.

mod icicle;
pub mod merges;
mod motion;
mod nodes;
mod plots;
mod ray;

pub use icicle::{IcicleInputs, IcicleLayout, IcicleState, SharedIcicle};
pub use merges::{MergesState, SharedMerges, Standing};
pub use motion::{MotionCurves, MotionInputs, MotionQuantity, MotionState, PolicyCurve, SharedMotion, frame_cost};
pub use nodes::{NodesState, Outline, OutlineRow, RankingInputs};
pub use plots::{PlotKind, PlotsState, PlottedTree, ScatterInputs, SharedPlots, TreeQuality, TreeSet, TreeToMeasure};
pub use ray::{RayOutcome, RaySource, RayState, SPEEDS, SharedRayView};

use std::sync::{Arc, Weak};

use serde::{Deserialize, Serialize};

use crate::accel::{Accel, is_same};
use crate::app::state::study::{OtherTree, Study};
use crate::lab::diagnose::Finding;
use crate::lab::icicle::IcicleWidth;
use crate::lab::node_values::KnownVisits;
use crate::lab::population::{MeasuredVisits, Population, ViewRays};
use crate::lab::scaffold::Scaffold;
use crate::scene::Scene;
use bvhscope_engine::tree::survival::Survival;

/// State of the dock's views. Nothing here outlives the run.
#[derive(Debug, Default)]
pub struct LabState {
    /// The outline of the tree in the view "Nodes".
    pub outline: Outline,
    /// The curve that the primitives are sorted along.
    pub curve: CurveState,
    /// Problems of the model or its tree that make rays slow.
    pub findings: Study<(), Vec<Finding>>,
    /// The nodes of the first tree that the second has too, and the other way round.
    pub survival: Study<OtherTree, [Survival; 2]>,
    /// The nodes of the first tree that it had before its passes too, and the other way round.
    pub moved: Study<(), [Survival; 2]>,
    /// Savings from rebuilding subtrees, which the tree keeps.
    pub regrets: Study<(), ()>,
    /// Readings that are taken while nothing else happens.
    pub at_rest: AtRestState,
    /// The ray in the view "Ray".
    pub ray: RayState,
    /// The kind of rays that visits are measured by.
    pub population: Population,
    /// How often the chosen rays visit each node.
    pub visits: Study<ViewRays, MeasuredVisits>,
    /// The primary rays by whose view visits are measured, and their scene: the view when visits were first wanted, so that numbers stay
    /// the same while the user looks at nodes from elsewhere, and can be compared from tree to tree.
    pub(in crate::app::state) rays: Option<(Weak<Scene>, ViewRays)>,
    /// The list of worst nodes.
    pub nodes: NodesState,
    /// The icicle.
    pub icicle: IcicleState,
    /// The view "Plots".
    pub plots: PlotsState,
    /// The view "Merges".
    pub merges: MergesState,
    /// The view "Motion".
    pub motion: MotionState,
}

impl LabState {
    /// The rays of the chosen population by which visits in `scene` are measured, if that was begun.
    pub fn rays(&self, scene: &Arc<Scene>) -> Option<ViewRays> {
        let (_, rays) = self.rays.as_ref().filter(|(of, _)| is_same(of, scene))?;
        Some(rays.of(self.population))
    }

    /// Measures visits by the rays of the view of these primary ones from now on.
    pub fn measure_by(&mut self, scene: &Arc<Scene>, rays: ViewRays) {
        self.rays = Some((Arc::downgrade(scene), rays));
        self.visits.resume();
    }

    /// Inputs of the list of worst nodes of `accel`; `None` while visits or regrets are needed and not known.
    pub fn ranking_inputs(&self, accel: &Arc<Accel>) -> Option<RankingInputs> {
        let order = self.nodes.order;
        if order.metric.needs_regrets {
            self.regrets.get(accel, &())?;
        }
        let visits = self.needed_visits(accel, order.metric.needs_visits).ok()?;
        Some(RankingInputs { order, visits })
    }

    /// Inputs of the widths of `accel`'s icicle; `None` while visits are needed and not known.
    pub fn icicle_inputs(&self, accel: &Arc<Accel>) -> Option<IcicleInputs> {
        let width = self.icicle.width;
        let visits = self.needed_visits(accel, width == IcicleWidth::Visits).ok()?;
        Some(IcicleInputs { width, visits })
    }

    /// Inputs of the scatter of `accel`'s nodes; `None` while its visits are not known.
    pub fn scatter_inputs(&self, accel: &Arc<Accel>) -> Option<ScatterInputs> {
        let rays = self.rays(&accel.scene)?;
        let measured = self.visits.get(accel, &rays)?;
        let visits = KnownVisits(Arc::clone(&measured.visits));
        Some(ScatterInputs { rays, sums: measured.sums.clone(), visits })
    }

    /// Notes a tree that is shown, and what rays cost in it where that is known; called each UI frame.
    pub fn note_tree(&mut self, accel: &Arc<Accel>) {
        self.plots.session.note(accel);
        if let Some(inputs) = self.scatter_inputs(accel)
            && let Some(scatter) = self.plots.scatter.get(accel, &inputs)
            && scatter.sums.root_hits > 0
        {
            let cost = scatter.sums.cost;
            self.plots.session.note_cost(accel, inputs.rays, cost);
        }
    }

    /// Whether the user has stopped what measures the visits of `accel`, or what rebuilds its subtrees.
    pub fn is_measuring_stopped(&self, accel: &Arc<Accel>) -> bool {
        self.regrets.is_cancelled(accel, &())
            || self.rays(&accel.scene).is_some_and(|rays| self.visits.is_cancelled(accel, &rays))
    }

    /// The visits of `accel` where they are `needed`; an error while they are not known.
    fn needed_visits(&self, accel: &Arc<Accel>, needed: bool) -> Result<Option<KnownVisits>, ()> {
        if needed { self.known_visits(accel).map(Some).ok_or(()) } else { Ok(None) }
    }

    /// The visits of `accel` that were measured last, by whichever rays.
    pub fn known_visits(&self, accel: &Arc<Accel>) -> Option<KnownVisits> {
        self.visits.of_tree(accel).map(|measured| KnownVisits(Arc::clone(&measured.visits)))
    }
}

/// Readings of both trees that no window moves; see [`measure_at_rest`](crate::lab::at_rest::measure_at_rest). The trees keep them.
#[derive(Debug, Default)]
pub struct AtRestState {
    /// Those of the first tree, by the number of threads.
    pub first: Study<usize, ()>,
    /// Those of the second.
    pub second: Study<usize, ()>,
    /// The user has just pressed or moved something.
    pub is_disturbed: bool,
    /// None are taken, for tests of other things.
    pub is_off: bool,
}

impl AtRestState {
    /// Readings may be taken now, where building and tracing are `idle`.
    pub const fn may_measure(&self, idle: bool) -> bool {
        idle && !self.is_disturbed && !self.is_off
    }
}

/// The drawn part of the curve, by level of the recursion.
#[derive(Debug)]
pub struct CurveState {
    /// Whether it is drawn.
    pub shown: bool,
    /// The level of the recursion whose cells are drawn; 0 is the whole model.
    pub level: u32,
    /// Curve and cells of the presented tree, or why it has none.
    pub scaffold: Study<u32, Result<Scaffold, String>>,
}

impl CurveState {
    /// The deepest level that can be chosen: cells of deeper ones are too small and too many to be told apart.
    pub const MAX_LEVEL: u32 = 10;

    /// Its part of a shared state.
    pub fn shared(&self) -> SharedCurve {
        let Self { shown, level, scaffold: _ } = self;
        SharedCurve { shown: *shown, level: *level }
    }

    /// Shows what another window showed.
    pub fn show_shared(&mut self, SharedCurve { shown, level }: SharedCurve) {
        (self.shown, self.level) = (shown, level.min(Self::MAX_LEVEL));
    }
}

/// The curve's part of a shared state.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SharedCurve {
    shown: bool,
    level: u32,
}

impl Default for SharedCurve {
    fn default() -> Self {
        CurveState::default().shared()
    }
}

impl Default for CurveState {
    fn default() -> Self {
        Self { shown: false, level: 4, scaffold: Study::default() }
    }
}
