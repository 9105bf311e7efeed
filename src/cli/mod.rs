//! The command line: parses flags into resolved settings, runs the command and sets the exit code.
//!
//! The only module that knows flags; knows nothing of how a command works. Start at [`main`].

mod args;
mod named;
mod resolve;
mod suggest;
mod values;

use std::cell::OnceCell;
use std::ffi::OsStr;
use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{CommandFactory as _, Parser as _};

use crate::budget::Budget;
use crate::headless::plot::PlotCommand;
use crate::headless::{Context, Failure, Finished};
use crate::lab::Job;
use crate::scene::LoadOptions;
use args::{BuildArgs, Cli, CommandArgs, MeasureArgs, OneTreeArgs, StrictLoadArgs};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::tree::ContainerKind;

/// Runs the program with its command line arguments and returns the exit code: 0 done, 1 failed, 2 wrong usage, 3 done
/// with warnings under `--strict`, 130 interrupted.
pub fn main() -> ExitCode {
    let parsed = match std::env::args_os().nth(1).and_then(|first| suggest(&first)) {
        Some(text) => Err(Cli::command().error(ErrorKind::InvalidSubcommand, text)),
        None => Cli::try_parse(),
    };
    let cli = match parsed {
        Ok(cli) => cli,
        Err(error) => {
            // Ignores a closed pipe.
            let _ = error.print();
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2));
        }
    };
    // `RUST_LOG=bvhscope=info` logs the events of the window; graphics drivers log errors only.
    env_logger::Builder::from_env(env_logger::Env::default().default_filter_or("warn,wgpu_hal=error,winit=error"))
        .init();
    let token = CancelToken::new();
    let load_args = cli.command.as_ref().and_then(load_args);
    // The viewer shows warnings and has no --strict.
    let strict = load_args.is_some_and(|load| load.strict);
    if let Some(limit) = load_args.map_or(cli.viewer.load.memory_limit, |load| load.any.memory_limit) {
        Budget::set_limit(limit);
    }
    if let Some(text) = invalid_combination(&cli) {
        return finish(Err(Failure::Usage(text)), strict);
    }
    let result = match cli.command {
        None => run_viewer(cli.viewer),
        Some(command) => {
            let handler_token = token.clone();
            // The first Ctrl-C or termination signal cancels, the second exits at once.
            let handler = ctrlc::set_handler(move || {
                if handler_token.is_cancelled() {
                    std::process::exit(130);
                }
                handler_token.cancel();
            });
            if let Err(error) = handler {
                log::warn!("Ctrl-C will end the program at once: {error}");
            }
            // A panic is a bug in bvhscope; it ends with an exit code and a message.
            catch_unwind(AssertUnwindSafe(|| run_command(command, token))).unwrap_or_else(|_| {
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

/// The error message for a first argument that resembles a command.
fn suggest(first: &OsStr) -> Option<String> {
    let program = Cli::command();
    suggest::suggest(first, program.get_subcommands().map(clap::Command::get_name).chain(["help"]))
}

/// Prints the outcome and returns its exit code.
fn finish(result: Result<Finished, Failure>, strict: bool) -> ExitCode {
    match result {
        Ok(Finished { warned: true }) if strict => {
            eprintln!("bvhscope: done, with warnings (--strict)");
            ExitCode::from(3)
        }
        Ok(_) | Err(Failure::BrokenPipe) => ExitCode::SUCCESS,
        Err(Failure::Usage(text)) => {
            let _ = Cli::command().error(ErrorKind::ValueValidation, text).print();
            ExitCode::from(2)
        }
        Err(failure @ Failure::Interrupted) => {
            eprintln!("bvhscope: {failure}");
            ExitCode::from(130)
        }
        Err(failure @ Failure::Failed(_)) => {
            eprintln!("bvhscope: {failure}");
            ExitCode::FAILURE
        }
    }
}

/// The loading flags of a command; `None` if it loads no model.
fn load_args(command: &CommandArgs) -> Option<&StrictLoadArgs> {
    Some(match command {
        CommandArgs::Render(args) => &args.load,
        CommandArgs::Info(args) => &args.load,
        CommandArgs::Bench(args) => &args.measure.load,
        CommandArgs::Sweep(args) => &args.measure.load,
        CommandArgs::Scaling(args) => &args.measure.load,
        CommandArgs::Compare(args) => &args.measure.load,
        CommandArgs::Plot(_) => return None,
    })
}

/// The error message for an invalid combination of flags, if it is one.
fn invalid_combination(cli: &Cli) -> Option<String> {
    let one = |args: &BuildArgs| resolve::invalid_passes(args.shape.optimize, args.container.as_slice());
    let several = |args: &OneTreeArgs, default: &[ContainerKind]| {
        resolve::invalid_passes(args.shape.optimize, args.container.as_ref().map_or(default, |given| &given.0))
    };
    match &cli.command {
        None => one(&cli.viewer.build),
        Some(CommandArgs::Render(args)) => one(&args.build),
        Some(CommandArgs::Info(args)) => one(&args.build),
        Some(CommandArgs::Bench(args)) => several(&args.tree, &ContainerKind::ALL),
        Some(CommandArgs::Scaling(args)) => several(&args.tree, &[ContainerKind::Aabb]),
        Some(CommandArgs::Sweep(_) | CommandArgs::Compare(_) | CommandArgs::Plot(_)) => None,
    }
}

fn run_command(command: CommandArgs, token: CancelToken) -> Result<Finished, Failure> {
    let mut out = std::io::BufWriter::new(std::io::stdout());
    let load = load_args(&command).map_or_else(LoadOptions::default, |load| resolve::load(&load.any));
    let mut context = Context { token, out: &mut out, threads: None, load, pool: OnceCell::new() };
    let result = match command {
        CommandArgs::Render(args) => {
            context.threads = args.build.threads;
            let command = resolve::render(args);
            crate::headless::render::run(&command, &mut context)
        }
        CommandArgs::Info(args) => {
            context.threads = args.build.threads;
            crate::headless::info::run(&resolve::info(args), &mut context)
        }
        CommandArgs::Plot(args) => {
            let command = PlotCommand { files: args.files, output: args.output };
            crate::headless::plot::run(&command, &mut context)
        }
        CommandArgs::Bench(args) => {
            let setups = resolve::setups(&args.tree, &args.measure, &ContainerKind::ALL);
            measure(Job::Bench { setups, no_bvh: args.no_bvh }, args.measure, &mut context)
        }
        CommandArgs::Scaling(args) => {
            let setups = resolve::setups(&args.tree, &args.measure, &[ContainerKind::Aabb]);
            let max_threads = args.measure.threads.unwrap_or_else(rayon::current_num_threads);
            measure(Job::Scaling { setups, max_threads }, args.measure, &mut context)
        }
        CommandArgs::Sweep(args) => measure(Job::Sweep(resolve::sweep(&args)), args.measure, &mut context),
        CommandArgs::Compare(args) => {
            let threads = args.measure.threads.unwrap_or(0);
            measure(Job::Compare { containers: args.container.0, threads }, args.measure, &mut context)
        }
    };
    let flushed = out.flush();
    let finished = result?;
    flushed?;
    Ok(finished)
}

fn measure(job: Job, args: MeasureArgs, context: &mut Context<'_>) -> Result<Finished, Failure> {
    context.threads = args.threads;
    crate::headless::measure::run(&resolve::measure(job, args), context)
}

#[cfg(feature = "gui")]
fn run_viewer(args: args::ViewerArgs) -> Result<Finished, Failure> {
    let options = resolve::viewer(args);
    let handler = ctrlc::set_handler(|| {
        crate::app::mark_clean_exit();
        if !crate::app::interrupt() {
            std::process::exit(130);
        }
    });
    if let Err(error) = handler {
        log::warn!("Ctrl-C may look like a crash to the next start: {error}");
    }
    crate::app::run(options).map_err(|error| Failure::Failed(error.to_string()))?;
    if crate::app::was_interrupted() { Err(Failure::Interrupted) } else { Ok(Finished::default()) }
}

#[cfg(not(feature = "gui"))]
fn run_viewer(_: args::ViewerArgs) -> Result<Finished, Failure> {
    Err(Failure::Failed(
        "this program was built without its window (feature 'gui'): use a command such as 'render' or 'bench', see --help"
            .to_owned(),
    ))
}
