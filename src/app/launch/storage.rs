//! What is kept between runs. Damaged settings never keep the program from starting.

use std::path::{Path, PathBuf};
use std::sync::Once;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use crate::app::state::{Preferences, Wanted};
use crate::export::write_bytes;
use bvhscope_engine::settings::BuildSettings;

/// The folder in which the desktop keeps our settings is named after this.
pub const APP_ID: &str = "bvhscope";
/// The settings in that folder.
pub const SETTINGS: &str = "settings.json";
/// Where the window stood, beside them; eframe's own.
pub const WINDOW: &str = "window.ron";

/// A change is written down this long after it, together with those that have come since.
const DELAY: Duration = Duration::from_millis(800);

/// What was found. Parts that could not be used are missing.
#[derive(Default)]
pub struct Restored {
    /// The settings of the last run.
    pub wanted: Option<Wanted>,
    /// The preferences of the last run.
    pub preferences: Option<Preferences>,
    /// What the user must know: settings were damaged.
    pub complaint: Option<String>,
}

/// Reads the settings of the last run, which are in `file`.
pub fn restore(file: Option<&Path>) -> Restored {
    let Some(file) = file.filter(|file| file.exists()) else { return Restored::default() };
    let mut restored = std::fs::read_to_string(file).map_or_else(|_| parse(""), |text| parse(&text));
    if restored.complaint.is_some() {
        restored.complaint = Some(complain(file));
    }
    restored
}

/// Writes the settings down soon after each change, so that nothing more is lost however the process ends.
#[derive(Default)]
pub struct SettingsAutosave {
    file: Option<PathBuf>,
    kept: Option<(Wanted, Preferences)>,
    due: Option<Instant>,
    writer: Option<JoinHandle<()>>,
}

impl SettingsAutosave {
    /// Keeps settings in `file`; in none without it.
    pub fn new(file: Option<PathBuf>) -> Self {
        Self { file, ..Self::default() }
    }

    /// Sees to it that the present settings are written. Returns after what time this is to be called again.
    pub fn follow(&mut self, wanted: &Wanted, preferences: &Preferences, now: Instant) -> Option<Duration> {
        if self.file.is_none() || self.holds(wanted, preferences) {
            self.due = None;
            return None;
        }
        let due = *self.due.get_or_insert(now + DELAY);
        if now < due {
            return Some(due - now);
        }
        if self.writer.as_ref().is_some_and(|writer| !writer.is_finished()) {
            // A slow disk: no write overtakes another.
            return Some(DELAY);
        }
        self.due = None;
        let write = self.next_write(wanted, preferences)?;
        match std::thread::Builder::new().name("settings".to_owned()).spawn(write) {
            Ok(writer) => self.writer = Some(writer),
            Err(error) => {
                log::warn!("the settings are written later: {error}");
                self.kept = None;
            }
        }
        None
    }

    /// Writes the settings before the process ends, and waits for that.
    pub fn finish(&mut self, wanted: &Wanted, preferences: &Preferences) {
        if let Some(writer) = self.writer.take() {
            let _ = writer.join();
        }
        if let Some(write) = self.next_write(wanted, preferences) {
            write();
        }
    }

    fn holds(&self, wanted: &Wanted, preferences: &Preferences) -> bool {
        self.kept.as_ref().is_some_and(|kept| kept.0 == *wanted && kept.1 == *preferences)
    }

    /// What writes these settings, where they are not written yet.
    fn next_write(&mut self, wanted: &Wanted, preferences: &Preferences) -> Option<impl FnOnce() + Send + use<>> {
        let file = self.file.clone().filter(|_| !self.holds(wanted, preferences))?;
        self.kept = Some((wanted.clone(), preferences.clone()));
        let text = serde_json::to_string(&Kept { wanted, preferences });
        Some(move || {
            let text = text.map_err(|error| error.to_string());
            let written = text.and_then(|text| write_bytes(&file, text.as_bytes()).map_err(|error| error.to_string()));
            if let Err(error) = written {
                // Said once, and not at each change.
                static SAID: Once = Once::new();
                SAID.call_once(|| log::warn!("the settings were not saved: {error}"));
            }
        })
    }
}

#[derive(Serialize)]
struct Kept<'a> {
    wanted: &'a Wanted,
    preferences: &'a Preferences,
}

fn parse(text: &str) -> Restored {
    #[derive(Deserialize)]
    struct Parts {
        wanted: serde_json::Value,
        preferences: serde_json::Value,
    }
    let Ok(parts) = serde_json::from_str::<Parts>(text) else {
        return Restored { complaint: Some(String::new()), ..Restored::default() };
    };
    let wanted = serde_json::from_value::<Wanted>(parts.wanted).ok().map(within_limits);
    let preferences = serde_json::from_value::<Preferences>(parts.preferences).ok().map(|mut preferences| {
        preferences.paper.limit();
        preferences
    });
    let complaint = (wanted.is_none() || preferences.is_none()).then(String::new);
    Restored { wanted, preferences, complaint }
}

