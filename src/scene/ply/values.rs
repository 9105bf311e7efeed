//! The values of a PLY file, one after another: numbers in text or binary, and their places.

use std::path::Path;

use super::element::{Element, Encoding, Number, Property};
use crate::budget::Budget;
use crate::scene::error::{FileLocation, LoadError, Warnings};
use crate::scene::numbers::{advice_about, number};
use crate::scene::read::READ_PROGRESS;
use crate::text::quoted;
use bvhscope_engine::cancel::{CancelToken, MEDIUM_STEPS};

/// Maximum number of bytes of a number in text.
const MAX_WORD: usize = 1 << 12;
/// Bytes of white space between two cancellation checks.
const POLL_INTERVAL_BYTES: usize = 1 << 20;
/// Elements or numbers between two cancellation checks.
const POLL_INTERVAL: u64 = 16_384;

/// The bytes of a file and how far they are read.
pub(super) struct Source<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    at: usize,
    token: &'a CancelToken,
    /// Number of the line that is read, from 1.
    pub(super) line: u64,
    pub(super) encoding: Encoding,
    pub(super) warnings: Warnings,
}

impl<'a> Source<'a> {
    pub(super) fn new(path: &'a Path, bytes: &'a [u8], token: &'a CancelToken) -> Self {
        let at = if bytes.starts_with(b"\xEF\xBB\xBF") { 3 } else { 0 };
        Self { path, bytes, at, token, line: 1, encoding: Encoding::Text, warnings: Warnings::default() }
    }

