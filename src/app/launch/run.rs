//! Opening the window, and saying in plain words why there is none.

use std::ffi::OsString;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::PathBuf;
use std::process::Command;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use eframe::egui_wgpu::{WgpuConfiguration, WgpuSetup, WgpuSetupCreateNew};
use eframe::{egui, wgpu};

use crate::app::launch::device::was_lost;
use crate::app::launch::settings::{Start, ended_as_wanted};
use crate::app::launch::storage::{APP_ID, WINDOW};
use crate::app::viewport::screenshot;
use crate::app::{App, MIN_SIZE, START_SIZE, StartOptions};
use crate::lab::available_threads;

/// Why the window could not be opened. The texts say what to do instead.
#[derive(Debug, thiserror::Error)]
pub enum AppError {
    /// Nowhere to open a window.
    #[error(
        "there is no display to open a window on ({0}). Without one, 'bvhscope render MODEL -o out.png' makes the same \
         picture, and all other commands work as well"
    )]
    NoDisplay(String),
    /// No graphics driver that can draw.
    #[error(
        "no graphics driver was found ({0}). Install a Vulkan or OpenGL driver (Debian and Ubuntu: \
         mesa-vulkan-drivers); 'bvhscope render MODEL -o out.png' works without one as long as no overlay is asked for"
    )]
    NoGraphics(String),
    /// A library of the desktop is missing.
    #[error("{0} Install it (Debian and Ubuntu: libxkbcommon-x11-0), or use 'bvhscope render MODEL -o out.png'")]
    NoLibrary(String),
    /// The system gives the window's libraries no thread, which is a panic there.
    #[error(
        "a window needs more threads than the system gives ({0}). End other programs or raise the limit (ulimit -u), or use \
         'bvhscope render MODEL -o out.png', which works without"
    )]
    NoThreads(String),
    /// The driver ended, and again soon after the new start.
    #[error(
        "the graphics driver ended twice within 30 seconds, so the window is closed; the settings are kept. Update the \
         driver, or use 'bvhscope render MODEL -o out.png', which needs none"
    )]
    DeviceLost,
    /// Anything else.
    #[error("the window could not be opened: {0}")]
    Other(String),
}

/// How long a screenshot may take that was asked for just before the window was closed.
const LAST_SCREENSHOT: Duration = Duration::from_millis(800);

/// Opens the window and returns when it is closed.
pub fn run(mut options: StartOptions) -> Result<(), AppError> {
    let start = Start::prepare(options.settings);
    if start.safe {
        options = StartOptions { load: options.load, settings: options.settings, ..StartOptions::default() };
    }
    start_pool();
    start.watch();
    options.notices.clone_from(&start.notices);
    options.settings_file.clone_from(&start.file);
    let again = next_arguments(std::env::args_os().skip(1), !options.settings.none);
    let native = native_options(start.file.as_ref().map(|file| file.with_file_name(WINDOW)));
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        eframe::run_native(APP_ID, native, Box::new(move |context| Ok(Box::new(App::new(context, options)?))))
    }));
    screenshot::wait_for_all(LAST_SCREENSHOT);
    if was_lost(outcome.is_err()) {
        ended_as_wanted();
        drop(start);
        return start_again(&again);
    }
    if outcome.is_ok() {
        ended_as_wanted();
    }
    match outcome {
        Ok(Ok(())) => Ok(()),
        Ok(Err(error)) => Err(in_plain_words(error)),
        // The keyboard library is opened at run time, and its absence is a panic there; so is a thread that cannot be started.
        Err(payload) => match payload.downcast_ref::<String>() {
            Some(text) if text.contains("could not be loaded") => Err(AppError::NoLibrary(text.clone())),
            Some(text) if text.contains("failed to spawn thread") => Err(AppError::NoThreads(text.clone())),
            _ => resume_unwind(payload),
        },
    }
}

/// Starts the threads that UI frames share their work with, while there are some to be had: asked for later, rayon would panic
/// where the system gives none. In the end this thread works alone.
fn start_pool() {
    let named = || rayon::ThreadPoolBuilder::new().thread_name(|i| format!("frame {i}"));
    let mut threads = available_threads();
    while threads > 0 && named().num_threads(threads).build_global().is_err() {
        threads /= 2;
    }
    if threads == 0
        && let Err(error) = named().num_threads(1).use_current_thread().build_global()
    {
        log::warn!("frames have no threads to share their work with: {error}");
    }
}

