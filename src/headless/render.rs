//! `render`: traces one frame and writes it as a PNG or SVG, with or without overlay, or its linear radiance as an EXR; and its
//! hit distances as an EXR. Of a model that moves, traces a moment, or a film of many.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use serde::Serialize;

use super::context::{Context, Failure, Finished, camera_of, ignore_missing_reader, in_pool};
use super::exr::write_distances;
use super::film::{Film, check_output};
use super::measure::of_job;
use super::moments::{MomentChoice, ShownMoment, check_follow, note_lost};
use super::output::json_line;
use super::picture::{Picture, PictureChoice, check_written, note_written};
use super::progress::Progress;
use super::tree_numbers::TreeNumbers;
use super::tree_origin::{TreeOrigin, note_faults};
use crate::accel::followed::FollowSession;
use crate::accel::laid::CountedLayout;
use crate::accel::{Accel, Follow};
use crate::budget::Budget;
use crate::catalog::layouts::{LayoutChoice, NamedLayout};
use crate::catalog::reading::TreeReading;
use crate::export::{Protected, check_target, wrong_ending};
use crate::lab::layouts::kept_nodes;
use crate::lab::population::{Population, ViewRays};
use crate::lab::{Conditions, ViewConditions};
use crate::overlay::{NodeTable, OverlaySettings, Selection};
use crate::render::{Frame, RenderRequest, RenderSettings};
use crate::scene::{Moment, Scene, SceneSource};
use crate::section::SectionChoice;
use crate::text::counted;
use crate::view::CameraChoice;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::BuildSettings;

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
    /// File to write: a PNG or SVG of what the window shows, or an EXR of linear radiance.
    pub output: Option<PathBuf>,
    /// EXR file of hit distances to write.
    pub depth_image: Option<PathBuf>,
    /// Draw a legend below a picture whose colours stand for numbers; `None` where it is wide enough.
    pub legend: Option<bool>,
    /// Print the measurements as JSON.
    pub json: bool,
    /// Moments of a model that moves: several make a film.
    pub moments: MomentChoice,
    /// How the tree of a moment is made.
    pub follow: Follow,
    /// The layout of the tree that heat maps count and containers are of; `None` for the tree itself.
    pub layout: Option<LayoutChoice>,
}

/// The JSON object that `--json` prints.
#[derive(Debug, Serialize)]
struct RenderSummary<'a> {
    command: &'static str,
    model: String,
    triangles: usize,
    #[serde(flatten)]
    tree: TreeNumbers,
    traversal: &'static str,
    width_px: u32,
    height_px: u32,
    repeat: usize,
    #[serde(flatten)]
    conditions: Conditions,
    samples: u32,
    #[serde(flatten)]
    moment: Option<ShownMoment>,
    #[serde(skip_serializing_if = "Option::is_none")]
    layout: Option<String>,
    /// Values at the two ends of the colours, in modes whose colours stand for values.
    #[serde(skip_serializing_if = "Option::is_none")]
    color_range: Option<[f32; 2]>,
    output: Option<&'a Path>,
    warnings: Vec<String>,
}

/// Renders the frame or the film, writes the files and prints the measurements.
pub fn run(command: &RenderCommand, context: &mut Context<'_>) -> Result<Finished, Failure> {
    let mut read = Protected::default();
    read.add_read(command.source.path().into_iter().chain(command.tree.path()));
    read.add_standard_streams();
    check(command, &read)?;
    let scene = context.load(&command.source)?;
    // Again, as only now it is known what else was read: buffers, textures, material libraries.
    read.add_read(&scene.files_read);
    check_outputs(command, &read)?;
    if command.moments.is_film() {
        let step = command.moments.step(&scene);
        let moments = command.moments.of(&scene)?;
        let (token, out) = (&context.token, &mut *context.out);
        return in_pool(|| film(command, &scene, &moments, step, &read, out, token));
    }
    let token = &context.token;
    let scene = command.moments.first(scene, token)?;
    let (accel, picture, frame) = in_pool(|| {
        let progress = Progress::new("Building", token);
        trace(command, &scene, &mut FollowSession::default(), &progress, token)
    })?;
    token.check()?;
    let has_faults = note_faults(&accel);
    if let Some(path) = &command.output {
        check_written(picture.write(path, &read, token), token)?;
        note_written(path, &picture.description());
        read.add_read([path]);
    }
    if let Some(path) = &command.depth_image {
        check_written(write_distances(path, &read, &frame, token), token)?;
        note_written(path, "hit distances");
    }
    if command.json {
        in_pool(|| accel.epo(None, token))?;
        print(command, &accel, &frame, context.out)?;
    }
    Ok(Finished { warned: has_faults || !scene.warnings.is_empty() })
}

