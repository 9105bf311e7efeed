//! The picture of a frame: containers over it, legends below it, and its file.

use std::io::Write;
use std::path::Path;
use std::sync::Arc;

use super::context::Failure;
use super::exr::write_exr;
use super::svg::svg;
use crate::accel::node_values::KnownVisits;
use crate::catalog::metrics::Source;
use crate::console::note;
use crate::export::{ExportError, Protected, cannot_be_written, write_bytes, write_file};
use crate::lab::population::{Population, ViewRays};
use crate::legend::{self, Key};
#[cfg(feature = "gui")]
use crate::overlay::PictureInput;
use crate::overlay::{
    NodeTable, OverlaySettings, Selection, Shown, VectorInput, VectorLines, Viewpoint, tinted, vector_lines,
};
use crate::render::{Background, Frame};
use crate::text::shown_path;
use bvhscope_engine::cancel::CancelToken;

/// The parts of a frame that a picture shows.
pub(super) struct PictureChoice<'a> {
    /// Overlay settings; `None` for no overlay.
    pub(super) overlay: Option<OverlaySettings>,
    /// Selected, hidden and isolated nodes.
    pub(super) selection: &'a Selection,
    /// Show the traced picture under the overlay instead of the backdrop.
    pub(super) geometry: bool,
    /// Width and height in pixels.
    pub(super) size: [u32; 2],
    /// Draw a legend; `None` where the picture is wide enough.
    pub(super) legend: Option<bool>,
    /// Draw containers as vector lines.
    pub(super) is_vector: bool,
}

/// A picture to be written.
pub(super) enum Picture {
    /// sRGB with alpha, as the window shows it, with a legend below.
    Screen { size_px: [u32; 2], rgba: Vec<[u8; 4]>, legend: String },
    /// Linear radiance in sRGB's primaries.
    Linear { size_px: [u32; 2], radiance: Vec<[f32; 3]> },
    /// The traced picture, unless it is left out, and lines over it.
    Vector {
        size_px: [u32; 2],
        rgba: Option<Vec<[u8; 4]>>,
        lines: Vec<VectorLines>,
        keys: Vec<Key>,
        background: Background,
    },
}

impl Picture {
    /// The picture of a frame as the command asks for it.
    pub(super) fn of_frame(
        frame: &Frame,
        choice: &PictureChoice<'_>,
        table: &Arc<NodeTable>,
        token: &CancelToken,
    ) -> Result<Self, Failure> {
        let background = frame.settings.background;
        let viewpoint = Viewpoint { camera: frame.camera, size_px: choice.size, section: frame.settings.section };
        let view = (frame, &viewpoint);
        let shown = choice.overlay.map(|overlay| chosen(table, &overlay, choice, view, token)).transpose()?;
        let keys = if legend::is_wanted(choice.legend, choice.size[0]) {
            legend::of_picture(frame, choice.geometry, shown.as_deref().map(|shown| (&**table, shown)))
        } else {
            Vec::new()
        };
        let colors = colors(frame, choice, table);
        if choice.is_vector {
            let lines = match (&choice.overlay, &shown) {
                (Some(settings), Some(shown)) => {
                    let depth = if choice.geometry { &frame.depth[..] } else { &[] };
                    let neutral_lines = frame.settings.shading.is_coded() && choice.geometry;
                    let selection = choice.selection;
                    let input = VectorInput { table, shown, settings, selection, viewpoint, depth, neutral_lines };
                    vector_lines(&input, token)?
                }
                _ => Vec::new(),
            };
            let rgba = choice.geometry.then_some(colors);
            return Ok(Self::Vector { size_px: choice.size, rgba, lines, keys, background });
        }
        let mut rgba = match (&choice.overlay, &shown) {
            (Some(overlay), Some(shown)) => draw_overlay(frame, &colors, choice, overlay, (table, shown))?,
            _ => colors,
        };
        let [width, mut height] = choice.size;
        if !keys.is_empty() {
            height = legend::append(&mut rgba, choice.size, &keys, background);
        }
        let legend = keys.iter().map(Key::title).fold(String::new(), |all, title| all + "; " + title);
        Ok(Self::Screen { size_px: [width, height], rgba, legend })
    }

