//! Writing a tree file.

use std::io::{self, Write};

use serde_json::{Map, Value, json};

use super::arrays::{EMPTY_SLOT, shapes};
use super::bounds::FileContainer;
use super::header::{Header, LevelCounts};
use super::layout::{ArrayName, VERSION, VERSION_TWO_LEVELS};
use super::links::STEPS_BETWEEN_CHECKS;
use crate::cancel::CancelToken;
use crate::geometry::Triangle;
use crate::tree::{AnyTree, ContainerKind, Node, Tree};
use crate::with_tree;

/// Writes `tree`, binary or n-ary, as a tree file, with its triangles where `corners` has them: those in `header` by number.
/// Reading it gives the same tree, node for node. Fields of `header.other` that this version defines are left out.
///
/// # Errors
///
/// Those of `writer`; [`Cancelled`](crate::Cancelled) as the inner error of one, once `token` is cancelled.
pub fn write_tree(
    tree: &AnyTree,
    header: &Header,
    corners: Option<&[Triangle]>,
    writer: &mut (impl Write + ?Sized),
    token: &CancelToken,
) -> io::Result<()> {
    with_tree!(tree, tree => write_tree_of(tree, header, corners, writer, token))
}

/// Writes triangles as rows of nine f32, little-endian: the array `corners` alone.
///
/// # Errors
///
/// As [`write_tree`].
pub fn write_corners(
    triangles: &[Triangle],
    writer: &mut (impl Write + ?Sized),
    token: &CancelToken,
) -> io::Result<()> {
    let corners = |triangle: &Triangle| bytemuck::cast::<Triangle, [f32; 9]>(*triangle).map(f32::to_le_bytes);
    write_rows(triangles, writer, token, |triangle, bytes| bytes.extend(corners(triangle).as_flattened()))
}

fn write_tree_of<C: FileContainer>(
    tree: &Tree<C>,
    header: &Header,
    corners: Option<&[Triangle]>,
    writer: &mut (impl Write + ?Sized),
    token: &CancelToken,
) -> io::Result<()> {
    let arity = widest(tree, header.arity);
    let header = &Header { arity, ..header.clone() };
    let (nodes, indices) = (tree.nodes.len() as u32, tree.primitive_indices.len() as u32);
    token.check().map_err(io::Error::other)?;
    let is_written = |array: ArrayName| array != ArrayName::Corners || corners.is_some();
    write_lines(C::KIND, [nodes, indices], header, None, is_written, writer)?;
    write_bounds(tree, writer, &token.part(0, 5))?;
    write_children(tree, arity, writer, &token.part(1, 5))?;
    write_leaves(tree, writer, &token.part(2, 5))?;
    write_numbers(&tree.primitive_indices, writer, &token.part(3, 5))?;
    corners.map_or(Ok(()), |corners| write_corners(corners, writer, &token.part(4, 5)))
}

/// Most children of a node, at least `arity` and 2.
pub(super) fn widest<C>(tree: &Tree<C>, arity: u32) -> u32 {
    tree.nodes.iter().map(Node::arity).fold(arity.max(2), u32::max)
}

/// Writes the first two lines of a file of so many nodes and indices, with the arrays that are written, in their order.
pub(super) fn write_lines(
    kind: ContainerKind,
    [nodes, indices]: [u32; 2],
    header: &Header,
    levels: Option<LevelCounts>,
    is_written: impl Fn(ArrayName) -> bool,
    writer: &mut (impl Write + ?Sized),
) -> io::Result<()> {
    let mut arrays = Map::new();
    let mut end = 0_u64;
    let shapes = shapes(kind, nodes, indices, header, levels.unwrap_or_default());
    for (array, shape) in ArrayName::ALL.into_iter().zip(shapes) {
        if is_written(array) && (levels.is_some() || !array.is_of_two_levels()) {
            arrays.insert(array.name().to_owned(), end.into());
            end = end.saturating_add(shape.bytes());
        }
    }
    let mut fields = header.other.clone();
    let known = json!({
        "container": kind.name(),
        "arity": header.arity,
        "nodes": nodes,
        "indices": indices,
        "triangles": header.triangles,
        "trees": levels.map(|levels| levels.trees),
        "instances": levels.map(|levels| levels.instances),
        "arrays": Value::Object(arrays),
        "builder": header.builder,
        "settings": header.settings,
        "build_ms": header.build_ms,
    });
    for (name, value) in known.as_object().into_iter().flatten() {
        fields.remove(name);
        if !value.is_null() {
            fields.insert(name.clone(), value.clone());
        }
    }
    let version = if levels.is_some() { VERSION_TWO_LEVELS } else { VERSION };
    writeln!(writer, "bvhscope tree {version}\n{}", Value::Object(fields))
}

/// Writes the bounds of all nodes.
pub(super) fn write_bounds<C: FileContainer>(
    tree: &Tree<C>,
    writer: &mut (impl Write + ?Sized),
    token: &CancelToken,
) -> io::Result<()> {
    write_rows(&tree.nodes, writer, token, |node, bytes| {
        node.container.numbers().iter().for_each(|number| bytes.extend(number.to_le_bytes()));
    })
}

/// Writes the children of all nodes in rows of `arity`.
pub(super) fn write_children<C>(
    tree: &Tree<C>,
    arity: u32,
    writer: &mut (impl Write + ?Sized),
    token: &CancelToken,
) -> io::Result<()> {
    write_rows(&tree.nodes, writer, token, |node, bytes| {
        let row = node.children().chain(std::iter::repeat(EMPTY_SLOT)).take(arity as usize);
        row.for_each(|child| bytes.extend(child.to_le_bytes()));
    })
}

/// Writes the ranges of indices of all nodes.
pub(super) fn write_leaves<C>(
    tree: &Tree<C>,
    writer: &mut (impl Write + ?Sized),
    token: &CancelToken,
) -> io::Result<()> {
    write_rows(&tree.nodes, writer, token, |node, bytes| {
        let [first, count] = if node.is_leaf() { [node.first, node.count] } else { [0, 0] };
        bytes.extend([first, count].map(u32::to_le_bytes).as_flattened());
    })
}

/// Writes whole numbers.
pub(super) fn write_numbers(
    numbers: &[u32],
    writer: &mut (impl Write + ?Sized),
    token: &CancelToken,
) -> io::Result<()> {
    write_rows(numbers, writer, token, |number, bytes| bytes.extend(number.to_le_bytes()))
}

/// Writes one row after the other through a buffer.
pub(super) fn write_rows<T>(
    rows: &[T],
    writer: &mut (impl Write + ?Sized),
    token: &CancelToken,
    put: impl Fn(&T, &mut Vec<u8>),
) -> io::Result<()> {
    let mut buffer = Vec::new();
    for (index, chunk) in rows.chunks(STEPS_BETWEEN_CHECKS as usize).enumerate() {
        token.check().map_err(io::Error::other)?;
        token.set_progress(index as f32 * STEPS_BETWEEN_CHECKS as f32 / rows.len() as f32);
        buffer.clear();
        for row in chunk {
            put(row, &mut buffer);
        }
        writer.write_all(&buffer)?;
    }
    Ok(())
}
