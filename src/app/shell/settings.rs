//! Where the settings of this run are saved, and safe mode: default settings after a run that ended soon after its start.

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Duration;

use crate::app::shell::files::{is_irregular, read_text, set_aside, write_text};
use crate::app::shell::storage::{APP_ID, SETTINGS_FILE, WINDOW_FILE};
use crate::export::is_same_file;
use crate::text::shown_path;

/// A run that ends abnormally within this time is attributed to its settings or its model.
const TRIAL_TIME: Duration = Duration::from_secs(10);

/// How the command line uses saved settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SettingsUse {
    /// Neither read nor write them.
    pub none: bool,
    /// Start with the defaults; the saved settings are renamed.
    pub reset: bool,
}

/// The settings file of this run and what the last run left behind.
#[derive(Debug, Default)]
pub(crate) struct Startup {
    /// The file in which settings are saved.
    pub settings_file: Option<PathBuf>,
    /// Warnings to show at start.
    pub notices: Vec<String>,
    /// The last run ended soon after its start, so this one uses default settings and the built-in model.
    pub safe_mode: bool,
    /// The folder of a run that saves no settings, deleted at its end.
    _temporary_folder: Option<tempfile::TempDir>,
    marker: Option<StartupMarker>,
}

impl Startup {
    /// Finds the folder of the settings, and sets them aside where they are to be reset or the last run ended too soon. There are
    /// none where `model` is in the place of one of the files.
    pub(crate) fn prepare(settings: SettingsUse, model: Option<&Path>) -> Self {
        if settings.none {
            let temporary_folder = tempfile::tempdir().ok();
            let settings_file = temporary_folder.as_ref().map(|folder| folder.path().join(SETTINGS_FILE));
            return Self { settings_file, _temporary_folder: temporary_folder, ..Self::default() };
        }
        let Some(folder) = eframe::storage_dir(APP_ID) else { return Self::default() };
        let files = [SETTINGS_FILE, WINDOW_FILE].map(|name| folder.join(name));
        if model.is_some_and(|model| files.iter().any(|file| is_same_file(model, file))) {
            let notices = vec!["The model is in the place of the settings, so none are read or written".to_owned()];
            return Self { notices, ..Self::default() };
        }
        Self::in_folder(&folder, settings.reset)
    }

    fn in_folder(folder: &Path, reset: bool) -> Self {
        let mut startup = Self { settings_file: Some(folder.join(SETTINGS_FILE)), ..Self::default() };
        let (file, window) = (folder.join(SETTINGS_FILE), folder.join(WINDOW_FILE));
        if is_irregular(&window) {
            // The library of the window would wait for a pipe.
            let kept = set_aside(&window);
            let remains = kept.map_or(String::new(), |kept| format!(", and is kept as {}", shown_path(&kept)));
            startup.notices.push(format!("{} is not a file: it is not read{remains}", shown_path(&window)));
        }
        let mut reset_all = |reason: &str| {
            // Fails where there is no such file, as before the first run.
            let _ = set_aside(&window);
            match set_aside(&file) {
                Ok(kept) => {
                    startup.notices.push(format!("{reason}. The old settings are kept as {}", shown_path(&kept)));
                }
                Err(error) if error.kind() == std::io::ErrorKind::NotFound => startup.notices.push(reason.to_owned()),
                Err(error) => {
                    startup.notices.push(format!("{reason}, but {} could not be moved: {error}", shown_path(&file)));
                }
            }
        };
        if reset {
            reset_all("Settings were reset");
        }
        let marker = StartupMarker { file: folder.join("starting") };
        startup.safe_mode = marker.is_left_over();
        if startup.safe_mode {
            let text =
                "The last start ended within 10 seconds, so this one is safe: default settings and the built-in teapot";
            reset_all(text);
        }
        startup.marker = marker.create().then_some(marker);
        startup
    }

