//! One number for a tree, by which trees of different machines, versions and settings are compared without keeping them.

use bytemuck::{Pod, bytes_of, cast_slice, pod_read_unaligned};

use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Triangle;
use crate::kernel::mix::mix64;
use crate::kernel::parallel::par_tasks;
use crate::tree::{AnyTree, Node};
use crate::wide::{AnyWideTree, WideContainer, WideNode, WideTree};
use crate::{with_tree, with_wide_tree};

/// Items that are hashed together; the hash depends on it.
const BATCH: usize = 1 << 12;

/// Hash of a binary tree: of the exact bits of every container, of every reference and of the order of the primitives. Computed in
/// the calling thread's rayon pool, and the same for any number of threads. Equal trees have equal hashes; two that differ in
/// anything have the same one with a probability of 2⁻⁶⁴.
///
/// ```
/// use bvhscope_engine::{BuildSettings, CancelToken, Triangle, build, fingerprint, glam::Vec3};
///
/// let triangles = [Vec3::X, Vec3::Y, Vec3::Z].map(|a| Triangle { a, b: 2.0 * a, c: Vec3::ONE });
/// let hash = |triangles: &[Triangle]| {
///     let bvh = build(triangles, &BuildSettings::default(), &CancelToken::new())?;
///     Ok::<_, bvhscope_engine::BuildError>(fingerprint::of_tree(bvh.tree(), &CancelToken::new())?)
/// };
/// assert_eq!(hash(&triangles)?, hash(&triangles)?);
/// assert_ne!(hash(&triangles)?, hash(&triangles[1..])?);
/// # Ok::<(), bvhscope_engine::BuildError>(())
/// ```
pub fn of_tree(tree: &AnyTree, token: &CancelToken) -> Result<u64, Cancelled> {
    with_tree!(tree, tree => {
        let nodes = of_list(&tree.nodes, token, hash_node)?;
        let indices = of_list(&tree.primitive_indices, token, |hash, index| join(hash, u64::from(*index)))?;
        Ok(join(join(nodes, indices), tree.max_depth.into()))
    })
}

/// [`of_tree`] of a wide tree: nodes, references, and the triangles of the leaves.
pub fn of_wide_tree(tree: &AnyWideTree, token: &CancelToken) -> Result<u64, Cancelled> {
    with_wide_tree!(tree, tree => of_wide(tree, token))
}

/// Hash of the exact bits of a list of triangles: two machines that load the same scene can tell whether they did.
pub fn of_triangles(triangles: &[Triangle], token: &CancelToken) -> Result<u64, Cancelled> {
    of_list(triangles, token, |hash, triangle| hash_bytes(hash, bytes_of(triangle)))
}

fn of_wide<C: WideContainer>(tree: &WideTree<C>, token: &CancelToken) -> Result<u64, Cancelled> {
    let nodes = of_list(&tree.nodes, token, hash_wide_node)?;
    let compact_nodes = of_list(&tree.compact_nodes, token, hash_wide_node)?;
    let children = tree.all_nodes().flat_map(|node| tree.children_of(node)).chain(tree.root);
    let values = tree.leaves.unmarked(children.filter(|child| child.is_leaf()), token)?;
    let leaves = of_list(&values, token, |hash, value| join(hash, value.to_bits().into()))?;
    let root = tree.root.map_or(u64::MAX, |root| root.bits().into());
    Ok(join(join(join(nodes, compact_nodes), leaves), root))
}

fn hash_wide_node<B: Pod>(hash: u64, node: &WideNode<B>) -> u64 {
    hash_bytes(hash_bytes(hash, bytes_of(&node.bounds)), cast_slice(&node.children))
}

/// Hash of a list, batch by batch on all threads.
fn of_list<T: Sync>(list: &[T], token: &CancelToken, hash: impl Fn(u64, &T) -> u64 + Sync) -> Result<u64, Cancelled> {
    let hashes = par_tasks(list.chunks(BATCH), token, |batch, _| Ok(batch.iter().fold(0, &hash)))?;
    Ok(hashes.into_iter().fold(list.len() as u64, join))
}

fn hash_node<C: Pod>(hash: u64, node: &Node<C>) -> u64 {
    hash_bytes(join(hash, u64::from(node.first) << 32 | u64::from(node.count)), bytes_of(&node.container))
}

fn hash_bytes(hash: u64, bytes: &[u8]) -> u64 {
    let (words, rest) = bytes.as_chunks::<8>();
    let hash = words.iter().fold(hash, |hash, word| join(hash, pod_read_unaligned(word)));
    rest.iter().fold(hash, |hash, byte| join(hash, (*byte).into()))
}

#[inline]
fn join(hash: u64, word: u64) -> u64 {
    mix64(hash ^ word)
}
