//! Clusters, the groups of primitives that agglomerative clustering merges, and the lists that they stand in.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]
#![allow(clippy::needless_range_loop, reason = "several arrays are indexed by the same field")]

use bytemuck::{Pod, Zeroable};
use fearless_simd::Simd;

use crate::geometry::{Aabb, Sphere};
use crate::kernel::lanes::{FIELDS, LANES, Lanes};
use crate::order::primitive::PrimitiveContainer;
use crate::tree::Node;

/// A container that can be compared with many others at a time.
pub trait Clustered: PrimitiveContainer {
    /// How many of the fields are used.
    const USED_FIELDS: usize;
    /// What is infinitely far from every container.
    const NOWHERE: [f32; FIELDS];
    /// The numbers that describe it.
    fn fields(&self) -> [f32; FIELDS];
    /// The container that `fields` describe.
    fn from_fields(fields: [f32; FIELDS]) -> Self;
    /// The fields of the union of two containers, each in all lanes.
    fn union_fields<S: Simd, V: Lanes<S>>(simd: S, first: &[f32; FIELDS], second: &[f32; FIELDS]) -> [V; FIELDS];
    /// The surface area of the union with each of `others`, or a number that grows with it.
    fn distances<S: Simd, V: Lanes<S>>(own: &[V; FIELDS], others: &[V; FIELDS]) -> V;
}

impl Clustered for Aabb {
    const USED_FIELDS: usize = 6;
    const NOWHERE: [f32; FIELDS] =
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
    fn distances<S: Simd, V: Lanes<S>>(own: &[V; FIELDS], others: &[V; FIELDS]) -> V {
        let x = own[3].max(others[3]) - own[0].min(others[0]);
        let y = own[4].max(others[4]) - own[1].min(others[1]);
        let z = own[5].max(others[5]) - own[2].min(others[2]);
        x * (y + z) + y * z
    }
}

impl Clustered for Sphere {
    const USED_FIELDS: usize = 4;
    const NOWHERE: [f32; FIELDS] = [0.0, 0.0, 0.0, f32::INFINITY, 0.0, 0.0];
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
    fn distances<S: Simd, V: Lanes<S>>(own: &[V; FIELDS], others: &[V; FIELDS]) -> V {
        let (x, y, z) = (own[0] - others[0], own[1] - others[1], own[2] - others[2]);
        let reach = ((x * x + y * y + z * z).sqrt() + (own[3] + others[3])) * 0.5;
        // The radius grows with the area; a sphere inside the other does not enlarge it.
        reach.max(own[3]).max(others[3])
    }
}

/// A group of primitives: what becomes a node once it is merged.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C, align(32))]
pub struct Cluster {
    /// The container, see [`Clustered::fields`].
    pub fields: [f32; FIELDS],
    /// Number of its first child in the list of nodes or, of a single primitive, that primitive's number in the input.
    pub first: u32,
    /// Number of primitives.
    pub count: u32,
}

impl Cluster {
    /// A single primitive in the container that `fields` describe.
    #[inline(always)]
    pub fn of_primitive(fields: [f32; FIELDS], primitive: u32) -> Self {
        Self { fields, first: primitive, count: 1 }
    }

    /// The node that it becomes, still with its number of primitives.
    #[inline(always)]
    pub fn node<C: Clustered>(&self) -> Node<C> {
        Node { container: C::from_fields(self.fields), first: self.first, count: self.count }
    }

    /// A cluster in the container that `fields` describe in each lane.
    #[inline(always)]
    pub fn from_lanes<C: Clustered, S: Simd, V: Lanes<S>>(lanes: &[V; FIELDS], first: u32, count: u32) -> Self {
        let mut fields = [0.0; FIELDS];
        for field in 0..C::USED_FIELDS {
            fields[field] = lanes[field][0];
        }
        Self { fields, first, count }
    }
}

/// A stack of clusters, once whole and once as a structure of arrays. The lists that a subtree works on lie behind one
/// another at its end. There is always room for a row more.
#[derive(Debug)]
pub struct Clusters {
    pub fields: [Vec<f32>; FIELDS],
    pub items: Vec<Cluster>,
    pub len: usize,
}

