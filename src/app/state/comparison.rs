//! Comparison of the presented tree with the one before it: which of their numbers compare, and which way is better.

use crate::accel::Accel;
use crate::camera::Camera;
use crate::render::{ColorMap, Frame, RenderSettings};
use bvhscope_engine::tree::ContainerKind;

/// Relative change of a time or speed below which it counts as noise.
const TIME_NOISE: f64 = 0.05;
/// Relative change of any other number below which it counts as none.
const EQUAL: f64 = 0.0005;
/// Maximum number of passes whose speeds are kept.
const MAX_SPEEDS: usize = 64;

/// A number of a tree that is compared with the tree before.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Quantity {
    /// Wall-clock time of the build in seconds.
    BuildTime,
    /// SAH cost.
    SahCost,
    /// End-point overlap.
    Epo,
    /// Number of nodes.
    Nodes,
    /// Number of leaves.
    Leaves,
    /// Depth of the deepest node.
    Depth,
    /// Container and triangle tests per primary ray.
    TestsPerRay,
    /// Container tests per primary ray.
    ContainerTests,
    /// Triangle tests per primary ray.
    TriangleTests,
    /// Primary rays in Mray/s.
    Speed,
}

impl Quantity {
    /// Whether a smaller value is better; `None` where neither direction is.
    pub const fn smaller_is_better(self) -> Option<bool> {
        match self {
            Self::Nodes | Self::Leaves | Self::Depth => None,
            Self::Speed => Some(false),
            _ => Some(true),
        }
    }

    /// Whether the value depends on camera, size and shading of the picture.
    const fn depends_on_view(self) -> bool {
        matches!(self, Self::TestsPerRay | Self::ContainerTests | Self::TriangleTests | Self::Speed)
    }

    /// Whether values of boxes and of spheres compare. Costs are relative to the root's container, and a box's surface is
    /// another than a sphere's.
    const fn compares_across_containers(self) -> bool {
        !matches!(self, Self::SahCost | Self::Epo)
    }

    const fn noise(self) -> f64 {
        if matches!(self, Self::BuildTime | Self::Speed) { TIME_NOISE } else { EQUAL }
    }
}

/// How a number differs from that of the tree before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Comparison {
    /// There is nothing to compare with: this is the first tree of its model, or the number is not known yet.
    Unknown,
    /// The tree before was counted in another view.
    OtherView,
    /// The tree before has containers of another kind, whose numbers do not compare with these.
    OtherContainer,
    /// The numbers compare.
    Change {
        /// The number of the tree before.
        before: f64,
        /// The number of the presented tree.
        now: f64,
        /// Which way it went.
        verdict: Verdict,
    },
}

/// Which way a number went.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The presented tree is better.
    Better,
    /// The tree before was better.
    Worse,
    /// No difference beyond noise.
    Same,
    /// There is a difference, and neither direction is better.
    Different,
}

impl Verdict {
    /// The word beside the difference; empty where neither direction is better.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Better => "better",
            Self::Worse => "worse",
            Self::Same => "same",
            Self::Different => "",
        }
    }
}

/// Everything beside the tree that its counts and its speed depend on.
#[derive(Debug, Clone, Copy, PartialEq)]
struct View {
    camera: Camera,
    size_px: [u32; 2],
    settings: RenderSettings,
}

impl View {
    fn of(frame: &Frame) -> Self {
        // Only the colours of the same counts, and how often the same ray is repeated.
        let settings = RenderSettings { heat_range: None, color_map: ColorMap::Inferno, samples: 1, ..frame.settings };
        Self { camera: frame.camera, size_px: [frame.width_px, frame.height_px], settings }
    }
}

/// Counts and speed of a tree in one view, at full resolution.
#[derive(Debug, Clone, PartialEq)]
pub struct Counted {
    /// `None` where triangles were hidden: counts of such a picture compare with none.
    view: Option<View>,
    /// Container and triangle tests per primary ray.
    tests_per_ray: [f32; 2],
    /// Speed of each pass in Mray/s.
    speeds: Vec<f64>,
}

