//! Reading a tree file from memory.

use super::arrays::{Arrays, Rows};
use super::assemble::{Assembled, assemble};
use super::bounds::FileContainer;
use super::cuts;
use super::error::TreeFileError;
use super::faults::{self, Fault};
use super::header::{Header, Parsed, parse};
use super::layout::MAGIC;
use super::links::{Links, Steps};
use crate::cancel::CancelToken;
use crate::geometry::{Aabb, Dop14, OrientedBox, Sphere, Triangle};
use crate::tree::{AnyTree, ContainerKind, Node, Tree};

/// Contents of a tree file.
#[derive(Debug, Clone, PartialEq)]
pub struct TreeFile {
    /// The file's header.
    pub header: Header,
    /// The tree. Nodes have 1 to [`Header::arity`] children, leaves any number of primitives.
    pub tree: AnyTree,
    /// The triangles of the file, where it has them and no others were given.
    pub corners: Option<Vec<Triangle>>,
    /// Number of nodes that were left out, because they have neither primitives nor children that were kept.
    pub empty_nodes: u32,
    /// The number that each node of the tree has in the file; `None` where all have the same.
    pub numbers: Option<Vec<u32>>,
    /// Faults of the tree; one entry per kind, in the order of [`FaultKind::ALL`](super::FaultKind::ALL).
    pub faults: Vec<Fault>,
}

