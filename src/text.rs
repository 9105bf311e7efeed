//! Text from outside (names in files, paths, arguments) as messages show it: printable and bounded. And points and directions as
//! users type them.

use std::borrow::Cow;
use std::path::Path;

use glam::{DVec3, Vec3};

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

/// Control characters, separators of lines, the marks, embeddings and isolates of bidirectional text, and characters without
/// width, of which a byte order mark is one.
fn is_unprintable(character: char) -> bool {
    character.is_control()
        || matches!(character, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{2069}' | '\u{feff}')
}

/// A path as messages show it.
pub fn shown_path(path: &Path) -> String {
    printable(&path_text(path)).into_owned()
}

/// A path as text. Bytes of a name that is not UTF-8 are escaped, so that names that differ look different.
///
/// ```
/// assert_eq!(bvhscope::text::path_text("a/é.obj".as_ref()), "a/é.obj");
/// # #[cfg(unix)] {
/// # use std::os::unix::ffi::OsStrExt as _;
/// let name = std::ffi::OsStr::from_bytes(b"\xe9.obj");
/// assert_eq!(bvhscope::text::path_text(name.as_ref()), r"\xe9.obj");
/// # }
/// ```
pub fn path_text(path: &Path) -> Cow<'_, str> {
    if let Some(text) = path.to_str() {
        return Cow::Borrowed(text);
    }
    let mut text = String::new();
    for part in path.as_os_str().as_encoded_bytes().utf8_chunks() {
        text.push_str(part.valid());
        text.extend(part.invalid().iter().map(|byte| format!("\\x{byte:02x}")));
    }
    Cow::Owned(text)
}

/// `text` without its middle part where it is long: the first and the last of its bytes, as many as `kept`.
///
/// ```
/// assert_eq!(bvhscope::text::without_middle("from here to there", [4, 5]), "from … there");
/// ```
pub fn without_middle(text: &str, kept: [usize; 2]) -> Cow<'_, str> {
    let end = text.ceil_char_boundary(text.len().saturating_sub(kept[1]));
    let start = text.floor_char_boundary(kept[0]);
    match (text.get(..start), text.get(end..)) {
        (Some(head), Some(tail)) if start < end => Cow::Owned(format!("{head} … {tail}")),
        _ => Cow::Borrowed(text),
    }
}

/// Name of a file without its folder; the whole path where it ends in none.
pub fn file_name(path: &Path) -> Cow<'_, str> {
    path_text(path.file_name().map_or(path, Path::new))
}

/// A name or number from a file in single quotes, without its rest where it is long.
///
/// ```
/// use bvhscope::text::quoted;
///
/// assert_eq!(quoted(b"wood"), "'wood'");
/// assert_eq!(quoted(b"\xff\0"), "'\u{fffd}\\u{0}'");
/// assert_eq!(quoted("0\u{a0}1 2"), "'0\\u{a0}1 2'");
/// assert_eq!(quoted(&[b'7'; 300]).chars().count(), 63);
/// ```
pub fn quoted(name: impl AsRef<[u8]>) -> String {
    let bytes = name.as_ref();
    // A character has at most 4 bytes, so nothing beyond is looked at.
    let start = bytes.get(..4 * (MAX_QUOTED + 1)).unwrap_or(bytes);
    let text = String::from_utf8_lossy(start);
    let kept = cut(&text, MAX_QUOTED + 1);
    // Spaces of other kinds would be shown as the one that they are not.
    let is_other_space = |character: char| character != ' ' && character.is_whitespace() || character == '\u{ad}';
    if !kept.contains(is_other_space) {
        return format!("'{}'", printable(&kept));
    }
    let shown = kept.split_inclusive(is_other_space).flat_map(|part| {
        let space = part.chars().next_back().filter(|&last| is_other_space(last));
        let before = part.strip_suffix(is_other_space).unwrap_or(part);
        [printable(before), space.map_or(Cow::Borrowed(""), |space| space.escape_default().to_string().into())]
    });
    format!("'{}'", shown.collect::<String>())
}

/// `text`, ended by an ellipsis after `most` - 1 characters where it has more than `most`.
///
/// ```
/// assert_eq!(bvhscope::text::cut("needle", 6), "needle");
/// assert_eq!(bvhscope::text::cut("needles", 6), "needl…");
/// ```
pub fn cut(text: &str, most: usize) -> Cow<'_, str> {
    match text.char_indices().nth(most) {
        None => Cow::Borrowed(text),
        Some(_) => Cow::Owned(text.chars().take(most.saturating_sub(1)).chain(['…']).collect()),
    }
}

/// `text` as one word of a POSIX shell.
///
/// ```
/// assert_eq!(bvhscope::text::quote("a/b.obj"), "a/b.obj");
/// assert_eq!(bvhscope::text::quote("Bob's"), r"'Bob'\''s'");
/// ```
pub fn quote(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-:+".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', r"'\''"))
    }
}

/// The text that [`quote`] made a word of.
///
/// ```
/// assert_eq!(bvhscope::text::unquote(r"'Bob'\''s'"), "Bob's");
/// ```
pub fn unquote(word: &str) -> String {
    let inner = word.strip_prefix('\'').and_then(|word| word.strip_suffix('\''));
    inner.map_or_else(|| word.to_owned(), |inner| inner.replace(r"'\''", "'"))
}

