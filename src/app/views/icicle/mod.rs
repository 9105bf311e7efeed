//! The view "Icicle": the tree from the root downwards, each node as wide as its share.

mod plot;
mod state;

use std::sync::Arc;

pub use state::{IcicleLayout, IcicleView};

use egui::{
    self, Align, Align2, Color32, CornerRadius, Key, Layout, Rect, RichText, Role, Sense, TextStyle, Ui, WidgetInfo,
    pos2, vec2,
};

use self::state::IcicleInputs;
use crate::app::state::{AppState, Presented, Severity};
use crate::app::studies::{Studies, StudyPlan};
use crate::app::views::{Needs, View, parts};
use crate::app::widgets::{DropDown, Tip as _};
use crate::app::{format, theme};
use crate::catalog::metrics::{METRICS, Metric, Source};
use crate::lab::icicle::{IcicleWidth, subtree_sums};

/// Width of the hint in points. In a narrower window it is left out.
const HINT_WIDTH: f32 = 200.0;
/// Width of the gradient in points.
const WIDTH: f32 = 72.0;
/// Steps of the gradient.
const STEPS: u16 = 24;
/// Most nodes that the line of nodes above the topmost one names.
const NAMED: usize = 5;

impl View for IcicleView {
    const PURPOSE: &'static str =
        "The whole tree at a glance: each node below its parent, as wide as its share of cost, visits or triangles";
    const KEY: Key = Key::F7;

    fn ui(&mut self, ui: &mut Ui, state: &mut AppState) {
        let Some(mut shown) = parts::presented_tree(ui, state, "Open a model to see its tree as an icicle") else {
            return;
        };
        if let Some(table) = state.model.layout_of(&shown.accel) {
            shown.table = Arc::clone(table);
        }
        self.follow(&shown.accel);
        ui.horizontal(|ui| {
            let choices = IcicleWidth::ALL.map(|width| (width, width.label(), width.meaning()));
            DropDown::new("Width", &choices).beside(
                ui,
                "Width",
                "What the width of a node stands for",
                &mut self.width,
            );
            let choices = METRICS.map(|metric| (metric, metric.label, metric.meaning));
            DropDown::new("Colour", &choices).beside(
                ui,
                "Colour",
                "What the colour of a node stands for",
                &mut self.color,
            );
            self.legend(ui, &shown);
            parts::layout_on_show(ui, state);
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                self.copy(ui, state, &shown);
                self.breadcrumb(ui, &shown);
            });
        });
        if self.needs().visits {
            ui.horizontal(|ui| {
                parts::rays(ui, state, &shown);
                if let Some(reason) = parts::no_rays(state, &shown) {
                    ui.weak(reason);
                }
            });
        }
        self.plot(ui, state, &shown);
    }

    fn needs(&self) -> Needs {
        let visits = self.width == IcicleWidth::Visits || self.color.source == Source::Visits;
        Needs { visits, regrets: self.color.source == Source::Regrets, counts: false }
    }

    fn add_studies(studies: &mut Studies) -> std::io::Result<()> {
        let plan = StudyPlan::new(
            "icicle",
            "Measuring subtrees",
            |state| &mut state.views.get_mut::<Self>().sums,
            |state, _| state.inputs_of(|view: &Self, model, accel| view.inputs(model, accel)),
        );
        studies.add(plan, |accel, inputs: &IcicleInputs, token| {
            accel.compute_ancestry(token)?;
            let kept = inputs.layout.as_ref().map(|layout| &*layout.0);
            subtree_sums(accel, inputs.width, inputs.visits.as_ref(), kept, token)
        })
    }
}

