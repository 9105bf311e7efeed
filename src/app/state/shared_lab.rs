//! State of the dock's views, as part of the state that is copied as one line.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::app::state::lab::{
    LabState, RaySource, SharedCurve, SharedIcicle, SharedMerges, SharedMotion, SharedPlots, SharedRayView,
};
use crate::camera::Camera;
use crate::lab::node_ranking::NodeOrder;
use crate::lab::population::Population;
use crate::lab::ray::RayMethod;
use crate::render::{RayKind, RayStart};
use bvhscope_engine::construction::{Cut, MergeOrder};
use bvhscope_engine::geometry::{Aabb, Ray};

/// State of the dock's views.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SharedLab {
    /// The kind of rays that visits are measured by.
    pub population: Population,
    /// The ray of the view "Ray".
    pub ray: Option<SharedRay>,
    /// The order of the merges.
    pub merge_order: MergeOrder,
    /// Number of clusters left at the present merge.
    pub clusters_left: Option<u32>,
    /// The cut that is shown instead of a merge.
    pub cut: Option<Cut>,
    /// The rest of the view "Merges".
    pub merges: SharedMerges,
    /// The view "Icicle".
    pub icicle: SharedIcicle,
    /// The rest of the view "Ray".
    pub ray_view: SharedRayView,
    /// The order of the view "Nodes".
    pub nodes: NodeOrder,
    /// The view "Plots".
    pub plots: SharedPlots,
    /// The view "Motion".
    #[serde(default)]
    pub motion: SharedMotion,
    /// The curve over the picture.
    pub curve: SharedCurve,
}

impl Default for SharedLab {
    fn default() -> Self {
        LabState::default().shared()
    }
}

/// A ray and the step that is looked at.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SharedRay {
    start: SharedStart,
    kind: RayKind,
    method: RayMethod,
    step: usize,
}

/// Where a ray comes from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum SharedStart {
    Pixel { pixel: [u32; 2], camera: Camera, size_px: [u32; 2] },
    Ray { origin: Vec3, direction: Vec3 },
}

impl SharedRay {
    /// The source of the ray; `None` where no picture has such a ray.
    fn source(&self) -> Option<RaySource> {
        match self.start {
            SharedStart::Pixel { pixel: [x, y], camera, size_px } => {
                let is_in = x < size_px[0] && y < size_px[1] && camera.is_usable();
                is_in.then_some(RaySource { start: RayStart::Pixel([x, y]), camera, size_px })
            }
            SharedStart::Ray { origin, direction } => {
                let direction = direction.try_normalize().filter(|_| origin.is_finite())?;
                let start = RayStart::Given(Ray::new(origin, direction));
                // Nothing of such a ray is seen from there.
                let camera = Camera::framing(&Aabb { min: Vec3::ZERO, max: Vec3::ONE }, Vec3::Y);
                Some(RaySource { start, camera, size_px: [1; 2] })
            }
        }
    }
}

impl LabState {
    /// The part that another window needs to show the same.
    pub fn shared(&self) -> SharedLab {
        #[rustfmt::skip]
        let Self {
            population, ray: view, nodes, icicle, plots, merges, motion, curve,
            // Its unfolded nodes are shared with the selected and hidden ones.
            outline: _, at_rest: _,
            // Derived from the tree.
            findings: _, survival: _, moved: _, regrets: _, visits: _, rays: _,
        } = self;
        let ray = view.source.map(|RaySource { start, camera, size_px }| SharedRay {
            start: match start {
                RayStart::Pixel(pixel) => SharedStart::Pixel { pixel, camera, size_px },
                RayStart::Given(ray) => SharedStart::Ray { origin: ray.origin, direction: ray.direction },
            },
            kind: view.kind,
            method: view.method,
            step: view.cursor,
        });
        SharedLab {
            population: *population,
            ray,
            merge_order: merges.order,
            clusters_left: merges.left,
            cut: merges.wanted_cut(),
            merges: merges.shared(),
            icicle: icicle.shared(),
            ray_view: view.shared(),
            nodes: nodes.shared(),
            plots: plots.shared(),
            motion: motion.shared(),
            curve: curve.shared(),
        }
    }

