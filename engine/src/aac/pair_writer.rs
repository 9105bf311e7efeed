//! Where merged clusters are written: the list of nodes.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use crate::aac::cluster::Cluster;
use crate::aac::cluster_container::ClusterContainer;
use crate::tree::Node;

/// Writes merged clusters to the list of nodes as pairs of siblings, from the end of a slice to its start, so that parents
/// precede their children.
pub struct PairWriter<'a, C> {
    /// The slice of the list of nodes that exactly holds the pairs.
    nodes: &'a mut [Node<C>],
    /// Index of the slice's first node in the whole list.
    offset: u32,
    /// Index in the slice of the first node that has been written.
    first_written: usize,
}

impl<'a, C: ClusterContainer> PairWriter<'a, C> {
    /// A writer to `nodes`, the first of which has the index `offset` in the whole list.
    pub fn new(nodes: &'a mut [Node<C>], offset: usize) -> Self {
        let first_written = nodes.len();
        Self { nodes, offset: offset as u32, first_written }
    }

    /// Writes two siblings and returns the index of the first in the whole list.
    #[inline(always)]
    pub fn push(&mut self, pair: &[Cluster<C>; 2]) -> u32 {
        self.push_if(true, pair)
    }

    /// [`Self::push`] if `is_merge`; otherwise the next pair overwrites this one. At least one pair must still be due.
    #[inline(always)]
    pub fn push_if(&mut self, is_merge: bool, pair: &[Cluster<C>; 2]) -> u32 {
        let start = self.first_written - 2;
        let nodes = &mut self.nodes[start..start + 2];
        for (node, cluster) in nodes.iter_mut().zip(pair) {
            *node = cluster.node();
        }
        self.first_written = if is_merge { start } else { self.first_written };
        self.offset + start as u32
    }

    /// Leaves the next pair as it is and returns the index of its first node in the whole list: where a merge was written before.
    pub fn skip(&mut self) -> u32 {
        self.first_written -= 2;
        self.offset + self.first_written as u32
    }
}
