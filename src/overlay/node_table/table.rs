//! What the overlay knows of one tree: who stands at which depth, and on demand everything it draws of a node.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

use crate::accel::Accel;
use crate::overlay::node::OverlayNode;
use crate::overlay::settings::{ColorBy, OverlaySettings};
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::{Aabb, Sphere, Triangle};
use bvhscope_engine::kernel::par_collect;
use bvhscope_engine::tree::levels::Levels;
use bvhscope_engine::tree::{AnyTree, Container, ContainerKind, Node, Tree};
use bvhscope_engine::with_tree;

/// Every node of one tree by depth. Making it is part of every rebuild, so it holds the indices of the first depths only; those of
/// the others, containers of the kind that the tree is not made of, parents and primitive counts are computed when first
/// asked for.
#[derive(Debug)]
pub struct NodeTable {
    /// The nodes of the tree by depth.
    pub(super) levels: Levels,
    /// Unique for each table, to tell whether it has been uploaded.
    pub id: u64,
    pub(super) accel: Arc<Accel>,
    boxes: OnceLock<Vec<Aabb>>,
    spheres: OnceLock<Vec<Sphere>>,
}

impl NodeTable {
    /// Lists the first depths of `accel`'s tree.
    pub fn new(accel: &Arc<Accel>) -> Self {
        static NEXT_ID: AtomicU64 = AtomicU64::new(1);
        Self {
            levels: with_tree!(&accel.tree, tree => Levels::new(tree, &accel.report.stats.nodes_per_depth)),
            id: NEXT_ID.fetch_add(1, Ordering::Relaxed),
            accel: Arc::clone(accel),
            boxes: OnceLock::new(),
            spheres: OnceLock::new(),
        }
    }

    /// Lists what [`NodeTable::shown`] takes for `settings`, or all nodes, unless `token` is cancelled.
    pub fn list(&self, settings: Option<&OverlaySettings>, token: &CancelToken) -> Result<(), Cancelled> {
        let all = self.levels.ranges.last().map_or(0, |range| range.end);
        let count = settings.map_or(all, |settings| self.needed(settings));
        with_tree!(&self.accel.tree, tree => self.levels.list(tree, count, token))
    }

    /// How many of the list's nodes [`NodeTable::shown`] takes for `settings`.
    fn needed(&self, settings: &OverlaySettings) -> u32 {
        if self.is_empty() {
            return 0;
        }
        let (_, [from, last]) = self.depths(settings);
        let depth = if self.is_cut_from_the_top(settings, self.wanted(settings)) { from } else { last };
        self.levels.ranges[depth as usize].end
    }

    /// The first nodes of the list that goes depth by depth, `count` of them or more, within a depth in the order of the tree.
    pub fn by_depth(&self, count: u32) -> &[u32] {
        with_tree!(&self.accel.tree, tree => self.levels.first(tree, count))
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.accel.tree.node_count()
    }

    /// Whether the tree has no nodes.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Depth of the deepest node; 0 for an empty tree.
    pub fn max_depth(&self) -> u32 {
        self.levels.ranges.len().saturating_sub(1) as u32
    }

    /// Which container the tree is made of.
    pub fn container_kind(&self) -> ContainerKind {
        self.accel.tree.container_kind()
    }

    /// Whether `node` holds primitives rather than nodes.
    pub fn is_leaf(&self, node: u32) -> bool {
        with_tree!(&self.accel.tree, tree => tree.nodes[node as usize].is_leaf())
    }

    /// The two children; `None` for a leaf.
    pub fn children(&self, node: u32) -> Option<[u32; 2]> {
        with_tree!(&self.accel.tree, tree => {
            let node = &tree.nodes[node as usize];
            (!node.is_leaf()).then_some([node.first, node.first + 1])
        })
    }

    /// The node above; `None` for the root and where there is no such node.
    pub fn parent(&self, node: u32) -> Option<u32> {
        if node == 0 || node as usize >= self.len() {
            return None;
        }
        match self.accel.known_ancestry() {
            Some(ancestry) => ancestry.parents.get(node as usize).copied(),
            None => self.path(node).iter().rev().nth(1).copied(),
        }
    }

    /// The other child of the same parent; `None` for the root and where there is no such node.
    pub fn sibling(&self, node: u32) -> Option<u32> {
        // The root is node 0 and all others are in pairs of neighbours: 1 and 2, 3 and 4, and so on.
        (node > 0 && (node as usize) < self.len()).then(|| ((node - 1) ^ 1) + 1)
    }