/// A second loss within this time is no accident.
const LOST_AGAIN: Duration = Duration::from_secs(30);
/// Tells the new process when the old one started it, in seconds since 1970.
const STARTED_AGAIN: &str = "BVHSCOPE_STARTED_AGAIN";

/// What the next process is told where the driver ends this one, which was told `given`: to go on with the settings that
/// were kept and what its files may use, or the same again where nothing is kept.
fn next_arguments(given: impl Iterator<Item = OsString>, kept: bool) -> Vec<OsString> {
    let mut given = given.filter(|argument| argument != "--lose-device" && argument != "--refuse-buffer");
    if !kept {
        return given.collect();
    }
    let mut next = vec![OsString::from("--restore")];
    while let Some(argument) = given.next() {
        let text = argument.to_string_lossy();
        if text == "--allow-outside" || text.starts_with("--memory-limit=") {
            next.push(argument);
        } else if text == "--memory-limit" {
            next.push(argument);
            next.extend(given.next());
        }
    }
    next
}

/// Starts the program anew with the settings that were just kept: a lost device cannot be used again.
fn start_again(arguments: &[OsString]) -> Result<(), AppError> {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs();
    let before = std::env::var(STARTED_AGAIN).ok().and_then(|text| text.parse::<u64>().ok());
    if before.is_some_and(|before| now.saturating_sub(before) < LOST_AGAIN.as_secs()) {
        return Err(AppError::DeviceLost);
    }
    eprintln!("warning: the graphics driver ended; the window is opened again");
    let failed = |error: std::io::Error| AppError::Other(format!("the program could not be started again: {error}"));
    let mut command = Command::new(std::env::current_exe().map_err(failed)?);
    command.args(arguments).env(STARTED_AGAIN, now.to_string());
    #[cfg(unix)]
    return Err(failed(std::os::unix::process::CommandExt::exec(&mut command)));
    #[cfg(not(unix))]
    command.spawn().map(drop).map_err(failed)
}

fn in_plain_words(error: eframe::Error) -> AppError {
    let text = without_place(&error.to_string()).to_owned();
    match error {
        eframe::Error::WinitEventLoop(_) => AppError::NoDisplay(text),
        eframe::Error::Wgpu(_) => AppError::NoGraphics(text),
        _ => AppError::Other(text),
    }
}

/// What the window's library says, without the place in its sources where it says so.
fn without_place(text: &str) -> &str {
    let said = text.rsplit_once(".rs:").and_then(|(_, rest)| rest.split_once(": ")).map_or(text, |(_, said)| said);
    said.trim_end_matches('.')
}

fn native_options(window_file: Option<PathBuf>) -> eframe::NativeOptions {
    let viewport = egui::ViewportBuilder::default()
        .with_title("bvhscope")
        .with_app_id(APP_ID)
        .with_inner_size(START_SIZE)
        .with_min_inner_size(MIN_SIZE)
        .with_drag_and_drop(true);
    eframe::NativeOptions {
        viewport: match eframe::icon_data::from_png_bytes(include_bytes!("../../../assets/icon-256.png")) {
            Ok(icon) => viewport.with_icon(icon),
            Err(_) => viewport,
        },
        wgpu_options: WgpuConfiguration {
            wgpu_setup: WgpuSetup::CreateNew(WgpuSetupCreateNew {
                device_descriptor: std::sync::Arc::new(device_descriptor),
                ..WgpuSetupCreateNew::without_display_handle()
            }),
            ..WgpuConfiguration::default()
        },
        persistence_path: window_file,
        system_font_fallback: false,
        ..eframe::NativeOptions::default()
    }
}

/// As much as the adapter gives: ten million nodes need buffers far beyond the portable defaults.
fn device_descriptor(adapter: &wgpu::Adapter) -> wgpu::DeviceDescriptor<'static> {
    wgpu::DeviceDescriptor {
        label: Some("bvhscope"),
        required_limits: adapter.limits(),
        ..wgpu::DeviceDescriptor::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn next(given: &str, kept: bool) -> String {
        let next = next_arguments(given.split(' ').map(OsString::from), kept);
        next.iter().map(|argument| argument.to_string_lossy()).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn the_next_process_keeps_what_is_not_in_the_settings() {
        let given = "model.obj --shading depth --memory-limit 4GB --allow-outside --lose-device";
        assert_eq!(next(given, true), "--restore --memory-limit 4GB --allow-outside");
        assert_eq!(next("--memory-limit=50%", true), "--restore --memory-limit=50%");
        assert_eq!(
            next(&format!("{given} --no-config"), false),
            "model.obj --shading depth --memory-limit 4GB --allow-outside --no-config"
        );
    }
}
