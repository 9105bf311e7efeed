//! Widths of nodes and blocks, and what a triangle takes.

/// Number of children per node.
pub const WIDTH: usize = 8;

/// Number of triangles per block.
pub const BLOCK: usize = 4;

/// Area below which nodes are compact, in multiples of the root's over the number of binary nodes: 97 of 100 nodes in San Miguel. The
/// share of the root's area is how likely a ray is to enter what eight bits add to a box: there it makes 0.1 % more container tests.
pub const COMPACT_AREA: f32 = 150.0;

/// Number of triangles from which nodes are compact unless another form is asked for: the tree is larger than the cache of most
/// processors, so that less memory pays for what each compact node takes to unpack.
pub const COMPACT_TRIANGLES: usize = 1 << 21;

/// Coordinates of a triangle.
pub(crate) const COORDINATES: usize = 9;
/// Values of a triangle in a leaf: coordinates and index.
pub(crate) const VALUES: usize = COORDINATES + 1;
/// Values that a block can be read from: what its own are followed by is read too, and ignored.
pub(crate) const WINDOW: usize = 64 + BLOCK;
/// Set in the index of every triangle, because a small integer would be a subnormal number, which makes arithmetic slow: what is
/// read of the next row is calculated with as well.
pub(crate) const INDEX_MARK: u32 = 1 << 30;
/// Set in the index of a needle, which makes it a negative number; see [`geometry`](crate::geometry).
pub(crate) const NEEDLE_MARK: u32 = 1 << 31;
/// Maximum number of triangles.
pub(crate) const MAX_TRIANGLES: usize = INDEX_MARK as usize;
