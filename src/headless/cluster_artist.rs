//! Draws the active clusters of a step of a construction over a picture.

use std::sync::Arc;

use super::context::Failure;
use super::picture::picture_input;
use crate::accel::Accel;
use crate::lab::merges::{Merges, TreeOfRecord};
use crate::legend::{self, Key};
use crate::overlay::{DrawInput, NodeTable, Offscreen, OverlaySettings, Selection, Viewpoint};
use crate::render::Frame;
use crate::text::count;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::construction::Timeline;

/// Number of rows of the legend.
pub(super) const KEYS: usize = 2;

/// Draws pictures of a construction, all with the same device and over the same traced picture.
pub(super) struct Artist<'a> {
    offscreen: Offscreen,
    table: Arc<NodeTable>,
    merges: &'a Merges,
    frame: &'a Frame,
    settings: OverlaySettings,
    viewpoint: Viewpoint,
    has_legend: bool,
}

impl<'a> Artist<'a> {
    /// Prepares drawing the clusters of `merges`, which are those of `accel`, over `frame`.
    pub(super) fn new(
        accel: &Arc<Accel>,
        merges: &'a Merges,
        frame: &'a Frame,
        settings: OverlaySettings,
        has_legend: bool,
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
        Ok(Self { offscreen, table: Arc::new(table), merges, frame, settings, viewpoint, has_legend })
    }

    /// The picture after `step` merges, sRGB RGBA: the active clusters, and the last merge highlighted. With a legend, it is
    /// higher than the frame.
    pub(super) fn draw(&mut self, step: u32) -> Result<Vec<[u8; 4]>, Failure> {
        let timeline = &self.merges.timeline;
        let most = (self.settings.at_most() as usize).min(Timeline::MAX_LARGEST);
        let nodes = timeline.largest_at(step, most);
        let selection = Selection { selected: self.merges.made_at(step), ..Selection::default() };
        let all = timeline.standing(step) as usize;
        let shown = self.table.shown_of(&nodes, all, &self.settings, &selection, Some(&self.viewpoint));
        let frame = self.frame;
        let input = DrawInput {
            picture: picture_input(frame, &frame.rgba),
            camera: frame.camera,
            table: Some(&self.table),
            shown: &Arc::new(shown),
            settings: self.settings,
            selection: &selection,
            show_picture: true,
            section: None,
            neutral_lines: frame.settings.shading.is_coded(),
            backdrop: frame.settings.background.backdrop(),
            viewport_px: [0, 0, frame.width_px, frame.height_px],
            pixels_per_point: 1.0,
        };
        let mut rgba = self.offscreen.draw(&input).map_err(|error| Failure::Failed(error.to_string()))?;
        if self.has_legend {
            let keys = self.keys(step, &input);
            legend::append(&mut rgba, [frame.width_px, frame.height_px], &keys, frame.settings.background);
        }
        Ok(rgba)
    }

    /// The number of the merge, what it lights up, and the colours of the other clusters.
    fn keys(&self, step: u32, input: &DrawInput<'_>) -> [Key; KEYS] {
        let timeline = &self.merges.timeline;
        let [step_text, steps, left] = [step as usize, timeline.steps() as usize, timeline.standing(step) as usize]
            .map(|number| count(number as u64));
        let title = if timeline.splits() {
            format!("Split {step_text} of {steps}, {left} nodes")
        } else {
            format!("Merge {step_text} of {steps}, {left} clusters left")
        };
        [legend::of_merge(title, timeline.splits()), legend::of_containers(&self.table, input.shown)]
    }
}
