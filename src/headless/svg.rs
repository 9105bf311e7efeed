//! A picture with containers as an SVG: the traced picture as an embedded PNG, lines and legend as vectors.

use std::fmt::Write as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use plotters::prelude::*;

use crate::legend::{self, Key};
use crate::overlay::VectorLines;
use crate::render::Background;

/// The text of an SVG of the size of the picture with its legend below. `png` is the encoded picture; `None` leaves it out.
pub(super) fn svg(
    [width, height]: [u32; 2],
    png: Option<&[u8]>,
    lines: &[VectorLines],
    keys: &[Key],
    background: Background,
) -> String {
    let legend_px = legend::height_px(width, keys.len());
    let all = height + legend_px;
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{all}\" viewBox=\"0 0 {width} {all}\">\n"
    );
    if let Some(png) = png {
        let data = STANDARD.encode(png);
        // Writing into a string cannot fail.
        let _ = writeln!(text, "<image width=\"{width}\" height=\"{height}\" href=\"data:image/png;base64,{data}\"/>");
    } else if background != Background::Transparent {
        let [r, g, b, _] = background.backdrop();
        let color = hex([r, g, b].map(|channel| (channel * 255.0).round() as u8));
        let _ = writeln!(text, "<rect width=\"{width}\" height=\"{height}\" fill=\"{color}\"/>");
    }
    text.push_str("<g fill=\"none\" stroke-linecap=\"round\" stroke-linejoin=\"round\">\n");
    for VectorLines { node, color, opacity, width_px, lines } in lines {
        let path: String = lines.iter().map(|line| polyline(line)).collect();
        let _ = writeln!(
            text,
            "<path data-node=\"{node}\" stroke=\"{}\" stroke-opacity=\"{opacity:.3}\" stroke-width=\"{width_px:.2}\" d=\"{path}\"/>",
            hex(*color)
        );
    }
    text.push_str("</g>\n");
    if legend_px > 0 {
        let mut part = String::new();
        let area = SVGBackend::with_string(&mut part, (width, legend_px)).into_drawing_area();
        // Drawing into memory does not fail.
        let _ = legend::draw(&area, keys, background, legend::unit(width), 0);
        drop(area);
        let _ = writeln!(text, "<g transform=\"translate(0 {height})\">{}</g>", crate::lab::plot::for_viewers(&part));
    }
    text + "</svg>\n"
}

fn hex([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn polyline(points: &[[f32; 2]]) -> String {
    let place = |[x, y]: &[f32; 2]| format!("{x:.1} {y:.1}");
    format!("M{}", points.iter().map(place).collect::<Vec<_>>().join("L"))
}
