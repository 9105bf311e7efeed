//! Settings of the window that are saved between runs, with the recently opened files and the camera bookmarks: named cameras, each
//! of one model.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Deserializer, Serialize};

use crate::app::state::layout::{self, Dock};
use crate::app::state::paper::PaperPlan;
use crate::camera::Camera;
use crate::scene::SceneSource;

/// Colours of the window.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Theme {
    /// Light text on dark grey.
    Dark,
    /// Dark text on light grey.
    Light,
    /// The desktop's preference.
    System,
}

/// How mouse and keys move the camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Navigation {
    /// Around the target.
    Orbit,
    /// Through the scene, with W, A, S, D, Q and E.
    Fly,
}

/// Settings saved between runs, apart from [`crate::app::state::Wanted`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Preferences {
    /// Colours of the window.
    pub theme: Theme,
    /// How mouse and keys move the camera.
    pub navigation: Navigation,
    /// The traced picture is shown under the containers (key N).
    pub show_geometry: bool,
    /// Containers are drawn (key B).
    pub show_containers: bool,
    /// The left panel is open.
    pub left_open: bool,
    /// The right panel is open.
    pub right_open: bool,
    /// The dock above the depth bar.
    #[serde(alias = "paper_open", deserialize_with = "layout::dock_from_saved")]
    pub dock: Dock,
    /// Measurements of the view "Paper".
    pub paper: PaperPlan,
    /// Recently opened files, newest first.
    pub recent: Vec<PathBuf>,
    /// Recently opened tree files, newest first.
    pub recent_trees: Vec<PathBuf>,
    /// Cameras to come back to.
    #[serde(deserialize_with = "usable_bookmarks")]
    pub bookmarks: Vec<Bookmark>,
    /// The user has closed the line of help over the first scene.
    pub greeted: bool,
    /// The tour was shown; it does not come back by itself.
    pub toured: bool,
    /// Which sections of the side panels are expanded, by name.
    pub sections: BTreeMap<String, bool>,
}

impl Default for Preferences {
    fn default() -> Self {
        Self {
            theme: Theme::Dark,
            navigation: Navigation::Orbit,
            show_geometry: true,
            show_containers: true,
            left_open: true,
            right_open: true,
            dock: Dock::default(),
            paper: PaperPlan::default(),
            recent: Vec::new(),
            recent_trees: Vec::new(),
            bookmarks: Vec::new(),
            greeted: false,
            toured: false,
            sections: BTreeMap::new(),
        }
    }
}

/// Maximum length of the list.
const MAX_RECENT: usize = 10;

/// Moves a file to the head of the list. Built-in scenes are not listed.
pub fn remember(recent: &mut Vec<PathBuf>, source: &SceneSource) {
    // The next run may have another current folder.
    if let SceneSource::File(path) = source.absolute() {
        remember_file(recent, path);
    }
}

/// Moves a file, whose path is absolute, to the head of the list.
pub fn remember_file(recent: &mut Vec<PathBuf>, path: PathBuf) {
    recent.retain(|known| *known != path);
    recent.insert(0, path);
    recent.truncate(MAX_RECENT);
}

/// Maximum number of bookmarks of all models; the oldest goes first.
const MAX_BOOKMARKS: usize = 200;

/// A named camera of one model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Bookmark {
    /// The name, unique among the model's.
    pub name: String,
    /// The model that it was made for; files with their absolute path.
    pub source: SceneSource,
    /// The camera.
    pub camera: Camera,
}

/// Adds a bookmark of `camera` for `source` under the first free name "View N". Returns its name.
pub fn add_bookmark(bookmarks: &mut Vec<Bookmark>, source: &SceneSource, camera: Camera) -> String {
    let source = source.absolute();
    let is_taken = |name: &str| bookmarks.iter().any(|known| known.source == source && known.name == name);
    let name = (1..=bookmarks.len() + 1)
        .map(|number| format!("View {number}"))
        .find(|name| !is_taken(name))
        .unwrap_or_default();
    bookmarks.push(Bookmark { name: name.clone(), source, camera });
    if bookmarks.len() > MAX_BOOKMARKS {
        bookmarks.remove(0);
    }
    name
}

/// The bookmarks of `source` with their indices.
pub fn own_bookmarks<'a>(
    bookmarks: &'a [Bookmark],
    source: &SceneSource,
) -> impl Iterator<Item = (usize, &'a Bookmark)> {
    let source = source.absolute();
    bookmarks.iter().enumerate().filter(move |(_, known)| known.source == source)
}

