//! Exact agglomerative clustering: always merges the globally closest pair (Walter, Bala, Kulkarni, Pingali, *Fast Agglomerative
//! Clustering for Rendering*, 2008). One `combine_clusters` of all primitives, in roughly quadratic time.

use std::time::Instant;

use crate::aac::{
    Cluster, ClusterContainer, ClusterStack, PairWriter, Primitives, Scratch, combine_clusters, order_leaves,
};
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Triangle;
use crate::kernel::SimdLevel;
use crate::kernel::lanes::LANES;
use crate::kernel::simd::{dispatch, dispatch_plain};
use crate::stage_times::StageTimes;
use crate::tree::{Node, Tree};

/// The agglomerative tree of `triangles`, at least one. Adds the stage "tree".
pub fn build<C: ClusterContainer>(
    triangles: &[Triangle],
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<Tree<C>, Cancelled> {
    let start = Instant::now();
    let mut clusters = ClusterStack::with_capacity(triangles.len());
    dispatch_plain!(SimdLevel::of_builds().level(), simd => {
        for (primitive, triangle) in triangles.iter().enumerate() {
            // By the same kernel as in the approximate builder, so that containers are bit for bit the same.
            let (cached, _) = C::bounds_and_centroids(simd, &[*triangle; LANES]);
            let fields = C::fields_from_cached(simd, &cached[0], triangle);
            clusters.push(Cluster::of_primitive(fields, primitive as u32));
        }
    });
    let tree = agglomerate(clusters, token)?;
    times.stages.push(("tree", start.elapsed()));
    token.set_progress(1.0);
    Ok(tree)
}

/// The agglomerative tree of `clusters`, each with a single primitive. Its last merge is written first.
pub(crate) fn agglomerate<C: ClusterContainer>(
    mut clusters: ClusterStack<C>,
    token: &CancelToken,
) -> Result<Tree<C>, Cancelled> {
    let count = clusters.len;
    let mut nodes: Vec<Node<C>> = bytemuck::zeroed_vec(2 * count - 1);
    let (root, others) = nodes.split_at_mut(1);
    let mut pairs = PairWriter::new(others, 1);
    dispatch!(SimdLevel::of_builds().level(), simd => {
        combine_clusters(simd, &mut clusters, &mut Scratch::default(), 0, 1, &mut pairs, token)
    })?;
    root[0] = clusters.items[0].node();
    let (primitive_indices, max_depth) = order_leaves(&Primitives, &mut nodes, &mut [], count, None, token)?;
    Ok(Tree { nodes, primitive_indices, max_depth })
}
