//! The icicle itself: painted cells, what pointing, clicking and keys do in it, and its image for other programs.

use std::fmt::Write as _;

use egui::{
    self, Align2, Color32, ColorImage, CornerRadius, EventFilter, Key, Mesh, Rect, Response, Role, Sense, Stroke,
    StrokeKind, TextStyle, Ui, WidgetInfo, pos2, vec2,
};

use super::state::value;
use super::{IcicleLayout, IcicleView};
use crate::accel::node_values::NodeValues;
use crate::app::state::action::Action;
use crate::app::state::{AppState, Presented, Request};
use crate::app::views::parts;
use crate::app::{format, theme};
use crate::catalog::metrics::METRICS;
use crate::lab::icicle::IcicleCell;
use bvhscope_engine::layouts::KeptNodes;

/// Least and largest height of a level in points.
const LEVEL_HEIGHT: [f32; 2] = [4.0, 18.0];
/// Least width and height of a cell in points that has its name in it.
const NAMED_SIZE: [f32; 2] = [44.0, 13.0];

impl IcicleView {
    /// Shows the icicle.
    pub(super) fn plot(&mut self, ui: &mut Ui, state: &mut AppState, shown: &Presented) {
        let rect = ui.available_rect_before_wrap();
        let scale = ui.ctx().pixels_per_point();
        let columns = (rect.width() * scale).floor().max(1.0) as u32;
        let levels = (rect.height() / LEVEL_HEIGHT[0]).floor().max(1.0) as u32;
        let visits = state.model.derived.known_visits(&shown.accel);
        let height = |layout: &IcicleLayout| {
            (rect.height() / layout.icicle.level_count().max(1) as f32).clamp(LEVEL_HEIGHT[0], LEVEL_HEIGHT[1])
        };
        if !shown.table.has(self.top()) {
            self.zoom_to(shown.table.parent(self.top()).unwrap_or(0));
        }
        let Some(layout) = self.layout(&shown.accel, &shown.table, visits, [columns, levels]) else {
            let inputs = self.inputs(&state.model, &shown.accel);
            let derived = &mut state.model.derived;
            parts::wait_for(ui, derived, &shown.accel, (&mut self.sums, inputs), "Measuring the subtrees");
            return;
        };
        let response = ui.allocate_rect(rect, Sense::click());
        let count = format::count(layout.icicle.cells.len() as u64);
        let name = format!("Icicle of {count} nodes, widths by {}", self.width.label());
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &name));
        let plot = Plot { layout: &layout, rect, column: 1.0 / scale, height: height(&layout) };
        plot.paint(ui);
        plot.marks(ui, state, shown);
        self.pointer(state, shown, &plot, &response);
        self.keys(ui, state, shown, &response);
    }

    /// Lights up the node at the pointer with its numbers; a click selects it, a double click zooms to it and frames it.
    fn pointer(&mut self, state: &mut AppState, shown: &Presented, plot: &Plot<'_>, response: &Response) {
        let Some(cell) = response.hover_pos().and_then(|at| plot.cell_at(at)).copied() else { return };
        state.selection.point_at(cell.node);
        response.clone().on_hover_text_at_pointer(self.facts(state, shown, &cell));
        if response.clicked() {
            response.request_focus();
            state.select_node(cell.node);
        }
        if response.double_clicked() {
            self.zoom_to(cell.node);
            state.activity.requests.push(Request::Perform(Action::FrameSelection));
        }
    }

    /// The numbers of a cell's node.
    fn facts(&self, state: &AppState, shown: &Presented, cell: &IcicleCell) -> String {
        let node = cell.node;
        let visits = state.model.derived.known_visits(&shown.accel);
        let values = NodeValues { accel: &shown.accel, visits: visits.as_ref().map(|visits| &*visits.0) };
        let kind = if shown.table.is_leaf(node) { "Leaf" } else { "Node" };
        let mut text = format!("{kind} {}", format::count(u64::from(node)));
        if let Some(place) = shown.place_in_mesh(node) {
            text = format!("{text}: {place}");
        }
        let mut line = |name: &str, value: String| {
            // Writing into a string cannot fail.
            let _ = write!(text, "\n{name}: {value}");
        };
        if let Some(sums) = self.sums_of(&shown.accel, &shown.table)
            && let (Some(&own), Some(&whole)) = (sums.get(node as usize), sums.first())
            && whole > 0.0
        {
            let share = format::percent(f64::from(own / whole));
            line(&format!("{} with all below", self.width.label()), share);
        }
        for metric in METRICS {
            if let Some(value) = value(&values, &shown.table, metric, node) {
                line(metric.label, super::metric_text(metric, value));
            }
        }
        if shown.table.kept().is_some() {
            let below = match shown.table.below(node).count() as u64 {
                0 => "a leaf of the layout".to_owned(),
                count => format!("{} in the layout", format::counted(count, "child")),
            };
            line("The numbers are those of the binary node", below);
        }
        if cell.is_narrow {
            text.push_str("\nNarrower than a pixel: its neighbours are not drawn. Zoom in to see them");
        }
        text
    }

    /// While the icicle has the keyboard: arrows walk the tree, Enter zooms to the selected node, Backspace zooms out.
    fn keys(&mut self, ui: &Ui, state: &mut AppState, shown: &Presented, response: &Response) {
        if !response.has_focus() {
            return;
        }
        let filter = EventFilter { horizontal_arrows: true, vertical_arrows: true, ..EventFilter::default() };
        ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
        let stroke = Stroke::new(1.0, theme::palette(ui).accent);
        ui.painter().rect_stroke(response.rect, CornerRadius::same(2), stroke, StrokeKind::Inside);
        let pressed = |key: Key| ui.input(|input| input.modifiers.is_none() && input.key_pressed(key));
        let walks = [
            (Key::ArrowUp, Action::SelectParent),
            (Key::ArrowDown, Action::SelectChild),
            (Key::ArrowLeft, Action::SelectPreviousSibling),
            (Key::ArrowRight, Action::SelectNextSibling),
        ];
        for (key, action) in walks {
            if !pressed(key) {
                continue;
            }
            match (shown.table.kept(), state.selection.nodes.selected) {
                (Some(kept), Some(node)) if kept.keeps(node) => {
                    if let Some(next) = beside(kept, node, key) {
                        state.select_node(next);
                    }
                }
                _ => state.activity.requests.push(Request::Perform(action)),
            }
        }
        if pressed(Key::Enter)
            && let Some(node) = state.selection.nodes.selected.filter(|&node| (node as usize) < shown.table.len())
        {
            self.zoom_to(node);
        }
        if pressed(Key::Backspace)
            && let Some(parent) = shown.table.parent(self.top())
        {
            self.zoom_to(parent);
        }
    }
}