    /// Depth of `node`, root 0.
    pub fn depth(&self, node: u32) -> u32 {
        match self.accel.known_ancestry() {
            Some(ancestry) => ancestry.depth(node),
            None => self.path(node).len().saturating_sub(1) as u32,
        }
    }

    /// The nodes from the root to `node`: down to one of the triangles below it, past `node`.
    fn path(&self, node: u32) -> Vec<u32> {
        let primitive = self.accel.tree.first_primitive_below(node);
        let mut path = primitive.map_or_else(Vec::new, |primitive| self.accel.path_to(primitive));
        let end = path.iter().position(|&step| step == node).map_or(0, |at| at + 1);
        path.truncate(end);
        path
    }

    /// Number of primitives below `node`. Reads the whole tree when an interior node is asked for the first time.
    pub fn primitives(&self, node: u32) -> u32 {
        self.known_primitives(node).unwrap_or_else(|| self.accel.ancestry().primitive_counts[node as usize])
    }

    /// Number of primitives below `node` where that is known without reading the tree.
    pub fn known_primitives(&self, node: u32) -> Option<u32> {
        if node == 0 {
            return Some(self.accel.tree.primitive_indices().len() as u32);
        }
        let own = with_tree!(&self.accel.tree, tree => tree.nodes[node as usize].count);
        let counts = || Some(self.accel.known_ancestry()?.primitive_counts[node as usize]);
        if self.is_leaf(node) { Some(own) } else { counts() }
    }

    /// Makes everything that [`NodeTable::drawable`] leaves out of `settings`, in the calling thread's rayon pool.
    pub fn prepare(&self, settings: &OverlaySettings, token: &CancelToken) -> Result<(), Cancelled> {
        let [boxes, spheres] = [ContainerKind::Aabb, ContainerKind::Sphere].map(|kind| kind != self.container_kind());
        if boxes && settings.show_boxes || spheres && settings.show_spheres {
            self.complete(token)?;
        }
        if settings.color_by == ColorBy::Primitives {
            self.accel.compute_ancestry(token)?;
        }
        self.list(Some(settings), token)
    }

    /// Makes known what lies below each node.
    pub fn study(&self, token: &CancelToken) -> Result<(), Cancelled> {
        self.accel.compute_ancestry(token).map(|_| ())
    }

    /// Makes the containers of the kind that the tree is not made of, in the calling thread's rayon pool.
    pub fn complete(&self, token: &CancelToken) -> Result<(), Cancelled> {
        let triangles = &self.accel.scene.triangles;
        match &self.accel.tree {
            AnyTree::Aabb(tree) if self.spheres.get().is_none() => {
                let spheres = containers(tree, triangles, token)?;
                self.spheres.get_or_init(|| spheres);
            }
            AnyTree::Sphere(tree) if self.boxes.get().is_none() => {
                let boxes = containers(tree, triangles, token)?;
                self.boxes.get_or_init(|| boxes);
            }
            _ => {}
        }
        Ok(())
    }

    /// `settings` without what takes a pass over the tree that [`NodeTable::prepare`] has not made yet: containers of the kind that
    /// the tree is not made of, numbers of primitives, depths below those that are listed.
    pub fn drawable(&self, settings: &OverlaySettings) -> OverlaySettings {
        let is_complete = self.spheres.get().is_some() || self.boxes.get().is_some();
        let own = self.container_kind();
        let listed = self.levels.ranges.partition_point(|range| range.end <= self.levels.listed());
        let deepest = listed.saturating_sub(1) as u32;
        let is_listed = self.needed(settings) <= self.levels.listed();
        let is_counted = settings.color_by != ColorBy::Primitives || self.accel.known_ancestry().is_some();
        OverlaySettings {
            depth: if is_listed { settings.depth } else { settings.depth.map(|depth| depth.min(deepest)) },
            color_by: if is_counted { settings.color_by } else { ColorBy::Depth },
            show_boxes: settings.show_boxes && (is_complete || own == ContainerKind::Aabb),
            show_spheres: settings.show_spheres && (is_complete || own == ContainerKind::Sphere),
            ..*settings
        }
    }

    /// The box around `node`: the tree's own, or for a tree of spheres exactly around the triangles below.
    pub fn node_box(&self, node: u32) -> Aabb {
        match &self.accel.tree {
            AnyTree::Aabb(tree) => tree.nodes[node as usize].container,
            AnyTree::Sphere(tree) => self.boxes.get_or_init(|| containers_at_once(tree, &self.accel))[node as usize],
        }
    }