/// Whether `bytes` begin as a tree file does.
pub fn is_tree_file(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// True if `bytes` begin as a file of trees in two levels does.
pub fn is_two_levels(bytes: &[u8]) -> bool {
    parse(bytes).is_ok_and(|parsed| parsed.levels.is_some())
}

/// Reads the header alone.
///
/// # Errors
///
/// Where the first two lines are not those of a tree file.
pub fn read_header(bytes: &[u8]) -> Result<Header, TreeFileError> {
    parse(bytes).map(|parsed| parsed.header)
}

/// Whether a file has the triangles of its mesh, by its first two lines, which are enough of `bytes`.
///
/// # Errors
///
/// Where the first two lines are not those of a tree file.
pub fn has_corners(bytes: &[u8]) -> Result<bool, TreeFileError> {
    parse(bytes).map(|parsed| parsed.arrays.contains_key("corners"))
}

/// Reads the triangles of a file without its tree. `max_bytes` is the memory that may be allocated.
///
/// # Errors
///
/// [`TreeFileError::NoCorners`] where the file has none; otherwise where header, arrays or corners are wrong.
pub fn read_corners(bytes: &[u8], max_bytes: u64, token: &CancelToken) -> Result<Vec<Triangle>, TreeFileError> {
    let arrays = Arrays::find(&parse(bytes)?)?;
    let corners = arrays.corners.ok_or(TreeFileError::NoCorners)?;
    allow(u64::from(arrays.items).saturating_mul(size_of::<Triangle>() as u64), max_bytes)?;
    triangles(corners, arrays.items, token)
}

impl TreeFile {
    /// Reads a file in memory. `mesh` are the triangles that the tree is of, where they are known; otherwise those of the file
    /// are taken, if it has them. `max_bytes` is the memory that may be allocated; nothing is before the sizes in the header
    /// are found to fit the file. Runs in the calling thread's rayon pool, and reports progress through `token`.
    ///
    /// # Errors
    ///
    /// A [`TreeFileError`] for files that cannot be shown. Faults of a tree that can be shown are in [`TreeFile::faults`].
    pub fn read(
        bytes: &[u8],
        mesh: Option<&[Triangle]>,
        max_bytes: u64,
        token: &CancelToken,
    ) -> Result<Self, TreeFileError> {
        token.check()?;
        let parsed = parse(bytes)?;
        let arrays = Arrays::find(&parsed)?;
        check_count(arrays.items, mesh)?;
        allow(peak_bytes(&parsed, &arrays, mesh.is_some()), max_bytes)?;
        match parsed.kind {
            ContainerKind::Aabb => file_of::<Aabb>(parsed, &arrays, mesh, token),
            ContainerKind::Sphere => file_of::<Sphere>(parsed, &arrays, mesh, token),
            ContainerKind::Dop14 => file_of::<Dop14>(parsed, &arrays, mesh, token),
            ContainerKind::Oriented => file_of::<OrientedBox>(parsed, &arrays, mesh, token),
        }
    }
}

fn file_of<C: FileContainer>(
    parsed: Parsed<'_>,
    arrays: &Arrays<'_>,
    mesh: Option<&[Triangle]>,
    token: &CancelToken,
) -> Result<TreeFile, TreeFileError>
where
    AnyTree: From<Tree<C>>,
{
    let OneTree { tree, corners, empty_nodes, numbers, faults } = read_of::<C>(arrays, mesh, token)?;
    Ok(TreeFile { header: parsed.header, tree: tree.into(), corners, empty_nodes, numbers, faults })
}

/// A tree of triangles; see [`TreeFile`].
pub(super) struct OneTree<C> {
    pub tree: Tree<C>,
    pub corners: Option<Vec<Triangle>>,
    pub empty_nodes: u32,
    pub numbers: Option<Vec<u32>>,
    pub faults: Vec<Fault>,
}

/// Reads a tree over `mesh`, or where that is not known over the corners of the file.
pub(super) fn read_of<C: FileContainer>(
    arrays: &Arrays<'_>,
    mesh: Option<&[Triangle]>,
    token: &CancelToken,
) -> Result<OneTree<C>, TreeFileError> {
    let links = Links::follow(arrays, &token.part(0, 3))?;
    let Assembled { tree, numbers } = assemble::<C>(arrays, &links, &token.part(1, 3))?;
    let corners = match arrays.corners {
        Some(corners) if mesh.is_none() => Some(triangles(corners, arrays.items, token)?),
        _ => None,
    };
    let known = mesh.or(corners.as_deref());
    let faults = faults::find(&tree, numbers.as_deref(), arrays, &links, known, &token.part(2, 3))?;
    token.set_progress(1.0);
    Ok(OneTree { tree, corners, empty_nodes: links.empty, numbers, faults })
}

/// Checks that a tree over so many triangles can be one of `mesh`.
pub(super) fn check_count(triangles: u32, mesh: Option<&[Triangle]>) -> Result<(), TreeFileError> {
    match mesh.filter(|mesh| mesh.len() != triangles as usize) {
        Some(mesh) => Err(TreeFileError::OtherMesh { file: triangles, model: mesh.len() }),
        None => Ok(()),
    }
}

/// The triangles in the array `corners`.
pub(super) fn triangles(corners: Rows<'_>, count: u32, token: &CancelToken) -> Result<Vec<Triangle>, TreeFileError> {
    let mut list = Vec::with_capacity(count as usize);
    let mut steps = Steps::new(token, u64::from(count));
    for triangle in 0..count {
        steps.step()?;
        list.push(bytemuck::cast(faults::corners_of(corners, triangle)?));
    }
    Ok(list)
}

/// Estimated peak of what reading allocates, in bytes. The file itself, which is in memory already, is not counted.
pub(super) fn peak_bytes(parsed: &Parsed<'_>, arrays: &Arrays<'_>, has_mesh: bool) -> u64 {
    // Parent, place in the order, number and depth, and the stack, which grows by doubling.
    const OF_LINKS: u64 = 7 * size_of::<u32>() as u64;
    let node = match parsed.kind {
        ContainerKind::Aabb => size_of::<Node<Aabb>>(),
        ContainerKind::Sphere => size_of::<Node<Sphere>>(),
        ContainerKind::Dop14 => size_of::<Node<Dop14>>(),
        ContainerKind::Oriented => size_of::<Node<OrientedBox>>(),
    };
    let is_oriented = u64::from(parsed.kind == ContainerKind::Oriented);
    let of_cuts = [cuts::BYTES_PER_NODE, cuts::BYTES_PER_TRIANGLE].map(|bytes| bytes.saturating_mul(is_oriented));
    let per_node = [OF_LINKS, faults::BYTES_PER_NODE, of_cuts[0]].into_iter().fold(node as u64, u64::saturating_add);
    let (of_index, of_triangle) = match (has_mesh, arrays.corners) {
        (true, _) => (0, faults::BYTES_PER_TRIANGLE),
        (false, Some(_)) => (0, faults::BYTES_PER_TRIANGLE.saturating_add(size_of::<Triangle>() as u64)),
        (false, None) => (faults::BYTES_PER_INDEX, 0),
    };
    let per_index = of_index.saturating_add(size_of::<u32>() as u64);
    let of_triangle = of_triangle.saturating_add(of_cuts[1]);
    [(arrays.nodes, per_node), (arrays.indices, per_index), (arrays.items, of_triangle)]
        .into_iter()
        .map(|(count, bytes)| u64::from(count).saturating_mul(bytes))
        .fold(0, u64::saturating_add)
}

pub(super) fn allow(needed: u64, allowed: u64) -> Result<(), TreeFileError> {
    if needed <= allowed { Ok(()) } else { Err(TreeFileError::Memory { needed, allowed }) }
}
