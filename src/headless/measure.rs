//! `bench`, `sweep`, `scaling`, `compare` and `animate`: run a measuring job over models, and write its rows to stdout and files.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Serialize;

use super::context::{Context, Failure, Finished, camera_of, ignore_missing_reader, in_pool};
use super::moments::MomentChoice;
use super::output::{Output, STDOUT, json_line};
use super::progress::Progress;
use super::ray_input::MeasuringRays;
use super::tree_origin::note_faults;
use crate::accel::Accel;
use crate::console::note;
use crate::export::Protected;
use crate::lab::copy_forms::flat_scene;
use crate::lab::motion::AnimatePlan;
use crate::lab::plot::Figure;
use crate::lab::population::Populations;
use crate::lab::prediction::Correlation;
use crate::lab::report_table::{few_entering, summary, tables};
use crate::lab::rows::write_csv;
use crate::lab::{Job, LabError, Measurement, SceneForm, Subject, TraceView, settings_of_forms};
use crate::scene::{Instancing, LoadOptions, Moment, Scene, SceneSource, load};
use crate::text::{counted, printable, shown_path};
use crate::view::CameraChoice;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::settings::Passes;
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::traverse::Traversal;

/// Most parts for each copy in the opened tree that `compare` measures.
const OPENED: f32 = 2.0;

/// How rays are traced to be measured, in any model.
#[derive(Debug, Clone)]
pub struct TraceChoice {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Traversal order.
    pub traversal: Traversal,
    /// SIMD level for tracing.
    pub simd: SimdLevel,
    /// Number of repetitions.
    pub repeat: usize,
    /// Number of samples of which the end-point overlap is estimated; exact without.
    pub epo_samples: Option<usize>,
}

impl TraceChoice {
    /// The same for `scene` from a camera, with the rays of which `populations` are measured too.
    pub(super) fn view(
        &self,
        camera: &CameraChoice,
        scene: &Scene,
        populations: Populations,
    ) -> Result<TraceView, Failure> {
        let Self { size, traversal, simd, repeat, epo_samples } = *self;
        let (place, camera) = (camera.place(scene), camera_of(camera, scene)?);
        Ok(TraceView { camera, place, size, traversal, simd, repeat, populations, epo_samples })
    }
}

/// Settings of a measuring command.
#[derive(Debug, Clone)]
pub struct MeasureCommand {
    /// The models.
    pub sources: Vec<SceneSource>,
    /// The measuring job.
    pub job: Job,
    /// Files with trees of the model to measure beside those that are built.
    pub trees: Vec<PathBuf>,
    /// Names of these trees in tables and plots, in their order; those without are named by their files.
    pub labels: Vec<String>,
    /// The moment of models that move.
    pub moments: MomentChoice,
    /// The cameras from which each model is measured.
    pub cameras: Vec<CameraChoice>,
    /// How the rays are traced.
    pub trace: TraceChoice,
    /// Rays whose cost is measured too.
    pub rays: MeasuringRays,
    /// Output options.
    pub output: Output,
}

impl MeasureCommand {
    /// The label of the tree of one of `paths`: the given one, or the whole path where another file has the same name.
    fn label(&self, index: usize, paths: &[&Path]) -> Option<String> {
        let path = paths[index];
        let is_namesake = |other: &&Path| other.file_name() == path.file_name() && *other != path;
        let whole = || paths.iter().any(is_namesake).then(|| shown_path(path));
        self.labels.get(index).cloned().or_else(whole)
    }

    /// Why the file of rays cannot be used.
    fn ray_file_refusal(&self) -> Option<&'static str> {
        let path = self.rays.file.as_ref()?;
        (path.as_os_str() == STDOUT && self.sources.len() > 1)
            .then_some("--rays -: standard input is read once: name one model, or a file")
    }
}