    /// The unread bytes.
    pub(super) fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.at..).unwrap_or_default()
    }

    /// Skips `count` bytes.
    pub(super) fn advance(&mut self, count: usize) {
        self.at = self.at.saturating_add(count).min(self.bytes.len());
    }

    /// The place of the next value: its line, or its byte in a binary file.
    pub(super) fn place(&self) -> FileLocation {
        match self.encoding {
            Encoding::Text => FileLocation::Line(self.line),
            _ => FileLocation::Byte(self.at as u64),
        }
    }

    /// An error at the next value.
    pub(super) fn fault(&self, problem: impl Into<String>) -> LoadError {
        self.fault_with(problem, "it may be cut off or damaged: export or copy it again")
    }

    /// An error at the next value, with what to do about it.
    pub(super) fn fault_with(&self, problem: impl Into<String>, advice: &str) -> LoadError {
        let location = match self.encoding {
            Encoding::Text => {
                let read = &self.bytes[..self.at];
                let line = read.rsplit(|&byte| byte == b'\n' || byte == b'\r').next().unwrap_or_default();
                FileLocation::Column(self.line, (line.len() as u64).saturating_add(1))
            }
            _ => FileLocation::Byte(self.at as u64),
        };
        LoadError::at(self.path, location, problem, advice)
    }

    /// Counts an occurrence of `what` at `place`.
    pub(super) fn warn(&mut self, what: &str, place: FileLocation) {
        self.warnings.add(what, || place);
    }

    /// Warns about properties that no part of the scene is made of, in one line for the element.
    pub(super) fn warn_of_unused(&mut self, element: &Element, is_used: impl Fn(&Property) -> bool) {
        let unused: Vec<_> = element.properties.iter().filter(|property| !is_used(property)).collect();
        let named: Vec<_> = unused.iter().take(3).map(|property| quoted(&property.name)).collect();
        let rest = if unused.len() > named.len() { ", …" } else { "" };
        let what = format!("properties of {} elements left out: {}{rest}", quoted(&element.name), named.join(", "));
        let count = if element.count > 0 { unused.len() as u64 } else { 0 };
        self.warnings.add_many(count, &what, || FileLocation::Line(element.line));
    }

    /// Reads a number. Integers up to 32 bits and floats convert to `f64` without loss, larger ones are rounded.
    pub(super) fn number(&mut self, number: Number) -> Result<f64, LoadError> {
        if self.encoding == Encoding::Text {
            return self.text_number();
        }
        let big = self.encoding == Encoding::Big;
        macro_rules! bytes {
            ($type:ty) => {{
                let part = self.rest().first_chunk::<{ size_of::<$type>() }>();
                let Some(&part) = part else { return Err(self.fault("the file ends where a number is expected")) };
                self.advance(part.len());
                if big { <$type>::from_be_bytes(part) } else { <$type>::from_le_bytes(part) }
            }};
        }
        macro_rules! read {
            ($type:ty) => {
                f64::from(bytes!($type))
            };
        }
        Ok(match number {
            Number::I8 => read!(i8),
            Number::U8 => read!(u8),
            Number::I16 => read!(i16),
            Number::U16 => read!(u16),
            Number::I32 => read!(i32),
            Number::U32 => read!(u32),
            Number::I64 => bytes!(i64) as f64,
            Number::U64 => bytes!(u64) as f64,
            Number::F32 => read!(f32),
            Number::F64 => read!(f64),
        })
    }

    /// Skips white space; with `within` only that before the end of the line.
    fn skip_white_space(&mut self, within: bool) -> Result<(), LoadError> {
        while let Some(&byte) = self.rest().first().filter(|byte| byte.is_ascii_whitespace()) {
            let is_return = byte == b'\r';
            if within && (is_return || byte == b'\n') {
                break;
            }
            self.advance(1);
            // A carriage return ends a line unless a line feed follows.
            let ends_line = byte == b'\n' || is_return && self.rest().first() != Some(&b'\n');
            self.line = self.line.saturating_add(u64::from(ends_line));
            self.token.check_every(POLL_INTERVAL_BYTES, self.at)?;
        }
        Ok(())
    }

    fn text_number(&mut self) -> Result<f64, LoadError> {
        self.skip_white_space(false)?;
        let rest = self.rest();
        // The search for the end of a word is bounded.
        let start = rest.get(..MAX_WORD).unwrap_or(rest);
        let end = start.iter().position(u8::is_ascii_whitespace).unwrap_or(start.len());
        if end == MAX_WORD {
            return Err(self.fault(format!("a number is longer than {MAX_WORD} bytes")));
        }
        if end == 0 {
            return Err(self.fault("the file ends where a number is expected"));
        }
        let word = &rest[..end];
        let Some(value) = number(word) else {
            return Err(self.fault_with(format!("{} is not a number", quoted(word)), advice_about(word)));
        };
        self.advance(end);
        Ok(value)
    }

    /// Reads the length of a list, of which each entry has at least a byte.
    pub(super) fn list_length(&mut self, number: Number) -> Result<u64, LoadError> {
        let length = self.number(number)?;
        let left = self.rest().len() as f64;
        if length >= 0.0 && length <= left && length.fract() == 0.0 {
            return Ok(length as u64);
        }
        // A number of 300 digits holds no more than its magnitude.
        let shown = if length.abs() < 1e15 { format!("{length}") } else { format!("{length:e}") };
        Err(self.fault(format!("a list of {shown} entries does not fit into the {left} bytes that follow")))
    }

    pub(super) fn check_memory(&self, what: &str, bytes: u64) -> Result<(), LoadError> {
        Budget::of_process().check(what, bytes).map_err(|error| LoadError::over_budget(self.path, &error))
    }

    /// Checks for cancellation and reports progress every 16,384 items.
    pub(super) fn poll(&self, index: u64) -> Result<(), LoadError> {
        if index.is_multiple_of(POLL_INTERVAL) {
            self.token.check()?;
            let done = self.at as f32 / self.bytes.len() as f32;
            self.token.set_progress(READ_PROGRESS + (0.95 - READ_PROGRESS) * done);
        }
        Ok(())
    }

    pub(super) fn skip_property(&mut self, property: &Property) -> Result<(), LoadError> {
        let length = property.list.map_or(Ok(1), |count| self.list_length(count))?;
        for k in 1..=length {
            self.poll(k)?;
            self.number(property.number)?;
        }
        Ok(())
    }

    /// Passes over all elements of a kind.
    pub(super) fn skip(&mut self, element: &Element) -> Result<(), LoadError> {
        for index in 0..element.count {
            self.poll(index)?;
            element.properties.iter().try_for_each(|property| self.skip_property(property))?;
            self.end_element(element)?;
        }
        Ok(())
    }

    /// Warns where more numbers follow in the line of an element than it has, as they do where the header disagrees with the
    /// data and all that follows is misread.
    pub(super) fn end_element(&mut self, element: &Element) -> Result<(), LoadError> {
        if self.encoding == Encoding::Text {
            self.skip_white_space(true)?;
            if self.rest().first().is_some_and(|byte| !byte.is_ascii_whitespace()) {
                let what = format!("lines with more numbers than the header gives to {}", quoted(&element.name));
                self.warn(&what, self.place());
            }
            // So that the place of the next element is its own line.
            self.skip_white_space(false)?;
        }
        Ok(())
    }

    /// Warns of what follows the last element.
    pub(super) fn check_end(&mut self) -> Result<(), LoadError> {
        let rest = self.rest();
        if rest.len() < POLL_INTERVAL_BYTES && rest.trim_ascii().is_empty() {
            return Ok(());
        }
        if self.encoding != Encoding::Text {
            let place = self.place();
            self.warnings.add_many(rest.len() as u64, "bytes after the last element not read", || place);
            return Ok(());
        }
        self.skip_white_space(false)?;
        let place = self.place();
        let mut lines = 0_u64;
        for (index, part) in self.rest().split(|&byte| byte == b'\n' || byte == b'\r').enumerate() {
            self.token.check_every(MEDIUM_STEPS, index)?;
            lines = lines.saturating_add(u64::from(!part.trim_ascii().is_empty()));
        }
        self.warnings.add_many(lines, "lines after the last element not read", || place);
        Ok(())
    }
}
