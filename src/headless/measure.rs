//! `bench`, `sweep`, `scaling` and `compare`: run a measuring job over models, and write its rows to stdout and files.

use std::path::PathBuf;

use super::context::Progress;
use super::context::{Context, Failure, Finished};
use crate::export::{check_target, write_bytes, write_file};
use crate::lab::plot::{PlotFormat, draw, panels};
use crate::lab::report_table::{summary, tables};
use crate::lab::rows::write_csv;
use crate::lab::{Job, LabError, Measurement, Subject, TraceView};
use crate::scene::SceneSource;
use crate::view::CameraChoice;
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::tree::traverse::Traversal;

/// Output options of a measuring command.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Output {
    /// Print JSON lines instead of tables.
    pub json: bool,
    /// CSV file to write as well.
    pub csv: Option<PathBuf>,
    /// Plot to draw as well.
    pub plot: Option<PathBuf>,
}

/// Settings of a measuring command.
#[derive(Debug, Clone)]
pub struct MeasureCommand {
    /// The models.
    pub sources: Vec<SceneSource>,
    /// The measuring job.
    pub job: Job,
    /// Camera for each model.
    pub camera: CameraChoice,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Traversal order.
    pub traversal: Traversal,
    /// SIMD level for tracing.
    pub simd: SimdLevel,
    /// Number of repetitions.
    pub repeat: usize,
    /// Output options.
    pub output: Output,
}

/// Measures one model after another. With several models, one that cannot be used is reported and skipped, and the command fails
/// at the end. Rows measured before an early end are still printed and written.
pub fn run(command: &MeasureCommand, context: &mut Context<'_>) -> Result<Finished, Failure> {
    if let Some(text) = command.job.refusal() {
        return Err(Failure::Usage(text));
    }
    if let Some(path) = &command.output.plot {
        PlotFormat::of(path).map_err(Failure::Usage)?;
    }
    for path in [&command.output.csv, &command.output.plot].into_iter().flatten() {
        check_target(path)?;
    }
    let mut rows = Vec::new();
    let mut finished = Finished::default();
    let mut unusable = 0;
    let mut early_end = None;
    for (index, source) in command.sources.iter().enumerate() {
        match measure_model(command, index, source, context, &mut rows) {
            Ok(warned) => finished.warned |= warned,
            Err(Failure::Failed(text)) if command.sources.len() > 1 => {
                eprintln!("bvhscope: {text}");
                unusable += 1;
            }
            Err(failure) => {
                early_end = Some(failure);
                break;
            }
        }
    }
    // Both outputs are attempted even if one fails.
    let written = write_files(&command.output, &rows, early_end.is_some());
    print_tables(command, &rows, context)?;
    written?;
    if let Some(failure) = early_end {
        return Err(failure);
    }
    if unusable > 0 {
        return Err(Failure::Failed(format!("{unusable} of {} models could not be measured", command.sources.len())));
    }
    Ok(finished)
}

/// Writes the CSV file and the plot; after an early end only if there are rows.
fn write_files(output: &Output, rows: &[Measurement], ended_early: bool) -> Result<(), Failure> {
    if let Some(path) = output.csv.as_ref().filter(|_| !(ended_early && rows.is_empty())) {
        write_file(path, |writer| write_csv(rows, writer))?;
    }
    if let Some(path) = output.plot.as_ref().filter(|_| !rows.is_empty()) {
        let format = PlotFormat::of(path).map_err(Failure::Usage)?;
        let picture = panels(rows).and_then(|panels| draw(&panels, format)).map_err(Failure::Failed)?;
        write_bytes(path, &picture)?;
    }
    Ok(())
}

/// Appends all rows of one model; returns whether it was loaded with warnings.
fn measure_model(
    command: &MeasureCommand,
    index: usize,
    source: &SceneSource,
    context: &mut Context<'_>,
    rows: &mut Vec<Measurement>,
) -> Result<bool, Failure> {
    // A shard of a sweep may contain no point of this model, which then need not be loaded.
    if !command.job.concerns(index, command.sources.len()) {
        return Ok(false);
    }
    let scene = context.load(source)?;
    let view = TraceView {
        camera: command.camera.camera(&scene.bounds, scene.up),
        size: command.size,
        traversal: command.traversal,
        simd: command.simd,
        repeat: command.repeat,
    };
    let subject = Subject { model: source.to_string(), scene };
    let token = context.token.clone();
    let progress = Progress::new(&format!("Measuring {}", source.label()), &token);
    let mut output_failure = None;
    let out = &mut *context.out;
    let mut row = |measured: Measurement| {
        // Rows are reported as they come: as JSON lines, or as notes on stderr before the table.
        if !command.output.json {
            progress.suspend(|| note(&measured));
        } else if output_failure.is_none() {
            output_failure = progress.suspend(|| print_json(&measured, out)).err();
            if output_failure.is_some() {
                // The output can no longer be written.
                token.cancel();
            }
        }
        rows.push(measured);
    };
    let outcome = command.job.run(&subject, (index, command.sources.len()), &view, &token, &mut row);
    if let Some(failure) = output_failure {
        return Err(failure);
    }
    outcome?;
    Ok(!subject.scene.warnings.is_empty())
}

impl From<LabError> for Failure {
    fn from(error: LabError) -> Self {
        match error {
            LabError::Cancelled(_) => Self::Interrupted,
            LabError::Refused(text) => Self::Failed(text),
        }
    }
}

/// Prints a row as one JSON line and flushes it.
fn print_json(row: &Measurement, out: &mut (dyn std::io::Write + Send)) -> Result<(), Failure> {
    let text = serde_json::to_string(row).map_err(|error| Failure::Failed(error.to_string()))?;
    writeln!(out, "{text}")?;
    out.flush()?;
    Ok(())
}

/// Prints a summary of a row on stderr; the table follows when all rows are measured.
fn note(row: &Measurement) {
    eprintln!("bvhscope: {}", summary(row));
}

fn print_tables(command: &MeasureCommand, rows: &[Measurement], context: &mut Context<'_>) -> Result<(), Failure> {
    if command.output.json || rows.is_empty() {
        return Ok(());
    }
    for (index, table) in tables(command.job.command(), rows).iter().enumerate() {
        if index > 0 {
            writeln!(context.out)?;
        }
        write!(context.out, "{table}")?;
    }
    Ok(())
}
