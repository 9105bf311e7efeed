//! Clusters, the groups of primitives that agglomerative clustering merges, and stacks of them.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]
#![allow(clippy::needless_range_loop, reason = "several arrays are indexed by the same field")]

use fearless_simd::Simd;

use crate::aac::cluster_container::ClusterContainer;
use crate::kernel::lanes::{Fields, LANES, Lanes};
use crate::tree::Node;

/// A group of primitives and its container; becomes a node when it is merged.
#[derive(Clone, Copy)]
#[repr(C, align(32))]
pub struct Cluster<C: ClusterContainer> {
    /// Fields of its container, see [`ClusterContainer::fields`].
    pub fields: C::Fields<f32>,
    /// Index of its first child in the list of nodes, which is odd, or twice the index of its [`item`].
    pub first: u32,
    /// Number of primitives.
    pub count: u32,
}

/// Index of the item that a cluster or node with this `first` is before its leaves are ordered: of a primitive in the input, of a block
/// its position. `None` where it was merged.
#[inline(always)]
pub fn item(first: u32) -> Option<u32> {
    first.is_multiple_of(2).then_some(first / 2)
}

impl<C: ClusterContainer> Cluster<C> {
    /// The cluster of the item `index`, below 2³¹, of `count` primitives, whose container has these `fields`.
    #[inline(always)]
    pub fn of_item(fields: C::Fields<f32>, index: u32, count: u32) -> Self {
        Self { fields, first: 2 * index, count }
    }

    /// The cluster of the single primitive with this index, whose container has these `fields`.
    #[inline(always)]
    pub fn of_primitive(fields: C::Fields<f32>, primitive: u32) -> Self {
        Self::of_item(fields, primitive, 1)
    }

    /// The node that it becomes. An interior node's `count` still is its number of primitives, until leaves are ordered.
    #[inline(always)]
    pub fn node(&self) -> Node<C> {
        Node { container: C::from_fields(self.fields), first: self.first, count: self.count }
    }

    /// A cluster whose container has these fields, each in all lanes.
    #[inline(always)]
    pub fn from_lanes<S: Simd, V: Lanes<S>>(lanes: &C::Fields<V>, first: u32, count: u32) -> Self {
        let mut fields = C::Fields::splat(0.0);
        for field in 0..C::USED_FIELDS {
            fields[field] = lanes[field][0];
        }
        Self { fields, first, count }
    }
}

/// A stack of clusters, stored both whole and as a structure of arrays. The lists that `combine_clusters` works on lie behind
/// one another at its end. Its capacity always exceeds its length by a row of the widest kernel.
pub struct ClusterStack<C: ClusterContainer> {
    /// Container fields of each cluster.
    pub fields: C::Columns,
    /// The clusters.
    pub items: Vec<Cluster<C>>,
    /// Number of clusters; what lies behind is unspecified.
    pub len: usize,
}

impl<C: ClusterContainer> ClusterStack<C> {
    /// An empty stack with space for `capacity` clusters; it grows where that is not enough.
    pub fn with_capacity(capacity: usize) -> Self {
        let mut clusters = Self { fields: C::Columns::default(), items: Vec::new(), len: 0 };
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
        for field in 0..C::USED_FIELDS {
            self.fields[field].resize(capacity, 0.0);
        }
        self.items.resize(capacity, Cluster { fields: C::Fields::splat(0.0), first: 0, count: 0 });
    }

    /// Pushes `cluster`.
    #[inline(always)]
    pub fn push(&mut self, cluster: Cluster<C>) {
        self.reserve(1);
        self.set(self.len, cluster);
        self.len += 1;
    }

    /// Replaces the cluster at `at`.
    #[inline(always)]
    pub fn set(&mut self, at: usize, cluster: Cluster<C>) {
        for field in 0..C::USED_FIELDS {
            self.fields[field][at] = cluster.fields[field];
        }
        self.items[at] = cluster;
    }

    /// Pushes the `count` clusters of `other` that begin at `from`.
    #[inline(always)]
    pub fn append(&mut self, other: &Self, from: usize, count: usize) {
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
    pub fn load_row<S: Simd, V: Lanes<S>>(&self, simd: S, at: usize) -> C::Fields<V> {
        let mut row = C::Fields::splat(V::splat(simd, 0.0));
        for field in 0..C::USED_FIELDS {
            row[field] = V::from_slice(simd, &self.fields[field][at..at + V::LEN]);
        }
        row
    }
}
