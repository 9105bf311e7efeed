//! The text of an OBJ file on its way to the crate tobj, which ends at the first line that it does not understand and loses its
//! number: good lines pass as they are, the others as the rules leave them.
//!
//! tobj takes longer for a line than the rules do, so that it reads on a thread of its own, some blocks behind. Of the processor's
//! time on the Happy Buddha (43 MB, positions and triangles only) a quarter is the guard's and two thirds tobj's: nearly half of that
//! the system's clearing of pages for its lists (positions in double precision, 104 bytes a face, a table of vertices for each mesh),
//! then faces (parse_face, add_vertex) and one string for each line. That is twice what a reader of our own took, and 1.5 times its
//! elapsed time (median of interleaved runs on a loaded machine; 0.9 on the conference room, 0.7 on Crytek Sponza).

use std::borrow::Cow;
use std::io::{BufRead, Read};
use std::ops::Range;
use std::sync::mpsc::{Receiver, channel, sync_channel};

use super::super::error::{FileLocation, LoadError};
use super::super::read::{ModelFile, READ_PROGRESS};
use super::SETTINGS;
use super::mesh::MESH_PROGRESS;
use super::rules::{Rules, Stop, Verdict};
use super::statement::{Fault, Statements};
use bvhscope_engine::cancel::{CancelToken, Cancelled, HEAVY_STEPS};

/// Bytes of the file between two cancellation checks.
const POLL_INTERVAL_BYTES: usize = 1 << 16;
/// Bytes of the file between two checks of the memory budget.
const MEMORY_INTERVAL_BYTES: usize = 1 << 20;
/// Bytes of a block, about; together, those that wait take tobj some milliseconds, which cancelling must wait for.
const BLOCK_BYTES: usize = 1 << 16;
/// Blocks that wait for tobj.
const WAITING_BLOCKS: usize = 4;
/// Bytes of unchanged text up to which it is copied behind repaired lines rather than made a block of its own.
const COPIED_BYTES: usize = 1 << 10;

/// A part of the guarded text that ends with a line.
type Block<'a> = Cow<'a, [u8]>;

