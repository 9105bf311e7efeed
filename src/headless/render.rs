//! `render`: traces one frame and writes it as a PNG, with or without overlay, or its linear radiance as an EXR; and its hit
//! distances as an EXR.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Serialize;

use super::context::{Context, Failure, Finished, ignore_missing_reader, in_pool};
use super::exr::{write_distances, write_exr};
use super::progress::Progress;
use super::tree_numbers::TreeNumbers;
use super::tree_origin::{TreeOrigin, note_faults};
use crate::accel::Accel;
use crate::budget::Budget;
use crate::console::printable_json;
use crate::export::{ExportError, Protected, cannot_be_written, check_target, write_file};
use crate::overlay::{NodeTable, OverlaySettings, Selection};
use crate::render::{Frame, RenderRequest, RenderSettings};
use crate::scene::SceneSource;
use crate::section::SectionChoice;
use crate::text::shown_path;
use crate::view::CameraChoice;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::BuildSettings;
use bvhscope_engine::tree::overlap::EndPointOverlap;

/// Settings of `render`.
#[derive(Debug, Clone)]
pub struct RenderCommand {
    /// The model.
    pub source: SceneSource,
    /// Build settings of the tree, where it is built.
    pub build: BuildSettings,
    /// Where the tree comes from.
    pub tree: TreeOrigin,
    /// The camera.
    pub camera: CameraChoice,
    /// Render settings.
    pub settings: RenderSettings,
    /// Overlay settings; `None` for no overlay.
    pub overlay: Option<OverlaySettings>,
    /// The section plane; `None` for the whole model.
    pub section: Option<SectionChoice>,
    /// Selected, hidden and isolated nodes.
    pub selection: Selection,
    /// Leave the triangles below hidden nodes out of the picture.
    pub hide_triangles: bool,
    /// Show the traced picture under the overlay instead of a neutral background.
    pub geometry: bool,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// File to write: a PNG of what the window shows, or an EXR of linear radiance.
    pub output: Option<PathBuf>,
    /// EXR file of hit distances to write.
    pub depth_image: Option<PathBuf>,
    /// Print the measurements as JSON.
    pub json: bool,
}

/// The JSON object that `--json` prints.
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

/// Renders the frame, writes the files and prints the measurements.
pub fn run(command: &RenderCommand, context: &mut Context<'_>) -> Result<Finished, Failure> {
    check_extensions(command)?;
    let mut read = Protected::default();
    read.add_read(command.source.path().into_iter().chain(command.tree.path()));
    read.add_standard_streams();
    check_outputs(command, &read)?;
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
    // Again, as only now it is known what else was read: buffers, textures, material libraries.
    read.add_read(&scene.files_read);
    check_outputs(command, &read)?;
    let [width_px, height_px] = command.size;
    let token = &context.token;
    let (accel, picture, frame) = in_pool(|| {
        let progress = Progress::new("Building", token);
        let accel = Arc::new(command.tree.accel(&scene, &command.source, &command.build, token)?);
        accel.widen(token)?;
        progress.set_label("Tracing");
        let table = NodeTable::new(&accel);
        check_nodes(&command.selection, &table)?;
        let visibility = table.visibility(&command.selection).filter(|_| command.hide_triangles);
        let request = RenderRequest {
            accel: Arc::clone(&accel),
            camera: command.camera.camera(&scene),
            settings: RenderSettings {
                section: command.section.map(|choice| choice.plane(&scene.bounds)),
                ..command.settings
            },
            width_px,
            height_px,
            coarseness: 1.0,
            count_tests: command.json,
            hidden: visibility.map(|visibility| Arc::clone(&visibility.triangles)),
            clusters: None,
        };
        let (frame, radiance) = if command.writes_radiance() {
            crate::render::render_radiance(&request, token)?
        } else {
            (crate::render::render(&request, token, &|_| ())?, Vec::new())
        };
        drop(progress);
        let picture = match &command.overlay {
            _ if command.writes_radiance() => Picture::Linear(radiance),
            Some(overlay) => Picture::Screen(draw_overlay(&accel, &frame, command, overlay, token)?),
            None => Picture::Screen(frame.rgba.clone()),
        };
        Ok::<_, Failure>((accel, picture, frame))
    })?;
    token.check()?;
    let has_faults = note_faults(&accel);
    if let Some(path) = &command.output {
        let size_px = [width_px, height_px];
        let written = match &picture {
            Picture::Screen(rgba) => write_png(path, &read, size_px, rgba, token),
            Picture::Linear(radiance) => write_exr(path, &read, size_px, radiance.as_flattened().to_vec(), token),
        };
        check_written(written, token)?;
        read.add_read([path]);
    }
    if let Some(path) = &command.depth_image {
        check_written(write_distances(path, &read, &frame, token), token)?;
    }
    if command.json {
        let epo = in_pool(|| accel.epo(token))?;
        let line = summary(command, &accel, epo, &frame);
        let text = serde_json::to_string(&line).map_err(|error| Failure::Failed(error.to_string()))?;
        ignore_missing_reader(writeln!(context.out, "{}", printable_json(&text)))?;
    }
    Ok(Finished { warned: has_faults || !scene.warnings.is_empty() })
}

/// A picture to be written.
enum Picture {
    /// sRGB with alpha, as the window shows it.
    Screen(Vec<[u8; 4]>),
    /// Linear radiance in sRGB's primaries.
    Linear(Vec<[f32; 3]>),
}

impl RenderCommand {
    /// Whether the picture is written as linear radiance.
    fn writes_radiance(&self) -> bool {
        self.output.as_deref().is_some_and(|path| ends_in(path, "exr"))
    }
}