/// Numbers that neither a slider nor the command line can reach are brought back into their range.
fn within_limits(mut wanted: Wanted) -> Wanted {
    let build = &mut wanted.build;
    build.threshold = build.threshold.clamp(BuildSettings::MIN_THRESHOLD, BuildSettings::MAX_THRESHOLD);
    build.epsilon = build.epsilon.clamp(0.0, BuildSettings::MAX_EPSILON);
    wanted.threads = wanted.threads.min(1024);
    wanted.render.samples = wanted.render.samples.clamp(1, 1024);
    wanted.overlay.budget = wanted.overlay.budget.clamp(1, 1_000_000);
    wanted.overlay.line_width = wanted.overlay.line_width.clamp(0.25, 16.0);
    wanted.overlay.hidden_alpha = wanted.overlay.hidden_alpha.clamp(0.0, 1.0);
    let camera = wanted.camera;
    let usable = camera.eye.is_finite() && camera.target.is_finite() && camera.distance() > 0.0;
    if !usable || camera.up.length_squared() < 1e-12 || !(0.01..3.1).contains(&camera.fov_y) {
        wanted.camera = Wanted::new(wanted.source.clone()).camera;
    }
    wanted
}

/// Saves the damaged file under another name and says so.
fn complain(file: &Path) -> String {
    let copy = file.with_extension("json.bad");
    let kept = std::fs::copy(file, &copy).is_ok();
    let place = if kept { format!(". The damaged file is kept as {}", copy.display()) } else { String::new() };
    format!("The settings of the last run could not be read, so the defaults are used{place}")
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::scene::SceneSource;

    #[test]
    fn settings_survive_a_restart() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(SETTINGS);
        let mut wanted = Wanted::new(SceneSource::default_builtin());
        wanted.build.threshold = 17;
        let preferences = Preferences { greeted: true, ..Preferences::default() };
        SettingsAutosave::new(Some(file.clone())).finish(&wanted, &preferences);
        let restored = restore(Some(&file));
        assert_eq!(restored.wanted, Some(wanted));
        assert_eq!(restored.preferences, Some(preferences));
        assert_eq!(restored.complaint, None);
    }

    #[test]
    fn changes_are_written_once_while_the_program_goes_on() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(SETTINGS);
        let (mut wanted, preferences) = (Wanted::new(SceneSource::default_builtin()), Preferences::default());
        let mut settings_autosave = SettingsAutosave::new(Some(file.clone()));
        let start = Instant::now();
        let mut moments = 0;
        // A slider under a hand, thirty frames a second.
        for frame in 0..60 {
            wanted.build.threshold = 2 + frame;
            let again = settings_autosave.follow(&wanted, &preferences, start + Duration::from_millis(33) * frame);
            moments += u32::from(again.is_none());
            if let Some(writer) = settings_autosave.writer.take_if(|_| again.is_none()) {
                writer.join().unwrap();
                assert_eq!(restore(Some(&file)).wanted, Some(wanted.clone()));
            }
        }
        assert_eq!(moments, 2, "not once a frame");
        let end = start + Duration::from_secs(10);
        settings_autosave.follow(&wanted, &preferences, end);
        assert_eq!(settings_autosave.follow(&wanted, &preferences, end + DELAY), None);
        settings_autosave.writer.take().unwrap().join().unwrap();
        assert_eq!(restore(Some(&file)).wanted, Some(wanted.clone()));
        assert_eq!(settings_autosave.follow(&wanted, &preferences, end + 9 * DELAY), None);
        assert!(settings_autosave.writer.is_none(), "what is written already is not written again");
    }

    #[test]
    fn damaged_settings_give_defaults_and_a_complaint() {
        for text in ["", "{", "null", "[]", "{\"wanted\":3,\"preferences\":{}}"] {
            let restored = parse(text);
            assert!(restored.wanted.is_none(), "{text}");
            assert!(restored.complaint.is_some(), "{text}");
        }
    }

    #[test]
    fn unreachable_numbers_are_brought_back() {
        let mut wanted = Wanted::new(SceneSource::default_builtin());
        wanted.build.threshold = 1_000_000;
        wanted.camera.eye = wanted.camera.target;
        let limited = within_limits(wanted);
        assert_eq!(limited.build.threshold, BuildSettings::MAX_THRESHOLD);
        assert!(limited.camera.distance() > 0.0);
    }
}
