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

/// A number with a noun that stands in its plural, and in its singular where the number is 1. What follows the noun is kept, so
/// it must not depend on the number: "triangles left out", not "triangles are left out".
///
/// ```
/// use bvhscope::text::counted;
///
/// assert_eq!(counted(2, "vertices without a normal"), "2 vertices without a normal");
/// assert_eq!(counted(1, "vertices without a normal"), "1 vertex without a normal");
/// ```
pub fn counted(count: u64, plural: &str) -> String {
    let end = plural.find(|character: char| !character.is_ascii_alphabetic()).unwrap_or(plural.len());
    let (noun, rest) = plural.split_at(end);
    if count == 1 { format!("1 {}{rest}", singular(noun)) } else { format!("{count} {plural}") }
}

/// The singular of a noun as it occurs in messages; other words are kept.
fn singular(noun: &str) -> Cow<'_, str> {
    const IRREGULAR: [(&str, &str); 3] = [("vertices", "vertex"), ("indices", "index"), ("matrices", "matrix")];
    if let Some((_, one)) = IRREGULAR.iter().find(|(many, _)| *many == noun) {
        return Cow::Borrowed(one);
    }
    if let Some(stem) = noun.strip_suffix("ies") {
        return Cow::Owned(format!("{stem}y"));
    }
    let stem = noun.strip_suffix("es").filter(|stem| ["sh", "ch", "x", "ss"].iter().any(|end| stem.ends_with(end)));
    Cow::Borrowed(stem.or_else(|| noun.strip_suffix('s')).unwrap_or(noun))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_thing_is_named_in_the_singular() {
        for (many, one) in [
            ("triangles with a vertex out of range", "1 triangle with a vertex out of range"),
            ("vertices", "1 vertex"),
            ("indices left over", "1 index left over"),
            ("meshes", "1 mesh"),
            ("boxes", "1 box"),
            ("faces", "1 face"),
            ("libraries not found", "1 library not found"),
            ("texture sets", "1 texture sets"),
            ("", "1 "),
        ] {
            assert_eq!(counted(1, many), one);
            assert_eq!(counted(0, many), format!("0 {many}"));
        }
    }
}
