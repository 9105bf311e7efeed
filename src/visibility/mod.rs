//! Which nodes of a tree, and which triangles, are hidden: whole subtrees, or everything but one.

mod node_identity;

pub use node_identity::NodeIdentity;

use std::collections::HashSet;
use std::sync::Arc;

use crate::accel::Accel;
use bvhscope_engine::tree::Tree;
use bvhscope_engine::with_tree;

/// A set of triangles of a scene, one bit for each.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TriangleSet {
    bits: Vec<u64>,
}

impl TriangleSet {
    /// No triangles of a scene of `count`.
    pub fn none(count: usize) -> Self {
        Self { bits: vec![0; count.div_ceil(64)] }
    }

    /// The triangles of these ranges, each with both ends, that are in a scene of `count`.
    pub fn from_ranges(ranges: &[[u32; 2]], count: usize) -> Self {
        let mut set = Self::none(count);
        for &[first, last] in ranges {
            (first..=last)
                .take_while(|&triangle| (triangle as usize) < count)
                .for_each(|triangle| set.insert(triangle));
        }
        set
    }

    /// The triangles in it as ranges, each with both ends, in ascending order.
    pub fn ranges(&self) -> Vec<[u32; 2]> {
        let mut ranges: Vec<[u32; 2]> = Vec::new();
        for triangle in self.iter() {
            match ranges.last_mut() {
                Some([_, last]) if *last + 1 == triangle => *last = triangle,
                _ => ranges.push([triangle; 2]),
            }
        }
        ranges
    }

    /// Adds a triangle, which must be of the scene.
    pub fn insert(&mut self, triangle: u32) {
        self.bits[triangle as usize / 64] |= 1 << (triangle % 64);
    }

    /// Removes a triangle, which must be of the scene.
    pub fn remove(&mut self, triangle: u32) {
        self.bits[triangle as usize / 64] &= !(1 << (triangle % 64));
    }

    /// Adds all triangles of a scene of `count` that `other` lacks.
    pub fn insert_all_but(&mut self, other: &Self, count: usize) {
        for (word, bits) in self.bits.iter_mut().enumerate() {
            // The last word ends with the scene.
            let own = match count - (word * 64).min(count) {
                0 => 0,
                left @ 1..64 => (1 << left) - 1,
                _ => u64::MAX,
            };
            *bits |= own & !other.bits.get(word).copied().unwrap_or(0);
        }
    }

    /// True if it holds the triangle.
    #[inline]
    pub fn contains(&self, triangle: u32) -> bool {
        self.bits.get(triangle as usize / 64).is_some_and(|bits| bits >> (triangle % 64) & 1 == 1)
    }

    /// The triangles in it, in ascending order.
    pub fn iter(&self) -> impl Iterator<Item = u32> {
        self.bits.iter().zip(0_u32..).flat_map(|(&bits, word)| {
            let mut left = bits;
            std::iter::from_fn(move || {
                let bit = left.trailing_zeros();
                left &= left.wrapping_sub(1);
                (bit < 64).then_some(word * 64 + bit)
            })
        })
    }

    /// Number of triangles in it.
    pub fn len(&self) -> usize {
        self.bits.iter().map(|bits| bits.count_ones() as usize).sum()
    }

    /// True if it holds no triangle.
    pub fn is_empty(&self) -> bool {
        self.bits.iter().all(|&bits| bits == 0)
    }
}

/// The hidden nodes and triangles of one tree.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Visibility {
    is_hidden: Vec<bool>,
    /// The hidden triangles: those of which no leaf is visible. In a tree of split triangles a triangle that a visible leaf
    /// shares stays visible.
    pub triangles: Arc<TriangleSet>,
}

