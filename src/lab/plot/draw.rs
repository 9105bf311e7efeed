//! Draws a chart, its legend and the names of its rows.

use std::ops::Range;
use std::sync::Once;

use plotters::coord::Shift;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, ValueFormatter};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::axis::Axis;
use super::chart::{Chart, Curve, Look, tick_text};
use crate::text::{cut, printable};

/// The palette of Okabe and Ito as RGB, with grey in place of its yellow, which is pale on white: distinguishable with any colour
/// vision.
pub const COLORS: [[u8; 3]; 8] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [86, 180, 233],
    [230, 159, 0],
    [0, 0, 0],
    [120, 120, 120],
];
/// Lengths in pixels of the dashes of lines and of the gaps between them, by the index of the colour; without a gap solid. With the
/// three markers, eight curves differ in print without colours.
const DASHES: [[u32; 2]; 8] = [[1, 0], [1, 0], [1, 0], [12, 5], [12, 5], [12, 5], [3, 4], [3, 4]];
/// Name under which the font is registered.
const FONT: &str = "plot";
/// Size of the font of labels in pixels.
pub(super) const LABEL_SIZE: u32 = 19;
/// Size of the font of titles and of what axes show in pixels.
const TITLE_SIZE: u32 = 21;
/// Height of a chart with rows without its rows in pixels.
pub(super) const ROWS_FRAME: u32 = MARGIN + ACROSS_HEIGHT + TOP;
/// Room for the labels of the axis across in pixels.
const ACROSS_HEIGHT: u32 = 60;
/// Margins at the left and below in pixels.
const MARGIN: u32 = 12;
/// Margins at the right and above in pixels.
const TOP: u32 = 16;
const RIGHT: u32 = 28;
/// Most characters of the name of a row.
const MAX_NAME: usize = 44;
/// Number of points from which dots are small.
const MANY: usize = 400;

type Failed<B> = DrawingAreaErrorKind<<B as DrawingBackend>::ErrorType>;

/// The name of the font of plots, which this registers.
pub fn font() -> &'static str {
    static REGISTERED: Once = Once::new();
    // The embedded font is valid.
    REGISTERED.call_once(|| {
        let _ = plotters::style::register_font(FONT, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT);
    });
    FONT
}

/// The text of an SVG for any viewer: with fallbacks for those without the font, and with control characters of names escaped, which XML
/// cannot hold.
pub fn for_viewers(svg: &str) -> String {
    let font = [format!("font-family=\"{FONT}\""), "font-family=\"Ubuntu, Helvetica, Arial, sans-serif\"".to_owned()];
    svg.split('\n').map(|line| printable(line).replace(&font[0], &font[1])).collect::<Vec<_>>().join("\n")
}

/// Width of a text in pixels.
pub fn text_width(text: &str, size: u32) -> i32 {
    // Where the font cannot be measured, a generous width.
    let estimate = || text.chars().count() as i32 * size as i32 * 6 / 10;
    (font(), size).into_font().box_size(text).map_or_else(|_| estimate(), |(width, _)| width as i32)
}

fn color_of(curve: &Curve) -> RGBColor {
    let [r, g, b] = COLORS[curve.color % COLORS.len()];
    RGBColor(r, g, b)
}

fn dash_of(curve: &Curve) -> [u32; 2] {
    DASHES[curve.color % DASHES.len()]
}

