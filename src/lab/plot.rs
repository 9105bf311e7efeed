//! Plots that can go into a paper: white background, axes with units, a legend, lines that differ in marker as well as in
//! colour.

use plotters::coord::Shift;
use plotters::prelude::*;

use super::Measurement;
use super::table::{models, short};

/// Width and height of a panel in pixels.
const PANEL: (u32, u32) = (1200, 420);
/// Okabe and Ito's colours: told apart with any colour vision, and in grey.
const COLORS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(0, 0, 0),
];
const FONT: &str = "plot";
/// Height of a line of the legend in pixels.
const LEGEND_LINE: i32 = 28;

/// One line of a panel.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// What the legend says.
    pub name: String,
    /// Points from left to right.
    pub points: Vec<(f64, f64)>,
    /// Drawn thin and grey, without markers: a reference.
    pub reference: bool,
}

/// One pair of axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// What lies across, with its unit.
    pub x_label: String,
    /// What goes up, with its unit.
    pub y_label: String,
    /// Its lines.
    pub curves: Vec<Curve>,
    /// Names under the axis where x counts things without a number; empty otherwise.
    pub categories: Vec<String>,
}

/// The file format of a plot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlotFormat {
    /// Pixels.
    Png,
    /// Vectors.
    Svg,
}

impl PlotFormat {
    /// By the file's extension.
    pub fn of(path: &std::path::Path) -> Result<Self, String> {
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("png") => Ok(Self::Png),
            Some("svg") => Ok(Self::Svg),
            _ => Err(format!("{}: the plot must end in .png or .svg", path.display())),
        }
    }
}

type Value = fn(&Measurement) -> f64;

/// The panels for rows of one command: the paper's three curves for a sweep, speed-up and efficiency for scaling, and the
/// same three quantities by scene or by builder for the others.
pub fn panels(rows: &[Measurement]) -> Result<Vec<Panel>, String> {
    let Some(first) = rows.first() else { return Err("there are no rows to draw".to_owned()) };
    if let Some(other) = rows.iter().find(|row| row.command != first.command) {
        return Err(format!("rows of '{}' and of '{}' do not go into one plot", first.command, other.command));
    }
    match first.command.as_str() {
        "sweep" => Ok(sweep_panels(rows)),
        "scaling" => Ok(scaling_panels(rows)),
        "bench" => Ok(category_panels(rows, |row| short(&row.model), |row| row.container.name().to_owned())),
        "compare" => Ok(category_panels(
            rows,
            |row| row.preset.clone().unwrap_or_else(|| row.builder.clone()),
            |row| series_name(row, rows),
        )),
        other => Err(format!("there is no plot of '{other}'")),
    }
}

const QUANTITIES: [(&str, Value); 3] = [
    ("Build time (ms)", |row| row.build_ms),
    ("Trace time (ms)", |row| row.trace_ms),
    ("Tests per ray", |row| row.tests_per_ray),
];

/// Scene, container and ε, each only where the rows differ in it.
fn series_name(row: &Measurement, rows: &[Measurement]) -> String {
    let mut parts = Vec::new();
    if models(rows).len() > 1 {
        parts.push(short(&row.model));
    }
    if rows.iter().any(|other| other.container != row.container) {
        parts.push(row.container.name().to_owned());
    }
    if row.command == "sweep" && rows.iter().any(|other| other.epsilon != row.epsilon) {
        parts.push(format!("ε = {}", row.epsilon));
    }
    if parts.is_empty() {
        parts.push(format!("{}, {}", short(&row.model), row.container.name()));
    }
    parts.join(", ")
}

