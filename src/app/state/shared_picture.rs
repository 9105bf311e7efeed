//! Drawing over the picture and the rays that measure visits, as part of the state that is copied as one line.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::app::state::curve::SharedCurve;
use crate::app::state::derived::Derived;
use crate::app::state::model::Model;
use crate::app::state::picture_cut::SharedMerges;
use crate::app::state::picture_ray::{RaySource, SharedRayView};
use crate::camera::Camera;
use crate::catalog::layouts::LayoutChoice;
use crate::lab::population::Population;
use crate::lab::ray::RayMethod;
use crate::render::{RayKind, RayStart};
use bvhscope_engine::construction::{Cut, MergeOrder};
use bvhscope_engine::geometry::{Aabb, Ray};

/// Drawing over the picture, and the rays that measure visits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SharedPicture {
    /// The kind of rays that visits are measured by.
    pub population: Population,
    /// The ray.
    pub ray: Option<SharedRay>,
    /// The order of the merges.
    pub merge_order: MergeOrder,
    /// Number of clusters left at the present merge.
    pub clusters_left: Option<u32>,
    /// The cut that is shown instead of a merge.
    pub cut: Option<Cut>,
    /// The rest of the merges.
    pub merges: SharedMerges,
    /// The rest of the ray.
    pub ray_view: SharedRayView,
    /// The layout that is shown in place of the binary tree.
    pub layout: Option<LayoutChoice>,
    /// The curve.
    pub curve: SharedCurve,
}

impl Default for SharedPicture {
    fn default() -> Self {
        Model::default().shared_picture()
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

impl Model {
    /// The part that another window needs to draw the same over its picture.
    pub fn shared_picture(&self) -> SharedPicture {
        #[rustfmt::skip]
        let Self {
            ray, cut, layout, curve, derived,
            // Products, and what has its own place in a shared state.
            loaded: _, presented: _, second: _, difference: _, up_override: _, file_missing: _, playback: _, followed: _,
            load_options: _, heat_basis: _,
        } = self;
        let Derived {
            population,
            // The file is wanted beside this part.
            ray_file: _,
            findings: _,
            survival: _,
            moved: _,
            regrets: _,
            at_rest: _,
            visits: _,
            rays: _,
            edges: _,
            counts_edges: _,
            estimates: _,
        } = derived;
        let source = ray.source.map(|RaySource { start, camera, size_px }| SharedRay {
            start: match start {
                RayStart::Pixel(pixel) => SharedStart::Pixel { pixel, camera, size_px },
                RayStart::Given(ray) => SharedStart::Ray { origin: ray.origin, direction: ray.direction },
            },
            kind: ray.kind,
            method: ray.method,
            step: ray.cursor,
        });
        SharedPicture {
            population: *population,
            ray: source,
            merge_order: cut.order,
            clusters_left: cut.left,
            cut: cut.wanted_cut(),
            merges: cut.shared(),
            ray_view: ray.shared(),
            layout: layout.chosen,
            curve: curve.shared(),
        }
    }

    /// Draws over the picture what another window drew.
    pub fn show_shared_picture(&mut self, shared: SharedPicture) {
        let SharedPicture { population, ray, merge_order, clusters_left, cut, merges, ray_view, layout, curve } =
            shared;
        self.derived.population = population;
        (self.cut.order, self.cut.left, self.cut.playing) = (merge_order, clusters_left, None);
        self.cut.show_shared(merges);
        self.cut.show_cut(cut);
        self.layout.chosen = layout.and_then(LayoutChoice::within_limits);
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
    use crate::app::state::json::unchanged;
    use crate::app::state::picture_cut::{CutKind, MergePage, PictureCut};
    use bvhscope_engine::tree::traverse::Traversal;

    /// A model over whose picture each control has another value than at the start.
    fn all_changed() -> Model {
        let mut model = Model::default();
        model.derived.population = Population::Bounce;
        let camera = Camera::framing(&Aabb { min: Vec3::ZERO, max: Vec3::ONE }, Vec3::Y);
        model.ray.source = Some(RaySource { start: RayStart::Pixel([3, 4]), camera, size_px: [20, 10] });
        (model.ray.kind, model.ray.method, model.ray.cursor) =
            (RayKind::Shadow, RayMethod::Binary(Traversal::Paper), 17);
        (model.ray.picks, model.ray.speed, model.ray.zoom) = (false, 20.0, Some([1.0, 2.0]));
        model.ray.typed = ["1,2,3".to_owned(), "0,0,1".to_owned()];
        let merges = &mut model.cut;
        (merges.order, merges.left, merges.speed, merges.window) = (MergeOrder::Level, Some(9), 30.0, Some(100));
        (merges.cut_area, merges.cut_triangles, merges.cut_kind) = (0.25, 7, CutKind::Triangles);
        (merges.page, merges.price_of) = (MergePage::Price, Some(5));
        (model.curve.shown, model.curve.level) = (true, 7);
        model.layout.chosen = Some(LayoutChoice::Engine);
        model
    }

    #[test]
    fn every_control_over_the_picture_is_shared_and_shown() {
        let model = all_changed();
        let value = serde_json::to_value(model.shared_picture()).unwrap();
        let default = serde_json::to_value(SharedPicture::default()).unwrap();
        assert_eq!(unchanged(&default, &value, ""), [""; 0], "not changed by this test");
        let mut other = Model::default();
        other.show_shared_picture(serde_json::from_value(value).unwrap());
        assert_eq!(other.shared_picture(), model.shared_picture());
    }

    #[test]
    fn a_typed_ray_is_shared_and_shown() {
        let mut model = all_changed();
        let start = RayStart::Given(Ray::new(Vec3::new(1.0, 2.0, 3.0), Vec3::NEG_Z));
        model.ray.source = model.ray.source.map(|source| RaySource { start, ..source });
        let mut other = Model::default();
        other.show_shared_picture(model.shared_picture());
        assert_eq!((other.ray.source.map(|source| source.start), other.ray.cursor), (Some(start), 17));
    }

    #[test]
    fn a_cut_that_was_shared_is_shown_within_its_limits() {
        for (shared, shown) in [
            (None, None),
            (Some(Cut::Area(0.25)), Some(Cut::Area(0.25))),
            (Some(Cut::Area(-3.0)), Some(Cut::Area(PictureCut::CUT_AREA[0]))),
            (Some(Cut::Primitives(0)), Some(Cut::Primitives(1))),
            (Some(Cut::Step { order: MergeOrder::Built, step: 3 }), None),
        ] {
            let mut model = Model::default();
            model.show_shared_picture(SharedPicture { cut: shared, ..SharedPicture::default() });
            assert_eq!(model.shared_picture().cut, shown);
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
            let mut model = Model::default();
            model.show_shared_picture(SharedPicture { ray: Some(ray), ..SharedPicture::default() });
            assert_eq!(model.ray.source, None);
        }
    }
}
