//! This engine beside Embree, obvhs and tinybvh, in one process and interleaved, on identical triangles and rays: `make peers`, or
//! `cargo run --release --no-default-features --features peers --bin peers -- [FLAGS]`.
//!
//! Measures by threads the time until the binary tree is there and until rays can be traced at full speed, SAH cost, end-point
//! overlap and tests per ray by one formula, bytes per triangle, the rate of primary, ambient occlusion and diffuse rays through
//! every interface, the time from triangles to a picture, and updates of trees whose triangles have moved. Fails where the engines'
//! hits disagree.

#![allow(clippy::pedantic, reason = "tests and measurements may be plainer than the libraries")]

mod copies;
mod dump;
mod embree;
mod embree_library;
mod embree_motion;
mod embree_queries;
mod embree_rays;
mod embree_tree;
mod engine;
mod foreign;
mod measure;
mod motion;
mod newest;
mod obvhs_peer;
mod obvhs_tree;
mod packed;
mod paper;
mod peer;
mod rays;
mod record;
mod report;
mod scenes;
mod tinybvh_library;
mod tinybvh_peer;
mod two_levels;

use std::path::PathBuf;
use std::process::ExitCode;

use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::kernel::SimdLevel;
use clap::Parser;
use mimalloc::MiMalloc;
use serde_json::Value;

use scenes::Subject;

// As in the program that people run.
#[global_allocator]
static ALLOCATOR: MiMalloc = MiMalloc;

/// Measures this engine beside its peers.
#[derive(Debug, Parser)]
#[command(name = "peers")]
struct Flags {
    /// Scenes: bunny, sponza, conference, car, buddha, dragon, san-miguel, san-miguel-wall, terrain, a file, or
    /// builtin:NAME[:SIZE]
    #[arg(long, value_delimiter = ',', default_values_t = scenes::DEFAULT.map(str::to_owned))]
    scenes: Vec<String>,
    /// Parts to measure: build, tree, primary, ao, diffuse, all-hits, closest-point, picture (where builds and rays are), update (of
    /// moved triangles)
    #[arg(long, value_delimiter = ',', default_values_t = measure::PARTS.map(str::to_owned))]
    parts: Vec<String>,
    /// Only engines and interfaces whose name contains one of these
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// Also the preset Finest, which takes minutes, Embree's high quality and obvhs's slow settings
    #[arg(long)]
    slow: bool,
    /// Scenes of copies in two levels, this engine's and Embree's, beside the flat scene: parts build, tree, primary, ao, diffuse, all-hits
    #[arg(long)]
    copies: bool,
    /// Measured rounds; medians are shown
    #[arg(long, default_value_t = 7)]
    repeat: usize,
    /// The paper's tables 1 and 2, after the scenes
    #[arg(long)]
    paper: bool,
    /// Numbers of threads of builds and rays, 0 for all
    #[arg(long, value_delimiter = ',', default_values_t = [1, 0])]
    threads: Vec<usize>,
    /// Width and height of the picture in pixels, a power of two
    #[arg(long, default_value_t = 1024)]
    size: u32,
    /// Folder of the models [default: the variable BVHSCOPE_MODELS, or ../shared/models]
    #[arg(long)]
    models: Option<PathBuf>,
    /// Widest vector instructions of this engine's builds and rays and of Embree: sse2, avx2 or avx512
    #[arg(long, value_parser = simd)]
    simd: Option<SimdLevel>,
    /// Write each tree into this folder instead of measuring, for `bvhscope MODEL --tree FILE`; Embree's come from the same
    /// builders through rtcBuildBVH, because the trees inside its scenes cannot be read
    #[arg(long, value_name = "FOLDER")]
    dump: Option<PathBuf>,
    /// Print one JSON object a line instead of tables
    #[arg(long)]
    json: bool,
    /// Add the rows to this file too, with machine, date and commit, in place of an older run with the same flags;
    /// the oldest runs leave where the file would have more than 300 kB
    #[arg(long)]
    append: Option<PathBuf>,
}

fn simd(name: &str) -> Result<SimdLevel, String> {
    let level = SimdLevel::ALL.into_iter().find(|level| level.name() == name && level.is_available());
    level.ok_or_else(|| "this machine has no such instructions".to_owned())
}

fn main() -> ExitCode {
    let flags = Flags::parse();
    SimdLevel::limit_builds(flags.simd);
    let mut threads: Vec<usize> = flags.threads.iter().map(|&threads| bvhscope::threads::count(threads)).collect();
    threads.dedup();
    let plan = measure::Plan {
        parts: flags.parts,
        only: flags.only,
        slow: flags.slow,
        repeat: flags.repeat.max(1),
        threads,
        size: flags.size.next_power_of_two(),
    };
    let models = scenes::model_folder(flags.models);
    let provenance = record::Provenance::of_this_run();
    let keep = |rows: Vec<Value>| {
        let rows: Vec<Value> = rows.into_iter().map(|row| provenance.with(row)).collect();
        if flags.json {
            rows.iter().for_each(|row| println!("{row}"));
        }
        match &flags.append {
            Some(path) => record::append(&rows, path).inspect_err(|error| eprintln!("{error:#}")).is_ok(),
            None => true,
        }
    };
    let mut agreed = true;
    // "--scenes=" names none.
    for name in flags.scenes.iter().filter(|name| !name.is_empty()) {
        let subject = match Subject::load(name, &models, &CancelToken::new()) {
            Ok(subject) => subject,
            Err(error) => {
                eprintln!("skipped {name}: {error}");
                agreed = false;
                continue;
            }
        };
        if let Some(folder) = &flags.dump {
            match dump::dump(&subject, &plan, folder) {
                Ok(files) => files.iter().for_each(|file| println!("{}", file.display())),
                Err(error) => {
                    eprintln!("{name}: {error:#}");
                    agreed = false;
                }
            }
            continue;
        }
        let result = if flags.copies {
            match scenes::load_copies(name, &models, &CancelToken::new()) {
                Ok(Some(copies)) => copies::measure(&subject, &copies, &plan),
                Ok(None) | Err(_) => {
                    eprintln!("skipped {name}: it has no copies");
                    agreed = false;
                    continue;
                }
            }
        } else {
            measure::measure(&subject, &plan)
        };
        if !flags.json {
            report::print_tables(&result);
        }
        agreed &= keep(report::rows(&result));
        for disagreement in &result.disagreements {
            eprintln!("{}: {disagreement}", result.model);
            agreed = false;
        }
    }
    if flags.paper {
        match paper::rows(&models, plan.repeat) {
            Ok(rows) => agreed &= keep(rows),
            Err(error) => {
                eprintln!("the paper's tables: {error:#}");
                agreed = false;
            }
        }
    }
    if let Some(path) = &flags.append {
        agreed &= record::keep_newest(path).inspect_err(|error| eprintln!("{error:#}")).is_ok();
    }
    if agreed { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