/// Reads the meshes of an OBJ file; `None` where the text is to be read again with a colour for each position.
pub(super) fn read(file: &ModelFile<'_>, rules: &mut Rules<'_, '_>) -> Result<Option<Vec<tobj::Model>>, LoadError> {
    let ModelFile { path, bytes: text, token, .. } = *file;
    // Libraries are read by the rules, whenever they are named.
    let parse =
        |blocks| tobj::load_obj_buf(&mut Guarded::new(blocks), &SETTINGS, |_| Err(tobj::LoadError::OpenFileFailed));
    let mut guard = Guard { file, statements: Statements::new(text), rules, copied: Vec::new(), passed: 0..0 };
    let (stopped, parsed) = std::thread::scope(|scope| {
        let (sender, blocks) = sync_channel(WAITING_BLOCKS);
        let thread = std::thread::Builder::new().name("tobj".to_owned()).spawn_scoped(scope, move || parse(blocks));
        if let Ok(thread) = thread {
            let stopped = guard.run(|block| sender.send(block).is_ok());
            drop(sender);
            (stopped, thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
        } else {
            let (sender, blocks) = channel();
            let stopped = guard.run(|block| sender.send(block).is_ok());
            drop(sender);
            (stopped, parse(blocks))
        }
    });
    let in_line = |line: u64, fault: Fault| {
        let column = fault.column.map(|at| (at as u64).saturating_add(1));
        let location = column.map_or(FileLocation::Line(line), |column| FileLocation::Column(line, column));
        LoadError::at(path, location, fault.problem, fault.advice)
    };
    token.check()?;
    match (stopped, parsed) {
        (Err(Stop::Colors), _) => Ok(None),
        // tobj has read up to the line at which the guard stopped.
        (_, Err(error)) => Err(match first_fault(text, token)? {
            Some((line, fault)) => in_line(line, fault),
            None => LoadError::of_file(path, format!("cannot be read: {error}"), "export the model again"),
        }),
        (Err(Stop::Load(error)), _) => Err(error),
        (Err(Stop::Fault(line, fault)), _) => Err(in_line(line, fault)),
        (Ok(()), Ok((models, _))) => Ok(Some(models)),
    }
}

/// Cuts the text into blocks.
struct Guard<'a, 'r, 'm, 'b> {
    file: &'a ModelFile<'a>,
    statements: Statements<'a>,
    rules: &'r mut Rules<'m, 'b>,
    /// Repaired lines, with some that pass between them.
    copied: Vec<u8>,
    /// Lines that pass as they are, behind what was copied.
    passed: Range<usize>,
}

impl<'a> Guard<'a, '_, '_, '_> {
    /// Hands over all blocks to `emit`, until it returns false.
    fn run(&mut self, mut emit: impl FnMut(Block<'a>) -> bool) -> Result<(), Stop> {
        let (mut next_poll, mut next_memory_check) = (0, MEMORY_INTERVAL_BYTES);
        loop {
            let at = self.statements.at;
            if at >= next_poll {
                self.file.token.check().map_err(|cancelled| Stop::Load(cancelled.into()))?;
                let fraction = at as f32 / self.file.bytes.len().max(1) as f32;
                self.file.token.set_progress(READ_PROGRESS + (MESH_PROGRESS - READ_PROGRESS) * fraction);
                next_poll = at.saturating_add(POLL_INTERVAL_BYTES);
            }
            if at >= next_memory_check {
                self.rules.check_memory(self.file.path)?;
                next_memory_check = at.saturating_add(MEMORY_INTERVAL_BYTES);
            }
            let is_full = self.passed.len() >= BLOCK_BYTES || self.copied.len() >= BLOCK_BYTES;
            if is_full && !self.flush(&mut emit) {
                return Ok(());
            }
            let verdict = self.advance();
            if !matches!(verdict, Ok(Some(_))) {
                self.flush(&mut emit);
                return verdict.map(|_| ());
            }
            let made = !self.rules.made.is_empty();
            let passes = matches!(verdict, Ok(Some(Verdict::Pass)));
            let span = self.statements.span.clone();
            if made || passes && span.start != self.passed.end {
                if self.passed.len() > COPIED_BYTES {
                    if !self.flush(&mut emit) {
                        return Ok(());
                    }
                } else {
                    self.copied.extend_from_slice(&self.file.bytes[self.passed.clone()]);
                }
                self.copied.append(&mut self.rules.made);
                self.passed = span.start..span.start;
            }
            if passes {
                self.passed.end = span.end;
                if !self.file.bytes[span.clone()].ends_with(b"\n") {
                    self.copied.extend_from_slice(self.file.bytes[self.passed.clone()].trim_ascii_end());
                    self.copied.push(b'\n');
                    self.passed = span.end..span.end;
                }
            }
        }
    }

    /// Reads the next statement; `None` at the end.
    fn advance(&mut self) -> Result<Option<Verdict>, Stop> {
        let line = self.statements.line.saturating_add(1);
        let in_line = |fault| Stop::Fault(line, fault);
        let Some(statement) = self.statements.next().map_err(in_line)? else { return Ok(None) };
        self.rules.read(&statement).map(Some)
    }

    /// Hands over what there is.
    fn flush(&mut self, emit: &mut impl FnMut(Block<'a>) -> bool) -> bool {
        let passed = &self.file.bytes[self.passed.clone()];
        self.passed.start = self.passed.end;
        (self.copied.is_empty() || emit(Cow::Owned(std::mem::take(&mut self.copied))))
            && (passed.is_empty() || emit(Cow::Borrowed(passed)))
    }
}

/// The guarded text, as tobj reads it.
struct Guarded<'a> {
    blocks: Receiver<Block<'a>>,
    block: Block<'a>,
    /// Bytes of the block that were read.
    at: usize,
}

impl<'a> Guarded<'a> {
    fn new(blocks: Receiver<Block<'a>>) -> Self {
        Self { blocks, block: Cow::Borrowed(b""), at: 0 }
    }
}

impl BufRead for Guarded<'_> {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        if self.at >= self.block.len()
            && let Ok(block) = self.blocks.recv()
        {
            (self.block, self.at) = (block, 0);
        }
        Ok(self.block.get(self.at..).unwrap_or_default())
    }

    fn consume(&mut self, count: usize) {
        self.at = self.at.saturating_add(count);
    }
}

impl Read for Guarded<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.fill_buf()?.read(buffer)?;
        self.consume(count);
        Ok(count)
    }
}

/// The first line that looks like numbers and is none, which tobj refuses without its number.
fn first_fault(text: &[u8], token: &CancelToken) -> Result<Option<(u64, Fault)>, Cancelled> {
    let mut statements = Statements::new(text);
    loop {
        let line = statements.line.saturating_add(1);
        token.check_every(HEAVY_STEPS, line as usize)?;
        let Ok(Some(statement)) = statements.next() else { return Ok(None) };
        let numbers = match statement.keyword {
            b"v" => statement.numbers::<3>("a vertex", 0).err(),
            b"vt" => statement.numbers::<2>("a texture coordinate", 0).err(),
            b"vn" => statement.numbers::<3>("a normal", 0).err(),
            _ => None,
        };
        if let Some(fault) = numbers {
            return Ok(Some((line, fault)));
        }
    }
}
