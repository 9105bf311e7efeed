//! `diff`: two trees of one model, in numbers, in the nodes that both have, and in a picture of where one tests more.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Serialize;

use super::context::{Context, Failure, Finished, ignore_missing_reader, in_pool};
use super::measure::{TraceChoice, of_job};
use super::moments::MomentChoice;
use super::output::{Output, json_line};
use super::picture::{check_written, note_written, write_png};
use super::progress::Progress;
use super::ray_input::MeasuringRays;
use super::tree_origin::note_faults;
use crate::accel::Accel;
use crate::budget::Budget;
use crate::catalog::numbers::NUMBERS;
use crate::catalog::numbers::rows::{LEAVES, NODES};
use crate::catalog::settings::short_name;
use crate::console::{note, printable_lines};
use crate::export::{Protected, check_target, wrong_ending};
use crate::lab::by_depth::Depth;
use crate::lab::diff::{TreeDifference, diff};
use crate::lab::plot::Figure;
use crate::lab::report_table::{depth_table, difference_table, few_entering, number};
use crate::lab::rows::write_csv;
use crate::lab::{Contender, Measurement, Setup, Subject};
use crate::legend;
use crate::provenance::command_line;
use crate::render::Background;
use crate::scene::{Scene, SceneSource};
use crate::text::{count, shown_path};
use crate::view::CameraChoice;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::{BuildSettings, Passes};

/// Bytes for each pixel: two heat maps, their difference and its picture.
const BYTES_A_PIXEL: u64 = 160;

/// One of the two trees.
#[derive(Debug, Clone, PartialEq)]
pub enum DiffTree {
    /// Built with these settings.
    Built(BuildSettings),
    /// Held by this file.
    File(PathBuf),
}

/// Settings of `diff`.
#[derive(Debug, Clone)]
pub struct DiffCommand {
    /// The model.
    pub source: SceneSource,
    /// The moment of a model that moves.
    pub moments: MomentChoice,
    /// A and B.
    pub trees: [DiffTree; 2],
    /// Number of threads for building and tracing.
    pub threads: usize,
    /// The camera.
    pub camera: CameraChoice,
    /// How the rays are traced.
    pub trace: TraceChoice,
    /// The PNG of the difference to write.
    pub output: Option<PathBuf>,
    /// Draw a legend below the picture; `None` where it is wide enough.
    pub legend: Option<bool>,
    /// Names of A and B; those without are named by their settings or files.
    pub labels: Vec<String>,
    /// Rays by which they are compared too.
    pub rays: MeasuringRays,
    /// How the numbers are printed, and files for both rows.
    pub rows: Output,
}

/// The JSON object that `--json` prints.
#[derive(Debug, Serialize)]
struct DiffSummary<'a> {
    command: &'static str,
    model: &'a str,
    triangles: usize,
    a: &'a Measurement,
    b: &'a Measurement,
    /// B minus A. Without costs where the containers differ, because these do not compare.
    difference: BTreeMap<String, f64>,
    /// Nodes of A that B has too, leaves included, and as a fraction of all nodes of A.
    survived_nodes: usize,
    survived_share: f64,
    /// The same of the interior nodes alone.
    survived_interior: usize,
    survived_interior_share: f64,
    /// Pixels with fewer tests in B, with as many, and with more.
    pixels_fewer: u64,
    pixels_same: u64,
    pixels_more: u64,
    /// The nodes of A and of B at each depth.
    by_depth: &'a [Vec<Depth>; 2],
    /// Differences at the two ends of the picture's colours.
    difference_range: [f32; 2],
    output: Option<&'a Path>,
    command_line: String,
}

