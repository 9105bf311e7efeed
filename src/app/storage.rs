//! What is kept between runs. Damaged settings never keep the program from starting.

use std::path::PathBuf;

use eframe::Storage;
use serde::{Deserialize, Serialize};

use super::state::{Preferences, Wanted};
use crate::bvh::BuildSettings;

/// The folder in which the desktop keeps our settings is named after this.
pub const APP_ID: &str = "bvhscope";
const KEY: &str = "bvhscope";

#[derive(Serialize)]
struct Kept<'a> {
    wanted: &'a Wanted,
    preferences: &'a Preferences,
}

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
pub fn restore(storage: Option<&dyn Storage>, file: Option<PathBuf>) -> Restored {
    match storage.and_then(|storage| storage.get_string(KEY)) {
        Some(text) => {
            let mut restored = parse(&text);
            if restored.complaint.is_some() {
                restored.complaint = Some(complain(file));
            }
            restored
        }
        // The file is there, but our part of it is not: eframe could not read it and would overwrite it.
        None if storage.is_some() && file.as_ref().is_some_and(|file| file.exists()) => {
            Restored { complaint: Some(complain(file)), ..Restored::default() }
        }
        None => Restored::default(),
    }
}

/// Writes the settings down.
pub fn keep(storage: &mut dyn Storage, wanted: &Wanted, preferences: &Preferences) {
    match serde_json::to_string(&Kept { wanted, preferences }) {
        Ok(text) => storage.set_string(KEY, text),
        Err(error) => log::warn!("the settings were not saved: {error}"),
    }
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
fn complain(file: Option<PathBuf>) -> String {
    let kept = file.and_then(|file| {
        let copy = file.with_extension("ron.bad");
        std::fs::copy(&file, &copy).ok().map(|_| copy)
    });
    let place = kept.map_or_else(String::new, |copy| format!(". The damaged file is kept as {}", copy.display()));
    format!("The settings of the last run could not be read, so the defaults are used{place}")
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::scene::SceneSource;

    #[derive(Default)]
    struct Memory(std::collections::HashMap<String, String>);

    impl Storage for Memory {
        fn get_string(&self, key: &str) -> Option<String> {
            self.0.get(key).cloned()
        }
        fn set_string(&mut self, key: &str, value: String) {
            self.0.insert(key.to_owned(), value);
        }
        fn remove_string(&mut self, key: &str) {
            self.0.remove(key);
        }
        fn flush(&mut self) {}
    }

    #[test]
    fn settings_survive_a_restart() {
        let mut wanted = Wanted::new(SceneSource::default_builtin());
        wanted.build.threshold = 17;
        let preferences = Preferences { greeted: true, ..Preferences::default() };
        let mut storage = Memory::default();
        keep(&mut storage, &wanted, &preferences);
        let restored = restore(Some(&storage), None);
        assert_eq!(restored.wanted, Some(wanted));
        assert_eq!(restored.preferences, Some(preferences));
        assert_eq!(restored.complaint, None);
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
