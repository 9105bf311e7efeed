//! The overlay's view of one tree: its nodes by depth and, on demand, everything that is drawn of a node.

use std::collections::HashSet;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use crate::accel::Accel;
use crate::accel::node_values::{KnownVisits, NodeValues};
use crate::catalog::metrics::Source;
use crate::overlay::node::OverlayNode;
use crate::overlay::selection::Selection;
use crate::overlay::settings::{ColorBy, OverlaySettings};
use crate::visibility::{TriangleSet, Visibility};
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::{Aabb, Dop14, OrientedBox, OrientedKind, Sphere};
use bvhscope_engine::layouts::KeptNodes;
use bvhscope_engine::tree::levels::Levels;
use bvhscope_engine::tree::{AnyTree, Container, ContainerKind, Tree, node_metrics};
use bvhscope_engine::with_tree;

/// Hidden nodes, the isolated one, the triangles shown alone, and what follows from them.
type LastVisibility = (HashSet<u32>, Option<u32>, Option<Arc<TriangleSet>>, Arc<Visibility>);

/// The nodes of one tree by depth. It is made for every rebuild, so only the indices of the first levels are listed then; those
/// of deeper levels, containers of the other kind, parents and primitive counts are computed on first use.
///
/// The table of a layout has the nodes that it keeps, by the numbers of the binary tree, with the depths, parents, children and boxes
/// that they have in the wide tree.
#[derive(Debug)]
pub struct NodeTable {
    /// The nodes of the tree by depth.
    pub(super) levels: Levels,
    /// Unique id, by which the GPU side recognises an uploaded table.
    pub id: u64,
    pub(super) accel: Arc<Accel>,
    /// The nodes that a layout keeps; `None` for all of the tree.
    pub(super) kept: Option<Arc<KeptNodes>>,
    pub(super) boxes: OnceLock<Vec<Aabb>>,
    pub(super) spheres: OnceLock<Vec<Sphere>>,
    pub(super) dops: OnceLock<Vec<Dop14>>,
    /// Measured visits of the nodes, see [`NodeTable::set_visits`].
    visits: Mutex<Option<KnownVisits>>,
    /// The last result of [`NodeTable::visibility`], with the selection's hidden and isolated nodes.
    visibility: Mutex<Option<LastVisibility>>,
}

impl NodeTable {
    /// Lists the first levels of `accel`'s tree.
    pub fn new(accel: &Arc<Accel>) -> Self {
        let levels = with_tree!(&accel.tree, tree => Levels::new(tree, &accel.report.stats.nodes_per_depth));
        Self::of_levels(accel, levels, None)
    }

    pub(super) fn of_levels(accel: &Arc<Accel>, levels: Levels, kept: Option<Arc<KeptNodes>>) -> Self {
        static NEXT_ID: AtomicU64 = AtomicU64::new(1);
        Self {
            levels,
            id: NEXT_ID.fetch_add(1, Ordering::Relaxed),
            accel: Arc::clone(accel),
            kept,
            boxes: OnceLock::new(),
            spheres: OnceLock::new(),
            dops: OnceLock::new(),
            visits: Mutex::new(None),
            visibility: Mutex::new(None),
        }
    }

    /// Lists the nodes that [`NodeTable::shown`] needs for `settings`, or all nodes for `None`, unless `token` is cancelled.
    pub fn list(&self, settings: Option<&OverlaySettings>, token: &CancelToken) -> Result<(), Cancelled> {
        let all = self.levels.ranges.last().map_or(0, |range| range.end);
        let count = settings.map_or(all, |settings| self.needed(settings));
        with_tree!(&self.accel.tree, tree => self.levels.list(tree, count, token))
    }

    /// Length of the prefix of the list that [`NodeTable::shown`] needs for `settings`.
    fn needed(&self, settings: &OverlaySettings) -> u32 {
        if self.is_empty() {
            return 0;
        }
        let (_, [from, last]) = self.depths(settings);
        let depth = if self.is_cut_from_the_top(settings) { from } else { last };
        self.levels.ranges[depth as usize].end
    }

