//! A reader that checks every statement of an OBJ file, tracks its line, and passes a simplified text on to tobj, which would
//! refuse some valid files, panic on others and invent triangles.

use std::collections::HashSet;
use std::io::{BufRead, Error, Read, Write};
use std::ops::RangeInclusive;

use arrayvec::ArrayVec;

use crate::budget::Budget;
use crate::scene::assemble::BYTES_PER_TRIANGLE;
use crate::scene::error::{FileLocation, Warnings};
use crate::scene::read::{MAX_LINE, READ_PROGRESS, lines};
use bvhscope_engine::cancel::CancelToken;

/// Bytes of sanitized text produced at a time.
const CHUNK_SIZE: usize = 1 << 16;
/// Bytes of the file between two checks of the budget and of cancellation.
const CHECK_INTERVAL_BYTES: usize = 1 << 20;
/// Maximum number of triangles per group: tobj processes a group without cancellation checks.
const TRIANGLES_PER_GROUP: usize = 20_000;

/// An error in a line, with the byte offset in the line if a single word is at fault.
struct Fault {
    message: String,
    column: Option<usize>,
}

impl From<String> for Fault {
    fn from(message: String) -> Self {
        Self { message, column: None }
    }
}

/// Whether the corners of a face have texture coordinates and normals.
type FaceKind = (bool, bool);

/// Sanitized OBJ text, produced while it is read.
pub(super) struct Sanitizer<'a> {
    data: &'a [u8],
    at: usize,
    out: Vec<u8>,
    out_at: usize,
    token: &'a CancelToken,
    colored: bool,
    positions: u64,
    texcoords: u64,
    normals: u64,
    /// Indices, from 1, of positions with unusable coordinates.
    bad_positions: HashSet<u64>,
    corners: Vec<[u64; 3]>,
    kind: FaceKind,
    triangles_in_group: usize,
    triangles: u64,
    /// Byte offset of the next budget check.
    next_check: usize,
    object_open: bool,
    /// Number of the line last read, from 1.
    pub(super) line: u64,
    /// Number of objects and groups with faces.
    pub(super) mesh_count: usize,
    pub(super) warnings: Warnings,
    /// Location and message of the error that stopped reading, if the file is at fault.
    pub(super) fault: Option<(FileLocation, String)>,
}

impl<'a> Sanitizer<'a> {
    pub(super) fn new(data: &'a [u8], token: &'a CancelToken) -> Self {
        let data = data.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(data);
        Self {
            data,
            at: 0,
            out: Vec::with_capacity(CHUNK_SIZE + 1024),
            out_at: 0,
            token,
            colored: has_colors(data, token),
            positions: 0,
            texcoords: 0,
            normals: 0,
            bad_positions: HashSet::new(),
            corners: Vec::new(),
            kind: (false, false),
            triangles_in_group: 0,
            triangles: 0,
            next_check: CHECK_INTERVAL_BYTES,
            object_open: true,
            line: 0,
            mesh_count: 0,
            warnings: Warnings::default(),
            fault: None,
        }
    }

    /// Number of positions so far.
    pub(super) fn positions(&self) -> u64 {
        self.positions
    }