    /// The sphere around `node`: the tree's own, or for a tree of boxes merged bottom-up from the triangles' spheres.
    pub fn node_sphere(&self, node: u32) -> Sphere {
        match &self.accel.tree {
            AnyTree::Sphere(tree) => tree.nodes[node as usize].container,
            AnyTree::Aabb(tree) => self.spheres.get_or_init(|| containers_at_once(tree, &self.accel))[node as usize],
        }
    }

    /// A box around `node`'s own container; `None` where there is no such node.
    pub fn bounds(&self, node: u32) -> Option<Aabb> {
        with_tree!(&self.accel.tree, tree => tree.nodes.get(node as usize).map(|node| node.container.bounds()))
    }

    /// Surface area of `node`'s own container over the root's, 0 to 1.
    pub fn area_share(&self, node: u32) -> f32 {
        with_tree!(&self.accel.tree, tree => share(area(tree, node), area(tree, 0)))
    }

    /// Overlap of `node`'s own container with its sibling's, as a share of its own area, 0 to 1; 0 for the root.
    pub fn overlap(&self, node: u32) -> f32 {
        let Some(sibling) = self.sibling(node) else { return 0.0 };
        with_tree!(&self.accel.tree, tree => {
            let [own, other] = [node, sibling].map(|node| &tree.nodes[node as usize].container);
            share(own.overlap(other), own.relative_area())
        })
    }

    /// `node`, which is `depth` deep, as the shaders read it. A container of the kind that the tree is not made of, and the number of primitives, are
    /// zero unless `settings` show them: they cost a pass over the tree.
    pub fn instance(&self, node: u32, depth: u32, settings: &OverlaySettings) -> OverlayNode {
        let own = self.container_kind();
        let nothing = Aabb { min: glam::Vec3::ZERO, max: glam::Vec3::ZERO };
        let bounds = if settings.show_boxes || own == ContainerKind::Aabb { self.node_box(node) } else { nothing };
        let sphere = if settings.show_spheres || own == ContainerKind::Sphere {
            self.node_sphere(node)
        } else {
            Sphere { center: glam::Vec3::ZERO, radius: 0.0 }
        };
        OverlayNode {
            box_min: bounds.min.to_array(),
            depth,
            box_max: bounds.max.to_array(),
            primitives: if settings.color_by == ColorBy::Primitives { self.primitives(node) } else { 0 },
            sphere_center: sphere.center.to_array(),
            sphere_radius: sphere.radius,
            node,
            flags: u32::from(self.is_leaf(node)),
            area_share: self.area_share(node),
            overlap: self.overlap(node),
        }
    }
}

/// Poll for cancellation every 16,384 nodes.
const NODES_PER_CHECK: usize = 1 << 14;

pub(super) fn area<C: Container>(tree: &Tree<C>, node: u32) -> f32 {
    tree.nodes[node as usize].container.relative_area().max(0.0)
}

/// `part / whole` between 0 and 1; 1 where the whole has no area.
fn share(part: f32, whole: f32) -> f32 {
    if whole > 0.0 { (part / whole).clamp(0.0, 1.0) } else { 1.0 }
}

/// Containers of kind `C` for the nodes of a tree of another kind over `triangles`: leaves around theirs, then bottom-up.
fn containers<K: Container, C: Container>(
    tree: &Tree<K>,
    triangles: &[Triangle],
    token: &CancelToken,
) -> Result<Vec<C>, Cancelled> {
    let of_leaf = |node: &Node<K>| {
        let own = &tree.primitive_indices[node.first as usize..(node.first + node.count) as usize];
        own.iter().fold(C::EMPTY, |all, &index| all.union(&C::of_triangle(&triangles[index as usize])))
    };
    let mut all = par_collect(tree.nodes.len(), token, |at| {
        let node = &tree.nodes[at];
        if node.is_leaf() { of_leaf(node) } else { C::EMPTY }
    })?;
    for (index, node) in tree.nodes.iter().enumerate().rev() {
        if index.is_multiple_of(NODES_PER_CHECK) {
            token.check()?;
        }
        if !node.is_leaf() {
            all[index] = all[node.first as usize].union(&all[node.first as usize + 1]);
        }
    }
    Ok(all)
}

/// [`containers`], however long it takes.
fn containers_at_once<K: Container, C: Container>(tree: &Tree<K>, accel: &Accel) -> Vec<C> {
    containers(tree, &accel.scene.triangles, &CancelToken::new()).unwrap_or_else(|_| unreachable!("nobody cancels"))
}