    /// The file for position and size of the window; `None` where something else is in its place, which was not moved.
    pub(crate) fn window_file(&self) -> Option<PathBuf> {
        let file = self.settings_file.as_ref()?.with_file_name(WINDOW_FILE);
        Some(file).filter(|file| !is_irregular(file))
    }

    /// Removes the marker after [`TRIAL_TIME`], on a thread of its own.
    pub(crate) fn watch(&self) {
        let Some(marker) = self.marker.clone() else { return };
        *MARKER.lock().unwrap_or_else(std::sync::PoisonError::into_inner) = Some(marker.clone());
        let remove_later = move || {
            std::thread::sleep(TRIAL_TIME);
            marker.remove();
        };
        if let Err(error) = std::thread::Builder::new().name("trial".to_owned()).spawn(remove_later) {
            log::warn!("an early end will not be noticed: {error}");
        }
    }
}

/// The marker of this process, which a signal handler removes.
static MARKER: Mutex<Option<StartupMarker>> = Mutex::new(None);

/// Marks the end of this run as normal, however soon after its start: the window was closed, or the user interrupted it.
pub fn mark_clean_exit() {
    if let Some(marker) = MARKER.lock().unwrap_or_else(std::sync::PoisonError::into_inner).take() {
        marker.remove();
    }
}

/// A file that exists during the first seconds of a run and holds its process identifier.
#[derive(Debug, Clone)]
struct StartupMarker {
    file: PathBuf,
}

impl StartupMarker {
    /// Whether an ended process has left its marker behind.
    fn is_left_over(&self) -> bool {
        let Ok(text) = read_text(&self.file) else { return false };
        match text.trim().parse::<u32>() {
            // Another instance may have started at the same time.
            Ok(pid) => !is_running(pid),
            Err(_) => true,
        }
    }

    fn create(&self) -> bool {
        std::fs::create_dir_all(self.file.parent().unwrap_or(Path::new("."))).is_ok()
            && write_text(&self.file, &std::process::id().to_string()).is_ok()
    }

    fn remove(&self) {
        // Fails where it is removed already. In a folder that has become read-only it stays, and the next start says so.
        let _ = std::fs::remove_file(&self.file);
    }
}

fn is_running(pid: u32) -> bool {
    let pid = sysinfo::Pid::from_u32(pid);
    let Ok(mut system) = sysinfo::System::new() else { return false };
    system.refresh_processes_specifics(
        sysinfo::ProcessesToUpdate::Some(&[pid]),
        false,
        sysinfo::ProcessRefreshKind::nothing().without_tasks(),
    );
    system.process(pid).is_some_and(|process| process.name().to_string_lossy().contains(APP_ID))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    #[test]
    fn an_abnormal_end_soon_after_the_start_causes_safe_mode() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(SETTINGS_FILE), "settings").unwrap();
        let first = Startup::in_folder(folder.path(), false);
        assert!(!first.safe_mode && first.notices.is_empty());
        // The marker of a process that no longer runs: none has this identifier.
        std::fs::write(folder.path().join("starting"), u32::MAX.to_string()).unwrap();
        let second = Startup::in_folder(folder.path(), false);
        assert!(second.safe_mode && second.notices[0].contains("settings.json.bad"), "{:?}", second.notices);
        assert_eq!(std::fs::read(folder.path().join("settings.json.bad")).unwrap(), b"settings");
        second.marker.unwrap().remove();
        assert!(!Startup::in_folder(folder.path(), false).safe_mode, "a run that was closed ended normally");
    }

    #[test]
    fn reset_settings_are_renamed() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(SETTINGS_FILE), "settings").unwrap();
        let startup = Startup::in_folder(folder.path(), true);
        assert!(!folder.path().join(SETTINGS_FILE).exists() && folder.path().join("settings.json.bad").exists());
        assert_eq!(startup.notices.len(), 1);
    }

    #[test]
    fn a_run_without_settings_saves_none() {
        let startup = Startup::prepare(SettingsUse { none: true, reset: false }, None);
        assert!(startup.settings_file.is_some_and(|file| !file.exists()) && !startup.safe_mode);
    }
}
