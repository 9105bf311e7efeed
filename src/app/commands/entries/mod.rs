//! The table of actions, one file per menu.

mod list;

mod file;
mod help;
mod lab;
mod tree;
mod view;

use std::sync::LazyLock;

use self::list::List;
use crate::app::commands::action::Action;
use crate::app::commands::entry::{Category, Entry};
use crate::app::state::AppState;
use crate::text::file_name;

/// All entries except recent files and trees, bookmarks and lessons, in the order of the menus.
pub fn entries() -> &'static [Entry] {
    static ENTRIES: LazyLock<Vec<Entry>> = LazyLock::new(|| {
        let mut list = List::default();
        file::add(&mut list);
        view::add(&mut list);
        tree::add(&mut list);
        lab::add(&mut list);
        help::add(&mut list);
        list.entries
    });
    &ENTRIES
}

/// All entries including the recent files and trees, bookmarks and lessons of `state`.
pub fn entries_for(state: &AppState) -> Vec<Entry> {
    let recent = state.preferences.recent.iter().enumerate().map(|(index, path)| Entry {
        action: Action::OpenRecent(index),
        label: format!("Open {}", file_name(path)),
        description: path.display().to_string(),
        category: Category::File,
        shortcuts: Vec::new(),
        group: 2,
        in_viewport: false,
    });
    let recent_trees = state.preferences.recent_trees.iter().enumerate().map(|(index, path)| Entry {
        action: Action::OpenRecentTree(index),
        label: format!("Open tree {}", file_name(path)),
        description: path.display().to_string(),
        category: Category::File,
        shortcuts: Vec::new(),
        group: 3,
        in_viewport: false,
    });
    let source = state.wanted.source.absolute();
    let bookmarks = state.preferences.bookmarks.iter().enumerate().map(|(index, known)| {
        let is_own = known.source == source;
        let model = if is_own { String::new() } else { format!(" of {}", known.source.label()) };
        Entry {
            action: Action::GoToBookmark(index),
            label: format!("Go to {}{model}", known.name),
            description: format!("A camera kept for {}", known.source),
            category: Category::View,
            shortcuts: Vec::new(),
            group: 1,
            in_viewport: false,
        }
    });
    let lessons = state.lessons.iter().enumerate().map(|(index, lesson)| Entry {
        action: Action::Lesson(index),
        label: format!("Lesson: {}", lesson.title),
        description: lesson.about.clone(),
        category: Category::Help,
        shortcuts: Vec::new(),
        group: 2,
        in_viewport: false,
    });
    entries().iter().cloned().chain(recent).chain(recent_trees).chain(bookmarks).chain(lessons).collect()
}
