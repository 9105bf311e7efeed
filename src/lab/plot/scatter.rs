//! Scatter plots drawn into a PNG, side by side, in the look of [`draw`](super::draw()).

use std::ops::Range;

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, ValueFormatter};
use plotters::prelude::*;

use super::axis::Axis;
use super::draw::COLORS;
use crate::lab::report_table::number;

/// Width and height of a plot in pixels.
const SIZE: [u32; 2] = [700, 560];
const FONT: &str = "plot";

/// How the points of a series look.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SeriesLook {
    /// Dots.
    Dots,
    /// Rings around dots of other series.
    Rings,
    /// A line from point to point.
    Line,
}

/// Points with a name.
#[derive(Debug, Clone, PartialEq)]
pub struct ScatterSeries {
    /// Name in the legend.
    pub name: String,
    /// How they look.
    pub look: SeriesLook,
    /// The points.
    pub points: Vec<[f64; 2]>,
}

/// A scatter plot.
#[derive(Debug, Clone, PartialEq)]
pub struct Scatter {
    /// Title above it.
    pub title: String,
    /// Labels of the axes, with unit: across and up.
    pub labels: [String; 2],
    /// The axes.
    pub axes: [Axis; 2],
    /// What is drawn, from below.
    pub series: Vec<ScatterSeries>,
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        limit.0 + (self.at(*value).clamp(0.0, 1.0) * f64::from(limit.1 - limit.0)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        self.ticks(hint.max_num_points())
    }

    fn range(&self) -> Range<f64> {
        self.low..self.high
    }
}

impl ValueFormatter<f64> for Axis {
    fn format_ext(&self, value: &f64) -> String {
        if self.is_never(*value) {
            return "never".to_owned();
        }
        let text = number(*value);
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
    }
}

/// Draws plots side by side into the bytes of a PNG.
pub fn draw_scatters(scatters: &[Scatter]) -> Result<Vec<u8>, String> {
    // Registering again is harmless, and the embedded font is valid.
    let _ = plotters::style::register_font(FONT, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT);
    let (width, height) = (SIZE[0] * scatters.len().max(1) as u32, SIZE[1]);
    let mut pixels = vec![255_u8; (width * height * 3) as usize];
    {
        let area = BitMapBackend::with_buffer(&mut pixels, (width, height)).into_drawing_area();
        area.fill(&WHITE).map_err(|error| error.to_string())?;
        for (area, scatter) in area.split_evenly((1, scatters.len().max(1))).iter().zip(scatters) {
            draw_one(area, scatter).map_err(|error| error.to_string())?;
        }
        area.present().map_err(|error| error.to_string())?;
    }
    let picture = image::RgbImage::from_raw(width, height, pixels).ok_or("the plot has no pixels")?;
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png).map_err(|error| error.to_string())?;
    Ok(bytes.into_inner())
}

fn draw_one<B: DrawingBackend>(
    area: &DrawingArea<B, plotters::coord::Shift>,
    scatter: &Scatter,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let mut builder = ChartBuilder::on(area);
    builder.margin(14).margin_right(28).y_label_area_size(84).x_label_area_size(58);
    builder.caption(&scatter.title, (FONT, 21).into_font().color(&BLACK));
    let [x, y] = scatter.axes;
    let mut chart = builder.build_cartesian_2d(x, y)?;
    let [x_label, y_label] = [x, y].map(|axis| move |value: &f64| axis.format_ext(value));
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.12))
        .axis_style(BLACK.stroke_width(1))
        .label_style((FONT, 18).into_font().color(&BLACK))
        .axis_desc_style((FONT, 21).into_font().color(&BLACK))
        .x_labels(8)
        .y_labels(8)
        .x_label_formatter(&x_label)
        .y_label_formatter(&y_label)
        .x_desc(&scatter.labels[0])
        .y_desc(&scatter.labels[1])
        .draw()?;
    for (index, series) in scatter.series.iter().enumerate() {
        let [r, g, b] = COLORS[index % COLORS.len()];
        let color = RGBColor(r, g, b);
        let points = || series.points.iter().map(|&[x, y]| (x, y));
        // Small where they are many.
        let radius = if series.points.len() > 400 { 2 } else { 4 };
        let drawn = match series.look {
            SeriesLook::Dots => {
                chart.draw_series(points().map(|at| Circle::new(at, radius, color.mix(0.6).filled())))?
            }
            SeriesLook::Rings => chart.draw_series(points().map(|at| Circle::new(at, 7, color.stroke_width(2))))?,
            SeriesLook::Line => chart.draw_series(LineSeries::new(points(), color.stroke_width(2)))?,
        };
        drawn.label(&series.name).legend(move |(x, y)| Circle::new((x + 8, y), 4, color.filled()));
    }
    if scatter.series.len() > 1 {
        let font = (FONT, 18).into_font().color(&BLACK);
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .background_style(WHITE.mix(0.8))
            .label_font(font)
            .draw()?;
    }
    Ok(())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    #[test]
    fn dots_are_drawn_where_their_values_are() {
        let axis = Axis { low: 1.0, high: 100.0, is_log: true, has_never: false };
        let series = |look, points| ScatterSeries { name: "trees".to_owned(), look, points };
        let scatter = |points| Scatter {
            title: "Trees".to_owned(),
            labels: ["x".to_owned(), "y".to_owned()],
            axes: [axis; 2],
            series: vec![series(SeriesLook::Dots, points), series(SeriesLook::Line, vec![[1.0, 1.0]])],
        };
        let picture = |points| image::load_from_memory(&draw_scatters(&[scatter(points)]).unwrap()).unwrap().to_rgb8();
        let (empty, one) = (picture(Vec::new()), picture(vec![[10.0, 10.0]]));
        assert_eq!([one.width(), one.height()], SIZE);
        let changed: Vec<(u32, u32)> = one
            .enumerate_pixels()
            .filter(|(x, y, pixel)| empty.get_pixel(*x, *y) != *pixel)
            .map(|(x, y, _)| (x, y))
            .collect();
        assert!((20..200).contains(&changed.len()), "{}", changed.len());
        let [x, y] = [changed.iter().map(|at| at.0).sum::<u32>(), changed.iter().map(|at| at.1).sum::<u32>()]
            .map(|sum| sum / changed.len() as u32);
        // The middle of the logarithm, between the labels and the other margins.
        let middle = [(14 + 84 + SIZE[0] - 28) / 2, (14 + 25 + SIZE[1] - 14 - 58) / 2];
        assert!(x.abs_diff(middle[0]) < 6 && y.abs_diff(middle[1]) < 12, "{x} {y} {middle:?}");
        assert_eq!(axis.format_ext(&2.5), "2.5");
        assert_eq!(axis.format_ext(&2000.0), "2,000");
        let [never, once] = [0.0, 1.0].map(|count| Axis::of_counts(100.0, 0.1).format_ext(&count));
        assert_eq!([never.as_str(), once.as_str(), axis.format_ext(&0.0).as_str()], ["never", "1", "0"]);
    }
}
