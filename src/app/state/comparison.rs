//! Comparison of the presented tree with the one before it: which of their numbers compare, and which way is better.

use crate::accel::Accel;
use crate::camera::Camera;
pub use crate::lab::{Quantity, Verdict};
use crate::render::{ColorMap, Frame, RenderSettings};
use bvhscope_engine::tree::ContainerKind;

/// Maximum number of passes whose speeds are kept.
const MAX_SPEEDS: usize = 64;

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
    /// `None` where the file of the tree does not say.
    build_secs: Option<f64>,
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
            build_secs: accel.build_ms().map(|ms| ms * 1e-3),
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
            Quantity::BuildTime => self.build_secs,
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
        Comparison::Change { before: earlier, now, verdict: quantity.verdict(earlier, now) }
    }
}
