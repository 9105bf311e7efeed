//! Clusters, the groups of primitives that agglomerative clustering merges; stacks of them; and the nodes that they become.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]
#![allow(clippy::needless_range_loop, reason = "several arrays are indexed by the same field")]

use bytemuck::{Pod, Zeroable};
use fearless_simd::Simd;

use crate::geometry::{Aabb, Sphere};
use crate::kernel::lanes::{FIELDS, LANES, Lanes};
use crate::order::PrimitiveContainer;
use crate::tree::Node;

/// A container whose merge distance to many others can be computed at once.
pub trait ClusterContainer: PrimitiveContainer {
    /// Number of fields in use.
    const USED_FIELDS: usize;
    /// Fields of a stand-in for no cluster, whose distance to every container is infinite.
    const INFINITELY_FAR: [f32; FIELDS];
    /// Its fields: a box's minimum and maximum corner, a sphere's centre and radius.
    fn fields(&self) -> [f32; FIELDS];
    /// The container with these `fields`.
    fn from_fields(fields: [f32; FIELDS]) -> Self;
    /// Fields of the smallest container around two, each in all lanes.
    fn union_fields<S: Simd, V: Lanes<S>>(simd: S, first: &[f32; FIELDS], second: &[f32; FIELDS]) -> [V; FIELDS];
    /// d(`own`, other) for each lane of `others`: surface area of the union, or a value that increases with it.
    fn merge_distances<S: Simd, V: Lanes<S>>(own: &[V; FIELDS], others: &[V; FIELDS]) -> V;
}

impl ClusterContainer for Aabb {
    const USED_FIELDS: usize = 6;
    const INFINITELY_FAR: [f32; FIELDS] =
        [-f32::INFINITY, -f32::INFINITY, -f32::INFINITY, f32::INFINITY, f32::INFINITY, f32::INFINITY];
    #[inline(always)]
    fn fields(&self) -> [f32; FIELDS] {
        [self.min.x, self.min.y, self.min.z, self.max.x, self.max.y, self.max.z]
    }

    #[inline(always)]
    fn from_fields([ax, ay, az, bx, by, bz]: [f32; FIELDS]) -> Self {
        Self { min: glam::Vec3::new(ax, ay, az), max: glam::Vec3::new(bx, by, bz) }
    }

    #[inline(always)]
    fn union_fields<S: Simd, V: Lanes<S>>(simd: S, first: &[f32; FIELDS], second: &[f32; FIELDS]) -> [V; FIELDS] {
        std::array::from_fn(|field| {
            let (a, b) = (V::splat(simd, first[field]), V::splat(simd, second[field]));
            if field < 3 { a.min(b) } else { a.max(b) }
        })
    }

    #[inline(always)]
    fn merge_distances<S: Simd, V: Lanes<S>>(own: &[V; FIELDS], others: &[V; FIELDS]) -> V {
        let x = own[3].max(others[3]) - own[0].min(others[0]);
        let y = own[4].max(others[4]) - own[1].min(others[1]);
        let z = own[5].max(others[5]) - own[2].min(others[2]);
        x * (y + z) + y * z
    }
}

impl ClusterContainer for Sphere {
    const USED_FIELDS: usize = 4;
    const INFINITELY_FAR: [f32; FIELDS] = [0.0, 0.0, 0.0, f32::INFINITY, 0.0, 0.0];
    #[inline(always)]
    fn fields(&self) -> [f32; FIELDS] {
        [self.center.x, self.center.y, self.center.z, self.radius, 0.0, 0.0]
    }

    #[inline(always)]
    fn from_fields([x, y, z, radius, ..]: [f32; FIELDS]) -> Self {
        Self { center: glam::Vec3::new(x, y, z), radius }
    }

    #[inline(always)]
    fn union_fields<S: Simd, V: Lanes<S>>(simd: S, first: &[f32; FIELDS], second: &[f32; FIELDS]) -> [V; FIELDS] {
        splat_fields::<Self, S, V>(simd, &Self::from_fields(*first).union(&Self::from_fields(*second)).fields())
    }

    #[inline(always)]
    fn merge_distances<S: Simd, V: Lanes<S>>(own: &[V; FIELDS], others: &[V; FIELDS]) -> V {
        let (x, y, z) = (own[0] - others[0], own[1] - others[1], own[2] - others[2]);
        let reach = ((x * x + y * y + z * z).sqrt() + (own[3] + others[3])) * 0.5;
        // The radius increases with the area; a sphere inside the other does not enlarge it.
        reach.max(own[3]).max(others[3])
    }
}

/// A group of primitives and its container; becomes a node when it is merged.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C, align(32))]
pub struct Cluster {
    /// Fields of its container, see [`ClusterContainer::fields`].
    pub fields: [f32; FIELDS],
    /// Index of its first child in the list of nodes or, of a single primitive, that primitive's index in the input.
    pub first: u32,
    /// Number of primitives.
    pub count: u32,
}

impl Cluster {
    /// The cluster of a single primitive, whose container has these `fields`.
    #[inline(always)]
    pub fn of_primitive(fields: [f32; FIELDS], primitive: u32) -> Self {
        Self { fields, first: primitive, count: 1 }
    }

    /// The node that it becomes. An interior node's `count` still is its number of primitives, until leaves are ordered.
    #[inline(always)]
    pub fn node<C: ClusterContainer>(&self) -> Node<C> {
        Node { container: C::from_fields(self.fields), first: self.first, count: self.count }
    }

