//! Draws the clusters that stand at a step of a construction over a picture.

use std::sync::Arc;

use super::context::Failure;
use crate::accel::Accel;
use crate::lab::merges::{Merges, TreeOfRecord};
use crate::overlay::{DrawInput, NodeTable, Offscreen, OverlaySettings, PictureInput, Selection, Viewpoint};
use crate::render::{Background, Frame};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::construction::Timeline;

/// Draws pictures of a construction, all with the same device and over the same traced picture.
pub(super) struct Artist<'a> {
    offscreen: Offscreen,
    table: Arc<NodeTable>,
    merges: &'a Merges,
    frame: &'a Frame,
    settings: OverlaySettings,
    viewpoint: Viewpoint,
}

impl<'a> Artist<'a> {
    /// Prepares drawing the clusters of `merges`, which are those of `accel`, over `frame`.
    pub(super) fn new(
        accel: &Arc<Accel>,
        merges: &'a Merges,
        frame: &'a Frame,
        settings: OverlaySettings,
        token: &CancelToken,
    ) -> Result<Self, Failure> {
        let table = match &merges.history.of {
            TreeOfRecord::Same => NodeTable::new(accel),
            TreeOfRecord::Before(before) => NodeTable::new(before),
        };
        table.study(token)?;
        table.prepare(&settings, token)?;
        let offscreen = Offscreen::new().map_err(|error| Failure::Failed(error.to_string()))?;
        let size_px = [frame.width_px, frame.height_px];
        let viewpoint = Viewpoint { camera: frame.camera, size_px, section: None };
        Ok(Self { offscreen, table: Arc::new(table), merges, frame, settings, viewpoint })
    }

    /// The picture after `step` merges, sRGB RGBA: the clusters that stand, and the last merge lit up.
    pub(super) fn draw(&mut self, step: u32) -> Result<Vec<[u8; 4]>, Failure> {
        let timeline = &self.merges.timeline;
        let most = (self.settings.at_most() as usize).min(Timeline::MAX_LARGEST);
        let nodes = timeline.largest_at(step, most);
        let selection = Selection { selected: self.merges.made_at(step), ..Selection::default() };
        let all = timeline.standing(step) as usize;
        let shown = self.table.shown_of(&nodes, all, &self.settings, &selection, Some(&self.viewpoint));
        let frame = self.frame;
        let input = DrawInput {
            picture: PictureInput {
                id: 1,
                width_px: frame.width_px,
                height_px: frame.height_px,
                coarseness: 1.0,
                rgba: &frame.rgba,
                depth: &frame.depth,
            },
            camera: frame.camera,
            table: Some(&self.table),
            shown: &Arc::new(shown),
            settings: self.settings,
            selection: &selection,
            show_picture: true,
            section: None,
            neutral_lines: frame.settings.shading.is_coded(),
            light_background: frame.settings.background == Background::Light,
            viewport_px: [0, 0, frame.width_px, frame.height_px],
            pixels_per_point: 1.0,
        };
        self.offscreen.draw(&input).map_err(|error| Failure::Failed(error.to_string()))
    }
}
