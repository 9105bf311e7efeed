//! Nodes as the shaders read them.

use super::{NodeTable, Selection};

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
    /// The colour of its lines as sRGB bytes, the same as in `line.wgsl`; `None` for [`Role::Shown`], whose colour stands
    /// for a value.
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
        self.flags >> 8 & 7
    }
}

/// The nodes that stand out, drawn over all others, also where depth or budget leave them out: the selected one's children,
/// itself, the hovered one.
pub fn highlighted(table: &NodeTable, selection: &Selection) -> Vec<(u32, Role)> {
    let exists = |node: &u32| (*node as usize) < table.len();
    let mut marked = Vec::new();
    if let Some(node) = selection.selected.filter(exists) {
        if let Some([first, second]) = table.children(node) {
            marked.push((first, Role::FirstChild));
            marked.push((second, Role::SecondChild));
        }
        marked.push((node, Role::Selected));
    }
    if let Some(node) = selection.hovered.filter(exists)
        && selection.selected != Some(node)
    {
        marked.push((node, Role::Hovered));
    }
    marked
}

#[cfg(test)]
mod tests {
    use super::Role;

    #[test]
    fn legend_and_shader_have_the_same_colors() {
        let shader = include_str!("../../shaders/line.wgsl");
        for (role, name) in [
            (Role::Selected, "ROLE_SELECTED"),
            (Role::FirstChild, "ROLE_FIRST_CHILD"),
            (Role::SecondChild, "ROLE_SECOND_CHILD"),
            (Role::Hovered, "ROLE_HOVERED"),
        ] {
            let [r, g, b] = role.color().unwrap_or_default().map(|channel| f32::from(channel) / 255.0);
            let text = |value: f32| if value == 1.0 { "1.0".to_owned() } else { format!("{value:.3}") };
            let line = format!("case {name}: {{ return vec4f({}, {}, {}, ", text(r), text(g), text(b));
            assert!(shader.contains(&line), "'{line}' is not in the shader");
        }
    }
}
