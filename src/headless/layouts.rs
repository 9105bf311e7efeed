//! `layouts`: wide trees of many layouts over one binary tree, and what rays cost in each.

use std::sync::Arc;

use super::context::{Context, Failure, Finished, camera_of, ignore_missing_reader, in_pool, needs_triangles};
use super::measure::of_job;
use super::moments::MomentChoice;
use super::output::Output;
use super::progress::Progress;
use super::ray_input::MeasuringRays;
use super::tree_origin::{TreeOrigin, note_faults};
use crate::accel::followed::FollowSession;
use crate::accel::{Accel, Follow};
use crate::camera::Camera;
use crate::catalog::settings::Stated;
use crate::export::Protected;
use crate::lab::layouts::{LayoutPlan, LayoutRow, layouts, mark_front};
use crate::lab::plot::layout_figure;
use crate::lab::population::{Population, RayPlan};
use crate::lab::report_table::layout_tables;
use crate::lab::rows::write_layouts_csv;
use crate::lab::{Conditions, LabError, ViewConditions};
use crate::render::RenderSettings;
use crate::scene::{Scene, SceneSource};
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
    let written = match &rows[..] {
        [] => Ok(()),
        rows => command.output.write_files(rows, write_layouts_csv, |rows| Ok(layout_figure(rows)), &read),
    };
    let printed = command.output.print(&rows, write_layouts_csv, layout_tables, context.out);
    written?;
    outcome.map_err(|error| of_job(error, &command.source))?;
    ignore_missing_reader(printed)?;
    Ok(Finished { warned: has_faults || has_bad_rays || !scene.warnings.is_empty() })
}

/// The rows, as far as they were measured.
fn measured(
    command: &LayoutsCommand,
    accel: &Arc<Accel>,
    rays: &RayPlan,
    token: &CancelToken,
) -> (Vec<LayoutRow>, Result<(), LabError>) {
    let scene = &accel.scene;
    let mut rows = Vec::new();
    let outcome = layouts(accel, &command.plan, &rays.views(), token, &mut |laid| {
        rows.push(LayoutRow {
            command: "layouts",
            model: command.source.to_string(),
            triangles: scene.triangle_count() as usize,
            builder: accel.builder_name().into_owned(),
            tree: accel.file.as_ref().map(|file| file.path.display().to_string()),
            settings: if accel.file.is_some() { Stated::default() } else { Stated::of(&accel.settings) },
            threads: rayon::current_num_threads(),
            width_px: command.size[0],
            height_px: command.size[1],
            conditions: conditions(command, scene, &rays.camera, laid.population),
            laid,
            warnings: scene.warnings.entries.iter().map(ToString::to_string).collect(),
        });
    });
    mark_front(rows.iter_mut().map(|row| &mut row.laid));
    (rows, outcome)
}

fn conditions(command: &LayoutsCommand, scene: &Scene, camera: &Camera, population: Population) -> Conditions {
    let has_camera = population.kind().is_some();
    let view = has_camera.then(|| ViewConditions::new(command.camera.place(scene), camera, scene.offset));
    Conditions::of_process(view, command.settings.simd)
}
