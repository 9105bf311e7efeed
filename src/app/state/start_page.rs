//! The start page: small pictures of models, and the field in which a path is typed, with what the folder offers to
//! complete it.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::second_tree::TreeSide;
use crate::scene::SceneSource;

/// Maximum number of completions that are offered.
const MAX_OFFERED: usize = 8;

/// A path being typed.
#[derive(Debug, Clone, Default)]
pub struct PathField {
    /// The text.
    pub text: String,
    /// Where the desktop offers no file dialog: what to do instead.
    pub asked_for: Option<&'static str>,
    /// The tree that is read from the path; `None` where it is that of a model.
    pub tree: Option<TreeSide>,
    /// The field is to take the keyboard focus.
    pub wants_focus: bool,
    /// The whole text is to be selected as well, so that typing replaces it.
    pub selects_all: bool,
    /// Index of the chosen one of [`PathField::offered`].
    pub chosen: Option<usize>,
    /// The folder whose entries were requested last.
    pub requested: Option<PathBuf>,
    /// The entries of a folder.
    pub listing: Option<Listing>,
}

/// Models and folders in a folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Listing {
    /// The folder.
    pub folder: PathBuf,
    /// Its folders, then its models, each in alphabetical order.
    pub entries: Vec<FolderEntry>,
}

/// A model or folder in a folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FolderEntry {
    /// Its name without the folder.
    pub name: String,
    /// It is a folder.
    pub is_folder: bool,
}

impl FolderEntry {
    /// The name, with a slash behind a folder's.
    pub fn shown(&self) -> String {
        if self.is_folder { format!("{}/", self.name) } else { self.name.clone() }
    }
}

impl PathField {
    /// The typed path; a leading `~` stands for the home folder.
    pub fn path(&self) -> PathBuf {
        expand(self.text.trim(), std::env::home_dir().as_deref())
    }

    /// The folder in which the last name of the text is completed.
    pub fn folder(&self) -> PathBuf {
        match self.split().0 {
            "" if self.text.trim() == "~" => self.path(),
            "" => PathBuf::from("."),
            folder => expand(folder, std::env::home_dir().as_deref()),
        }
    }

    /// The entries that begin with the last name of the text, in whatever case. Hidden ones only where it begins with a dot.
    pub fn offered(&self) -> Vec<FolderEntry> {
        let Some(listing) = self.listing.as_ref().filter(|listing| listing.folder == self.folder()) else {
            return Vec::new();
        };
        let name = self.split().1.to_lowercase();
        let is_tree = |name: &str| name.to_lowercase().ends_with(".bvh");
        let fits = |entry: &&FolderEntry| {
            (self.tree.is_none() || entry.is_folder || is_tree(&entry.name))
                && entry.name.to_lowercase().starts_with(&name)
                && (name.starts_with('.') || !entry.name.starts_with('.'))
        };
        listing.entries.iter().filter(fits).take(MAX_OFFERED).cloned().collect()
    }

    /// Completes the last name: with the chosen entry, else with what all entries have in common.
    pub fn complete(&mut self) {
        let offered = self.offered();
        let chosen = self.chosen.and_then(|index| offered.get(index));
        let completed = match (chosen, &offered[..]) {
            (Some(entry), _) | (None, [entry]) => entry.shown(),
            (None, []) => return,
            (None, [first, rest @ ..]) => rest.iter().fold(first.name.clone(), |common, entry| {
                let same = common.chars().zip(entry.name.chars()).take_while(|(a, b)| a.eq_ignore_ascii_case(b));
                same.map(|(a, _)| a).collect()
            }),
        };
        let (folder, name) = self.split();
        if completed.len() >= name.len() {
            self.text = format!("{folder}{completed}");
        }
        self.chosen = None;
    }

    /// Moves the choice by a step among what is offered.
    pub fn choose(&mut self, step: i32) {
        let count = self.offered().len();
        self.chosen = match self.chosen {
            _ if count == 0 => None,
            None => Some(if step > 0 { 0 } else { count - 1 }),
            Some(index) => Some(index.saturating_add_signed(step as isize).min(count - 1)),
        };
    }

    /// Completes with an entry, and returns the path where it is a file.
    pub fn take(&mut self, entry: &FolderEntry) -> Option<PathBuf> {
        let folder = self.split().0.to_owned();
        self.text = format!("{folder}{}", entry.shown());
        self.chosen = None;
        (!entry.is_folder).then(|| self.path())
    }

