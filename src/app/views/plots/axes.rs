//! A pair of axes: grid, labels, and where values are on the screen.

use egui::{self, Align2, Color32, FontId, Painter, Pos2, Rect, Stroke, Ui, Vec2, pos2, vec2};

use crate::app::{format, theme};
use crate::lab::plot::Axis;

/// Room for labels in points: on the left, above, on the right, below.
const MARGINS: [f32; 4] = [46.0, 18.0, 10.0, 30.0];
/// Distance in points from one label to the next: across, and up.
const LABEL_STEP: [f32; 2] = [52.0, 22.0];
/// Height of a label in points.
const LABEL_HEIGHT: f32 = 12.0;

/// A pair of axes in a rectangle of the screen.
pub(super) struct Axes {
    /// Where the values are.
    pub(super) plot: Rect,
    axes: [Axis; 2],
}

impl Axes {
    /// Paints grid and labels of `axes` in `rect` under a title. `labels` name what is across and what is up.
    pub(super) fn paint(ui: &Ui, rect: Rect, axes: [Axis; 2], title: &str, labels: [&str; 2]) -> Self {
        let [left, top, right, bottom] = MARGINS;
        let plot = Rect::from_min_max(rect.min + vec2(left, top), rect.max - vec2(right, bottom));
        let this = Self { plot, axes };
        let palette = theme::palette(ui);
        let font = FontId::proportional(theme::HEADING_SIZE);
        let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
        let grid = Stroke::new(1.0, palette.line);
        let most = |length: f32, step: f32| (length / step).max(1.0) as usize;
        for value in axes[0].ticks(most(plot.width(), LABEL_STEP[0])) {
            let x = this.at([value, axes[1].low]).x;
            painter.vline(x, plot.y_range(), grid);
            let at = pos2(x, plot.bottom() + 2.0);
            painter.text(at, Align2::CENTER_TOP, format::significant(value), font.clone(), palette.dim);
        }
        let mut free_from = plot.bottom() + LABEL_HEIGHT;
        for value in axes[1].ticks(most(plot.height(), LABEL_STEP[1])) {
            let y = this.at([axes[0].low, value]).y;
            let is_never = axes[1].is_never(value);
            if is_never {
                let top = this.at([axes[0].low, 1.0]).y;
                let band = Rect::from_x_y_ranges(plot.x_range(), top..=plot.bottom());
                painter.rect_filled(band, 0.0, palette.line.gamma_multiply(0.5));
            } else {
                painter.hline(plot.x_range(), y, grid);
            }
            // In a low plot the band for never leaves no room for the label of 1.
            if y + LABEL_HEIGHT * 0.5 <= free_from {
                let text = if is_never { "never".to_owned() } else { format::significant(value) };
                let at = pos2(plot.left() - 4.0, y);
                painter.text(at, Align2::RIGHT_CENTER, text, font.clone(), palette.dim);
                free_from = y - LABEL_HEIGHT * 0.5;
            }
        }
        painter.rect_stroke(plot, 0.0, grid, egui::StrokeKind::Outside);
        let below = pos2(plot.center().x, rect.bottom());
        painter.text(below, Align2::CENTER_BOTTOM, labels[0], font.clone(), palette.dim);
        let above = pos2(rect.left(), rect.top());
        painter.text(above, Align2::LEFT_TOP, format!("{} · {title}", labels[1]), font, palette.text);
        this
    }

    /// Where a pair of values is on the screen.
    pub(super) fn at(&self, values: [f64; 2]) -> Pos2 {
        self.place([self.axes[0].at(values[0]), self.axes[1].at(values[1])])
    }

    /// Where a place from the left and from below, each 0 to 1, is on the screen.
    pub(super) fn place(&self, place: [f64; 2]) -> Pos2 {
        pos2(
            self.plot.left() + self.plot.width() * place[0] as f32,
            self.plot.bottom() - self.plot.height() * place[1] as f32,
        )
    }

    /// The place of a point of the screen, the other way round.
    pub(super) fn place_of(&self, at: Pos2) -> [f64; 2] {
        let offset = at - self.plot.left_bottom();
        [f64::from(offset.x / self.plot.width()), f64::from(-offset.y / self.plot.height())]
    }

    /// A painter that draws nothing outside of the plot but what lies on its edge.
    pub(super) fn painter(&self, ui: &Ui) -> Painter {
        ui.painter().with_clip_rect(self.plot.expand(6.0).intersect(ui.clip_rect()))
    }

    /// Paints the line on which both values are the same.
    pub(super) fn diagonal(&self, ui: &Ui, color: Color32) {
        let low = self.axes[0].low.max(self.axes[1].low);
        let high = self.axes[0].high.min(self.axes[1].high);
        if low < high {
            let ends = [self.at([low; 2]), self.at([high; 2])];
            self.painter(ui).line_segment(ends, Stroke::new(1.0, color));
        }
    }
}

/// Size of the rest of the view, at least one in which a plot can be read.
pub(super) fn rest(ui: &Ui) -> Vec2 {
    vec2(ui.available_width().max(160.0), (ui.available_height() - 2.0).max(100.0))
}
