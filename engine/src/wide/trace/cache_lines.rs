//! Memory that single rays read from a wide tree, in cache lines.
//!
//! Memory moves between caches in lines of 64 bytes, so that a ray costs the lines that it touches, whatever part of each it uses.
//! Counted are distinct lines of each ray, as if none were cached before: of a node its whole record, of a block its triangles, in
//! the order of traversal of a single ray. Neighbours in memory that share a line count it once. Every array is taken to begin at a
//! line, so that the counts are the same on every machine. Memory read by a ray is the measure of Haydel, Kensler, Brunvand and
//! Yuksel, *Merged Nodes*, HPG 2026.

#![allow(clippy::inline_always, reason = "the kernels call it for every node")]

use std::ops::{AddAssign, Range};

use crate::tree::traverse::Probe;
use crate::wide::WideContainer;
use crate::wide::child::{Child, LeafRange};
use crate::wide::layout::{BLOCK, VALUES};
use crate::wide::leaves::Leaves;
use crate::wide::tree::{AnyWideTree, WideNode, WideTree};
use crate::with_wide_tree;

/// Bytes of a cache line: those of x86-64 and of most ARM processors.
pub const LINE_BYTES: usize = 64;

/// Numbers of cache lines of [`LINE_BYTES`] bytes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct CacheLines {
    /// Lines of nodes.
    pub nodes: u64,
    /// Lines of blocks of triangles.
    pub triangles: u64,
}

impl CacheLines {
    /// Bytes of all.
    pub const fn bytes(self) -> u64 {
        (self.nodes + self.triangles) * LINE_BYTES as u64
    }
}

impl AddAssign for CacheLines {
    fn add_assign(&mut self, other: Self) {
        self.nodes += other.nodes;
        self.triangles += other.triangles;
    }
}

/// First and last line of a record.
pub(crate) type Lines = [usize; 2];

/// A [`Probe`] of the wide tree that it was made for, which counts the lines that a ray reads.
///
/// ```
/// use bvhscope_engine::glam::Vec3;
/// use bvhscope_engine::kernel::SimdLevel;
/// use bvhscope_engine::wide::trace::{CacheLines, LineProbe};
/// use bvhscope_engine::{BuildSettings, CancelToken, Ray, Triangle, build};
///
/// let triangles = [Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::Y }];
/// let bvh = build(&triangles, &BuildSettings::default(), &CancelToken::new())?;
/// let tree = &bvh.wide().tree;
/// let mut probe = LineProbe::new(tree);
/// tree.closest_hit_with(SimdLevel::best().level(), &Ray::new(Vec3::Z, Vec3::NEG_Z), &mut probe);
/// // One triangle, of which a leaf holds 40 bytes, and no node.
/// assert_eq!(probe.take(), CacheLines { nodes: 0, triangles: 1 });
/// # Ok::<(), bvhscope_engine::BuildError>(())
/// ```
#[derive(Debug)]
pub struct LineProbe<'a> {
    leaves: &'a Leaves,
    /// Bytes of a full node, and of a compact one.
    node_bytes: [usize; 2],
    /// Lines read of the full nodes, of the compact ones and of the leaves.
    read: [Vec<Lines>; 3],
    /// Slots of the leaf that was visited last, without the blocks that were tested.
    slots: Range<usize>,
}

impl<'a> LineProbe<'a> {
    /// A probe that has read nothing.
    pub fn new(tree: &'a AnyWideTree) -> Self {
        with_wide_tree!(tree, tree => Self::of(tree))
    }

    fn of<C: WideContainer>(tree: &'a WideTree<C>) -> Self {
        let node_bytes = [size_of::<WideNode<C::Bounds>>(), size_of::<WideNode<C::Compact>>()];
        Self { leaves: &tree.leaves, node_bytes, read: Default::default(), slots: 0..0 }
    }

    /// The number of distinct lines read since the last call. Call it after each ray.
    pub fn take(&mut self) -> CacheLines {
        let [full, compact, triangles] = self.read.each_mut().map(distinct);
        CacheLines { nodes: full + compact, triangles }
    }
}

/// Number of distinct lines in `read`, which is empty afterwards.
fn distinct(read: &mut Vec<Lines>) -> u64 {
    read.sort_unstable();
    let count = count_distinct(read.iter().copied());
    read.clear();
    count
}

/// Number of distinct lines among those of `records`, which are in ascending order.
pub(crate) fn count_distinct(records: impl Iterator<Item = Lines>) -> u64 {
    let (mut count, mut next) = (0, 0);
    for [first, last] in records {
        count += (last + 1).saturating_sub(next.max(first));
        next = next.max(last + 1);
    }
    count as u64
}

/// The lines of `count` records of `bytes` bytes from number `first` on.
fn lines(first: usize, count: usize, bytes: usize) -> Lines {
    [first * bytes / LINE_BYTES, ((first + count) * bytes - 1) / LINE_BYTES]
}

impl Probe for LineProbe<'_> {
    #[inline(always)]
    fn container_test(&mut self) {}

    fn primitive_test(&mut self) {
        let count = self.slots.len().min(BLOCK);
        self.read[2].push(lines(self.slots.start, count, size_of::<[f32; VALUES]>()));
        self.slots.start += count;
    }

    fn visited(&mut self, node: u32) {
        let child = Child::from_bits(node);
        if child.is_leaf() {
            let LeafRange { first, count } = self.leaves.range(child);
            self.slots = first as usize..(first + count) as usize;
        } else {
            let form = usize::from(child.is_compact());
            self.read[form].push(lines(child.index(), 1, self.node_bytes[form]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_count_once_however_often_they_are_read() {
        assert_eq!(lines(0, 1, 64), [0, 0]);
        assert_eq!(lines(1, 1, 64), [1, 1]);
        // 224 bytes from 224 on end at 447.
        assert_eq!(lines(1, 1, 224), [3, 6]);
        assert_eq!(lines(3, 4, 40), [1, 4]);
        let mut read = vec![[7, 9], [3, 6], [6, 7], [3, 6], [20, 20]];
        // 3 to 9, and 20.
        assert_eq!(distinct(&mut read), 8);
        assert_eq!(distinct(&mut read), 0);
        assert_eq!(distinct(&mut vec![[0, 9], [2, 3], [4, 12]]), 13);
    }
}
