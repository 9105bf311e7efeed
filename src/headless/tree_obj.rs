//! The boxes of trees as an OBJ file: an object for each depth, whose lines are the edges of the boxes.

use std::io::{self, Write};

use glam::{DVec3, Vec3};

use super::context::Failure;
use crate::accel::Accel;
use crate::accel::written::FileTrees;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::Aabb;
use bvhscope_engine::tree::Tree;
use bvhscope_engine::{AnyTree, ContainerKind};

/// Boxes of a file, of about 400 bytes each, that programs for models still open.
const MAX_BOXES: u64 = 4_000_000;

/// The edges of a box: corners are numbered by the bits of x, y and z that are the larger ones, back from the last corner.
const EDGES: [[i32; 2]; 12] = [
    [-8, -7],
    [-6, -5],
    [-4, -3],
    [-2, -1],
    [-8, -6],
    [-7, -5],
    [-4, -2],
    [-3, -1],
    [-8, -4],
    [-7, -3],
    [-6, -2],
    [-5, -1],
];

/// Why the boxes of `trees` are not written.
pub(super) fn refusal(accel: &Accel, trees: &FileTrees<'_>) -> Option<Failure> {
    let kind = trees.top().container_kind();
    let failed = |text: String| Some(Failure::Failed(format!("{}: {text}", accel.scene.source)));
    if kind != ContainerKind::Aabb {
        return failed(format!(
            "an OBJ file holds boxes, and the tree has {}; write another kind of file",
            kind.plural()
        ));
    }
    let mut boxes = trees.top().node_count() as u64;
    if let Some(levels) = trees.levels() {
        let nodes = |mesh: u32| levels.meshes[mesh as usize].0.node_count() as u64;
        boxes += levels.instances.iter().map(|instance| nodes(instance.mesh)).sum::<u64>();
    }
    if boxes > MAX_BOXES {
        return failed(format!(
            "there are {boxes} boxes, and an OBJ file gets {MAX_BOXES} at most; write a .bvh, or take a smaller model"
        ));
    }
    None
}

/// Writes the boxes of `trees`, those of meshes where each copy stands, in the coordinates of the model's file.
pub(super) fn write_boxes(
    accel: &Accel,
    trees: &FileTrees<'_>,
    writer: &mut dyn Write,
    token: &CancelToken,
) -> io::Result<()> {
    let offset = accel.scene.offset;
    let levels = trees.levels();
    let name = if levels.is_some() { "copies" } else { "tree" };
    write_tree(trees.top(), name, &[&|corner| corner], offset, writer, token)?;
    let Some((levels, scene)) = levels.zip(accel.scene.copies.as_ref()) else { return Ok(()) };
    let copies = scene.copies();
    let mut of_mesh: Vec<Vec<u32>> = vec![Vec::new(); levels.meshes.len()];
    for copy in 0..copies.len() as u32 {
        of_mesh[copies.mesh(copy) as usize].push(copy);
    }
    for (mesh, (tree, _)) in levels.meshes.iter().enumerate() {
        let places: Vec<_> =
            of_mesh[mesh].iter().map(|&copy| move |corner: Vec3| copies.place(copy).point(corner)).collect();
        let places: Vec<&dyn Fn(Vec3) -> Vec3> = places.iter().map(|place| place as &dyn Fn(Vec3) -> Vec3).collect();
        write_tree(tree, &format!("mesh_{mesh}"), &places, offset, writer, token)?;
    }
    Ok(())
}

/// Writes an object for each depth of `tree`, with its boxes at each of `places`.
fn write_tree(
    tree: &AnyTree,
    name: &str,
    places: &[&dyn Fn(Vec3) -> Vec3],
    offset: DVec3,
    writer: &mut dyn Write,
    token: &CancelToken,
) -> io::Result<()> {
    let AnyTree::Aabb(tree) = tree else { return Ok(()) };
    for (depth, nodes) in by_depth(tree, token)?.into_iter().enumerate() {
        writeln!(writer, "o {name}_depth_{depth}")?;
        for (index, node) in nodes.into_iter().enumerate() {
            for place in places {
                token.check_every(1 << 12, index).map_err(io::Error::other)?;
                write_box(&tree.nodes[node as usize].container, place, offset, writer)?;
            }
        }
    }
    Ok(())
}

/// The nodes of each depth.
fn by_depth(tree: &Tree<Aabb>, token: &CancelToken) -> io::Result<Vec<Vec<u32>>> {
    let mut nodes: Vec<Vec<u32>> = Vec::new();
    for (node, depth) in (0_u32..).zip(tree.depths(token).map_err(io::Error::other)?) {
        let depth = depth as usize;
        if nodes.len() <= depth {
            nodes.resize(depth + 1, Vec::new());
        }
        nodes[depth].push(node);
    }
    Ok(nodes)
}

fn write_box(bounds: &Aabb, place: &dyn Fn(Vec3) -> Vec3, offset: DVec3, writer: &mut dyn Write) -> io::Result<()> {
    for corner in 0..8 {
        let side = |axis: usize| if corner >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] };
        let point = place(Vec3::new(side(0), side(1), side(2)));
        if offset == DVec3::ZERO {
            // The digits of single precision.
            writeln!(writer, "v {:?} {:?} {:?}", point.x, point.y, point.z)?;
        } else {
            let point = point.as_dvec3() + offset;
            writeln!(writer, "v {:?} {:?} {:?}", point.x, point.y, point.z)?;
        }
    }
    EDGES.iter().try_for_each(|[from, to]| writeln!(writer, "l {from} {to}"))
}
