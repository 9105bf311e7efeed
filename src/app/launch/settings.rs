//! Where the settings of this run come from: the desktop's folder, or nowhere; and whether the last start went wrong.

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Duration;

use crate::app::launch::storage::{APP_ID, SETTINGS, WINDOW};

/// A start that dies earlier than this was one that its settings or its model killed.
const TRIAL: Duration = Duration::from_secs(10);

/// What the command line says about settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SettingsUse {
    /// Neither read nor write any.
    pub none: bool,
    /// Begin with the defaults; the old ones are kept aside.
    pub reset: bool,
}

/// What was found before the window opens.
#[derive(Debug, Default)]
pub(crate) struct Start {
    /// The file of the settings.
    pub file: Option<PathBuf>,
    /// What the user must know.
    pub notices: Vec<String>,
    /// The last start died early: no settings, no model.
    pub safe: bool,
    /// Holds the settings of a run that keeps none.
    _nowhere: Option<tempfile::TempDir>,
    trial: Option<Trial>,
}

impl Start {
    /// Looks at the settings' folder.
    pub fn prepare(settings: SettingsUse) -> Self {
        if settings.none {
            let nowhere = tempfile::tempdir().ok();
            let file = nowhere.as_ref().map(|folder| folder.path().join(SETTINGS));
            return Self { file, _nowhere: nowhere, ..Self::default() };
        }
        let Some(folder) = eframe::storage_dir(APP_ID) else { return Self::default() };
        Self::in_folder(&folder, settings.reset)
    }

    fn in_folder(folder: &Path, reset: bool) -> Self {
        let mut start = Self { file: Some(folder.join(SETTINGS)), ..Self::default() };
        let mut set_aside = |why: &str| {
            let (file, window) = (folder.join(SETTINGS), folder.join(WINDOW));
            let kept = file.with_extension("json.bad");
            // Mostly there is none yet.
            let _ = std::fs::rename(&window, window.with_extension("ron.bad"));
            match std::fs::rename(&file, &kept) {
                Ok(()) => start.notices.push(format!("{why}. The old settings are kept as {}", kept.display())),
                Err(error) if error.kind() == std::io::ErrorKind::NotFound => start.notices.push(why.to_owned()),
                Err(error) => start.notices.push(format!("{why}, but {} could not be moved: {error}", file.display())),
            }
        };
        if reset {
            set_aside("Settings were reset");
        }
        let trial = Trial { file: folder.join("starting") };
        start.safe = trial.died();
        if start.safe {
            let text =
                "The last start ended within 10 seconds, so this one is safe: default settings and the built-in teapot";
            set_aside(text);
        }
        start.trial = trial.begin().then_some(trial);
        start
    }

    /// Ends the trial after a while; a thread of its own, since a window that hangs must not count as well started.
    pub fn watch(&self) {
        let Some(trial) = self.trial.clone() else { return };
        *ENDS_WITH.lock().unwrap_or_else(std::sync::PoisonError::into_inner) = Some(trial.clone());
        let watcher = move || {
            std::thread::sleep(TRIAL);
            trial.end();
        };
        if let Err(error) = std::thread::Builder::new().name("trial".to_owned()).spawn(watcher) {
            log::warn!("an early end will not be noticed: {error}");
        }
    }
}

/// The trial of this process, for signals.
static ENDS_WITH: Mutex<Option<Trial>> = Mutex::new(None);

/// The window was closed, or the user interrupted it: no failure, however early.
pub fn ended_as_wanted() {
    if let Some(trial) = ENDS_WITH.lock().unwrap_or_else(std::sync::PoisonError::into_inner).take() {
        trial.end();
    }
}

/// A file that exists while a start is young; it holds the number of the process.
#[derive(Debug, Clone)]
struct Trial {
    file: PathBuf,
}

impl Trial {
    /// Whether an earlier start left its file behind and is gone.
    fn died(&self) -> bool {
        let Ok(text) = std::fs::read_to_string(&self.file) else { return false };
        match text.trim().parse::<u32>() {
            // Two instances may start at the same time.
            Ok(pid) => !is_running(pid),
            Err(_) => true,
        }
    }

    fn begin(&self) -> bool {
        std::fs::create_dir_all(self.file.parent().unwrap_or(Path::new("."))).is_ok()
            && std::fs::write(&self.file, std::process::id().to_string()).is_ok()
    }

    fn end(&self) {
        // Gone already, or in a folder that has become read-only: the next start will say so.
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
    fn an_early_death_makes_the_next_start_a_safe_one() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(SETTINGS), "settings").unwrap();
        let first = Start::in_folder(folder.path(), false);
        assert!(!first.safe && first.notices.is_empty());
        // As if that process had died: no process has this number.
        std::fs::write(folder.path().join("starting"), u32::MAX.to_string()).unwrap();
        let second = Start::in_folder(folder.path(), false);
        assert!(second.safe && second.notices[0].contains("settings.json.bad"), "{:?}", second.notices);
        assert_eq!(std::fs::read(folder.path().join("settings.json.bad")).unwrap(), b"settings");
        second.trial.unwrap().end();
        assert!(!Start::in_folder(folder.path(), false).safe, "a start that was closed is none that died");
    }

    #[test]
    fn settings_are_reset_and_kept_aside() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(SETTINGS), "settings").unwrap();
        let start = Start::in_folder(folder.path(), true);
        assert!(!folder.path().join(SETTINGS).exists() && folder.path().join("settings.json.bad").exists());
        assert_eq!(start.notices.len(), 1);
    }

    #[test]
    fn a_run_without_settings_keeps_them_nowhere() {
        let start = Start::prepare(SettingsUse { none: true, reset: false });
        assert!(start.file.is_some_and(|file| !file.exists()) && !start.safe);
    }
}
