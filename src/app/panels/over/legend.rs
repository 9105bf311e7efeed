//! What colours mean, with numbers, over the lower left corner of the viewport.

use eframe::egui::{
    Align2, Color32, CornerRadius, FontId, Painter, Rect, Role as AccessRole, Sense, Ui, WidgetInfo, pos2, vec2,
};

use crate::app::state::AppState;
use crate::app::{format, theme};
use crate::overlay::{self, Role};
use crate::render::{Frame, Shading};

/// Width of a legend in points.
const WIDTH: f32 = 208.0;
/// Height of its title in points.
const TITLE_HEIGHT: f32 = 20.0;
/// Height of a gradient with its numbers.
const RAMP_HEIGHT: f32 = 28.0;
/// Height of a line of swatches or of words.
const LINE_HEIGHT: f32 = 18.0;

/// What is coloured, and what the colours stand for.
struct Legend {
    title: String,
    parts: Vec<Part>,
}

enum Part {
    /// A gradient.
    Ramp {
        /// Places between 0 and 1 with what they stand for.
        stops: Vec<(f32, String)>,
        color: Box<dyn Fn(f32) -> [u8; 3]>,
    },
    /// Single colours with their names.
    Swatches(Vec<(Vec<[u8; 3]>, String)>),
    /// Where every colour is as good as another.
    Words(&'static str),
}

impl Part {
    const fn height(&self) -> f32 {
        match self {
            Self::Ramp { .. } => RAMP_HEIGHT,
            Self::Swatches(_) | Self::Words(_) => LINE_HEIGHT,
        }
    }

