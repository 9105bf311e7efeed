//! Restructuring: agglomerative clustering merges what is close, which on scans is worse than splitting from the top, on
//! architecture far better. So a sample of treelets is built again from the top; where that pays on the whole, so is the
//! tree, otherwise the treelets of those neighbourhoods where it pays, each kept only where it is cheaper.

use rayon::prelude::*;

use super::below::joined_cost;
use super::gather::{Leaves, node_of, treelet_roots};
use super::item::{Item, NEW};
use super::topdown::{Builder, TopDown};
use super::weigh::Weight;
use crate::bvh::lists::zeros;
use crate::bvh::simd::SimdLevel;
use crate::bvh::{Node, Tree};
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Aabb;

/// So many treelets are built to see whether it pays for their neighbours, where there are more.
const SAMPLES: usize = 20;
/// Least neighbours, one of which is built.
const NEIGHBOURS: usize = 8;
/// Share of their cost that all samples must gain for the whole tree to be built again. Scans gain 5 to 6 percent, architecture
/// 0 to 3.
const WHOLE_GAIN: f32 = 0.04;
/// Share of its cost that a sample must gain for its neighbours to be built.
const SAMPLE_GAIN: f32 = 0.03;
/// Share of its cost that what is kept must gain: less is rounding.
const KEPT_GAIN: f32 = 1e-5;
/// Most nodes: links have a bit for other things.
const MAX_NODES: usize = NEW as usize;

/// Builds treelets of `tree`, whose nodes have `weights`, or all of it again. The nodes then stand in any order, siblings
/// together. Returns by how much the SAH cost falls.
pub fn restructure(
    tree: &mut Tree<Aabb>,
    weights: &[Weight],
    collapses: bool,
    token: &CancelToken,
) -> Result<f32, Cancelled> {
    if tree.nodes.len() > MAX_NODES {
        return Ok(0.0);
    }
    let job = Job {
        nodes: &tree.nodes,
        weights,
        builder: Builder { level: SimdLevel::best().level_of_plain_loops(), collapses, token },
    };
    let roots = treelet_roots(&tree.nodes, weights);
    let neighbours = roots.len().div_ceil(SAMPLES).max(NEIGHBOURS);
    let samples = roots.par_chunks(neighbours).map(|group| {
        let root = group[group.len() / 2];
        let old = weights[root as usize].cost;
        Ok([old, job.treelet(root)?.map_or(old, |treelet| treelet.cost)])
    });
    let samples: Vec<[f32; 2]> = samples.collect::<Result<_, _>>()?;
    let gains = |[old, new]: [f32; 2], share: f32| new < old * (1.0 - share);
    let all = samples.iter().fold([0.0; 2], |sum, sample| [sum[0] + sample[0], sum[1] + sample[1]]);
    if gains(all, WHOLE_GAIN)
        && let Some(whole) = job.whole(&roots)?
    {
        let old = weights[0].cost;
        if gains([old, whole.cost], KEPT_GAIN) {
            write_whole(tree, &whole.tree, token)?;
            return Ok(old - whole.cost);
        }
    }

    let pays = |at: usize| gains(samples[at / neighbours], SAMPLE_GAIN);
    let chosen: Vec<u32> = roots.iter().enumerate().filter(|&(at, _)| pays(at)).map(|(_, &root)| root).collect();
    let built = chosen.par_iter().map(|&root| {
        let treelet = job.treelet(root)?;
        Ok(treelet.filter(|treelet| gains([weights[root as usize].cost, treelet.cost], KEPT_GAIN)))
    });
    let built: Vec<Option<Treelet>> = built.collect::<Result<_, _>>()?;
    let mut gain = 0.0;
    for (&root, treelet) in chosen.iter().zip(&built) {
        token.check()?;
        if let Some(treelet) = treelet {
            treelet.write(&mut tree.nodes, root);
            gain += weights[root as usize].cost - treelet.cost;
        }
    }
    Ok(gain)
}

/// A subtree that was built again.
struct Treelet {
    tree: TopDown,
    /// Where the pairs of siblings of the old one stand: as many as it needs.
    places: Vec<u32>,
    cost: f32,
}

impl Treelet {
    /// Puts it in the place of the old one.
    fn write(&self, nodes: &mut [Node<Aabb>], root: u32) {
        nodes[root as usize].first = self.places[0];
        for (pair, &first) in self.tree.pairs.iter().zip(&self.places) {
            for (item, at) in pair.iter().zip(first as usize..) {
                nodes[at] = node_of(item, |pair| self.places[pair as usize]);
            }
        }
    }
}

/// Pairs that one task writes.
const CHUNK: usize = 4096;

/// Puts a whole tree in the place of the old one, depth first.
fn write_whole(tree: &mut Tree<Aabb>, new: &TopDown, token: &CancelToken) -> Result<(), Cancelled> {
    tree.nodes[0].first = 1;
    tree.nodes.truncate(1 + 2 * new.pairs.len());
    tree.nodes[1..].par_chunks_mut(2 * CHUNK).zip(new.pairs.par_chunks(CHUNK)).try_for_each(|(nodes, pairs)| {
        token.check()?;
        for (node, item) in nodes.iter_mut().zip(pairs.as_flattened()) {
            *node = node_of(item, |pair| 1 + 2 * pair);
        }
        Ok(())
    })
}

struct Job<'a> {
    nodes: &'a [Node<Aabb>],
    weights: &'a [Weight],
    builder: Builder<'a>,
}

impl Job<'_> {
    /// The subtree under `root` built again; `None` where there is only one tree over its leaves.
    fn treelet(&self, root: u32) -> Result<Option<Treelet>, Cancelled> {
        let Leaves { mut items, places } = Leaves::below(self.nodes, root);
        if items.len() < 3 {
            return Ok(None);
        }
        let mut tree = TopDown::default();
        let below = self.builder.build(&mut items, self.item(root), &mut tree)?;
        Ok(Some(Treelet { tree, places, cost: self.cost(root, below) }))
    }

    /// The whole tree, which consists of the treelets under `roots` and what is above, built again.
    fn whole(&self, roots: &[u32]) -> Result<Option<Treelet>, Cancelled> {
        let token = self.builder.token;
        let parts = roots.par_iter().map(|&root| {
            token.check()?;
            Ok(Leaves::below(self.nodes, root))
        });
        let parts: Vec<Leaves> = parts.collect::<Result<_, _>>()?;
        let mut items: Vec<Item> = zeros(parts.iter().map(|part| part.items.len()).sum(), token)?;
        let (mut targets, mut rest) = (Vec::with_capacity(parts.len()), &mut items[..]);
        for part in parts {
            let own;
            (own, rest) = rest.split_at_mut(part.items.len());
            targets.push((own, part));
        }
        targets.into_par_iter().try_for_each(|(own, part)| {
            token.check()?;
            own.copy_from_slice(&part.items);
            Ok(())
        })?;
        if items.len() < 3 {
            return Ok(None);
        }
        let mut tree = TopDown::default();
        let below = self.builder.build(&mut items, self.item(0), &mut tree)?;
        Ok(Some(Treelet { tree, places: Vec::new(), cost: self.cost(0, below) }))
    }

    fn item(&self, root: u32) -> Item {
        Item::new(&self.nodes[root as usize].container, self.weights[root as usize].count, NEW)
    }

    /// SAH cost of `root` over children that cost `below`.
    fn cost(&self, root: u32, below: f32) -> f32 {
        let area = self.nodes[root as usize].container.half_area();
        joined_cost(area, self.weights[root as usize].count, below, self.builder.collapses).0
    }
}