/// A count with its thousands separated.
///
/// ```
/// assert_eq!(bvhscope::text::count(1_234_567), "1,234,567");
/// ```
pub fn count(value: u64) -> String {
    let digits = value.to_string();
    let mut text = String::with_capacity(digits.len() + digits.len() / 3);
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// A number without its decimals, with its thousands separated; from 1e15 on by its power of ten, as a double does not know all
/// digits of it.
///
/// ```
/// assert_eq!([12_345.4, -1e6, 2e30].map(bvhscope::text::whole), ["12,345", "-1,000,000", "2.000e30"]);
/// ```
pub fn whole(value: f64) -> String {
    let size = value.abs().round();
    if size.is_nan() || size >= 1e15 {
        return format!("{value:.3e}");
    }
    format!("{}{}", if value < 0.0 && size > 0.0 { "-" } else { "" }, count(size as u64))
}

/// A number with about four digits: 0.123, 12.34, 123.4, 12,345; one that is not known as a dash.
///
/// ```
/// assert_eq!([0.1234, 12.344, -12.344, 12_345.4].map(bvhscope::text::number), ["0.123", "12.34", "-12.34", "12,345"]);
/// assert_eq!([f64::NAN, -0.0, -0.0001].map(bvhscope::text::number), ["–", "0.000", "0.000"]);
/// ```
pub fn number(value: f64) -> String {
    match value.abs() {
        size if size.is_nan() => "–".to_owned(),
        // Not -0.000.
        size if size < 0.0005 => "0.000".to_owned(),
        size if size < 10.0 => format!("{value:.3}"),
        size if size < 100.0 => format!("{value:.2}"),
        size if size < 1000.0 => format!("{value:.1}"),
        _ => whole(value),
    }
}

/// A number with a noun that stands in its plural, and in its singular where the number is 1. What follows the noun, the first word
/// in the plural, is kept, so it must not depend on the number: "triangles left out", not "triangles are left out".
///
/// ```
/// use bvhscope::text::counted;
///
/// assert_eq!(counted(2, "vertices without a normal"), "2 vertices without a normal");
/// assert_eq!(counted(1, "vertices without a normal"), "1 vertex without a normal");
/// assert_eq!(counted(1, "morph targets left out"), "1 morph target left out");
/// ```
pub fn counted(count: u64, plural: &str) -> String {
    if count == 1 { format!("1 {}", with_singular(plural)) } else { format!("{count} {plural}") }
}

/// `text` with the singular of the first word in the plural, of those before anything but letters and single spaces.
fn with_singular(text: &str) -> String {
    let mut start = 0;
    for word in text.split(' ') {
        let end = start + word.find(|character: char| !character.is_ascii_alphabetic()).unwrap_or(word.len());
        let one = singular(&text[start..end]);
        if one != text[start..end] {
            return format!("{}{one}{}", &text[..start], &text[end..]);
        }
        if end < start + word.len() {
            break;
        }
        start = (end + 1).min(text.len());
    }
    text.to_owned()
}

/// The change from `before` to `after` as a factor, where percentages would be hard to read, from threefold and from a third on: `× 224`,
/// `÷ 3.5`. `None` of smaller changes, and where either is not positive or not finite.
///
/// ```
/// use bvhscope::text::factor;
///
/// assert_eq!(factor(2.0, 448.0).as_deref(), Some("× 224"));
/// assert_eq!(factor(7.0, 2.0).as_deref(), Some("÷ 3.5"));
/// assert_eq!((factor(2.0, 5.9), factor(0.0, 9.0)), (None, None));
/// ```
pub fn factor(before: f64, after: f64) -> Option<String> {
    let is_usable = |value: f64| value > 0.0 && value.is_finite();
    let (sign, factor) = if after < before { ('÷', before / after) } else { ('×', after / before) };
    let digits = if factor >= 9.95 { whole(factor) } else { format!("{factor:.1}") };
    (is_usable(before) && is_usable(after) && factor >= 3.0).then(|| format!("{sign} {digits}"))
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

/// Parses a point `X,Y,Z`, with or without spaces; numbers in the range of single precision.
///
/// # Errors
///
/// Fails with what is expected where these are not three finite numbers.
pub fn parse_vector(text: &str) -> Result<DVec3, String> {
    let expected = || "three finite numbers X,Y,Z are expected, as in 0,1.5,-2".to_owned();
    let parts: Vec<f64> =
        text.split(',').map(|part| part.trim().parse()).collect::<Result<_, _>>().map_err(|_| expected())?;
    match parts[..] {
        [x, y, z] if DVec3::new(x, y, z).as_vec3().is_finite() => Ok(DVec3::new(x, y, z)),
        _ => Err(expected()),
    }
}

/// Parses a direction `X,Y,Z` and scales it to length 1.
///
/// # Errors
///
/// Fails as [`parse_vector`], and for a direction without a length.
pub fn parse_direction(text: &str) -> Result<Vec3, String> {
    let value = parse_vector(text)?;
    // Divided first, since the square of a long or short direction is no number.
    let scaled = (value / value.abs().max_element()).try_normalize();
    scaled
        .map(DVec3::as_vec3)
        .ok_or_else(|| format!("the direction {},{},{} points nowhere", value.x, value.y, value.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_direction_of_any_length_is_scaled() {
        let diagonal = Vec3::ONE.normalize();
        for text in ["1e38,1e38,1e38", "1e-40,1e-40,1e-40", "3,3,3"] {
            assert!(parse_direction(text).is_ok_and(|direction| direction.distance(diagonal) < 1e-6), "{text}");
        }
        assert!(parse_direction("0,0,-0").is_err());
    }

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
            ("texture sets", "1 texture set"),
            ("morph targets left out: numbers", "1 morph target left out: numbers"),
            ("'faces' of lines", "1 'faces' of lines"),
            ("", "1 "),
        ] {
            assert_eq!(counted(1, many), one);
            assert_eq!(counted(0, many), format!("0 {many}"));
        }
    }
}
