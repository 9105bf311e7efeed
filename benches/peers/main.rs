//! This engine beside Embree and obvhs, in one process and interleaved, on identical triangles and rays: `make peers`, or
//! `cargo run --release --no-default-features --features peers --bin peers -- [FLAGS]`.
//!
//! Measures build time by threads, SAH cost by one formula, bytes per triangle, and the rate of primary, ambient occlusion and
//! diffuse rays through every interface on one thread. Fails where the engines' hits disagree.

#![allow(clippy::pedantic, reason = "tests and measurements may be plainer than the libraries")]

mod embree;
mod engine;
mod measure;
mod obvhs_peer;
mod peer;
mod rays;
mod report;
mod scenes;

use std::path::PathBuf;
use std::process::ExitCode;

use bvhscope_engine::cancel::CancelToken;
use clap::Parser;
use mimalloc::MiMalloc;

use scenes::Subject;

// As in the program that people run.
#[global_allocator]
static ALLOCATOR: MiMalloc = MiMalloc;

/// Measures this engine beside its peers.
#[derive(Debug, Parser)]
#[command(name = "peers")]
struct Flags {
    /// Scenes: bunny, sponza, conference, car, buddha, dragon, san-miguel, terrain, a file, or builtin:NAME[:SIZE]
    #[arg(long, value_delimiter = ',', default_values_t = scenes::DEFAULT.map(str::to_owned))]
    scenes: Vec<String>,
    /// What is measured: build, tree, primary, ao, diffuse
    #[arg(long, value_delimiter = ',', default_values_t = measure::PARTS.map(str::to_owned))]
    parts: Vec<String>,
    /// Only engines and interfaces whose name contains one of these
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// Also Embree's high quality and obvhs's slow settings
    #[arg(long)]
    slow: bool,
    /// Measured rounds; medians are shown
    #[arg(long, default_value_t = 7)]
    repeat: usize,
    /// Numbers of threads of the builds
    #[arg(long, value_delimiter = ',', default_values_t = [1, 2])]
    threads: Vec<usize>,
    /// Width and height of the picture in pixels, a power of two
    #[arg(long, default_value_t = 1024)]
    size: u32,
    /// Folder of the models [default: the variable BVHSCOPE_MODELS, or ../shared/models]
    #[arg(long)]
    models: Option<PathBuf>,
    /// Print one JSON object a line instead of tables
    #[arg(long)]
    json: bool,
}

fn main() -> ExitCode {
    let flags = Flags::parse();
    let plan = measure::Plan {
        parts: flags.parts,
        only: flags.only,
        slow: flags.slow,
        repeat: flags.repeat.max(1),
        threads: flags.threads,
        size: flags.size.next_power_of_two(),
    };
    let folder = scenes::model_folder(flags.models);
    let mut agreed = true;
    for name in &flags.scenes {
        let subject = match Subject::load(name, &folder, &CancelToken::new()) {
            Ok(subject) => subject,
            Err(error) => {
                eprintln!("skipped {name}: {error}");
                agreed = false;
                continue;
            }
        };
        let result = measure::measure(&subject, &plan);
        if flags.json {
            report::print_json(&result)
        } else {
            report::print_tables(&result)
        }
        for disagreement in &result.disagreements {
            eprintln!("{}: {disagreement}", result.model);
            agreed = false;
        }
    }
    if agreed { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
