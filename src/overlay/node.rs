//! Nodes as the shaders read them.

/// A node as the shaders read it, one instance of 64 bytes; `Node` in `line.wgsl` has the same layout.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct OverlayNode {
    /// Corner of the box with the smallest coordinates.
    pub box_min: [f32; 3],
    /// Depth in the tree, root 0.
    pub depth: u32,
    /// Corner of the box with the largest coordinates.
    pub box_max: [f32; 3],
    /// Primitives below.
    pub primitives: u32,
    /// Middle of the sphere.
    pub sphere_center: [f32; 3],
    /// Radius of the sphere.
    pub sphere_radius: f32,
    /// Index of the node in the tree.
    pub node: u32,
    /// Bit 0: leaf. Bits 8 to 10: [`Role`].
    pub flags: u32,
    /// Surface area over the root's, 0 to 1, of the container that the tree is made of.
    pub area_share: f32,
    /// Overlap with the sibling as a share of its own area, 0 to 1.
    pub overlap: f32,
}

/// Why a node is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Role {
    /// The settings chose it.
    Shown = 0,
    /// It is the selected one.
    Selected = 1,
    /// It is the selected one's first child.
    FirstChild = 2,
    /// It is the selected one's second child.
    SecondChild = 3,
    /// The pointer is over it.
    Hovered = 4,
}

impl Role {
    /// All roles.
    pub const ALL: [Self; 5] = [Self::Shown, Self::Selected, Self::FirstChild, Self::SecondChild, Self::Hovered];
    /// Position of the role in [`OverlayNode::flags`]: its lowest bit.
    pub const SHIFT: u32 = 8;
    /// Bits of the role, before the shift.
    pub const MASK: u32 = 7;

    /// The name in the shaders, as in `ROLE_SELECTED`.
    pub const fn shader_name(self) -> &'static str {
        match self {
            Self::Shown => "SHOWN",
            Self::Selected => "SELECTED",
            Self::FirstChild => "FIRST_CHILD",
            Self::SecondChild => "SECOND_CHILD",
            Self::Hovered => "HOVERED",
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
        }
    }
}

impl OverlayNode {
    /// Why it is drawn.
    pub fn role(&self) -> u32 {
        self.flags >> Role::SHIFT & Role::MASK
    }
}
