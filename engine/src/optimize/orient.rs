//! Oriented boxes for the nodes of a finished tree of boxes. The topology stays; each node gets the smallest of its plain box, a box that
//! is turned to fit and a skewed one.

use crate::cancel::{CancelToken, Cancelled, MEDIUM_STEPS};
use crate::geometry::{Aabb, Extremes, OrientedBox, Triangle, intervals};
use crate::kernel::parallel::{par_collect, par_collect_in_chunks, zeros};
use crate::tree::{AnyTree, Node, Tree};

/// Nodes that are fitted between two polls: some microseconds each, and one for each few triangles below it.
const FITTED_BETWEEN_CHECKS: usize = 1 << 10;
/// Most triangles of a node to which a turned box is fitted, which takes a look at each of them.
const MOST_FITTED: u32 = 1 << 15;
/// Looks at each triangle, on average, that fitting may take: more than the depth of any sensible tree.
const LOOKS: u64 = 64;

/// The three corners of the triangles of a tree, numbered in leaf order.
#[derive(Clone, Copy)]
struct Corners<'a> {
    triangles: &'a [Triangle],
    indices: &'a [u32],
}

impl Corners<'_> {
    fn place(self, corner: u32) -> glam::Vec3 {
        let Triangle { a, b, c } = self.triangles[self.indices[corner as usize / 3] as usize];
        match corner % 3 {
            0 => a,
            1 => b,
            _ => c,
        }
    }

    /// The corners of the triangles in `slots`.
    fn of(self, slots: std::ops::Range<u32>) -> impl Iterator<Item = glam::Vec3> {
        slots.flat_map(move |slot| {
            let Triangle { a, b, c } = self.triangles[self.indices[slot as usize] as usize];
            [a, b, c]
        })
    }
}

/// `tree`, of boxes, with oriented ones; a copy of a tree of other containers. `triangles` is the list that it was built from. Works on
/// trees of any arity and of any builder. Of a valid tree, all rays have the same hits. The same for any number of threads.
///
/// Where a builder put parts of a triangle into several leaves, boxes askew enclose all of it.
///
/// ```
/// use bvhscope_engine::builders::build_binary;
/// use bvhscope_engine::geometry::OrientedKind;
/// use bvhscope_engine::glam::Vec3;
/// use bvhscope_engine::{AnyTree, BuildSettings, CancelToken, Triangle, orient};
///
/// // A strand askew.
/// let at = |i: u16| Vec3::new(5.0, 3.0, 1.0) * f32::from(i);
/// let strand: Vec<_> = (0..8).map(|i| Triangle { a: at(i), b: at(i + 1), c: at(i) + Vec3::X * 0.1 }).collect();
/// let token = CancelToken::new();
/// let (tree, _) = build_binary(&strand, &BuildSettings::default(), &token)?;
/// let AnyTree::Oriented(tree) = orient(&tree, &strand, &token)? else { panic!("it was a tree of boxes") };
/// assert!(tree.nodes.iter().all(|node| node.container.kind() != OrientedKind::Plain));
/// # Ok::<(), bvhscope_engine::BuildError>(())
/// ```
pub fn orient(tree: &AnyTree, triangles: &[Triangle], token: &CancelToken) -> Result<AnyTree, Cancelled> {
    match tree {
        AnyTree::Aabb(tree) => Ok(AnyTree::Oriented(oriented(tree, triangles, token)?)),
        other => Ok(other.clone()),
    }
}

/// [`orient`] of a tree of boxes.
fn oriented(tree: &Tree<Aabb>, triangles: &[Triangle], token: &CancelToken) -> Result<Tree<OrientedBox>, Cancelled> {
    token.begin_stage("orient");
    let corners = Corners { triangles, indices: &tree.primitive_indices };
    let slots = slots_below(tree, token)?;
    let extremes = extremes(tree, corners, token)?;
    let most = most_fitted(&slots, tree.primitive_indices.len());
    let nodes = par_collect_in_chunks(tree.nodes.len(), FITTED_BETWEEN_CHECKS, token, |index| {
        let Node { container, first, count } = tree.nodes[index];
        let places = extremes[index].places(|corner| corners.place(corner));
        let [begin, end] = slots[index];
        let project = |normals| intervals(corners.of(begin..end), normals);
        Node { container: OrientedBox::choose(container, &places, end - begin <= most, project), first, count }
    })?;
    Ok(Tree { nodes, primitive_indices: tree.primitive_indices.clone(), max_depth: tree.max_depth })
}

