//! STL loader, binary and text. Normals in the file are ignored: they are often wrong and never smooth.
//!
//! Not based on stl_io 0.11, whose text reader rejects upper case, a bare `solid`, Latin-1 names and any NaN without naming the
//! line, and stops after the first of several solids. Working around that would mean rewriting every line first.

mod text;

use glam::Vec3;

use super::assemble::Assembly;
use super::error::{FileLocation, LoadError};
use super::read::{ModelFile, READ_PROGRESS, TEXT_SAMPLE, beginning, is_control, is_plain_text};
use bvhscope_engine::geometry::Triangle;

/// Bytes of a triangle in the binary form.
const RECORD: usize = 50;
/// Bytes before the first triangle in the binary form.
const HEADER: usize = 84;
/// The bit of a record's last two bytes that says whether they are a colour; VisCAM sets it, Magics leaves it out.
const COLOR_BIT: u16 = 1 << 15;

/// Number of triangles that the header of a binary file declares.
fn declared_count(bytes: &[u8]) -> Option<u64> {
    let count: [u8; 4] = bytes.get(80..HEADER)?.try_into().ok()?;
    Some(u64::from(u32::from_le_bytes(count)))
}

/// Size in bytes that the header of a binary file implies.
pub(super) fn binary_size(bytes: &[u8]) -> Option<u64> {
    declared_count(bytes)?.checked_mul(RECORD as u64)?.checked_add(HEADER as u64)
}

/// Words of the text form that the numbers of a binary file hardly spell.
const TEXT_WORDS: [&[u8]; 3] = [b"vertex", b"endfacet", b"endsolid"];
/// Bytes of the beginning in which they are looked for.
const SEARCHED: usize = 1 << 12;

/// Whether a byte fills up text that programs write in blocks: zero, and the Ctrl-Z that ended text files once.
fn is_padding(byte: u8) -> bool {
    matches!(byte, 0 | 0x1A)
}

/// The beginning of a text without comments, which some programs write before it.
fn after_comments(bytes: &[u8]) -> &[u8] {
    let mut rest = beginning(bytes);
    while rest.starts_with(b"#") {
        let end = rest.iter().position(|&byte| byte == b'\n' || byte == b'\r').unwrap_or(rest.len());
        rest = rest[end..].trim_ascii_start();
    }
    rest
}

/// Whether the content is the text form, which zeros may fill up. Headers of binary files may begin with "solid" too, but have control
/// characters, or zeros and none of its words.
pub(super) fn is_text(bytes: &[u8]) -> bool {
    let start = after_comments(bytes);
    let begins = |word: &[u8]| start.get(..word.len()).is_some_and(|start| start.eq_ignore_ascii_case(word));
    let after = |word: &[u8]| start.get(word.len()).is_none_or(|&byte| byte.is_ascii_whitespace() || is_padding(byte));
    if !(begins(b"solid") && after(b"solid") || begins(b"facet") && after(b"facet")) {
        return false;
    }
    let sample = start.get(..TEXT_SAMPLE).unwrap_or(start);
    let searched = start.get(..SEARCHED).unwrap_or(start);
    let has_word =
        || TEXT_WORDS.iter().any(|word| searched.windows(word.len()).any(|at| at.eq_ignore_ascii_case(word)));
    is_plain_text(start) || sample.iter().all(|&byte| is_padding(byte) || !is_control(byte)) && has_word()
}

/// Loads an STL file from memory.
pub(super) fn load(file: &ModelFile<'_>, assembly: &mut Assembly) -> Result<(), LoadError> {
    let ModelFile { path, bytes, token, .. } = *file;
    if is_text(bytes) && binary_size(bytes) != Some(bytes.len() as u64) {
        return text::load(file, assembly);
    }
    let Some(declared) = declared_count(bytes) else {
        let location = FileLocation::Byte(bytes.len() as u64);
        let problem = format!("the file ends in the header of {HEADER} bytes");
        return Err(LoadError::at(path, location, problem, "it may be cut off: export or copy it again"));
    };
    let records = whole_records(bytes, declared, assembly);
    assembly.mesh_count = 1;
    if records.is_empty() {
        assembly.other_contents.push("a header".to_owned());
    }
    assembly.reserve(records.len()).map_err(|error| error.in_file(path))?;
    let is_magics = bytes[..80].windows(6).any(|word| word == b"COLOR=");
    for (index, record) in records.iter().enumerate() {
        if index % 65_536 == 0 {
            token.check()?;
            token.set_progress(READ_PROGRESS + (1.0 - READ_PROGRESS) * index as f32 / records.len() as f32);
        }
        // The normal, three corners, and two bytes for attributes.
        let (vectors, attributes) = record.as_chunks::<12>();
        let corner = |k: usize| {
            Vec3::from_array(bytemuck::pod_read_unaligned::<[[u8; 4]; 3]>(&vectors[k]).map(f32::from_le_bytes))
        };
        let triangle = Triangle { a: corner(1), b: corner(2), c: corner(3) };
        let location = || FileLocation::Byte(index.saturating_mul(RECORD).saturating_add(HEADER) as u64);
        assembly.push(triangle, None, 0, location);
        let color = u16::from_le_bytes([attributes[0], attributes[1]]);
        if color != 0 && (color & COLOR_BIT == 0) == is_magics {
            assembly.warnings.add("triangles with a colour, which is not shown", location);
        }
    }
    Ok(())
}

/// The records of a binary file: as many as are there, with a warning where the header declares another number.
fn whole_records<'a>(bytes: &'a [u8], declared: u64, assembly: &mut Assembly) -> &'a [[u8; RECORD]] {
    let (records, rest) = bytes.get(HEADER..).unwrap_or_default().as_chunks::<RECORD>();
    let found = records.len() as u64;
    let missing = format!("triangles of {declared} declared missing at the end");
    assembly.warnings.add_many(declared.saturating_sub(found), &missing, || FileLocation::Byte(bytes.len() as u64));
    // Beyond the declared number, only what is nothing but records is taken for more of them.
    let count = if rest.is_empty() { found } else { found.min(declared) };
    let end = count.saturating_mul(RECORD as u64).saturating_add(HEADER as u64);
    let extra = format!("triangles beyond the {declared} that the header declares, shown too");
    let first_extra = declared.saturating_mul(RECORD as u64).saturating_add(HEADER as u64);
    assembly.warnings.add_many(count.saturating_sub(declared), &extra, || FileLocation::Byte(first_extra));
    if declared <= found {
        let left = (bytes.len() as u64).saturating_sub(end);
        assembly.warnings.add_many(left, "bytes after the last triangle not read", || FileLocation::Byte(end));
    }
    records.get(..usize::try_from(count).unwrap_or(usize::MAX)).unwrap_or(records)
}