/// Draws an entry of a legend whose middle is at `y`.
pub(super) fn legend_entry<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    [x, y]: [i32; 2],
    curve: &Curve,
    joined: bool,
) -> Result<(), Failed<B>> {
    let (color, line) = (color_of(curve), [(x, y), (x + 26, y)]);
    match curve.look {
        Look::Reference => area.draw(&PathElement::new(line, BLACK.mix(0.45).stroke_width(1)))?,
        Look::Line => area.draw(&PathElement::new(line, color.stroke_width(1)))?,
        Look::Dots => area.draw(&Circle::new((x + 13, y), 4, color.filled()))?,
        Look::Rings => area.draw(&Circle::new((x + 13, y), 7, color.stroke_width(2)))?,
        Look::Measured => {
            if joined {
                let [dash, gap] = dash_of(curve);
                for start in (x..x + 26).step_by((dash + gap).max(1) as usize).take(if gap == 0 { 1 } else { 26 }) {
                    let end = if gap == 0 { x + 26 } else { (start + dash as i32).min(x + 26) };
                    area.draw(&PathElement::new([(start, y), (end, y)], color.stroke_width(2)))?;
                }
            }
            area.draw(&marker((x + 13, y), curve.color, color))?;
        }
    }
    let style = (font(), LABEL_SIZE).into_font().color(&BLACK).pos(Pos::new(HPos::Left, VPos::Center));
    area.draw(&Text::new(curve.name.clone(), (x + 34, y), style))
}

/// Width in pixels that the names of the rows take.
pub(super) fn names_width(chart: &Chart) -> u32 {
    let widths = chart.rows.iter().map(|name| text_width(&cut(name, MAX_NAME), LABEL_SIZE));
    widths.max().unwrap_or(0) as u32 + MARGIN + 8
}

/// Draws the names of the rows, each beside its row.
pub(super) fn row_names<B: DrawingBackend>(area: &DrawingArea<B, Shift>, chart: &Chart) -> Result<(), Failed<B>> {
    let (width, height) = area.dim_in_pixel();
    let plot_height = f64::from(height - ROWS_FRAME);
    let style = (font(), LABEL_SIZE).into_font().color(&BLACK).pos(Pos::new(HPos::Right, VPos::Center));
    for (index, name) in chart.rows.iter().enumerate() {
        let y = f64::from(TOP) + plot_height * (1.0 - chart.axes[1].at(index as f64));
        area.draw(&Text::new(cut(name, MAX_NAME).into_owned(), (width as i32, y as i32), style.clone()))?;
    }
    Ok(())
}

/// An axis with the values that are labelled.
struct Labelled {
    axis: Axis,
    labels: Vec<f64>,
}

impl Ranged for Labelled {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        limit.0 + (self.axis.at(*value).clamp(0.0, 1.0) * f64::from(limit.1 - limit.0)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.labels.clone()
    }

    fn range(&self) -> Range<f64> {
        self.axis.low..self.axis.high
    }
}

impl ValueFormatter<f64> for Labelled {
    fn format_ext(&self, value: &f64) -> String {
        tick_text(&self.axis, *value)
    }
}

/// Draws a chart; names of rows are drawn by [`row_names`].
pub(super) fn chart<B: DrawingBackend>(area: &DrawingArea<B, Shift>, chart: &Chart) -> Result<(), Failed<B>> {
    let [across, up] = chart.axes;
    let has_rows = !chart.rows.is_empty();
    let (width, height) = area.dim_in_pixel();
    let width_of = |axis: Axis| move |value: f64| f64::from(text_width(&tick_text(&axis, value), LABEL_SIZE));
    let title_height = if chart.title.is_empty() { 0 } else { TITLE_SIZE + 8 };
    let up_length = f64::from(height.saturating_sub(MARGIN + ACROSS_HEIGHT + TOP + title_height));
    let up_labels = if has_rows { up.ticks(chart.rows.len()) } else { up.labels(up_length, 24.0, 7, |_| 12.0) };
    let widest = up_labels.iter().map(|&value| width_of(up)(value)).fold(0.0, f64::max) as u32;
    let up_width = if has_rows { 8 } else { widest + 44 };
    let across_length = f64::from(width.saturating_sub(MARGIN + RIGHT + up_width));
    let labels = across.labels(across_length, 14.0, 9, width_of(across));
    let mut builder = ChartBuilder::on(area);
    builder.margin(MARGIN).margin_right(RIGHT).margin_top(TOP);
    builder.y_label_area_size(up_width).x_label_area_size(ACROSS_HEIGHT);
    if !chart.title.is_empty() {
        builder.caption(&chart.title, (font(), TITLE_SIZE).into_font().color(&BLACK));
    }
    let mut context =
        builder.build_cartesian_2d(Labelled { axis: across, labels }, Labelled { axis: up, labels: up_labels })?;
    let text_across = |value: &f64| tick_text(&across, *value);
    let text_up = |value: &f64| if has_rows { String::new() } else { tick_text(&up, *value) };
    context
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.12))
        .axis_style(BLACK.stroke_width(1))
        .label_style((font(), LABEL_SIZE).into_font().color(&BLACK))
        .axis_desc_style((font(), TITLE_SIZE).into_font().color(&BLACK))
        .x_label_formatter(&text_across)
        .y_label_formatter(&text_up)
        .x_desc(&chart.labels[0])
        .y_desc(&chart.labels[1])
        .draw()?;
    for curve in &chart.curves {
        draw_curve(&mut context, chart, curve)?;
    }
    Ok(())
}

