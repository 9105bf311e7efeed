//! The command line: parses flags into resolved settings, runs the command and sets the exit code.
//!
//! The only module that knows flags; independent of how a command works. Start at [`main`].

mod args;
mod common;
#[cfg(test)]
mod copied_lines;
mod named;
mod resolve;
mod signals;
mod suggest;
mod tree_settings;
mod usage;
mod values;

use std::ffi::OsStr;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{CommandFactory as _, Parser as _};

use crate::budget::Budget;
use crate::console::{self, Output, note};
use crate::headless::plot::PlotCommand;
use crate::headless::{Context, Failure, Finished, ignore_missing_reader};
use crate::lab::Job;
use crate::scene::LoadOptions;
use crate::text::without_middle;
use crate::threads::start_global_pool;
use args::{Cli, CommandArgs, MeasureArgs, TreesFromFilesArgs};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::tree::ContainerKind;
use common::Common;

/// Runs the program with its command line arguments and returns the exit code: 0 done, 1 failed, 2 wrong usage, 3 done
/// with warnings under `--strict`, 130 interrupted.
pub fn main() -> ExitCode {
    // First of all: until then a signal would kill the process.
    let token = signals::install();
    let code = run(token);
    console::finish();
    ExitCode::from(code)
}

fn run(token: CancelToken) -> u8 {
    let parsed = match std::env::args_os().nth(1).and_then(|first| suggest(&first)) {
        Some(text) => Err(usage::error(Cli::command(), ErrorKind::InvalidSubcommand, &text)),
        None => Cli::try_parse(),
    };
    let cli = match parsed {
        Ok(cli) => cli,
        Err(error) => return usage::print(error),
    };
    console::start_log();
    let Common { load, strict, threads, simd, fault } = Common::of(&cli);
    if let Some(limit) = load.and_then(|load| load.memory_limit) {
        Budget::set_limit(limit);
    }
    SimdLevel::limit_builds(simd);
    if let Some(text) = fault {
        return finish(Err(Failure::Usage(text)), strict);
    }
    let load = load.map_or_else(LoadOptions::default, resolve::load);
    let result = match cli.command {
        None => run_viewer(cli.viewer, &token),
        // A panic is a bug in bvhscope; it ends with an exit code and a message.
        Some(command) => {
            catch_unwind(AssertUnwindSafe(|| run_command(command, load, threads, token))).unwrap_or_else(|_| {
                Err(Failure::Failed(
                    "this is a mistake in bvhscope; please report it with the message above".to_owned(),
                ))
            })
        }
    };
    finish(result, strict)
}

/// The whole command line as clap describes it, for man pages and shell completions.
pub fn command() -> clap::Command {
    Cli::command()
}

/// The command that the arguments name, whose usage is shown with errors; the program itself where they name none.
fn given_command() -> clap::Command {
    let mut program = Cli::command();
    // Only then do commands know the name of the program.
    program.build();
    let named = program.find_subcommand(usage::given_name()).cloned();
    named.unwrap_or(program)
}

/// The error message for a first argument that resembles a command.
fn suggest(first: &OsStr) -> Option<String> {
    let program = Cli::command();
    suggest::suggest(first, program.get_subcommands().map(clap::Command::get_name).chain(["help"]))
}

/// Prints the outcome and returns its exit code.
fn finish(result: Result<Finished, Failure>, strict: bool) -> u8 {
    match result {
        Ok(Finished { warned: true }) if strict => {
            note("bvhscope: done, with warnings (--strict)");
            3
        }
        Ok(_) => 0,
        Err(Failure::Usage(text)) => usage::print(usage::error(given_command(), ErrorKind::ValueValidation, &text)),
        Err(failure @ Failure::Interrupted) => {
            note(format_args!("bvhscope: {failure}"));
            signals::INTERRUPTED
        }
        Err(failure @ Failure::Failed(_)) => {
            note(format_args!("bvhscope: {}", without_middle(&failure.to_string(), usage::KEPT_OF_MESSAGE)));
            1
        }
    }
}