/// Prints the measurements of a frame as a line of JSON.
fn print(command: &RenderCommand, accel: &Accel, frame: &Frame, out: &mut dyn Write) -> Result<(), Failure> {
    ignore_missing_reader(out.write_all(json_line(&summary(command, accel, frame))?.as_bytes()))?;
    Ok(())
}

/// Renders the model at each moment, `step` seconds apart, with a tree built for each, and writes the film.
fn film(
    command: &RenderCommand,
    scene: &Arc<Scene>,
    moments: &[Moment],
    step: f32,
    read: &Protected,
    out: &mut (dyn Write + Send),
    token: &CancelToken,
) -> Result<Finished, Failure> {
    let Some(output) = &command.output else { return Ok(Finished::default()) };
    let (progress, mut session) = (Progress::new("Building", token), FollowSession::default());
    let mut warned = !scene.warnings.is_empty();
    let mut frame_of = |moment: Moment| -> Result<([u32; 2], Vec<[u8; 4]>), Failure> {
        token.check()?;
        let posed = Arc::new(scene.at(moment, token)?);
        warned |= note_lost(&posed, moment.seconds);
        let (accel, picture, frame) = trace(command, &posed, &mut session, &progress, token)?;
        if command.json {
            accel.epo(None, token)?;
            print(command, &accel, &frame, out)?;
        }
        match picture {
            Picture::Screen { size_px, rgba, .. } => Ok((size_px, rgba)),
            Picture::Linear { .. } | Picture::Vector { .. } => unreachable!("a film has neither extension"),
        }
    };
    // The first frame has the size of all: a legend below it adds to the height.
    let (size_px, first) = frame_of(moments[0])?;
    let delay = Duration::try_from_secs_f32(step).unwrap_or(Duration::MAX);
    let film = Film { output, size_px, count: moments.len(), delays: [delay; 2] };
    let others = moments[1..].iter().map(|&moment| frame_of(moment).map(|(_, rgba)| rgba));
    film.write(read, &mut std::iter::once(Ok(first)).chain(others), token)?;
    drop(progress);
    note_written(output, &counted(film.count as u64, &format!("frames of {}×{} pixels", size_px[0], size_px[1])));
    Ok(Finished { warned })
}

/// Builds the tree, traces the frame and makes the picture of it.
fn trace(
    command: &RenderCommand,
    scene: &Arc<Scene>,
    session: &mut FollowSession,
    progress: &Progress,
    token: &CancelToken,
) -> Result<(Arc<Accel>, Picture, Frame), Failure> {
    progress.set_label("Building");
    let accel = command.tree.accel(scene, &command.source, &command.build, (command.follow, session), token)?;
    let accel = Arc::new(accel);
    accel.widen(token)?;
    progress.set_label("Tracing");
    let table = Arc::new(NodeTable::new(&accel));
    check_nodes(&command.selection, &table)?;
    let visibility = table.visibility(&command.selection).filter(|_| command.hide_triangles);
    let section = command.section.map(|choice| choice.plane(&scene.bounds, scene.offset));
    let settings = RenderSettings { section, ..command.settings };
    let mut request = RenderRequest {
        count_tests: command.json,
        hidden: visibility.map(|visibility| Arc::clone(&visibility.triangles)),
        ..RenderRequest::new(&accel, camera_of(&command.camera, scene)?, settings, command.size)
    };
    request.layout = command.layout.map(|choice| laid_out(choice, &request, &command.source, token)).transpose()?;
    let of_layout = request.layout.as_ref().map(|layout| Arc::new(NodeTable::of_layout(&accel, &layout.kept)));
    let table = of_layout.unwrap_or(table);
    let (frame, radiance) = if command.writes("exr") {
        crate::render::render_radiance(&request, token)?
    } else {
        (crate::render::render(&request, token, &|_| ())?, Vec::new())
    };
    let picture = if command.writes("exr") {
        Picture::Linear { size_px: command.size, radiance }
    } else {
        Picture::of_frame(&frame, &command.choice(), &table, token)?
    };
    Ok((accel, picture, frame))
}

/// The layout of the tree of a picture; visits by which it may be chosen are those of the primary rays.
fn laid_out(
    choice: LayoutChoice,
    request: &RenderRequest,
    source: &SceneSource,
    token: &CancelToken,
) -> Result<CountedLayout, Failure> {
    let size_px = [request.width_px, request.height_px];
    let rays = ViewRays::new(Population::Primary, request.camera, size_px, &request.settings);
    let kept = kept_nodes(&request.accel, choice, choice.is_by_visits().then_some(&rays), token);
    Ok(CountedLayout { choice, kept: Arc::new(kept.map_err(|error| of_job(error, source))?) })
}