    /// Size and legend, for the user.
    pub(super) fn description(&self) -> String {
        let size = |[width, height]: &[u32; 2]| format!("{width}×{height} pixels");
        match self {
            Self::Screen { size_px, legend, .. } => format!("{}{legend}", size(size_px)),
            Self::Linear { size_px, .. } => format!("{} of linear radiance", size(size_px)),
            Self::Vector { size_px, lines, .. } => format!("{}, {} paths", size(size_px), lines.len()),
        }
    }

    /// Writes the picture, which is none of the `protected` files.
    pub(super) fn write(&self, path: &Path, protected: &Protected, token: &CancelToken) -> Result<(), ExportError> {
        match self {
            Self::Screen { size_px, rgba, .. } => write_png(path, protected, *size_px, rgba, token),
            Self::Linear { size_px, radiance } => {
                write_exr(path, protected, *size_px, radiance.as_flattened().to_vec(), token)
            }
            Self::Vector { size_px, rgba, lines, keys, background } => {
                let png = match rgba {
                    Some(rgba) => {
                        let mut png = Vec::new();
                        encode_png(&mut png, *size_px, rgba, token).map_err(|reason| ExportError::new(path, reason))?;
                        Some(png)
                    }
                    None => None,
                };
                let text = svg(*size_px, png.as_deref(), lines, keys, *background);
                write_bytes(path, protected, text.as_bytes())
            }
        }
    }
}

/// The nodes that are drawn, with a note where these are not all or have other colours. Visits are those by the rays of the picture.
fn chosen(
    table: &NodeTable,
    settings: &OverlaySettings,
    choice: &PictureChoice<'_>,
    (frame, viewpoint): (&Frame, &Viewpoint),
    token: &CancelToken,
) -> Result<Arc<Shown>, Failure> {
    if settings.color_by.source() == Source::Visits {
        let rays = ViewRays::new(Population::Primary, frame.camera, choice.size, &frame.settings);
        table.set_visits(Some(KnownVisits(rays.measure(table.accel(), token)?.visits)));
    }
    table.prepare(settings, token)?;
    let color_by = table.drawable(settings).color_by;
    if color_by != settings.color_by {
        note(format_args!(
            "bvhscope: --color-by {}: the tree has not followed a model (--time, --policy refit); the colours are those of --color-by {}",
            settings.color_by.name(),
            color_by.name()
        ));
    }
    let settings = &OverlaySettings { color_by, ..*settings };
    let shown = table.shown(settings, choice.selection, Some(viewpoint));
    let drawn = if choice.is_vector { shown.outlined } else { shown.nodes.len() };
    if shown.wanted > drawn {
        note(format_args!(
            "bvhscope: the chosen levels hold {} containers; the {drawn} largest on screen are drawn",
            shown.wanted,
        ));
    }
    Ok(Arc::new(shown))
}

/// The colours of the frame, with the triangles of the selected node tinted where there is an overlay.
fn colors(frame: &Frame, choice: &PictureChoice<'_>, table: &NodeTable) -> Vec<[u8; 4]> {
    let selected = choice.selection.selected.filter(|_| choice.overlay.is_some());
    match selected.filter(|&node| node > 0 && !frame.settings.shading.is_coded()) {
        Some(node) => tinted(&frame.rgba, &frame.primitive, &table.triangles_below(node)),
        None => frame.rgba.clone(),
    }
}

/// A frame in other colours as the overlay draws it.
#[cfg(feature = "gui")]
pub(super) fn picture_input<'a>(frame: &'a Frame, rgba: &'a [[u8; 4]]) -> PictureInput<'a> {
    let &Frame { width_px, height_px, ref depth, .. } = frame;
    PictureInput { id: 1, width_px, height_px, coarseness: 1.0, rgba, depth }
}

