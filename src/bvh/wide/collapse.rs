//! From the binary tree to the wide one.
//!
//! Bottom-up, each subtree learns what it costs at least by the surface area heuristic, as a leaf or under at most one, two, up
//! to eight roots; top-down, each wide node takes the cheapest eight roots of its subtree (Ylitie, Karras, Laine: *Efficient
//! Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs*, 2017, section 3). The work is shared out by subtrees, the
//! same ones for any number of threads: first each task decides what its part looks like, then, when the parts' places are
//! known, all is written once.

use std::collections::{HashMap, VecDeque};

use rayon::prelude::*;

use super::opening::{Lane, Look, Part, Spot, Subtree, children_of};
use super::prefetch::prefetch;
use super::{Child, TriangleBlock, WIDTH, WideContainer, WideNode, WideTree};
use crate::bvh::{Node, Tree};
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Triangle;

/// Binary nodes that one task gets on average, and how many tasks there are at most.
const TASK_NODES: usize = 4096;
const MAX_TASKS: usize = 1024;

/// Nodes or blocks that a thread writes between two looks at the token: 20 ms where the triangles lie far apart.
const WRITTEN_BETWEEN_CHECKS: usize = 1 << 14;
/// Nodes or blocks that a thread writes at least before it looks for other work.
const WRITTEN_AT_ONCE: usize = 256;
/// Blocks between the one that is written and the one whose triangles are asked for.
const FETCHED_AHEAD: usize = 8;

/// The wide tree of a binary one of `triangles`. Any number of threads gives the same tree.
pub fn collapse<C: WideContainer>(
    tree: &Tree<C>,
    triangles: &[Triangle],
    token: &CancelToken,
) -> Result<WideTree<C>, Cancelled> {
    if tree.nodes.is_empty() {
        return Ok(WideTree { root: None, nodes: Vec::new(), blocks: Vec::new() });
    }
    let (top, tasks) = share_out(tree);
    let subtrees: Vec<Subtree> =
        tasks.par_iter().map(|&root| Subtree::to_leaves(tree, root, token)).collect::<Result<_, Cancelled>>()?;
    let (top, top_subtree) = Top::new(tree, &top, &tasks, &subtrees, token)?;
    let parts: Vec<Part> = subtrees
        .into_par_iter()
        .chain(top_subtree.into_par_iter())
        .zip(&top.starts)
        .map(|(subtree, starts)| token.check().and_then(|()| subtree.open(tree, starts, token)))
        .collect::<Result<_, Cancelled>>()?;

    // Each part's nodes and blocks follow those of the part before; the top's nodes stand first.
    let (mut node_count, mut block_count) = (top.nodes.len(), 0);
    let mut places = Vec::with_capacity(parts.len() + 1);
    for part in &parts {
        places.push(Place { node: node_count, block: block_count });
        node_count += part.nodes.len();
        block_count += part.blocks.len();
    }
    places.push(Place { node: node_count, block: block_count });
    let start_at = |at: usize| {
        let (part, start) = top.numbers[at];
        places[part].moved(parts[part].roots[start])
    };

    // Written once, by all threads: getting new memory takes as long as filling it, and so they share that work too.
    let nodes = written(node_count, token, |part, index| {
        if index < top.nodes.len() {
            let moved = |child: Child| if child.is_leaf() { start_at(child.index()) } else { child };
            return wide_node(tree, &top.nodes[index], moved);
        }
        let place = Place::find(&places, part, |place| place.node, index);
        wide_node(tree, &parts[*part].nodes[index - place.node], |child| place.moved(child))
    })?;
    let blocks = written(block_count, token, |part, index| {
        let place = Place::find(&places, part, |place| place.block, index);
        let plans = &parts[*part].blocks[index - place.block..];
        if let Some(ahead) = plans.get(FETCHED_AHEAD) {
            ahead.slots().for_each(|slot| prefetch(triangles, tree.primitive_indices[slot] as usize));
        }
        TriangleBlock::new(triangles, &tree.primitive_indices[plans[0].slots()], plans[0].is_last)
    })?;
    let root = if top.nodes.is_empty() { start_at(0) } else { Child::node(0) };
    token.check()?;
    Ok(WideTree { root: Some(root), nodes, blocks })
}