/// Measures one model after another. Of several models none may be missing; one that cannot be used is reported and skipped, and
/// the command fails at the end. Rows measured before an early end are still printed and written.
pub fn run(command: &MeasureCommand, context: &mut Context<'_>) -> Result<Finished, Failure> {
    if let Some(text) = command.job.refusal().or_else(|| command.ray_file_refusal().map(ToOwned::to_owned)) {
        return Err(Failure::Usage(text));
    }
    if command.labels.len() > command.trees.len() {
        return Err(Failure::Usage(format!(
            "{} for {}: each --label names the tree of a --tree",
            counted(command.labels.len() as u64, "labels"),
            counted(command.trees.len() as u64, "trees")
        )));
    }
    command.output.check()?;
    // Before the first of them is measured, which may take hours.
    let missing: Vec<_> =
        command.sources.iter().filter(|source| source.is_missing()).map(ToString::to_string).collect();
    if command.sources.len() > 1 && !missing.is_empty() {
        return Err(Failure::Failed(printable(&format!("no such file: {}", missing.join(", "))).into_owned()));
    }
    let mut read = Protected::default();
    read.add_read(command.sources.iter().filter_map(SceneSource::path));
    read.add_read(command.trees.iter().chain(&command.rays.file));
    read.add_standard_streams();
    command.output.check_files(&read)?;
    let mut run = Run { command, rows: Vec::new(), read, finished: Finished::default(), output_failure: None };
    let mut unusable = 0;
    let mut early_end = None;
    for (index, source) in command.sources.iter().enumerate() {
        match run.measure_model(index, source, context) {
            Ok(()) => {}
            Err(ModelFailure::Unusable(text)) if command.sources.len() > 1 => {
                note(format_args!("bvhscope: {text}"));
                unusable += 1;
            }
            Err(ModelFailure::Unusable(text)) => {
                early_end = Some(Failure::Failed(text));
                break;
            }
            Err(ModelFailure::Of(failure)) => {
                early_end = Some(failure);
                break;
            }
            Err(ModelFailure::NoOutput) => break,
        }
    }
    // Every output is attempted even if others fail.
    let written = match &run.rows[..] {
        [] if early_end.is_some() => Ok(()),
        rows => command.output.write_files(rows, write_csv, Figure::of_rows, &run.read),
    };
    let printed = match run.output_failure {
        Some(failure) => Err(failure),
        None => print_tables(command, &run.rows, context),
    };
    written?;
    if let Some(failure) = early_end {
        return Err(failure);
    }
    ignore_missing_reader(printed)?;
    if unusable > 0 {
        return Err(Failure::Failed(format!("{unusable} of {} models could not be measured", command.sources.len())));
    }
    Ok(run.finished)
}

/// Why the measuring of a model ended without all its rows.
enum ModelFailure {
    /// The model cannot be used or measured; others can.
    Unusable(String),
    /// Nothing more is measured.
    Of(Failure),
    /// Nothing would take the rows.
    NoOutput,
}

impl From<Failure> for ModelFailure {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Failed(text) => Self::Unusable(text),
            failure => Self::Of(failure),
        }
    }
}

/// A measuring command under way.
struct Run<'a> {
    command: &'a MeasureCommand,
    rows: Vec<Measurement>,
    /// The files read so far.
    read: Protected,
    finished: Finished,
    /// Why rows are not printed any more.
    output_failure: Option<std::io::Error>,
}

