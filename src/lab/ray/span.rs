//! The containers that a ray enters, and which visits were worth it.

use std::collections::HashMap;

use super::chord::chord;
use super::step::{RayStep, Step};
use super::tree_nodes::TreeNodes;
use crate::accel::Accel;
use bvhscope_engine::geometry::Ray;
use bvhscope_engine::tree::traverse::{RayEvent, TestCounts};

/// Fate of a container that a ray enters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Visit {
    /// Visited, and a hit that was the nearest until then was found in it.
    Useful,
    /// Visited without finding anything nearer.
    Wasted,
    /// Never visited: it begins behind a hit that was found before, or a hit ended the ray.
    Skipped,
}

impl Visit {
    /// The name in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Useful => "useful",
            Self::Wasted => "wasted",
            Self::Skipped => "skipped",
        }
    }
}

/// The part of a ray in a container.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// The node of the traversed tree, as [`RayEvent`] names it.
    pub node: u32,
    /// The node of the tree whose container it is.
    pub tree_node: u32,
    /// It is a leaf of the traversed tree.
    pub is_leaf: bool,
    /// Depth in the traversed tree, root 0.
    pub depth: u32,
    /// Distances at which the ray enters and leaves it.
    pub t: [f32; 2],
    /// Index of the step in which it was entered.
    pub entered: usize,
    /// Index of the step in which it was visited.
    pub visited: Option<usize>,
    /// Its fate.
    pub visit: Visit,
    /// The span of its parent.
    parent: Option<usize>,
}

/// Turns recorded steps into [`RayStep`]s and [`Span`]s.
pub(super) struct Spans<'a> {
    accel: &'a Accel,
    ray: &'a Ray,
    nodes: TreeNodes<'a>,
    /// The spans so far.
    found: Vec<Span>,
    /// The span of each node that was entered since the ray began.
    of_node: HashMap<u32, usize>,
    /// The span of the node that is visited.
    current: Option<usize>,
    waiting: u32,
    nearest: f32,
}

impl<'a> Spans<'a> {
    pub(super) fn new(accel: &'a Accel, ray: &'a Ray, is_wide: bool) -> Self {
        Self {
            accel,
            ray,
            nodes: TreeNodes::new(accel, is_wide),
            found: Vec::new(),
            of_node: HashMap::new(),
            current: None,
            waiting: 0,
            nearest: f32::INFINITY,
        }
    }

    /// All spans.
    pub(super) fn finish(self) -> Vec<Span> {
        self.found
    }

    /// Follows step number `index`.
    pub(super) fn follow(&mut self, index: usize, what: Step, counts: TestCounts) -> RayStep {
        let span = match what {
            Step::Again { .. } => {
                (self.waiting, self.nearest, self.current) = (0, f32::INFINITY, None);
                self.of_node.clear();
                None
            }
            Step::Event(event) => self.follow_event(index, event),
        };
        let (tree_node, depth) = match (span, what) {
            (Some(span), _) => (self.found[span].tree_node, self.found[span].depth),
            (None, Step::Event(RayEvent::Miss { node })) => (self.nodes.of(node), self.child_depth()),
            (None, _) => (0, 0),
        };
        let (waiting, nearest) = (self.waiting, self.nearest);
        RayStep { what, tree_node, depth, counts, waiting, nearest, span: span.map(|span| span as u32) }
    }

    /// Returns the span that the event is about.
    fn follow_event(&mut self, index: usize, event: RayEvent) -> Option<usize> {
        match event {
            RayEvent::Enter { node, t } => Some(self.enter(index, node, Some(t))),
            RayEvent::Miss { .. } => None,
            RayEvent::Cull { node, .. } => self.of_node.get(&node).copied(),
            RayEvent::Push { node } => {
                self.waiting += 1;
                self.of_node.get(&node).copied()
            }
            RayEvent::Pop { node } => {
                self.waiting = self.waiting.saturating_sub(1);
                self.of_node.get(&node).copied()
            }
            RayEvent::Visit { node } => {
                // A root whose container is not tested is entered by its visit.
                let span = self.of_node.get(&node).copied().unwrap_or_else(|| self.enter(index, node, None));
                self.found[span].visited = Some(index);
                self.found[span].visit = Visit::Wasted;
                self.current = Some(span);
                self.nodes.visit(node);
                self.current
            }
            RayEvent::Triangle { .. } => self.current,
            RayEvent::Nearer { t } => {
                self.nearest = t;
                let mut above = self.current;
                while let Some(span) = above {
                    self.found[span].visit = Visit::Useful;
                    above = self.found[span].parent;
                }
                self.current
            }
        }
    }

    fn child_depth(&self) -> u32 {
        self.current.map_or(0, |span| self.found[span].depth + 1)
    }

    fn enter(&mut self, index: usize, node: u32, t: Option<f32>) -> usize {
        let tree_node = self.nodes.of(node);
        let inside = chord(&self.accel.tree, tree_node, self.ray);
        // The traversal's containers are a little larger, so that rounding loses no hit.
        let near = t.or(inside.map(|[near, _]| near)).unwrap_or_else(|| self.ray.t_min.max(0.0));
        let far = inside.map_or(near, |[_, far]| far.max(near));
        let span = self.found.len();
        self.found.push(Span {
            node,
            tree_node,
            is_leaf: self.nodes.is_leaf(node),
            depth: self.child_depth(),
            t: [near, far],
            entered: index,
            visited: None,
            visit: Visit::Skipped,
            parent: self.current,
        });
        self.of_node.insert(node, span);
        span
    }
}
