//! The hierarchy of nodes: which meshes the scene shows, and where.

use std::path::Path;

use glam::{Mat4, Quat, Vec3};

use super::json::Whole;
use super::place::place;
use super::schema::{Node, Root};
use crate::scene::error::{FileLocation, LoadError, Warnings};
use bvhscope_engine::cancel::CancelToken;

/// Parent index of a node that the scene itself names.
const SCENE: usize = usize::MAX;

/// A mesh of the scene.
pub(super) struct Placement {
    pub(super) node: usize,
    /// An index into the meshes that exists.
    pub(super) mesh: usize,
    /// From mesh space to the world.
    pub(super) transform: Mat4,
}

/// Where the hierarchy names a node: in the scene or, by its parent, among the children.
#[derive(Clone, Copy)]
struct Step {
    node: usize,
    parent: usize,
    /// Position in the list that names it.
    position: usize,
    /// From the parent's space to the world.
    transform: Mat4,
}

/// Every mesh that the nodes of the scene refer to, in the order of the hierarchy.
pub(super) fn placements(
    path: &Path,
    root: &Root,
    warnings: &mut Warnings,
    token: &CancelToken,
) -> Result<Vec<Placement>, LoadError> {
    let nodes = &root.nodes;
    let (list, mut stack) = starts(root, warnings);
    // The parent of each visited node.
    let mut parents: Vec<Option<usize>> = vec![None; nodes.len()];
    let mut placements = Vec::new();
    while let Some(Step { node: index, parent, position, transform }) = stack.pop() {
        token.check()?;
        let location = || FileLocation::Json(format!("nodes[{index}]"));
        let Some(node) = nodes.get(index) else {
            let list = if parent == SCENE { list.clone() } else { format!("nodes[{parent}].children") };
            let detail = format!("nodes[{index}] does not exist, there are {}", nodes.len());
            warnings.add("nodes out of range left out", || place(format!("{list}[{position}]"), &detail));
            continue;
        };
        if let Some(first) = parents[index] {
            let (problem, advice) = describe_second_parent(index, first, parent, &parents);
            return Err(LoadError::at(path, location(), problem, advice));
        }
        parents[index] = Some(parent);
        let transform = transform * local_transform(node);
        if !transform.is_finite() {
            warnings.add("nodes placed by numbers that are not finite left out", location);
            continue;
        }
        let children = node.children.iter().enumerate().rev();
        stack.extend(children.map(|(position, child)| Step { node: child.get(), parent: index, position, transform }));
        let Some(mesh) = node.mesh.map(Whole::get) else { continue };
        if mesh >= root.meshes.len() {
            let detail = format!("meshes[{mesh}] does not exist, there are {}", root.meshes.len());
            warnings
                .add("nodes of a mesh that does not exist left out", || place(format!("nodes[{index}].mesh"), &detail));
            continue;
        }
        if node.skin.is_some() {
            let what = "meshes with a skeleton shown in rest pose";
            warnings.add(what, || FileLocation::Json(format!("nodes[{index}].skin")));
        }
        placements.push(Placement { node: index, mesh, transform });
    }
    if root.scenes.len() == 1 {
        let lost = (0..nodes.len()).filter(|&index| parents[index].is_none() && nodes[index].mesh.is_some());
        let (mut first, mut count) = (None, 0_u64);
        for index in lost {
            first = first.or(Some(index));
            count = count.saturating_add(1);
        }
        let what = "nodes with a mesh outside the scene left out";
        warnings.add_many(count, what, || FileLocation::Json(format!("nodes[{}]", first.unwrap_or(0))));
    }
    Ok(placements)
}

/// The nodes of the scene to be shown, the last first, and the list that names them. Without scenes, the nodes that have no
/// parent.
fn starts(root: &Root, warnings: &mut Warnings) -> (String, Vec<Step>) {
    let wanted = root.scene.map_or(0, Whole::get);
    if wanted >= root.scenes.len() && root.scene.is_some() {
        let detail = format!("scenes[{wanted}] does not exist, there are {}", root.scenes.len());
        warnings.add("scenes out of range replaced by the first", || place("scene", &detail));
    }
    let start = |position: usize, node: usize| Step { node, parent: SCENE, position, transform: Mat4::IDENTITY };
    let shown = if wanted < root.scenes.len() { wanted } else { 0 };
    if let Some(scene) = root.scenes.get(shown) {
        let others = root.scenes.len().saturating_sub(1) as u64;
        let first = usize::from(shown == 0);
        warnings.add_many(others, "scenes other than the default one not shown", || {
            FileLocation::Json(format!("scenes[{first}]"))
        });
        let steps = scene.nodes.iter().enumerate().rev().map(|(position, node)| start(position, node.get()));
        return (format!("scenes[{shown}].nodes"), steps.collect());
    }
    let mut is_root = vec![true; root.nodes.len()];
    for child in root.nodes.iter().flat_map(|node| node.children.iter()) {
        if let Some(is_root) = is_root.get_mut(child.get()) {
            *is_root = false;
        }
    }
    let mut steps: Vec<Step> =
        (0..is_root.len()).rev().filter(|&index| is_root[index]).map(|node| start(0, node)).collect();
    if steps.is_empty() && !is_root.is_empty() {
        // Every node has a parent, so there is a cycle, which is reported from any of its nodes.
        steps.push(start(0, 0));
    }
    ("nodes".to_owned(), steps)
}

/// The error message about a node that was reached from parent `first` and again from parent `second`.
fn describe_second_parent(
    index: usize,
    first: usize,
    second: usize,
    parents: &[Option<usize>],
) -> (String, &'static str) {
    // If the way up from the second parent leads back to the node, there is a cycle.
    let mut path = vec![index];
    let mut ancestor = second;
    while ancestor != index {
        path.push(ancestor);
        let Some(parent) = parents.get(ancestor).copied().flatten() else {
            let owner = |node| if node == SCENE { "the scene".to_owned() } else { format!("nodes[{node}]") };
            return if first == second {
                (format!("is named twice by {}", owner(first)), "name it once")
            } else {
                (format!("has two parents, {} and {}", owner(first), owner(second)), "copy it for one of them")
            };
        };
        ancestor = parent;
    }
    path.push(index);
    let names: Vec<String> = path.iter().rev().map(|node| format!("nodes[{node}]")).collect();
    // A long path is abbreviated in the middle.
    let text = if names.len() <= 8 {
        names.join(" → ")
    } else {
        format!("{} → … → {}", names[..4].join(" → "), names[names.len().saturating_sub(3)..].join(" → "))
    };
    (format!("stands below itself: {text} is a loop"), "take it out of the children of one of them")
}

fn local_transform(node: &Node) -> Mat4 {
    if let Some(matrix) = &node.matrix {
        return Mat4::from_cols_array(&matrix.0);
    }
    let rotation = node.rotation.map_or(Quat::IDENTITY, |quaternion| rotation(quaternion.0));
    let scale = node.scale.map_or(Vec3::ONE, |scale| Vec3::from_array(scale.0));
    let translation = node.translation.map_or(Vec3::ZERO, |translation| Vec3::from_array(translation.0));
    Mat4::from_scale_rotation_translation(scale, rotation, translation)
}

/// The rotation by a quaternion, which is normalised first; none if it has no direction.
pub(super) fn rotation(numbers: [f32; 4]) -> Quat {
    let quaternion = Quat::from_array(numbers);
    let length = quaternion.length();
    if length > 0.0 && length.is_finite() { quaternion / length } else { Quat::IDENTITY }
}