impl Run<'_> {
    /// Appends all rows of one model.
    fn measure_model(
        &mut self,
        index: usize,
        source: &SceneSource,
        context: &mut Context<'_>,
    ) -> Result<(), ModelFailure> {
        let command = self.command;
        // A shard of a sweep may contain no point of this model, which then need not be loaded.
        if !command.job.concerns(index, command.sources.len()) {
            return Ok(());
        }
        let mut scene = command.moments.first(context.load(source)?, &context.token)?;
        if let Job::Animate { plan, .. } = &command.job {
            scene = at_start(scene, plan, &context.token)?;
        }
        self.finished.warned |= !scene.warnings.is_empty();
        // Again, as only now it is known what else was read: buffers, textures, material libraries.
        self.read.add_read(&scene.files_read);
        command.output.check_files(&self.read).map_err(ModelFailure::Of)?;
        let views = views(command, &scene).map_err(ModelFailure::Of)?;
        let trees = self.read_trees(&scene, source, context)?;
        let rays = command.rays.read_file(&scene, &context.token)?;
        self.finished.warned |= rays.as_ref().is_some_and(|rays| !rays.faults.is_empty());
        let forms = other_forms(&command.job, &scene, source, context)?;
        let subject = Subject { model: source.to_string(), scene, trees, rays, load: context.load.clone(), forms };
        if let Some(reason) = command.job.left_out(&subject) {
            note(format_args!("bvhscope: {}: trees left out: {reason}", printable(&source.to_string())));
        }
        let token = context.token.clone();
        let progress = Progress::new(&format!("Measuring {}", source.label()), &token);
        let has_files = command.output.csv_file().is_some() || command.output.plot.is_some();
        let Self { rows, output_failure, finished, .. } = self;
        let first = rows.len();
        // Frames of a clip have warnings of their own.
        let known = subject.scene.warnings.entries.iter().map(ToString::to_string).collect::<Vec<_>>();
        let mut noted = (None, Vec::new());
        let out = &mut *context.out;
        let mut row = |measured: Measurement| {
            let own: Vec<String> =
                measured.warnings.iter().filter(|warning| !known.contains(warning)).cloned().collect();
            finished.warned |= !own.is_empty();
            let moment = measured.motion.as_ref().map(|motion| motion.time_s);
            if noted != (moment, own.clone()) {
                progress.suspend(|| note_moment(source, moment, &own));
                noted = (moment, own);
            }
            // Rows are reported as they come: as JSON lines, or as notes on stderr before the table.
            if !command.output.json {
                let camera = measured.view().camera;
                let from = if views.len() > 1 { format!(", from camera {camera}") } else { String::new() };
                progress.suspend(|| note(format_args!("bvhscope: {}{from}", summary(&measured))));
            } else if output_failure.is_none() {
                *output_failure = progress.suspend(|| print_json(&measured, out)).err();
                if output_failure.is_some() && !has_files {
                    // Nobody would get the other rows.
                    token.cancel();
                }
            }
            rows.push(measured);
        };
        let measured = views.iter().enumerate().try_for_each(|(turn, view)| {
            let token = token.part(turn, views.len());
            command.job.run(&subject, (index, command.sources.len()), view, &token, &mut row)
        });
        for text in few_entering(&rows[first..]) {
            note(format_args!("bvhscope: {text}"));
        }
        if output_failure.is_some() && !has_files {
            return Err(ModelFailure::NoOutput);
        }
        Ok(measured.map_err(|error| of_job(error, source))?)
    }
}

impl Run<'_> {
    /// Reads the trees of a model that files hold: those that are named, and for `compare` that of the model's own file.
    fn read_trees(
        &mut self,
        scene: &Arc<Scene>,
        source: &SceneSource,
        context: &Context<'_>,
    ) -> Result<Vec<Arc<Accel>>, Failure> {
        let own = source.path().filter(|_| scene.has_tree && matches!(self.command.job, Job::Compare { .. }));
        let paths: Vec<&Path> = self.command.trees.iter().map(PathBuf::as_path).chain(own).collect();
        let token = &context.token;
        let read = paths.iter().enumerate().map(|(index, path)| {
            let mut accel = in_pool(|| Accel::read(scene, path, Passes::NONE, token))?;
            if let Some(file) = &mut accel.file {
                file.label = self.command.label(index, &paths);
            }
            Ok(Arc::new(accel))
        });
        let mut trees = read.collect::<Result<Vec<_>, Failure>>()?;
        for accel in &trees {
            self.finished.warned |= note_faults(accel);
        }
        if self.command.job.orients() {
            let has_boxes = |accel: &&Arc<Accel>| accel.tree.container_kind() == ContainerKind::Aabb;
            let oriented = |accel: &Arc<Accel>| Ok(Arc::new(in_pool(|| accel.oriented(token))?));
            let oriented = trees.iter().filter(has_boxes).map(oriented).collect::<Result<Vec<_>, Failure>>()?;
            trees.extend(oriented);
        }
        Ok(trees)
    }
}