/// The first slot below each node and the one after the last.
fn slots_below(tree: &Tree<Aabb>, token: &CancelToken) -> Result<Vec<[u32; 2]>, Cancelled> {
    let mut slots = zeros::<[u32; 2]>(tree.nodes.len(), token)?;
    // Backwards, so that children are done before their parents.
    for (index, node) in tree.nodes.iter().enumerate().rev() {
        token.check_every(MEDIUM_STEPS, index)?;
        let children = node.children().map(|child| slots[child as usize]);
        let below = children.reduce(|[first, end], next| [first.min(next[0]), end.max(next[1])]);
        slots[index] = below.unwrap_or([node.first, node.first + node.count]);
    }
    Ok(slots)
}

/// The extreme corners of each node: of leaves on all threads, then upwards.
fn extremes(tree: &Tree<Aabb>, corners: Corners<'_>, token: &CancelToken) -> Result<Vec<Extremes<u32>>, Cancelled> {
    let place = |corner: u32| corners.place(corner);
    let mut extremes = par_collect(tree.nodes.len(), token, |index| {
        let node = &tree.nodes[index];
        let mut found = Extremes::of(if node.is_leaf() { 3 * node.first } else { 0 });
        for slot in node.slots() {
            (3 * slot as u32..3 * slot as u32 + 3).for_each(|corner| found.add(&Extremes::of(corner), place));
        }
        found
    })?;
    for (index, node) in tree.nodes.iter().enumerate().rev() {
        token.check_every(MEDIUM_STEPS, index)?;
        if let [first, others @ ..] = &node.children().collect::<arrayvec::ArrayVec<u32, 32>>()[..] {
            let mut found = extremes[*first as usize];
            for &child in others {
                found.add(&extremes[child as usize], place);
            }
            extremes[index] = found;
        }
    }
    Ok(extremes)
}

/// Most triangles of a node to which turned boxes are fitted, a power of two less one: so that this takes [`LOOKS`] at each of
/// `count` triangles at most.
fn most_fitted(slots: &[[u32; 2]], count: usize) -> u32 {
    // By the bits of the number of triangles.
    let mut looks = [0_u64; 33];
    for [begin, end] in slots {
        looks[(u32::BITS - (end - begin).leading_zeros()) as usize] += u64::from(end - begin);
    }
    let (mut sum, mut bits) = (0, 0);
    for (at, looks) in looks.iter().enumerate().skip(1) {
        sum += looks;
        if sum > LOOKS * count as u64 || at as u32 > MOST_FITTED.ilog2() {
            break;
        }
        bits = at as u32;
    }
    ((1_u64 << bits) - 1) as u32
}

impl Tree<OrientedBox> {
    /// The same tree with the box along the axes of each node.
    pub fn to_plain(&self, token: &CancelToken) -> Result<Tree<Aabb>, Cancelled> {
        let plain = |index: usize| {
            let Node { container, first, count } = self.nodes[index];
            Node { container: container.bounds, first, count }
        };
        let nodes = par_collect(self.nodes.len(), token, plain)?;
        Ok(Tree { nodes, primitive_indices: self.primitive_indices.clone(), max_depth: self.max_depth })
    }

    /// A tree of plain boxes as one of oriented ones.
    pub(crate) fn from_plain(tree: &Tree<Aabb>, token: &CancelToken) -> Result<Self, Cancelled> {
        let oriented = |index: usize| {
            let Node { container, first, count } = tree.nodes[index];
            Node { container: OrientedBox::plain(container), first, count }
        };
        let nodes = par_collect(tree.nodes.len(), token, oriented)?;
        Ok(Self { nodes, primitive_indices: tree.primitive_indices.clone(), max_depth: tree.max_depth })
    }
}