/// The index of the bookmark of `source` that follows the one with this camera, the first one's where the camera is none of
/// them; `None` where the model has no bookmarks.
pub fn next_bookmark(bookmarks: &[Bookmark], source: &SceneSource, camera: &Camera) -> Option<usize> {
    let own: Vec<_> = own_bookmarks(bookmarks, source).collect();
    let present = own.iter().position(|(_, known)| known.camera == *camera);
    own.get(present.map_or(0, |place| (place + 1) % own.len())).map(|(index, _)| *index)
}

/// The bookmark of this name: `source`'s own, otherwise another model's.
pub fn find_bookmark<'a>(bookmarks: &'a [Bookmark], name: &str, source: &SceneSource) -> Option<&'a Bookmark> {
    let source = source.absolute();
    let named = || bookmarks.iter().filter(|known| known.name.eq_ignore_ascii_case(name));
    named().find(|known| known.source == source).or_else(|| named().next())
}

/// Reads the bookmarks that can be used and passes over all others, so that one that is damaged takes no setting with it.
fn usable_bookmarks<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<Bookmark>, D::Error> {
    let all = Vec::<serde_json::Value>::deserialize(from)?;
    let read = all.into_iter().filter_map(|value| serde_json::from_value::<Bookmark>(value).ok());
    Ok(read.filter(|known| known.camera.is_usable()).take(MAX_BOOKMARKS).collect())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::app::state::{Preferences, Wanted};
    use glam::Vec3;

    #[test]
    fn newest_file_comes_first_and_only_once() {
        let mut recent = Vec::new();
        for name in ["/a.obj", "/b.obj", "/a.obj"] {
            remember(&mut recent, &SceneSource::File(name.into()));
        }
        remember(&mut recent, &SceneSource::default_builtin());
        assert_eq!(recent, [PathBuf::from("/a.obj"), PathBuf::from("/b.obj")]);
    }

    #[test]
    fn list_is_bounded() {
        let mut recent = Vec::new();
        for i in 0..30 {
            remember(&mut recent, &SceneSource::File(format!("/{i}.obj").into()));
        }
        assert_eq!(recent.len(), MAX_RECENT);
    }

    fn camera(x: f32) -> Camera {
        Camera { eye: Vec3::new(x, 0.0, 5.0), ..Wanted::new(SceneSource::default_builtin()).camera }
    }

    #[test]
    fn each_model_has_its_own_names_and_order() {
        let (a, b) = (SceneSource::File("/a.obj".into()), SceneSource::File("/b.obj".into()));
        let mut all = Vec::new();
        assert_eq!(next_bookmark(&all, &a, &camera(0.0)), None);
        let names: Vec<String> = [(&a, 1.0), (&b, 2.0), (&a, 3.0)]
            .iter()
            .map(|(source, x)| add_bookmark(&mut all, source, camera(*x)))
            .collect();
        assert_eq!(names, ["View 1", "View 1", "View 2"]);
        assert_eq!(next_bookmark(&all, &a, &camera(9.0)), Some(0));
        assert_eq!(next_bookmark(&all, &a, &camera(1.0)), Some(2));
        assert_eq!(next_bookmark(&all, &a, &camera(3.0)), Some(0));
        assert_eq!(find_bookmark(&all, "view 1", &b).unwrap().camera, camera(2.0));
        assert_eq!(find_bookmark(&all, "View 2", &b).unwrap().source, a, "another model's, where there is no own");
        assert_eq!(find_bookmark(&all, "View 3", &a), None);
        all.remove(0);
        assert_eq!(add_bookmark(&mut all, &a, camera(4.0)), "View 1", "a free name");
        for x in 0..300 {
            add_bookmark(&mut all, &a, camera(x as f32));
        }
        assert_eq!(all.len(), MAX_BOOKMARKS);
    }

    #[test]
    fn a_damaged_bookmark_takes_nothing_with_it() {
        let mut preferences = Preferences { greeted: true, ..Preferences::default() };
        for x in [1.0, 2.0, 3.0] {
            add_bookmark(&mut preferences.bookmarks, &SceneSource::default_builtin(), camera(x));
        }
        let mut value = serde_json::to_value(&preferences).unwrap();
        value["bookmarks"][0]["camera"] = serde_json::json!({ "eye": "here" });
        // A camera at its own target looks nowhere.
        value["bookmarks"][1]["camera"]["eye"] = value["bookmarks"][1]["camera"]["target"].clone();
        let read: Preferences = serde_json::from_value(value.clone()).unwrap();
        assert_eq!(read.bookmarks, preferences.bookmarks[2..]);
        assert!(read.greeted);
        // Version 0.1 had none.
        value.as_object_mut().unwrap().remove("bookmarks");
        assert!(serde_json::from_value::<Preferences>(value).unwrap().bookmarks.is_empty());
    }
}
