//! `copies --open`: a scene of copies flat, in two levels and opened.

use std::sync::Arc;

use super::context::{Context, Failure, ignore_missing_reader, in_pool};
use super::copies::CopiesCommand;
use super::measure::of_job;
use super::progress::Progress;
use crate::accel::Accel;
use crate::catalog::settings::Stated;
use crate::console::note;
use crate::export::Protected;
use crate::lab::copy_forms::{FormRow, copy_forms};
use crate::lab::plot::form_figure;
use crate::lab::population::RayPlan;
use crate::lab::report_table::form_tables;
use crate::lab::rows::write_forms_csv;
use crate::lab::{Conditions, LabError, ViewConditions};
use crate::scene::Instancing;
use crate::text::printable;
use bvhscope_engine::cancel::CancelToken;

/// Measures the forms of the scene of `accel` and prints their rows; those that were measured before an early end, too.
pub(super) fn run(
    command: &CopiesCommand,
    accel: &Arc<Accel>,
    plan: &RayPlan,
    read: &Protected,
    context: &mut Context<'_>,
) -> Result<(), Failure> {
    let flat = flat(command, context)?;
    let token = context.token.clone();
    let progress = Progress::new("Tracing", &token);
    let (rows, outcome) = in_pool(|| measured(command, accel, flat.as_ref(), plan, &token));
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
fn flat(command: &CopiesCommand, context: &mut Context<'_>) -> Result<Option<Accel>, Failure> {
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
fn measured(
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