    /// The text up to the last slash, and the name behind it.
    fn split(&self) -> (&str, &str) {
        let text = self.text.trim();
        let is_separator = |c: char| c == '/' || (cfg!(windows) && c == '\\');
        match text.rfind(is_separator) {
            Some(at) => text.split_at(at + 1),
            None if text == "~" => ("", ""),
            None => ("", text),
        }
    }
}

/// `text` as a path, with `home` in place of a leading `~`.
fn expand(text: &str, home: Option<&Path>) -> PathBuf {
    match (text.strip_prefix('~'), home) {
        (Some(""), Some(home)) => home.to_owned(),
        (Some(rest), Some(home)) if rest.starts_with(['/', '\\']) => home.join(&rest[1..]),
        _ => PathBuf::from(text),
    }
}

/// Width and height of a thumbnail in pixels.
pub const THUMBNAIL_SIZE: [u32; 2] = [192, 120];

/// A small picture of a model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Thumbnail {
    /// sRGB RGBA, row by row from the top left, [`THUMBNAIL_SIZE`] pixels.
    pub rgba: Vec<[u8; 4]>,
}

/// The thumbnails known so far.
#[derive(Debug, Clone, Default)]
pub struct Thumbnails {
    known: HashMap<SceneSource, Arc<Thumbnail>>,
}

impl Thumbnails {
    /// The thumbnail of a model, once it is known.
    pub fn get(&self, source: &SceneSource) -> Option<&Arc<Thumbnail>> {
        self.known.get(source)
    }

    /// Adds or replaces the thumbnail of a model.
    pub fn insert(&mut self, source: SceneSource, thumbnail: Thumbnail) {
        self.known.insert(source, Arc::new(thumbnail));
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    fn field(text: &str, names: &[&str]) -> PathField {
        let mut field = PathField { text: text.to_owned(), ..PathField::default() };
        let entry =
            |name: &&str| FolderEntry { name: name.trim_end_matches('/').to_owned(), is_folder: name.ends_with('/') };
        field.listing = Some(Listing { folder: field.folder(), entries: names.iter().map(entry).collect() });
        field
    }

    #[test]
    fn a_tilde_is_the_home_folder() {
        let home = Path::new("/home/ada");
        let expanded = |text: &str| expand(text, Some(home));
        assert_eq!(expanded("~"), home);
        assert_eq!(expanded("~/models/a.obj"), home.join("models/a.obj"));
        assert_eq!(expanded("~other/a.obj"), Path::new("~other/a.obj"));
        assert_eq!(expanded("a~b.obj"), Path::new("a~b.obj"));
        assert_eq!(expand("~/a.obj", None), Path::new("~/a.obj"));
    }

    #[test]
    fn names_are_completed_as_far_as_they_agree() {
        let names = ["models/", "bunny.obj", "bunny-high.ply", ".hidden.obj"];
        let completed = |text: &str| {
            let mut field = field(text, &names);
            field.complete();
            field.text
        };
        assert_eq!(completed("/data/mo"), "/data/models/");
        assert_eq!(completed("/data/BU"), "/data/bunny");
        assert_eq!(completed("/data/bunny.o"), "/data/bunny.obj");
        assert_eq!(completed("/data/xyz"), "/data/xyz");
        let offered = |text: &str| field(text, &names).offered().len();
        assert_eq!([offered("/data/"), offered("/data/."), offered("b")], [3, 1, 2]);
    }

    #[test]
    fn only_trees_are_offered_for_a_tree() {
        let names = ["a/", "bunny.obj", "bunny.BVH"];
        let field = PathField { tree: Some(TreeSide::A), ..field("/data/", &names) };
        let offered: Vec<String> = field.offered().iter().map(FolderEntry::shown).collect();
        assert_eq!(offered, ["a/", "bunny.BVH"]);
    }

    #[test]
    fn a_chosen_entry_is_taken() {
        let mut field = field("/data/b", &["a/", "bunny.obj", "box/"]);
        field.choose(-1);
        assert_eq!(field.chosen, Some(1));
        field.choose(-1);
        let entry = field.offered()[field.chosen.unwrap()].clone();
        assert_eq!(field.take(&entry), Some(PathBuf::from("/data/bunny.obj")));
        let folder = FolderEntry { name: "box".to_owned(), is_folder: true };
        assert_eq!((field.take(&folder), field.text.as_str()), (None, "/data/box/"));
    }

    #[test]
    fn entries_of_another_folder_are_not_offered() {
        let mut field = field("/data/b", &["bunny.obj"]);
        assert_eq!(field.offered().len(), 1);
        field.text = "/other/b".to_owned();
        assert!(field.offered().is_empty());
    }
}
