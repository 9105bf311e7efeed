//! A pair of axes: grid, labels, and where values are on the screen.

use egui::{
    self, Align2, Color32, FontId, Painter, Pos2, Rect, Response, Role, Sense, Stroke, Ui, Vec2, WidgetInfo, pos2, vec2,
};

use crate::app::theme;
use crate::lab::plot::{Axis, Chart, tick_text};

/// Room for labels in points: on the left, above, on the right, below.
const MARGINS: [f32; 4] = [46.0, 18.0, 10.0, 30.0];
/// Least distance in points from one label to the next: across, and up.
const LABEL_STEP: [f32; 2] = [52.0, 22.0];
/// Width of a character of a label in points, and the distance between labels across.
const CHARACTER: f32 = 6.5;
const LABEL_GAP: f32 = 8.0;
/// Height of a label in points.
const LABEL_HEIGHT: f32 = 12.0;

/// A pair of axes in a rectangle of the screen.
pub(crate) struct Axes {
    /// Where the values are.
    pub(crate) plot: Rect,
    axes: [Axis; 2],
}

/// Texts around a pair of axes.
#[derive(Default)]
pub(crate) struct Lettering<'a> {
    /// Above them, from the left edge.
    pub(crate) heading: &'a str,
    /// Below them.
    pub(crate) across: &'a str,
    /// Names of the rows from below instead of values of the upward axis.
    pub(crate) rows: &'a [String],
    /// Width of the names of the rows in points; 0 where they are beside another pair of axes.
    pub(crate) rows_width: f32,
}

impl Axes {
    /// Paints the axes of `chart` in the rest of the view; also returns the response to the pointer there.
    pub(crate) fn of_chart(ui: &mut Ui, chart: &Chart) -> (Self, Response) {
        let (rect, response) = ui.allocate_exact_size(rest(ui), Sense::hover());
        let [across, up] = &chart.labels;
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, format!("Plot of {up} over {across}")));
        (Self::paint(ui, rect, chart.axes, &Lettering { heading: up, across, ..Lettering::default() }), response)
    }

    /// Paints grid, labels and lettering of `axes` in `rect`.
    pub(crate) fn paint(ui: &Ui, rect: Rect, axes: [Axis; 2], lettering: &Lettering<'_>) -> Self {
        let [left, top, right, bottom] = MARGINS;
        let left = if lettering.rows.is_empty() { left } else { lettering.rows_width + 4.0 };
        let plot = Rect::from_min_max(rect.min + vec2(left, top), rect.max - vec2(right, bottom));
        let this = Self { plot, axes };
        let palette = theme::palette(ui);
        let font = FontId::proportional(theme::HEADING_SIZE);
        let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
        this.paint_across(&painter, ui);
        this.paint_up(&painter, ui, lettering);
        painter.rect_stroke(plot, 0.0, Stroke::new(1.0, palette.line), egui::StrokeKind::Outside);
        let below = pos2(plot.center().x, rect.bottom());
        painter.text(below, Align2::CENTER_BOTTOM, lettering.across, font.clone(), palette.dim);
        painter.text(rect.min, Align2::LEFT_TOP, lettering.heading, font, palette.text);
        this
    }

    fn paint_across(&self, painter: &Painter, ui: &Ui) {
        let (plot, axis, palette) = (self.plot, self.axes[0], theme::palette(ui));
        let font = FontId::proportional(theme::HEADING_SIZE);
        let width = |value| f64::from(tick_text(&axis, value).chars().count() as f32 * CHARACTER);
        let most = (plot.width() / LABEL_STEP[0]).max(1.0) as usize * 2;
        for value in axis.labels(f64::from(plot.width()), f64::from(LABEL_GAP), most, width) {
            let x = self.at([value, self.axes[1].low]).x;
            painter.vline(x, plot.y_range(), Stroke::new(1.0, palette.line));
            let text = painter.layout_no_wrap(tick_text(&axis, value), font.clone(), palette.dim);
            // At the right end there may be less room than half a label.
            let left = (x - text.size().x * 0.5).min(painter.clip_rect().right() - text.size().x);
            painter.galley(pos2(left, plot.bottom() + 2.0), text, palette.dim);
        }
    }

    fn paint_up(&self, painter: &Painter, ui: &Ui, lettering: &Lettering<'_>) {
        let (plot, axis, palette) = (self.plot, self.axes[1], theme::palette(ui));
        let font = FontId::proportional(theme::HEADING_SIZE);
        let (ticks, mut free_from) = match lettering.rows.len() {
            0 => (axis.ticks((plot.height() / LABEL_STEP[1]).max(1.0) as usize), plot.bottom() + LABEL_HEIGHT),
            rows => (axis.ticks(rows), f32::INFINITY),
        };
        for value in ticks {
            let y = self.at([self.axes[0].low, value]).y;
            if axis.is_never(value) {
                let top = self.at([self.axes[0].low, 1.0]).y;
                let band = Rect::from_x_y_ranges(plot.x_range(), top..=plot.bottom());
                painter.rect_filled(band, 0.0, palette.line.gamma_multiply(0.5));
            } else {
                painter.hline(plot.x_range(), y, Stroke::new(1.0, palette.line));
            }
            let text = match lettering.rows.get(value as usize) {
                Some(_) if lettering.rows_width == 0.0 => continue,
                Some(name) => name.clone(),
                None => tick_text(&axis, value),
            };
            // In a low plot the band for never leaves no room for the label of 1.
            if y + LABEL_HEIGHT * 0.5 <= free_from {
                painter.text(pos2(plot.left() - 4.0, y), Align2::RIGHT_CENTER, text, font.clone(), palette.dim);
                free_from = y - LABEL_HEIGHT * 0.5;
            }
        }
    }

    /// Where a pair of values is on the screen.
    pub(crate) fn at(&self, values: [f64; 2]) -> Pos2 {
        self.place([self.axes[0].at(values[0]), self.axes[1].at(values[1])])
    }

    /// Where a place from the left and from below, each 0 to 1, is on the screen.
    pub(crate) fn place(&self, place: [f64; 2]) -> Pos2 {
        pos2(
            self.plot.left() + self.plot.width() * place[0] as f32,
            self.plot.bottom() - self.plot.height() * place[1] as f32,
        )
    }

    /// The place of a point of the screen, the other way round.
    pub(crate) fn place_of(&self, at: Pos2) -> [f64; 2] {
        let offset = at - self.plot.left_bottom();
        [f64::from(offset.x / self.plot.width()), f64::from(-offset.y / self.plot.height())]
    }

    /// A painter that draws nothing outside of the plot but what lies on its edge.
    pub(crate) fn painter(&self, ui: &Ui) -> Painter {
        ui.painter().with_clip_rect(self.plot.expand(6.0).intersect(ui.clip_rect()))
    }

    /// Paints the line on which both values are the same.
    pub(crate) fn diagonal(&self, ui: &Ui, color: Color32) {
        let low = self.axes[0].low.max(self.axes[1].low);
        let high = self.axes[0].high.min(self.axes[1].high);
        if low < high {
            let ends = [self.at([low; 2]), self.at([high; 2])];
            self.painter(ui).line_segment(ends, Stroke::new(1.0, color));
        }
    }
}

/// Size of the rest of the view, at least one in which a plot can be read.
pub(crate) fn rest(ui: &Ui) -> Vec2 {
    vec2(ui.available_width().max(160.0), (ui.available_height() - 2.0).max(100.0))
}
