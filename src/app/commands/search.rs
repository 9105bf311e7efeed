//! Fuzzy search over the entries, for the command palette.

use std::cmp::Reverse;

use super::row::Entry;

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
