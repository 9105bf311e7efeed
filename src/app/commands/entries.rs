//! The table of actions as a list of entries, and the row of each action.

use std::sync::LazyLock;

use super::row::{Category, Entry, Items, Row};
use super::rows;
use crate::app::state::AppState;
use crate::app::state::action::Action;

/// All entries except recent files and trees, bookmarks and lessons, in the order of the menus.
pub fn entries() -> &'static [Entry] {
    static ENTRIES: LazyLock<Vec<Entry>> =
        LazyLock::new(|| all_rows().flat_map(|(category, group, row)| row.entries(category, group)).collect());
    &ENTRIES
}

/// All entries including the recent files and trees, bookmarks and lessons of `state`, in the order of the menus.
pub fn entries_for(state: &AppState) -> Vec<Entry> {
    let entries = all_rows().flat_map(|(category, group, row)| match row.items {
        Items::Current(items) => row.family(category, group, items(state)),
        _ => row.entries(category, group),
    });
    entries.collect()
}

fn current_entries(state: &AppState) -> impl Iterator<Item = Entry> {
    all_rows().flat_map(move |(category, group, row)| match row.items {
        Items::Current(items) => row.family(category, group, items(state)),
        _ => Vec::new(),
    })
}

fn all_rows() -> impl Iterator<Item = (Category, usize, &'static Row)> {
    Category::ALL.into_iter().flat_map(|category| {
        let groups = rows::groups(category).iter().enumerate();
        groups.flat_map(move |(group, rows)| rows.iter().map(move |row| (category, group, row)))
    })
}

impl Action {
    /// The row of the action and its index in it. `None` where its recent file, bookmark or lesson does not exist.
    fn row(self, state: &AppState) -> Option<(&'static Row, usize)> {
        let fixed = entries().iter().find(|entry| entry.action == self).map(|entry| (entry.row, entry.index));
        fixed
            .or_else(|| current_entries(state).find(|entry| entry.action == self).map(|entry| (entry.row, entry.index)))
    }

    /// The action can be performed now.
    pub fn is_enabled(self, state: &AppState) -> bool {
        self.row(state).is_some_and(|(row, index)| (row.enabled)(state, index))
    }

    /// State of a switch or choice; `None` for other actions.
    pub fn is_on(self, state: &AppState) -> Option<bool> {
        self.row(state).and_then(|(row, index)| (row.on)(state, index))
    }

    /// Performs the action.
    pub fn perform(self, state: &mut AppState) {
        if let Some((row, index)) = self.row(state) {
            (row.perform)(state, index);
        }
    }
}
