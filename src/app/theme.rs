//! Colours, sizes and spacing of the window: neutral greys, an accent colour for active elements, a warm one for the
//! selection, red for errors only. All distances are multiples of 4 points.

use egui::{
    self, Color32, CornerRadius, FontFamily, FontId, Margin, Mesh, Painter, Rect, Stroke, TextStyle, ThemePreference,
    Visuals, vec2,
};

use crate::app::state::{Preferences, Theme};
use crate::overlay;

/// Font size of labels and values in points.
pub const VALUE_SIZE: f32 = 13.0;
/// Font size of headings in points.
pub const HEADING_SIZE: f32 = 11.5;
/// Height of a row in a panel in points.
pub const ROW_HEIGHT: f32 = 20.0;

/// Colours in addition to egui's [`Visuals`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Palette {
    /// Active elements: filled bars, sliders, links.
    pub accent: Color32,
    /// The selection in the picture.
    pub warm: Color32,
    /// Errors.
    pub error: Color32,
    /// Warnings: something was skipped or limited.
    pub warning: Color32,
    /// A number that is better than before; told from `worse` without red and green.
    pub better: Color32,
    /// A number that is worse than before.
    pub worse: Color32,
    /// Ordinary text.
    pub text: Color32,
    /// Secondary text: labels and units.
    pub dim: Color32,
    /// Separators between sections.
    pub line: Color32,
    /// Empty part of bars and slider rails.
    pub rail: Color32,
    /// Background of text over the picture.
    pub veil: Color32,
}

const DARK: Palette = Palette {
    accent: Color32::from_rgb(0x5a, 0xa2, 0xee),
    warm: Color32::from_rgb(0xff, 0xb3, 0x47),
    error: Color32::from_rgb(0xf2, 0x6d, 0x60),
    warning: Color32::from_rgb(0xd9, 0xb8, 0x6a),
    better: Color32::from_rgb(0x6f, 0xb7, 0xff),
    worse: Color32::from_rgb(0xf2, 0x9b, 0x4e),
    text: Color32::from_rgb(0xd8, 0xd8, 0xd8),
    dim: Color32::from_rgb(0x93, 0x93, 0x93),
    line: Color32::from_rgb(0x33, 0x33, 0x33),
    rail: Color32::from_rgb(0x3c, 0x3c, 0x3c),
    veil: Color32::from_rgba_premultiplied(0x16, 0x16, 0x16, 0xd8),
};

const LIGHT: Palette = Palette {
    accent: Color32::from_rgb(0x1d, 0x6a, 0xb8),
    warm: Color32::from_rgb(0xd0, 0x6a, 0x00),
    error: Color32::from_rgb(0xc0, 0x2b, 0x22),
    warning: Color32::from_rgb(0x8a, 0x62, 0x00),
    better: Color32::from_rgb(0x0b, 0x5c, 0xad),
    worse: Color32::from_rgb(0xa6, 0x4a, 0x00),
    text: Color32::from_rgb(0x26, 0x26, 0x26),
    dim: Color32::from_rgb(0x66, 0x66, 0x66),
    line: Color32::from_rgb(0xd4, 0xd4, 0xd4),
    rail: Color32::from_rgb(0xc8, 0xc8, 0xc8),
    veil: Color32::from_rgba_premultiplied(0xea, 0xea, 0xea, 0xec),
};

/// Colours of the current theme.
pub fn palette(ui: &egui::Ui) -> Palette {
    if ui.visuals().dark_mode { DARK } else { LIGHT }
}

/// Applies the theme of `preferences`. Cheap to call every frame: the styles are set once per context.
pub fn apply(ctx: &egui::Context, preferences: &Preferences) {
    let preference = match preferences.theme {
        Theme::Dark => ThemePreference::Dark,
        Theme::Light => ThemePreference::Light,
        Theme::System => ThemePreference::System,
    };
    if ctx.options(|options| options.theme_preference) != preference {
        ctx.set_theme(preference);
    }
    let marker = egui::Id::unique("bvhscope theme");
    if ctx.data(|data| data.get_temp::<bool>(marker)).is_none() {
        ctx.data_mut(|data| data.insert_temp(marker, true));
        ctx.set_visuals_of(egui::Theme::Dark, visuals(true));
        ctx.set_visuals_of(egui::Theme::Light, visuals(false));
        ctx.all_styles_mut(style);
    }
}

