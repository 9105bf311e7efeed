//! The nodes of a tree as a table for notebooks: CSV or JSON.

use std::io::{self, Write};

use serde::Serialize;
use serde_json::{Value, json};

use super::bounds::FileContainer;
use super::header::Header;
use super::links::Steps;
use super::write_levels::TwoLevelTrees;
use crate::cancel::CancelToken;
use crate::kernel::parallel::zeros;
use crate::tree::{AnyTree, ContainerKind, Tree};
use crate::with_tree;

/// Columns beside the bounds.
const COLUMNS: [&str; 7] = ["node", "parent", "depth", "first_child", "children", "first_primitive", "primitives"];

/// Columns of the bounds.
const fn bounds_columns(kind: ContainerKind) -> &'static [&'static str] {
    match kind {
        ContainerKind::Aabb => &["min_x", "min_y", "min_z", "max_x", "max_y", "max_z"],
        ContainerKind::Sphere => &["center_x", "center_y", "center_z", "radius"],
        ContainerKind::Dop14 => &[
            "min_x", "min_y", "min_z", "max_x", "max_y", "max_z", "low_0", "low_1", "low_2", "low_3", "high_0",
            "high_1", "high_2", "high_3",
        ],
        ContainerKind::Oriented => &[
            "min_x",
            "min_y",
            "min_z",
            "max_x",
            "max_y",
            "max_z",
            "normal_0_x",
            "normal_0_y",
            "normal_0_z",
            "normal_1_x",
            "normal_1_y",
            "normal_1_z",
            "normal_2_x",
            "normal_2_y",
            "normal_2_z",
            "low_0",
            "low_1",
            "low_2",
            "high_0",
            "high_1",
            "high_2",
        ],
    }
}

/// A row without its bounds: the values of [`COLUMNS`].
#[derive(Serialize)]
struct NodeRow(u32, Option<u32>, u32, Option<u32>, u32, u32, u32);

/// Writes the nodes of `tree` as CSV with a line of names: `node`, `parent` (empty for the root), `depth`, `first_child` (empty
/// for a leaf; children are neighbours), `children` (their number), `first_primitive` and `primitives` (the range of positions
/// in leaf order at and below the node), then `min_x` to `max_z`, `center_x` to `radius`, `min_x` to `high_3`, or `min_x` to `high_2`,
/// and `triangles` (the primitives of a leaf, separated by blanks; empty for an interior node).
///
/// # Errors
///
/// As [`write_tree`](super::write_tree).
pub fn write_nodes_csv(tree: &AnyTree, writer: &mut (impl Write + ?Sized), token: &CancelToken) -> io::Result<()> {
    let columns = [&COLUMNS, bounds_columns(tree.container_kind()), &["triangles"][..]].concat();
    writeln!(writer, "{}", columns.join(","))?;
    write_csv_rows("", tree, writer, token)
}

/// Writes the nodes of both levels of `trees` as [`write_nodes_csv`] does, with the column `mesh` in front: empty for the tree over the
/// instances, which comes first and whose leaves list instances in the column `items`, as those of meshes list triangles.
///
/// # Errors
///
/// As [`write_tree`](super::write_tree).
pub fn write_level_nodes_csv(
    trees: &TwoLevelTrees<'_>,
    writer: &mut (impl Write + ?Sized),
    token: &CancelToken,
) -> io::Result<()> {
    let columns = [&["mesh"][..], &COLUMNS, bounds_columns(trees.top.container_kind()), &["items"]].concat();
    writeln!(writer, "{}", columns.join(","))?;
    for_each_tree(trees, token, |mesh, tree, token| {
        let mesh = mesh.map_or_else(String::new, |mesh| mesh.to_string());
        write_csv_rows(&format!("{mesh},"), tree, writer, token)
    })
}

/// Calls `write` with the tree over the instances, then with each mesh by its number.
fn for_each_tree(
    trees: &TwoLevelTrees<'_>,
    token: &CancelToken,
    mut write: impl FnMut(Option<usize>, &AnyTree, &CancelToken) -> io::Result<()>,
) -> io::Result<()> {
    let count = trees.meshes.len().saturating_add(1);
    write(None, trees.top, &token.part(0, count))?;
    let mut meshes = trees.meshes.iter().enumerate();
    meshes.try_for_each(|(mesh, (tree, _))| write(Some(mesh), tree, &token.part(mesh.saturating_add(1), count)))
}

/// Writes a line for each node, with `before` in front.
fn write_csv_rows(
    before: &str,
    tree: &AnyTree,
    writer: &mut (impl Write + ?Sized),
    token: &CancelToken,
) -> io::Result<()> {
    let indices = tree.primitive_indices();
    let mut steps = Steps::silent(token);
    with_tree!(tree, tree => for_each_row(tree, token, |_, NodeRow(node, parent, depth, child, children, first, count), bounds| {
        let [parent, child] = [parent, child].map(|number| number.map_or_else(String::new, |number| number.to_string()));
        write!(writer, "{before}{node},{parent},{depth},{child},{children},{first},{count}")?;
        bounds.iter().try_for_each(|number| write!(writer, ",{number:?}"))?;
        let of_leaf = if child.is_empty() { &indices[first as usize..][..count as usize] } else { &[] };
        for (place, triangle) in of_leaf.iter().enumerate() {
            steps.step().map_err(io::Error::other)?;
            write!(writer, "{}{triangle}", if place == 0 { ',' } else { ' ' })?;
        }
        writeln!(writer, "{}", if of_leaf.is_empty() { "," } else { "" })
    }))
}