    /// The next physical line without its line ending.
    fn physical_line(&mut self) -> Option<&'a [u8]> {
        let rest = self.data.get(self.at..).filter(|rest| !rest.is_empty())?;
        // A line beyond the limit is not scanned to its end.
        let start = rest.get(..=MAX_LINE).unwrap_or(rest);
        let end = start.iter().position(|&byte| byte == b'\n' || byte == b'\r').unwrap_or(start.len());
        let ending = if rest[end..].starts_with(b"\r\n") { 2 } else { 1 };
        self.at = self.at.saturating_add(end).saturating_add(ending);
        self.line = self.line.saturating_add(1);
        Some(&rest[..end])
    }

    /// Reads one statement, joining continued lines; returns whether there was one.
    fn statement(&mut self) -> Result<bool, Fault> {
        let Some(line) = self.physical_line() else { return Ok(false) };
        let joined;
        let mut is_joined = false;
        let mut line = line;
        if line.trim_ascii_end().last() == Some(&b'\\') && line.trim_ascii_start().first() != Some(&b'#') {
            let mut whole = Vec::new();
            loop {
                let part = line.trim_ascii_end();
                let (part, more) = part.strip_suffix(b"\\").map_or((part, false), |part| (part, true));
                whole.extend_from_slice(part);
                whole.push(b' ');
                check_length(&whole)?;
                match if more { self.physical_line() } else { None } {
                    Some(next) => line = next,
                    None => break,
                }
            }
            (joined, is_joined) = (whole, true);
            line = &joined;
        }
        check_length(line)?;
        // Columns are meaningless in joined lines.
        self.sanitize(line).map_err(|fault| if is_joined { fault.message.into() } else { fault })?;
        Ok(true)
    }

    /// Checks a statement and appends its simplified form to the output.
    fn sanitize(&mut self, line: &[u8]) -> Result<(), Fault> {
        let statement = line.trim_ascii();
        let end = statement.iter().position(u8::is_ascii_whitespace).unwrap_or(statement.len());
        let (keyword, rest) = statement.split_at(end);
        // Byte offset of the arguments in the line.
        let start = line.trim_ascii_end().len().saturating_sub(rest.len());
        match keyword {
            b"v" => self.position(rest, start),
            b"vt" => {
                self.texcoords = self.texcoords.saturating_add(1);
                self.numbers(b"vt", rest, start, 1..=2)
            }
            b"vn" => {
                self.normals = self.normals.saturating_add(1);
                self.numbers(b"vn", rest, start, 3..=3)
            }
            b"f" | b"fo" => {
                self.face(rest);
                Ok(())
            }
            b"o" | b"g" => {
                self.object_open = true;
                Ok(())
            }
            b"usemtl" | b"mtllib" => {
                let name = String::from_utf8_lossy(rest);
                if !name.trim().is_empty() {
                    self.out.extend_from_slice(keyword);
                    self.out.push(b' ');
                    self.out.extend_from_slice(name.trim().as_bytes());
                    self.out.push(b'\n');
                }
                Ok(())
            }
            b"l" | b"p" => {
                let line = self.line;
                self.warnings.add("lines and points not shown", || FileLocation::Line(line));
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// A vertex position; `start` is the byte offset of `rest` in the line.
    fn position(&mut self, rest: &[u8], start: usize) -> Result<(), Fault> {
        self.positions = self.positions.saturating_add(1);
        let mut values = ArrayVec::<f32, 6>::new();
        self.out.extend_from_slice(b"v");
        for (at, word) in words_at(rest).take(6) {
            values.push(number(word, start.saturating_add(at))?);
            if values.len() <= 3 {
                self.out.push(b' ');
                self.out.extend_from_slice(word);
            }
        }
        let count = values.len();
        if count < 3 {
            return Err(format!("a vertex needs 3 coordinates, but there are {count}").into());
        }
        let is_usable = values.iter().take(3).all(|value| value.abs() <= 1e18);
        if self.colored {
            let [.., r, g, b] = values.into_inner().unwrap_or([1.0; 6]);
            // Writing to memory cannot fail.
            let _ = write!(self.out, " {r} {g} {b}");
        }
        self.out.push(b'\n');
        if !is_usable {
            self.bad_positions.insert(self.positions);
        }
        Ok(())
    }

    /// A statement with a number of arguments within `counts`; `start` is the byte offset of `rest` in the line.
    fn numbers(
        &mut self,
        keyword: &[u8],
        rest: &[u8],
        start: usize,
        counts: RangeInclusive<usize>,
    ) -> Result<(), Fault> {
        let (min, max) = counts.into_inner();
        self.out.extend_from_slice(keyword);
        let mut count = 0_usize;
        for (at, word) in words_at(rest).take(max) {
            number(word, start.saturating_add(at))?;
            self.out.push(b' ');
            self.out.extend_from_slice(word);
            count = count.saturating_add(1);
        }
        if count < min {
            return Err(format!("{min} numbers are expected, but there are {count}").into());
        }
        for _ in count..max {
            self.out.extend_from_slice(b" 0");
        }
        self.out.push(b'\n');
        Ok(())
    }

    fn face(&mut self, rest: &[u8]) {
        let line = self.line;
        let mut corners = std::mem::take(&mut self.corners);
        corners.clear();
        let mut kind = (true, true);
        let mut fault = None;
        for word in words(rest) {
            let mut parts = word.split(|&byte| byte == b'/');
            let mut index = |count| parts.next().and_then(|part| resolve(part, count));
            let (position, texcoord, normal) = (index(self.positions), index(self.texcoords), index(self.normals));
            let Some(position) = position else {
                fault = Some("faces with a vertex that does not exist (yet) skipped");
                break;
            };
            if self.bad_positions.contains(&position) {
                fault = Some("faces with coordinates that are not numbers or beyond 1e18 skipped");
            }
            kind = (kind.0 && texcoord.is_some(), kind.1 && normal.is_some());
            corners.push([position, texcoord.unwrap_or(0), normal.unwrap_or(0)]);
        }
        if fault.is_none() && corners.len() < 3 {
            fault = Some("faces with fewer than 3 corners skipped");
        }
        if let Some(fault) = fault {
            self.warnings.add(fault, || FileLocation::Line(line));
        } else {
            if kind != self.kind || self.triangles_in_group >= TRIANGLES_PER_GROUP {
                self.end_group();
                self.kind = kind;
            }
            let begins = std::mem::take(&mut self.object_open);
            self.mesh_count = self.mesh_count.saturating_add(usize::from(begins));
            let triangles = corners.len().saturating_sub(2);
            self.triangles_in_group = self.triangles_in_group.saturating_add(triangles);
            self.triangles = self.triangles.saturating_add(triangles as u64);
            self.out.push(b'f');
            for [position, texcoord, normal] in &corners {
                let _ = match kind {
                    (false, false) => write!(self.out, " {position}"),
                    (true, false) => write!(self.out, " {position}/{texcoord}"),
                    (false, true) => write!(self.out, " {position}//{normal}"),
                    (true, true) => write!(self.out, " {position}/{texcoord}/{normal}"),
                };
            }
            self.out.push(b'\n');
        }
        self.corners = corners;
    }

    fn end_group(&mut self) {
        if self.triangles_in_group > 0 {
            self.out.extend_from_slice(b"g\n");
            self.triangles_in_group = 0;
        }
    }

    /// Checks the budget for tobj's lists to double, as they do when they grow, and for the scene made of them. Also polls for
    /// cancellation, since meaningless lines may go on for long.
    fn check_memory_and_token(&mut self) -> Result<(), String> {
        const FLOAT: u64 = size_of::<f32>() as u64;
        const FACE: u64 = size_of::<[u32; 3]>() as u64 + BYTES_PER_TRIANGLE;
        if self.at < self.next_check {
            return Ok(());
        }
        self.next_check = self.at.saturating_add(CHECK_INTERVAL_BYTES);
        self.token.check().map_err(|cancelled| cancelled.to_string())?;
        let position = if self.colored { 6 * FLOAT } else { 3 * FLOAT };
        let lists = [
            (self.positions, position),
            (self.texcoords, 2 * FLOAT),
            (self.normals, 3 * FLOAT),
            (self.triangles, FACE),
        ];
        let bytes = |sum: u64, (count, each): (u64, u64)| sum.saturating_add(count.saturating_mul(each));
        let bytes = lists.into_iter().fold(0, bytes);
        Budget::of_process().check("the vertices and faces", bytes).map_err(|error| error.to_string())
    }

    fn refill(&mut self) -> std::io::Result<()> {
        self.out.clear();
        self.out_at = 0;
        while self.out.len() < CHUNK_SIZE {
            match self.statement().and_then(|more| Ok(self.check_memory_and_token().map(|()| more)?)) {
                Ok(true) => {}
                Ok(false) => break,
                Err(Fault { message, column }) => {
                    let location = column.map_or(FileLocation::Line(self.line), |at| {
                        FileLocation::Column(self.line, (at as u64).saturating_add(1))
                    });
                    self.fault = Some((location, message));
                    return Err(Error::other("unreadable line"));
                }
            }
            if self.line.is_multiple_of(4096) {
                self.token.check().map_err(Error::other)?;
            }
        }
        let fraction = self.at as f32 / self.data.len().max(1) as f32;
        self.token.set_progress(READ_PROGRESS + (0.95 - READ_PROGRESS) * fraction);
        self.token.check().map_err(Error::other)
    }
}

impl Read for Sanitizer<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.fill_buf()?.read(buffer)?;
        self.consume(count);
        Ok(count)
    }
}

