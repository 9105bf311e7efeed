//! STL loader, binary and text. Normals in the file are ignored: they are often wrong and never smooth.
//!
//! Not based on stl_io 0.11, whose text reader rejects upper case, a bare `solid`, Latin-1 names and any NaN without naming the
//! line, and stops after the first of several solids. Working around that would mean rewriting every line first.

use std::path::Path;

use glam::Vec3;

use super::assemble::Assembly;
use super::error::{FileLocation, LoadError};
use super::read::{READ_PROGRESS, beginning, is_plain_text, lines};
use crate::text::{counted, quoted};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::Triangle;

/// Bytes of a triangle in the binary form.
const RECORD: usize = 50;
/// Bytes before the first triangle in the binary form.
const HEADER: usize = 84;
/// Maximum number of bytes of text between two cancellation checks.
const POLL_INTERVAL_BYTES: usize = 1 << 20;
/// The warning about facets that are no triangles.
const WRONG_CORNERS: &str = "facets without exactly 3 corners skipped";
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

/// Whether the content is the text form. Headers of binary files may begin with "solid" too, but have control characters.
pub(super) fn is_text(bytes: &[u8]) -> bool {
    let start = beginning(bytes);
    let begins = |word: &[u8]| start.get(..word.len()).is_some_and(|start| start.eq_ignore_ascii_case(word));
    let after = |word: &[u8]| start.get(word.len()).is_none_or(u8::is_ascii_whitespace);
    (begins(b"solid") && after(b"solid") || begins(b"facet") && after(b"facet")) && is_plain_text(start)
}

/// Loads an STL file from memory.
pub(super) fn load(path: &Path, bytes: &[u8], assembly: &mut Assembly, token: &CancelToken) -> Result<(), LoadError> {
    if is_text(bytes) && binary_size(bytes) != Some(bytes.len() as u64) {
        return Text::new(path, assembly, bytes.len()).load(bytes, token);
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

/// The reader of the text form. Statements stand in lines of their own; those that are not known are counted.
struct Text<'a> {
    path: &'a Path,
    assembly: &'a mut Assembly,
    /// Bytes of the file.
    length: usize,
    /// The corners since the last facet.
    corners: Vec<Vec3>,
    /// Whether a facet has begun and not ended.
    in_facet: bool,
    /// Whether the facet has had corners.
    has_corners: bool,
    /// Whether a solid has begun and not ended.
    in_solid: bool,
    line: u64,
}

impl<'a> Text<'a> {
    fn new(path: &'a Path, assembly: &'a mut Assembly, length: usize) -> Self {
        let (corners, line) = (Vec::with_capacity(3), 0);
        Self { path, assembly, length, corners, in_facet: false, has_corners: false, in_solid: false, line }
    }

    fn load(mut self, bytes: &[u8], token: &CancelToken) -> Result<(), LoadError> {
        let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
        let (mut done, mut next_poll) = (0_usize, 0);
        for (index, line) in lines(bytes).enumerate() {
            if index % 16_384 == 0 || done >= next_poll {
                token.check()?;
                next_poll = done.saturating_add(POLL_INTERVAL_BYTES);
                // A triangle has seven lines; in an unusual file at least two.
                self.assembly.reserve(16_384 / 2).map_err(|error| error.in_file(self.path))?;
                token.set_progress(READ_PROGRESS + (1.0 - READ_PROGRESS) * done as f32 / self.length as f32);
            }
            done = done.saturating_add(line.len()).saturating_add(1);
            self.line = (index as u64).saturating_add(1);
            self.statement(line)?;
        }
        self.end_facet(true);
        if self.in_solid {
            let end = FileLocation::Byte(self.length as u64);
            self.assembly.warnings.add("solids without 'endsolid': the file may be cut off", || end);
        }
        if self.assembly.is_empty() && self.assembly.mesh_count > 0 {
            self.assembly.other_contents.push(counted(self.assembly.mesh_count as u64, "solids"));
        }
        Ok(())
    }

    fn statement(&mut self, line: &[u8]) -> Result<(), LoadError> {
        let mut words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        let Some(keyword) = words.next() else { return Ok(()) };
        let is = |name: &[u8]| keyword.eq_ignore_ascii_case(name);
        if is(b"vertex") {
            self.vertex(words)?;
        } else if is(b"endloop") || is(b"endfacet") {
            self.end_facet(false);
            if is(b"endfacet") && self.in_facet && !self.has_corners {
                self.warn(WRONG_CORNERS);
            }
            self.in_facet &= is(b"endloop");
        } else if is(b"facet") {
            self.end_facet(true);
            (self.in_facet, self.has_corners) = (true, false);
            if !self.in_solid {
                self.warn("facets outside 'solid' and 'endsolid', shown too");
            }
        } else if is(b"solid") {
            self.end_facet(true);
            self.in_solid = true;
            self.assembly.mesh_count = self.assembly.mesh_count.saturating_add(1);
        } else if is(b"endsolid") {
            self.end_facet(true);
            self.in_solid = false;
        } else if !is(b"outer") {
            self.warn("lines without an STL statement skipped");
        }
        Ok(())
    }

    fn vertex<'w>(&mut self, mut words: impl Iterator<Item = &'w [u8]>) -> Result<(), LoadError> {
        let mut corner = [0.0_f32; 3];
        for (k, coordinate) in corner.iter_mut().enumerate() {
            let Some(word) = words.next() else {
                return Err(self.fault(format!("a 'vertex' needs 3 numbers, but there are {k}")));
            };
            let parsed = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
            *coordinate = parsed.ok_or_else(|| self.fault(format!("{} is not a number", quoted(word))))?;
        }
        if words.next().is_some() {
            self.warn("vertices with more than 3 numbers, of which the first 3 count");
        }
        // More are never needed; a facet of a million would fill the memory.
        if self.corners.len() <= 3 {
            self.corners.push(Vec3::from_array(corner));
        }
        Ok(())
    }

    /// Ends the loop of corners; `early` where a statement follows that may not stand within a facet.
    fn end_facet(&mut self, early: bool) {
        if early && (self.in_facet || !self.corners.is_empty()) {
            self.warn("facets without 'endfacet'");
            self.in_facet = false;
        }
        self.has_corners |= !self.corners.is_empty();
        match self.corners[..] {
            [] => {}
            [a, b, c] => {
                let line = self.line;
                self.assembly.push(Triangle { a, b, c }, None, 0, || FileLocation::Line(line));
            }
            _ => self.warn(WRONG_CORNERS),
        }
        self.corners.clear();
    }

    fn warn(&mut self, what: &str) {
        let line = self.line;
        self.assembly.warnings.add(what, || FileLocation::Line(line));
    }

    fn fault(&self, problem: String) -> LoadError {
        LoadError::at(self.path, FileLocation::Line(self.line), problem, "correct the line or export the model again")
    }
}