/// Writes the nodes of `tree` as a JSON object: the header's fields; `columns`, the names of [`write_nodes_csv`] up to the bounds;
/// `nodes`, a list of rows with these values, null where CSV has nothing; and `indices`, the primitives in leaf order.
///
/// # Errors
///
/// As [`write_tree`](super::write_tree).
pub fn write_nodes_json(
    tree: &AnyTree,
    header: &Header,
    writer: &mut (impl Write + ?Sized),
    token: &CancelToken,
) -> io::Result<()> {
    write_json_head(tree.container_kind(), header, writer)?;
    write_json_rows(tree, writer, token)?;
    writeln!(writer, "}}")
}

/// Writes the nodes of both levels of `trees` as a JSON object: the header's fields and `columns` as [`write_nodes_json`] has them; `trees`, a
/// list of objects with `mesh`, its number or null for the tree over the instances, which comes first, `nodes` and `indices`; and
/// `instances`, a list of rows of the mesh and the twelve numbers of the matrix.
///
/// # Errors
///
/// As [`write_tree`](super::write_tree).
pub fn write_level_nodes_json(
    trees: &TwoLevelTrees<'_>,
    header: &Header,
    writer: &mut (impl Write + ?Sized),
    token: &CancelToken,
) -> io::Result<()> {
    let triangles = trees.meshes.iter().map(|(_, triangles)| triangles.len()).fold(0, usize::saturating_add);
    let triangles = u32::try_from(triangles).unwrap_or(u32::MAX);
    write_json_head(trees.top.container_kind(), &Header { triangles, ..header.clone() }, writer)?;
    write!(writer, "\"trees\":[")?;
    for_each_tree(trees, token, |mesh, tree, token| {
        let before = if mesh.is_some() { ",\n" } else { "\n" };
        write!(writer, "{before}{{\"mesh\":{},", Value::from(mesh))?;
        write_json_rows(tree, writer, token)?;
        write!(writer, "}}")
    })?;
    write!(writer, "],\n\"instances\":[")?;
    let mut steps = Steps::silent(token);
    for (index, instance) in trees.instances.iter().enumerate() {
        steps.step().map_err(io::Error::other)?;
        write!(writer, "{}[{}", if index > 0 { ",\n" } else { "\n" }, instance.mesh)?;
        instance.matrix.as_flattened().iter().try_for_each(|number| write!(writer, ",{number:?}"))?;
        write!(writer, "]")?;
    }
    writeln!(writer, "]}}")
}

/// Writes the beginning of an object: the header's fields and `columns`.
fn write_json_head(kind: ContainerKind, header: &Header, writer: &mut (impl Write + ?Sized)) -> io::Result<()> {
    let columns = [&COLUMNS, bounds_columns(kind)].concat();
    let fields = json!({
        "container": kind.name(),
        "triangles": header.triangles,
        "builder": header.builder,
        "settings": header.settings,
        "build_ms": header.build_ms,
        "columns": columns,
    });
    write!(writer, "{{")?;
    for (name, value) in fields.as_object().into_iter().flatten().filter(|(_, value)| !value.is_null()) {
        write!(writer, "{}:{value},", Value::from(name.as_str()))?;
    }
    Ok(())
}

/// Writes `nodes` and `indices` of a tree.
fn write_json_rows(tree: &AnyTree, writer: &mut (impl Write + ?Sized), token: &CancelToken) -> io::Result<()> {
    write!(writer, "\"nodes\":[")?;
    with_tree!(tree, tree => for_each_row(tree, token, |index, row, bounds| {
        write!(writer, "{}", if index > 0 { ",\n" } else { "\n" })?;
        let text = serde_json::to_string(&row)?;
        write!(writer, "{}", text.trim_end_matches(']'))?;
        bounds.iter().try_for_each(|number| write!(writer, ",{number:?}"))?;
        write!(writer, "]")
    }))?;
    write!(writer, "],\n\"indices\":[")?;
    let mut steps = Steps::silent(token);
    for (index, primitive) in tree.primitive_indices().iter().enumerate() {
        steps.step().map_err(io::Error::other)?;
        write!(writer, "{}{primitive}", if index > 0 { "," } else { "" })?;
    }
    write!(writer, "]")
}

/// Calls `write` with each node, its number and the numbers of its bounds.
fn for_each_row<C: FileContainer>(
    tree: &Tree<C>,
    token: &CancelToken,
    mut write: impl FnMut(usize, NodeRow, &[f32]) -> io::Result<()>,
) -> io::Result<()> {
    let nodes = &tree.nodes;
    let list = || zeros::<u32>(nodes.len(), token).map_err(io::Error::other);
    let (mut parents, mut depths, mut firsts, mut counts) = (list()?, list()?, list()?, list()?);
    let mut steps = Steps::silent(token);
    for (number, node) in nodes.iter().enumerate() {
        steps.step().map_err(io::Error::other)?;
        for child in node.children() {
            parents[child as usize] = number as u32;
            depths[child as usize] = depths[number].saturating_add(1);
        }
    }
    // Backwards, so that children are done before their parents.
    for (number, node) in nodes.iter().enumerate().rev() {
        steps.step().map_err(io::Error::other)?;
        if node.is_leaf() {
            (firsts[number], counts[number]) = (node.first, node.count);
        } else {
            firsts[number] = firsts[node.first as usize];
            let sum = node.children().map(|child| counts[child as usize]).fold(0, u32::saturating_add);
            counts[number] = sum;
        }
    }
    let mut steps = Steps::new(token, nodes.len() as u64);
    for (index, node) in nodes.iter().enumerate() {
        steps.step().map_err(io::Error::other)?;
        let parent = (index > 0).then_some(parents[index]);
        let first_child = (!node.is_leaf()).then_some(node.first);
        let (number, arity) = (index as u32, node.arity());
        let row = NodeRow(number, parent, depths[index], first_child, arity, firsts[index], counts[index]);
        write(index, row, node.container.numbers())?;
    }
    Ok(())
}