    /// At least the first `count` nodes in order of depth; within a depth in the order of the tree.
    pub fn by_depth(&self, count: u32) -> &[u32] {
        with_tree!(&self.accel.tree, tree => self.levels.first(tree, count))
    }

    /// The tree.
    pub fn accel(&self) -> &Arc<Accel> {
        &self.accel
    }

    /// Takes the visits of the nodes that were measured last, which colours may stand for; `None` where they are not known.
    pub fn set_visits(&self, visits: Option<KnownVisits>) {
        *self.visits.lock().unwrap_or_else(PoisonError::into_inner) = visits;
    }

    /// The visits of the nodes, where they are known.
    pub fn visits(&self) -> Option<KnownVisits> {
        self.visits.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// The numbers of the nodes.
    pub(super) fn values<'a>(&'a self, visits: Option<&'a KnownVisits>) -> NodeValues<'a> {
        NodeValues { accel: &self.accel, visits: visits.map(|visits| &*visits.0) }
    }

    /// Number of nodes at each depth.
    pub fn nodes_per_depth(&self) -> impl ExactSizeIterator<Item = u32> {
        self.levels.ranges.iter().map(|range| range.len() as u32)
    }

    /// Number of nodes of the tree, those that a layout does not keep included.
    pub fn len(&self) -> usize {
        self.accel.tree.node_count()
    }

    /// The tree has no nodes.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Depth of the deepest node; 0 for an empty tree.
    pub fn max_depth(&self) -> u32 {
        self.levels.ranges.len().saturating_sub(1) as u32
    }

    /// The nodes and triangles that `selection` hides; `None` for none. The same as the last time as long as the same nodes are hidden,
    /// so that it can be compared by identity. Takes a pass over the tree otherwise.
    pub fn visibility(&self, selection: &Selection) -> Option<Arc<Visibility>> {
        if !selection.hides_any() {
            return None;
        }
        let mut last = self.visibility.lock().unwrap_or_else(PoisonError::into_inner);
        let Selection { hidden, isolated, only, .. } = selection;
        if let Some((last_hidden, last_isolated, last_only, visibility)) = &*last
            && (last_hidden, last_isolated, last_only) == (hidden, isolated, only)
        {
            return Some(Arc::clone(visibility));
        }
        let visibility = Arc::new(Visibility::new(&self.accel, hidden, *isolated, only.as_deref()));
        *last = Some((hidden.clone(), *isolated, only.clone(), Arc::clone(&visibility)));
        Some(visibility)
    }

    /// The triangles in the subtree of `node`, none for indices beyond the tree.
    pub fn triangles_below(&self, node: u32) -> TriangleSet {
        let mut triangles = TriangleSet::none(self.accel.scene.triangles.len());
        self.collect_triangles(&mut vec![node], &mut triangles, usize::MAX);
        triangles
    }

    /// First and last depth that suit the tree: where all nodes are drawn, of levels with about as many containers as can be told
    /// apart on a screen; where only leaves are, of all leaves, of which [`NodeTable::shown`] takes the largest.
    pub fn automatic_depths(&self, leaves_only: bool) -> [u32; 2] {
        let counts = || self.levels.ranges.iter().map(ExactSizeIterator::len);
        if leaves_only { self.leaf_depths().unwrap_or_default() } else { self.depths_of_few(counts()) }
    }

    /// Most containers that can be told apart on a screen: 200 boxes of either kind, 100 polytopes, or 60 spheres.
    pub(super) fn suits(&self) -> usize {
        match self.container_kind() {
            ContainerKind::Aabb | ContainerKind::Oriented => 200,
            ContainerKind::Sphere => 60,
            ContainerKind::Dop14 => 100,
        }
    }

    /// The deepest level above the first one with more containers than can be told apart on a screen, and as many above it as together
    /// have no more, where each level has as many as `counts` says.
    pub fn depths_of_few(&self, counts: impl Iterator<Item = usize>) -> [u32; 2] {
        let most = self.suits();
        let above: Vec<usize> = counts.take_while(|&count| count <= most).collect();
        let last = above.len().saturating_sub(1);
        let mut in_all = 0;
        let fits = |&count: &usize| {
            in_all += count;
            in_all <= most
        };
        let levels = above.into_iter().rev().take_while(fits).count();
        [(last + 1).saturating_sub(levels) as u32, last as u32]
    }

    /// First and last depth at which there are leaves; `None` for an empty tree.
    pub fn leaf_depths(&self) -> Option<[u32; 2]> {
        let first = match &self.kept {
            Some(kept) => kept.first_leaf_depth()?,
            None => self.accel.report.stats.min_leaf_depth,
        };
        (!self.is_empty()).then(|| [first, self.max_depth()])
    }

    /// First and last depth of `settings` in this tree, in order and clamped; the levels above that "parents" adds not included.
    pub fn drawn_depths(&self, settings: &OverlaySettings) -> [u32; 2] {
        let [a, b] = settings
            .depth
            .unwrap_or_else(|| self.automatic_depths(settings.leaves_only))
            .map(|depth| depth.min(self.max_depth()));
        [a.min(b), a.max(b)]
    }

    /// The container kind of the tree.
    pub fn container_kind(&self) -> ContainerKind {
        self.accel.tree.container_kind()
    }

    /// The nodes that stick out of their parents, or out of which triangles stick.
    pub fn faulty(&self) -> impl Iterator<Item = u32> + '_ {
        self.accel.faults().iter().flat_map(|fault| fault.nodes.iter().copied())
    }

