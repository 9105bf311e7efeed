//! The text of an OBJ file on its way to the crate tobj, which ends at the first line that it does not understand and loses its
//! number: good lines pass as they are, the others as the rules leave them.

use std::io::{BufRead, Read};
use std::path::Path;

use super::super::assemble::Assembly;
use super::super::error::{FileLocation, LoadError};
use super::super::read::READ_PROGRESS;
use super::materials::Materials;
use super::mesh::MESH_PROGRESS;
use super::rules::{Rules, Stop, Verdict};
use super::statement::{Fault, Statements};
use bvhscope_engine::cancel::CancelToken;

/// Bytes of the file between two cancellation checks.
const POLL_INTERVAL_BYTES: usize = 1 << 16;
/// Bytes of the file between two checks of the memory budget.
const MEMORY_INTERVAL_BYTES: usize = 1 << 20;

/// The guarded text.
pub(super) struct Guard<'a, 'b> {
    path: &'a Path,
    text: &'a [u8],
    statements: Statements<'a>,
    pub(super) rules: Rules<'a, 'b>,
    /// Bytes of [`Rules::made`] that were read.
    made_at: usize,
    /// What is left of a line that passes, behind what was made.
    line: &'a [u8],
    /// First line of the last statement.
    statement_line: u64,
    next_poll: usize,
    next_memory_check: usize,
    /// Set where reading failed.
    stop: Option<Stop>,
    token: &'a CancelToken,
}

impl<'a, 'b> Guard<'a, 'b> {
    pub(super) fn new(
        path: &'a Path,
        text: &'a [u8],
        is_colored: bool,
        materials: Materials<'b>,
        assembly: &'a mut Assembly,
        token: &'a CancelToken,
    ) -> Self {
        Self {
            path,
            text,
            statements: Statements::new(text),
            rules: Rules::new(is_colored, materials, assembly),
            made_at: 0,
            line: b"",
            statement_line: 0,
            next_poll: 0,
            next_memory_check: MEMORY_INTERVAL_BYTES,
            stop: None,
            token,
        }
    }

    /// The error for which tobj ended; `None` where the text is to be read again with colours.
    pub(super) fn into_error(self, error: tobj::LoadError) -> Option<LoadError> {
        let fault = match self.stop {
            Some(Stop::Colors) => return None,
            Some(Stop::Load(error)) => return Some(error),
            Some(Stop::Fault(fault)) => fault,
            // The line looked like numbers and was none.
            None => last_fault(&self.text[self.statements.span]).unwrap_or_else(|| Fault {
                problem: format!("cannot be read: {error}"),
                advice: "correct the line or export the model again",
                column: None,
            }),
        };
        let line = self.statement_line;
        let column = fault.column.map(|at| (at as u64).saturating_add(1));
        let location = column.map_or(FileLocation::Line(line), |column| FileLocation::Column(line, column));
        Some(LoadError::at(self.path, location, fault.problem, fault.advice))
    }

    /// Reads the next statement; returns whether there was one.
    fn advance(&mut self) -> Result<bool, Stop> {
        let at = self.statements.at;
        if at >= self.next_poll {
            self.token.check().map_err(|cancelled| Stop::Load(cancelled.into()))?;
            let fraction = at as f32 / self.text.len().max(1) as f32;
            self.token.set_progress(READ_PROGRESS + (MESH_PROGRESS - READ_PROGRESS) * fraction);
            self.next_poll = at.saturating_add(POLL_INTERVAL_BYTES);
        }
        if at >= self.next_memory_check {
            self.rules.check_memory(self.path)?;
            self.next_memory_check = at.saturating_add(MEMORY_INTERVAL_BYTES);
        }
        self.statement_line = self.statements.line.saturating_add(1);
        let Some(statement) = self.statements.next()? else { return Ok(false) };
        if matches!(self.rules.read(&statement)?, Verdict::Pass) {
            let line = &self.text[self.statements.span.clone()];
            if line.ends_with(b"\n") {
                self.line = line;
            } else {
                self.rules.made.extend_from_slice(line.trim_ascii_end());
                self.rules.made.push(b'\n');
            }
        }
        Ok(true)
    }
}

impl BufRead for Guard<'_, '_> {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        while self.made_at >= self.rules.made.len() && self.line.is_empty() {
            self.rules.made.clear();
            self.made_at = 0;
            match self.advance() {
                Ok(true) => {}
                Ok(false) => break,
                Err(stop) => {
                    self.stop = Some(stop);
                    return Err(std::io::Error::other("stopped"));
                }
            }
        }
        Ok(self.rules.made.get(self.made_at..).filter(|made| !made.is_empty()).unwrap_or(self.line))
    }

    fn consume(&mut self, count: usize) {
        if self.made_at < self.rules.made.len() {
            self.made_at = self.made_at.saturating_add(count);
        } else {
            self.line = self.line.get(count..).unwrap_or_default();
        }
    }
}

impl Read for Guard<'_, '_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.fill_buf()?.read(buffer)?;
        self.consume(count);
        Ok(count)
    }
}

/// The fault in a line of numbers.
fn last_fault(line: &[u8]) -> Option<Fault> {
    let mut statements = Statements::new(line);
    let statement = statements.next().ok()??;
    statement.numbers::<3>("a vertex", 0).err()
}
