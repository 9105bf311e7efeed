//! A row of a list that stands for a node: its cells, and what pointing, clicking and double clicking do in every such list.

use egui::{self, Align2, Color32, CornerRadius, Rect, Response, Role, Sense, TextStyle, Ui, WidgetInfo, pos2, vec2};

use crate::app::state::action::Action;
use crate::app::state::{AppState, Request};
use crate::app::theme;

/// Height of a row in points.
pub(super) const HEIGHT: f32 = 18.0;
/// Gap between two columns in points.
pub(super) const GAP: f32 = 12.0;

/// A text in a column.
pub(super) struct Cell<'a> {
    /// The text.
    pub(super) text: &'a str,
    /// Width of the column in points.
    pub(super) width: f32,
}

/// Shows a row for `node`, which begins `indent` points from the left with `name`, and has `cells` at its right end. Lights the node up
/// while it is pointed at, selects it by a click and frames it by a double click.
pub(super) fn show(
    ui: &mut Ui,
    state: &mut AppState,
    node: u32,
    (name, indent): (&str, f32),
    cells: &[Cell<'_>],
) -> Response {
    let palette = theme::palette(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT), Sense::click());
    let selected = state.selection.nodes.selected == Some(node);
    response.widget_info(|| {
        let cells = cells.iter().map(|cell| cell.text).filter(|text| !text.is_empty());
        let text = std::iter::once(name).chain(cells).collect::<Vec<_>>().join(", ");
        WidgetInfo::selected(Role::ListItem, true, selected, text)
    });
    let pointed = state.selection.nodes.hovered == Some(node);
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