/// The node of a layout that an arrow leads to from `node`, siblings in a circle.
fn beside(kept: &KeptNodes, node: u32, key: Key) -> Option<u32> {
    match key {
        Key::ArrowUp => kept.parent(node),
        Key::ArrowDown => kept.children(node).first().copied(),
        _ => {
            let family = kept.children(kept.parent(node)?);
            let at = family.iter().position(|&sibling| sibling == node)?;
            let next = if key == Key::ArrowLeft { at + family.len() - 1 } else { at + 1 };
            Some(family[next % family.len()])
        }
    }
}

/// Where cells are on the screen.
struct Plot<'a> {
    layout: &'a IcicleLayout,
    rect: Rect,
    /// Width of a pixel column in points.
    column: f32,
    /// Height of a level in points.
    height: f32,
}

impl Plot<'_> {
    fn rect_of(&self, cell: &IcicleCell) -> Rect {
        let x = |px: u32| self.rect.left() + px as f32 * self.column;
        let top = self.rect.top() + cell.level as f32 * self.height;
        // A line of the background between levels, and between cells that are wide enough.
        let gap = if cell.right_px - cell.left_px > 3 { self.column } else { 0.0 };
        let gap_below = if self.height > 6.0 { 1.0 } else { 0.0 };
        Rect::from_min_max(pos2(x(cell.left_px), top), pos2(x(cell.right_px) - gap, top + self.height - gap_below))
    }

    fn cell_at(&self, at: egui::Pos2) -> Option<&IcicleCell> {
        let offset = at - self.rect.min;
        if offset.x < 0.0 || offset.y < 0.0 {
            return None;
        }
        self.layout.icicle.at((offset.y / self.height) as u32, (offset.x / self.column) as u32)
    }

    /// Paints all cells as one mesh, and the names of those that have room.
    fn paint(&self, ui: &Ui) {
        let none = theme::palette(ui).rail;
        let font = TextStyle::Small.resolve(ui.style());
        let cells = &self.layout.icicle.cells;
        let mut mesh = Mesh::default();
        mesh.reserve_vertices(cells.len() * 4);
        mesh.reserve_triangles(cells.len() * 2);
        for (cell, position) in cells.iter().zip(&self.layout.positions) {
            mesh.add_colored_rect(self.rect_of(cell), super::color(*position, none));
        }
        ui.painter().add(mesh);
        for (cell, position) in cells.iter().zip(&self.layout.positions) {
            let rect = self.rect_of(cell);
            if rect.width() < NAMED_SIZE[0] || rect.height() < NAMED_SIZE[1] {
                continue;
            }
            let text = if cell.node == 0 { "root".to_owned() } else { format::count(u64::from(cell.node)) };
            let fill = super::color(*position, none);
            let is_bright = u32::from(fill.r()) * 3 + u32::from(fill.g()) * 6 + u32::from(fill.b()) > 1_150;
            let color = if is_bright { Color32::from_gray(0x16) } else { Color32::WHITE };
            let painter = ui.painter().with_clip_rect(rect);
            painter.text(rect.left_center() + vec2(4.0, 0.0), Align2::LEFT_CENTER, text, font.clone(), color);
        }
    }

    /// Outlines the selected and the hovered node, or what is drawn of the nodes above them.
    fn marks(&self, ui: &Ui, state: &AppState, shown: &Presented) {
        let palette = theme::palette(ui);
        let nodes = &state.selection.nodes;
        let marks = [(nodes.selected, palette.warm, 2.0), (nodes.hovered, ui.visuals().strong_text_color(), 1.5)];
        for (node, color, width) in marks {
            let mut node = node.filter(|&node| (node as usize) < shown.table.len());
            while let Some(at) = node {
                if let Some(cell) = self.layout.icicle.cell_of(at) {
                    // Narrow cells are widened, so that the mark is seen.
                    let rect = self.rect_of(cell).expand2(vec2(if cell.is_narrow { 1.0 } else { 0.0 }, 0.0));
                    let stroke = Stroke::new(width, color);
                    ui.painter().rect_stroke(rect, CornerRadius::same(1), stroke, StrokeKind::Inside);
                    break;
                }
                node = shown.table.parent(at);
            }
        }
    }
}