/// Compares the trees, writes the picture and prints the numbers.
pub fn run(command: &DiffCommand, context: &mut Context<'_>) -> Result<Finished, Failure> {
    let mut read = Protected::default();
    let files = command.trees.iter().filter_map(|tree| if let DiffTree::File(path) = tree { Some(path) } else { None });
    read.add_read(command.source.path());
    read.add_read(files);
    read.add_read(command.rays.file.as_deref());
    read.add_standard_streams();
    check(command, &read)?;
    let scene = command.moments.first(context.load(&command.source)?, &context.token)?;
    // Again, as only now it is known what else was read: buffers, textures, material libraries.
    read.add_read(&scene.files_read);
    check_files(command, &read)?;
    let view = command.trace.view(&command.camera, &scene, command.rays.populations)?;
    let (trees, has_faults) = contenders(command, &scene, &context.token)?;
    let rays = command.rays.read_file(&scene, &context.token)?;
    let has_bad_rays = rays.as_ref().is_some_and(|rays| !rays.faults.is_empty());
    let warned = has_faults || has_bad_rays || !scene.warnings.is_empty();
    let load = context.load.clone();
    let subject =
        Subject { model: command.source.to_string(), scene, trees: Vec::new(), forms: Vec::new(), rays, load };
    let progress = Progress::new(&format!("Comparing trees of {}", command.source.label()), &context.token);
    let found = diff(&subject, &trees, &view, &context.token).map_err(|error| of_job(error, &command.source))?;
    drop(progress);
    for text in few_entering(&found.rows) {
        note(format_args!("bvhscope: {text}"));
    }
    if let Some(path) = &command.output {
        write_picture(path, command, &found, &read, &context.token)?;
    }
    command.rows.write_files(&found.rows, write_csv, Figure::of_rows, &read)?;
    if command.rows.prints_csv() {
        ignore_missing_reader(write_csv(&found.rows, context.out).map_err(std::io::Error::other))?;
    } else if command.rows.json {
        ignore_missing_reader(context.out.write_all(json_line(&summary(command, &subject, &found))?.as_bytes()))?;
    } else {
        let text = printable_lines(&text(&found));
        ignore_missing_reader(context.out.write_all(text.as_bytes()))?;
    }
    Ok(Finished { warned })
}

/// Checks what can be checked before the model is loaded.
fn check(command: &DiffCommand, read: &Protected) -> Result<(), Failure> {
    if let Some(path) = &command.output
        && !path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png"))
    {
        let text = "the file must end in .png: no other format is written here";
        return Err(Failure::Usage(wrong_ending(path, text)));
    }
    if command.labels.len() > command.trees.len() {
        return Err(Failure::Usage("--label: A and B take a label each, no more".to_owned()));
    }
    command.rows.check()?;
    check_files(command, read)?;
    for tree in &command.trees {
        if let DiffTree::Built(build) = tree
            && let Some(text) = build.refusal(0)
        {
            return Err(Failure::Usage(text));
        }
    }
    let [width, height] = command.trace.size.map(u64::from);
    Budget::of_process()
        .check(&format!("a picture of {width}x{height} pixels"), width * height * BYTES_A_PIXEL)
        .map_err(|error| Failure::Failed(error.to_string()))
}

/// Checks that all files can be written, are different files and none of those `read`.
fn check_files(command: &DiffCommand, read: &Protected) -> Result<(), Failure> {
    let mut protected = read.clone();
    if let Some(path) = &command.output {
        check_target(path, read)?;
        protected.add_output(path);
    }
    command.rows.check_files(&protected)
}

/// The two trees to measure, and `true` where a file holds one with faults.
fn contenders(
    command: &DiffCommand,
    scene: &Arc<Scene>,
    token: &CancelToken,
) -> Result<([Contender; 2], bool), Failure> {
    let mut has_faults = false;
    let mut contender = |tree: &DiffTree| -> Result<Contender, Failure> {
        Ok(match tree {
            &DiffTree::Built(build) => Setup { build, preset: None, threads: command.threads }.into(),
            DiffTree::File(path) => {
                let accel = Arc::new(in_pool(|| Accel::read(scene, path, Passes::NONE, token))?);
                has_faults |= note_faults(&accel);
                Contender::of_file(&accel, command.threads)
            }
        })
    };
    let [a, b] = &command.trees;
    let mut trees = [contender(a)?, contender(b)?];
    for (tree, label) in trees.iter_mut().zip(labels(command)) {
        tree.label = label;
    }
    Ok((trees, has_faults))
}