fn run_command(
    command: CommandArgs,
    load: LoadOptions,
    requested: Option<usize>,
    token: CancelToken,
) -> Result<Finished, Failure> {
    let mut out = Output;
    let threads = usable_threads(requested);
    let mut context = Context { token: token.clone(), out: &mut out, load };
    // A plot is drawn without.
    let is_parallel = !matches!(command, CommandArgs::Plot(_));
    if let Some(text) = is_parallel.then(|| start_global_pool("bvhscope", threads)).flatten() {
        note(format_args!("bvhscope: {text}"));
    }
    let result = match command {
        CommandArgs::Render(args) => {
            resolve::render(args).and_then(|command| crate::headless::render::run(&command, &mut context))
        }
        CommandArgs::Diff(args) => crate::headless::diff::run(&resolve::diff(args), &mut context),
        CommandArgs::Merges(args) => crate::headless::merges::run(&resolve::merges(args), &mut context),
        CommandArgs::Info(args) => crate::headless::info::run(&resolve::info(args), &mut context),
        CommandArgs::Tree(args) => crate::headless::tree::run(&resolve::tree(args), &mut context),
        CommandArgs::Ray(args) => {
            resolve::ray(args).and_then(|command| crate::headless::ray::run(&command, &mut context))
        }
        CommandArgs::Layouts(args) => crate::headless::layouts::run(&resolve::layouts(args), &mut context),
        CommandArgs::Copies(args) => crate::headless::copies::run(&resolve::copies(args), &mut context),
        CommandArgs::Rays(args) => crate::headless::rays::run(&resolve::rays(args)?, &mut context),
        CommandArgs::Plot(args) => {
            let command = PlotCommand { files: args.files, output: args.output };
            crate::headless::plot::run(&command, &mut context)
        }
        CommandArgs::Bench(args) => {
            let setups = resolve::setups(&args.tree, &args.measure, &ContainerKind::OF_PAPER);
            measure(Job::Bench { setups, no_bvh: args.no_bvh }, args.files, args.measure, &mut context)
        }
        CommandArgs::Scaling(args) => {
            let setups = resolve::setups(&args.tree, &args.measure, &[ContainerKind::Aabb]);
            let job = Job::Scaling { setups, max_threads: threads, predict: args.predict };
            measure(job, TreesFromFilesArgs::default(), args.measure, &mut context)
        }
        CommandArgs::Animate(args) => {
            let (setups, plan) = resolve::animate(&args);
            measure(Job::Animate { setups, plan }, TreesFromFilesArgs::default(), args.measure, &mut context)
        }
        CommandArgs::Sweep(args) => measure(Job::Sweep(resolve::sweep(&args)), args.files, args.measure, &mut context),
        CommandArgs::Compare(args) => {
            let job = Job::Compare { containers: args.container.0, slow: args.slow, threads };
            measure(job, args.files, args.measure, &mut context)
        }
    };
    // Also after a failure: rows that were measured are printed.
    let printed = ignore_missing_reader(out.finish());
    let finished = result?;
    if printed.is_err() {
        token.check()?;
    }
    printed?;
    Ok(finished)
}

/// The number of threads to work with; reports where more were asked for.
fn usable_threads(requested: Option<usize>) -> usize {
    let threads = resolve::threads(requested);
    if let Some(requested) = requested.filter(|&requested| requested > threads) {
        note(format_args!(
            "bvhscope: --threads {requested}: this process may use {threads} at once; working with {threads}"
        ));
    }
    threads
}

fn measure(
    job: Job,
    files: TreesFromFilesArgs,
    args: MeasureArgs,
    context: &mut Context<'_>,
) -> Result<Finished, Failure> {
    crate::headless::measure::run(&resolve::measure(job, files, args), context)
}

#[cfg(feature = "gui")]
fn run_viewer(args: args::ViewerArgs, token: &CancelToken) -> Result<Finished, Failure> {
    usable_threads(args.build.threads);
    let options = resolve::viewer(args);
    if signals::pass_to_window(token) {
        return Err(Failure::Interrupted);
    }
    crate::app::run(options).map_err(|error| Failure::Failed(error.to_string()))?;
    if crate::app::was_interrupted() { Err(Failure::Interrupted) } else { Ok(Finished::default()) }
}

#[cfg(not(feature = "gui"))]
fn run_viewer(_: args::ViewerArgs, _: &CancelToken) -> Result<Finished, Failure> {
    Err(Failure::Failed(
        "this program was built without its window (feature 'gui'): use a command such as 'render' or 'bench', see --help"
            .to_owned(),
    ))
}
