//! `bench`, `sweep`, `scaling` and `compare`: the measuring jobs over models, their rows to stdout and into files.

use std::path::PathBuf;

use super::context::RowProgress;
use super::{Context, Failure, Finished};
use crate::bvh::traverse::Traversal;
use crate::bvh::{ContainerKind, SimdLevel};
use crate::export::{check_target, write_bytes, write_file};
use crate::lab::plot::{PlotFormat, draw, panels};
use crate::lab::table::tables;
use crate::lab::{LabError, Measurement, Setup, Subject, SweepPlan, TraceView};
use crate::lab::{bench, compare, scaling, sweep};
use crate::scene::SceneSource;
use crate::view::CameraChoice;

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

/// What is measured.
#[derive(Debug, Clone)]
pub enum Job {
    /// These trees, in turn; with `true` every triangle as well.
    Bench(Vec<Setup>, bool),
    /// A range of thresholds.
    Sweep(SweepPlan),
    /// Each tree with 1 to so many threads.
    Scaling(Vec<Setup>, usize),
    /// Every builder with these containers and so many threads.
    Compare(Vec<ContainerKind>, usize),
}

/// A measuring command.
#[derive(Debug, Clone)]
pub struct MeasureJob {
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

impl Job {
    const fn command(&self) -> &'static str {
        match self {
            Self::Bench(..) => "bench",
            Self::Sweep(..) => "sweep",
            Self::Scaling(..) => "scaling",
            Self::Compare(..) => "compare",
        }
    }

    /// Settings that fit no scene at all.
    fn refusal(&self) -> Option<String> {
        match self {
            Self::Bench(setups, _) | Self::Scaling(setups, _) => setups.iter().find_map(|setup| setup.build.refusal(0)),
            Self::Sweep(_) | Self::Compare(..) => None,
        }
    }
}

/// Measures model after model. A model that cannot be used is reported, the others are measured all the same, and the
/// command fails at the end. Interrupted, it prints what it has; files are written only when all is done.
pub fn run(job: &MeasureJob, context: &mut Context<'_>) -> Result<Finished, Failure> {
    if let Some(text) = job.job.refusal() {
        return Err(Failure::Usage(text));
    }
    if let Some(path) = &job.output.plot {
        PlotFormat::of(path).map_err(Failure::Usage)?;
    }
    for path in [&job.output.csv, &job.output.plot].into_iter().flatten() {
        check_target(path)?;
    }
    let mut rows = Vec::new();
    let mut finished = Finished::default();
    let mut unusable = 0;
    for (index, source) in job.sources.iter().enumerate() {
        match measure_model(job, index, source, context, &mut rows) {
            Ok(warned) => finished.warned |= warned,
            Err(Failure::Failed(text)) if job.sources.len() > 1 => {
                eprintln!("bvhscope: {text}");
                unusable += 1;
            }
            Err(Failure::Interrupted) => {
                print_tables(job, &rows, context)?;
                return Err(Failure::Interrupted);
            }
            Err(failure) => return Err(failure),
        }
    }
    print_tables(job, &rows, context)?;
    if let Some(path) = &job.output.csv {
        write_file(path, |writer| write_csv(&rows, writer))?;
    }
    if let Some(path) = job.output.plot.as_ref().filter(|_| !rows.is_empty()) {
        let format = PlotFormat::of(path).map_err(Failure::Usage)?;
        let picture = panels(&rows).and_then(|panels| draw(&panels, format)).map_err(Failure::Failed)?;
        write_bytes(path, &picture)?;
    }
    if unusable > 0 {
        return Err(Failure::Failed(format!("{unusable} of {} models could not be measured", job.sources.len())));
    }
    Ok(finished)
}

