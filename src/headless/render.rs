//! `render`: one frame into a PNG, with or without overlay; its hit distances into an EXR.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Serialize;

use super::context::Progress;
use super::tree_numbers::TreeNumbers;
use super::{Context, Failure, Finished};
use crate::accel::Accel;
use crate::budget::Budget;
use crate::export::{ExportError, check_target, write_file};
use crate::overlay::{OverlaySettings, Selection};
use crate::render::{Frame, RenderRequest, RenderSettings};
use crate::scene::SceneSource;
use crate::view::CameraChoice;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::BuildSettings;

/// One picture that is wanted.
#[derive(Debug, Clone)]
pub struct RenderCommand {
    /// The model.
    pub source: SceneSource,
    /// Its tree.
    pub build: BuildSettings,
    /// From where.
    pub camera: CameraChoice,
    /// How.
    pub settings: RenderSettings,
    /// The containers over it; `None` for the picture alone.
    pub overlay: Option<OverlaySettings>,
    /// Nodes that stand out or are left out.
    pub selection: Selection,
    /// The traced picture is seen under the containers; else a neutral background.
    pub geometry: bool,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// The PNG.
    pub output: Option<PathBuf>,
    /// The EXR of hit distances.
    pub depth_image: Option<PathBuf>,
    /// Print what was measured.
    pub json: bool,
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct RenderSummary<'a> {
    command: &'static str,
    model: String,
    triangles: usize,
    #[serde(flatten)]
    tree: TreeNumbers,
    trace_ms: f64,
    rays: u64,
    hits: u64,
    mrays_per_s: f64,
    tests_per_ray: Option<f32>,
    container_tests_per_ray: Option<f32>,
    primitive_tests_per_ray: Option<f32>,
    width_px: u32,
    height_px: u32,
    samples: u32,
    output: Option<&'a Path>,
    warnings: Vec<String>,
}

/// Renders, writes, prints.
pub fn run(command: &RenderCommand, context: &mut Context<'_>) -> Result<Finished, Failure> {
    for (path, extension) in [(&command.output, "png"), (&command.depth_image, "exr")] {
        let Some(path) = path else { continue };
        if !path.extension().is_some_and(|found| found.eq_ignore_ascii_case(extension)) {
            return Err(Failure::Usage(format!(
                "{}: the file must end in .{extension}: no other format is written here",
                path.display()
            )));
        }
        if command.source.path().is_some_and(|model| same_file(model, path)) {
            return Err(Failure::Failed(format!("{}: this is the model itself", path.display())));
        }
        check_target(path)?;
    }
    if let Some(text) = command.build.refusal(0) {
        return Err(Failure::Usage(text));
    }
    if command.overlay.is_some() && !cfg!(feature = "gui") {
        return Err(Failure::Failed(
            "--overlay needs the feature 'gui', which this program was built without: leave --overlay out".to_owned(),
        ));
    }
    check_memory(command)?;
    let scene = context.load(&command.source)?;
    let [width_px, height_px] = command.size;
    let (accel, frame) = context.pool()?.install(|| {
        let progress = Progress::new("Building", &context.token);
        let accel = Arc::new(Accel::build(&scene, &command.build, &context.token)?);
        progress.say("Tracing");
        let request = RenderRequest {
            accel: Arc::clone(&accel),
            camera: command.camera.camera(&scene.bounds, scene.up),
            settings: command.settings,
            width_px,
            height_px,
            coarseness: 1,
            count_tests: command.json,
        };
        let frame = crate::render::render(&request, &context.token, &|_| ())?;
        drop(progress);
        Ok::<_, Failure>((accel, frame))
    })?;
    let picture = match &command.overlay {
        Some(overlay) => draw_overlay(&accel, &frame, command, overlay, &context.token)?,
        None => frame.rgba.clone(),
    };
    context.token.check()?;
    if let Some(path) = &command.output {
        stop_or_fail(write_png(path, [width_px, height_px], &picture, &context.token), &context.token)?;
    }
    if let Some(path) = &command.depth_image {
        stop_or_fail(write_distances(path, &frame, &context.token), &context.token)?;
    }
    if command.json {
        let epo = context.pool()?.install(|| accel.epo(&context.token))?;
        let line = summary(command, &accel, epo, &frame);
        let text = serde_json::to_string(&line).map_err(|error| Failure::Failed(error.to_string()))?;
        writeln!(context.out, "{text}")?;
    }
    Ok(Finished { warned: !scene.warnings.is_empty() })
}

/// Whether the picture can be held and written.
fn check_memory(command: &RenderCommand) -> Result<(), Failure> {
    let [width, height] = command.size.map(u64::from);
    // A pixel of the frame, its sum over samples and the copy that is written; what the overlay draws into; the distances in
    // three channels and as a file.
    let bytes_a_pixel =
        52 + if command.overlay.is_some() { 24 } else { 0 } + if command.depth_image.is_some() { 40 } else { 0 };
    Budget::of_process()
        .check(&format!("a picture of {width}x{height} pixels"), width * height * bytes_a_pixel)
        .map_err(|error| Failure::Failed(error.to_string()))
}

