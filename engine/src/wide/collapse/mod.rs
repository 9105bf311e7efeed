//! From the binary tree to the wide one.
//!
//! Bottom-up, each subtree learns what it costs at least by the surface area heuristic, as a leaf or under at most one, two, up
//! to eight roots; top-down, each wide node takes the cheapest eight roots of its subtree (Ylitie, Karras, Laine: *Efficient
//! Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs*, 2017, section 3). The second half is shared out by subtrees,
//! the same ones for any number of threads: first each task lays out its part, then, when the parts' places are known, all is
//! written once.

mod cost;
mod decision;
mod emit;
mod optimal;

use rayon::prelude::*;

use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Triangle;
use crate::kernel::prefetch::prefetch;
use crate::tree::Tree;
use crate::wide::block::TriangleBlock;
use crate::wide::bounds::WideContainer;
use crate::wide::collapse::emit::{Lane, Opener, Part};
use crate::wide::collapse::optimal::choices;
use crate::wide::layout::WIDTH;
use crate::wide::tree::{Child, WideNode, WideTree};

/// Binary nodes for each wide node at the top, which one thread makes, and how many of these there are at most. Each leaves some
/// four tasks.
const TASK_NODES: usize = 16_384;
const MAX_TOP_NODES: usize = 512;

/// Nodes and blocks that a thread writes between two looks at the token: 20 ms where the triangles lie far apart.
const NODES_BETWEEN_CHECKS: usize = 1 << 12;
const BLOCKS_BETWEEN_CHECKS: usize = 1 << 14;
/// Nodes or blocks that a thread writes at least before it looks for other work.
const WRITTEN_AT_ONCE: usize = 256;
/// Blocks between the one that is written and the one whose triangles are asked for.
const FETCHED_AHEAD: usize = 8;
/// Nodes between the one that is written and the one whose containers are asked for.
const NODES_AHEAD: usize = 4;

/// The wide tree of a binary one of `triangles`. Any number of threads gives the same tree.
pub fn collapse<C: WideContainer>(
    tree: &Tree<C>,
    triangles: &[Triangle],
    token: &CancelToken,
) -> Result<WideTree<C>, Cancelled> {
    if tree.nodes.is_empty() {
        return Ok(WideTree { root: None, nodes: Vec::new(), blocks: Vec::new() });
    }
    let choices = choices(tree, token)?;
    let opener = Opener { tree, choices: &choices };
    let (top, tasks) = opener.top((tree.nodes.len() / TASK_NODES).min(MAX_TOP_NODES));
    let top_nodes = top.nodes.len();
    let parts = tasks.par_iter().map(|&root| opener.part(root, token));
    let parts: Vec<Part> = parts.collect::<Result<_, Cancelled>>()?;
    let parts: Vec<Part> = std::iter::once(top).chain(parts).collect();

    // Each part's nodes and blocks follow those of the part before.
    let mut places = vec![Place { node: 0, block: 0 }];
    for (part, before) in parts.iter().zip(0..) {
        let Place { node, block } = places[before];
        places.push(Place { node: node + part.nodes.len(), block: block + part.blocks.len() });
    }
    let [.., Place { node: node_count, block: block_count }] = places[..] else {
        unreachable!("there is one at least")
    };

    // Written once, by all threads: getting new memory takes as long as filling it, and so they share that work too.
    let nodes = written(node_count, NODES_BETWEEN_CHECKS, token, |part, index| {
        if index < top_nodes {
            let below = |child: Child| match child.index().checked_sub(top_nodes) {
                Some(task) if !child.is_leaf() => Child::node(places[task + 1].node),
                _ => child,
            };
            return wide_node(tree, &parts[0].nodes[index], below);
        }
        let place = Place::find(&places, part, |place| place.node, index);
        let plans = &parts[*part].nodes[index - place.node..];
        if let Some(ahead) = plans.get(NODES_AHEAD) {
            for lane in ahead {
                prefetch(&tree.nodes, lane.node as usize);
            }
        }
        wide_node(tree, &plans[0], |child| place.moved(child))
    })?;
    let blocks = written(block_count, BLOCKS_BETWEEN_CHECKS, token, |part, index| {
        let place = Place::find(&places, part, |place| place.block, index);
        let plans = &parts[*part].blocks[index - place.block..];
        if let Some(ahead) = plans.get(FETCHED_AHEAD) {
            ahead.slots().for_each(|slot| prefetch(triangles, tree.primitive_indices[slot] as usize));
        }
        TriangleBlock::new(triangles, &tree.primitive_indices[plans[0].slots()], plans[0].is_last)
    })?;
    let root = if node_count == 0 { Child::leaf(0) } else { Child::node(0) };
    token.check()?;
    Ok(WideTree { root: Some(root), nodes, blocks })
}

/// A list of what `write` gives for 0 to `count`, written by all threads, which look at the token after `between_checks` each.
/// `write` also gets a number of its own, 0 at first.
fn written<T: Send>(
    count: usize,
    between_checks: usize,
    token: &CancelToken,
    write: impl Fn(&mut usize, usize) -> T + Sync,
) -> Result<Vec<T>, Cancelled> {
    let mut list = Vec::with_capacity(count);
    let at_once = between_checks * rayon::current_num_threads();
    for start in (0..count).step_by(at_once) {
        token.check()?;
        let portion = start..count.min(start + at_once);
        list.par_extend(portion.into_par_iter().with_min_len(WRITTEN_AT_ONCE).map_init(|| 0, &write));
    }
    Ok(list)
}

/// Where a part's nodes and blocks begin.
#[derive(Clone, Copy)]
struct Place {
    node: usize,
    block: usize,
}

impl Place {
    /// The place of the part that holds number `index` of what `start` counts. `part` is where it was found last.
    #[inline(always)]
    fn find(places: &[Self], part: &mut usize, start: impl Fn(&Self) -> usize, index: usize) -> Self {
        if !(start(&places[*part])..start(&places[*part + 1])).contains(&index) {
            *part = places.partition_point(|place| start(place) <= index) - 1;
        }
        places[*part]
    }

    fn moved(self, child: Child) -> Child {
        if child.is_leaf() { Child::leaf(child.index() + self.block) } else { Child::node(child.index() + self.node) }
    }
}

/// The wide node of these lanes, whose children are moved to where their parts are.
#[inline(always)]
fn wide_node<C: WideContainer>(
    tree: &Tree<C>,
    lanes: &[Lane; WIDTH],
    moved: impl Fn(Child) -> Child,
) -> WideNode<C::Bounds> {
    let mut node = WideNode { bounds: C::NOTHING, children: [Child::node(0); WIDTH] };
    for (lane, &Lane { node: from, child }) in lanes.iter().enumerate() {
        if from == Lane::NONE.node {
            break;
        }
        tree.nodes[from as usize].container.store(&mut node.bounds, lane);
        node.children[lane] = moved(child);
    }
    node
}