type Plane<'a, B> = ChartContext<'a, B, Cartesian2d<Labelled, Labelled>>;

fn draw_curve<B: DrawingBackend>(plane: &mut Plane<'_, B>, chart: &Chart, curve: &Curve) -> Result<(), Failed<B>> {
    let color = color_of(curve);
    let places = || curve.points.iter().map(|point| (point.x, point.y));
    let whiskers = curve.points.iter().filter_map(|point| chart.whisker(point));
    let faint = color.mix(0.55).stroke_width(1);
    plane.draw_series(whiskers.map(|ends| PathElement::new(ends.map(|[x, y]| (x, y)), faint)))?;
    match curve.look {
        Look::Reference => {
            plane.draw_series(LineSeries::new(places(), BLACK.mix(0.45).stroke_width(1)))?;
        }
        Look::Line => draw_line(plane, curve, color.stroke_width(1))?,
        Look::Dots => {
            let radius = if curve.points.len() > MANY { 2 } else { 4 };
            plane.draw_series(places().map(|at| Circle::new(at, radius, color.mix(0.6).filled())))?;
        }
        Look::Rings => {
            plane.draw_series(places().map(|at| Circle::new(at, 7, color.stroke_width(2))))?;
        }
        Look::Measured => {
            if chart.is_joined() {
                draw_line(plane, curve, color.stroke_width(2))?;
            }
            let markers = places().map(|at| EmptyElement::at(at) + marker((0, 0), curve.color, color));
            plane.draw_series(markers)?;
        }
    }
    Ok(())
}

/// Joins the points of a curve, by dashes where its colour has some.
fn draw_line<B: DrawingBackend>(plane: &mut Plane<'_, B>, curve: &Curve, style: ShapeStyle) -> Result<(), Failed<B>> {
    let places = curve.points.iter().map(|point| (point.x, point.y));
    let [dash, gap] = dash_of(curve);
    if gap == 0 {
        plane.draw_series(LineSeries::new(places, style))?;
    } else {
        plane.draw_series(DashedLineSeries::new(places, dash, gap, style))?;
    }
    Ok(())
}

/// A marker: disc, square or diamond.
fn marker<B: DrawingBackend>(at: (i32, i32), shape: usize, color: RGBColor) -> DynElement<'static, B, (i32, i32)> {
    let (x, y) = at;
    match shape % 3 {
        0 => Circle::new(at, 5, color.filled()).into_dyn(),
        1 => Rectangle::new([(x - 4, y - 4), (x + 5, y + 5)], color.filled()).into_dyn(),
        _ => Polygon::new([(x - 6, y), (x, y - 6), (x + 6, y), (x, y + 6)], color.filled()).into_dyn(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_svg_has_no_character_that_xml_lacks() {
        let svg = "<text font-family=\"sans-serif\">a\u{0}\u{7}\u{1b}[2J\u{202e}é</text>\n<g/>\n";
        let found = for_viewers(svg);
        assert!(found.ends_with(">a\\u{0}\\u{7}\\u{1b}[2J\\u{202e}é</text>\n<g/>\n"), "{found}");
    }
}