impl Visibility {
    /// Hides the subtrees of the nodes `hidden`, everything outside of the subtree of `isolated`, and all triangles but `only`, with
    /// the nodes that hold none of these. Takes a pass over the tree.
    pub fn new(accel: &Accel, hidden: &HashSet<u32>, isolated: Option<u32>, only: Option<&TriangleSet>) -> Self {
        let count = accel.scene.triangles.len();
        with_tree!(&accel.tree, tree => {
            let mut is_hidden = hidden_nodes(tree, hidden, isolated);
            if let Some(only) = only {
                hide_all_but(tree, only, &mut is_hidden);
            }
            let mut triangles = hidden_triangles(tree, &is_hidden, count);
            if let Some(only) = only {
                triangles.insert_all_but(only, count);
            }
            Self { is_hidden, triangles: Arc::new(triangles) }
        })
    }

    /// True if a node is hidden; `false` for indices beyond the tree.
    pub fn hides(&self, node: u32) -> bool {
        self.is_hidden.get(node as usize).copied().unwrap_or(false)
    }
}

/// True if each node is hidden: itself or by an ancestor, or outside of the isolated subtree.
fn hidden_nodes<C>(tree: &Tree<C>, hidden: &HashSet<u32>, isolated: Option<u32>) -> Vec<bool> {
    let mut roots: Vec<u32> = hidden.iter().copied().collect();
    roots.sort_unstable();
    let mut roots = roots.into_iter().peekable();
    let mut is_hidden = vec![false; tree.nodes.len()];
    if let Some(first) = is_hidden.first_mut() {
        *first = isolated.is_some();
    }
    // Parents come before their children, so one pass hands it down.
    for (index, node) in tree.nodes.iter().enumerate() {
        if isolated == Some(index as u32) {
            is_hidden[index] = false;
        }
        if roots.next_if_eq(&(index as u32)).is_some() {
            is_hidden[index] = true;
        }
        let children = node.children().start as usize..node.children().end as usize;
        let is_parent_hidden = is_hidden[index];
        is_hidden[children].fill(is_parent_hidden);
    }
    is_hidden
}

/// Hides the nodes below which none of the triangles `only` is visible.
fn hide_all_but<C>(tree: &Tree<C>, only: &TriangleSet, is_hidden: &mut [bool]) {
    // Children come after their parents, so one pass backwards hands it up.
    for (index, node) in tree.nodes.iter().enumerate().rev() {
        let own = &tree.primitive_indices[node.slots()];
        is_hidden[index] |= own.iter().all(|&triangle| !only.contains(triangle))
            && node.children().all(|child| is_hidden[child as usize]);
    }
}

/// The triangles whose leaves are all hidden.
fn hidden_triangles<C>(tree: &Tree<C>, is_hidden: &[bool], count: usize) -> TriangleSet {
    let mut triangles = TriangleSet::none(count);
    let of_leaves = |hidden: bool| {
        let leaves = tree.nodes.iter().zip(is_hidden).filter(move |(node, is)| node.is_leaf() && **is == hidden);
        leaves.flat_map(|(node, _)| &tree.primitive_indices[node.slots()])
    };
    of_leaves(true).for_each(|&triangle| triangles.insert(triangle));
    of_leaves(false).for_each(|&triangle| triangles.remove(triangle));
    triangles
}

#[cfg(test)]
mod tests {
    use super::*;
    use bvhscope_engine::geometry::Aabb;
    use bvhscope_engine::tree::Node;

    /// ((0 1) (2 3)); the leaves of the second half are nodes 5 and 6, and triangle 1 is split: node 6 holds it too.
    fn tree() -> Tree<Aabb> {
        let node = |first, count| Node { container: Aabb::EMPTY, first, count };
        Tree {
            nodes: vec![node(1, 0), node(3, 0), node(5, 0), node(0, 1), node(1, 1), node(2, 1), node(3, 2)],
            primitive_indices: vec![0, 1, 2, 3, 1],
            max_depth: 2,
        }
    }

