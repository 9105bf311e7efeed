//! The view "Icicle": the tree from the root downwards, each node as wide as its share.

mod plot;

use egui::{
    self, Align, Align2, Color32, CornerRadius, Key, Layout, Rect, RichText, Role, Sense, TextStyle, Ui, WidgetInfo,
    pos2, vec2,
};

use crate::app::state::lab::{IcicleInputs, IcicleState};
use crate::app::state::{AppState, LabState, Presented, Severity};
use crate::app::studies::{Studies, StudyPlan};
use crate::app::views::{View, parts};
use crate::app::widgets::Tip as _;
use crate::app::{format, theme};
use crate::catalog::metrics::{METRICS, Metric};
use crate::lab::icicle::{IcicleWidth, subtree_sums};

/// Most nodes that the line of nodes above the topmost one names.
const NAMED: usize = 5;

const PURPOSE: &str =
    "The whole tree at a glance: each node below its parent, as wide as its share of cost, visits or triangles";

/// The tree from the root downwards.
pub(super) const VIEW: View = View {
    add_studies: add_widths,
    needs_visits: |state| {
        let IcicleState { width, color, .. } = state.lab.icicle;
        width == IcicleWidth::Visits || color.needs_visits
    },
    needs_regrets: |state| state.lab.icicle.color.needs_regrets,
    ..View::new(IcicleState::VIEW, PURPOSE, Key::F7, show)
};

fn show(ui: &mut Ui, state: &mut AppState) {
    let Some(shown) = parts::presented_tree(ui, state, "Open a model to see its tree as an icicle") else { return };
    state.lab.icicle.follow(&shown.accel);
    ui.horizontal(|ui| {
        let view = &mut state.lab.icicle;
        let choices = IcicleWidth::ALL.map(|width| (width, width.label(), width.meaning()));
        parts::drop_down(ui, "Width", "What the width of a node stands for", &mut view.width, &choices);
        let choices = METRICS.map(|metric| (metric, metric.label, metric.meaning));
        parts::drop_down(ui, "Colour", "What the colour of a node stands for", &mut view.color, &choices);
        legend(ui, state, &shown);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            copy(ui, state, &shown);
            breadcrumb(ui, state, &shown);
        });
    });
    let view = &state.lab.icicle;
    if view.width == IcicleWidth::Visits || view.color.needs_visits {
        ui.horizontal(|ui| {
            parts::rays(ui, state, &shown);
            if let Some(reason) = parts::no_rays(state, &shown) {
                ui.weak(reason);
            }
        });
    }
    plot::show(ui, state, &shown);
}

/// Width of the hint in points. In a narrower window it is left out.
const HINT_WIDTH: f32 = 200.0;

/// The button that copies the icicle as an image.
fn copy(ui: &mut Ui, state: &mut AppState, shown: &Presented) {
    let layout = state.lab.icicle.last_layout(&shown.accel).cloned();
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
fn breadcrumb(ui: &mut Ui, state: &mut AppState, shown: &Presented) {
    let mut path = vec![state.lab.icicle.top()];
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
        state.lab.icicle.zoom_to(node);
    }
}

/// Adds the study: the width of each node, derived from all that is below it.
fn add_widths(studies: &mut Studies) -> std::io::Result<()> {
    let plan = StudyPlan::new(
        "icicle",
        "Measuring subtrees",
        |state| &mut state.lab.icicle.sums,
        |state, _| state.inputs_of_view(IcicleState::VIEW, LabState::icicle_inputs),
    );
    studies.add(plan, |accel, inputs: &IcicleInputs, token| {
        accel.compute_ancestry(token)?;
        subtree_sums(accel, inputs.width, inputs.visits.as_ref(), token)
    })
}

/// Width of the gradient in points.
const WIDTH: f32 = 72.0;
/// Steps of the gradient.
const STEPS: u16 = 24;

/// Shows the colours of the icicle for the icicle that was laid out last.
fn legend(ui: &mut Ui, state: &AppState, shown: &Presented) {
    let metric = state.lab.icicle.color;
    let Some(layout) = state.lab.icicle.last_layout(&shown.accel) else { return };
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

/// The colour at a position on the scale, 0 to 1; `none` for a node without a value.
fn color(position: Option<f32>, none: Color32) -> Color32 {
    position.map_or(none, theme::scale_color)
}

/// A value of a metric as text.
fn metric_text(metric: &'static Metric, value: f32) -> String {
    format::of_metric(metric, value)
}