    /// Shows what another window showed.
    pub fn show_shared(&mut self, shared: SharedLab) {
        #[rustfmt::skip]
        let SharedLab {
            population, ray, merge_order, clusters_left, cut, merges, icicle, ray_view, nodes, plots, motion, curve,
        } = shared;
        self.population = population;
        (self.merges.order, self.merges.left, self.merges.playing) = (merge_order, clusters_left, None);
        self.merges.show_shared(merges);
        self.merges.show_cut(cut);
        self.icicle.show_shared(icicle);
        self.nodes.show_shared(nodes);
        self.plots.show_shared(plots);
        self.motion.show_shared(motion);
        self.curve.show_shared(curve);
        self.ray.source = ray.as_ref().and_then(SharedRay::source);
        self.ray.restart();
        self.ray.show_shared(ray_view);
        if let Some(ray) = ray {
            (self.ray.kind, self.ray.method, self.ray.cursor) = (ray.kind, ray.method, ray.step);
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::app::state::lab::merges::{CutKind, MergePage, MergesState};
    use crate::app::state::lab::{MotionQuantity, PlotKind, TreeQuality, TreeSet};
    use crate::app::state::paper::Experiment;
    use crate::catalog::metrics;
    use crate::lab::icicle::IcicleWidth;
    use bvhscope_engine::follow::Policy;
    use bvhscope_engine::tree::traverse::Traversal;
    use serde_json::Value;

    /// A state in which each control of each view has another value than at the start.
    fn all_changed() -> LabState {
        let mut lab = LabState { population: Population::Bounce, ..LabState::default() };
        let camera = Camera::framing(&Aabb { min: Vec3::ZERO, max: Vec3::ONE }, Vec3::Y);
        lab.ray.source = Some(RaySource { start: RayStart::Pixel([3, 4]), camera, size_px: [20, 10] });
        (lab.ray.kind, lab.ray.method, lab.ray.cursor) = (RayKind::Shadow, RayMethod::Binary(Traversal::Paper), 17);
        (lab.ray.picks, lab.ray.speed, lab.ray.zoom) = (false, 20.0, Some([1.0, 2.0]));
        lab.ray.typed = ["1,2,3".to_owned(), "0,0,1".to_owned()];
        let merges = &mut lab.merges;
        (merges.order, merges.left, merges.speed, merges.window) = (MergeOrder::Level, Some(9), 30.0, Some(100));
        (merges.cut_area, merges.cut_triangles, merges.cut_kind) = (0.25, 7, CutKind::Triangles);
        (merges.page, merges.price_of) = (MergePage::Price, Some(5));
        (lab.icicle.width, lab.icicle.color) = (IcicleWidth::Visits, metrics::DEPTH);
        lab.nodes.order = NodeOrder { metric: metrics::OVERLAP, ascending: true, min_area: 0.01 };
        let plots = &mut lab.plots;
        (plots.kind, plots.quality) = (PlotKind::Speed, TreeQuality::Epo);
        plots.set = TreeSet::Measured(Experiment::Builders);
        let motion = &mut lab.motion;
        (motion.quantity, motion.hidden, motion.rays) = (MotionQuantity::Epo, vec![Policy::Refit], 2e5);
        (lab.curve.shown, lab.curve.level) = (true, 7);
        lab
    }

    /// The members of `value` that are as in `default`.
    fn unchanged(default: &Value, value: &Value, name: &str) -> Vec<String> {
        match (default, value) {
            (Value::Object(default), Value::Object(value)) if default.keys().eq(value.keys()) => {
                value.iter().flat_map(|(member, value)| unchanged(&default[member], value, member)).collect()
            }
            _ if default == value => vec![name.to_owned()],
            _ => Vec::new(),
        }
    }

    #[test]
    fn every_control_of_every_view_is_shared_and_shown() {
        let lab = all_changed();
        let value = serde_json::to_value(lab.shared()).unwrap();
        let default = serde_json::to_value(SharedLab::default()).unwrap();
        assert_eq!(unchanged(&default, &value, ""), [""; 0], "not changed by this test");
        let mut other = LabState::default();
        other.show_shared(serde_json::from_value(value).unwrap());
        assert_eq!(other.shared(), lab.shared());
    }

    #[test]
    fn a_typed_ray_is_shared_and_shown() {
        let mut lab = all_changed();
        let start = RayStart::Given(Ray::new(Vec3::new(1.0, 2.0, 3.0), Vec3::NEG_Z));
        lab.ray.source = lab.ray.source.map(|source| RaySource { start, ..source });
        let mut other = LabState::default();
        other.show_shared(lab.shared());
        assert_eq!((other.ray.source.map(|source| source.start), other.ray.cursor), (Some(start), 17));
    }

    #[test]
    fn a_cut_that_was_shared_is_shown_within_its_limits() {
        for (shared, shown) in [
            (None, None),
            (Some(Cut::Area(0.25)), Some(Cut::Area(0.25))),
            (Some(Cut::Area(-3.0)), Some(Cut::Area(MergesState::CUT_AREA[0]))),
            (Some(Cut::Primitives(0)), Some(Cut::Primitives(1))),
            (Some(Cut::Step { order: MergeOrder::Built, step: 3 }), None),
        ] {
            let mut lab = LabState::default();
            lab.show_shared(SharedLab { cut: shared, ..SharedLab::default() });
            assert_eq!(lab.shared().cut, shown);
        }
    }

    #[test]
    fn a_ray_that_points_nowhere_is_no_ray() {
        let camera = Camera::framing(&Aabb { min: Vec3::ZERO, max: Vec3::ONE }, Vec3::Y);
        for start in [
            SharedStart::Pixel { pixel: [20, 3], camera, size_px: [20, 10] },
            SharedStart::Ray { origin: Vec3::ONE, direction: Vec3::ZERO },
            SharedStart::Ray { origin: Vec3::NAN, direction: Vec3::X },
        ] {
            let (kind, method) = (RayKind::Primary, RayMethod::Wide);
            let ray = SharedRay { start, kind, method, step: 0 };
            let mut lab = LabState::default();
            lab.show_shared(SharedLab { ray: Some(ray), ..SharedLab::default() });
            assert_eq!(lab.ray.source, None);
        }
    }
}