/// Draws the overlay over the frame offscreen, with the same pass as the window.
#[cfg(feature = "gui")]
fn draw_overlay(
    frame: &Frame,
    colors: &[[u8; 4]],
    choice: &PictureChoice<'_>,
    settings: &OverlaySettings,
    (table, shown): (&Arc<NodeTable>, &Arc<Shown>),
) -> Result<Vec<[u8; 4]>, Failure> {
    use crate::overlay::{DrawInput, draw_offscreen};
    draw_offscreen(&DrawInput {
        picture: picture_input(frame, colors),
        camera: frame.camera,
        table: Some(table),
        shown,
        settings: *settings,
        selection: choice.selection,
        show_picture: choice.geometry,
        section: frame.settings.section,
        neutral_lines: frame.settings.shading.is_coded(),
        backdrop: frame.settings.background.backdrop(),
        viewport_px: [0, 0, frame.width_px, frame.height_px],
        pixels_per_point: 1.0,
    })
    .map_err(|error| {
        Failure::Failed(format!("{error}\nwithout --overlay, or as an .svg, the picture needs no graphics driver"))
    })
}

#[cfg(not(feature = "gui"))]
fn draw_overlay(
    _: &Frame,
    _: &[[u8; 4]],
    _: &PictureChoice<'_>,
    _: &OverlaySettings,
    _: (&Arc<NodeTable>, &Arc<Shown>),
) -> Result<Vec<[u8; 4]>, Failure> {
    Err(Failure::Failed("this program was built without the feature `gui`, which draws the overlay".to_owned()))
}

/// Prints on stderr what was written.
pub(super) fn note_written(path: &Path, what: &str) {
    note(format_args!("bvhscope: wrote {}: {what}", shown_path(path)));
}

/// Converts a write error into a failure, or into an interruption if the token was cancelled.
pub(super) fn check_written(written: Result<(), ExportError>, token: &CancelToken) -> Result<(), Failure> {
    written.or_else(|error| {
        token.check()?;
        Err(error.into())
    })
}

/// Writes sRGB pixels as a PNG, which is none of the `protected` files; fails when cancelled.
pub fn write_png(
    path: &Path,
    protected: &Protected,
    size_px: [u32; 2],
    rgba: &[[u8; 4]],
    token: &CancelToken,
) -> Result<(), ExportError> {
    write_file(path, protected, |writer| encode_png(writer, size_px, rgba, token))
}

/// Encodes sRGB pixels as a PNG; fails when cancelled.
fn encode_png(writer: &mut dyn Write, size_px: [u32; 2], rgba: &[[u8; 4]], token: &CancelToken) -> Result<(), String> {
    let encode = |writer: &mut dyn Write| -> Result<(), png::EncodingError> {
        let mut header = png_encoder(writer, size_px).write_header()?;
        let mut stream = header.stream_writer_with_size(1 << 16)?;
        for chunk in rgba.chunks(1 << 16) {
            token.check().map_err(std::io::Error::other)?;
            stream.write_all(chunk.as_flattened())?;
        }
        stream.finish()?;
        header.finish()
    };
    encode(writer).map_err(encoding_error)
}

/// An encoder of sRGB pixels with alpha.
pub(super) fn png_encoder(writer: &mut dyn Write, size_px: [u32; 2]) -> png::Encoder<'static, &mut dyn Write> {
    let mut encoder = png::Encoder::new(writer, size_px[0], size_px[1]);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    encoder
}

/// Why a PNG was not written.
pub(super) fn encoding_error(error: png::EncodingError) -> String {
    match error {
        png::EncodingError::IoError(error) => cannot_be_written(&error),
        error => format!("cannot be encoded: {error}"),
    }
}