impl BufRead for Sanitizer<'_> {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        if self.out_at >= self.out.len() {
            self.refill()?;
        }
        Ok(&self.out[self.out_at..])
    }

    fn consume(&mut self, amount: usize) {
        self.out_at = self.out_at.saturating_add(amount).min(self.out.len());
    }
}

/// Whether any vertex has a colour; tobj then needs one for every vertex.
fn has_colors(data: &[u8], token: &CancelToken) -> bool {
    let mut since_poll = 0_usize;
    lines(data).any(|line| {
        since_poll = since_poll.saturating_add(line.len()).saturating_add(1);
        let stop = since_poll >= CHECK_INTERVAL_BYTES && {
            since_poll = 0;
            token.is_cancelled()
        };
        stop || line.starts_with(b"v ") && words(line).count() >= 7
    })
}

fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// The words of a line with their byte offsets.
fn words_at(line: &[u8]) -> impl Iterator<Item = (usize, &[u8])> {
    let mut next = 0_usize;
    let parts = line.split(u8::is_ascii_whitespace).map(move |word| {
        let at = next;
        next = next.saturating_add(word.len()).saturating_add(1);
        (at, word)
    });
    parts.filter(|(_, word)| !word.is_empty())
}

fn check_length(line: &[u8]) -> Result<(), String> {
    if line.len() > MAX_LINE { Err(format!("the line is longer than {MAX_LINE} bytes")) } else { Ok(()) }
}

/// Parses the word at byte offset `at` of its line as a number.
fn number(word: &[u8], at: usize) -> Result<f32, Fault> {
    let parsed = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
    parsed.ok_or_else(|| {
        let word: String = String::from_utf8_lossy(word).chars().take(40).collect();
        Fault { message: format!("'{}' is not a number", word.escape_debug()), column: Some(at) }
    })
}

/// Resolves an index counted from 1, or from the end if negative; `None` if it is missing or out of range.
fn resolve(part: &[u8], count: u64) -> Option<u64> {
    let index: i64 = std::str::from_utf8(part).ok()?.parse().ok()?;
    let index = if index < 0 { count.checked_add_signed(index)?.checked_add(1)? } else { index.cast_unsigned() };
    (1..=count).contains(&index).then_some(index)
}