impl RenderCommand {
    fn choice(&self) -> PictureChoice<'_> {
        PictureChoice {
            overlay: self.overlay,
            selection: &self.selection,
            geometry: self.geometry,
            size: self.size,
            legend: self.legend,
            is_vector: self.writes("svg"),
        }
    }

    /// The picture is written as a file with this extension.
    fn writes(&self, extension: &str) -> bool {
        self.output.as_deref().is_some_and(|path| ends_in(path, extension))
    }
}

fn ends_in(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|found| found.eq_ignore_ascii_case(extension))
}

/// Checks what can be checked before the model is loaded.
fn check(command: &RenderCommand, read: &Protected) -> Result<(), Failure> {
    check_extensions(command)?;
    check_outputs(command, read)?;
    check_follow(command.follow, &command.build, &command.moments)?;
    if command.layout.is_some() && command.overlay.is_none() && !command.settings.shading.is_of_layouts() {
        return Err(Failure::Usage(format!(
            "--layout: --shading {} has nothing of a layout: take a heat map of tests, steps, lines or the whole ray, or \
             --overlay",
            command.settings.shading.name()
        )));
    }
    if command.overlay.is_some() && !command.writes("svg") && !cfg!(feature = "gui") {
        return Err(Failure::Failed(
            "--overlay needs the feature 'gui', which this program was built without: leave --overlay out, or write an .svg"
                .to_owned(),
        ));
    }
    check_memory(command)
}

/// Checks that the outputs have extensions that are written, and can hold the requested content.
fn check_extensions(command: &RenderCommand) -> Result<(), Failure> {
    if command.moments.is_film() {
        // A film, see `check_outputs`.
        return Ok(());
    }
    for (path, extensions, expected) in
        [(&command.output, &["png", "svg", "exr"][..], ".png, .svg or .exr"), (&command.depth_image, &["exr"], ".exr")]
    {
        let Some(path) = path else { continue };
        if !extensions.iter().any(|extension| ends_in(path, extension)) {
            let text = format!("the file must end in {expected}: no other format is written here");
            return Err(Failure::Usage(wrong_ending(path, &text)));
        }
    }
    if command.writes("exr") && command.overlay.is_some() {
        return Err(Failure::Usage(
            "--overlay: containers are drawn on what a screen shows, and an .exr holds linear radiance: \
             write a .png, or leave --overlay out"
                .to_owned(),
        ));
    }
    if command.writes("exr") && command.settings.shading.has_values() {
        return Err(Failure::Usage(format!(
            "--shading {}: its colours stand for numbers, and an .exr holds linear radiance: write a .png, or take \
             --depth-image for distances",
            command.settings.shading.name()
        )));
    }
    if command.writes("svg") && command.overlay.is_some_and(|overlay| overlay.faces || overlay.overlap) {
        return Err(Failure::Usage(
            "--faces and --overlap: an .svg holds lines of containers only: write a .png, or leave them out".to_owned(),
        ));
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
    if let (true, Some(output)) = (command.moments.is_film(), &command.output) {
        return check_output(output, read);
    }
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
        + if command.depth_image.is_some() || command.writes("exr") { 40 } else { 0 };
    Budget::of_process()
        .check(&format!("a picture of {width}x{height} pixels"), width * height * bytes_a_pixel)
        .map_err(|error| Failure::Failed(error.to_string()))
}

fn summary<'a>(command: &'a RenderCommand, accel: &Accel, frame: &Frame) -> RenderSummary<'a> {
    let tree = TreeReading { trace: Some(frame.reading()), ..accel.reading() };
    RenderSummary {
        command: "render",
        model: command.source.to_string(),
        triangles: accel.scene.triangle_count() as usize,
        tree: TreeNumbers::new(accel, &tree),
        traversal: frame.settings.traversal.name(),
        width_px: frame.width_px,
        height_px: frame.height_px,
        repeat: 1,
        conditions: Conditions::of_process(
            Some(ViewConditions::new(command.camera.place(&accel.scene), &frame.camera, accel.scene.offset)),
            frame.settings.simd,
        ),
        samples: frame.samples,
        moment: ShownMoment::of(accel),
        layout: frame.layout.map(|layout| NamedLayout::from(layout).name()),
        color_range: frame.settings.shading.has_values().then_some(frame.value_range),
        output: command.output.as_deref(),
        warnings: accel.scene.warnings.entries.iter().map(ToString::to_string).collect(),
    }
}
