//! `copies`: what the copies of a scene of two levels cost rays, or its forms, flat, in two levels and opened.

use std::sync::Arc;

use super::context::{Context, Failure, Finished, camera_of, in_pool};
use super::cost_rows::RowsOf;
use super::measure::{note_no_flat, of_job};
use super::output::Output;
use super::progress::Progress;
use super::ray_input::MeasuringRays;
use crate::accel::Accel;
use crate::export::Protected;
use crate::lab::LabError;
use crate::lab::copy_costs::copy_costs;
use crate::lab::copy_forms::{copy_forms, flat_form};
use crate::lab::plot::form_figure;
use crate::lab::population::RayPlan;
use crate::lab::report_table::{copy_tables, form_tables};
use crate::render::RenderSettings;
use crate::scene::{Instancing, SceneSource};
use crate::view::CameraChoice;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::BuildSettings;

/// Settings of `copies`.
#[derive(Debug, Clone)]
pub struct CopiesCommand {
    /// The model.
    pub source: SceneSource,
    /// Number of copies that have rows.
    pub most: usize,
    /// How far the tree over the copies is opened in the forms that are measured instead; none for the costs of copies.
    pub open: Vec<f32>,
    /// Build settings of all trees.
    pub build: BuildSettings,
    /// The camera of the view whose rays are traced.
    pub camera: CameraChoice,
    /// Width and height of that view in pixels.
    pub size: [u32; 2],
    /// Light and SIMD level; the others do not matter.
    pub settings: RenderSettings,
    /// The rays.
    pub rays: MeasuringRays,
    /// Output options.
    pub output: Output,
}

/// Measures the costs and prints their rows; those that were measured before an early end, too.
pub fn run(command: &CopiesCommand, context: &mut Context<'_>) -> Result<Finished, Failure> {
    if let Some(text) = command.build.refusal(0) {
        return Err(Failure::Usage(text));
    }
    command.output.check()?;
    let mut read = Protected::default();
    read.add_read(command.source.path().into_iter().chain(command.rays.file.as_deref()));
    read.add_standard_streams();
    command.output.check_files(&read)?;
    if context.load.instances == Instancing::Auto {
        context.load.instances = Instancing::TwoLevel;
    }
    let scene = context.load(&command.source)?;
    if scene.copies.is_none() {
        let text = format!("{}: the model has no copies of meshes in two levels", scene.source);
        return Err(Failure::Failed(text));
    }
    // Again, as only now it is known what else was read: buffers, textures, material libraries.
    read.add_read(&scene.files_read);
    command.output.check_files(&read)?;
    let camera = camera_of(&command.camera, &scene)?;
    let file = command.rays.read_file(&scene, &context.token)?;
    let has_bad_rays = file.as_ref().is_some_and(|file| !file.faults.is_empty());
    let token = context.token.clone();
    let progress = Progress::new("Building", &token);
    let accel = in_pool(|| Accel::build(&scene, &command.build, &token));
    let accel = Arc::new(accel.map_err(|error| of_job(error.into(), &command.source))?);
    let rays =
        RayPlan { populations: command.rays.populations, camera, size: command.size, settings: command.settings, file };
    let finished = Finished { warned: has_bad_rays || !scene.warnings.is_empty() };
    if !command.open.is_empty() {
        drop(progress);
        return run_forms(command, &accel, &rays, &read, context).map(|()| finished);
    }
    progress.set_label("Tracing");
    let rows_of = rows_of(command, &accel, &rays);
    let mut rows = Vec::new();
    let outcome =
        in_pool(|| copy_costs(&accel, &rays.views(), command.most, &token, &mut |cost| rows.push(rows_of.row(cost))));
    drop(progress);
    let outcome = outcome.map_err(|error| of_job(error, &command.source));
    let figure = |_: &[_]| unreachable!("--plot needs --open");
    command.output.deliver(&rows, copy_tables, figure, &read, context.out, outcome)?;
    Ok(finished)
}

/// The fields that all rows share.
fn rows_of<'a>(command: &'a CopiesCommand, accel: &'a Accel, rays: &'a RayPlan) -> RowsOf<'a> {
    RowsOf {
        command: "copies",
        source: &command.source,
        accel,
        camera: (&command.camera, &rays.camera),
        size: command.size,
        simd: command.settings.simd,
    }
}

/// Measures the forms of the scene of `accel` and prints their rows; those that were measured before an early end, too.
fn run_forms(
    command: &CopiesCommand,
    accel: &Arc<Accel>,
    plan: &RayPlan,
    read: &Protected,
    context: &mut Context<'_>,
) -> Result<(), Failure> {
    let token = context.token.clone();
    let flat = flat_tree(accel, &token).map_err(|error| of_job(error, &command.source))?;
    let progress = Progress::new("Tracing", &token);
    let (rows_of, rays) = (rows_of(command, accel, plan), plan.views());
    let mut rows = Vec::new();
    let outcome = in_pool(|| {
        copy_forms(accel, flat.as_ref(), &command.open, &rays, &token, &mut |cost| rows.push(rows_of.row(cost)))
    });
    drop(progress);
    let outcome = outcome.map_err(|error| of_job(error, &command.source));
    command.output.deliver(&rows, form_tables, |rows| Ok(form_figure(rows)), read, context.out, outcome)
}

/// The flat form; `None`, with a note, where memory does not suffice.
fn flat_tree(accel: &Accel, token: &CancelToken) -> Result<Option<Accel>, LabError> {
    let progress = Progress::new("Building", token);
    let built = in_pool(|| flat_form(accel, token));
    drop(progress);
    match built {
        Ok(flat) => Ok(Some(flat)),
        Err(LabError::Refused(reason)) => {
            note_no_flat(&reason);
            Ok(None)
        }
        Err(cancelled) => Err(cancelled),
    }
}
