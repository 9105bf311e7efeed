//! The statements of an OBJ file: physical lines of any ending, continued lines joined, and the words and numbers in them.

use std::ops::Range;

use super::super::numbers::{advice_about, number};
use super::super::read::{BYTE_ORDER_MARK, MAX_LINE};
use crate::text::{counted, quoted};

/// An error in a statement, at a byte offset in the line if a single word is at fault.
#[derive(Debug)]
pub(super) struct Fault {
    pub(super) problem: String,
    pub(super) advice: &'static str,
    pub(super) column: Option<usize>,
}

/// A statement without its continuation marks.
#[derive(Clone, Copy)]
pub(super) struct Statement<'a> {
    pub(super) keyword: &'a [u8],
    /// The text behind the keyword.
    pub(super) rest: &'a [u8],
    /// Number of its first line, from 1.
    pub(super) line: u64,
    /// Byte offset of `rest` in the line; `None` where lines were joined.
    start: Option<usize>,
    /// The line is the statement and nothing else: no comment follows, no byte order mark precedes it.
    pub(super) is_plain: bool,
}

/// Splits a text into statements.
pub(super) struct Statements<'a> {
    text: &'a [u8],
    /// Bytes consumed.
    pub(super) at: usize,
    /// Number of the line last read, from 1.
    pub(super) line: u64,
    /// The line last read, with its ending.
    pub(super) span: Range<usize>,
    joined: Vec<u8>,
}

impl<'a> Statements<'a> {
    pub(super) fn new(text: &'a [u8]) -> Self {
        Self { text, at: 0, line: 0, span: 0..0, joined: Vec::new() }
    }

    /// The next physical line without its ending.
    fn physical_line(&mut self) -> Option<&'a [u8]> {
        let rest = self.text.get(self.at..).filter(|rest| !rest.is_empty())?;
        // A line beyond the limit is not scanned to its end.
        let start = rest.get(..=MAX_LINE).unwrap_or(rest);
        let end = start.iter().position(|&byte| byte == b'\n' || byte == b'\r').unwrap_or(start.len());
        let ending = if rest[end..].starts_with(b"\r\n") { 2 } else { 1 };
        let start = self.at;
        self.at = self.at.saturating_add(end).saturating_add(ending);
        self.span = start..self.at.min(self.text.len());
        self.line = self.line.saturating_add(1);
        Some(&rest[..end])
    }

    /// The next statement; `None` at the end.
    pub(super) fn next(&mut self) -> Result<Option<Statement<'_>>, Fault> {
        let Some(mut line) = self.physical_line() else { return Ok(None) };
        let number = self.line;
        let is_joined = continued(line).is_some() && line.trim_ascii_start().first() != Some(&b'#');
        if is_joined {
            self.joined.clear();
            loop {
                let part = continued(line);
                self.joined.extend_from_slice(part.unwrap_or(line));
                self.joined.push(b' ');
                check_length(&self.joined)?;
                match part.and_then(|_| self.physical_line()) {
                    Some(next) => line = next,
                    None => break,
                }
            }
        } else {
            check_length(line)?;
        }
        let line = if is_joined { &self.joined } else { line };
        let whole = line.trim_ascii();
        // Texts that were put together have a mark where each begins.
        let statement = whole.strip_prefix(BYTE_ORDER_MARK).unwrap_or(whole);
        let end = statement.iter().position(u8::is_ascii_whitespace).unwrap_or(statement.len());
        let (keyword, rest) = statement.split_at(end);
        let start = (!is_joined).then(|| line.trim_ascii_end().len().saturating_sub(rest.len()));
        let is_plain = !is_joined && whole.len() == statement.len() && !rest.contains(&b'#');
        Ok(Some(Statement { keyword, rest, line: number, start, is_plain }))
    }
}

/// A line without the backslash with which it goes on in the next one; `None` where it does not.
fn continued(line: &[u8]) -> Option<&[u8]> {
    line.trim_ascii_end().strip_suffix(b"\\")
}

fn check_length(line: &[u8]) -> Result<(), Fault> {
    if line.len() <= MAX_LINE {
        return Ok(());
    }
    let problem = format!("the line is longer than {MAX_LINE} bytes");
    Err(Fault { problem, advice: "export the model again with shorter statements", column: None })
}

impl<'a> Statement<'a> {
    /// The words after the keyword, up to a comment, with their byte offsets in `rest`.
    fn words_at(&self) -> impl Iterator<Item = (usize, &'a [u8])> + use<'a> {
        let mut next = 0_usize;
        let parts = self.rest.split(u8::is_ascii_whitespace).map(move |word| {
            let at = next;
            next = next.saturating_add(word.len()).saturating_add(1);
            (at, word)
        });
        parts.filter(|(_, word)| !word.is_empty()).take_while(|(_, word)| word[0] != b'#')
    }

    /// The words after the keyword, up to a comment.
    pub(super) fn words(&self) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        self.words_at().map(|(_, word)| word)
    }

    /// The name after the keyword, which may contain spaces.
    pub(super) fn name(&self) -> &'a [u8] {
        self.rest.trim_ascii()
    }

    /// Reads up to `N` numbers into an array of zeros; returns it with the number of words there are. Fewer than `least` are
    /// an error that names what lacks them.
    pub(super) fn numbers<const N: usize>(&self, what: &str, least: usize) -> Result<([f64; N], usize), Fault> {
        let mut values = [0.0; N];
        let mut count = 0_usize;
        for (at, word) in self.words_at() {
            if let Some(value) = values.get_mut(count) {
                *value = number(word).ok_or_else(|| Fault {
                    problem: format!("{} is not a number", quoted(word)),
                    advice: advice_about(word),
                    column: self.start.map(|start| start.saturating_add(at)),
                })?;
            }
            count = count.saturating_add(1);
        }
        if count < least {
            let problem = format!("{what} needs {}, but there are {count}", counted(least as u64, "numbers"));
            return Err(Fault { problem, advice: "add what is missing or export the model again", column: None });
        }
        Ok((values, count))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    #[test]
    fn lines_of_any_ending_are_joined_and_numbered() {
        let mut statements = Statements::new(b"\xEF\xBB\xBFa 1\r\n# no \\\rb\t2 \\ \r\n  3 # not this\n\nc \\");
        let mut found = Vec::new();
        while let Some(statement) = statements.next().unwrap() {
            let words: Vec<String> = statement.words().map(|word| String::from_utf8_lossy(word).into_owned()).collect();
            found.push(format!(
                "{} {} {}",
                statement.line,
                String::from_utf8_lossy(statement.keyword),
                words.join(",")
            ));
        }
        assert_eq!(found, ["1 a 1", "2 # no,\\", "3 b 2,3", "5  ", "6 c "]);
    }

    #[test]
    fn numbers_that_are_none_have_advice_and_a_column() {
        for (line, column, advice) in [
            ("v 1 1,5 0", Some(4), "decimals with a point"),
            ("  v 1 0x10", Some(6), "decimal digits"),
            ("v 1 --1 0", Some(4), "correct the line"),
            ("v 1 2", None, "add what is missing"),
            ("v \\\n x 2 3", None, "correct the line"),
        ] {
            let mut statements = Statements::new(line.as_bytes());
            let fault = statements.next().unwrap().unwrap().numbers::<3>("a vertex", 3).unwrap_err();
            assert_eq!(fault.column, column, "{line}: {fault:?}");
            assert!(fault.advice.contains(advice), "{line}: {fault:?}");
        }
    }
}
