//! Text from outside (names in files, paths, arguments) as messages show it: printable and bounded.

use std::borrow::Cow;
use std::path::Path;

/// Characters of a name from a file that [`quoted`] keeps.
const MAX_QUOTED: usize = 60;

/// `text` with control characters and those that change the direction of text escaped, so that a name cannot drive a terminal.
///
/// ```
/// assert_eq!(bvhscope::text::printable("a\u{1b}[2Jé b"), "a\\u{1b}[2Jé b");
/// ```
pub fn printable(text: &str) -> Cow<'_, str> {
    if !text.contains(is_unprintable) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len());
    for character in text.chars() {
        if is_unprintable(character) {
            shown.extend(character.escape_default());
        } else {
            shown.push(character);
        }
    }
    Cow::Owned(shown)
}

/// Control characters, separators of lines, and the marks, embeddings and isolates of bidirectional text.
fn is_unprintable(character: char) -> bool {
    character.is_control()
        || matches!(character, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// A path as messages show it.
pub fn shown_path(path: &Path) -> String {
    printable(&path.to_string_lossy()).into_owned()
}

/// A name or number from a file in single quotes, without its rest where it is long.
///
/// ```
/// use bvhscope::text::quoted;
///
/// assert_eq!(quoted(b"wood"), "'wood'");
/// assert_eq!(quoted(b"\xff\0"), "'\u{fffd}\\u{0}'");
/// assert_eq!(quoted(&[b'7'; 300]).chars().count(), 63);
/// ```
pub fn quoted(name: impl AsRef<[u8]>) -> String {
    let bytes = name.as_ref();
    // A character has at most 4 bytes, so nothing beyond is looked at.
    let start = bytes.get(..4 * (MAX_QUOTED + 1)).unwrap_or(bytes);
    let text = String::from_utf8_lossy(start);
    let mut characters = text.chars();
    let kept: String = characters.by_ref().take(MAX_QUOTED).collect();
    let rest = if characters.next().is_some() { "…" } else { "" };
    format!("'{}{rest}'", printable(&kept))
}