impl Counted {
    /// Adds a picture to what was `counted` so far, which is replaced where it belongs to another view. Coarse pictures and those
    /// without counts change nothing. `hides` tells whether triangles of the picture are hidden.
    pub fn observe(counted: &mut Option<Self>, frame: &Frame, hides: bool) {
        let Some(tests_per_ray) = frame.stats.tests_per_ray().filter(|_| frame.coarseness == 1.0) else { return };
        let view = (!hides).then(|| View::of(frame));
        if counted.as_ref().is_none_or(|counted| counted.view != view) {
            *counted = Some(Self { view, tests_per_ray, speeds: Vec::new() });
        }
        if let Some(counted) = counted {
            counted.tests_per_ray = tests_per_ray;
            counted.speeds.truncate(MAX_SPEEDS - 1);
            counted.speeds.push(frame.mrays_per_s());
        }
    }

    /// Median speed of the passes in Mray/s, where they are those of `frame`.
    pub fn mrays_per_s_of(&self, frame: &Frame) -> Option<f64> {
        (frame.coarseness == 1.0 && self.view == Some(View::of(frame))).then(|| self.mrays_per_s())
    }

    fn mrays_per_s(&self) -> f64 {
        let mut speeds = self.speeds.clone();
        speeds.sort_by(f64::total_cmp);
        speeds.get(speeds.len() / 2).copied().unwrap_or(0.0)
    }
}

/// The numbers of a tree that was shown at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct TreeNumbers {
    container: ContainerKind,
    build_secs: f64,
    sah_cost: f64,
    epo: Option<f64>,
    nodes: f64,
    leaves: f64,
    depth: f64,
    counted: Option<Counted>,
}

impl TreeNumbers {
    /// The numbers of a tree and of what was counted while it was shown.
    pub fn new(accel: &Accel, counted: Option<Counted>) -> Self {
        let stats = &accel.report.stats;
        Self {
            container: accel.settings.container,
            build_secs: accel.report.build_time.as_secs_f64(),
            sah_cost: f64::from(stats.sah_cost),
            epo: accel.known_epo().map(|epo| f64::from(epo.value)),
            nodes: stats.nodes as f64,
            leaves: stats.leaves as f64,
            depth: f64::from(stats.max_depth),
            counted,
        }
    }

    /// One of the numbers; `None` where it is not known.
    pub fn value(&self, quantity: Quantity) -> Option<f64> {
        let tests =
            |select: fn([f32; 2]) -> f32| self.counted.as_ref().map(|counted| f64::from(select(counted.tests_per_ray)));
        match quantity {
            Quantity::BuildTime => Some(self.build_secs),
            Quantity::SahCost => Some(self.sah_cost),
            Quantity::Epo => self.epo,
            Quantity::Nodes => Some(self.nodes),
            Quantity::Leaves => Some(self.leaves),
            Quantity::Depth => Some(self.depth),
            Quantity::TestsPerRay => tests(|[containers, triangles]| containers + triangles),
            Quantity::ContainerTests => tests(|[containers, _]| containers),
            Quantity::TriangleTests => tests(|[_, triangles]| triangles),
            Quantity::Speed => self.counted.as_ref().map(Counted::mrays_per_s),
        }
    }

    /// How a number differs from that of the tree `before`.
    pub fn compare(&self, before: Option<&Self>, quantity: Quantity) -> Comparison {
        let Some(before) = before else { return Comparison::Unknown };
        if self.container != before.container && !quantity.compares_across_containers() {
            return Comparison::OtherContainer;
        }
        let (Some(earlier), Some(now)) = (before.value(quantity), self.value(quantity)) else {
            return Comparison::Unknown;
        };
        let view = |numbers: &Self| numbers.counted.as_ref().and_then(|counted| counted.view);
        if quantity.depends_on_view() && (view(self).is_none() || view(self) != view(before)) {
            return Comparison::OtherView;
        }
        Comparison::Change { before: earlier, now, verdict: verdict(quantity, earlier, now) }
    }
}

fn verdict(quantity: Quantity, before: f64, now: f64) -> Verdict {
    if (now - before).abs() <= before.abs() * quantity.noise() {
        return Verdict::Same;
    }
    match quantity.smaller_is_better() {
        None => Verdict::Different,
        Some(smaller) if smaller == (now < before) => Verdict::Better,
        Some(_) => Verdict::Worse,
    }
}