impl Clusters {
    /// A stack with room for `capacity` clusters; it grows where that is not enough.
    pub fn with_capacity(capacity: usize) -> Self {
        let mut clusters = Self { fields: [const { Vec::new() }; FIELDS], items: Vec::new(), len: 0 };
        clusters.grow(capacity);
        clusters
    }

    /// Makes room for `more` clusters and a row of the widest kernel behind them.
    #[inline(always)]
    pub fn reserve(&mut self, more: usize) {
        if self.len + more + 4 * LANES > self.items.len() {
            self.grow(self.len + 2 * more);
        }
    }

    #[cold]
    fn grow(&mut self, capacity: usize) {
        let room = capacity + 4 * LANES;
        for field in &mut self.fields {
            field.resize(room, 0.0);
        }
        self.items.resize(room, Cluster::zeroed());
    }

    /// Puts `cluster` on the stack.
    #[inline(always)]
    pub fn push<C: Clustered>(&mut self, cluster: Cluster) {
        self.reserve(1);
        self.set::<C>(self.len, cluster);
        self.len += 1;
    }

    /// Replaces the cluster at `at`.
    #[inline(always)]
    pub fn set<C: Clustered>(&mut self, at: usize, cluster: Cluster) {
        for field in 0..C::USED_FIELDS {
            self.fields[field][at] = cluster.fields[field];
        }
        self.items[at] = cluster;
    }

    /// Puts `count` clusters of `other`, from `from` on, on the stack.
    #[inline(always)]
    pub fn append<C: Clustered>(&mut self, other: &Self, from: usize, count: usize) {
        self.reserve(count);
        // Whole rows: what is too much lies behind the end.
        for at in (0..count).step_by(LANES) {
            let (to, from) = (self.len + at, from + at);
            for field in 0..C::USED_FIELDS {
                self.fields[field][to..to + LANES].copy_from_slice(&other.fields[field][from..from + LANES]);
            }
            self.items[to..to + LANES].copy_from_slice(&other.items[from..from + LANES]);
        }
        self.len += count;
    }

    /// As many containers as a vector has lanes, from `at` on.
    #[inline(always)]
    pub fn row<C: Clustered, S: Simd, V: Lanes<S>>(&self, simd: S, at: usize) -> [V; FIELDS] {
        std::array::from_fn(|field| {
            if field < C::USED_FIELDS {
                V::from_slice(simd, &self.fields[field][at..at + V::LEN])
            } else {
                V::splat(simd, 0.0)
            }
        })
    }
}

/// The container that `fields` describe in all lanes. No closure: one that is not inlined would lack the instructions.
#[inline(always)]
pub fn splat_fields<C: Clustered, S: Simd, V: Lanes<S>>(simd: S, fields: &[f32; FIELDS]) -> [V; FIELDS] {
    let mut lanes = [V::splat(simd, 0.0); FIELDS];
    for field in 0..C::USED_FIELDS {
        lanes[field] = V::splat(simd, fields[field]);
    }
    lanes
}

/// Where merged clusters go: pairs of siblings in the list of nodes, from the end of `nodes` to its start, so that
/// parents come before their children.
pub struct Pairs<'a, C> {
    /// A part of the list of nodes, as long as the pairs that it is for.
    nodes: &'a mut [Node<C>],
    /// Number of its first node in the whole list.
    offset: u32,
    /// What lies from here on is written.
    written: usize,
}

impl<'a, C: Clustered> Pairs<'a, C> {
    /// Writes to `nodes`, the first of which has the number `offset`.
    pub fn new(nodes: &'a mut [Node<C>], offset: usize) -> Self {
        let written = nodes.len();
        Self { nodes, offset: offset as u32, written }
    }

    /// Writes two siblings and returns the number of the first.
    #[inline(always)]
    pub fn push(&mut self, pair: &[Cluster; 2]) -> u32 {
        self.push_if(true, pair)
    }

    /// The same if they `are_siblings`; if not, whatever is pushed next comes in their place. Some must.
    #[inline(always)]
    pub fn push_if(&mut self, are_siblings: bool, pair: &[Cluster; 2]) -> u32 {
        let start = self.written - 2;
        let nodes = &mut self.nodes[start..start + 2];
        for (node, cluster) in nodes.iter_mut().zip(pair) {
            *node = cluster.node();
        }
        self.written = if are_siblings { start } else { self.written };
        self.offset + start as u32
    }
}
