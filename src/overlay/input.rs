//! The arguments of one draw: picture, camera, nodes and where on the target.

use std::sync::Arc;

use crate::camera::Camera;
use crate::overlay::node_table::{NodeTable, Shown};
use crate::overlay::selection::Selection;
use crate::overlay::settings::OverlaySettings;
use crate::section::SectionPlane;

/// The traced picture as plain slices, row by row from the top left, so that this module need not know the renderer.
#[derive(Debug, Clone, Copy)]
pub struct PictureInput<'a> {
    /// Identifies the picture: an id that is already on the GPU is not uploaded again.
    pub id: u64,
    /// Width in pixels.
    pub width_px: u32,
    /// Height in pixels.
    pub height_px: u32,
    /// Edge in viewport pixels of the square that a pixel covers; 1 at full resolution.
    pub coarseness: f32,
    /// sRGB-encoded RGBA, 8 bits a channel.
    pub rgba: &'a [[u8; 4]],
    /// Linear view depth of each pixel in world units; 1e30 where no surface was hit.
    pub depth: &'a [f32],
}

/// Everything that one draw depends on.
pub struct DrawInput<'a> {
    /// The picture under the lines.
    pub picture: PictureInput<'a>,
    /// The camera that the picture was traced with, which may lag behind the current one while it moves.
    pub camera: Camera,
    /// The nodes of the tree; `None` draws the picture alone.
    pub table: Option<&'a Arc<NodeTable>>,
    /// The nodes of the table that are drawn: [`NodeTable::shown`] of the same settings.
    pub shown: &'a Arc<Shown>,
    /// How they are drawn.
    pub settings: OverlaySettings,
    /// Selected, hovered and hidden nodes.
    pub selection: &'a Selection,
    /// Colour that is drawn instead of the picture: sRGB, premultiplied by the opacity.
    pub backdrop: [f32; 4],
    /// `false` draws the backdrop instead of the picture and hides no lines behind surfaces.
    pub show_picture: bool,
    /// The plane that the picture is cut by, which cuts the containers too.
    pub section: Option<SectionPlane>,
    /// Colours of the picture stand for values, so lines are white with a dark edge rather than coloured.
    pub neutral_lines: bool,
    /// Viewport in the render target: x, y, width, height in pixels.
    pub viewport_px: [u32; 4],
    /// Pixels per point, for line widths.
    pub pixels_per_point: f32,
}
