//! The instance data of a node.

/// Instance data of one node, 136 bytes; the struct `Node` in `line.wgsl` has the same layout.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct OverlayNode {
    /// Lower corner of the box in world space.
    pub box_min: [f32; 3],
    /// Depth in the tree, root 0.
    pub depth: u32,
    /// Upper corner of the box in world space.
    pub box_max: [f32; 3],
    /// Place on the colour scale, 0 to 1.
    pub place: f32,
    /// Centre of the sphere in world space.
    pub sphere_center: [f32; 3],
    /// Radius of the sphere in world units.
    pub sphere_radius: f32,
    /// Index of the node in the tree.
    pub node: u32,
    /// Bit 0: leaf. Bits 8 to 11: [`Role`].
    pub flags: u32,
    /// The polytope's lower planes along [`Dop14::DIAGONALS`](bvhscope_engine::Dop14::DIAGONALS); its box is that above.
    pub low: [f32; 4],
    /// The upper planes.
    pub high: [f32; 4],
    /// A corner of the oriented box in world space.
    pub corner: [f32; 3],
    /// The edges of the oriented box from that corner.
    pub edges: [[f32; 3]; 3],
}

/// The reason why a node is drawn, which decides its colour and line width.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Role {
    /// Chosen by depth range and filters.
    Shown = 0,
    /// The selected node.
    Selected = 1,
    /// First child of the selected node.
    FirstChild = 2,
    /// Second child of the selected node.
    SecondChild = 3,
    /// The node under the pointer.
    Hovered = 4,
    /// The container that the present step of a recorded ray is about.
    Traced = 5,
    /// A container on the stack of that ray.
    Waiting = 6,
    /// The volume that children of the selected node have in common.
    Overlap = 7,
    /// A node from a file that extends beyond its parent, or whose triangles extend beyond it.
    Faulty = 8,
}

impl Role {
    /// All roles.
    pub const ALL: [Self; 9] = [
        Self::Shown,
        Self::Selected,
        Self::FirstChild,
        Self::SecondChild,
        Self::Hovered,
        Self::Traced,
        Self::Waiting,
        Self::Overlap,
        Self::Faulty,
    ];
    /// Lowest bit of the role in [`OverlayNode::flags`].
    pub const SHIFT: u32 = 8;
    /// Mask of the role's bits after the shift.
    pub const MASK: u32 = 15;

    /// The name in the shaders, as in `ROLE_SELECTED`.
    pub const fn shader_name(self) -> &'static str {
        match self {
            Self::Shown => "SHOWN",
            Self::Selected => "SELECTED",
            Self::FirstChild => "FIRST_CHILD",
            Self::SecondChild => "SECOND_CHILD",
            Self::Hovered => "HOVERED",
            Self::Traced => "TRACED",
            Self::Waiting => "WAITING",
            Self::Overlap => "OVERLAP",
            Self::Faulty => "FAULTY",
        }
    }

    /// Width of its lines relative to the chosen one.
    pub const fn width(self) -> f32 {
        match self {
            Self::Selected | Self::Traced => 2.0,
            Self::FirstChild | Self::SecondChild | Self::Hovered | Self::Faulty => 1.5,
            Self::Shown | Self::Waiting | Self::Overlap => 1.0,
        }
    }

    /// The colour of its lines as sRGB bytes; `None` for [`Role::Shown`], whose colour encodes a value.
    pub const fn color(self) -> Option<[u8; 3]> {
        match self {
            Self::Shown => None,
            Self::Selected => Some([255, 180, 84]),
            Self::FirstChild => Some([255, 217, 161]),
            Self::SecondChild => Some([231, 130, 79]),
            Self::Hovered => Some([255, 255, 255]),
            Self::Traced => Some([70, 214, 255]),
            Self::Waiting => Some([58, 126, 170]),
            Self::Overlap => Some([255, 77, 148]),
            Self::Faulty => Some([240, 40, 40]),
        }
    }
}

impl OverlayNode {
    /// The role's id, see [`Role`].
    pub fn role(&self) -> u32 {
        self.flags >> Role::SHIFT & Role::MASK
    }
}
