//! The text form of STL: words separated by white space; line breaks matter only in names.

use std::path::Path;

use glam::{DVec3, Vec3};

use crate::scene::assemble::Assembly;
use crate::scene::error::{FileLocation, LoadError};
use crate::scene::numbers::{advice_about, number};
use crate::scene::offset::{Extent, moved};
use crate::scene::read::{BYTE_ORDER_MARK, ModelFile, READ_PROGRESS};
use crate::text::{counted, quoted};
use bvhscope_engine::geometry::Triangle;

/// Words between two cancellation checks.
const POLL_INTERVAL: u64 = 16_384;
/// Bytes between two cancellation checks, where words are long.
const POLL_INTERVAL_BYTES: usize = 1 << 20;
/// Maximum number of bytes of white space and of a word that are passed over at once.
const MAX_WORD: usize = 1 << 12;
/// Words that begin a statement.
const KEYWORDS: [&[u8]; 7] = [b"solid", b"facet", b"outer", b"vertex", b"endloop", b"endfacet", b"endsolid"];
/// The warning about facets that are no triangles.
const WRONG_CORNERS: &str = "facets without exactly 3 corners skipped";

/// The words of a text.
#[derive(Clone, Copy)]
struct Words<'a> {
    rest: &'a [u8],
    /// Number of the line of the last word, from 1.
    line: u64,
}

impl<'a> Words<'a> {
    /// The next word, which is empty within long white space, and cut where it is too long; `None` at the end.
    fn next(&mut self) -> Option<&'a [u8]> {
        let is_space = |byte: &u8| byte.is_ascii_whitespace() || *byte == 0x0B || super::is_padding(*byte);
        let limit = self.rest.get(..MAX_WORD).unwrap_or(self.rest);
        let start = limit.iter().position(|byte| !is_space(byte)).unwrap_or(limit.len());
        for (at, &byte) in self.rest[..start].iter().enumerate() {
            let ends_line = byte == b'\n' || byte == b'\r' && self.rest.get(at.saturating_add(1)) != Some(&b'\n');
            self.line = self.line.saturating_add(u64::from(ends_line));
        }
        let word = &self.rest[start..];
        if word.is_empty() {
            self.rest = word;
            return None;
        }
        let limit = word.get(..MAX_WORD).unwrap_or(word);
        let (word, rest) = word.split_at(limit.iter().position(is_space).unwrap_or(limit.len()));
        self.rest = rest;
        Some(word.strip_prefix(BYTE_ORDER_MARK).unwrap_or(word))
    }

    /// The next word without passing it.
    fn peek(mut self) -> Option<&'a [u8]> {
        self.next()
    }
}

/// The keyword that a word is, in lower case.
fn keyword(word: &[u8]) -> Option<&'static [u8]> {
    KEYWORDS.into_iter().find(|keyword| word.eq_ignore_ascii_case(keyword))
}

/// Words that are passed over.
#[derive(Clone, Copy, PartialEq)]
enum Skipped {
    Nothing,
    /// A normal: everything before the next keyword.
    Normal,
    /// A name, or words that are not understood: the rest of the line with this number.
    Line(u64),
}

/// The reader of the text form.
struct Text<'a> {
    path: &'a Path,
    assembly: &'a mut Assembly,
    words: Words<'a>,
    skipped: Skipped,
    /// Line of the statement being read.
    line: u64,
    /// The corners since the last facet.
    corners: Vec<Vec3>,
    /// Whether a facet has begun and not ended.
    in_facet: bool,
    /// Whether the facet has had corners.
    has_corners: bool,
    /// Whether a solid has begun and not ended.
    in_solid: bool,
    /// Subtracted from all coordinates.
    offset: DVec3,
    /// The box around all corners.
    extent: Extent,
}

/// Loads the text form from memory; a second time with an offset where the corners turn out to need one.
pub(super) fn load(file: &ModelFile<'_>, assembly: &mut Assembly) -> Result<(), LoadError> {
    let warnings = assembly.warnings.clone();
    let offset = read(file, DVec3::ZERO, assembly)?;
    if offset != DVec3::ZERO {
        *assembly = Assembly::new();
        (assembly.warnings, assembly.offset) = (warnings, offset);
        read(file, offset, assembly)?;
    }
    Ok(())
}

