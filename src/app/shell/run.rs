//! Opens the window, and reports in plain words why that failed.

use std::ffi::OsString;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::PathBuf;
use std::process::Command;
use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use egui_wgpu::{WgpuConfiguration, WgpuSetup, WgpuSetupCreateNew};

use crate::app::shell::app::App;
use crate::app::shell::options::StartOptions;
use crate::app::shell::settings::{Startup, mark_clean_exit};
use crate::app::shell::storage::APP_ID;
use crate::app::shell::system::{DEFAULT_SIZE, MIN_SIZE, SystemFonts, was_lost};
use crate::app::viewport::screenshot;
use crate::console::note;
use crate::scene::SceneSource;
use crate::threads::start_global_pool;

/// Why the window could not be opened. The texts say what to do instead.
#[derive(Debug, thiserror::Error)]
pub enum AppError {
    /// There is no display.
    #[error(
        "there is no display to open a window on ({0}). Without one, 'bvhscope render MODEL -o out.png' makes the same \
         picture, and all other commands work as well"
    )]
    NoDisplay(String),
    /// No graphics driver was found.
    #[error(
        "no graphics driver was found ({0}). Install a Vulkan or OpenGL driver (Debian and Ubuntu: \
         mesa-vulkan-drivers); 'bvhscope render MODEL -o out.png' works without one as long as no overlay is asked for"
    )]
    NoGraphics(String),
    /// A library of the desktop is missing.
    #[error("{0} Install it (Debian and Ubuntu: libxkbcommon-x11-0), or use 'bvhscope render MODEL -o out.png'")]
    NoLibrary(String),
    /// The system refuses the window's libraries a thread, on which they panic.
    #[error(
        "a window needs more threads than the system gives ({0}). End other programs or raise the limit (ulimit -u), or use \
         'bvhscope render MODEL -o out.png', which works without"
    )]
    NoThreads(String),
    /// The graphics device was lost, and again soon after the restart.
    #[error(
        "the graphics driver ended twice within 30 seconds, so the window is closed; the settings are kept. Update the \
         driver, or use 'bvhscope render MODEL -o out.png', which needs none"
    )]
    DeviceLost,
    /// Any other error of the window's libraries.
    #[error("the window could not be opened: {0}")]
    Other(String),
}

/// Maximum time to wait for screenshots still being saved when the window is closed.
const SCREENSHOT_TIMEOUT: Duration = Duration::from_millis(800);

/// Opens the window and returns when it is closed.
pub fn run(mut options: StartOptions) -> Result<(), AppError> {
    let startup = Startup::prepare(options.settings, options.source.as_ref().and_then(SceneSource::path));
    if startup.safe_mode {
        options = StartOptions { load: options.load, settings: options.settings, ..StartOptions::default() };
    }
    if let Some(text) = start_global_pool("frame", 0) {
        log::warn!("{text}");
    }
    startup.watch();
    options.notices.clone_from(&startup.notices);
    options.settings_file.clone_from(&startup.settings_file);
    let restart_arguments = restart_arguments(std::env::args_os().skip(1), !options.settings.none);
    let native = native_options(startup.window_file());
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        let create: eframe::AppCreator<'_> = Box::new(move |context| {
            context.egui_ctx.add_font_provider(Arc::new(SystemFonts::new()));
            Ok(Box::new(App::new(context, options)?))
        });
        eframe::run_native(APP_ID, native, create)
    }));
    screenshot::wait_for_all(SCREENSHOT_TIMEOUT);
    if was_lost(outcome.is_err()) {
        mark_clean_exit();
        drop(startup);
        return restart(&restart_arguments);
    }
    if outcome.is_ok() {
        mark_clean_exit();
    }
    match outcome {
        Ok(Ok(())) => Ok(()),
        Ok(Err(error)) => Err(describe_error(error)),
        // The window's libraries panic where the keyboard library is missing or a thread cannot be started.
        Err(payload) => match payload.downcast_ref::<String>() {
            Some(text) if text.contains("could not be loaded") => Err(AppError::NoLibrary(text.clone())),
            Some(text) if text.contains("failed to spawn thread") => Err(AppError::NoThreads(text.clone())),
            _ => resume_unwind(payload),
        },
    }
}

/// A second loss of the device within this time ends the program.
const MIN_RESTART_INTERVAL: Duration = Duration::from_secs(30);
/// Environment variable with the time of the last restart in seconds since 1970.
const RESTARTED_AT: &str = "BVHSCOPE_STARTED_AGAIN";

