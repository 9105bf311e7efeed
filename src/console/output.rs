//! Notes on stderr and results on stdout.

use std::fmt::Display;
use std::io::{self, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::stream::{LOOK, Stream, wait_for_all};
use super::system::{Kind, is_ready};
use crate::text::printable;

/// Bytes of notes that wait at most; a window may log for days into a pipe that nobody reads.
const MAX_NOTES: usize = 1 << 20;

static OUTPUT: Mutex<Stream> = Mutex::new(Stream::new(Kind::Output));
static ERROR: Mutex<Stream> = Mutex::new(Stream::new(Kind::Error));
/// A thread writes notes that stderr has not taken at once. Changed under the lock of [`ERROR`] only.
static WRITER_RUNS: AtomicBool = AtomicBool::new(false);
/// Nothing waits for a slow reader any more.
static STOPPED: AtomicBool = AtomicBool::new(false);

fn locked(stream: &'static Mutex<Stream>) -> MutexGuard<'static, Stream> {
    stream.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Prints a line on stderr, its control characters escaped; line breaks stay. A failure to write is ignored:
/// there is nobody to tell.
pub fn note(text: impl Display) {
    let mut error = locked(&ERROR);
    error.queue_note(&printable_lines(&text.to_string()), MAX_NOTES);
    // A note that is lost fails nothing.
    let _ = error.write_some();
    if !error.is_empty() && !WRITER_RUNS.swap(true, Ordering::Relaxed) {
        write_the_rest();
    }
}

/// Writes what stderr has not taken on a thread of its own, because no further note may come along to do it.
fn write_the_rest() {
    let write = || loop {
        is_ready(Kind::Error, LOOK);
        let mut error = locked(&ERROR);
        let _ = error.write_some();
        if error.is_empty() {
            // Under the lock, so that the next note that is left starts another.
            WRITER_RUNS.store(false, Ordering::Relaxed);
            return;
        }
    };
    if std::thread::Builder::new().name("notes".to_owned()).spawn(write).is_err() {
        WRITER_RUNS.store(false, Ordering::Relaxed);
    }
}

/// True if stderr takes text now, so that drawing on it does not wait.
pub fn is_error_ready() -> bool {
    let mut error = locked(&ERROR);
    error.write_some().is_ok() && error.is_empty() && error.is_ready()
}

/// Waits until stderr has taken every note.
pub fn finish() {
    let _ = wait_for_all(&ERROR, &STOPPED);
}

/// Lets nothing wait for a slow reader any longer than a moment: after Ctrl-C.
pub fn stop_waiting() {
    STOPPED.store(true, Ordering::Relaxed);
}

/// Results on stdout. Writing fails where stdout cannot take them, and never waits; [`Output::finish`] does.
#[derive(Debug, Default)]
pub struct Output;

impl Output {
    /// Waits until everything is written.
    pub fn finish(&self) -> io::Result<()> {
        wait_for_all(&OUTPUT, &STOPPED)
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        locked(&OUTPUT).queue(bytes)?;
        Ok(bytes.len())
    }

    /// Writes what stdout takes now.
    fn flush(&mut self) -> io::Result<()> {
        locked(&OUTPUT).write_some()
    }
}

/// `text` with everything in it escaped that could drive a terminal, except for line breaks.
pub fn printable_lines(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for (index, line) in text.split('\n').enumerate() {
        if index > 0 {
            shown.push('\n');
        }
        shown.push_str(&printable(line));
    }
    shown
}

/// JSON with the same characters escaped, which it may hold in its strings only.
pub fn printable_json(json: &str) -> String {
    use std::fmt::Write as _;
    let mut shown = String::with_capacity(json.len());
    let mut buffer = [0; 4];
    for character in json.chars() {
        if printable(character.encode_utf8(&mut buffer)).len() == character.len_utf8() {
            shown.push(character);
        } else {
            for unit in character.encode_utf16(&mut [0; 2]) {
                // Writing to a text cannot fail.
                let _ = write!(shown, "\\u{unit:04x}");
            }
        }
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_line_breaks_stay_of_control_characters() {
        assert_eq!(printable_lines("a\u{1b}[2J\r\n\tb\u{9b}é"), "a\\u{1b}[2J\\r\n\\tb\\u{9b}é");
        assert_eq!(printable_json("{\"a\":\"\u{9b}\u{202e}é\"}"), "{\"a\":\"\\u009b\\u202eé\"}");
    }
}