    /// `node` is a leaf.
    pub fn is_leaf(&self, node: u32) -> bool {
        if let Some(kept) = self.kept.as_ref().filter(|kept| kept.keeps(node)) {
            return kept.children(node).is_empty();
        }
        with_tree!(&self.accel.tree, tree => tree.nodes[node as usize].is_leaf())
    }

    /// The children in the tree, in their order; none for a leaf.
    pub fn children(&self, node: u32) -> Range<u32> {
        with_tree!(&self.accel.tree, tree => tree.nodes[node as usize].children())
    }

    /// The parent; `None` for the root and for indices beyond the tree. In a layout the next node above that it keeps.
    pub fn parent(&self, node: u32) -> Option<u32> {
        match &self.kept {
            Some(kept) if kept.keeps(node) => kept.parent(node),
            Some(kept) => {
                std::iter::successors(Some(node), |node| self.parent_in_tree(*node)).find(|node| kept.keeps(*node))
            }
            None => self.parent_in_tree(node),
        }
    }

    fn parent_in_tree(&self, node: u32) -> Option<u32> {
        if node == 0 || node as usize >= self.len() {
            return None;
        }
        match self.accel.known_ancestry() {
            Some(ancestry) => ancestry.parents.get(node as usize).copied(),
            None => self.path(node).iter().rev().nth(1).copied(),
        }
    }

    /// In the tree, the child of the same parent that comes `steps` after `node`, or before it where these are negative, the last before the
    /// first; `None` for the root, for an only child, and for indices beyond the tree.
    pub fn sibling(&self, node: u32, steps: i32) -> Option<u32> {
        let family = self.family(node)?;
        let count = family.len() as i64;
        let at = (i64::from(node - family.start) + i64::from(steps)).rem_euclid(count);
        (count > 1).then(|| family.start + at as u32)
    }

    /// The children of the parent of `node`; `None` for the root and for indices beyond the tree.
    fn family(&self, node: u32) -> Option<Range<u32>> {
        if self.accel.report.stats.is_binary() {
            // Siblings are neighbours: the root is node 0, its children 1 and 2, further pairs 3 and 4, and so on.
            let first = node.checked_sub(1)? / 2 * 2 + 1;
            return ((node as usize) < self.len()).then_some(first..first + 2);
        }
        Some(self.children(self.parent_in_tree(node)?))
    }

