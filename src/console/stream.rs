//! A stream with a queue: takes text at once and writes it when the stream takes it.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::system::{Kind, is_ready, write};

/// Bytes written at once. A pipe that is ready takes as many without waiting.
const PORTION: usize = 4096;
/// Bytes that are queued before the next attempt to write them.
const MAX_QUEUED: usize = 64 << 10;
/// Time between two looks at whether waiting is to end.
pub(super) const LOOK: Duration = Duration::from_millis(20);
/// Time that a reader has after Ctrl-C to take the next portion.
const LAST_CHANCE: Duration = Duration::from_millis(100);

/// One of the streams, with what it has not taken yet.
#[derive(Debug)]
pub(super) struct Stream {
    kind: Kind,
    queue: Vec<u8>,
    /// Number of notes that found no room in the queue.
    left_out: u64,
    /// Why the stream takes nothing any more.
    failure: Option<io::ErrorKind>,
    /// The error as the operating system reported it.
    reason: String,
}

impl Stream {
    pub(super) const fn new(kind: Kind) -> Self {
        Self { kind, queue: Vec::new(), left_out: 0, failure: None, reason: String::new() }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.queue.is_empty()
    }

    /// Adds a line to the queue, or counts it where that holds `most` bytes already.
    pub(super) fn queue_note(&mut self, line: &str, most: usize) {
        if self.queue.len() + line.len() > most {
            self.left_out += 1;
            return;
        }
        if self.left_out > 0 {
            let left_out = std::mem::take(&mut self.left_out);
            self.queue.extend_from_slice(format!("({left_out} lines were left out here)\n").as_bytes());
        }
        self.queue.extend_from_slice(line.as_bytes());
        self.queue.push(b'\n');
    }

    /// Adds `bytes` to the queue; fails once the stream has failed.
    pub(super) fn queue(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.queue.extend_from_slice(bytes);
        if self.queue.len() > MAX_QUEUED { self.write_some() } else { self.check() }
    }

    /// Writes as much of the queue as the stream takes without waiting. Of a stream that fails the queue is dropped.
    pub(super) fn write_some(&mut self) -> io::Result<()> {
        let mut written = 0;
        while written < self.queue.len() && self.failure.is_none() && self.is_ready() {
            let end = self.queue.len().min(written + PORTION);
            match write(self.kind, &self.queue[written..end]) {
                Ok(0) => break,
                Ok(count) => written += count,
                Err(error) => {
                    // Notes are tried again: a disk that was full may have room.
                    if self.kind == Kind::Output {
                        self.failure = Some(error.kind());
                        self.reason = error.to_string();
                    }
                    self.queue.clear();
                    return Err(error);
                }
            }
        }
        self.queue.drain(..written.min(self.queue.len()));
        self.check()
    }

    /// True if the stream takes text, or fails, without waiting.
    pub(super) fn is_ready(&self) -> bool {
        is_ready(self.kind, Duration::ZERO)
    }

    fn check(&self) -> io::Result<()> {
        self.failure.map_or(Ok(()), |kind| Err(io::Error::new(kind, self.reason.clone())))
    }
}

/// Waits until the queue is written; after `stopped` only for as long as the reader takes something now and then.
pub(super) fn wait_for_all(stream: &Mutex<Stream>, stopped: &AtomicBool) -> io::Result<()> {
    let mut give_up = None;
    let mut left = usize::MAX;
    loop {
        let kind = {
            let mut stream = stream.lock().unwrap_or_else(PoisonError::into_inner);
            stream.write_some()?;
            if stream.is_empty() {
                return Ok(());
            }
            if stream.queue.len() < left {
                left = stream.queue.len();
                give_up = None;
            }
            stream.kind
        };
        if stopped.load(Ordering::Relaxed) && Instant::now() > *give_up.get_or_insert(Instant::now() + LAST_CHANCE) {
            return Err(io::Error::new(io::ErrorKind::TimedOut, "nobody reads them"));
        }
        is_ready(kind, LOOK);
    }
}
