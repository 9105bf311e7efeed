//! `copies`: what the copies of a scene of two levels cost rays, or its forms, flat, in two levels and opened, or what other meshes would save.

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
use crate::lab::copy_advice::{CostOfChange, copy_advice};
use crate::lab::copy_costs::{CostInPart, copy_costs};
use crate::lab::copy_forms::{CostInForm, copy_forms, flat_form};
use crate::lab::cost_row::{CostRow, OwnFields};
use crate::lab::plot::{Figure, form_figure};
use crate::lab::population::{RayPlan, ViewRays};
use crate::lab::report_table::{ReportTable, advice_tables, copy_tables, form_tables};
use crate::render::RenderSettings;
use crate::scene::{Instancing, SceneSource};
use crate::view::CameraChoice;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::BuildSettings;

/// A measurement of `copies`.
#[derive(Debug, Clone, PartialEq)]
pub enum MeasuredCopies {
    /// The costs of copies and meshes.
    Costs,
    /// The forms of the scene, with the tree over the copies opened so far.
    Forms(Vec<f32>),
    /// Costs with other meshes.
    Advice,
}

/// Settings of `copies`.
#[derive(Debug, Clone)]
pub struct CopiesCommand {
    /// The model.
    pub source: SceneSource,
    /// Number of copies that have rows.
    pub most: usize,
    /// The measurement.
    pub measured: MeasuredCopies,
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
    drop(progress);
    let measuring = Measuring { command, accel: &accel, plan: &rays, read: &read };
    match &command.measured {
        MeasuredCopies::Costs => measuring.costs(context),
        MeasuredCopies::Forms(open) => measuring.forms(open, context),
        MeasuredCopies::Advice => measuring.advice(context),
    }?;
    Ok(finished)
}

/// Draws the plot of rows.
type FigureOf<T> = fn(&[CostRow<T>]) -> Figure;

/// Scene, rays and settings of all measurements.
struct Measuring<'a> {
    command: &'a CopiesCommand,
    accel: &'a Arc<Accel>,
    plan: &'a RayPlan,
    read: &'a Protected,
}

impl Measuring<'_> {
    /// The fields that all rows share.
    fn rows_of(&self) -> RowsOf<'_> {
        RowsOf {
            command: "copies",
            source: &self.command.source,
            accel: self.accel,
            camera: (&self.command.camera, &self.plan.camera),
            size: self.command.size,
            simd: self.command.settings.simd,
        }
    }

    /// Measures by `measure` and prints the rows by `tables`; those that were measured before an early end, too.
    fn print<T: OwnFields + Send>(
        &self,
        measure: impl FnOnce(&[ViewRays], &CancelToken, &mut dyn FnMut(T)) -> Result<(), LabError> + Send,
        tables: fn(&[CostRow<T>]) -> Vec<ReportTable>,
        figure: Option<FigureOf<T>>,
        context: &mut Context<'_>,
    ) -> Result<(), Failure> {
        let token = context.token.clone();
        let progress = Progress::new("Tracing", &token);
        let (rows_of, rays) = (self.rows_of(), self.plan.views());
        let mut rows = Vec::new();
        let outcome = in_pool(|| measure(&rays, &token, &mut |own| rows.push(rows_of.row(own))));
        drop(progress);
        let outcome = outcome.map_err(|error| of_job(error, &self.command.source));
        let figure = |rows: &_| figure.map(|figure| figure(rows)).ok_or_else(|| "--plot needs --open".to_owned());
        self.command.output.deliver(&rows, tables, figure, self.read, context.out, outcome)
    }

    fn costs(&self, context: &mut Context<'_>) -> Result<(), Failure> {
        let (accel, most) = (self.accel, self.command.most);
        let measure = |rays: &[ViewRays], token: &CancelToken, row: &mut dyn FnMut(CostInPart)| {
            copy_costs(accel, rays, most, token, row)
        };
        self.print(measure, copy_tables, None, context)
    }

    fn forms(&self, open: &[f32], context: &mut Context<'_>) -> Result<(), Failure> {
        let accel = self.accel;
        let flat = flat_tree(accel, &context.token).map_err(|error| of_job(error, &self.command.source))?;
        let measure = |rays: &[ViewRays], token: &CancelToken, row: &mut dyn FnMut(CostInForm)| {
            copy_forms(accel, flat.as_ref(), open, rays, token, row)
        };
        self.print(measure, form_tables, Some(form_figure), context)
    }

    fn advice(&self, context: &mut Context<'_>) -> Result<(), Failure> {
        let accel = self.accel;
        let measure = |rays: &[ViewRays], token: &CancelToken, row: &mut dyn FnMut(CostOfChange)| {
            copy_advice(accel, rays, token, row)
        };
        self.print(measure, advice_tables, None, context)
    }
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
