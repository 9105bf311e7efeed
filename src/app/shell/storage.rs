//! Settings saved between runs. Damaged settings never prevent the program from starting.

use std::path::{Path, PathBuf};
use std::sync::Once;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::app::shell::files::{read_text, set_aside};
use crate::app::state::json::{difference, merge, plain_value};
use crate::app::state::preferences::{self, Bookmark};
use crate::app::state::{Preferences, Wanted};
use crate::export::{Protected, write_bytes};
use crate::scene::SceneSource;
use crate::text::shown_path;

/// Name of the application, and of its folder among the desktop's settings.
pub(crate) const APP_ID: &str = "bvhscope";
/// Name of the settings file in that folder.
pub(crate) const SETTINGS_FILE: &str = "settings.json";
/// Name of the file in that folder in which eframe saves position and size of the window.
pub(crate) const WINDOW_FILE: &str = "window.ron";

/// Delay after a change before the settings are written, so that further changes are written with it.
const SAVE_DELAY: Duration = Duration::from_millis(800);

/// Settings and preferences.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Settings {
    /// The settings of model, tree and picture.
    pub wanted: Wanted,
    /// The preferences.
    pub preferences: Preferences,
}

/// The settings of the last run; parts that are missing or damaged are `None`.
#[derive(Default)]
pub(crate) struct Restored {
    /// The settings of model, tree and picture.
    pub wanted: Option<Wanted>,
    /// The preferences.
    pub preferences: Option<Preferences>,
    /// Both with what held for the last run only, where that was anything.
    pub run: Option<Settings>,
    /// The warning to show where settings were damaged.
    pub warning: Option<String>,
}

impl Restored {
    const fn is_damaged(&self) -> bool {
        self.wanted.is_none() || self.preferences.is_none()
    }

    /// Those that were kept, for a run that begins with `source`; defaults for what is missing.
    pub(crate) fn kept(&self, source: &SceneSource) -> Settings {
        Settings {
            wanted: self.wanted.clone().unwrap_or_else(|| Wanted::new(source.clone())),
            preferences: self.preferences.clone().unwrap_or_default(),
        }
    }
}

/// Reads the settings of the last run from `file`.
pub(crate) fn restore(file: Option<&Path>) -> Restored {
    let Some(file) = file else { return Restored::default() };
    let mut restored = match read_text(file) {
        Ok(text) => parse(&text),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Restored::default(),
        Err(_) => Restored::default(),
    };
    if restored.is_damaged() {
        restored.warning = Some(set_damaged_aside(file));
    }
    restored
}

/// Writes the settings soon after each change, so that little is lost even where the process ends abnormally.
#[derive(Default)]
pub(crate) struct SettingsAutosave {
    file: Option<PathBuf>,
    /// The settings before and after the flags of this run.
    start: Option<[Settings; 2]>,
    /// The settings last written.
    saved: Option<(Wanted, Preferences)>,
    /// When a change is to be written.
    due: Option<Instant>,
    writer: Option<JoinHandle<()>>,
}

impl SettingsAutosave {
    /// Saves settings in `file`; `None` saves none.
    pub(crate) fn new(file: Option<PathBuf>) -> Self {
        Self { file, ..Self::default() }
    }

    /// Saves settings without what the flags of this run have made of the `kept` ones: `started`.
    pub(crate) fn without_flags(self, kept: Settings, started: Settings) -> Self {
        Self { start: Some([kept, started]), ..self }
    }

    /// The settings of the next run: those of `now` that are no longer as this run started, and of the others those that were kept.
    fn kept(&self, now: &Settings) -> Settings {
        let Some([kept, started]) = &self.start else { return now.clone() };
        let [before, at_start, wanted] = [kept, started, now].map(|settings| &settings.wanted);
        let build = changed(&before.build, &at_start.build, &wanted.build);
        Settings {
            wanted: Wanted {
                // A builder and a container from two runs may exclude each other.
                build: if build.refusal(0).is_some() { wanted.build } else { build },
                threads: changed(&before.threads, &at_start.threads, &wanted.threads),
                render: changed(&before.render, &at_start.render, &wanted.render),
                overlay: changed(&before.overlay, &at_start.overlay, &wanted.overlay),
                second: changed(&before.second, &at_start.second, &wanted.second),
                ..wanted.clone()
            },
            preferences: changed(&kept.preferences, &started.preferences, &now.preferences),
        }
    }