/// The forms of a scene of copies that `compare` measures beside its own: flat, where memory allows, in two levels, and opened.
fn other_forms(
    job: &Job,
    scene: &Arc<Scene>,
    source: &SceneSource,
    context: &Context<'_>,
) -> Result<Vec<SceneForm>, ModelFailure> {
    let token = &context.token;
    let levels = match scene.form() {
        _ if !matches!(job, Job::Compare { .. }) => return Ok(Vec::new()),
        Instancing::Auto => return Ok(Vec::new()),
        Instancing::TwoLevel => Arc::clone(scene),
        Instancing::Flat => {
            let options = LoadOptions { instances: Instancing::TwoLevel, ..context.load.clone() };
            Arc::new(in_pool(|| load(source, &options, token)).map_err(Failure::from)?)
        }
    };
    let mut forms = Vec::new();
    if scene.copies.is_none() {
        forms.push(SceneForm::of(&levels));
    } else {
        match in_pool(|| flat_scene(scene, &settings_of_forms(), token)) {
            Ok(flat) => forms.push(SceneForm::of(&flat)),
            Err(LabError::Refused(reason)) => note_no_flat(&reason),
            Err(cancelled) => return Err(of_job(cancelled, source).into()),
        }
    }
    forms.push(SceneForm { scene: levels, open: Some(OPENED) });
    Ok(forms)
}

/// Says that memory does not suffice for the flat form of a scene.
pub(super) fn note_no_flat(reason: &str) {
    note(format_args!("bvhscope: the flat scene is left out: {}", printable(reason)));
}

/// The view of each camera of a command; one where two names stand for the same place.
fn views(command: &MeasureCommand, scene: &Scene) -> Result<Vec<TraceView>, Failure> {
    let mut views: Vec<TraceView> = Vec::new();
    for camera in &command.cameras {
        let view = command.trace.view(camera, scene, command.rays.populations)?;
        if !views.contains(&view) {
            views.push(view);
        }
    }
    Ok(views)
}

/// Prints the warnings of a model at a moment to stderr.
fn note_moment(source: &SceneSource, seconds: Option<f32>, warnings: &[String]) {
    for warning in warnings {
        let at = seconds.map_or_else(String::new, |seconds| format!("at {seconds} s: "));
        note(format_args!("bvhscope: {}: {at}{warning}", printable(&source.to_string())));
    }
}

/// A model that moves at the beginning of the clip, so that a view frames all of it.
fn at_start(scene: Arc<Scene>, plan: &AnimatePlan, token: &CancelToken) -> Result<Arc<Scene>, Failure> {
    let Some(motion) = &scene.motion else { return Ok(scene) };
    let clip = motion.choose(plan.clip.as_deref()).map_err(Failure::Failed)?;
    let moment = Moment { clip, seconds: motion.clips[clip].start };
    Ok(Arc::new(in_pool(|| scene.at(moment, token))?))
}

/// A job that ended early on `source`.
pub(super) fn of_job(error: LabError, source: &SceneSource) -> Failure {
    match error {
        LabError::Cancelled(_) => Failure::Interrupted,
        LabError::Refused(text) => Failure::Failed(format!("{}: {text}", printable(&source.to_string()))),
    }
}

/// Prints a row, or a correlation over rows, as one JSON line, as far as its reader takes it now.
fn print_json(row: &impl Serialize, out: &mut (dyn std::io::Write + Send)) -> std::io::Result<()> {
    out.write_all(json_line(row)?.as_bytes())?;
    out.flush()
}

/// Prints what follows the rows: correlations over them as JSON lines, or all of them as tables.
fn print_tables(command: &MeasureCommand, rows: &[Measurement], context: &mut Context<'_>) -> std::io::Result<()> {
    if command.output.json {
        // The frames of a clip are no trees of one scene.
        let correlations = if matches!(command.job, Job::Animate { .. }) { Vec::new() } else { Correlation::all(rows) };
        return correlations.iter().try_for_each(|found| print_json(found, context.out));
    }
    command.output.print(rows, write_csv, |rows| tables(command.job.command(), rows), context.out)
}