fn ends_in(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|found| found.eq_ignore_ascii_case(extension))
}

/// Checks that the outputs have extensions that are written, and hold what is asked for.
fn check_extensions(command: &RenderCommand) -> Result<(), Failure> {
    for (path, extensions) in [(&command.output, &["png", "exr"][..]), (&command.depth_image, &["exr"])] {
        let Some(path) = path else { continue };
        if !extensions.iter().any(|extension| ends_in(path, extension)) {
            return Err(Failure::Usage(format!(
                "{}: the file must end in .{}: no other format is written here",
                shown_path(path),
                extensions.join(" or .")
            )));
        }
    }
    if command.writes_radiance() && command.overlay.is_some() {
        return Err(Failure::Usage(
            "--overlay: containers are drawn on what a screen shows, and an .exr holds linear radiance: \
             write a .png, or leave --overlay out"
                .to_owned(),
        ));
    }
    if command.writes_radiance() && command.settings.shading.has_values() {
        return Err(Failure::Usage(format!(
            "--shading {}: its colours stand for numbers, and an .exr holds linear radiance: write a .png, or take \
             --depth-image for distances",
            command.settings.shading.name()
        )));
    }
    Ok(())
}

/// Checks that the tree has the nodes that are named.
fn check_nodes(selection: &Selection, table: &NodeTable) -> Result<(), Failure> {
    let Selection { selected, hidden, isolated, .. } = selection;
    let missing = selected.iter().chain(isolated).chain(hidden).find(|&&node| node as usize >= table.len());
    missing.map_or(Ok(()), |node| {
        Err(Failure::Failed(format!(
            "there is no node {node}: this tree has {} nodes, counted from 0 as in the window's selection",
            table.len()
        )))
    })
}

/// Checks that both outputs can be written, are two files and none of those `read`.
fn check_outputs(command: &RenderCommand, read: &Protected) -> Result<(), Failure> {
    let mut protected = read.clone();
    for path in [&command.output, &command.depth_image].into_iter().flatten() {
        check_target(path, &protected)?;
        protected.add_output(path);
    }
    Ok(())
}

/// Checks the memory budget for rendering and writing the picture.
fn check_memory(command: &RenderCommand) -> Result<(), Failure> {
    let [width, height] = command.size.map(u64::from);
    // Per pixel: the frame, its sums over samples and the copy that is written; the overlay's render target; distances or
    // radiance as three channels and as an encoded file.
    let bytes_a_pixel = 68
        + if command.overlay.is_some() { 24 } else { 0 }
        + if command.depth_image.is_some() || command.writes_radiance() { 40 } else { 0 };
    Budget::of_process()
        .check(&format!("a picture of {width}x{height} pixels"), width * height * bytes_a_pixel)
        .map_err(|error| Failure::Failed(error.to_string()))
}

fn summary<'a>(command: &'a RenderCommand, accel: &Accel, epo: EndPointOverlap, frame: &Frame) -> RenderSummary<'a> {
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

/// Draws the overlay over the frame offscreen, with the same pass as the window.
#[cfg(feature = "gui")]
fn draw_overlay(
    accel: &Arc<Accel>,
    frame: &Frame,
    command: &RenderCommand,
    settings: &OverlaySettings,
    token: &CancelToken,
) -> Result<Vec<[u8; 4]>, Failure> {
    use crate::console::note;
    use crate::overlay::{DrawInput, PictureInput, Viewpoint, draw_offscreen, tinted};
    let table = Arc::new(NodeTable::new(accel));
    let selection = &command.selection;
    let tint = selection.selected.filter(|&node| node > 0 && !frame.settings.shading.is_coded());
    let tinted = tint.map(|node| tinted(&frame.rgba, &frame.primitive, &table.triangles_below(node)));
    let picture = PictureInput {
        id: 1,
        width_px: frame.width_px,
        height_px: frame.height_px,
        coarseness: 1.0,
        rgba: tinted.as_ref().unwrap_or(&frame.rgba),
        depth: &frame.depth,
    };
    table.prepare(settings, token)?;
    let viewpoint = Viewpoint { camera: frame.camera, size_px: command.size, section: frame.settings.section };
    let shown = Arc::new(table.shown(settings, selection, Some(&viewpoint)));
    if shown.wanted > shown.nodes.len() {
        note(format_args!(
            "bvhscope: the chosen levels hold {} containers; the {} largest on screen are drawn",
            shown.wanted,
            shown.nodes.len()
        ));
    }
    draw_offscreen(&DrawInput {
        picture,
        camera: frame.camera,
        table: Some(&table),
        shown: &shown,
        settings: *settings,
        selection,
        show_picture: command.geometry,
        section: frame.settings.section,
        neutral_lines: frame.settings.shading.is_coded(),
        light_background: frame.settings.background == crate::render::Background::Light,
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
    let encode = |writer: &mut dyn Write| -> Result<(), png::EncodingError> {
        let mut encoder = png::Encoder::new(writer, size_px[0], size_px[1]);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::Fast);
        let mut header = encoder.write_header()?;
        let mut stream = header.stream_writer_with_size(1 << 16)?;
        for chunk in rgba.chunks(1 << 16) {
            token.check().map_err(std::io::Error::other)?;
            stream.write_all(chunk.as_flattened())?;
        }
        stream.finish()?;
        header.finish()
    };
    write_file(path, protected, |writer| {
        encode(writer).map_err(|error| match error {
            png::EncodingError::IoError(error) => cannot_be_written(&error),
            error => format!("cannot be encoded: {error}"),
        })
    })
}
