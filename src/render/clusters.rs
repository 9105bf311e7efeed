//! Cluster colours: each surface in the colour of its ancestor node at a chosen depth.

use glam::Vec3;

use super::shade::{Shade, Shaded};
use super::trace_context::TraceContext;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::{Hit, Ray};
use bvhscope_engine::tree::traverse::TestCounts;
use bvhscope_engine::tree::{Container, Tree};

/// Poll for cancellation every this many nodes.
const CHECK_EVERY: usize = 1 << 16;

/// The ancestor at `depth` of each primitive, or its leaf if that lies above; the root for a primitive that no leaf holds.
pub fn cluster_of_primitives<C: Container>(
    tree: &Tree<C>,
    depth: u32,
    token: &CancelToken,
) -> Result<Vec<u32>, Cancelled> {
    let count = tree.primitive_indices.iter().max().map_or(0, |&last| last as usize + 1);
    let mut of_primitive = vec![0; count];
    // Parents come before their children, so one forward pass propagates depth and cluster.
    let mut of_node = vec![(0_u32, 0_u32); tree.nodes.len()];
    for (index, node) in tree.nodes.iter().enumerate() {
        if index % CHECK_EVERY == 0 {
            token.check()?;
        }
        let (own_depth, cluster) = of_node[index];
        for &primitive in &tree.primitive_indices[node.slots()] {
            of_primitive[primitive as usize] = cluster;
        }
        for child in node.children() {
            of_node[child as usize] = (own_depth + 1, if own_depth < depth { child } else { cluster });
        }
    }
    Ok(of_primitive)
}

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

/// Shades by cluster, with a weak headlight that keeps the shape visible.
pub(super) struct Clusters {
    of_primitive: Vec<u32>,
}

impl Clusters {
    pub(super) fn new<C: Container>(tree: &Tree<C>, depth: u32, token: &CancelToken) -> Result<Self, Cancelled> {
        Ok(Self { of_primitive: cluster_of_primitives(tree, depth, token)? })
    }
}

impl<C: Container> Shade<C> for Clusters {
    type Point = ();

    fn hit(
        &self,
        context: &TraceContext<C>,
        ray: &Ray,
        hit: &Hit,
        _point: &(),
        _tests: TestCounts,
        _blocked: &[bool],
    ) -> Shaded {
        let facing = context.orientation(ray, hit).smooth.dot(-ray.direction).max(0.0);
        let color = cluster_color(self.of_primitive[hit.primitive_index as usize]);
        Shaded::color(color * (0.35 + 0.65 * facing))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bvhscope_engine::geometry::Aabb;
    use bvhscope_engine::tree::Node;

    /// A root with a leaf and an interior node, which has two leaves; primitives in no particular order.
    fn tree() -> Tree<Aabb> {
        let node = |first, count| Node { container: Aabb::EMPTY, first, count };
        Tree {
            nodes: vec![node(1, 0), node(0, 2), node(3, 0), node(2, 1), node(3, 1)],
            primitive_indices: vec![3, 0, 1, 2],
            max_depth: 2,
        }
    }

    #[test]
    fn each_primitive_gets_its_ancestor_at_the_depth_or_its_leaf_above() {
        let token = CancelToken::new();
        let at = |depth| cluster_of_primitives(&tree(), depth, &token).unwrap_or_default();
        assert_eq!(at(0), [0, 0, 0, 0]);
        assert_eq!(at(1), [1, 2, 2, 1]);
        assert_eq!(at(2), [1, 3, 4, 1]);
        assert_eq!(at(u32::MAX), at(2));
        token.cancel();
        assert_eq!(cluster_of_primitives(&tree(), 0, &token), Err(Cancelled));
    }

    #[test]
    fn neighbors_in_number_differ_in_color() {
        for index in 0..200 {
            let color = cluster_color(index);
            assert!(color.min_element() >= 0.0 && color.max_element() <= 1.0);
            assert!((color - cluster_color(index + 1)).length() > 0.15, "{index}");
        }
    }
}
