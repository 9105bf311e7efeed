//! Parts of views that list nodes: a row that stands for a node, with what pointing, clicking and double clicking do in
//! every such list; and the button that measures visits from the present view.

use std::path::Path;
use std::sync::Arc;

use egui::{
    self, Align2, Color32, CornerRadius, Rect, Response, Role, ScrollArea, Sense, TextStyle, Ui, WidgetInfo, pos2, vec2,
};

use crate::accel::Accel;
use crate::app::state::action::{Action, RankingStep};
use crate::app::state::{AppState, Derived, Presented, Request, Study};
use crate::app::theme;
use crate::app::widgets::{DropDown, Tip as _, chip, empty_view};
use crate::catalog::metrics::{Metric, Source};
use crate::lab::population::Population;

/// Height of a row in points.
pub(super) const ROW_HEIGHT: f32 = 18.0;
/// Gap between two columns in points.
pub(super) const GAP: f32 = 12.0;

/// Why a tree over copies has no end-point overlap.
pub(super) const NO_OVERLAP: &str = "A tree over copies has no end-point overlap: the surface is that of their meshes";

/// The tree that views show, with its picture; shows `otherwise`, a hint, where there are none.
pub(super) fn presented(ui: &mut Ui, state: &AppState, otherwise: &str) -> Option<Presented> {
    if state.model.presented.is_none() {
        empty_view(ui, otherwise);
    }
    state.model.in_views().cloned()
}

/// The same where that has nodes.
pub(super) fn presented_tree(ui: &mut Ui, state: &AppState, otherwise: &str) -> Option<Presented> {
    let shown = state.model.in_views().filter(|shown| !shown.table.is_empty()).cloned();
    if shown.is_none() {
        empty_view(ui, otherwise);
    }
    shown
}

/// The buttons that select the next and the previous `noun` of a list by `action`, whose keys they name, in a row from the right.
pub(super) fn steps(
    ui: &mut Ui,
    state: &mut AppState,
    is_enabled: bool,
    noun: &str,
    action: fn(RankingStep) -> Action,
    keys: [&str; 2],
) {
    let steps = [(RankingStep::Next, "Next"), (RankingStep::Previous, "Previous")];
    for ((step, label), key) in steps.into_iter().zip(keys) {
        let tip = format!("Select the {} {noun} of the list and look at it ({key})", label.to_lowercase());
        if ui.add_enabled(is_enabled, egui::Button::new(label)).tip(tip).clicked() {
            state.activity.requests.push(Request::Perform(action(step)));
        }
    }
}

/// The rest of the view in two parts beside each other, with `gap` points between them; the left one takes a `share` of the width.
pub(super) fn beside(ui: &Ui, share: f32, gap: f32) -> [Rect; 2] {
    let whole = ui.available_rect_before_wrap();
    let middle = whole.left() + whole.width() * share;
    [
        Rect::from_min_max(whole.min, pos2(middle - gap * 0.5, whole.bottom())),
        Rect::from_min_max(pos2(middle + gap * 0.5, whole.top()), whole.max),
    ]
}

/// The name of a file for a plot of the model, without its ending.
pub(super) fn plot_name(shown: &Presented, what: &str) -> String {
    let label = shown.accel.scene.source.label();
    let stem = Path::new(&label).file_stem().map_or(label.clone(), |stem| stem.to_string_lossy().into());
    format!("{stem}-{what}")
}

/// The scroll area of a list of rows of [`ROW_HEIGHT`], scrolled so that the row `revealed` is in its middle.
pub(super) fn list(ui: &Ui, id: &str, revealed: Option<usize>) -> ScrollArea {
    let area = ScrollArea::vertical().id_salt(id).auto_shrink(false);
    match revealed {
        Some(row) => area.vertical_scroll_offset((row as f32 * ROW_HEIGHT - ui.available_height() * 0.5).max(0.0)),
        None => area,
    }
}

/// A text in a column.
pub(super) struct Cell<'a> {
    /// The text.
    pub(super) text: &'a str,
    /// Width of the column in points.
    pub(super) width: f32,
}

