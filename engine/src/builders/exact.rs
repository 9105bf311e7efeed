//! Exact agglomerative clustering: always the globally closest pair (Walter, Bala, Kulkarni, Pingali, *Fast Agglomerative
//! Clustering for Rendering*, 2008). One list of all primitives, bounds of best matches kept: about quadratic time.

use std::time::Instant;

use crate::aac::build::cluster_all;
use crate::aac::cluster::Clustered;
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Triangle;
use crate::stage_times::StageTimes;
use crate::tree::Tree;

/// The agglomerative tree of `triangles`.
pub fn build<C: Clustered>(
    triangles: &[Triangle],
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<Tree<C>, Cancelled> {
    let start = Instant::now();
    let tree = cluster_all(triangles, token)?;
    times.stages.push(("tree", start.elapsed()));
    token.set_progress(1.0);
    Ok(tree)
}
