//! Sentences that were hard to read, and were written again, do not come back.

use std::path::Path;

use crate::files::below;

/// Parts of former sentences. Code returns, reads, holds and drops; it does not tell, ask, say or know.
const FORMER: [&str; 32] = [
    "as far as can be told",
    "as the system told it",
    "ends when told",
    "What was the parent of its parent",
    "is skipped without a word",
    "what surfaces here do not have",
    "Indices that no list can have",
    "What of a pasted state",
    "made anew only where",
    "what quality takes to build",
    "What was in vain",
    "make a measurement slower and hardly another",
    "more make a measurement slower",
    "that nothing stops",
    "Hits per cost of a subtree",
    "of which the user was last told",
    "casts no shadow that is seen",
    "clusters that stand",
    "Ready to trace is what",
    "a frame says what it is shown with",
    "It tells work",
    "belongs into",
    "lets go of the one",
    "these are the last so many",
    "It stands here twice",
    "and that it does only",
    "out of whose parent it sticks",
    "which line they stand in",
    "of at most so many nodes",
    "What remains to be done is",
    "What becomes of a node",
    "So long after a tree",
];

#[test]
fn former_sentences_do_not_come_back() {
    let mut found = Vec::new();
    for folder in ["src", "engine", "shaders", "docs", "benches", "examples"] {
        for (path, text) in below(Path::new(folder), &["rs", "md", "wgsl"]) {
            // Comments break lines anywhere.
            let words: String = text.replace("//!", " ").replace("///", " ").replace("//", " ");
            let words = words.split_whitespace().collect::<Vec<_>>().join(" ");
            found.extend(
                FORMER
                    .iter()
                    .filter(|former| words.contains(*former))
                    .map(|former| format!("{}: {former}", path.display())),
            );
        }
    }
    assert!(found.is_empty(), "write these sentences again:\n{}", found.join("\n"));
}
