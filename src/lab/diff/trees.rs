//! Two trees measured alternately, then compared node by node and pixel by pixel.

use std::sync::Arc;

use super::map::DifferenceMap;
use crate::accel::Accel;
use crate::lab::by_depth::{Depth, by_depth};
use crate::lab::measure::{LabError, measure_contenders, request, visits};
use crate::lab::measurement::{Measurement, pool};
use crate::lab::setup::{Contender, Subject, TraceView};
use crate::render::{HeatKind, Shading, render};
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::tree::survival::{Survival, surviving_nodes};
use bvhscope_engine::with_tree;

/// Two trees of one scene, compared.
#[derive(Debug)]
pub struct TreeDifference {
    /// The measurements of A and of B.
    pub rows: [Measurement; 2],
    /// The nodes of A and of B at each depth.
    pub by_depth: [Vec<Depth>; 2],
    /// The nodes of A that B has too.
    pub survival: Survival,
    /// Tests of B minus tests of A in each pixel.
    pub map: DifferenceMap,
}

/// The nodes of `a` that `b` has too: those with the same set of triangles below.
pub fn survivors(a: &Accel, b: &Accel, token: &CancelToken) -> Result<Survival, Cancelled> {
    with_tree!(&a.tree, a => with_tree!(&b.tree, b => surviving_nodes(a, b, token)))
}

/// Measures both trees, A then B, alternately, then builds those that are built once more to compare them.
pub fn diff(
    subject: &Subject,
    trees: &[Contender; 2],
    view: &TraceView,
    token: &CancelToken,
) -> Result<TreeDifference, LabError> {
    let mut rows = Vec::with_capacity(2);
    measure_contenders("diff", subject, trees, view, &token.part(0, 2), &mut |row: Measurement| rows.push(row))?;
    let [a, b] = <[Measurement; 2]>::try_from(rows)
        .map_err(|_| LabError::Refused("one of the two trees was not measured".to_owned()))?;
    let token = token.part(1, 2);
    let (by_depth, survival, map) = pool(trees[0].setup.threads).map_err(LabError::Refused)?.install(|| {
        let trees = [build(subject, &trees[0], &token.part(0, 5))?, build(subject, &trees[1], &token.part(1, 5))?];
        let survival = survivors(&trees[0], &trees[1], &token.part(2, 5))?;
        let [a, b] = &trees;
        let by_depth = [depths(subject, a, view, &token)?, depths(subject, b, view, &token)?];
        let frames = [heat(a, view, &token.part(3, 5))?, heat(b, view, &token.part(4, 5))?];
        let map = DifferenceMap::new(&frames[0], &frames[1], &token)?;
        Ok::<_, LabError>((by_depth, survival, map))
    })?;
    let map = map.ok_or_else(|| LabError::Refused("the picture has no pixels".to_owned()))?;
    Ok(TreeDifference { rows: [a, b], by_depth, survival, map })
}

fn build(subject: &Subject, tree: &Contender, token: &CancelToken) -> Result<Arc<Accel>, LabError> {
    match &tree.read {
        Some(read) => Ok(Arc::clone(read)),
        None => Ok(Arc::new(Accel::build_binary(&subject.scene, &tree.setup.build, token)?)),
    }
}

/// The nodes at each depth, with their visits by the rays of the view's populations.
fn depths(
    subject: &Subject,
    accel: &Arc<Accel>,
    view: &TraceView,
    token: &CancelToken,
) -> Result<Vec<Depth>, Cancelled> {
    let visits = visits(subject, accel, view, token).collect::<Result<Vec<_>, Cancelled>>()?;
    by_depth(accel, visits.iter().map(|measured| (measured.sums.population, &measured.visits.counts[..])), token)
}

fn heat(accel: &Arc<Accel>, view: &TraceView, token: &CancelToken) -> Result<Arc<crate::render::Frame>, LabError> {
    let mut request = request(accel, view);
    request.settings.shading = Shading::Heat(HeatKind::Both);
    Ok(Arc::new(render(&request, token, &|_| ())?))
}
