//! Icons, painted as lines because the fonts may lack such glyphs, and the button that shows one.

use std::f32::consts::{FRAC_PI_2, TAU};

use egui::epaint::PathStroke;
use egui::{
    Color32, CornerRadius, Painter, Pos2, Rect, Response, Role, Sense, Shape, Stroke, StrokeKind, Ui, Vec2, WidgetInfo,
    vec2,
};

use crate::app::state::Side;
use crate::app::theme;

/// Icon of a button without text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Icon {
    /// Reset to the default: a circular arrow.
    Reset,
    /// Close or stop: a cross.
    Close,
    /// On: a tick.
    Tick,
    /// Fold or unfold a row: a triangle that points down where the flag, whether it is unfolded, is set.
    Fold(bool),
    /// Copy: two overlapping sheets.
    Copy,
    /// Play: a triangle that points to the right.
    Play,
    /// Pause: two bars.
    Pause,
    /// One step: a triangle that points forward where the flag is set, with a bar behind it.
    Step(bool),
    /// To the next place worth seeing: two triangles that point forward where the flag is set.
    Jump(bool),
    /// A side panel: a window with that side filled where the flag, whether the panel is shown, is set.
    Panel(Side, bool),
}

impl Icon {
    /// Paints the icon around `center`, about 10 points wide. `behind` is the colour of the background, which fills what is
    /// in front.
    #[expect(clippy::too_many_lines, reason = "a table of shapes")]
    pub(crate) fn paint(self, painter: &Painter, center: Pos2, color: Color32, behind: Color32) {
        let stroke = Stroke::new(1.4, color);
        match self {
            Self::Reset => reset(painter, center, stroke),
            Self::Panel(side, shown) => {
                let window = Rect::from_center_size(center, vec2(13.0, 11.0));
                let split = if side == Side::Left { window.left() + 4.5 } else { window.right() - 4.5 };
                let mut part = window;
                *(if side == Side::Left { part.right_mut() } else { part.left_mut() }) = split;
                if shown {
                    painter.rect_filled(part, CornerRadius::same(1), color);
                }
                let stroke = Stroke::new(1.2, color);
                painter.rect_stroke(window, CornerRadius::same(2), stroke, StrokeKind::Middle);
                painter.vline(split, window.y_range(), stroke);
            }
            Self::Close => {
                for side in [-1.0, 1.0] {
                    let half = vec2(3.5, 3.5 * side);
                    painter.line_segment([center - half, center + half], stroke);
                }
            }
            Self::Tick => {
                let points = [vec2(-4.0, 0.0), vec2(-1.3, 2.8), vec2(4.0, -3.2)].map(|offset| center + offset);
                painter.add(Shape::line(points.to_vec(), PathStroke::new(1.6, color)));
            }
            Self::Fold(unfolded) => {
                let points = if unfolded {
                    [vec2(-3.5, -2.0), vec2(3.5, -2.0), vec2(0.0, 3.0)]
                } else {
                    [vec2(-2.0, -3.5), vec2(3.0, 0.0), vec2(-2.0, 3.5)]
                };
                let points = points.map(|offset| center + offset).to_vec();
                painter.add(Shape::convex_polygon(points, color, Stroke::NONE));
            }
            Self::Play => triangle(painter, center + vec2(-3.0, 0.0), 8.0, color),
            Self::Pause => {
                for x in [-2.5, 2.5] {
                    let bar = Rect::from_center_size(center + vec2(x, 0.0), vec2(2.4, 9.0));
                    painter.rect_filled(bar, CornerRadius::ZERO, color);
                }
            }
            Self::Step(forward) => {
                let side = if forward { 1.0 } else { -1.0 };
                let bar = Rect::from_center_size(center + vec2(-3.5 * side, 0.0), vec2(1.6, 8.0));
                painter.rect_filled(bar, CornerRadius::ZERO, color);
                triangle(painter, center + vec2(-side, 0.0), 5.5 * side, color);
            }
            Self::Jump(forward) => {
                let side = if forward { 1.0 } else { -1.0 };
                for x in [-5.0, 0.0] {
                    triangle(painter, center + vec2(x * side, 0.0), 5.0 * side, color);
                }
            }
            Self::Copy => {
                for (offset, fill) in [(vec2(1.5, -1.5), Color32::TRANSPARENT), (vec2(-1.5, 1.5), behind)] {
                    let sheet = Rect::from_center_size(center + offset, vec2(6.0, 7.0));
                    let stroke = Stroke::new(1.2, color);
                    painter.rect(sheet, CornerRadius::same(1), fill, stroke, StrokeKind::Middle);
                }
            }
        }
    }
}

/// A triangle whose base is at `base` and whose tip is `length` points to the right of it, to the left where that is negative.
fn triangle(painter: &Painter, base: Pos2, length: f32, color: Color32) {
    let points = [vec2(0.0, -4.5), vec2(length, 0.0), vec2(0.0, 4.5)].map(|offset| base + offset);
    painter.add(Shape::convex_polygon(points.to_vec(), color, Stroke::NONE));
}

/// A counterclockwise arrow along three quarters of a circle.
fn reset(painter: &Painter, center: Pos2, stroke: Stroke) {
    const RADIUS: f32 = 4.2;
    const STEPS: u16 = 20;
    let (from, to) = (0.38 * TAU, -0.36 * TAU);
    let at = |angle: f32| center + RADIUS * Vec2::angled(angle);
    let points = (0..=STEPS).map(|step| at(from + (to - from) * f32::from(step) / f32::from(STEPS))).collect();
    painter.add(Shape::line(points, PathStroke::new(stroke.width, stroke.color)));
    let along = Vec2::angled(to - FRAC_PI_2);
    let out = Vec2::angled(to);
    let tip = at(to) + 3.8 * along;
    painter.add(Shape::convex_polygon(
        vec![tip, at(to) - 3.0 * out - 0.6 * along, at(to) + 3.0 * out - 0.6 * along],
        stroke.color,
        Stroke::NONE,
    ));
}

/// A button with an icon; its background is painted only while the pointer is over it. `name` is its accessible name.
pub(crate) fn icon_button(ui: &mut Ui, rect: Rect, icon: Icon, name: &str) -> Response {
    let palette = theme::palette(ui);
    let response = ui.interact(rect, ui.scope_id().with(("icon", name)), Sense::click());
    response.widget_info(|| WidgetInfo::labeled(Role::Button, ui.is_enabled(), name));
    let hot = response.hovered() || response.has_focus();
    let behind = if hot { ui.visuals().widgets.hovered.weak_bg_fill } else { ui.visuals().panel_fill };
    if hot {
        ui.painter().rect_filled(rect.shrink(2.0), CornerRadius::same(4), behind);
    }
    let color = if hot { ui.visuals().strong_text_color() } else { palette.dim };
    icon.paint(ui.painter(), rect.center(), color, behind);
    response
}
