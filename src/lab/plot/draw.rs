//! Draws panels into image files, fit for a paper: white background, axes with units, a legend, curves that differ in marker as
//! well as in colour.

use plotters::coord::Shift;
use plotters::prelude::*;

use super::format::PlotFormat;
use super::panel::{Panel, PlotCurve, Point};

/// Width of the picture in pixels.
const WIDTH: u32 = 1200;
/// Height of a panel in pixels.
const HEIGHT: u32 = 400;
/// The palette of Okabe and Ito as RGB: distinguishable with any colour vision and in greyscale.
pub const COLORS: [[u8; 3]; 7] =
    [[0, 114, 178], [213, 94, 0], [0, 158, 115], [204, 121, 167], [86, 180, 233], [230, 159, 0], [0, 0, 0]];
const FONT: &str = "plot";
/// Height of a line of the legend in pixels.
const LEGEND_LINE: i32 = 28;
/// Where the axes begin, from the left, in pixels.
const AXIS_X: i32 = 106;

/// Panels side by side, optionally under a legend.
struct Band<'a> {
    panels: Vec<&'a Panel>,
    legend: bool,
}

/// Lays panels out in bands: relative panels in pairs, then the others one per band. The first band of each kind has the legend.
fn bands(panels: &[Panel]) -> Vec<Band<'_>> {
    let (relative, absolute): (Vec<&Panel>, Vec<&Panel>) = panels.iter().partition(|panel| panel.relative_of.is_some());
    let pairs = relative.chunks(2).enumerate().map(|(index, pair)| Band { panels: pair.to_vec(), legend: index == 0 });
    let rows = absolute.iter().enumerate().map(|(index, panel)| Band { panels: vec![*panel], legend: index == 0 });
    pairs.chain(rows).collect()
}

impl Band<'_> {
    fn legend_height(&self) -> u32 {
        let last = if self.legend { legend_layout(self.panels[0]).pop() } else { None };
        last.map_or(0, |(_, y, _)| (y + LEGEND_LINE) as u32)
    }
}

/// Draws the panels below each other into the bytes of a file.
pub fn draw(panels: &[Panel], format: PlotFormat) -> Result<Vec<u8>, String> {
    // Registering again is harmless, and the embedded font is valid.
    let _ = plotters::style::register_font(FONT, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT);
    let bands = bands(panels);
    let (width, height) = (WIDTH, bands.iter().map(|band| HEIGHT + band.legend_height()).sum::<u32>().max(1));
    match format {
        PlotFormat::Svg => {
            let mut text = String::new();
            draw_on(SVGBackend::with_string(&mut text, (width, height)).into_drawing_area(), &bands)?;
            // Fallbacks for viewers without the font.
            Ok(text
                .replace(&format!("font-family=\"{FONT}\""), "font-family=\"Ubuntu, Helvetica, Arial, sans-serif\"")
                .into_bytes())
        }
        PlotFormat::Png => {
            let mut pixels = vec![255_u8; (width * height * 3) as usize];
            draw_on(BitMapBackend::with_buffer(&mut pixels, (width, height)).into_drawing_area(), &bands)?;
            let picture = image::RgbImage::from_raw(width, height, pixels).ok_or("the plot has no pixels")?;
            let mut bytes = std::io::Cursor::new(Vec::new());
            picture.write_to(&mut bytes, image::ImageFormat::Png).map_err(|error| error.to_string())?;
            Ok(bytes.into_inner())
        }
    }
}

fn draw_on<B: DrawingBackend>(area: DrawingArea<B, Shift>, bands: &[Band<'_>]) -> Result<(), String> {
    area.fill(&WHITE).map_err(|error| error.to_string())?;
    let mut below = area.clone();
    for band in bands {
        let (legend, rest) = below.split_vertically(band.legend_height());
        let (part, rest) = rest.split_vertically(HEIGHT);
        if band.legend {
            draw_legend(&legend, band.panels[0]).map_err(|error| error.to_string())?;
        }
        // A single panel of a pair takes half the width, so that all have the same scale.
        let columns = if band.panels[0].relative_of.is_some() && bands[0].panels.len() > 1 { 2 } else { 1 };
        for (part, panel) in part.split_evenly((1, columns)).iter().zip(&band.panels) {
            draw_panel(part, panel).map_err(|error| error.to_string())?;
        }
        below = rest;
    }
    area.present().map_err(|error| error.to_string())
}

/// Position of each legend entry, from left to right and then down: x, y and curve.
fn legend_layout(panel: &Panel) -> Vec<(i32, i32, &PlotCurve)> {
    let (mut x, mut y) = (AXIS_X, 26);
    let mut places = Vec::new();
    for curve in &panel.curves {
        let width = 60 + curve.name.chars().count() as i32 * 11;
        if x > AXIS_X && x + width > WIDTH as i32 {
            (x, y) = (AXIS_X, y + LEGEND_LINE);
        }
        places.push((x, y, curve));
        x += width;
    }
    places
}

/// Colour and marker of a curve. Relative panels show different things than the others, so theirs differ.
fn style_of(panel: &Panel, curve: usize) -> (RGBColor, usize) {
    let index = curve + if panel.relative_of.is_some() { 3 } else { 0 };
    let [r, g, b] = COLORS[index % COLORS.len()];
    (RGBColor(r, g, b), index % 3)
}

fn draw_legend<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    panel: &Panel,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    use plotters::style::text_anchor::{HPos, Pos, VPos};
    let style = (FONT, 20).into_font().color(&BLACK).pos(Pos::new(HPos::Left, VPos::Center));
    let joined = panel.categories.is_empty();
    for (index, (x, y, curve)) in legend_layout(panel).into_iter().enumerate() {
        if curve.reference {
            area.draw(&PathElement::new([(x, y), (x + 26, y)], BLACK.mix(0.45).stroke_width(1)))?;
        } else {
            let (color, shape) = style_of(panel, index);
            if joined {
                area.draw(&PathElement::new([(x, y), (x + 26, y)], color.stroke_width(2)))?;
            }
            area.draw(&marker((x + 13, y), shape, color))?;
        }
        area.draw(&Text::new(curve.name.clone(), (x + 34, y), &style))?;
    }
    Ok(())
}