    /// A cluster whose container has these fields, each in all lanes.
    #[inline(always)]
    pub fn from_lanes<C: ClusterContainer, S: Simd, V: Lanes<S>>(lanes: &[V; FIELDS], first: u32, count: u32) -> Self {
        let mut fields = [0.0; FIELDS];
        for field in 0..C::USED_FIELDS {
            fields[field] = lanes[field][0];
        }
        Self { fields, first, count }
    }
}

/// A stack of clusters, stored both whole and as a structure of arrays. The lists that `combine_clusters` works on lie behind
/// one another at its end. Its capacity always exceeds its length by a row of the widest kernel.
#[derive(Debug)]
pub struct ClusterStack {
    /// Container fields of each cluster.
    pub fields: [Vec<f32>; FIELDS],
    /// The clusters.
    pub items: Vec<Cluster>,
    /// Number of clusters; what lies behind is unspecified.
    pub len: usize,
}

impl ClusterStack {
    /// An empty stack with space for `capacity` clusters; it grows where that is not enough.
    pub fn with_capacity(capacity: usize) -> Self {
        let mut clusters = Self { fields: [const { Vec::new() }; FIELDS], items: Vec::new(), len: 0 };
        clusters.grow(capacity);
        clusters
    }

    /// Reserves capacity for `additional` clusters and a row of the widest kernel behind them.
    #[inline(always)]
    pub fn reserve(&mut self, additional: usize) {
        if self.len + additional + 4 * LANES > self.items.len() {
            self.grow(self.len + 2 * additional);
        }
    }

    #[cold]
    fn grow(&mut self, capacity: usize) {
        let capacity = capacity + 4 * LANES;
        for field in &mut self.fields {
            field.resize(capacity, 0.0);
        }
        self.items.resize(capacity, Cluster::zeroed());
    }

    /// Pushes `cluster`.
    #[inline(always)]
    pub fn push<C: ClusterContainer>(&mut self, cluster: Cluster) {
        self.reserve(1);
        self.set::<C>(self.len, cluster);
        self.len += 1;
    }

    /// Replaces the cluster at `at`.
    #[inline(always)]
    pub fn set<C: ClusterContainer>(&mut self, at: usize, cluster: Cluster) {
        for field in 0..C::USED_FIELDS {
            self.fields[field][at] = cluster.fields[field];
        }
        self.items[at] = cluster;
    }

    /// Pushes the `count` clusters of `other` that begin at `from`.
    #[inline(always)]
    pub fn append<C: ClusterContainer>(&mut self, other: &Self, from: usize, count: usize) {
        self.reserve(count);
        // Whole rows: what is copied in excess lies behind the end.
        for at in (0..count).step_by(LANES) {
            let (to, from) = (self.len + at, from + at);
            for field in 0..C::USED_FIELDS {
                self.fields[field][to..to + LANES].copy_from_slice(&other.fields[field][from..from + LANES]);
            }
            self.items[to..to + LANES].copy_from_slice(&other.items[from..from + LANES]);
        }
        self.len += count;
    }

    /// Loads the containers of the clusters from `at` on, one per lane.
    #[inline(always)]
    pub fn load_row<C: ClusterContainer, S: Simd, V: Lanes<S>>(&self, simd: S, at: usize) -> [V; FIELDS] {
        std::array::from_fn(|field| {
            if field < C::USED_FIELDS {
                V::from_slice(simd, &self.fields[field][at..at + V::LEN])
            } else {
                V::splat(simd, 0.0)
            }
        })
    }
}

/// Copies each of `fields` to all lanes. No closure: one that is not inlined would lack the vector instructions.
#[inline(always)]
pub fn splat_fields<C: ClusterContainer, S: Simd, V: Lanes<S>>(simd: S, fields: &[f32; FIELDS]) -> [V; FIELDS] {
    let mut lanes = [V::splat(simd, 0.0); FIELDS];
    for field in 0..C::USED_FIELDS {
        lanes[field] = V::splat(simd, fields[field]);
    }
    lanes
}

/// Writes merged clusters to the list of nodes as pairs of siblings, from the end of a slice to its start, so that parents
/// precede their children.
pub struct PairWriter<'a, C> {
    /// The slice of the list of nodes that exactly holds the pairs.
    nodes: &'a mut [Node<C>],
    /// Index of the slice's first node in the whole list.
    offset: u32,
    /// Index in the slice of the first node that has been written.
    first_written: usize,
}

impl<'a, C: ClusterContainer> PairWriter<'a, C> {
    /// A writer to `nodes`, the first of which has the index `offset` in the whole list.
    pub fn new(nodes: &'a mut [Node<C>], offset: usize) -> Self {
        let first_written = nodes.len();
        Self { nodes, offset: offset as u32, first_written }
    }

    /// Writes two siblings and returns the index of the first in the whole list.
    #[inline(always)]
    pub fn push(&mut self, pair: &[Cluster; 2]) -> u32 {
        self.push_if(true, pair)
    }

    /// [`Self::push`] if `is_merge`; otherwise the next pair overwrites this one. At least one pair must still be due.
    #[inline(always)]
    pub fn push_if(&mut self, is_merge: bool, pair: &[Cluster; 2]) -> u32 {
        let start = self.first_written - 2;
        let nodes = &mut self.nodes[start..start + 2];
        for (node, cluster) in nodes.iter_mut().zip(pair) {
            *node = cluster.node();
        }
        self.first_written = if is_merge { start } else { self.first_written };
        self.offset + start as u32
    }
}