/// Command line of the process that continues this one, whose own is `given`. With saved settings it restores them and
/// repeats only the flags that these do not hold; without, it repeats everything.
fn restart_arguments(given: impl Iterator<Item = OsString>, has_settings: bool) -> Vec<OsString> {
    let mut given = given.filter(|argument| argument != "--lose-device" && argument != "--refuse-buffer");
    if !has_settings {
        return given.collect();
    }
    let mut arguments = vec![OsString::from("--restore")];
    while let Some(argument) = given.next() {
        let text = argument.to_string_lossy();
        let is_kept = |flag: &str| text == flag || text.strip_prefix(flag).is_some_and(|rest| rest.starts_with('='));
        if text == "--allow-outside" {
            arguments.push(argument);
        } else if ["--memory-limit", "--scene", "--fps", "--instances"].into_iter().any(is_kept) {
            let has_value = text.contains('=');
            arguments.push(argument);
            arguments.extend(if has_value { None } else { given.next() });
        }
    }
    arguments
}

/// Restarts the program with the settings that were just saved: a process cannot use a device again that it has lost.
fn restart(arguments: &[OsString]) -> Result<(), AppError> {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs();
    let before = std::env::var(RESTARTED_AT).ok().and_then(|text| text.parse::<u64>().ok());
    if before.is_some_and(|before| now.saturating_sub(before) < MIN_RESTART_INTERVAL.as_secs()) {
        return Err(AppError::DeviceLost);
    }
    note("warning: the graphics driver ended; the window is opened again");
    let failed = |error: std::io::Error| AppError::Other(format!("the program could not be started again: {error}"));
    let mut command = Command::new(std::env::current_exe().map_err(failed)?);
    command.args(arguments).env(RESTARTED_AT, now.to_string());
    #[cfg(unix)]
    return Err(failed(std::os::unix::process::CommandExt::exec(&mut command)));
    #[cfg(not(unix))]
    command.spawn().map(drop).map_err(failed)
}

fn describe_error(error: eframe::Error) -> AppError {
    let text = without_source_location(&error.to_string()).to_owned();
    match error {
        eframe::Error::WinitEventLoop(_) => AppError::NoDisplay(text),
        eframe::Error::Wgpu(_) => AppError::NoGraphics(text),
        _ => AppError::Other(text),
    }
}

/// The error text of the window's library without the location in its source code.
fn without_source_location(text: &str) -> &str {
    let message =
        text.rsplit_once(".rs:").and_then(|(_, rest)| rest.split_once(": ")).map_or(text, |(_, message)| message);
    message.trim_end_matches('.')
}

fn native_options(window_file: Option<PathBuf>) -> eframe::NativeOptions {
    let viewport = egui::ViewportBuilder::default()
        .with_title("bvhscope")
        .with_app_id(APP_ID)
        .with_inner_size(DEFAULT_SIZE)
        .with_min_inner_size(MIN_SIZE)
        .with_drag_and_drop(true);
    eframe::NativeOptions {
        viewport: match eframe::icon_data::from_png_bytes(include_bytes!("../../../assets/icon-256.png")) {
            Ok(icon) => viewport.with_icon(icon),
            Err(_) => viewport,
        },
        wgpu_options: WgpuConfiguration {
            wgpu_setup: WgpuSetup::CreateNew(WgpuSetupCreateNew {
                device_descriptor: Arc::new(device_descriptor),
                ..WgpuSetupCreateNew::without_display_handle()
            }),
            ..WgpuConfiguration::default()
        },
        persistence_path: window_file,
        // Ours reads them without a library of its own.
        system_font_fallback: false,
        ..eframe::NativeOptions::default()
    }
}

/// Requests the adapter's own limits: ten million nodes need buffers far beyond the portable defaults.
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

    fn arguments(given: &str, has_settings: bool) -> String {
        let arguments = restart_arguments(given.split(' ').map(OsString::from), has_settings);
        arguments.iter().map(|argument| argument.to_string_lossy()).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn a_restart_repeats_arguments_that_are_not_in_the_settings() {
        let given = "model.obj --shading depth --memory-limit 4GB --scene 1 --allow-outside --lose-device";
        assert_eq!(arguments(given, true), "--restore --memory-limit 4GB --scene 1 --allow-outside");
        assert_eq!(arguments("--memory-limit=50%", true), "--restore --memory-limit=50%");
        assert_eq!(arguments("a.obj --instances flat --fps=12 --seed 1", true), "--restore --instances flat --fps=12");
        assert_eq!(
            arguments(&format!("{given} --no-config"), false),
            "model.obj --shading depth --memory-limit 4GB --scene 1 --allow-outside --no-config"
        );
    }
}
