//! The names in a ZIP archive, which tell 3MF, USDZ and KMZ from a packed model.

use std::path::Path;

use crate::scene::format::FileFormat;
use crate::text::quoted;

/// Advice about what only its own program reads.
pub(super) const EXPORT: &str = "open it in the program that made it and export glTF, OBJ, PLY or STL";
/// Entries of an archive that are looked at.
const MAX_ENTRIES: usize = 1000;
/// Bytes of the record at the end of an archive, without its comment of at most 65,535 bytes.
const END_RECORD: usize = 22;
/// Bytes of an entry in the directory before its name.
const ENTRY: usize = 46;

/// Kind of an archive, and advice.
pub(super) fn describe(bytes: &[u8]) -> (&'static str, String) {
    let names = names(bytes);
    let entries: Vec<String> = names.iter().map(|name| name.to_ascii_lowercase()).collect();
    let has = |extensions: &[&str]| entries.iter().any(|name| extensions.contains(&extension(name)));
    let what = if entries.iter().any(|name| name.starts_with("3d/") && extension(name) == "model") {
        "a 3MF model"
    } else if has(&["usd", "usda", "usdc"]) {
        "a USDZ scene"
    } else if has(&["kml"]) {
        "a KMZ file for Google Earth"
    } else if entries.iter().any(|name| name == "document.xml") && has(&["brp", "brep"]) {
        "a FreeCAD document"
    } else {
        let is_model = |name: &&String| FileFormat::from_extension(Path::new(name)).is_some();
        let model = names.iter().find(is_model).map_or_else(|| "the model".to_owned(), quoted);
        return ("a ZIP archive", format!("unpack it and open {model} from it"));
    };
    (what, EXPORT.to_owned())
}

/// The part of a name after its last dot.
fn extension(name: &str) -> &str {
    name.rsplit_once('.').map_or("", |(_, extension)| extension)
}

/// The names of the first entries, from the directory at the end.
fn names(bytes: &[u8]) -> Vec<String> {
    let number = |at: usize, length: usize| -> Option<usize> {
        let part = bytes.get(at..at.checked_add(length)?)?;
        Some(part.iter().rev().fold(0, |sum: usize, &byte| sum << 8 | usize::from(byte)))
    };
    let start = bytes.len().saturating_sub(END_RECORD + 65_535);
    let end = bytes[start..].windows(4).rposition(|word| word == b"PK\x05\x06").map(|at| at.saturating_add(start));
    let mut at = end.and_then(|end| number(end.saturating_add(16), 4));
    let mut names = Vec::new();
    while let Some(entry) = at
        && names.len() < MAX_ENTRIES
        && bytes.get(entry..).is_some_and(|rest| rest.starts_with(b"PK\x01\x02"))
        && let Some(start) = entry.checked_add(ENTRY)
        && let Some(name) = number(entry.saturating_add(28), 2).and_then(|length| bytes.get(start..)?.get(..length))
    {
        names.push(String::from_utf8_lossy(name).into_owned());
        let rest = [28_usize, 30, 32].iter().map(|&k| number(entry.saturating_add(k), 2)).sum::<Option<usize>>();
        at = rest.and_then(|rest| start.checked_add(rest));
    }
    names
}