/// Sizes and spacing, the same in both themes.
fn style(style: &mut egui::Style) {
    let proportional = |size| FontId::new(size, FontFamily::Proportional);
    style.text_styles = [
        (TextStyle::Small, proportional(HEADING_SIZE)),
        (TextStyle::Body, proportional(VALUE_SIZE)),
        (TextStyle::Button, proportional(VALUE_SIZE)),
        (TextStyle::Heading, proportional(HEADING_SIZE)),
        (TextStyle::Monospace, FontId::new(12.0, FontFamily::Monospace)),
    ]
    .into();
    let spacing = &mut style.spacing;
    spacing.item_spacing = vec2(8.0, 4.0);
    spacing.button_padding = vec2(8.0, 2.0);
    spacing.interact_size = vec2(32.0, ROW_HEIGHT);
    spacing.window_margin = Margin::same(12);
    spacing.menu_margin = Margin::same(4);
    spacing.icon_width = 16.0;
    spacing.icon_width_inner = 8.0;
    spacing.icon_spacing = 4.0;
    spacing.slider_rail_height = 4.0;
    spacing.tooltip_width = 320.0;
    spacing.combo_height = 320.0;
    spacing.scroll = egui::style::ScrollStyle::thin();
    style.interaction.tooltip_delay = 0.4;
    style.interaction.selectable_labels = false;
}

/// Visuals of one theme.
fn visuals(dark: bool) -> Visuals {
    let palette = if dark { DARK } else { LIGHT };
    let grey = |dark_level, light_level| Color32::from_gray(if dark { dark_level } else { light_level });
    let mut visuals = if dark { Visuals::dark() } else { Visuals::light() };
    let radius = CornerRadius::same(4);
    visuals.panel_fill = grey(0x20, 0xf4);
    visuals.window_fill = grey(0x26, 0xfa);
    visuals.window_stroke = Stroke::new(1.0, grey(0x3c, 0xcc));
    visuals.window_corner_radius = CornerRadius::same(8);
    visuals.menu_corner_radius = CornerRadius::same(4);
    visuals.extreme_bg_color = grey(0x16, 0xff);
    visuals.faint_bg_color = grey(0x26, 0xec);
    visuals.weak_text_color = Some(palette.dim);
    visuals.warn_fg_color = palette.warning;
    visuals.error_fg_color = palette.error;
    visuals.hyperlink_color = palette.accent;
    visuals.slider_trailing_fill = true;
    visuals.selection.bg_fill =
        if dark { Color32::from_rgb(0x2c, 0x5a, 0x8c) } else { Color32::from_rgb(0xb9, 0xd6, 0xf2) };
    visuals.selection.stroke =
        Stroke::new(1.0, if dark { Color32::WHITE } else { Color32::from_rgb(0x0b, 0x3a, 0x66) });
    let widgets = &mut visuals.widgets;
    for (widget, fill, text) in [
        (&mut widgets.noninteractive, grey(0x20, 0xf4), palette.text),
        (&mut widgets.inactive, grey(0x33, 0xe0), palette.text),
        (&mut widgets.hovered, grey(0x40, 0xd4), grey(0xf4, 0x10)),
        (&mut widgets.active, grey(0x4c, 0xc8), grey(0xff, 0x00)),
        (&mut widgets.open, grey(0x3a, 0xda), grey(0xf4, 0x10)),
    ] {
        widget.bg_fill = fill;
        widget.weak_bg_fill = fill;
        widget.bg_stroke = Stroke::NONE;
        widget.fg_stroke = Stroke::new(1.0, text);
        widget.corner_radius = radius;
        widget.expansion = 0.0;
    }
    // Rails and handles of sliders need contrast with the panel.
    widgets.inactive.bg_fill = grey(0x4a, 0xc4);
    widgets.noninteractive.bg_stroke = Stroke::new(1.0, palette.line);
    widgets.hovered.bg_stroke = Stroke::new(1.0, grey(0x58, 0xb8));
    widgets.active.bg_stroke = Stroke::new(1.0, palette.accent);
    visuals
}

/// The colour at a position, 0 to 1, of the scale that stands for the numbers of nodes.
pub fn scale_color(position: f32) -> Color32 {
    let [r, g, b] = overlay::ramp(position);
    Color32::from_rgb(r, g, b)
}

/// Paints a gradient from left to right in `bar`, in as many `steps` of one colour, that at its middle, 0 to 1.
pub fn paint_gradient(painter: &Painter, bar: Rect, steps: u16, color: impl Fn(f32) -> Color32) {
    let mut mesh = Mesh::default();
    for step in 0..steps {
        let at = |step: f32| bar.left() + bar.width() * step / f32::from(steps);
        let step = f32::from(step);
        let cell = Rect::from_x_y_ranges(at(step)..=at(step + 1.0), bar.y_range());
        mesh.add_colored_rect(cell, color((step + 0.5) / f32::from(steps)));
    }
    painter.add(mesh);
}