/// Height of a level in pixels, the line below it included.
const LEVEL_PX: usize = 12;

/// The icicle with one pixel for each of its columns, on `background`; nodes without a value are `none`.
pub(super) fn image(layout: &IcicleLayout, columns: u32, background: Color32, none: Color32) -> ColorImage {
    let size = [columns as usize, layout.icicle.level_count() * LEVEL_PX];
    let mut image = ColorImage::filled(size, background);
    for (cell, position) in layout.icicle.cells.iter().zip(&layout.positions) {
        let color = super::color(*position, none);
        let (left, right) = (cell.left_px as usize, (cell.right_px as usize).min(size[0]));
        // A line of the background between cells that are wide enough.
        let right = if right - left > 3 { right - 1 } else { right };
        let top = cell.level as usize * LEVEL_PX;
        for row in top..top + LEVEL_PX - 1 {
            image.pixels[row * size[0] + left..row * size[0] + right].fill(color);
        }
    }
    image
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::metric_scale::MetricScale;
    use crate::catalog::metrics;
    use crate::lab::icicle::Icicle;

    #[test]
    fn cells_are_where_the_layout_has_them() {
        let children = |node: u32| if node == 0 { 1..3 } else { 0..0 };
        let icicle = Icicle::new(children, &[4.0, 1.0, 2.0], 0, 16, 9);
        let scale = MetricScale { metric: metrics::OVERLAP, ends: [0.0, 1.0] };
        let layout = IcicleLayout { icicle, positions: vec![Some(0.0), Some(1.0), None], scale };
        let image = image(&layout, 16, Color32::BLACK, Color32::RED);
        assert_eq!(image.size, [16, 2 * LEVEL_PX]);
        let at = |x: usize, y: usize| image.pixels[y * 16 + x];
        assert_eq!([at(0, 0), at(14, 0)], [super::super::color(Some(0.0), Color32::RED); 2]);
        assert_eq!(at(0, LEVEL_PX - 1), Color32::BLACK, "a line between levels");
        let of_children = [at(2, LEVEL_PX), at(4, LEVEL_PX), at(12, LEVEL_PX)];
        assert_eq!(of_children, [super::super::color(Some(1.0), Color32::RED), Color32::RED, Color32::BLACK]);
    }
}
