//! Restructuring: agglomerative clustering merges what is close, which on scans is worse than splitting from the top, on
//! architecture far better. So a sample of treelets is built again from the top; where that pays on the whole, so is the
//! tree, otherwise the treelets of those neighbourhoods where it pays, each kept only where it is cheaper.

mod item;
mod split;
mod split_large;
mod topdown;
mod treelets;

use rayon::prelude::*;

use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Aabb;
use crate::kernel::par_collect::zeros;
use crate::optimize::restructure::item::{Item, NEW};
use crate::optimize::restructure::topdown::Builder;
use crate::optimize::restructure::treelets::{Subtree, gather, treelets};
use crate::optimize::sah::joined_cost;
use crate::optimize::subtree_costs::Weight;
use crate::tree::{Node, Tree};

/// So many treelets are built to see whether it pays for their neighbours, where there are more.
const SAMPLES: usize = 20;
/// Least neighbours, one of which is built.
const NEIGHBOURS: usize = 8;
/// Share of its cost that a sample must gain to pay, and its neighbours to be built.
const SAMPLE_GAIN: f32 = 0.01;
/// One in so many samples may fail to pay where the whole tree is built again: of scans one in five does at most, of architecture
/// mostly half.
const MAY_FAIL: usize = 4;
/// Share of its cost that what is kept must gain: less is rounding.
const KEPT_GAIN: f32 = 1e-5;
/// Most nodes: links have a bit for other things.
const MAX_NODES: usize = NEW as usize;

/// Builds treelets of `tree`, whose nodes have `weights`, or all of it again. The nodes then stand in any order, siblings
/// together. Returns by how much the SAH cost falls.
pub fn restructure(
    tree: &mut Tree<Aabb>,
    weights: Vec<Weight>,
    collapses: bool,
    token: &CancelToken,
) -> Result<f32, Cancelled> {
    if tree.nodes.len() > MAX_NODES {
        return Ok(0.0);
    }
    let top = Subtree { root: 0, weight: weights[0] };
    let treelets = treelets(&tree.nodes, &weights);
    // As much memory as the leaves of the whole tree need.
    drop(weights);
    let job = Job { nodes: &tree.nodes, builder: Builder::new(collapses, token) };
    let neighbours = treelets.len().div_ceil(SAMPLES).max(NEIGHBOURS);
    let samples = treelets.par_chunks(neighbours).map(|group| {
        let old = &group[group.len() / 2];
        Ok([old.weight.cost, job.again(old)?.map_or(old.weight.cost, |new| new.cost)])
    });
    let samples: Vec<[f32; 2]> = samples.collect::<Result<_, _>>()?;
    let gains = |[old, new]: [f32; 2], share: f32| new < old * (1.0 - share);
    let failed = samples.iter().filter(|&&sample| !gains(sample, SAMPLE_GAIN)).count();
    if failed <= samples.len() / MAY_FAIL
        && let Some((nodes, cost)) = job.whole(&top, &treelets)?
        && gains([top.weight.cost, cost], KEPT_GAIN)
    {
        tree.nodes = nodes;
        return Ok(top.weight.cost - cost);
    }

    let pays = |at: usize| gains(samples[at / neighbours], SAMPLE_GAIN);
    let chosen: Vec<&Subtree> = treelets.iter().enumerate().filter(|&(at, _)| pays(at)).map(|(_, old)| old).collect();
    let built = chosen.par_iter().map(|old| {
        let new = job.again(old)?;
        Ok(new.filter(|new| gains([old.weight.cost, new.cost], KEPT_GAIN)))
    });
    let built: Vec<Option<Treelet>> = built.collect::<Result<_, _>>()?;
    let mut gain = 0.0;
    for (old, new) in chosen.into_iter().zip(&built) {
        token.check()?;
        if let Some(new) = new {
            new.write(&mut tree.nodes, old.root);
            gain += old.weight.cost - new.cost;
        }
    }
    Ok(gain)
}

/// A subtree that was built again.
struct Treelet {
    /// What is below its root, which is numbered from 0 on.
    nodes: Vec<Node<Aabb>>,
    /// Where the pairs of siblings of the old one stand: as many as it needs.
    places: Vec<u32>,
    cost: f32,
}

impl Treelet {
    /// Puts it in the place of the old one.
    fn write(&self, nodes: &mut [Node<Aabb>], root: u32) {
        nodes[root as usize].first = self.places[0];
        for (pair, &place) in self.nodes.as_chunks::<2>().0.iter().zip(&self.places) {
            for (node, at) in pair.iter().zip(place as usize..) {
                let first = if node.is_leaf() { node.first } else { self.places[node.first as usize / 2] };
                nodes[at] = Node { first, ..*node };
            }
        }
    }
}

/// All nodes of a tree, and its SAH cost.
type Whole = (Vec<Node<Aabb>>, f32);

struct Job<'a> {
    nodes: &'a [Node<Aabb>],
    builder: Builder<'a>,
}

impl Job<'_> {
    /// `old` built again; `None` where there is only one tree over its leaves.
    fn again(&self, old: &Subtree) -> Result<Option<Treelet>, Cancelled> {
        let leaves = old.weight.leaves as usize;
        if leaves < 3 {
            return Ok(None);
        }
        let mut items = bytemuck::zeroed_vec(leaves);
        let mut places = Vec::with_capacity(leaves - 1);
        gather(self.nodes, old.root, &mut items, &mut places);
        let mut nodes = bytemuck::zeroed_vec(2 * (leaves - 1));
        let below = self.builder.build(&mut items, self.item(old), &mut nodes, 0)?;
        Ok(Some(Treelet { nodes, places, cost: self.cost(old, below) }))
    }

    /// The whole tree `old`, which consists of `treelets` and what is above them, built again, with its cost.
    fn whole(&self, old: &Subtree, treelets: &[Subtree]) -> Result<Option<Whole>, Cancelled> {
        let leaves = old.weight.leaves as usize;
        if leaves < 3 {
            return Ok(None);
        }
        let mut items: Vec<Item> = zeros(leaves, self.builder.token)?;
        let (mut targets, mut rest) = (Vec::with_capacity(treelets.len()), &mut items[..]);
        for treelet in treelets {
            let own;
            (own, rest) = rest.split_at_mut(treelet.weight.leaves as usize);
            targets.push((treelet.root, own));
        }
        targets.into_par_iter().try_for_each_init(Vec::new, |places, (root, items)| {
            self.builder.token.check()?;
            gather(self.nodes, root, items, places);
            Ok(())
        })?;
        let mut nodes = zeros(2 * leaves - 1, self.builder.token)?;
        let below = self.builder.build(&mut items, self.item(old), &mut nodes[1..], 1)?;
        nodes[0] = Node { first: 1, ..self.nodes[0] };
        Ok(Some((nodes, self.cost(old, below))))
    }

    fn item(&self, subtree: &Subtree) -> Item {
        Item::new(&self.nodes[subtree.root as usize].container, subtree.weight.count, NEW)
    }

    /// SAH cost of `subtree` where what is below its root costs `below`.
    fn cost(&self, subtree: &Subtree, below: f32) -> f32 {
        let area = self.nodes[subtree.root as usize].container.half_area();
        joined_cost(area, subtree.weight.count, below, self.builder.collapses).0
    }
}
