//! Arguments common to all commands on models.

use std::path::PathBuf;

use super::args::{
    BuildArgs, Cli, CommandArgs, LoadArgs, MeasureArgs, OneTreeArgs, SettingFlags, StrictLoadArgs, TreeFileArgs,
};
use super::resolve;
use crate::render::RenderSettings;
use crate::render::rows::SIMD;
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::tree::ContainerKind;

/// The arguments about models, threads and the processor; nothing where it loads no model.
#[derive(Default)]
pub(super) struct Common<'a> {
    /// How models are loaded.
    pub load: Option<&'a LoadArgs>,
    /// Exit with code 3 where a model was loaded with warnings. The viewer shows them.
    pub strict: bool,
    /// The number of threads that are asked for.
    pub threads: Option<usize>,
    /// The SIMD level for builds and rays.
    pub simd: Option<SimdLevel>,
    /// The error message for an invalid combination of flags, if it is one.
    pub fault: Option<String>,
}

impl<'a> Common<'a> {
    /// That of a command line.
    pub fn of(cli: &'a Cli) -> Self {
        let boxes = [ContainerKind::Aabb];
        match &cli.command {
            None => {
                let viewer = &cli.viewer;
                let simd = simd(&viewer.picture);
                Self { load: Some(&viewer.load), simd, ..Self::of_tree(&viewer.build, Some(&viewer.tree)) }
            }
            Some(CommandArgs::Render(args)) => {
                Self { simd: simd(&args.picture), ..Self::of_tree(&args.build, Some(&args.tree)) }.loading(&args.load)
            }
            Some(CommandArgs::Merges(args)) => {
                Self { simd: simd(&args.picture), ..Self::of_tree(&args.build, None) }.loading(&args.load)
            }
            Some(CommandArgs::Info(args)) => {
                Self { simd: args.simd, ..Self::of_tree(&args.build, Some(&args.tree)) }.loading(&args.load)
            }
            Some(CommandArgs::Ray(args)) => {
                Self { simd: args.simd, ..Self::of_tree(&args.build, Some(&args.tree)) }.loading(&args.load)
            }
            Some(CommandArgs::Rays(args)) => {
                Self { simd: args.simd, ..Self::of_tree(&args.build, Some(&args.tree)) }.loading(&args.load)
            }
            Some(CommandArgs::Layouts(args)) => {
                Self { simd: args.simd, ..Self::of_tree(&args.build, Some(&args.tree)) }.loading(&args.load)
            }
            Some(CommandArgs::Copies(args)) => {
                Self { simd: args.simd, ..Self::of_tree(&args.build, None) }.loading(&args.load)
            }
            Some(CommandArgs::Tree(args)) => {
                Self { simd: args.simd, ..Self::of_tree(&args.build, Some(&args.tree)) }.loading(&args.load)
            }
            Some(CommandArgs::Bench(args)) => {
                Self::measured(&args.measure, &args.files.trees, Some((&args.tree, &ContainerKind::OF_PAPER)))
            }
            Some(CommandArgs::Scaling(args)) => Self::measured(&args.measure, &[], Some((&args.tree, &boxes))),
            Some(CommandArgs::Animate(args)) => Self::measured(&args.measure, &[], Some((&args.tree, &boxes))),
            Some(CommandArgs::Sweep(args)) => Self::measured(&args.measure, &args.files.trees, None),
            Some(CommandArgs::Compare(args)) => Self::measured(&args.measure, &args.files.trees, None),
            // The settings of `diff` were checked one by one.
            Some(CommandArgs::Diff(args)) => {
                Self { threads: args.trace.threads, simd: args.trace.simd, ..Self::default() }.loading(&args.load)
            }
            Some(CommandArgs::Plot(_)) => Self::default(),
        }
    }

    fn loading(self, load: &'a StrictLoadArgs) -> Self {
        Self { load: Some(&load.any), strict: load.strict, ..self }
    }

    /// That of a command on one tree.
    fn of_tree(build: &BuildArgs, file: Option<&TreeFileArgs>) -> Self {
        let given = &build.settings.0;
        let is_file = file.is_some_and(|file| file.tree.is_some());
        let fault = resolve::invalid_passes(given, &[given.settings().container])
            .or_else(|| is_file.then(|| resolve::invalid_passes_of_file(given)).flatten());
        Self { threads: build.threads, fault, ..Self::default() }
    }

    /// That of a measuring command: of trees that files hold, and of trees whose settings are given with the containers by default.
    fn measured(args: &'a MeasureArgs, files: &[PathBuf], built: Option<(&OneTreeArgs, &[ContainerKind])>) -> Self {
        let models = args.models.len();
        let of_one_model = (!files.is_empty() && models > 1)
            .then(|| format!("--tree: a tree is that of one model, and {models} are named; measure them one by one"));
        let passes = built.and_then(|(tree, default)| {
            resolve::invalid_passes(&tree.shape.0, tree.container.as_ref().map_or(default, |given| &given.0))
        });
        let fault = of_one_model.or(passes);
        Self { threads: args.trace.threads, simd: args.trace.simd, fault, ..Self::default() }.loading(&args.load)
    }
}

/// The SIMD level among the settings of a picture.
fn simd(picture: &SettingFlags<RenderSettings>) -> Option<SimdLevel> {
    picture.0.get(&SIMD).map(|_| picture.0.settings().simd)
}
