//! Settings of the window that are saved between runs, with the recently opened files.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::app::state::bookmarks::{self, Bookmark};
use crate::app::state::layout::{self, Dock};
use crate::app::state::paper::PaperPlan;
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
    /// What the view "Paper" measures.
    pub paper: PaperPlan,
    /// Recently opened files, newest first.
    pub recent: Vec<PathBuf>,
    /// Recently opened tree files, newest first.
    pub recent_trees: Vec<PathBuf>,
    /// Cameras to come back to.
    #[serde(deserialize_with = "bookmarks::usable")]
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

#[cfg(test)]
mod tests {
    use super::*;

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
}