/// A list of what `write` gives for 0 to `count`, written by all threads. `write` also gets a number of its own, 0 at first.
fn written<T: Send>(
    count: usize,
    token: &CancelToken,
    write: impl Fn(&mut usize, usize) -> T + Sync,
) -> Result<Vec<T>, Cancelled> {
    let mut list = Vec::with_capacity(count);
    let at_once = WRITTEN_BETWEEN_CHECKS * rayon::current_num_threads();
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

/// The nodes at the top, breadth first, that no task looks at, and the roots of the tasks.
fn share_out<C: WideContainer>(tree: &Tree<C>) -> (Vec<u32>, Vec<u32>) {
    let top_nodes = (tree.nodes.len() / TASK_NODES).min(MAX_TASKS);
    let (mut top, mut tasks) = (Vec::new(), Vec::new());
    let mut open = VecDeque::from([0]);
    while let Some(index) = open.pop_front() {
        let node: &Node<C> = &tree.nodes[index as usize];
        if top.len() < top_nodes && !node.is_leaf() {
            top.push(index);
            open.extend([node.first, node.first + 1]);
        } else {
            tasks.push(index);
        }
    }
    (top, tasks)
}

/// The wide nodes that hold nodes of the top, and where they go over into the tasks' subtrees.
struct Top {
    /// The numbers of starts stand where blocks would.
    nodes: Vec<[Lane; WIDTH]>,
    /// For each start the number of its task, and its place among that task's starts.
    numbers: Vec<(usize, usize)>,
    /// Each task's starts, then those of the top itself, which become leaves.
    starts: Vec<Vec<Spot>>,
}

/// A node of the top, or in a task's subtree.
#[derive(Clone, Copy, Default)]
struct Placed {
    task: Option<usize>,
    spot: Spot,
}

impl Top {
    /// Also the top's own subtree.
    fn new<C: WideContainer>(
        tree: &Tree<C>,
        top: &[u32],
        tasks: &[u32],
        subtrees: &[Subtree],
        token: &CancelToken,
    ) -> Result<(Self, Option<Subtree>), Cancelled> {
        let mut wide = Self { nodes: Vec::new(), numbers: Vec::new(), starts: vec![Vec::new(); tasks.len() + 1] };
        if top.is_empty() {
            wide.start(0, subtrees[0].start());
            return Ok((wide, None));
        }
        let task_of: HashMap<u32, usize> = tasks.iter().enumerate().map(|(task, &root)| (root, task)).collect();
        let subtree = Subtree::new(tree, 0, |node| Some(subtrees[*task_of.get(&node)?].below(tree)), token)?;
        let into_task = |spot: Spot| match task_of.get(&spot.node) {
            Some(&task) if spot.is_end() => Placed { task: Some(task), spot: subtrees[task].start() },
            _ => Placed { task: None, spot },
        };
        let look = |place: Placed| {
            let subtree = place.task.map_or(&subtree, |task| &subtrees[task]);
            let Look { costs, children } = subtree.look(tree, place.spot);
            let children = children.map(|children| {
                children.map(|spot| if place.task.is_none() { into_task(spot) } else { Placed { spot, ..place } })
            });
            Look { costs, children }
        };
        let mut open = vec![(into_task(subtree.start()), None::<(usize, usize)>)];
        while let Some((place, parent)) = open.pop() {
            let at = wide.nodes.len();
            if let Some((node, lane)) = parent {
                wide.nodes[node][lane].child = Child::node(at);
            }
            let (places, count) = children_of(place, look);
            let mut lanes = [Lane::NONE; WIDTH];
            for (lane, &Placed { task, spot }) in places[..count].iter().enumerate() {
                let task = task.or(subtree.is_leaf(spot).then_some(tasks.len()));
                let child = task.map(|task| Child::leaf(wide.start(task, spot)));
                lanes[lane] = Lane { node: spot.node, child: child.unwrap_or_default() };
                if task.is_none() {
                    open.push((places[lane], Some((at, lane))));
                }
            }
            wide.nodes.push(lanes);
        }
        Ok((wide, Some(subtree)))
    }

    /// The number of a new start.
    fn start(&mut self, task: usize, spot: Spot) -> usize {
        self.numbers.push((task, self.starts[task].len()));
        self.starts[task].push(spot);
        self.numbers.len() - 1
    }
}

/// The wide node of these lanes, whose children are moved to where their parts are.
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
