//! The table of actions as a list of entries, the row of each action, and fuzzy search for the command palette.

use std::cmp::Reverse;
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

/// Score of a letter that follows the previous one directly.
const CONSECUTIVE: i32 = 8;
/// Score of a letter at the beginning of a word.
const WORD_START: i32 = 6;
/// Maximum penalty for letters skipped before one.
const MAX_GAP_PENALTY: usize = 5;

/// The entries whose labels match `query`, best first; all of them in their own order for an empty query.
pub fn search(entries: Vec<Entry>, query: &str) -> Vec<Entry> {
    let mut found: Vec<(i32, Entry)> =
        entries.into_iter().filter_map(|entry| Some((fuzzy_score(query, &entry.label)?, entry))).collect();
    if !query.trim().is_empty() {
        found.sort_by_key(|(score, _)| Reverse(*score));
    }
    found.into_iter().map(|(_, entry)| entry).collect()
}

/// How well `text` matches `query`: the letters of the query must occur in their order, and score higher where they begin words
/// or follow each other. Shorter texts score slightly higher. `None` where a letter is missing.
fn fuzzy_score(query: &str, text: &str) -> Option<i32> {
    let text: Vec<char> = text.to_lowercase().chars().collect();
    let mut score = 0;
    let mut start = 0;
    let mut previous = None;
    for letter in query.to_lowercase().chars().filter(|letter| !letter.is_whitespace()) {
        let candidates = text.iter().enumerate().skip(start).filter(|(_, other)| **other == letter);
        let (best, points) = candidates
            .map(|(at, _)| {
                let consecutive = previous.is_some_and(|previous: usize| at == previous + 1);
                let word_start = at == 0 || !text[at - 1].is_alphanumeric();
                let bonus = match (consecutive, word_start) {
                    (true, _) => CONSECUTIVE,
                    (false, true) => WORD_START,
                    (false, false) => 0,
                };
                (at, bonus - (at - start).min(MAX_GAP_PENALTY) as i32)
            })
            .max_by_key(|&(at, points)| (points, Reverse(at)))?;
        score += points;
        previous = Some(best);
        start = best + 1;
    }
    Some(score - text.len() as i32 / 8)
}