    /// Depth of `node`, root 0; of one that a layout does not keep, that of the next node above that it does.
    pub fn depth(&self, node: u32) -> u32 {
        if let Some(kept) = &self.kept {
            let next = if kept.keeps(node) { Some(node) } else { self.parent(node) };
            return next.and_then(|node| kept.depth(node)).unwrap_or(0);
        }
        match self.accel.known_ancestry() {
            Some(ancestry) => ancestry.depth(node),
            None => self.path(node).len().saturating_sub(1) as u32,
        }
    }

    /// The nodes from the root to `node`, found by descending to one of the triangles in its subtree.
    fn path(&self, node: u32) -> Vec<u32> {
        let primitive = self.accel.tree.first_primitive_below(node);
        let mut path = primitive.map_or_else(Vec::new, |primitive| self.accel.path_to(primitive));
        let end = path.iter().position(|&step| step == node).map_or(0, |at| at + 1);
        path.truncate(end);
        path
    }

    /// Number of primitives in the subtree of `node`. The first call for an interior node reads the whole tree.
    pub fn primitives(&self, node: u32) -> u32 {
        self.known_primitives(node).unwrap_or_else(|| self.accel.ancestry().primitive_counts[node as usize])
    }

    /// Number of primitives in the subtree of `node` if it is known without reading the tree.
    pub fn known_primitives(&self, node: u32) -> Option<u32> {
        if node == 0 {
            return Some(self.accel.tree.primitive_indices().len() as u32);
        }
        let own = with_tree!(&self.accel.tree, tree => tree.nodes[node as usize].count);
        let counts = || Some(self.accel.known_ancestry()?.primitive_counts[node as usize]);
        if self.is_leaf(node) { Some(own) } else { counts() }
    }

    /// Computes whatever [`NodeTable::drawable`] would leave out of `settings` but visits and areas of another moment, in the calling
    /// thread's rayon pool.
    pub fn prepare(&self, settings: &OverlaySettings, token: &CancelToken) -> Result<(), Cancelled> {
        self.complete(settings.kinds(self.container_kind()), token)?;
        match settings.color_by.source() {
            Source::Counts => drop(self.accel.compute_ancestry(token)?),
            Source::Regrets => drop(self.accel.compute_regrets(token)?),
            Source::Tree | Source::Visits | Source::BuiltAreas => {}
        }
        self.list(Some(settings), token)
    }

    /// Computes parents and primitive counts of all nodes.
    pub fn study(&self, token: &CancelToken) -> Result<(), Cancelled> {
        self.accel.compute_ancestry(token).map(|_| ())
    }

    /// [`NodeTable::drawable`] leaves out something of `settings`.
    pub fn lacks(&self, settings: &OverlaySettings) -> bool {
        let whole = settings.spelt_out(self.container_kind());
        let depth = (!settings.takes_largest_leaves()).then(|| self.drawn_depths(settings));
        self.drawable(settings) != OverlaySettings { depth, ..whole }
    }

    /// `settings`, with kinds and depths spelt out, unless the largest leaves are taken, restricted to what can be drawn without
    /// another pass over the tree. Until [`NodeTable::prepare`] has run, containers of the other kind, colours by data that are not known
    /// and unlisted levels are left out.
    pub fn drawable(&self, settings: &OverlaySettings) -> OverlaySettings {
        let own = self.container_kind();
        let listed = self.levels.ranges.partition_point(|range| range.end <= self.levels.listed());
        let deepest = listed.saturating_sub(1) as u32;
        let is_listed = self.needed(settings) <= self.levels.listed();
        let has_color = self.values(self.visits().as_ref()).has(settings.color_by.source());
        let depth = self.drawn_depths(settings);
        OverlaySettings {
            depth: if is_listed {
                (!settings.takes_largest_leaves()).then_some(depth)
            } else {
                Some(depth.map(|depth| depth.min(deepest)))
            },
            color_by: if has_color { settings.color_by } else { ColorBy::DEPTH },
            ..settings.with_kinds(settings.kinds(own).iter().filter(|kind| self.knows(*kind)).collect())
        }
    }

