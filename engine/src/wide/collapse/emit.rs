//! Plans wide nodes and leaves from the decisions for the binary nodes.

use crate::cancel::{CancelToken, Cancelled, HEAVY_STEPS};
use crate::tree::Tree;
use crate::wide::bounds::WideContainer;
use crate::wide::child::{Child, LeafRange};
use crate::wide::collapse::decision::{DecidedNode, DecisionRef, Decisions};
use crate::wide::collapse::visit_order::lanes_by;
use crate::wide::layout::WIDTH;

/// A lane of a planned wide node.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlannedChild {
    /// Index of the binary node whose container the lane holds.
    pub(crate) node: u32,
    /// Reference to the child within the segment.
    pub(crate) child: Child,
}

impl PlannedChild {
    /// An unused lane: the root is never a child.
    pub(crate) const NONE: Self = Self { node: 0, child: Child(0) };
}

/// A planned wide node; unused lanes come last.
pub(crate) type PlannedNode = [PlannedChild; WIDTH];

/// A planned segment of the wide tree; indices are relative to its start.
#[derive(Debug, Default)]
pub(crate) struct Segment {
    /// Full nodes and compact ones, in each list parents first.
    pub(crate) nodes: [Vec<PlannedNode>; 2],
    /// The first node; any other value where the segment is a leaf.
    pub(crate) root: Child,
    /// Leaves in the order of the nodes.
    pub(crate) leaves: Vec<LeafRange>,
    /// Those of them that a [`Child`] cannot describe by itself.
    pub(crate) long: Vec<LeafRange>,
}

/// The binary tree and the decisions for its nodes.
#[derive(Clone, Copy)]
pub(crate) struct Emitter<'a, C> {
    pub(crate) tree: &'a Tree<C>,
    pub(crate) decisions: &'a Decisions,
}

/// A binary node on the stack, and the number of lanes that it may take.
#[derive(Debug, Clone, Copy, Default)]
struct OpenNode {
    node: DecidedNode,
    lanes: u32,
}

impl<C: WideContainer> Emitter<'_, C> {
    /// The children of the wide node that replaces a binary one, from left to right, their number, and their lanes.
    #[inline(always)]
    fn children_of(self, root: DecisionRef) -> ([DecidedNode; WIDTH], usize, [u32; WIDTH]) {
        let mut children = [DecidedNode::default(); WIDTH];
        let mut count = 0;
        // A stack, left child on top.
        let mut open = [OpenNode::default(); WIDTH];
        open[0] = OpenNode { node: DecidedNode::new(0, root, 0), lanes: WIDTH as u32 };
        let mut len = 1;
        while len > 0 {
            len -= 1;
            let OpenNode { node, lanes } = open[len % WIDTH];
            if lanes > 1 && !node.decision.is_leaf() {
                let decision = self.decisions.get(node.decision);
                let left = decision.left_lanes(lanes);
                if left > 0 {
                    let [left_child, right_child] = decision.children();
                    open[len % WIDTH] = OpenNode { node: right_child, lanes: lanes - left };
                    open[(len + 1) % WIDTH] = OpenNode { node: left_child, lanes: left };
                    len += 2;
                    continue;
                }
            }
            children[count % WIDTH] = node;
            count += 1;
        }
        let mut order = [u32::MAX; WIDTH];
        for (order, child) in order.iter_mut().zip(&children[..count % (WIDTH + 1)]) {
            *order = child.hits_per_cost.into();
        }
        (children, count, lanes_by(&order))
    }

    /// Plans a node, whose leaves are appended; `child` gives the reference to a child that is a node.
    #[inline(always)]
    fn plan(
        self,
        segment: &mut Segment,
        children: &[DecidedNode],
        lanes: &[u32; WIDTH],
        mut child: impl FnMut(DecisionRef) -> Child,
    ) -> PlannedNode {
        let mut planned = [PlannedChild::NONE; WIDTH];
        for (node, lane) in children.iter().zip(lanes) {
            let child = if node.decision.is_leaf() { self.leaf(segment, *node) } else { child(node.decision) };
            planned[*lane as usize % WIDTH] = PlannedChild { node: node.node, child };
        }
        planned
    }

    /// Appends a leaf.
    #[inline(always)]
    fn leaf(self, segment: &mut Segment, node: DecidedNode) -> Child {
        let first = node.decision.first();
        segment.leaf(LeafRange { first, count: node.primitives(|node| self.tree.nodes[node as usize].count) })
    }

    /// Plans up to `max_nodes` wide nodes from the root, breadth first, all of them full. Also returns the binary nodes that are to be
    /// replaced by further wide nodes; references to these count on from the planned nodes.
    pub(crate) fn top(self, max_nodes: usize) -> (Segment, Vec<DecisionRef>) {
        let mut segment = Segment::default();
        let root = self.decisions.root;
        if root.decision.is_leaf() {
            self.leaf(&mut segment, root);
            return (segment, Vec::new());
        }
        let mut roots = vec![root.decision];
        let mut nodes = Vec::new();
        while nodes.len() < max_nodes.min(roots.len()) {
            let (children, count, lanes) = self.children_of(roots[nodes.len()]);
            let node = |decision: DecisionRef| {
                roots.push(decision);
                Child::node(roots.len() - 1, false)
            };
            nodes.push(self.plan(&mut segment, &children[..count], &lanes, node));
        }
        roots.drain(..nodes.len());
        segment.nodes[0] = nodes;
        (segment, roots)
    }

    /// Slot of the first triangle below a node.
    pub(crate) fn first_slot(self, mut decision: DecisionRef) -> u32 {
        while !decision.is_leaf() {
            decision = self.decisions.get(decision).children()[0].decision;
        }
        decision.first()
    }

    /// Plans the wide node that replaces a binary one and everything below it, depth first.
    pub(crate) fn segment(self, root: DecisionRef, token: &CancelToken) -> Result<Segment, Cancelled> {
        let mut segment = Segment::default();
        // Stack of binary nodes to replace, with the node and lane that refer to each.
        let mut open: Vec<(DecisionRef, Option<Child>, usize)> = vec![(root, None, 0)];
        while let Some((root, parent, lane)) = open.pop() {
            let [full, compact] = segment.nodes.each_ref().map(Vec::len);
            token.check_every(HEAVY_STEPS, full + compact)?;
            let form = usize::from(self.decisions.get(root).is_compact());
            let at = Child::node(segment.nodes[form].len(), form == 1);
            match parent {
                Some(parent) => segment.nodes[usize::from(parent.is_compact())][parent.index()][lane].child = at,
                None => segment.root = at,
            }
            let (children, count, lanes) = self.children_of(root);
            let planned = self.plan(&mut segment, &children[..count], &lanes, |_| Child::ROOT);
            segment.nodes[form].push(planned);
            for (child, lane) in children[..count].iter().zip(lanes).rev() {
                if !child.decision.is_leaf() {
                    self.decisions.prefetch(child.decision);
                    open.push((child.decision, Some(at), lane as usize % WIDTH));
                }
            }
        }
        Ok(segment)
    }
}

impl Segment {
    #[inline(always)]
    fn leaf(&mut self, range: LeafRange) -> Child {
        self.leaves.push(range);
        Child::leaf(range).unwrap_or_else(|| {
            self.long.push(range);
            Child::long_leaf(self.long.len() - 1)
        })
    }
}
