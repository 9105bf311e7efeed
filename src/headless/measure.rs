//! `bench`, `sweep`, `scaling` and `compare`: the measuring jobs over models, their rows to stdout and into files.

use std::path::PathBuf;

use super::context::Progress;
use super::{Context, Failure, Finished};
use crate::export::{check_target, write_bytes, write_file};
use crate::lab::plot::{PlotFormat, draw, panels};
use crate::lab::report_table::{summary, tables};
use crate::lab::rows::write_csv;
use crate::lab::{Job, LabError, Measurement, Subject, TraceView};
use crate::scene::SceneSource;
use crate::view::CameraChoice;
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::tree::traverse::Traversal;

/// Where the rows go.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Output {
    /// One JSON object a line instead of the table.
    pub json: bool,
    /// Also into this CSV file.
    pub csv: Option<PathBuf>,
    /// Also drawn into this picture.
    pub plot: Option<PathBuf>,
}

/// A measuring command.
#[derive(Debug, Clone)]
pub struct MeasureCommand {
    /// The models.
    pub sources: Vec<SceneSource>,
    /// What is measured.
    pub job: Job,
    /// The camera of each model.
    pub camera: CameraChoice,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// How rays visit nodes.
    pub traversal: Traversal,
    /// Vector instructions that rays are traced with.
    pub simd: SimdLevel,
    /// Repetitions.
    pub repeat: usize,
    /// Where the rows go.
    pub output: Output,
}

/// Measures model after model. A model that cannot be used is reported, the others are measured all the same, and the
/// command fails at the end. Whatever ends it early, it prints and writes the rows that it has.
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
    let mut ended = None;
    for (index, source) in command.sources.iter().enumerate() {
        match measure_model(command, index, source, context, &mut rows) {
            Ok(warned) => finished.warned |= warned,
            Err(Failure::Failed(text)) if command.sources.len() > 1 => {
                eprintln!("bvhscope: {text}");
                unusable += 1;
            }
            Err(failure) => {
                ended = Some(failure);
                break;
            }
        }
    }
    // Whatever keeps the rows from one of the two, the other has them.
    let written = write_files(&command.output, &rows, ended.is_some());
    print_tables(command, &rows, context)?;
    written?;
    if let Some(failure) = ended {
        return Err(failure);
    }
    if unusable > 0 {
        return Err(Failure::Failed(format!("{unusable} of {} models could not be measured", command.sources.len())));
    }
    Ok(finished)
}

/// The CSV file and the plot; after an early end only where there is anything to keep.
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

/// All rows of one model; whether it was loaded with warnings.
fn measure_model(
    command: &MeasureCommand,
    index: usize,
    source: &SceneSource,
    context: &mut Context<'_>,
    rows: &mut Vec<Measurement>,
) -> Result<bool, Failure> {
    // The shares of a sweep are cut over all models, so that an empty one need not load anything.
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
    let mut broken = None;
    let out = &mut *context.out;
    let mut row = |measured: Measurement| {
        // The rows of one model do not wait for the others: as lines for programs, as a note for people.
        if !command.output.json {
            progress.suspend(|| note(&measured));
        } else if broken.is_none() {
            broken = progress.suspend(|| print_json(&measured, out)).err();
            if broken.is_some() {
                // Nobody reads any more.
                token.cancel();
            }
        }
        rows.push(measured);
    };
    let outcome = command.job.run(&subject, (index, command.sources.len()), &view, &token, &mut row);
    if let Some(failure) = broken {
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

/// One line, out at once, so that a reader need not wait for the next.
fn print_json(row: &Measurement, out: &mut (dyn std::io::Write + Send)) -> Result<(), Failure> {
    let text = serde_json::to_string(row).map_err(|error| Failure::Failed(error.to_string()))?;
    writeln!(out, "{text}")?;
    out.flush()?;
    Ok(())
}

/// One line about a finished row on stderr: the table comes when all rows are there.
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
