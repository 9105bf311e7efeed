//! The measuring commands.

use super::parts::{camera, cameras, moment, threads};
use crate::cli::args::{AnimateArgs, DiffArgs, MeasureArgs, OneTreeArgs, SweepArgs, TraceArgs, TreesFromFilesArgs};
use crate::headless::Output;
use crate::headless::diff::DiffCommand;
use crate::headless::measure::{MeasureCommand, TraceChoice};
use crate::lab::motion::AnimatePlan;
use crate::lab::report_table::TableFormat;
use crate::lab::{Job, Setup, SweepPlan};
use crate::scene::SceneSource;
use bvhscope_engine::follow::Policy;
use bvhscope_engine::settings::BuildSettings;
use bvhscope_engine::tree::ContainerKind;

/// One setup per container given on the command line, or per container in `containers` of which the builder makes trees.
pub fn setups(tree: &OneTreeArgs, measure: &MeasureArgs, containers: &[ContainerKind]) -> Vec<Setup> {
    let shape = &tree.shape.0;
    // Flags beside the preset make the settings differ from it, so its name is dropped.
    let preset = shape.only_preset();
    let settings = shape.settings();
    let build = |&container: &ContainerKind| {
        let builder = tree.builder.unwrap_or(settings.builder);
        BuildSettings { builder, ..settings }.for_container(container)
    };
    let builds: Vec<BuildSettings> = match &tree.container {
        Some(given) => given.0.iter().map(build).collect(),
        None => containers.iter().map(build).filter(|build| build.refusal(0).is_none()).collect(),
    };
    builds.into_iter().map(|build| Setup { build, preset, threads: threads(measure.trace.threads) }).collect()
}

/// Trees, policies and frames; without named policies those that take all of the trees.
pub fn animate(args: &AnimateArgs) -> (Vec<Setup>, AnimatePlan) {
    let setups = setups(&args.tree, &args.measure, &[ContainerKind::Aabb]);
    let mut policies = args.policy.0.clone();
    if policies.is_empty() {
        let applies = |policy: &Policy| setups.iter().all(|setup| policy.refusal(&setup.build, 0).is_none());
        policies.extend(Policy::ALL.into_iter().filter(applies));
    }
    (setups, AnimatePlan { policies, clip: args.clip.clone(), frames: args.frames })
}

pub fn sweep(args: &SweepArgs) -> SweepPlan {
    SweepPlan {
        ranges: args.ranges.0.clone(),
        containers: args.container.0.clone(),
        threads: threads(args.measure.trace.threads),
        shard: args.shard.unwrap_or((1, 1)),
    }
}

fn trace(args: &TraceArgs) -> TraceChoice {
    let TraceArgs { size, repeat, traversal, simd, epo_samples, .. } = *args;
    TraceChoice { size, traversal, simd: simd.unwrap_or_default(), repeat, epo_samples }
}

pub fn measure(job: Job, files: TreesFromFilesArgs, args: MeasureArgs) -> MeasureCommand {
    let sources = if args.models.is_empty() { vec![SceneSource::default_builtin()] } else { args.models };
    MeasureCommand {
        sources,
        job,
        trees: files.trees,
        labels: files.labels,
        moments: moment(files.moment),
        cameras: cameras(&args.cameras),
        trace: trace(&args.trace),
        rays: args.rays.unwrap_or_default(),
        output: Output { json: args.json, format: args.format, csv: args.csv, plot: args.plot },
    }
}

pub fn diff(args: DiffArgs) -> DiffCommand {
    DiffCommand {
        source: args.model.unwrap_or_else(SceneSource::default_builtin),
        moments: moment(args.moment),
        trees: [args.a, args.b],
        threads: threads(args.trace.threads),
        camera: camera(&args.camera),
        trace: trace(&args.trace),
        output: args.output,
        legend: args.legend,
        labels: args.labels,
        rays: args.rays.unwrap_or_default(),
        rows: Output { json: args.json, format: TableFormat::Text, csv: args.csv, plot: args.plot },
    }
}
