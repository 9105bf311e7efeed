//! The layout of a figure: notes, and charts side by side under their legends; and its file.

use std::path::Path;

use plotters::coord::Shift;
use plotters::prelude::*;

use super::bitmap::Bitmap;
use super::chart::{Chart, Curve};
use super::charts::charts;
use super::draw::{self, text_width};
use super::notes::notes;
use crate::export::wrong_ending;
use crate::lab::measure::LabError;
use crate::lab::measurement::Measurement;
use bvhscope_engine::cancel::CancelToken;

/// Width of the picture in pixels.
const WIDTH: u32 = 1280;
/// Height of a chart without rows in pixels.
const HEIGHT: u32 = 430;
/// Height of a row of a chart in pixels.
const ROW_HEIGHT: u32 = 30;
/// Charts with rows side by side: more would leave no room for the labels of their axes.
const CHARTS_OF_ROWS: usize = 3;
/// Height of a line of the legend or of the notes in pixels.
const LINE: u32 = 28;
/// Distance of legend and notes from the left edge in pixels.
const INDENT: i32 = 24;
/// Size of the font of the notes in pixels.
const NOTE_SIZE: u32 = 18;

/// Charts with notes above them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Figure {
    /// How the values were made, and how to read the charts; a paragraph each.
    pub notes: Vec<String>,
    /// The charts.
    pub charts: Vec<Chart>,
}

impl Figure {
    /// The plots of the measurements of one command.
    pub fn of_rows(rows: &[Measurement]) -> Result<Self, String> {
        let charts = charts(rows)?;
        Ok(Self { notes: notes(rows, &charts), charts })
    }
}

/// The file format of a figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlotFormat {
    /// Raster image.
    Png,
    /// Vector graphics.
    Svg,
}

impl PlotFormat {
    /// The format that the extension of `path` names.
    pub fn of(path: &Path) -> Result<Self, String> {
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("png") => Ok(Self::Png),
            Some("svg") => Ok(Self::Svg),
            _ => Err(wrong_ending(path, "the plot must end in .png or .svg")),
        }
    }
}

/// Charts side by side, optionally under a legend.
struct Band<'a> {
    charts: &'a [Chart],
    /// Curves in the legend: places, and each once.
    legend: Vec<([i32; 2], &'a Curve)>,
}

impl Band<'_> {
    fn has_rows(&self) -> bool {
        !self.charts[0].rows.is_empty()
    }

    fn legend_height(&self) -> u32 {
        self.legend.last().map_or(0, |([_, y], _)| *y as u32 + LINE / 2 + 4)
    }

    fn height(&self) -> u32 {
        match self.charts[0].rows.len() as u32 {
            0 => HEIGHT,
            rows => draw::ROWS_FRAME + rows * ROW_HEIGHT,
        }
    }
}

/// Lays charts out in bands. The first band of those that share curves has the legend.
fn bands(charts: &[Chart]) -> Vec<Band<'_>> {
    let mut bands: Vec<Band<'_>> = Vec::new();
    for family in charts.chunk_by(|a, b| a.rows == b.rows && shares_curves(a, b)) {
        let per_band = if family[0].rows.is_empty() { 2 } else { CHARTS_OF_ROWS };
        for (index, charts) in family.chunks(per_band).enumerate() {
            bands.push(Band { charts, legend: if index == 0 { legend(family) } else { Vec::new() } });
        }
    }
    bands
}

/// Some curve is in both charts, under the same name in the same colour.
fn shares_curves(a: &Chart, b: &Chart) -> bool {
    a.curves.iter().any(|one| b.curves.iter().any(|other| one.name == other.name && one.color == other.color))
}

/// The curves of `charts`, each once, in lines from left to right. A single one of nameless dots needs no legend.
fn legend(charts: &[Chart]) -> Vec<([i32; 2], &Curve)> {
    let mut curves: Vec<&Curve> = Vec::new();
    for curve in charts.iter().flat_map(|chart| &chart.curves) {
        if !curves.iter().any(|other| other.name == curve.name) {
            curves.push(curve);
        }
    }
    curves.sort_by_key(|curve| curve.color);
    let mut at = [INDENT, LINE as i32 / 2 + 8];
    let mut placed = Vec::new();
    for curve in curves {
        let width = 34 + text_width(&curve.name, draw::LABEL_SIZE) + 26;
        if at[0] > INDENT && at[0] + width > WIDTH as i32 {
            at = [INDENT, at[1] + LINE as i32];
        }
        placed.push((at, curve));
        at[0] += width;
    }
    placed
}

/// The notes in lines that fit.
fn lines(notes: &[String]) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for note in notes {
        let mut line = String::new();
        for word in note.split(' ') {
            let longer = if line.is_empty() { word.to_owned() } else { format!("{line} {word}") };
            if !line.is_empty() && text_width(&longer, NOTE_SIZE) > WIDTH as i32 - 2 * INDENT {
                lines.push(std::mem::replace(&mut line, word.to_owned()));
            } else {
                line = longer;
            }
        }
        lines.push(line);
    }
    lines
}