impl IcicleView {
    /// The button that copies the icicle as an image.
    fn copy(&self, ui: &mut Ui, state: &mut AppState, shown: &Presented) {
        let layout = self.last_layout(&shown.accel).cloned();
        let response = ui.add_enabled(layout.is_some(), egui::Button::new("Copy")).tip("Copy the icicle as an image");
        let Some(layout) = layout.filter(|_| response.clicked()) else { return };
        if let Some(reason) = &state.layout.clipboard_fault {
            let text = format!("Nothing was copied, because there is no clipboard to copy to: {reason}");
            state.messages.notify(Severity::Warning, text);
            return;
        }
        let columns = layout.icicle.cells.first().map_or(0, |cell| cell.right_px);
        let (background, none) = (ui.visuals().panel_fill, theme::palette(ui).rail);
        ui.ctx().copy_image(plot::image(&layout, columns, background, none));
        state.messages.notify(Severity::Info, "The icicle was copied as an image");
    }

    /// The nodes from the root to the topmost one, to which a click zooms out.
    fn breadcrumb(&mut self, ui: &mut Ui, shown: &Presented) {
        let mut path = vec![self.top()];
        while let Some(parent) = path.last().and_then(|&node| shown.table.parent(node)) {
            path.push(parent);
        }
        if path.len() < 2 {
            if ui.available_width() >= HINT_WIDTH {
                ui.weak("Double click a node to zoom in");
            }
            return;
        }
        let root = path.pop();
        let hidden = path.len().saturating_sub(NAMED);
        path.truncate(NAMED);
        let dim = theme::palette(ui).dim;
        // From right to left: the topmost node first.
        let mut chosen = None;
        for (index, &node) in path.iter().enumerate() {
            let name = format::count(u64::from(node));
            let button = egui::Button::new(&name).selected(index == 0).frame(index == 0);
            let tip = if index == 0 { "The topmost node (Backspace zooms out)" } else { "Zoom out to this node" };
            if ui.add(button).tip(tip).clicked() {
                chosen = Some(node);
            }
            ui.label(RichText::new("›").color(dim));
        }
        if hidden > 0 {
            ui.label(RichText::new("…").color(dim)).tip(format!("{} between", format::counted(hidden as u64, "node")));
            ui.label(RichText::new("›").color(dim));
        }
        if ui.add(egui::Button::new("Root").frame(false)).tip("Zoom out to the whole tree").clicked() {
            chosen = root;
        }
        if let Some(node) = chosen {
            self.zoom_to(node);
        }
    }

    /// Shows the colours of the icicle for the icicle that was laid out last.
    fn legend(&self, ui: &mut Ui, shown: &Presented) {
        let metric = self.color;
        let Some(layout) = self.last_layout(&shown.accel) else { return };
        let [low, high] = layout.scale.ends.map(|value| metric_text(metric, value));
        let palette = theme::palette(ui);
        let font = TextStyle::Small.resolve(ui.style());
        let galleys =
            [&low, &high].map(|text| ui.painter().layout_no_wrap(text.clone(), font.clone(), palette.dim).size().x);
        let size = vec2(galleys[0] + WIDTH + galleys[1] + 12.0, theme::ROW_HEIGHT);
        let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
        let name = format!("Colours: {} from {low} to {high}", metric.label);
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &name));
        ui.painter().text(rect.left_center(), Align2::LEFT_CENTER, &low, font.clone(), palette.dim);
        ui.painter().text(rect.right_center(), Align2::RIGHT_CENTER, &high, font, palette.dim);
        let left = rect.left() + galleys[0] + 6.0;
        let bar = Rect::from_min_size(pos2(left, rect.center().y - 4.0), vec2(WIDTH, 8.0));
        theme::paint_gradient(ui.painter(), bar, STEPS, theme::scale_color);
        ui.painter().rect_stroke(
            bar,
            CornerRadius::ZERO,
            ui.visuals().widgets.noninteractive.bg_stroke,
            egui::StrokeKind::Outside,
        );
        response.tip(format!("{}. Grey: none", metric.meaning));
    }
}

/// The colour at a position on the scale, 0 to 1; `none` for a node without a value.
fn color(position: Option<f32>, none: Color32) -> Color32 {
    position.map_or(none, theme::scale_color)
}

/// A value of a metric as text.
fn metric_text(metric: &'static Metric, value: f32) -> String {
    format::of_metric(metric, value)
}
