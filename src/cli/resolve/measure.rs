//! The measuring commands.

use std::path::PathBuf;

use super::parts::{build_settings, camera, threads};
use crate::cli::args::{DiffArgs, MeasureArgs, OneTreeArgs, ShapeArgs, SweepArgs};
use crate::headless::diff::DiffCommand;
use crate::headless::measure::{MeasureCommand, Output};
use crate::lab::{Job, Setup, SweepPlan};
use crate::scene::SceneSource;
use crate::view::NamedView;
use bvhscope_engine::tree::ContainerKind;

/// One setup per container given on the command line, or per default container in `containers`.
pub fn setups(tree: &OneTreeArgs, measure: &MeasureArgs, containers: &[ContainerKind]) -> Vec<Setup> {
    let containers = tree.container.as_ref().map_or(containers, |given| &given.0);
    // Flags beside the preset make the settings differ from it, so its name is dropped.
    let ShapeArgs { threshold, epsilon, preset, optimize, rounds, curve } = &tree.shape;
    let is_modified =
        threshold.is_some() || epsilon.is_some() || optimize.is_some() || rounds.is_some() || curve.is_some();
    let preset = preset.filter(|_| !is_modified);
    let setup = |&container| Setup {
        build: build_settings(tree.builder, container, &tree.shape),
        preset,
        threads: threads(measure.threads),
    };
    containers.iter().map(setup).collect()
}

pub fn sweep(args: &SweepArgs) -> SweepPlan {
    SweepPlan {
        thresholds: args.threshold.0.clone(),
        epsilons: args.epsilon.0.clone(),
        containers: args.container.0.clone(),
        threads: threads(args.measure.threads),
        shard: args.shard.unwrap_or((1, 1)),
    }
}

pub fn measure(job: Job, trees: Vec<PathBuf>, args: MeasureArgs) -> MeasureCommand {
    let sources = if args.models.is_empty() { vec![SceneSource::default_builtin()] } else { args.models };
    MeasureCommand {
        sources,
        job,
        trees,
        // The paper's scenes are looked at from outside.
        camera: camera(&args.camera, NamedView::Outside),
        size: args.size,
        traversal: args.traversal,
        simd: args.simd.unwrap_or_default(),
        repeat: args.repeat,
        populations: args.rays.unwrap_or_default(),
        output: Output { json: args.json, csv: args.csv, plot: args.plot },
    }
}

pub fn diff(args: DiffArgs) -> DiffCommand {
    DiffCommand {
        source: args.model.unwrap_or_else(SceneSource::default_builtin),
        trees: [args.a, args.b],
        threads: threads(args.threads),
        // As the other measuring commands.
        camera: camera(&args.camera, NamedView::Outside),
        size: args.size,
        traversal: args.traversal,
        simd: args.simd.unwrap_or_default(),
        repeat: args.repeat,
        output: args.output,
        json: args.json,
    }
}
