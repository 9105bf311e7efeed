//! The hierarchy of nodes: which meshes the scene shows, and where.

use glam::DMat4;

use super::document::Document;
use super::table::extension;
use crate::scene::error::{FileLocation, LoadError, Warnings};
use crate::scene::motion::Local;
use crate::scene::read::ModelFile;

/// Parent index of a node that the scene itself names.
const SCENE: usize = usize::MAX;

/// A mesh of the scene.
pub(super) struct Placement {
    pub(super) node: usize,
    pub(super) mesh: usize,
    /// From mesh space to the world.
    pub(super) transform: DMat4,
    /// Whether the file hides the node or one above it.
    pub(super) is_hidden: bool,
}

/// The nodes that the scene shows.
pub(super) struct Hierarchy {
    /// Every mesh, in the order of the hierarchy.
    pub(super) placements: Vec<Placement>,
    /// From the space of each node to the world; `None` for nodes outside the scene.
    pub(super) worlds: Vec<Option<DMat4>>,
    /// Index of the scene that is shown.
    pub(super) scene: usize,
    /// The nodes of the scene, each after its parent, whose place in this list it names.
    pub(super) order: Vec<Ordered>,
}

/// A node of the scene.
pub(super) struct Ordered {
    pub(super) node: usize,
    /// Place of the parent in the list; `None` for a node that the scene itself names.
    pub(super) parent: Option<usize>,
    /// Whether it is shown, as far as the node itself decides.
    pub(super) is_visible: bool,
}

/// Where the hierarchy names a node: in the scene or, by its parent, among the children.
#[derive(Clone, Copy)]
struct Mention {
    node: usize,
    parent: usize,
    /// From the parent's space to the world.
    transform: DMat4,
    /// Place of the parent in [`Hierarchy::order`].
    above: Option<usize>,
    /// Whether the parent or one above it is hidden.
    is_hidden: bool,
}

/// Walks the nodes of a scene, the default one if none is wanted.
pub(super) fn hierarchy(
    file: &ModelFile<'_>,
    document: &Document,
    warnings: &mut Warnings,
) -> Result<Hierarchy, LoadError> {
    let ModelFile { path, token, .. } = *file;
    let nodes = &document.gltf.as_json().nodes;
    let (mut stack, scene) = starts(&document.gltf, file.options.scene, warnings);
    // The parent of each visited node.
    let mut parents: Vec<Option<usize>> = vec![None; nodes.len()];
    let (mut placements, mut worlds, mut order) = (Vec::new(), vec![None; nodes.len()], Vec::new());
    while let Some(Mention { node: index, parent, transform, above, is_hidden }) = stack.pop() {
        token.check()?;
        let location = || FileLocation::Json(format!("nodes[{index}]"));
        if let Some(first) = parents[index] {
            let (problem, advice) = describe_second_parent(index, first, parent, &parents);
            return Err(LoadError::at(path, location(), problem, advice));
        }
        parents[index] = Some(parent);
        let transform = transform * document.locals.get(index).map(Local::transform).unwrap_or_default();
        if !transform.as_mat4().is_finite() {
            warnings.add("nodes placed by numbers that are not finite left out", location);
            continue;
        }
        worlds[index] = Some(transform);
        let is_visible = is_visible(&nodes[index]);
        let (own, is_hidden) = (Some(order.len()), is_hidden || !is_visible);
        order.push(Ordered { node: index, parent: above, is_visible });
        let children = nodes[index].children.iter().flatten().rev();
        let mention = |child: &gltf::json::Index<gltf::json::Node>| Mention {
            node: child.value(),
            parent: index,
            transform,
            above: own,
            is_hidden,
        };
        stack.extend(children.map(mention));
        if let Some(mesh) = &nodes[index].mesh {
            placements.push(Placement { node: index, mesh: mesh.value(), transform, is_hidden });
        }
    }
    if document.gltf.scenes().len() == 1 {
        let lost = |&index: &usize| parents[index].is_none() && nodes[index].mesh.is_some();
        let mut lost = (0..nodes.len()).filter(lost);
        if let Some(first) = lost.next() {
            let count = lost.count().saturating_add(1) as u64;
            let what = "nodes with a mesh outside the scene left out";
            warnings.add_many(count, what, || FileLocation::Json(format!("nodes[{first}]")));
        }
    }
    Ok(Hierarchy { placements, worlds, scene, order })
}

/// Whether a node is shown by KHR_node_visibility.
fn is_visible(node: &gltf::json::Node) -> bool {
    let extension = node.extensions.as_ref().and_then(|extensions| extensions.others.get(extension::VISIBILITY));
    extension.and_then(|extension| extension.get("visible")?.as_bool()).unwrap_or(true)
}

/// The nodes of the scene to be shown, the last first, and its index. Without scenes, the nodes that have no parent.
fn starts(document: &gltf::Document, wanted: Option<usize>, warnings: &mut Warnings) -> (Vec<Mention>, usize) {
    let start =
        |node: usize| Mention { node, parent: SCENE, transform: DMat4::IDENTITY, above: None, is_hidden: false };
    let chosen = wanted.and_then(|wanted| document.scenes().nth(wanted));
    if let (Some(wanted), None) = (wanted, &chosen) {
        let count = document.scenes().len();
        warnings.add("scenes wanted that do not exist, the default one shown", || {
            FileLocation::in_json("scenes", format_args!("scene {wanted} does not exist, there are {count}"))
        });
    }
    if let Some(scene) = chosen.or_else(|| document.default_scene()).or_else(|| document.scenes().next()) {
        let others = document.scenes().len().saturating_sub(1) as u64;
        let first = usize::from(scene.index() == 0);
        let what = if wanted.is_some() {
            "scenes other than the wanted one not shown"
        } else {
            "scenes other than the default one not shown"
        };
        warnings.add_many(others, what, || FileLocation::Json(format!("scenes[{first}]")));
        let mut steps: Vec<Mention> = scene.nodes().map(|node| start(node.index())).collect();
        steps.reverse();
        return (steps, scene.index());
    }
    let nodes = &document.as_json().nodes;
    let mut is_root = vec![true; nodes.len()];
    for child in nodes.iter().flat_map(|node| node.children.iter().flatten()) {
        is_root[child.value()] = false;
    }
    let mut steps: Vec<Mention> = (0..nodes.len()).rev().filter(|&index| is_root[index]).map(start).collect();
    if steps.is_empty() && !nodes.is_empty() {
        // Every node has a parent, so there is a cycle, which is reported from any of its nodes.
        steps.push(start(0));
    }
    (steps, 0)
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