    /// The bounding box of the tree's own container of `node`; `None` for indices beyond the tree.
    pub fn bounds(&self, node: u32) -> Option<Aabb> {
        with_tree!(&self.accel.tree, tree => tree.nodes.get(node as usize).map(|node| node.container.bounds()))
    }

    /// Surface area of the node's container relative to the root's, 0 to 1.
    pub fn area_share(&self, node: u32) -> f32 {
        with_tree!(&self.accel.tree, tree => node_metrics::area_share(tree, node))
    }

    /// Share of the node alone in the SAH cost of the tree, 0 to 1.
    pub fn sah_share(&self, node: u32) -> f32 {
        with_tree!(&self.accel.tree, tree => node_metrics::sah_share(tree, node, &self.accel.report.stats))
    }

    /// Overlap of the node's children as a fraction of its own area, of two children 0 to 1; `None` for a leaf. See
    /// [`node_metrics::overlap`].
    pub fn overlap(&self, node: u32) -> Option<f32> {
        with_tree!(&self.accel.tree, tree => node_metrics::overlap(tree, node))
    }

    /// Kind of the oriented box of `node`; `None` in trees of other containers.
    pub fn node_kind(&self, node: u32) -> Option<OrientedKind> {
        match &self.accel.tree {
            AnyTree::Oriented(tree) => Some(tree.nodes.get(node as usize)?.container.kind()),
            _ => None,
        }
    }

    /// The instance data of `node` at `depth`, at the start of the colour scale. Containers of other kinds cost a pass over the tree and
    /// are zero unless `settings` show them. Where a box and a polytope are drawn of the same node, they have the polytope's box.
    pub fn instance(&self, node: u32, depth: u32, settings: &OverlaySettings) -> OverlayNode {
        let own = self.container_kind();
        let nothing = Aabb { min: glam::Vec3::ZERO, max: glam::Vec3::ZERO };
        let kinds = settings.kinds(own).with(own);
        let [boxes, spheres, dops, oriented] = ContainerKind::WITH_ORIENTED.map(|kind| kinds.contains(kind));
        let dop = if dops { self.node_dop(node) } else { Dop14 { bounds: nothing, low: [0.0; 4], high: [0.0; 4] } };
        let bounds = if boxes { self.node_box(node) } else { dop.bounds };
        let sphere = if spheres { self.node_sphere(node) } else { Sphere { center: glam::Vec3::ZERO, radius: 0.0 } };
        let [corner, edges @ ..] = if oriented { corner_and_edges(&self.node_oriented(node)) } else { [[0.0; 3]; 4] };
        OverlayNode {
            box_min: bounds.min.to_array(),
            depth,
            box_max: bounds.max.to_array(),
            place: 0.0,
            sphere_center: sphere.center.to_array(),
            sphere_radius: sphere.radius,
            node,
            flags: u32::from(self.is_leaf(node)),
            low: dop.low,
            high: dop.high,
            corner,
            edges,
        }
    }
}

/// A corner of a box and the three edges from there.
fn corner_and_edges(container: &OrientedBox) -> [[f32; 3]; 4] {
    let corners = container.corners();
    let edge = |at: usize| (corners[at] - corners[0]).as_vec3().to_array();
    [corners[0].as_vec3().to_array(), edge(1), edge(2), edge(4)]
}

pub(super) fn area<C: Container>(tree: &Tree<C>, node: u32) -> f32 {
    tree.area(node).max(0.0)
}