/// Groups rows into curves by name, in order of appearance, each sorted by x.
fn curves(
    rows: &[Measurement],
    name: impl Fn(&Measurement) -> String,
    point: impl Fn(&Measurement) -> (f64, f64),
) -> Vec<Curve> {
    let mut curves: Vec<Curve> = Vec::new();
    for row in rows {
        let name = name(row);
        let position = curves.iter().position(|curve| curve.name == name).unwrap_or_else(|| {
            curves.push(Curve { name, points: Vec::new(), reference: false });
            curves.len() - 1
        });
        curves[position].points.push(point(row));
    }
    for curve in &mut curves {
        curve.points.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
    curves
}

fn sweep_panels(rows: &[Measurement]) -> Vec<Panel> {
    let panel = |label: &str, value: Value| Panel {
        x_label: "Threshold δ (primitives)".to_owned(),
        y_label: label.to_owned(),
        curves: curves(rows, |row| series_name(row, rows), |row| (f64::from(row.threshold), value(row))),
        categories: Vec::new(),
    };
    QUANTITIES.iter().map(|(label, value)| panel(label, *value)).collect()
}

fn scaling_panels(rows: &[Measurement]) -> Vec<Panel> {
    let most = rows.iter().map(|row| row.threads).max().unwrap_or(1) as f64;
    let both = |scale: &dyn Fn(&Measurement) -> f64, ideal: Vec<(f64, f64)>| {
        let mut list = curves(
            rows,
            |row| format!("build, {}", series_name(row, rows)),
            |row| (row.threads as f64, row.speedup.unwrap_or(0.0) * scale(row)),
        );
        list.extend(curves(
            rows,
            |row| format!("trace, {}", series_name(row, rows)),
            |row| (row.threads as f64, row.trace_speedup.unwrap_or(0.0) * scale(row)),
        ));
        list.push(Curve { name: "ideal".to_owned(), points: ideal, reference: true });
        list
    };
    let panel = |y_label: &str, curves| Panel {
        x_label: "Threads".to_owned(),
        y_label: y_label.to_owned(),
        curves,
        categories: Vec::new(),
    };
    vec![
        panel("Speed-up over one thread", both(&|_| 1.0, vec![(1.0, 1.0), (most, most)])),
        panel(
            "Parallel efficiency (%)",
            both(&|row| 100.0 / row.threads.max(1) as f64, vec![(1.0, 100.0), (most, 100.0)]),
        ),
    ]
}

/// The three quantities over things without a number.
fn category_panels(
    rows: &[Measurement],
    category: impl Fn(&Measurement) -> String,
    series: impl Fn(&Measurement) -> String,
) -> Vec<Panel> {
    let rows: Vec<Measurement> = rows.iter().filter(|row| row.builder != "none").cloned().collect();
    let mut categories: Vec<String> = Vec::new();
    for row in &rows {
        let name = category(row);
        if !categories.contains(&name) {
            categories.push(name);
        }
    }
    let place = |row: &Measurement| categories.iter().position(|name| *name == category(row)).unwrap_or(0) as f64;
    QUANTITIES
        .iter()
        .map(|(label, value)| Panel {
            x_label: String::new(),
            y_label: (*label).to_owned(),
            curves: curves(&rows, &series, |row| (place(row), value(row))),
            categories: categories.clone(),
        })
        .collect()
}

/// Draws the panels below each other into the bytes of a file.
pub fn draw(panels: &[Panel], format: PlotFormat) -> Result<Vec<u8>, String> {
    // Registering again is harmless; the font is part of the program, so it cannot be unreadable.
    let _ = plotters::style::register_font(FONT, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT);
    let (width, height) = (PANEL.0, PANEL.1 * panels.len().max(1) as u32 + legend_height(panels));
    match format {
        PlotFormat::Svg => {
            let mut text = String::new();
            draw_on(&SVGBackend::with_string(&mut text, (width, height)).into_drawing_area(), panels)?;
            // Where the reader's machine lacks the font, any plain one does.
            Ok(text
                .replace(&format!("font-family=\"{FONT}\""), "font-family=\"Ubuntu, Helvetica, Arial, sans-serif\"")
                .into_bytes())
        }
        PlotFormat::Png => {
            let mut pixels = vec![255_u8; (width * height * 3) as usize];
            draw_on(&BitMapBackend::with_buffer(&mut pixels, (width, height)).into_drawing_area(), panels)?;
            let picture = image::RgbImage::from_raw(width, height, pixels).ok_or("the plot has no pixels")?;
            let mut bytes = std::io::Cursor::new(Vec::new());
            picture.write_to(&mut bytes, image::ImageFormat::Png).map_err(|error| error.to_string())?;
            Ok(bytes.into_inner())
        }
    }
}

fn draw_on<B: DrawingBackend>(area: &DrawingArea<B, Shift>, panels: &[Panel]) -> Result<(), String> {
    area.fill(&WHITE).map_err(|error| error.to_string())?;
    let (legend, below) = area.split_vertically(legend_height(panels));
    draw_legend(&legend, panels).map_err(|error| error.to_string())?;
    for (part, panel) in below.split_evenly((panels.len().max(1), 1)).iter().zip(panels) {
        draw_panel(part, panel).map_err(|error| error.to_string())?;
    }
    area.present().map_err(|error| error.to_string())
}

/// Where each entry of the legend stands, from left to right and then down: x, y and curve. All panels have the same
/// curves, so one legend above them serves all and hides no point.
fn legend_places(panels: &[Panel]) -> Vec<(i32, i32, &Curve)> {
    let (mut x, mut y) = (100, 26);
    let mut places = Vec::new();
    for curve in panels.first().map_or(&[][..], |panel| &panel.curves) {
        let width = 60 + curve.name.chars().count() as i32 * 11;
        if x > 100 && x + width > PANEL.0 as i32 {
            (x, y) = (100, y + LEGEND_LINE);
        }
        places.push((x, y, curve));
        x += width;
    }
    places
}

fn legend_height(panels: &[Panel]) -> u32 {
    legend_places(panels).last().map_or(0, |place| (place.1 + LEGEND_LINE) as u32)
}

fn draw_legend<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    panels: &[Panel],
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    use plotters::style::text_anchor::{HPos, Pos, VPos};
    let style = (FONT, 20).into_font().color(&BLACK).pos(Pos::new(HPos::Left, VPos::Center));
    let joined = panels.first().is_some_and(|panel| panel.categories.is_empty());
    let mut next = 0;
    for (x, y, curve) in legend_places(panels) {
        if curve.reference {
            area.draw(&PathElement::new([(x, y), (x + 26, y)], BLACK.mix(0.45).stroke_width(1)))?;
        } else {
            let color = COLORS[next % COLORS.len()];
            if joined {
                area.draw(&PathElement::new([(x, y), (x + 26, y)], color.stroke_width(2)))?;
            }
            area.draw(&marker((x + 13, y), next % 3, color))?;
            next += 1;
        }
        area.draw(&Text::new(curve.name.clone(), (x + 34, y), &style))?;
    }
    Ok(())
}