/// All rows of one model; whether it was loaded with warnings.
fn measure_model(
    job: &MeasureJob,
    index: usize,
    source: &SceneSource,
    context: &mut Context<'_>,
    rows: &mut Vec<Measurement>,
) -> Result<bool, Failure> {
    let points: Vec<_> = match &job.job {
        // The shares are cut over all models, so that an empty one need not load anything.
        Job::Sweep(plan) => plan.points(job.sources.len()).into_iter().filter(|point| point.model == index).collect(),
        _ => Vec::new(),
    };
    if matches!(job.job, Job::Sweep(_)) && points.is_empty() {
        return Ok(false);
    }
    let scene = context.load(source)?;
    let view = TraceView {
        camera: job.camera.camera(&scene.bounds, scene.up),
        size: job.size,
        traversal: job.traversal,
        simd: job.simd,
        repeat: job.repeat,
    };
    let subject = Subject { model: source.to_string(), scene };
    let token = context.token.clone();
    let steps = match &job.job {
        Job::Sweep(_) => points.len(),
        Job::Scaling(setups, _) => setups.len(),
        Job::Bench(..) | Job::Compare(..) => 1,
    };
    let progress = RowProgress::new(&format!("Measuring {}", source.label()), steps);
    let mut broken = None;
    {
        let json = job.output.json;
        let out = &mut *context.out;
        let mut row = |measured: Measurement| {
            if json && broken.is_none() {
                broken = progress.suspend(|| print_json(&measured, out)).err();
            }
            rows.push(measured);
        };
        let row: &mut dyn FnMut(Measurement) = &mut row;
        match &job.job {
            Job::Bench(setups, no_bvh) => bench(&subject, setups, &view, *no_bvh, &token, row)?,
            Job::Compare(containers, threads) => compare(&subject, containers, *threads, &view, &token, row)?,
            Job::Scaling(setups, most) => {
                for setup in setups {
                    scaling(&subject, setup, *most, &view, &token, row)?;
                    progress.advance();
                }
            }
            Job::Sweep(plan) => {
                for point in points {
                    sweep(&subject, plan, point, &view, &token, row)?;
                    progress.advance();
                }
            }
        }
    }
    if let Some(failure) = broken {
        return Err(failure);
    }
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

fn print_tables(job: &MeasureJob, rows: &[Measurement], context: &mut Context<'_>) -> Result<(), Failure> {
    if job.output.json || rows.is_empty() {
        return Ok(());
    }
    for (index, table) in tables(job.job.command(), rows).iter().enumerate() {
        if index > 0 {
            writeln!(context.out)?;
        }
        write!(context.out, "{table}")?;
    }
    Ok(())
}

/// The rows with the JSON names as columns; stages and spreads are joined into one cell each.
pub fn write_csv(rows: &[Measurement], writer: &mut dyn std::io::Write) -> Result<(), String> {
    let failed = |error: csv::Error| format!("cannot be written: {error}");
    let mut csv = csv::Writer::from_writer(writer);
    let mut head: Option<Vec<String>> = None;
    for row in rows {
        let value = serde_json::to_value(row).map_err(|error| error.to_string())?;
        let Some(fields) = value.as_object() else { continue };
        if head.is_none() {
            // Fields that this command never has would be empty columns.
            let names: Vec<String> = COLUMNS
                .iter()
                .filter(|name| rows.iter().any(|row| column(row, name).is_some()))
                .map(|name| (*name).to_owned())
                .collect();
            csv.write_record(&names).map_err(failed)?;
            head = Some(names);
        }
        let names = head.as_deref().unwrap_or_default();
        csv.write_record(names.iter().map(|name| fields.get(name).map(cell).unwrap_or_default())).map_err(failed)?;
    }
    csv.flush().map_err(|error| format!("cannot be written: {error}"))
}

/// Columns in the order of DESIGN's JSON names, then how it was measured.
const COLUMNS: [&str; 31] = [
    "command",
    "model",
    "triangles",
    "builder",
    "preset",
    "container",
    "threshold",
    "epsilon",
    "threads",
    "build_ms",
    "build_ms_spread",
    "build_stages_ms",
    "trace_ms",
    "trace_ms_spread",
    "rays",
    "hits",
    "mrays_per_s",
    "tests_per_ray",
    "container_tests_per_ray",
    "primitive_tests_per_ray",
    "sah_cost",
    "epo",
    "nodes",
    "leaves",
    "max_depth",
    "bytes_per_triangle",
    "speedup",
    "trace_speedup",
    "traversal",
    "width_px",
    "height_px",
];

fn column(row: &Measurement, name: &str) -> Option<serde_json::Value> {
    serde_json::to_value(row).ok()?.as_object()?.get(name).cloned()
}

/// A JSON value as the text of a cell.
fn cell(value: &serde_json::Value) -> String {
    match value {
        serde_json::Value::String(text) => text.clone(),
        serde_json::Value::Array(items) => items.iter().map(cell).collect::<Vec<_>>().join(" "),
        serde_json::Value::Object(fields) => {
            fields.iter().map(|(name, value)| format!("{name}={}", cell(value))).collect::<Vec<_>>().join(" ")
        }
        serde_json::Value::Null => String::new(),
        other => other.to_string(),
    }
}
