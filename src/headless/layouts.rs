//! `layouts`: wide trees of many layouts over one binary tree, and what rays cost in each.

use std::sync::Arc;

use super::context::{Context, Failure, Finished, camera_of, in_pool, needs_triangles};
use super::cost_rows::RowsOf;
use super::measure::of_job;
use super::moments::MomentChoice;
use super::output::Output;
use super::progress::Progress;
use super::ray_input::MeasuringRays;
use super::tree_origin::{TreeOrigin, note_faults};
use crate::accel::followed::FollowSession;
use crate::accel::{Accel, Follow};
use crate::export::Protected;
use crate::lab::LabError;
use crate::lab::cost_row::CostRow;
use crate::lab::layouts::{LaidOut, LayoutPlan, layouts, mark_front};
use crate::lab::plot::layout_figure;
use crate::lab::population::RayPlan;
use crate::lab::report_table::layout_tables;
use crate::render::RenderSettings;
use crate::scene::SceneSource;
use crate::view::CameraChoice;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::BuildSettings;

/// Settings of `layouts`.
#[derive(Debug, Clone)]
pub struct LayoutsCommand {
    /// The model.
    pub source: SceneSource,
    /// The layouts.
    pub plan: LayoutPlan,
    /// Build settings of the binary tree, where it is built.
    pub build: BuildSettings,
    /// Where the tree comes from.
    pub tree: TreeOrigin,
    /// The moment of a model that moves.
    pub moments: MomentChoice,
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

/// Measures the layouts and prints their rows; those that were measured before an early end, too.
pub fn run(command: &LayoutsCommand, context: &mut Context<'_>) -> Result<Finished, Failure> {
    if let Some(text) = command.build.refusal(0) {
        return Err(Failure::Usage(text));
    }
    command.output.check()?;
    let mut read = Protected::default();
    read.add_read(command.source.path().into_iter().chain(command.tree.path()).chain(command.rays.file.as_deref()));
    read.add_standard_streams();
    command.output.check_files(&read)?;
    let scene = command.moments.first(context.load(&command.source)?, &context.token)?;
    needs_triangles(&scene, "layouts")?;
    // Again, as only now it is known what else was read: buffers, textures, material libraries.
    read.add_read(&scene.files_read);
    command.output.check_files(&read)?;
    let camera = camera_of(&command.camera, &scene)?;
    let file = command.rays.read_file(&scene, &context.token)?;
    let has_bad_rays = file.as_ref().is_some_and(|file| !file.faults.is_empty());
    let token = context.token.clone();
    let progress = Progress::new("Building", &token);
    let unmoved = (Follow::default(), &mut FollowSession::default());
    let accel = in_pool(|| command.tree.accel(&scene, &command.source, &command.build, unmoved, &token))?;
    let accel = Arc::new(accel);
    progress.set_label("Laying out");
    let rays =
        RayPlan { populations: command.rays.populations, camera, size: command.size, settings: command.settings, file };
    let (rows, outcome) = in_pool(|| measured(command, &accel, &rays, &token));
    drop(progress);
    let has_faults = note_faults(&accel);
    let outcome = outcome.map_err(|error| of_job(error, &command.source));
    command.output.deliver(&rows, layout_tables, |rows| Ok(layout_figure(rows)), &read, context.out, outcome)?;
    Ok(Finished { warned: has_faults || has_bad_rays || !scene.warnings.is_empty() })
}

/// The rows, as far as they were measured.
fn measured(
    command: &LayoutsCommand,
    accel: &Arc<Accel>,
    rays: &RayPlan,
    token: &CancelToken,
) -> (Vec<CostRow<LaidOut>>, Result<(), LabError>) {
    let rows_of = RowsOf {
        command: "layouts",
        source: &command.source,
        accel,
        camera: (&command.camera, &rays.camera),
        size: command.size,
        simd: command.settings.simd,
    };
    let mut rows = Vec::new();
    let outcome = layouts(accel, &command.plan, &rays.views(), token, &mut |laid| rows.push(rows_of.row(laid)));
    mark_front(rows.iter_mut().map(|row| &mut row.own));
    (rows, outcome)
}
