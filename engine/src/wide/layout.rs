//! The two widths that the layout of wide trees is made of.

/// Children of a node.
pub const WIDTH: usize = 8;

/// Triangles of a block.
pub const BLOCK: usize = 4;
