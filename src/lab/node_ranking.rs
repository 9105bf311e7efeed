//! The worst nodes of a tree by a metric.

use serde::{Deserialize, Serialize};

use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::tree::largest::largest_nodes;

use crate::accel::node_values::NodeValues;
use crate::catalog::metrics::{self, Metric};

/// Most nodes in a ranking.
pub const RANKED_NODES: usize = 1_000;

/// Which nodes are ranked, and how.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NodeOrder {
    /// The metric.
    pub metric: &'static Metric,
    /// Nodes with the smallest values first, instead of those with the largest.
    pub ascending: bool,
    /// Nodes of a smaller area over the root's are left out.
    pub min_area: f32,
}

/// The first [`RANKED_NODES`] nodes in `order`; equal ones in the order of the tree. Nodes without a value are left out.
pub fn rank_nodes(values: &NodeValues<'_>, order: &NodeOrder, token: &CancelToken) -> Result<Vec<u32>, Cancelled> {
    let key = |node: u32| {
        let large_enough =
            order.min_area <= 0.0 || values.get(metrics::AREA, node).is_some_and(|area| area >= order.min_area);
        let value = if large_enough { values.get(order.metric, node) } else { None };
        value.map_or(f32::NAN, |value| if order.ascending { -value } else { value })
    };
    let ranked = largest_nodes(values.accel.tree.node_count(), RANKED_NODES, key, token)?;
    Ok(ranked.into_iter().map(|(node, _)| node).collect())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::catalog::metrics::RANKED;
    use crate::lab::population::{Population, ViewRays};
    use crate::lab::sample::teapot;
    use crate::render::RenderSettings;
    use bvhscope_engine::settings::BuildSettings;
    use bvhscope_engine::tree::ContainerKind;
    use std::sync::Arc;

    use crate::accel::Accel;

    /// Every order equals the plain sorting of all nodes.
    #[test]
    fn rankings_are_the_beginning_of_the_sorted_nodes() {
        let token = CancelToken::new();
        let scene = teapot();
        for container in ContainerKind::ALL {
            let settings = BuildSettings { container, ..BuildSettings::default() };
            let accel = Arc::new(Accel::build(&scene, &settings, &token).unwrap());
            let camera = Camera::framing(&scene.bounds, scene.up);
            let rays = ViewRays::new(Population::Primary, camera, [300, 200], &RenderSettings::default());
            let visits = rays.measure(&accel, &token).unwrap().visits;
            accel.compute_regrets(&token).unwrap();
            let values = NodeValues { accel: &accel, visits: Some(&visits) };
            for metric in RANKED {
                for (ascending, min_area) in [(false, 0.0), (true, 0.0), (false, 0.01)] {
                    let ranked = rank_nodes(&values, &NodeOrder { metric, ascending, min_area }, &token).unwrap();
                    let all = 0..accel.tree.node_count() as u32;
                    let large = all.filter(|&node| values.get(metrics::AREA, node).unwrap() >= min_area);
                    let mut sorted: Vec<(u32, f32)> =
                        large.filter_map(|node| Some((node, values.get(metric, node)?))).collect();
                    sorted.sort_by(|a, b| if ascending { a.1.total_cmp(&b.1) } else { b.1.total_cmp(&a.1) });
                    sorted.truncate(RANKED_NODES);
                    let sorted: Vec<u32> = sorted.into_iter().map(|(node, _)| node).collect();
                    // Only trees that follow a model have grown.
                    assert_eq!(ranked.is_empty(), metric == metrics::GROWTH, "{metric:?}");
                    assert_eq!(ranked, sorted, "{container:?} {metric:?} {ascending} {min_area}");
                }
            }
        }
    }

    #[test]
    fn visits_of_too_few_predicted_rays_are_not_ranked() {
        let token = CancelToken::new();
        let scene = teapot();
        let accel = Arc::new(Accel::build(&scene, &BuildSettings::default(), &token).unwrap());
        let camera = Camera::framing(&scene.bounds, scene.up);
        let visits = |size_px| {
            let rays = ViewRays::new(Population::Primary, camera, size_px, &RenderSettings::default());
            rays.measure(&accel, &token).unwrap().visits
        };
        assert!((200 * 256 / 2..=256 * 256).contains(&visits([4_000, 3_000]).rays));
        let visits = visits([20, 20]);
        assert_eq!(visits.rays, 400);
        let values = NodeValues { accel: &accel, visits: Some(&visits) };
        let of = |node| values.get(metrics::VISIT_RATIO, node);
        assert_eq!(of(0), Some(1.0), "the root is what predictions begin with");
        let unknown = (0..accel.tree.node_count() as u32).filter(|&node| of(node).is_none()).count();
        assert!(unknown > 0, "a small leaf has no meaningful ratio");
        assert_eq!(NodeValues { visits: None, ..values }.get(metrics::VISIT_RATIO, 0), None);
    }
}
