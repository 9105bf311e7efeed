//! Cluster colours: each surface in the colour of its ancestor node at a chosen depth, or of the node of a cut that holds it.

use glam::Vec3;

use super::cluster_cut::cluster_of_primitives;
use super::request::RenderRequest;
use super::shade::{Sample, Shade, Shaded};
use crate::scene::{Scene, SceneCopies};
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::Hit;
use bvhscope_engine::with_tree;

/// The linear colour of a cluster: hues a golden angle apart at three lightnesses, so that siblings differ most.
pub fn cluster_color(node_index: u32) -> Vec3 {
    // 1/φ of a turn: consecutive indices are far apart in hue.
    let turns = (f64::from(node_index) * 0.618_033_988_749_894_9).fract() as f32;
    let (sin, cos) = (turns * std::f32::consts::TAU).sin_cos();
    // Three lightnesses separate similar hues.
    let lightness = 0.66 + 0.06 * (node_index % 3) as f32;
    oklab(lightness, 0.13 * cos, 0.13 * sin)
}

/// Oklab to linear sRGB (Björn Ottosson, *A perceptual color space for image processing*, 2020), clamped to the sRGB gamut.
fn oklab(lightness: f32, a: f32, b: f32) -> Vec3 {
    let l = (lightness + 0.396_337_78 * a + 0.215_803_76 * b).powi(3);
    let m = (lightness - 0.105_561_346 * a - 0.063_854_17 * b).powi(3);
    let s = (lightness - 0.089_484_18 * a - 1.291_485_5 * b).powi(3);
    Vec3::new(
        4.076_741_7 * l - 3.307_711_6 * m + 0.230_969_93 * s,
        -1.268_438 * l + 2.609_757_4 * m - 0.341_319_4 * s,
        -0.004_196_086 * l - 0.703_418_6 * m + 1.707_614_7 * s,
    )
    .clamp(Vec3::ZERO, Vec3::ONE)
}

/// Shades by cluster.
pub(super) struct Clusters {
    of_primitive: Vec<u32>,
}

impl Clusters {
    pub(super) fn new(request: &RenderRequest, token: &CancelToken) -> Result<Self, Cancelled> {
        let tree = &request.accel.tree;
        let of_primitive = match &request.clusters {
            Some(cut) => cut.of_primitives(tree, token)?,
            None => with_tree!(tree, tree => cluster_of_primitives(tree, request.settings.cluster_depth, token))?,
        };
        Ok(Self { of_primitive })
    }
}

impl Shade for Clusters {
    type Point = ();

    fn hit(&self, sample: &Sample<'_>, hit: &Hit, _point: &()) -> Shaded {
        // The tree of a construction may lack what the traced one holds.
        let cluster = self
            .of_primitive
            .get(sample.context.scene.primitive_of(hit.primitive_index) as usize)
            .copied()
            .unwrap_or(0);
        lit(sample, hit, cluster_color(cluster))
    }
}

/// A surface of a colour below a weak headlight that keeps the shape visible.
fn lit(sample: &Sample<'_>, hit: &Hit, color: Vec3) -> Shaded {
    let facing = sample.context.orientation(sample.ray, hit).smooth.dot(-sample.ray.direction).max(0.0);
    Shaded::color(color * (0.35 + 0.65 * facing))
}

/// Shades by copy or by mesh; a flat scene has one colour.
pub(super) struct Copies<'a> {
    copies: Option<&'a SceneCopies>,
    is_by_mesh: bool,
}

impl<'a> Copies<'a> {
    /// Each copy in a colour of its own.
    pub(super) fn each(scene: &'a Scene) -> Self {
        Self { copies: scene.copies.as_deref(), is_by_mesh: false }
    }

    /// All copies of a mesh in one colour.
    pub(super) fn by_mesh(scene: &'a Scene) -> Self {
        Self { is_by_mesh: true, ..Self::each(scene) }
    }
}

impl Shade for Copies<'_> {
    type Point = ();

    fn hit(&self, sample: &Sample<'_>, hit: &Hit, _point: &()) -> Shaded {
        let number = self.copies.map_or(0, |copies| {
            let copy = copies.copy_of(hit.primitive_index);
            if self.is_by_mesh { copies.copies().mesh(copy) } else { copy }
        });
        lit(sample, hit, cluster_color(number))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbors_in_number_differ_in_color() {
        for index in 0..200 {
            let color = cluster_color(index);
            assert!(color.min_element() >= 0.0 && color.max_element() <= 1.0);
            assert!((color - cluster_color(index + 1)).length() > 0.15, "{index}");
        }
    }
}
