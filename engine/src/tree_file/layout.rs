//! First line of every tree file, and the names of its arrays.

/// Version of files that hold one tree.
pub const VERSION: u32 = 1;

/// Version of files that hold trees in two levels.
pub const VERSION_TWO_LEVELS: u32 = 2;

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
    /// In two levels: numbers of nodes, indices and items of each tree.
    Trees,
    /// In two levels: mesh of each instance.
    Instances,
    /// In two levels: place of each instance.
    Matrices,
    /// In two levels: number that the author gave to each instance.
    Ids,
}

impl ArrayName {
    /// All arrays, in the order in which they are written; those that trees in two levels have alone come last.
    pub const ALL: [Self; 9] = [
        Self::Bounds,
        Self::Children,
        Self::Leaves,
        Self::Indices,
        Self::Corners,
        Self::Trees,
        Self::Instances,
        Self::Matrices,
        Self::Ids,
    ];

    /// True if a file may lack it.
    pub(super) const fn is_optional(self) -> bool {
        matches!(self, Self::Corners | Self::Ids)
    }

    /// True if only trees in two levels have it.
    pub(super) const fn is_of_two_levels(self) -> bool {
        matches!(self, Self::Trees | Self::Instances | Self::Matrices | Self::Ids)
    }

    /// Name in the header.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Bounds => "bounds",
            Self::Children => "children",
            Self::Leaves => "leaves",
            Self::Indices => "indices",
            Self::Corners => "corners",
            Self::Trees => "trees",
            Self::Instances => "instances",
            Self::Matrices => "matrices",
            Self::Ids => "ids",
        }
    }
}

impl std::fmt::Display for ArrayName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}
