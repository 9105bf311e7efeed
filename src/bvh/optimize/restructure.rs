//! Restructuring: agglomerative clustering merges what is close, which on scans is worse than splitting from the top, on
//! architecture far better. So treelets are built again by the surface area heuristic from the top, small ones first,
//! then the whole tree, and each is kept only where it is cheaper.

use rayon::prelude::*;

use super::below::{Below, below, of};
use super::sweep::{self, Cluster};
use crate::bvh::{Container, Node};
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Aabb;

/// Sizes in primitives of the treelets that are built again, one after the other; the whole tree comes last.
const LEVELS: [u32; 2] = [4096, u32::MAX];
/// Share of its cost by which a treelet must become cheaper: less is rounding.
const MIN_GAIN: f32 = 1e-5;

/// Builds treelets of the tree again. `nodes` may stand in any order, siblings together, before and after.
pub fn restructure(nodes: &mut [Node<Aabb>], token: &CancelToken) -> Result<(), Cancelled> {
    let mut all = below(nodes);
    for size in LEVELS {
        // The largest subtrees of at most this size, and what is above them.
        let (mut roots, mut above, mut open) = (Vec::new(), Vec::new(), vec![0_u32]);
        while let Some(at) = open.pop() {
            let node = &nodes[at as usize];
            if all[at as usize].primitives <= size {
                roots.push(at);
            } else if !node.is_leaf() {
                above.push(at);
                open.extend([node.first + 1, node.first]);
            }
        }
        let cheaper: Vec<Option<Treelet>> = roots
            .par_iter()
            .map(|&at| {
                token.check()?;
                Ok(Treelet::cheaper(nodes, &all, at))
            })
            .collect::<Result<_, _>>()?;
        for treelet in cheaper.into_iter().flatten() {
            treelet.write(nodes, &mut all);
        }
        for &at in above.iter().rev() {
            all[at as usize] = of(nodes, &all, at as usize);
        }
    }
    Ok(())
}

/// A subtree that was built again.
struct Treelet {
    /// Where its root stands.
    root: u32,
    top: Cluster,
    /// The parts of each new cluster.
    slots: Vec<[Cluster; 2]>,
    /// Where pairs of siblings stand.
    pairs: Vec<u32>,
    /// What the given clusters stand for.
    given: Vec<(Node<Aabb>, Below)>,
}

impl Treelet {
    /// The subtree under `root` built from the top; `None` where that is no cheaper.
    fn cheaper(nodes: &[Node<Aabb>], all: &[Below], root: u32) -> Option<Self> {
        let (mut clusters, mut given, mut pairs) = (Vec::new(), Vec::new(), Vec::new());
        let mut open = vec![root];
        while let Some(at) = open.pop() {
            let (node, below) = (nodes[at as usize], all[at as usize]);
            // What becomes one leaf needs no tree.
            if node.is_leaf() || below.is_best_as_leaf(node.container.relative_area()) {
                clusters.push(Cluster::given(&node.container, below, given.len() as u32));
                given.push((node, below));
            } else {
                pairs.push(node.first);
                open.extend([node.first + 1, node.first]);
            }
        }
        let [first, _, _, ..] = clusters[..] else { return None };
        let mut slots = vec![[first; 2]; pairs.len()];
        let top = sweep::build(&mut clusters, &mut slots, 0, 0);
        if top.below.cost >= all[root as usize].cost * (1.0 - MIN_GAIN) {
            return None;
        }
        pairs.sort_unstable();
        Some(Self { root, top, slots, pairs, given })
    }

    /// Puts it in the place of the old one.
    fn write(&self, nodes: &mut [Node<Aabb>], all: &mut [Below]) {
        let mut open = vec![(self.top, self.root)];
        while let Some((cluster, at)) = open.pop() {
            let link = cluster.link as usize;
            let (node, below) = if cluster.new {
                let first = self.pairs[link];
                let [left, right] = self.slots[link];
                open.extend([(right, first + 1), (left, first)]);
                (Node { container: cluster.bounds.container(), first, count: 0 }, cluster.below)
            } else {
                self.given[link]
            };
            (nodes[at as usize], all[at as usize]) = (node, below);
        }
    }
}