    /// Writes the settings on a thread of its own once a change is due, unless their file is one of those that were `read`.
    /// Returns the delay after which this is to be called again.
    pub(crate) fn save_if_due(
        &mut self,
        wanted: &Wanted,
        preferences: &Preferences,
        read: &[PathBuf],
        now: Instant,
    ) -> Option<Duration> {
        if self.file.is_none() || self.has_saved(wanted, preferences) {
            self.due = None;
            return None;
        }
        let due = *self.due.get_or_insert(now + SAVE_DELAY);
        if now < due {
            return Some(due - now);
        }
        if self.writer.as_ref().is_some_and(|writer| !writer.is_finished()) {
            // The previous write is not finished: on a slow disk it must not overwrite this one.
            return Some(SAVE_DELAY);
        }
        self.due = None;
        let write = self.next_write(wanted, preferences, read)?;
        match std::thread::Builder::new().name("settings".to_owned()).spawn(write) {
            Ok(writer) => self.writer = Some(writer),
            Err(error) => {
                log::warn!("the settings are written later: {error}");
                self.saved = None;
            }
        }
        None
    }

    /// Writes unsaved settings and waits until they are written: before the process ends.
    pub(crate) fn finish(&mut self, wanted: &Wanted, preferences: &Preferences, read: &[PathBuf]) {
        if let Some(writer) = self.writer.take() {
            let _ = writer.join();
        }
        if let Some(write) = self.next_write(wanted, preferences, read) {
            write();
        }
    }

    fn has_saved(&self, wanted: &Wanted, preferences: &Preferences) -> bool {
        self.saved.as_ref().is_some_and(|saved| saved.0 == *wanted && saved.1 == *preferences)
    }

    /// A function that writes these settings; `None` where they are written already.
    fn next_write(
        &mut self,
        wanted: &Wanted,
        preferences: &Preferences,
        read: &[PathBuf],
    ) -> Option<impl FnOnce() + Send + use<>> {
        let file = self.file.clone().filter(|_| !self.has_saved(wanted, preferences))?;
        self.saved = Some((wanted.clone(), preferences.clone()));
        let now = Settings { wanted: wanted.clone(), preferences: preferences.clone() };
        let kept = self.kept(&now);
        let run = Some(now).filter(|now| *now != kept);
        let text = serde_json::to_string(&SavedSettings { kept, run });
        let mut protected = Protected::default();
        protected.add_read(read);
        Some(move || {
            let text = text.map_err(|error| error.to_string());
            let written = text
                .and_then(|text| write_bytes(&file, &protected, text.as_bytes()).map_err(|error| error.to_string()));
            if let Err(error) = written {
                // Logged once, and not at each change.
                static LOGGED: Once = Once::new();
                LOGGED.call_once(|| log::warn!("the settings were not saved: {error}"));
            }
        })
    }
}

/// The saved bookmark of this name: `source`'s own, otherwise another model's. `Err` has the names of the model's bookmarks.
pub fn saved_bookmark(name: &str, source: &SceneSource) -> Result<Bookmark, Vec<String>> {
    let file = eframe::storage_dir(APP_ID).map(|folder| folder.join(SETTINGS_FILE));
    let text = file.and_then(|file| read_text(&file).ok()).unwrap_or_default();
    let bookmarks = parse(&text).preferences.unwrap_or_default().bookmarks;
    preferences::find_bookmark(&bookmarks, name, source)
        .cloned()
        .ok_or_else(|| preferences::own_bookmarks(&bookmarks, source).map(|(_, known)| known.name.clone()).collect())
}

#[derive(Serialize)]
struct SavedSettings {
    #[serde(flatten)]
    kept: Settings,
    #[serde(skip_serializing_if = "Option::is_none")]
    run: Option<Settings>,
}

/// `kept` with the changes from `started` to `now`.
fn changed<T: Serialize + DeserializeOwned + Clone>(kept: &T, started: &T, now: &T) -> T {
    let mut value = plain_value(kept);
    if let Some(changes) = difference(&plain_value(started), plain_value(now)) {
        merge(&mut value, changes);
    }
    serde_json::from_value(value).unwrap_or_else(|_| now.clone())
}

fn parse(text: &str) -> Restored {
    // Values first, so that damage to one part leaves the other usable.
    #[derive(Deserialize)]
    struct Parts {
        wanted: Value,
        preferences: Value,
        #[serde(default)]
        run: Value,
    }
    let Ok(parts) = serde_json::from_str::<Parts>(text) else { return Restored::default() };
    let limited = |mut preferences: Preferences| {
        preferences.paper.limit();
        preferences
    };
    let wanted = serde_json::from_value(parts.wanted).ok().map(Wanted::within_limits);
    let preferences = serde_json::from_value(parts.preferences).ok().map(limited);
    let run = serde_json::from_value::<Settings>(parts.run)
        .ok()
        .map(|run| Settings { wanted: run.wanted.within_limits(), preferences: limited(run.preferences) });
    Restored { wanted, preferences, run, warning: None }
}

