//! Writing trees in two levels.

use std::io::{self, Write};

use super::header::{Header, LevelCounts};
use super::instance::Instance;
use super::layout::ArrayName;
use super::write::{
    widest, write_bounds, write_children, write_corners, write_leaves, write_lines, write_numbers, write_rows,
};
use crate::cancel::CancelToken;
use crate::geometry::{Aabb, Triangle};
use crate::tree::{AnyTree, ContainerKind, Tree};

/// Trees of meshes, and one over instances of them.
#[derive(Debug, Clone)]
pub struct TwoLevelTrees<'a> {
    /// The tree of each mesh, and its triangles.
    pub meshes: Vec<(&'a AnyTree, &'a [Triangle])>,
    /// The tree over the instances.
    pub top: &'a AnyTree,
    /// The instances.
    pub instances: Vec<Instance>,
    /// A number for each instance.
    pub ids: Option<&'a [u32]>,
}

/// Writes `trees` as a tree file in two levels, with the triangles of the meshes if `with_corners`. Reading it gives the same trees, node for
/// node. The number of triangles in `header` is not written, nor are fields of `header.other` that this version defines.
///
/// # Errors
///
/// As [`write_tree`](super::write_tree); also for trees that are not of boxes, and for more than 4,294,967,295 nodes, indices or triangles.
pub fn write_two_levels(
    trees: &TwoLevelTrees<'_>,
    header: &Header,
    with_corners: bool,
    writer: &mut (impl Write + ?Sized),
    token: &CancelToken,
) -> io::Result<()> {
    token.check().map_err(io::Error::other)?;
    let all: Vec<&Tree<Aabb>> =
        trees.meshes.iter().map(|(tree, _)| *tree).chain([trees.top]).map(boxes).collect::<io::Result<_>>()?;
    let nodes = total("nodes", all.iter().map(|tree| tree.nodes.len()))?;
    let indices = total("indices", all.iter().map(|tree| tree.primitive_indices.len()))?;
    let triangles = total("triangles", trees.meshes.iter().map(|(_, triangles)| triangles.len()))?;
    let instances = total("instances", [trees.instances.len()])?;
    let arity = all.iter().fold(header.arity, |arity, tree| widest(tree, arity));
    let header = Header { arity, triangles, ..header.clone() };
    let levels = LevelCounts { trees: total("trees", [all.len()])?, instances };
    let is_written = |array: ArrayName| match array {
        ArrayName::Corners => with_corners,
        ArrayName::Ids => trees.ids.is_some(),
        _ => true,
    };
    write_lines(ContainerKind::Aabb, [nodes, indices], &header, Some(levels), is_written, writer)?;
    let of_all = |part: usize, write: &mut dyn FnMut(&Tree<Aabb>, &CancelToken) -> io::Result<()>| {
        let token = token.part(part, 6);
        all.iter().enumerate().try_for_each(|(at, tree)| write(tree, &token.part(at, all.len())))
    };
    of_all(0, &mut |tree, token| write_bounds(tree, writer, token))?;
    of_all(1, &mut |tree, token| write_children(tree, arity, writer, token))?;
    of_all(2, &mut |tree, token| write_leaves(tree, writer, token))?;
    of_all(3, &mut |tree, token| write_numbers(&tree.primitive_indices, writer, token))?;
    if with_corners {
        let token = token.part(4, 6);
        let mut meshes = trees.meshes.iter().enumerate();
        meshes.try_for_each(|(at, (_, triangles))| {
            write_corners(triangles, writer, &token.part(at, trees.meshes.len()))
        })?;
    }
    let items = trees.meshes.iter().map(|(_, triangles)| triangles.len()).chain([trees.instances.len()]);
    let rows: Vec<[u32; 3]> = all
        .iter()
        .zip(items)
        .map(|(tree, items)| [tree.nodes.len(), tree.primitive_indices.len(), items].map(|count| count as u32))
        .collect();
    write_numbers(rows.as_flattened(), writer, &token.part(5, 6))?;
    write_rows(&trees.instances, writer, &token.part(5, 6), |instance, bytes| {
        bytes.extend(instance.mesh.to_le_bytes());
    })?;
    write_rows(&trees.instances, writer, &token.part(5, 6), |instance, bytes| {
        bytes.extend(instance.matrix.as_flattened().iter().flat_map(|number| number.to_le_bytes()));
    })?;
    trees.ids.map_or(Ok(()), |ids| write_numbers(ids, writer, &token.part(5, 6)))
}

fn boxes(tree: &AnyTree) -> io::Result<&Tree<Aabb>> {
    if let AnyTree::Aabb(tree) = tree {
        return Ok(tree);
    }
    let text = format!("trees in two levels have boxes, not {}", tree.container_kind().plural());
    Err(io::Error::new(io::ErrorKind::InvalidInput, text))
}

/// The sum of `counts`, which a header can state.
fn total(what: &str, counts: impl IntoIterator<Item = usize>) -> io::Result<u32> {
    let sum = counts.into_iter().fold(0_u64, |sum, count| sum.saturating_add(count as u64));
    u32::try_from(sum).map_err(|_| io::Error::new(io::ErrorKind::InvalidInput, format!("there are {sum} {what}")))
}