/// Shows a row for `node`, which begins `indent` points from the left with `name`, and has `cells` at its right end. Lights the node up
/// while it is pointed at, selects it by a click and frames it by a double click.
pub(super) fn node_row(
    ui: &mut Ui,
    state: &mut AppState,
    node: u32,
    name: (&str, f32),
    cells: &[Cell<'_>],
) -> Response {
    let nodes = &state.selection.nodes;
    let response = text_row(ui, name, cells, nodes.selected == Some(node), nodes.hovered == Some(node));
    if response.hovered() {
        state.selection.point_at(node);
    }
    if response.clicked() {
        state.select_node(node);
    }
    if response.double_clicked() {
        state.activity.requests.push(Request::Perform(Action::FrameSelection));
    }
    response
}

/// Shows a row that begins `indent` points from the left with `name`, and has `cells` at its right end.
pub(super) fn text_row(
    ui: &mut Ui,
    (name, indent): (&str, f32),
    cells: &[Cell<'_>],
    selected: bool,
    pointed: bool,
) -> Response {
    let palette = theme::palette(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW_HEIGHT), Sense::click());
    response.widget_info(|| {
        let cells = cells.iter().map(|cell| cell.text).filter(|text| !text.is_empty());
        let text = std::iter::once(name).chain(cells).collect::<Vec<_>>().join(", ");
        WidgetInfo::selected(Role::ListItem, true, selected, text)
    });
    let fill =
        if selected { Some(ui.visuals().selection.bg_fill) } else { pointed.then(|| ui.visuals().faint_bg_color) };
    if let Some(fill) = fill {
        ui.painter().rect_filled(rect, CornerRadius::same(3), fill);
    }
    let color = if selected { ui.visuals().selection.stroke.color } else { palette.text };
    let right = texts_from_the_right(ui, rect, cells, if selected { color } else { palette.dim });
    let left = Rect::from_min_max(pos2(rect.left() + indent, rect.top()), pos2(right, rect.bottom()));
    let painter = ui.painter().with_clip_rect(left.intersect(ui.clip_rect()));
    painter.text(left.left_center(), Align2::LEFT_CENTER, name, TextStyle::Body.resolve(ui.style()), color);
    if response.has_focus() {
        let stroke = egui::Stroke::new(1.0, palette.accent);
        ui.painter().rect_stroke(rect, CornerRadius::same(3), stroke, egui::StrokeKind::Inside);
    }
    response
}

/// Paints `cells` right-aligned in their columns, the last at the right end. Returns where they begin.
fn texts_from_the_right(ui: &Ui, rect: Rect, cells: &[Cell<'_>], color: Color32) -> f32 {
    let font = TextStyle::Body.resolve(ui.style());
    let mut right = rect.right() - 4.0;
    for cell in cells.iter().rev() {
        ui.painter().text(pos2(right, rect.center().y), Align2::RIGHT_CENTER, cell.text, font.clone(), color);
        right -= cell.width + GAP;
    }
    right
}

/// The button that measures visits by the rays of the present view.
fn measure_here(ui: &mut Ui, state: &mut AppState, shown: &Presented) {
    let scene = &shown.accel.scene;
    let present = state.view_rays();
    let can = state.model.derived.rays(scene).is_some_and(|rays| rays != present.of(state.model.derived.population));
    let response = ui.add_enabled(can, egui::Button::new("Measure this view"));
    let tip = "Count the visits again, by the rays of the view that you see now. Until then they stay those of an earlier view";
    let response = response.tip(tip).disabled_tip("Visits are those of the view that you see");
    if response.clicked() {
        state.model.derived.measure_by(scene, present);
    }
}

/// The list of the kinds of rays, and whether those of a file are drawn.
pub(super) fn population(ui: &mut Ui, state: &mut AppState, tip: &str) {
    let derived = &mut state.model.derived;
    let choices: Vec<_> = derived.populations().map(|of| (of, of.label(), of.meaning())).collect();
    DropDown::new("Rays", &choices).beside(ui, "Rays", tip, &mut derived.population);
    if derived.population == Population::File {
        let tip = "Draw 2,000 of the rays over the picture, at equal distances in the file, up to what they hit";
        ui.checkbox(&mut derived.ray_file.are_drawn, "Draw").tip(tip);
    }
}

/// The list of the kinds of rays that visits are measured by, and the button that measures those of the present view.
pub(crate) fn rays(ui: &mut Ui, state: &mut AppState, shown: &Presented) {
    population(ui, state, "The rays by which visits are measured");
    measure_here(ui, state, shown);
}

/// The layout that depths, containers and icicle are of, while one is on show; a click ends that.
pub(crate) fn layout_on_show(ui: &mut Ui, state: &mut AppState) {
    let Some(name) = state.model.layout_name() else { return };
    let tip =
        "Depths, containers and Icicle are those of this layout of the wide tree. Click for the binary tree again";
    if chip(ui, &format!("Layout {name}"), true, tip) {
        state.model.layout.chosen = None;
    }
}

/// Why no visits were measured, where the view has none of the chosen rays.
pub(super) fn no_rays(state: &AppState, shown: &Presented) -> Option<&'static str> {
    let rays = state.model.derived.rays(&shown.accel.scene)?;
    let measured = state.model.derived.visits.get(&shown.accel, &rays)?;
    (measured.sums.rays == 0).then(|| rays.population().absence(rays.light()))
}

/// Why the nodes of a tree have no values of a metric yet, or never will.
pub(crate) fn missing(state: &AppState, shown: &Presented, metric: &Metric) -> Option<&'static str> {
    let accel = &shown.accel;
    match metric.source {
        Source::Tree | Source::Counts => None,
        Source::Visits if state.model.derived.known_visits(accel).is_none() => Some("Measuring visits"),
        Source::Visits => no_rays(state, shown),
        Source::Regrets if !accel.report.stats.is_binary() => Some("Subtrees are rebuilt of binary trees only"),
        Source::Regrets => {
            accel.known_regrets().is_none().then_some("Rebuilding subtrees, to see what each could save")
        }
        Source::BuiltAreas => {
            accel.built_areas().is_none().then_some("Known of trees that are kept or fitted while the model moves")
        }
    }
}

/// In place of what `study` of the tree `accel` derives from `inputs`: `text` until it is there, or the button that begins it again
/// once it, or the measurement that it needs, was stopped.
pub(super) fn wait_for<K: PartialEq, V>(
    ui: &mut Ui,
    derived: &mut Derived,
    accel: &Arc<Accel>,
    (study, inputs): (&mut Study<K, V>, Option<K>),
    text: &str,
) {
    let is_cancelled = match inputs {
        Some(inputs) => study.is_cancelled(accel, &inputs),
        None => derived.is_measuring_stopped(accel),
    };
    if waiting(ui, is_cancelled, text) {
        study.resume();
        derived.resume_measuring();
    }
}

/// The line of a view that has nothing to show: its job is running, waits, or was stopped, with a button to begin again.
/// Returns whether to begin again.
pub(super) fn waiting(ui: &mut Ui, is_cancelled: bool, text: &str) -> bool {
    let mut again = false;
    ui.vertical_centered(|ui| {
        ui.add_space(ui.available_height() * 0.3);
        ui.weak(if is_cancelled { "Stopped" } else { text });
        again = is_cancelled && ui.button("Begin again").clicked();
    });
    again
}