    fn hidden(roots: &[u32], isolated: Option<u32>) -> (Vec<usize>, Vec<u32>) {
        let is_hidden = hidden_nodes(&tree(), &roots.iter().copied().collect(), isolated);
        let triangles = hidden_triangles(&tree(), &is_hidden, 4);
        let nodes = (0..7).filter(|&node| is_hidden[node]).collect();
        (nodes, (0..4).filter(|&triangle| triangles.contains(triangle)).collect())
    }

    #[test]
    fn hiding_takes_the_subtree_and_its_triangles() {
        assert_eq!(hidden(&[], None), (vec![], vec![]));
        assert_eq!(hidden(&[0], None), (vec![0, 1, 2, 3, 4, 5, 6], vec![0, 1, 2, 3]));
        assert_eq!(hidden(&[2], None), (vec![2, 5, 6], vec![2, 3]), "triangle 1 has a visible leaf");
        assert_eq!(hidden(&[2, 5, 99], None).0, [2, 5, 6]);
    }

    #[test]
    fn isolating_leaves_the_subtree() {
        assert_eq!(hidden(&[], Some(2)), (vec![0, 1, 3, 4], vec![0]));
        assert_eq!(hidden(&[5], Some(2)), (vec![0, 1, 3, 4, 5], vec![0, 2]), "and parts of it can be hidden");
        assert_eq!(hidden(&[], Some(0)), (vec![], vec![]));
    }

    #[test]
    fn triangles_shown_alone_leave_their_leaves_and_what_is_above() {
        let alone = |only: &[u32], isolated| {
            let mut set = TriangleSet::none(4);
            for &triangle in only {
                set.insert(triangle);
            }
            let mut is_hidden = hidden_nodes(&tree(), &HashSet::new(), isolated);
            hide_all_but(&tree(), &set, &mut is_hidden);
            (0..7).filter(|&node| is_hidden[node]).collect::<Vec<_>>()
        };
        assert_eq!(alone(&[0], None), [2, 4, 5, 6]);
        assert_eq!(alone(&[1], None), [3, 5], "both leaves of the split triangle stay");
        assert_eq!(alone(&[0, 3], Some(2)), [0, 1, 3, 4, 5], "what is hidden otherwise stays hidden");
        assert_eq!(alone(&[], None), [0, 1, 2, 3, 4, 5, 6]);
    }

    #[test]
    fn all_others_end_with_the_scene() {
        for count in [1, 63, 64, 65, 130] {
            let mut only = TriangleSet::none(count);
            only.insert(count as u32 - 1);
            let mut others = TriangleSet::none(count);
            others.insert_all_but(&only, count);
            assert_eq!(others.iter().collect::<Vec<_>>(), (0..count as u32 - 1).collect::<Vec<_>>());
        }
    }

    #[test]
    fn sets_count_their_triangles() {
        let mut set = TriangleSet::none(130);
        for triangle in [0, 63, 64, 129] {
            set.insert(triangle);
        }
        set.remove(63);
        assert_eq!((set.len(), set.is_empty()), (3, false));
        assert_eq!(set.iter().collect::<Vec<_>>(), [0, 64, 129]);
        assert!(set.contains(129) && !set.contains(63) && !set.contains(5_000));
    }

    #[test]
    fn ranges_give_the_set_back() {
        let mut set = TriangleSet::none(130);
        for triangle in [0, 62, 63, 64, 128, 129] {
            set.insert(triangle);
        }
        assert_eq!(set.ranges(), [[0, 0], [62, 64], [128, 129]]);
        assert_eq!(TriangleSet::from_ranges(&set.ranges(), 130), set);
        let fewer = TriangleSet::from_ranges(&[[3, 3], [120, u32::MAX], [9, 8]], 122);
        assert_eq!(fewer.iter().collect::<Vec<_>>(), [3, 120, 121], "none are beyond the scene");
        assert_eq!(TriangleSet::none(130).ranges(), Vec::<[u32; 2]>::new());
    }
}