/// Sets a damaged file aside, or whatever else is in its place. Returns the warning to show.
fn set_damaged_aside(file: &Path) -> String {
    let kept = set_aside(file).ok();
    let remains =
        kept.map_or(String::new(), |kept| format!(". What was in their place is kept as {}", shown_path(&kept)));
    format!("The settings of the last run could not be read, so the defaults are used{remains}")
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::app::state::{Navigation, Theme};
    use crate::catalog::metrics::AREA;
    use crate::overlay::{ColorBy, ContainerSet, OverlaySettings};
    use bvhscope_engine::settings::{BuildSettings, BuilderKind, Curve};
    use bvhscope_engine::tree::ContainerKind;

    #[test]
    fn settings_survive_a_restart() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(SETTINGS_FILE);
        let mut wanted = Wanted::new(SceneSource::default_builtin());
        wanted.build.threshold = 17;
        let preferences = Preferences { greeted: true, ..Preferences::default() };
        SettingsAutosave::new(Some(file.clone())).finish(&wanted, &preferences, &[]);
        let restored = restore(Some(&file));
        assert_eq!(restored.wanted, Some(wanted));
        assert_eq!(restored.preferences, Some(preferences));
        assert_eq!(restored.warning, None);
    }

    #[test]
    fn flags_hold_for_one_run_and_changes_by_hand_for_all() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(SETTINGS_FILE);
        let mut kept = Restored::default().kept(&SceneSource::default_builtin());
        kept.wanted.render.samples = 4;
        kept.wanted.build.container = ContainerKind::Sphere;
        kept.preferences.show_geometry = false;
        let mut started = kept.clone();
        started.wanted.render.samples = 16;
        started.wanted.overlay =
            OverlaySettings { leaves_only: true, color_by: ColorBy::Planes, ..kept.wanted.overlay };
        started.wanted.build = BuildSettings { builder: BuilderKind::BinnedSah, ..BuildSettings::default() };
        started.preferences.show_geometry = true;
        let mut now = started.clone();
        now.wanted.overlay.color_by = ColorBy::Metric(AREA);
        now.wanted.overlay.line_width = 3.0;
        now.wanted.build.curve = Curve::Hilbert;
        now.wanted.camera.eye.x = 7.0;
        SettingsAutosave::new(Some(file.clone())).without_flags(kept.clone(), started.clone()).finish(
            &now.wanted,
            &now.preferences,
            &[],
        );
        let restored = restore(Some(&file));
        let mut expected = kept.clone();
        expected.wanted.overlay.color_by = ColorBy::Metric(AREA);
        expected.wanted.overlay.line_width = 3.0;
        expected.wanted.build.curve = Curve::Hilbert;
        expected.wanted.camera.eye.x = 7.0;
        assert_eq!(restored.kept(&SceneSource::default_builtin()), expected);
        assert_eq!(restored.run, Some(now.clone()), "to go on with after the graphics driver was lost");
        // A builder chosen by hand that makes no trees of the container that was kept.
        started.wanted.build = BuildSettings::default();
        now.wanted.build = BuildSettings { builder: BuilderKind::BinnedSah, ..started.wanted.build };
        SettingsAutosave::new(Some(file.clone())).without_flags(kept, started).finish(
            &now.wanted,
            &now.preferences,
            &[],
        );
        assert_eq!(restore(Some(&file)).wanted.unwrap().build, now.wanted.build);
    }

    #[test]
    fn settings_are_not_written_over_a_model() {
        let folder = tempfile::tempdir().unwrap();
        let (file, texture) = (folder.path().join(SETTINGS_FILE), folder.path().join("texture.png"));
        std::fs::write(&texture, "read").unwrap();
        std::fs::hard_link(&texture, &file).unwrap();
        let (wanted, preferences) = (Wanted::new(SceneSource::default_builtin()), Preferences::default());
        SettingsAutosave::new(Some(file.clone())).finish(&wanted, &preferences, &[texture]);
        assert_eq!(std::fs::read_to_string(file).unwrap(), "read");
    }

    #[test]
    fn a_continuous_change_is_written_at_intervals() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(SETTINGS_FILE);
        let (mut wanted, preferences) = (Wanted::new(SceneSource::default_builtin()), Preferences::default());
        let mut autosave = SettingsAutosave::new(Some(file.clone()));
        let start = Instant::now();
        let mut writes = 0;
        // A slider is dragged at 30 frames per second.
        for frame in 0..60 {
            wanted.build.threshold = 2 + frame;
            let again = autosave.save_if_due(&wanted, &preferences, &[], start + Duration::from_millis(33) * frame);
            writes += u32::from(again.is_none());
            if let Some(writer) = autosave.writer.take_if(|_| again.is_none()) {
                writer.join().unwrap();
                assert_eq!(restore(Some(&file)).wanted, Some(wanted.clone()));
            }
        }
        assert_eq!(writes, 2, "not once a frame");
        let end = start + Duration::from_secs(10);
        autosave.save_if_due(&wanted, &preferences, &[], end);
        assert_eq!(autosave.save_if_due(&wanted, &preferences, &[], end + SAVE_DELAY), None);
        autosave.writer.take().unwrap().join().unwrap();
        assert_eq!(restore(Some(&file)).wanted, Some(wanted.clone()));
        assert_eq!(autosave.save_if_due(&wanted, &preferences, &[], end + 9 * SAVE_DELAY), None);
        assert!(autosave.writer.is_none(), "what is written already is not written again");
    }

    #[test]
    fn damaged_settings_give_defaults() {
        for text in ["", "{", "null", "[]", "{\"wanted\":3,\"preferences\":{}}"] {
            let restored = parse(text);
            assert!(restored.wanted.is_none(), "{text}");
            assert!(restored.is_damaged(), "{text}");
        }
    }

    #[test]
    fn numbers_are_clamped_to_their_ranges() {
        let mut wanted = Wanted::new(SceneSource::default_builtin());
        wanted.build.threshold = 1_000_000;
        wanted.camera.eye = wanted.camera.target;
        let limited = wanted.within_limits();
        assert_eq!(limited.build.threshold, BuildSettings::MAX_THRESHOLD);
        assert!(limited.camera.distance() > 0.0);
    }

    /// The settings that version 0.1 wrote.
    #[test]
    fn settings_of_version_0_1_are_kept() {
        let text = r#"{"wanted":{"source":{"File":"/models/bunny.obj"},
            "build":{"builder":"aac","container":"sphere","threshold":12,"epsilon":0.1,"curve":"hilbert","optimize":["collapse","reinsert"]},
            "threads":2,
            "camera":{"eye":[1.0,2.0,3.0],"target":[0.0,0.5,0.0],"up":[0.0,1.0,0.0],"fov_y":0.7,"projection":"Perspective"},
            "render":{"shading":{"heat":"both"},"light":"headlight","cluster_depth":9,"traversal":"paper",
                "heat_range":[0.0,80.0],"color_map":"turbo","mesh_edges":true,"samples":4},
            "overlay":{"show_boxes":false,"show_spheres":true,"depth":[3,8],"leaves_only":true,"parents":false,
                "color_by":"size","hidden_alpha":0.3,"line_width":2.0,"budget":4000}},
            "preferences":{"theme":"Light","navigation":"Fly","show_geometry":true,"show_containers":false,
                "left_open":false,"right_open":true,"paper_open":true,
                "paper":{"experiment":"Threads","display":"Plots","containers":["box"],"traversal":"ordered",
                    "default_camera":false,"side_px":512,"repeat":5,"thresholds":[4,10],"epsilons":[0.2],"no_bvh":false},
                "recent":["/models/bunny.obj"],"greeted":true}}"#;
        let restored = parse(text);
        assert!(!restored.is_damaged());
        let (wanted, preferences) = (restored.wanted.unwrap(), restored.preferences.unwrap());
        assert_eq!(wanted.source, SceneSource::File("/models/bunny.obj".into()));
        assert_eq!((wanted.build.threshold, wanted.build.container.name(), wanted.threads), (12, "sphere", 2));
        assert_eq!((wanted.camera.eye.x, wanted.camera.fov_y), (1.0, 0.7));
        assert_eq!((wanted.render.shading.name(), wanted.render.heat_range), ("heat", Some([0.0, 80.0])));
        let OverlaySettings { containers, depth, leaves_only, color_by, .. } = wanted.overlay;
        assert_eq!(color_by, ColorBy::Metric(AREA));
        let spheres = ContainerSet::of(ContainerKind::Sphere);
        assert_eq!((containers, depth, leaves_only), (spheres, Some([3, 8]), true));
        assert_eq!((preferences.theme, preferences.navigation), (Theme::Light, Navigation::Fly));
        assert_eq!((preferences.recent.len(), preferences.paper.side_px, preferences.left_open), (1, 512, false));
    }
}