/// Draws the figure into the bytes of a file, fit for a paper: white background, axes with units, legends, curves that differ in
/// marker as well as in colour.
pub fn draw(figure: &Figure, format: PlotFormat, token: &CancelToken) -> Result<Vec<u8>, LabError> {
    let (bands, lines) = (bands(&figure.charts), lines(&figure.notes));
    let notes_height = if lines.is_empty() { 0 } else { lines.len() as u32 * (LINE - 4) + 16 };
    let height = notes_height + bands.iter().map(|band| band.height() + band.legend_height()).sum::<u32>();
    let size = (WIDTH, height.max(1));
    match format {
        PlotFormat::Svg => {
            let mut text = String::new();
            draw_on(&SVGBackend::with_string(&mut text, size).into_drawing_area(), &lines, &bands, token)?;
            Ok(draw::for_viewers(&text).into_bytes())
        }
        PlotFormat::Png => {
            let mut pixels = vec![255_u8; (size.0 * size.1 * 3) as usize];
            let refused = |text: String| LabError::Refused(text);
            let bitmap = Bitmap::new(&mut pixels, size).map_err(refused)?;
            draw_on(&bitmap.into_drawing_area(), &lines, &bands, token)?;
            let picture = image::RgbImage::from_raw(size.0, size.1, pixels)
                .ok_or_else(|| refused("the plot has no pixels".to_owned()))?;
            let mut bytes = std::io::Cursor::new(Vec::new());
            picture.write_to(&mut bytes, image::ImageFormat::Png).map_err(|error| refused(error.to_string()))?;
            Ok(bytes.into_inner())
        }
    }
}

fn draw_on<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    lines: &[String],
    bands: &[Band<'_>],
    token: &CancelToken,
) -> Result<(), LabError> {
    let failed = |error: DrawingAreaErrorKind<B::ErrorType>| LabError::Refused(error.to_string());
    area.fill(&WHITE).map_err(failed)?;
    let mut y = 10;
    for line in lines {
        let style = (draw::font(), NOTE_SIZE).into_font().color(&BLACK);
        area.draw(&Text::new(line.clone(), (INDENT, y), style)).map_err(failed)?;
        y += LINE as i32 - 4;
    }
    let mut below = area.clone().split_vertically(if lines.is_empty() { 0 } else { y + 6 }).1;
    for band in bands {
        let (legend, rest) = below.split_vertically(band.legend_height());
        let (part, rest) = rest.split_vertically(band.height());
        for &(place, curve) in &band.legend {
            draw::legend_entry(&legend, place, curve, band.charts[0].is_joined()).map_err(failed)?;
        }
        // Names of rows are at the left of a band only.
        let names = if band.has_rows() { draw::names_width(&band.charts[0]) } else { 0 };
        let (left, charts) = part.split_horizontally(names);
        let columns = if band.has_rows() { band.charts.len() } else { 2 };
        if band.has_rows() {
            draw::row_names(&left, &band.charts[0]).map_err(failed)?;
        }
        for (part, chart) in charts.split_evenly((1, columns)).iter().zip(band.charts) {
            token.check()?;
            draw::chart(part, chart).map_err(failed)?;
        }
        below = rest;
    }
    area.present().map_err(failed)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::super::axis::{Axis, Scale};
    use super::super::chart::{Look, Point};
    use super::*;

    fn chart(name: &str, points: Vec<[f64; 2]>) -> Chart {
        let axis = Axis { low: 1.0, high: 100.0, scale: Scale::Log };
        let points = points.into_iter().map(Point::of).collect();
        let curve = Curve { name: name.to_owned(), color: 0, look: Look::Dots, points };
        let labels = ["x".to_owned(), "y".to_owned()];
        Chart { title: String::new(), labels, axes: [axis; 2], curves: vec![curve], rows: Vec::new() }
    }

    fn picture(charts: Vec<Chart>) -> image::RgbImage {
        let figure = Figure { notes: Vec::new(), charts };
        image::load_from_memory(&draw(&figure, PlotFormat::Png, &CancelToken::new()).unwrap()).unwrap().to_rgb8()
    }

    #[test]
    fn dots_are_drawn_where_their_values_are() {
        let [empty, one] = [vec![], vec![[10.0, 10.0]]].map(|points| picture(vec![chart("trees", points)]));
        let changed = one.enumerate_pixels().filter(|(x, y, pixel)| empty.get_pixel(*x, *y) != *pixel);
        let (mut count, mut sum) = (0, [0, 0]);
        for (x, y, _) in changed {
            (count, sum) = (count + 1, [sum[0] + x, sum[1] + y]);
        }
        assert!((20..200).contains(&count), "{count}");
        // The middle of both logarithms is near that of the chart, which takes the left half below its legend.
        let [x, y] = sum.map(|sum| sum / count);
        assert!(x.abs_diff(WIDTH / 4) < 40 && y.abs_diff(LINE + HEIGHT / 2) < 40, "{x} {y}");
    }

    #[test]
    fn charts_of_the_same_curves_share_a_legend() {
        let band = |charts: &[Chart]| bands(charts).iter().map(|band| band.legend.len()).collect::<Vec<_>>();
        let of = |names: &[&str]| names.iter().map(|name| chart(name, vec![[1.0; 2]])).collect::<Vec<_>>();
        assert_eq!(band(&of(&["a", "a", "a"])), [1, 0]);
        assert_eq!(band(&of(&["a", "b"])), [1, 1]);
    }

    #[test]
    fn nothing_is_drawn_once_cancelled() {
        let token = CancelToken::new();
        token.cancel();
        let figure = Figure { notes: Vec::new(), charts: vec![chart("a", Vec::new())] };
        assert!(matches!(draw(&figure, PlotFormat::Svg, &token), Err(LabError::Cancelled(_))));
    }
}