/// Names of A and B: those given, else the settings of one that is built; `None` for the name of its file.
fn labels(command: &DiffCommand) -> [Option<String>; 2] {
    let name = |tree: &DiffTree| match tree {
        DiffTree::Built(build) => short_name(build),
        DiffTree::File(path) => shown_path(path),
    };
    let names = command.trees.each_ref().map(name);
    let are_namesakes = names[0] == names[1];
    std::array::from_fn(|side| {
        let of_side = || match &command.trees[side] {
            _ if are_namesakes => Some(["A", "B"][side].to_owned()),
            DiffTree::Built(_) => Some(names[side].clone()),
            DiffTree::File(_) => None,
        };
        command.labels.get(side).cloned().or_else(of_side)
    })
}

/// Writes the picture of the difference with its legend.
fn write_picture(
    path: &Path,
    command: &DiffCommand,
    found: &TreeDifference,
    read: &Protected,
    token: &CancelToken,
) -> Result<(), Failure> {
    let mut rgba = found.map.rgba.to_vec();
    let [width, mut height] = command.trace.size;
    let key = legend::of_difference(found.map.limit);
    if legend::is_wanted(command.legend, width) {
        height = legend::append(&mut rgba, command.trace.size, std::slice::from_ref(&key), Background::White);
    }
    check_written(write_png(path, read, [width, height], &rgba, token), token)?;
    note_written(path, &format!("{width}×{height} pixels; {}", key.title()));
    Ok(())
}

fn summary<'a>(command: &'a DiffCommand, subject: &'a Subject, found: &'a TreeDifference) -> DiffSummary<'a> {
    let [a, b] = &found.rows;
    let comparable = NUMBERS.iter().filter(|number| {
        number.compared.is_some_and(|compared| a.container == b.container || compared.across_containers)
    });
    let [fewer, same, more] = found.map.pixels;
    let [nodes, interior] = shares(found);
    let mut difference: BTreeMap<String, f64> =
        comparable.map(|number| (number.key.to_owned(), short(b.number(number) - a.number(number)))).collect();
    for (of_a, of_b) in a.populations.iter().zip(&b.populations) {
        if let (Some(before), Some(now)) = (of_a.tests_per_entering_ray, of_b.tests_per_entering_ray) {
            difference.insert(format!("{}_tests_per_entering_ray", of_a.population.name()), now - before);
        }
    }
    DiffSummary {
        command: "diff",
        model: &subject.model,
        triangles: a.triangles,
        a,
        b,
        difference,
        survived_nodes: found.survival.nodes,
        survived_share: nodes,
        survived_interior: found.survival.interior,
        survived_interior_share: interior,
        pixels_fewer: fewer,
        pixels_same: same,
        pixels_more: more,
        by_depth: &found.by_depth,
        difference_range: [-found.map.limit, found.map.limit],
        output: command.output.as_deref(),
        command_line: command_line(),
    }
}

/// A difference with the digits of the numbers that it was made of, most of which are f32.
fn short(difference: f64) -> f64 {
    if difference.fract() == 0.0 { difference } else { (difference as f32).to_string().parse().unwrap_or(difference) }
}

/// The survivors as fractions of all nodes and of all interior nodes of A; 1 where A has none.
fn shares(found: &TreeDifference) -> [f64; 2] {
    let [nodes, leaves] = [NODES, LEAVES].map(|number| found.rows[0].values.count(number));
    [(found.survival.nodes, nodes), (found.survival.interior, nodes - leaves)]
        .map(|(count, all)| if all == 0 { 1.0 } else { count as f64 / all as f64 })
}

/// The table, and what became of nodes and pixels.
fn text(found: &TreeDifference) -> String {
    let [nodes, interior] = shares(found).map(|share| number(share * 100.0));
    let [fewer, same, more] = found.map.pixels;
    let all = (fewer + same + more).max(1) as f64;
    let percent = |pixels: u64| number(pixels as f64 / all * 100.0);
    let sums = found.rows.each_ref().map(|row| row.populations.iter().collect::<Vec<_>>());
    let [a, b] = &found.by_depth;
    let depths = depth_table(&[("A", a, &sums[0]), ("B", b, &sums[1])]);
    format!(
        "{}Nodes of A that B has too, with the same triangles below: {} of {} ({nodes} %); of the interior nodes {interior} %.\n\
         Pixels: B takes fewer tests in {} %, as many in {} %, more in {} %.\n\n{depths}",
        difference_table(&found.rows),
        count(found.survival.nodes as u64),
        count(found.rows[0].values.count(NODES)),
        percent(fewer),
        percent(same),
        percent(more),
    )
}
