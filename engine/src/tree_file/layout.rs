//! First line of every tree file, and the names of its arrays.

/// Version of the format that is read and written.
pub const VERSION: u32 = 1;

/// Maximum length of the second line in bytes.
pub(super) const MAX_HEADER: usize = 1 << 20;

/// The first line up to its version.
pub(super) const MAGIC: &[u8] = b"bvhscope tree ";

/// An array of a tree file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ArrayName {
    /// Bounds of each node.
    Bounds,
    /// Children of each node.
    Children,
    /// Range of indices of each node.
    Leaves,
    /// Triangles of the leaves.
    Indices,
    /// Corners of each triangle.
    Corners,
}

impl ArrayName {
    /// All arrays, in the order in which they are written.
    pub const ALL: [Self; 5] = [Self::Bounds, Self::Children, Self::Leaves, Self::Indices, Self::Corners];

    /// Name in the header.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Bounds => "bounds",
            Self::Children => "children",
            Self::Leaves => "leaves",
            Self::Indices => "indices",
            Self::Corners => "corners",
        }
    }
}

impl std::fmt::Display for ArrayName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}
