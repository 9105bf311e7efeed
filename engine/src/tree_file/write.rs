//! Writing a tree file.

use std::io::{self, Write};

use serde_json::{Map, Value, json};

use super::arrays::{EMPTY_SLOT, Shape, shapes};
use super::bounds::FileContainer;
use super::header::Header;
use super::layout::{ArrayName, VERSION};
use super::links::STEPS_BETWEEN_CHECKS;
use crate::cancel::CancelToken;
use crate::geometry::Triangle;
use crate::tree::{AnyTree, Node, Tree};
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
    let arity = tree.nodes.iter().map(Node::arity).fold(header.arity.max(2), u32::max);
    let header = &Header { arity, ..header.clone() };
    let (nodes, indices) = (tree.nodes.len() as u32, tree.primitive_indices.len() as u32);
    let mut arrays = Map::new();
    let mut end = 0_u64;
    let shapes: [Shape; 5] = shapes(C::KIND, nodes, indices, header);
    for (array, shape) in ArrayName::ALL.into_iter().zip(shapes) {
        if array != ArrayName::Corners || corners.is_some() {
            arrays.insert(array.name().to_owned(), end.into());
            end = end.saturating_add(shape.bytes());
        }
    }
    let mut fields = header.other.clone();
    let known = json!({
        "container": C::KIND.name(),
        "arity": arity,
        "nodes": nodes,
        "indices": indices,
        "triangles": header.triangles,
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
    token.check().map_err(io::Error::other)?;
    writeln!(writer, "bvhscope tree {VERSION}\n{}", Value::Object(fields))?;
    write_rows(&tree.nodes, writer, &token.part(0, 5), |node, bytes| {
        node.container.numbers().iter().for_each(|number| bytes.extend(number.to_le_bytes()));
    })?;
    write_rows(&tree.nodes, writer, &token.part(1, 5), |node, bytes| {
        let row = node.children().chain(std::iter::repeat(EMPTY_SLOT)).take(arity as usize);
        row.for_each(|child| bytes.extend(child.to_le_bytes()));
    })?;
    write_rows(&tree.nodes, writer, &token.part(2, 5), |node, bytes| {
        let [first, count] = if node.is_leaf() { [node.first, node.count] } else { [0, 0] };
        bytes.extend([first, count].map(u32::to_le_bytes).as_flattened());
    })?;
    write_rows(&tree.primitive_indices, writer, &token.part(3, 5), |index, bytes| bytes.extend(index.to_le_bytes()))?;
    corners.map_or(Ok(()), |corners| write_corners(corners, writer, &token.part(4, 5)))
}

/// Writes one row after the other through a buffer.
fn write_rows<T>(
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