fn draw_panel<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    panel: &Panel,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let points = || panel.curves.iter().flat_map(|curve| &curve.points);
    let low = points().map(|point| point.0).fold(f64::INFINITY, f64::min);
    let high = points().map(|point| point.0).fold(f64::NEG_INFINITY, f64::max);
    let top = points().map(|point| point.1).fold(0.0, f64::max);
    let named = !panel.categories.is_empty();
    let margin = if named { 0.5 } else { ((high - low) * 0.02).max(0.1) };
    let mut chart = ChartBuilder::on(area)
        .margin(14)
        .margin_right(30)
        .x_label_area_size(58)
        .y_label_area_size(92)
        // Axes start at zero, so that heights can be compared.
        .build_cartesian_2d(low - margin..high + margin, 0.0..if top > 0.0 { top * 1.08 } else { 1.0 })?;
    let x_name = |x: &f64| {
        let nearest = x.round();
        if (x - nearest).abs() > 1e-6 {
            return String::new();
        }
        if named { panel.categories.get(nearest as usize).cloned().unwrap_or_default() } else { format!("{nearest}") }
    };
    let x_labels =
        if named { panel.categories.len() * 2 + 1 } else { ((high - low).round() as usize + 1).clamp(2, 17) };
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
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
    let mut next = 0;
    for curve in &panel.curves {
        if curve.reference {
            let style = BLACK.mix(0.45).stroke_width(1);
            chart.draw_series(LineSeries::new(curve.points.iter().copied(), style))?;
            continue;
        }
        let (color, shape) = (COLORS[next % COLORS.len()], next % 3);
        next += 1;
        // Things without a number are not joined by a line.
        if !named {
            chart.draw_series(LineSeries::new(curve.points.iter().copied(), color.stroke_width(2)))?;
        }
        chart.draw_series(curve.points.iter().map(|&point| EmptyElement::at(point) + marker((0, 0), shape, color)))?;
    }
    Ok(())
}

/// A disc, a square or a diamond.
fn marker<B: DrawingBackend>(at: (i32, i32), shape: usize, color: RGBColor) -> DynElement<'static, B, (i32, i32)> {
    let (x, y) = at;
    match shape {
        0 => Circle::new(at, 5, color.filled()).into_dyn(),
        1 => Rectangle::new([(x - 4, y - 4), (x + 5, y + 5)], color.filled()).into_dyn(),
        _ => Polygon::new([(x - 6, y), (x, y - 6), (x + 6, y), (x, y + 6)], color.filled()).into_dyn(),
    }
}
