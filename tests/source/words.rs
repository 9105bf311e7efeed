//! Sentences that were hard to read stay gone: phrases that have a better wording, and comments that begin with a relative clause.

use std::path::Path;

use crate::texts::below;

/// Phrases that no file has any more, each with what to write instead.
const PHRASES: &[(&str, &str)] = &[
    ("clusters that stand", "active clusters, as in the paper"),
    ("clusters standing", "active clusters, as in the paper"),
    ("these are the last so many", "ordered by distance, they are a cut through the tree"),
    ("slower and hardly another", "more slow the measurement down and hardly change it"),
    ("it stands here twice", "there are two implementations"),
    ("and that it does only", "a cluster searches again only when its bound is the smallest"),
    ("out of whose parent it sticks", "a node that extends beyond its parent"),
    ("which line they stand in", "line breaks matter only in names"),
    ("what remains to be done is", "unfinished ones stay in `open`"),
    ("as far as can be told", "may hold …; rounding can give false positives"),
    ("as the system told it", "as the operating system reported it"),
    ("ends when told", "stops on request"),
    ("what was the parent of", "the former grandparent"),
    ("is skipped without a word", "is ignored silently"),
    ("what is the same without them", "that change nothing in this renderer"),
    ("shown as what they are at least", "an index above the maximum is reported as that maximum"),
    ("what of a pasted state", "selection and hidden nodes of a pasted state"),
    ("made anew", "recomputed, rebuilt"),
    ("written anew", "changed, written again"),
    ("what quality takes to build", "how long better trees take to build"),
    ("in vain", "wasted"),
    ("lines through the root that nothing stops", "random, unoccluded lines through the root"),
    ("from either times its", "both are given multiplied by its surface area"),
    ("the user was last told", "how many … were last reported to the user"),
    ("casts no shadow that is seen", "its shadows are never visible"),
    ("is what engines compare by", "engines are compared by"),
    ("says what it is shown with", "stores the exposure it used"),
    ("it tells work", "it reports work"),
    ("belongs into", "belongs in"),
    ("lets go of", "drops"),
    ("tells the thread that asks", "a log with a per-thread `clock`"),
    ("so long after", "delay after"),
    ("what surfaces here do not have", "statements about …, by their names"),
    ("indices that no list can have", "an index above the maximum is reported as that maximum"),
    ("hits per cost of a subtree", "ratio of hits to cost"),
    ("of at most so many nodes", "at most `budget` nodes"),
];

/// Beginnings of a comment that put a clause where a noun belongs.
const BEGINNINGS: &[&str] = &["What ", "As told", "So long ", "So many "];

/// Folders that are read, with the extensions of their text.
const TEXTS: &[(&str, &[&str])] = &[
    ("src", &["rs"]),
    ("engine", &["rs", "md"]),
    ("benches", &["rs"]),
    ("shaders", &["wgsl"]),
    ("docs", &["md"]),
    ("assets", &["txt"]),
    ("examples", &["rs"]),
    ("python", &["rs", "py", "md"]),
];

/// The text of a comment line; `None` for other lines.
fn comment(line: &str) -> Option<&str> {
    let text = line.trim_start().strip_prefix("//")?;
    Some(text.strip_prefix(['/', '!']).unwrap_or(text).trim())
}

/// The lines joined to one in lower case, without the marks of comments, so that phrases are found across line breaks.
fn joined(text: &str) -> String {
    let lines = text.lines().map(|line| comment(line).unwrap_or(line).trim().trim_end_matches('\\'));
    let words = lines.flat_map(str::split_whitespace).collect::<Vec<_>>();
    words.join(" ").to_lowercase()
}

/// Each phrase and each beginning of `text` that has a better wording.
fn faults(text: &str) -> Vec<String> {
    let all = joined(text);
    let phrases = PHRASES
        .iter()
        .filter(|(phrase, _)| all.match_indices(phrase).any(|(at, _)| !all[..at].ends_with(char::is_alphanumeric)));
    let mut found: Vec<String> = phrases.map(|(phrase, better)| format!("'{phrase}': better '{better}'")).collect();
    let mut is_inside = false;
    for (number, line) in text.lines().enumerate() {
        let comment = comment(line);
        if let Some(sentence) = comment.filter(|_| !is_inside) {
            let is_clause =
                BEGINNINGS.iter().any(|beginning| sentence.starts_with(beginning) && !sentence.contains('?'));
            let is_whether_that = sentence.starts_with("Whether that ")
                || sentence.split('.').next().is_some_and(|first| {
                    first.starts_with("Whether ") && (first.contains(" so that ") || first.contains(" that is no "))
                });
            if is_clause || is_whether_that {
                found.push(format!("line {}: a comment begins with '{sentence}': name the thing", number + 1));
            }
        }
        is_inside = comment.is_some_and(|text| !text.is_empty());
    }
    found
}

#[test]
fn sentences_that_have_a_better_wording_are_gone() {
    let (mut count, mut found) = (0, Vec::new());
    for (folder, extensions) in TEXTS {
        for (path, text) in below(Path::new(folder), extensions) {
            count += 1;
            found.extend(faults(&text).iter().map(|fault| format!("{}: {fault}", path.display())));
        }
    }
    assert!(count > 400, "only {count} files were read");
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn a_bad_sentence_is_found_across_lines_and_within_them() {
    assert_eq!(faults("/// Number of clusters that\n/// stand now.\nfn f() {}").len(), 1);
    assert_eq!(faults("    // What the row holds.\n").len(), 1);
    assert_eq!(faults("/// Whether it is empty, so that nothing is drawn.\n").len(), 1);
    assert_eq!(faults("/// The number of rays,\n/// What a line break may begin with.\n"), [""; 0]);
    assert_eq!(faults("// The certain vainness begins. Whether it ends is open.\n"), [""; 0]);
}