/// Reads all facets less `offset`, and returns the offset that they need. Words that are no statements are counted by the line.
fn read(file: &ModelFile<'_>, offset: DVec3, assembly: &mut Assembly) -> Result<DVec3, LoadError> {
    let ModelFile { path, bytes, token, .. } = *file;
    let mut text = Text {
        path,
        assembly,
        words: Words { rest: bytes, line: 1 },
        skipped: Skipped::Nothing,
        line: 1,
        corners: Vec::with_capacity(3),
        in_facet: false,
        has_corners: false,
        in_solid: false,
        offset,
        extent: Extent::EMPTY,
    };
    let mut next_poll = 0;
    for index in 0_u64.. {
        let done = bytes.len().saturating_sub(text.words.rest.len());
        if index.is_multiple_of(POLL_INTERVAL) || done >= next_poll {
            token.check()?;
            next_poll = done.saturating_add(POLL_INTERVAL_BYTES);
            // A triangle has at least the 12 words of its corners.
            text.assembly.reserve(POLL_INTERVAL as usize / 12).map_err(|error| error.in_file(path))?;
            token.set_progress(READ_PROGRESS + (1.0 - READ_PROGRESS) * done as f32 / bytes.len() as f32);
        }
        let Some(word) = text.words.next() else { break };
        text.word(word)?;
    }
    text.end_facet(true);
    if text.in_solid {
        let end = FileLocation::Byte(bytes.len() as u64);
        text.assembly.warnings.add("solids without 'endsolid': the file may be cut off", || end);
    }
    let needed = text.extent.offset();
    if assembly.is_empty() && assembly.mesh_count > 0 {
        assembly.other_contents.push(counted(assembly.mesh_count as u64, "solids"));
    }
    Ok(needed)
}

impl<'a> Text<'a> {
    /// Reads a word, and those that belong to it.
    fn word(&mut self, word: &'a [u8]) -> Result<(), LoadError> {
        if word.is_empty() {
            return Ok(());
        }
        let keyword = keyword(word);
        let begins = match self.skipped {
            Skipped::Nothing => true,
            Skipped::Normal => keyword.is_some(),
            Skipped::Line(line) => line != self.words.line || self.begins_facet(keyword),
        };
        if !begins {
            return Ok(());
        }
        self.skipped = Skipped::Nothing;
        self.line = self.words.line;
        match keyword {
            Some(b"vertex") => self.vertex()?,
            Some(b"endloop") => self.end_facet(false),
            Some(b"endfacet") => {
                self.end_facet(false);
                if self.in_facet && !self.has_corners {
                    self.warn(WRONG_CORNERS);
                }
                self.in_facet = false;
            }
            Some(b"facet") => {
                self.end_facet(true);
                (self.in_facet, self.has_corners, self.skipped) = (true, false, Skipped::Normal);
                if !self.in_solid {
                    self.warn("facets outside 'solid' and 'endsolid', shown too");
                }
            }
            Some(b"solid") => {
                self.end_facet(true);
                (self.in_solid, self.skipped) = (true, Skipped::Line(self.line));
                self.assembly.mesh_count = self.assembly.mesh_count.saturating_add(1);
            }
            Some(b"endsolid") => {
                self.end_facet(true);
                (self.in_solid, self.skipped) = (false, Skipped::Line(self.line));
            }
            // "outer loop"
            Some(_) => self.skipped = Skipped::Normal,
            None => {
                self.skipped = Skipped::Line(self.line);
                self.warn("lines without an STL statement skipped");
            }
        }
        Ok(())
    }

    /// Whether a facet begins in the line of a name: its first two words together are hardly part of one.
    fn begins_facet(&self, keyword: Option<&[u8]>) -> bool {
        keyword == Some(b"facet") && self.words.peek().is_some_and(|next| next.eq_ignore_ascii_case(b"normal"))
    }

    /// Reads the three numbers of a corner.
    fn vertex(&mut self) -> Result<(), LoadError> {
        let mut corner = [0.0_f64; 3];
        for (k, coordinate) in corner.iter_mut().enumerate() {
            let word = loop {
                match self.words.peek() {
                    Some(b"") => self.words.next(),
                    Some(word) if keyword(word).is_none() => break word,
                    _ => {
                        let problem = format!("a 'vertex' needs 3 numbers, but there are {k}");
                        return Err(self.fault(problem, "correct the line or export the model again"));
                    }
                };
            };
            self.words.next();
            let fault = || self.fault(format!("{} is not a number", quoted(word)), advice_about(word));
            *coordinate = number(word).ok_or_else(fault)?;
        }
        if self.words.peek().is_some_and(|word| number(word).is_some()) {
            self.warn("vertices with more than 3 numbers, of which the first 3 count");
            self.skipped = Skipped::Normal;
        }
        let corner = DVec3::from_array(corner);
        self.extent.add(corner);
        // More are never needed; a facet of a million would fill the memory.
        if self.corners.len() <= 3 {
            self.corners.push(moved(corner, self.offset).as_vec3());
        }
        Ok(())
    }

    /// Ends the loop of corners; `early` where a statement follows that is not allowed within a facet.
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

    fn fault(&self, problem: String, advice: &str) -> LoadError {
        LoadError::at(self.path, FileLocation::Line(self.line), problem, advice)
    }
}
