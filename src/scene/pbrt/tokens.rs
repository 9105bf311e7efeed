//! The tokens of a PBRT file: words, texts in quotes and brackets, between white space and comments.

use std::borrow::Cow;
use std::path::Path;

use crate::scene::error::{FileLocation, LoadError};
use crate::scene::numbers::{advice_about, number};
use crate::scene::read::{BYTE_ORDER_MARK, MAX_LINE};
use crate::text::quoted;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// Bytes between two cancellation checks.
const POLL_INTERVAL: usize = 1 << 16;
/// Advice about text that breaks the rules of the format.
pub(super) const CORRECT: &str = "correct the line or export the scene again";
/// Advice about text that ends too early.
const CUT_OFF: &str = "it may be cut off: export or copy it again";

/// The tokens of one file.
pub(super) struct Tokens<'a> {
    bytes: Cow<'a, [u8]>,
    at: usize,
    /// Number of the line of the token last read, from 1.
    pub(super) line: u64,
    /// The name by which the scene includes the file; `None` for the scene itself.
    pub(super) name: Option<String>,
    next_poll: usize,
    path: &'a Path,
    cancel: &'a CancelToken,
}

impl<'a> Tokens<'a> {
    /// The tokens of the scene at `path`, or of the file that it includes by `name`.
    pub(super) fn new(bytes: Cow<'a, [u8]>, name: Option<String>, path: &'a Path, cancel: &'a CancelToken) -> Self {
        let at = if bytes.starts_with(BYTE_ORDER_MARK) { BYTE_ORDER_MARK.len() } else { 0 };
        Self { bytes, at, line: 1, name, next_poll: 0, path, cancel }
    }

    /// Part of the file that was read, 0 to 1.
    pub(super) fn progress(&self) -> f32 {
        self.at as f32 / self.bytes.len().max(1) as f32
    }

    /// Position of the token last read.
    pub(super) fn place(&self) -> FileLocation {
        match &self.name {
            Some(name) => FileLocation::LineIn(name.clone(), self.line),
            None => FileLocation::Line(self.line),
        }
    }

    /// An error about the token last read.
    pub(super) fn fault(&self, problem: impl Into<String>, advice: &str) -> LoadError {
        LoadError::at(self.path, self.place(), problem, advice)
    }

    /// The first byte of the next token; `None` at the end.
    pub(super) fn peek(&mut self) -> Result<Option<u8>, Cancelled> {
        let mut in_comment = false;
        while let Some(&byte) = self.bytes.get(self.at) {
            match byte {
                b'\n' | b'\r' => {
                    in_comment = false;
                    let is_pair = byte == b'\r' && self.bytes.get(self.at.saturating_add(1)) == Some(&b'\n');
                    self.line = self.line.saturating_add(u64::from(!is_pair));
                }
                b'#' => in_comment = true,
                _ if in_comment || byte.is_ascii_whitespace() => {}
                _ => break,
            }
            self.at = self.at.saturating_add(1);
            self.poll()?;
        }
        self.poll()?;
        Ok(self.bytes.get(self.at).copied())
    }

    fn poll(&mut self) -> Result<(), Cancelled> {
        if self.at >= self.next_poll {
            self.cancel.check()?;
            self.next_poll = self.at.saturating_add(POLL_INTERVAL);
        }
        Ok(())
    }

    /// Passes the next byte if it is `wanted`; returns whether it was.
    pub(super) fn skip(&mut self, wanted: u8) -> Result<bool, Cancelled> {
        let is_there = self.peek()? == Some(wanted);
        self.at = self.at.saturating_add(usize::from(is_there));
        Ok(is_there)
    }

    /// The next word, which ends at white space, a bracket, a quote or a comment; empty where something else follows.
    pub(super) fn word(&mut self) -> Result<&[u8], LoadError> {
        self.peek()?;
        let start = self.at;
        let rest = self.bytes.get(start..).unwrap_or_default();
        let limit = rest.get(..=MAX_LINE).unwrap_or(rest);
        let ends = |byte: &u8| byte.is_ascii_whitespace() || b"[]\"#".contains(byte);
        let length = limit.iter().position(ends).unwrap_or(limit.len());
        if length > MAX_LINE {
            return Err(self.fault(format!("the word is longer than {MAX_LINE} bytes"), CORRECT));
        }
        self.at = start.saturating_add(length);
        Ok(&self.bytes[start..self.at])
    }

    /// The next text in quotes, without them.
    pub(super) fn text(&mut self) -> Result<String, LoadError> {
        if self.peek()?.is_none() {
            return Err(self.fault("a text in quotes is missing", CUT_OFF));
        }
        if !self.skip(b'"')? {
            let word = quoted(self.word()?);
            return Err(self.fault(format!("{word} stands where a text in quotes is expected"), CORRECT));
        }
        let (start, mut is_escaped) = (self.at, false);
        let rest = self.bytes.get(start..).unwrap_or_default();
        let end = rest.iter().take(MAX_LINE).position(|&byte| {
            let ends = byte == b'\n' || byte == b'"' && !is_escaped;
            is_escaped = byte == b'\\' && !is_escaped;
            ends
        });
        let Some(length) = end.filter(|&end| rest[end] == b'"') else {
            return Err(self.fault("the text has no closing quote in its line", CORRECT));
        };
        self.at = start.saturating_add(length).saturating_add(1);
        let text = String::from_utf8_lossy(&rest[..length]);
        Ok(if text.contains('\\') { text.replace("\\\"", "\"").replace("\\\\", "\\") } else { text.into_owned() })
    }

    /// The next word as a number.
    pub(super) fn number(&mut self) -> Result<f64, LoadError> {
        let word = self.word()?;
        if let Some(value) = number(word) {
            return Ok(value);
        }
        let (problem, advice) = match word {
            b"" => ("a number is missing".to_owned(), CUT_OFF),
            word => (format!("{} is not a number", quoted(word)), advice_about(word)),
        };
        Err(self.fault(problem, advice))
    }

    /// The `N` numbers after a directive, which may be in brackets.
    pub(super) fn numbers<const N: usize>(&mut self) -> Result<[f64; N], LoadError> {
        let is_list = self.skip(b'[')?;
        let mut numbers = [0.0; N];
        for value in &mut numbers {
            *value = self.number()?;
        }
        if is_list {
            self.close()?;
        }
        Ok(numbers)
    }

    /// Passes the bracket that closes a list.
    pub(super) fn close(&mut self) -> Result<(), LoadError> {
        if self.skip(b']')? {
            return Ok(());
        }
        let advice = if self.peek()?.is_none() { CUT_OFF } else { CORRECT };
        Err(self.fault("a list is not closed by ']'", advice))
    }
}
