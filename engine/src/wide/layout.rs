//! Widths of nodes and blocks.

/// Number of children per node.
pub const WIDTH: usize = 8;

/// Number of triangles per block.
pub const BLOCK: usize = 4;
