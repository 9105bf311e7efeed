//! What the views of the dock show, as part of the state that is copied as one line.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::app::state::lab::{LabState, RaySource};
use crate::camera::Camera;
use crate::lab::population::Population;
use crate::lab::ray::RayMethod;
use crate::render::{RayKind, RayStart};
use bvhscope_engine::construction::{Cut, MergeOrder};
use bvhscope_engine::geometry::{Aabb, Ray};

/// What the views of the dock show.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
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
    /// What of it another window needs to show the same.
    pub fn shared(&self) -> SharedLab {
        let view = &self.ray;
        let ray = view.source.map(|RaySource { start, camera, size_px }| SharedRay {
            start: match start {
                RayStart::Pixel(pixel) => SharedStart::Pixel { pixel, camera, size_px },
                RayStart::Given(ray) => SharedStart::Ray { origin: ray.origin, direction: ray.direction },
            },
            kind: view.kind,
            method: view.method,
            step: view.cursor,
        });
        let (merge_order, clusters_left) = (self.merges.order, self.merges.left);
        SharedLab { population: self.population, ray, merge_order, clusters_left, cut: self.merges.wanted_cut() }
    }

    /// Shows what another window showed.
    pub fn show_shared(&mut self, shared: SharedLab) {
        self.population = shared.population;
        (self.merges.order, self.merges.left, self.merges.playing) = (shared.merge_order, shared.clusters_left, None);
        self.merges.show_cut(shared.cut);
        self.ray.source = shared.ray.as_ref().and_then(SharedRay::source);
        self.ray.restart();
        if let Some(ray) = shared.ray {
            (self.ray.kind, self.ray.method, self.ray.cursor) = (ray.kind, ray.method, ray.step);
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::app::state::lab::merges::MergesState;
    use bvhscope_engine::tree::traverse::Traversal;

    #[test]
    fn what_was_shared_is_shown() {
        let camera = Camera::framing(&Aabb { min: Vec3::ZERO, max: Vec3::ONE }, Vec3::Y);
        let given = RayStart::Given(Ray::new(Vec3::new(1.0, 2.0, 3.0), Vec3::NEG_Z));
        for start in [RayStart::Pixel([3, 4]), given] {
            let mut lab = LabState::default();
            lab.population = Population::Bounce;
            lab.ray.source = Some(RaySource { start, camera, size_px: [20, 10] });
            (lab.ray.kind, lab.ray.method) = (RayKind::Shadow, RayMethod::Binary(Traversal::Paper));
            lab.ray.cursor = 17;
            (lab.merges.order, lab.merges.left) = (MergeOrder::Level, Some(9));
            let text = serde_json::to_string(&lab.shared()).unwrap();
            let mut other = LabState::default();
            other.show_shared(serde_json::from_str(&text).unwrap());
            assert_eq!(other.shared(), lab.shared(), "{text}");
            let start = |lab: &LabState| lab.ray.source.map(|source| source.start);
            assert_eq!((start(&other), other.ray.cursor), (Some(start(&lab).unwrap()), 17));
        }
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