/// Upper end of the vertical axis: above the highest point, and above the whiskers unless they would squash the curves.
fn y_max(panel: &Panel) -> f64 {
    let points = || panel.curves.iter().flat_map(|curve| &curve.points);
    let top = points().map(|point| point.y).fold(0.0, f64::max);
    let slowest = points().filter_map(|point| point.spread).map(|[_, high]| high).fold(top, f64::max);
    if top > 0.0 { slowest.min(top * 1.5) * 1.08 } else { 1.0 }
}

fn draw_panel<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    panel: &Panel,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let points = || panel.curves.iter().flat_map(|curve| &curve.points);
    let low = points().map(|point| point.x).fold(f64::INFINITY, f64::min);
    let high = points().map(|point| point.x).fold(f64::NEG_INFINITY, f64::max);
    let (low, high) = if low <= high { (low, high) } else { (0.0, 1.0) };
    let top = y_max(panel);
    let named = !panel.categories.is_empty();
    let margin = if named { 0.5 } else { ((high - low) * 0.02).max(0.1) };
    let mut builder = ChartBuilder::on(area);
    builder.margin(14).margin_right(30).y_label_area_size(92);
    builder.x_label_area_size(if panel.x_label.is_empty() { 34 } else { 58 });
    let caption = panel.relative_of.as_deref().unwrap_or_default();
    if !caption.is_empty() {
        builder.caption(caption, (FONT, 21).into_font().color(&BLACK));
    }
    // Axes start at zero, so that heights can be compared.
    let mut chart = builder.build_cartesian_2d(low - margin..high + margin, 0.0..top)?;
    let x_name = |x: &f64| {
        let nearest = x.round();
        if (x - nearest).abs() > 1e-6 {
            return String::new();
        }
        if named { panel.categories.get(nearest as usize).cloned().unwrap_or_default() } else { format!("{nearest}") }
    };
    // A label takes some 60 pixels.
    let max_labels = (area.dim_in_pixel().0 / 64) as usize;
    let x_labels = if named {
        panel.categories.len() * 2 + 1
    } else {
        ((high - low).round() as usize + 1).clamp(2, max_labels.max(2))
    };
    let mut mesh = chart.configure_mesh();
    if named {
        mesh.disable_x_mesh();
    }
    mesh.light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.12))
        .axis_style(BLACK.stroke_width(1))
        .label_style((FONT, 20).into_font().color(&BLACK))
        .axis_desc_style((FONT, 23).into_font().color(&BLACK))
        .x_labels(x_labels)
        .y_labels(6)
        .x_label_formatter(&x_name)
        .y_label_formatter(&|y| if top < 5.0 { format!("{y:.1}") } else { format!("{y:.0}") })
        .x_desc(&panel.x_label)
        .y_desc(&panel.y_label)
        .draw()?;
    for (index, curve) in panel.curves.iter().enumerate() {
        let places = || curve.points.iter().map(|point| (point.x, point.y));
        if curve.reference {
            chart.draw_series(LineSeries::new(places(), BLACK.mix(0.45).stroke_width(1)))?;
            continue;
        }
        let (color, shape) = style_of(panel, index);
        let whisker = |point: &Point| {
            let [fastest, slowest] = point.spread?.map(|value| value.min(top));
            (slowest > fastest)
                .then(|| PathElement::new([(point.x, fastest), (point.x, slowest)], color.mix(0.55).stroke_width(1)))
        };
        chart.draw_series(curve.points.iter().filter_map(whisker))?;
        // Categories are not joined by a line.
        if !named {
            chart.draw_series(LineSeries::new(places(), color.stroke_width(2)))?;
        }
        chart.draw_series(places().map(|place| EmptyElement::at(place) + marker((0, 0), shape, color)))?;
    }
    Ok(())
}

/// A marker: disc, square or diamond.
fn marker<B: DrawingBackend>(at: (i32, i32), shape: usize, color: RGBColor) -> DynElement<'static, B, (i32, i32)> {
    let (x, y) = at;
    match shape {
        0 => Circle::new(at, 5, color.filled()).into_dyn(),
        1 => Rectangle::new([(x - 4, y - 4), (x + 5, y + 5)], color.filled()).into_dyn(),
        _ => Polygon::new([(x - 6, y), (x, y - 6), (x + 6, y), (x, y + 6)], color.filled()).into_dyn(),
    }
}
