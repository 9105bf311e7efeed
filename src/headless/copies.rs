//! `copies`: what the copies of a scene of two levels cost rays, or its forms, flat, in two levels and opened.

use std::sync::Arc;

use super::context::{Context, Failure, Finished, camera_of, ignore_missing_reader, in_pool};
use super::measure::of_job;
use super::output::Output;
use super::progress::Progress;
use super::ray_input::MeasuringRays;
use crate::accel::Accel;
use crate::catalog::settings::Stated;
use crate::console::note;
use crate::export::Protected;
use crate::lab::copy_costs::{CopyRow, copy_costs};
use crate::lab::copy_forms::{FormRow, copy_forms};
use crate::lab::plot::form_figure;
use crate::lab::population::RayPlan;
use crate::lab::report_table::{copy_tables, form_tables};
use crate::lab::rows::{write_copies_csv, write_forms_csv};
use crate::lab::{Conditions, LabError, ViewConditions};
use crate::render::RenderSettings;
use crate::scene::{Instancing, SceneSource};
use crate::text::printable;
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
    let (rows, outcome) = in_pool(|| measured(command, &accel, &rays, &token));
    drop(progress);
    let written = match &rows[..] {
        [] => Ok(()),
        rows => command.output.write_files(rows, write_copies_csv, |_| unreachable!("--plot needs --open"), &read),
    };
    let printed = command.output.print(&rows, write_copies_csv, copy_tables, context.out);
    written?;
    outcome.map_err(|error| of_job(error, &command.source))?;
    ignore_missing_reader(printed)?;
    Ok(finished)
}

/// The rows, as far as they were measured.
fn measured(
    command: &CopiesCommand,
    accel: &Arc<Accel>,
    plan: &RayPlan,
    token: &CancelToken,
) -> (Vec<CopyRow>, Result<(), LabError>) {
    let scene = &accel.scene;
    let mut rows = Vec::new();
    let outcome = copy_costs(accel, plan, command.most, token, &mut |population, rays, part, cost| {
        let has_camera = population.kind().is_some();
        let view = has_camera.then(|| ViewConditions::new(command.camera.place(scene), &plan.camera, scene.offset));
        rows.push(CopyRow {
            command: "copies",
            model: command.source.to_string(),
            triangles: scene.triangle_count() as usize,
            builder: accel.builder_name().into_owned(),
            settings: Stated::of(&accel.settings),
            threads: rayon::current_num_threads(),
            population,
            rays,
            part,
            cost,
            width_px: command.size[0],
            height_px: command.size[1],
            conditions: Conditions::of_process(view, command.settings.simd),
            warnings: scene.warnings.entries.iter().map(ToString::to_string).collect(),
        });
    });
    (rows, outcome)
}

/// Measures the forms of the scene of `accel` and prints their rows; those that were measured before an early end, too.
fn run_forms(
    command: &CopiesCommand,
    accel: &Arc<Accel>,
    plan: &RayPlan,
    read: &Protected,
    context: &mut Context<'_>,
) -> Result<(), Failure> {
    let flat = flat_form(command, context)?;
    let token = context.token.clone();
    let progress = Progress::new("Tracing", &token);
    let (rows, outcome) = in_pool(|| measured_forms(command, accel, flat.as_ref(), plan, &token));
    drop(progress);
    let written = match &rows[..] {
        [] => Ok(()),
        rows => command.output.write_files(rows, write_forms_csv, |rows| Ok(form_figure(rows)), read),
    };
    let printed = command.output.print(&rows, write_forms_csv, form_tables, context.out);
    written?;
    outcome.map_err(|error| of_job(error, &command.source))?;
    Ok(ignore_missing_reader(printed)?)
}

/// The tree of the flat scene; `None`, with a note, where memory does not suffice.
fn flat_form(command: &CopiesCommand, context: &mut Context<'_>) -> Result<Option<Accel>, Failure> {
    let instances = std::mem::replace(&mut context.load.instances, Instancing::Flat);
    let scene = context.load(&command.source);
    context.load.instances = instances;
    let token = context.token.clone();
    let progress = Progress::new("Building", &token);
    let built = scene.and_then(|scene| {
        let accel = in_pool(|| Accel::build(&scene, &command.build, &token));
        accel.map_err(|error| of_job(error.into(), &command.source))
    });
    drop(progress);
    token.check().map_err(LabError::from).map_err(|error| of_job(error, &command.source))?;
    Ok(built
        .map_err(|error| {
            note(format_args!("bvhscope: the flat scene is left out: {}", printable(&error.to_string())));
        })
        .ok())
}

/// The rows, as far as they were measured.
fn measured_forms(
    command: &CopiesCommand,
    accel: &Arc<Accel>,
    flat: Option<&Accel>,
    plan: &RayPlan,
    token: &CancelToken,
) -> (Vec<FormRow>, Result<(), LabError>) {
    let scene = &accel.scene;
    let mut rows = Vec::new();
    let outcome = copy_forms(accel, flat, &command.open, plan, token, &mut |form, population, cost| {
        let has_camera = population.kind().is_some();
        let view = has_camera.then(|| ViewConditions::new(command.camera.place(scene), &plan.camera, scene.offset));
        rows.push(FormRow {
            command: "copies",
            model: command.source.to_string(),
            triangles: scene.triangle_count() as usize,
            builder: accel.builder_name().into_owned(),
            settings: Stated::of(&accel.settings),
            threads: rayon::current_num_threads(),
            form,
            population,
            cost,
            width_px: command.size[0],
            height_px: command.size[1],
            conditions: Conditions::of_process(view, command.settings.simd),
            warnings: scene.warnings.entries.iter().map(ToString::to_string).collect(),
        });
    });
    (rows, outcome)
}