fn summary<'a>(command: &'a RenderCommand, accel: &Accel, epo: f32, frame: &Frame) -> RenderSummary<'a> {
    RenderSummary {
        command: "render",
        model: command.source.to_string(),
        triangles: accel.scene.triangles.len(),
        tree: TreeNumbers::new(accel, epo),
        trace_ms: crate::lab::millis(frame.stats.trace_time),
        rays: frame.stats.primary_rays,
        hits: frame.stats.hits,
        mrays_per_s: frame.mrays_per_s(),
        tests_per_ray: frame
            .stats
            .container_tests_per_ray
            .zip(frame.stats.primitive_tests_per_ray)
            .map(|(containers, primitives)| containers + primitives),
        container_tests_per_ray: frame.stats.container_tests_per_ray,
        primitive_tests_per_ray: frame.stats.primitive_tests_per_ray,
        width_px: frame.width_px,
        height_px: frame.height_px,
        samples: frame.samples,
        output: command.output.as_deref(),
        warnings: accel.scene.warnings.entries.iter().map(ToString::to_string).collect(),
    }
}

/// Whether both names lead to one existing file.
fn same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// Picture and containers together, drawn by the window's own pass.
#[cfg(feature = "gui")]
fn draw_overlay(
    accel: &Arc<Accel>,
    frame: &Frame,
    command: &RenderCommand,
    settings: &OverlaySettings,
    token: &CancelToken,
) -> Result<Vec<[u8; 4]>, Failure> {
    use crate::overlay::{DrawInput, NodeTable, PictureInput, draw_offscreen};
    let table = Arc::new(NodeTable::new(accel));
    table.list(Some(settings), token)?;
    let selection = &command.selection;
    let missing = selection.selected.iter().chain(&selection.hidden).find(|&&node| node as usize >= table.len());
    if let Some(node) = missing {
        return Err(Failure::Failed(format!(
            "there is no node {node}: this tree has {} nodes, counted from 0 as in the window's selection",
            table.len()
        )));
    }
    let picture = PictureInput {
        id: 1,
        width_px: frame.width_px,
        height_px: frame.height_px,
        rgba: &frame.rgba,
        depth: &frame.depth,
    };
    if table.drawable(settings) != *settings {
        table.complete(token)?;
    }
    let shown = table.shown(settings, selection);
    if shown.wanted > shown.nodes.len() {
        eprintln!(
            "bvhscope: the chosen levels hold {} containers; the largest {} are drawn",
            shown.wanted,
            shown.nodes.len()
        );
    }
    draw_offscreen(&DrawInput {
        picture,
        camera: frame.camera,
        table: Some(&table),
        settings: *settings,
        selection,
        show_picture: command.geometry,
        viewport_px: [0, 0, frame.width_px, frame.height_px],
        pixels_per_point: 1.0,
    })
    .map_err(|error| Failure::Failed(format!("{error}\nwithout --overlay the picture needs no graphics driver")))
}

#[cfg(not(feature = "gui"))]
fn draw_overlay(
    _: &Arc<Accel>,
    _: &Frame,
    _: &RenderCommand,
    _: &OverlaySettings,
    _: &CancelToken,
) -> Result<Vec<[u8; 4]>, Failure> {
    Err(Failure::Failed("this program was built without the feature `gui`, which draws the overlay".to_owned()))
}

/// What came of writing a file: one that was not written because nobody wants it any more is no failure.
fn stop_or_fail(written: Result<(), ExportError>, token: &CancelToken) -> Result<(), Failure> {
    written.or_else(|error| {
        token.check()?;
        Err(error.into())
    })
}

/// Writes sRGB bytes as a PNG; cancelled, it fails.
pub fn write_png(path: &Path, size_px: [u32; 2], rgba: &[[u8; 4]], token: &CancelToken) -> Result<(), ExportError> {
    let encode = |writer: &mut dyn Write| -> Result<(), png::EncodingError> {
        let mut encoder = png::Encoder::new(writer, size_px[0], size_px[1]);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::Fast);
        let mut header = encoder.write_header()?;
        let mut stream = header.stream_writer_with_size(1 << 16)?;
        for portion in rgba.chunks(1 << 16) {
            token.check().map_err(std::io::Error::other)?;
            stream.write_all(portion.as_flattened())?;
        }
        stream.finish()?;
        header.finish()
    };
    write_file(path, |writer| encode(writer).map_err(|error| format!("cannot be written: {error}")))
}

/// Writes hit distances as an EXR with the distance in red, green and blue; infinity where nothing was hit. Cancelled, it
/// fails.
pub fn write_distances(path: &Path, frame: &Frame, token: &CancelToken) -> Result<(), ExportError> {
    let pixels: Vec<f32> = frame.distance.iter().flat_map(|&t| [t, t, t]).collect();
    let picture = image::Rgb32FImage::from_raw(frame.width_px, frame.height_px, pixels)
        .ok_or_else(|| ExportError::new(path, "the picture has no distances"))?;
    let mut bytes = Stoppable { bytes: std::io::Cursor::new(Vec::new()), token };
    picture
        .write_to(&mut bytes, image::ImageFormat::OpenExr)
        .map_err(|error| ExportError::new(path, format!("cannot be encoded: {error}")))?;
    crate::export::write_bytes(path, bytes.bytes.get_ref())
}

/// A file in memory that takes nothing more once its token is cancelled: the encoder hands over block after block.
struct Stoppable<'a> {
    bytes: std::io::Cursor<Vec<u8>>,
    token: &'a CancelToken,
}

impl Write for Stoppable<'_> {
    fn write(&mut self, buffer: &[u8]) -> std::io::Result<usize> {
        self.token.check().map_err(std::io::Error::other)?;
        self.bytes.write(buffer)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl std::io::Seek for Stoppable<'_> {
    fn seek(&mut self, to: std::io::SeekFrom) -> std::io::Result<u64> {
        self.bytes.seek(to)
    }
}