    /// What accessibility says.
    fn text(&self) -> String {
        match self {
            Self::Ramp { stops, .. } => stops.iter().map(|(_, text)| text.as_str()).collect::<Vec<_>>().join(", "),
            Self::Swatches(swatches) => swatches.iter().map(|(_, name)| name.as_str()).collect::<Vec<_>>().join(", "),
            Self::Words(words) => (*words).to_owned(),
        }
    }
}

pub(crate) fn show(ui: &mut Ui, rect: Rect, state: &AppState) {
    let mut bottom = rect.bottom() - 12.0;
    for legend in [picture_legend(state), overlay_legend(state)].into_iter().flatten() {
        let height = TITLE_HEIGHT + legend.parts.iter().map(Part::height).sum::<f32>() + 4.0;
        let size = vec2(WIDTH.min(rect.width() - 24.0), height);
        let place = Rect::from_min_size(pos2(rect.left() + 12.0, bottom - size.y), size);
        if place.top() > rect.top() + 12.0 && size.x > 80.0 {
            paint(ui, place, &legend);
        }
        bottom -= size.y + 8.0;
    }
}

/// The colours of the containers.
fn overlay_legend(state: &AppState) -> Option<Legend> {
    let shown = state.model.presented.as_ref()?;
    let settings = &state.wanted.overlay;
    if !state.preferences.show_containers || !(settings.show_boxes || settings.show_spheres) || state.graphics.failed {
        return None;
    }
    let legend = overlay::legend(settings, &shown.table);
    // The hovered container comes and goes with the pointer: its line stays.
    let selected = state.selection.nodes.selected.filter(|&node| (node as usize) < shown.table.len());
    let mut marked: &[(&[Role], &str)] = &[(&[Role::Hovered], "under the pointer")];
    if selected.is_some() {
        marked = &[
            (&[Role::Selected], "selected"),
            (&[Role::FirstChild, Role::SecondChild], "children"),
            (&[Role::Hovered], "hovered"),
        ];
    }
    let swatches =
        marked.iter().map(|(roles, name)| (roles.iter().filter_map(|role| role.color()).collect(), (*name).to_owned()));
    let colors = match &legend.stops[..] {
        // A single depth has a single colour.
        [(place, depth)] => Part::Swatches(vec![(vec![legend.color(*place)], format!("depth {depth}"))]),
        _ => Part::Ramp { stops: legend.stops, color: Box::new(overlay::ramp) },
    };
    Some(Legend {
        title: format!("Containers: {}", lower(legend.title)),
        parts: vec![colors, Part::Swatches(swatches.collect())],
    })
}

fn lower(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map_or_else(String::new, |first| first.to_lowercase().chain(chars).collect())
}

/// The colours of the picture, in modes where they stand for something.
fn picture_legend(state: &AppState) -> Option<Legend> {
    let shown = state.model.presented.as_ref()?;
    if !state.preferences.show_geometry {
        return None;
    }
    let frame = &shown.frame;
    let lines = frame.settings.mesh_edges.then_some(Part::Words("lines: edges of triangles, from 2 px on"));
    let (title, part) = match frame.settings.shading {
        Shading::Lit => return lines.map(|lines| Legend { title: "Picture: mesh".to_owned(), parts: vec![lines] }),
        Shading::Normals => {
            let axes = [("+x", [255, 128, 128]), ("+y", [128, 255, 128]), ("+z", [128, 128, 255])];
            let swatches = axes.map(|(name, color)| (vec![color], name.to_owned()));
            ("Picture: the surface looks to".to_owned(), Part::Swatches(swatches.to_vec()))
        }
        Shading::AmbientOcclusion => {
            let grey = |place: f32| [(255.0 * (0.05 + 0.9 * place)) as u8; 3];
            let stops = vec![(0.0, "closed in".to_owned()), (1.0, "open".to_owned())];
            ("Picture: surroundings".to_owned(), Part::Ramp { stops, color: Box::new(grey) })
        }
        Shading::Clusters => {
            let depth = frame.settings.cluster_depth;
            (format!("Picture: containers at depth {depth}"), Part::Words("each in a colour of its own"))
        }
        Shading::Heat(kind) => (format!("Picture: {} a pixel", kind.counted()), values_ramp(frame)),
        Shading::Depth => ("Picture: depth".to_owned(), values_ramp(frame)),
    };
    Some(Legend { title, parts: std::iter::once(part).chain(lines).collect() })
}

/// The colour map over the range of the picture's values.
fn values_ramp(frame: &Frame) -> Part {
    let [low, high] = frame.value_range;
    let stops = [0.0, 0.5, 1.0].map(|place: f32| {
        (place, format::significant(f64::from((low + (high - low) * place).round_to(frame.settings.shading))))
    });
    let map = frame.settings.color_map;
    Part::Ramp { stops: stops.to_vec(), color: Box::new(move |place| map.srgb(place)) }
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

fn paint(ui: &mut Ui, rect: Rect, legend: &Legend) {
    let palette = theme::palette(ui);
    let response = ui.interact(rect, ui.scope_id().with(&legend.title), Sense::hover());
    let parts: Vec<String> = legend.parts.iter().map(Part::text).collect();
    let name = format!("Legend. {}: {}", legend.title, parts.join("; "));
    response.widget_info(|| WidgetInfo::labeled(AccessRole::Image, true, &name));
    let painter = ui.painter();
    painter.rect_filled(rect, CornerRadius::same(6), palette.veil);
    let font = FontId::proportional(theme::HEADING_SIZE);
    painter.text(rect.min + vec2(8.0, 5.0), Align2::LEFT_TOP, &legend.title, font.clone(), palette.text);
    let mut top = rect.top() + TITLE_HEIGHT;
    for part in &legend.parts {
        let place = Rect::from_min_size(pos2(rect.left() + 8.0, top), vec2(rect.width() - 16.0, part.height()));
        match part {
            Part::Ramp { stops, color } => paint_ramp(painter, place, stops, color, palette.dim),
            Part::Swatches(swatches) => paint_swatches(painter, place, swatches, palette.dim),
            Part::Words(words) => {
                painter.text(place.left_center(), Align2::LEFT_CENTER, *words, font.clone(), palette.dim);
            }
        }
        top += part.height();
    }
}

fn paint_swatches(painter: &Painter, place: Rect, swatches: &[(Vec<[u8; 3]>, String)], dim: Color32) {
    let font = FontId::proportional(theme::HEADING_SIZE);
    let mut left = place.left();
    for (colors, name) in swatches {
        for [r, g, b] in colors {
            let swatch = Rect::from_center_size(pos2(left + 4.0, place.center().y), vec2(8.0, 8.0));
            painter.rect_filled(swatch, CornerRadius::same(2), Color32::from_rgb(*r, *g, *b));
            left += 10.0;
        }
        let text = painter.text(pos2(left + 2.0, place.center().y), Align2::LEFT_CENTER, name, font.clone(), dim);
        left = text.right() + 10.0;
    }
}

fn paint_ramp(painter: &Painter, place: Rect, stops: &[(f32, String)], color: &dyn Fn(f32) -> [u8; 3], dim: Color32) {
    let font = FontId::proportional(theme::HEADING_SIZE);
    let bar = Rect::from_min_size(place.min + vec2(0.0, 2.0), vec2(place.width(), 8.0));
    let steps = 48;
    for step in 0..steps {
        let [r, g, b] = color((step as f32 + 0.5) / steps as f32);
        let left = bar.left() + bar.width() * step as f32 / steps as f32;
        let right = bar.left() + bar.width() * (step + 1) as f32 / steps as f32;
        let cell = Rect::from_min_max(pos2(left, bar.top()), pos2(right, bar.bottom()));
        painter.rect_filled(cell, CornerRadius::ZERO, Color32::from_rgb(r, g, b));
    }
    let mut free_from = place.left() - 8.0;
    for (at, text) in stops {
        let galley = painter.layout_no_wrap(text.clone(), font.clone(), dim);
        let width = galley.size().x;
        let middle = bar.left() + bar.width() * at;
        let left = (middle - width * 0.5).clamp(bar.left(), (bar.right() - width).max(bar.left()));
        // Numbers that would run into each other are left out.
        if left >= free_from {
            painter.galley(pos2(left, bar.bottom() + 3.0), galley, dim);
            free_from = left + width + 6.0;
        }
    }
}
