//! What colours mean, with numbers, over the lower left corner of the viewport.

use eframe::egui::{Align2, Color32, CornerRadius, FontId, Rect, Role, Sense, Ui, WidgetInfo, pos2, vec2};

use crate::app::state::AppState;
use crate::app::{format, theme};
use crate::overlay;
use crate::render::{HeatKind, Shading};

/// Size of one legend in points.
const SIZE: [f32; 2] = [184.0, 52.0];

/// A gradient with its title and numbers.
struct Ramp {
    title: String,
    /// Places between 0 and 1 with what they stand for.
    stops: Vec<(f32, String)>,
    color: Box<dyn Fn(f32) -> [u8; 3]>,
}

pub(super) fn show(ui: &mut Ui, rect: Rect, state: &AppState) {
    let mut bottom = rect.bottom() - 12.0;
    for ramp in [picture_ramp(state), overlay_ramp(state)].into_iter().flatten() {
        let size = vec2(SIZE[0].min(rect.width() - 24.0), SIZE[1]);
        let place = Rect::from_min_size(pos2(rect.left() + 12.0, bottom - size.y), size);
        if place.top() > rect.top() + 12.0 && size.x > 80.0 {
            paint(ui, place, &ramp);
        }
        bottom -= size.y + 8.0;
    }
}

/// The colours of the containers.
fn overlay_ramp(state: &AppState) -> Option<Ramp> {
    let shown = state.presented.as_ref()?;
    let settings = &state.wanted.overlay;
    if !state.preferences.show_containers || !(settings.show_boxes || settings.show_spheres) || state.overlay_failed {
        return None;
    }
    let legend = overlay::legend(settings, &shown.table);
    Some(Ramp {
        title: format!("Containers: {}", lower(legend.title)),
        stops: legend.stops,
        color: Box::new(overlay::ramp),
    })
}

fn lower(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map_or_else(String::new, |first| first.to_lowercase().chain(chars).collect())
}

/// The colours of the picture, in modes where they stand for numbers.
fn picture_ramp(state: &AppState) -> Option<Ramp> {
    let shown = state.presented.as_ref()?;
    if !state.preferences.show_geometry {
        return None;
    }
    let frame = &shown.frame;
    let title = match frame.settings.shading {
        Shading::Heat(HeatKind::Both) => "Picture: tests a pixel",
        Shading::Heat(HeatKind::Containers) => "Picture: container tests a pixel",
        Shading::Heat(HeatKind::Primitives) => "Picture: triangle tests a pixel",
        Shading::Heat(HeatKind::Steps) => "Picture: wide tree steps a pixel",
        Shading::Depth => "Picture: depth",
        _ => return None,
    };
    let [low, high] = frame.value_range;
    let stops = [0.0, 0.5, 1.0].map(|place: f32| {
        (place, format::significant(f64::from((low + (high - low) * place).round_to(frame.settings.shading))))
    });
    let map = frame.settings.color_map;
    Some(Ramp { title: title.to_owned(), stops: stops.to_vec(), color: Box::new(move |place| map.srgb(place)) })
}

/// Counts are whole numbers, distances are not.
trait RoundTo {
    fn round_to(self, shading: Shading) -> Self;
}

impl RoundTo for f32 {
    fn round_to(self, shading: Shading) -> Self {
        if shading == Shading::Depth { self } else { self.round() }
    }
}

fn paint(ui: &mut Ui, rect: Rect, ramp: &Ramp) {
    let palette = theme::palette(ui);
    let response = ui.interact(rect, ui.scope_id().with(&ramp.title), Sense::hover());
    let numbers: Vec<&str> = ramp.stops.iter().map(|(_, text)| text.as_str()).collect();
    let name = format!("Legend. {}: {}", ramp.title, numbers.join(", "));
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &name));
    let painter = ui.painter();
    painter.rect_filled(rect, CornerRadius::same(6), palette.veil);
    let font = FontId::proportional(theme::HEADING_SIZE);
    painter.text(rect.min + vec2(8.0, 5.0), Align2::LEFT_TOP, &ramp.title, font.clone(), palette.text);
    let bar = Rect::from_min_size(rect.min + vec2(8.0, 22.0), vec2(rect.width() - 16.0, 8.0));
    let steps = 48;
    for step in 0..steps {
        let [r, g, b] = (ramp.color)((step as f32 + 0.5) / steps as f32);
        let left = bar.left() + bar.width() * step as f32 / steps as f32;
        let right = bar.left() + bar.width() * (step + 1) as f32 / steps as f32;
        let cell = Rect::from_min_max(pos2(left, bar.top()), pos2(right, bar.bottom()));
        painter.rect_filled(cell, CornerRadius::ZERO, Color32::from_rgb(r, g, b));
    }
    let mut free_from = rect.left();
    for (place, text) in &ramp.stops {
        let galley = painter.layout_no_wrap(text.clone(), font.clone(), palette.dim);
        let width = galley.size().x;
        let middle = bar.left() + bar.width() * place;
        let left = (middle - width * 0.5).clamp(bar.left(), (bar.right() - width).max(bar.left()));
        // Numbers that would run into each other are left out.
        if left >= free_from {
            painter.galley(pos2(left, bar.bottom() + 3.0), galley, palette.dim);
            free_from = left + width + 6.0;
        }
    }
}
