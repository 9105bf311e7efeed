//! Reading from pipes and terminals in a way that Ctrl-C ends.

use std::fs::{File, OpenOptions};
use std::io::{self, Read};
use std::path::Path;

use bvhscope_engine::cancel::CancelToken;

/// A source that is waited for only as long as `token` is not cancelled; its end then is an error.
struct Cancellable<'a, S> {
    source: S,
    token: &'a CancelToken,
}

/// Standard input.
pub fn standard_input(token: &CancelToken) -> impl Read {
    #[cfg(unix)]
    return Cancellable { source: rustix::stdio::stdin(), token };
    #[cfg(not(unix))]
    return Cancellable { source: io::stdin(), token };
}

/// A file, which may be a pipe: neither opening nor reading it waits longer than until `token` is cancelled.
pub fn open_input<'a>(path: &Path, token: &'a CancelToken) -> io::Result<impl Read + use<'a>> {
    let mut open = OpenOptions::new();
    open.read(true);
    // Opening a pipe must not wait for a writer.
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut open, libc::O_NONBLOCK);
    let source: File = open.open(path)?;
    Ok(Cancellable { source, token })
}

fn cancelled() -> io::Error {
    // Not ErrorKind::Interrupted, on which readers try again.
    io::Error::other("interrupted")
}

#[cfg(unix)]
impl<S: std::os::fd::AsFd> Read for Cancellable<'_, S> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        use rustix::event::{PollFd, PollFlags, Timespec, poll};
        use rustix::io::Errno;
        let look = Timespec { tv_sec: 0, tv_nsec: 20_000_000 };
        loop {
            if self.token.is_cancelled() {
                return Err(cancelled());
            }
            let mut descriptors = [PollFd::new(&self.source, PollFlags::IN)];
            match poll(&mut descriptors, Some(&look)) {
                Ok(0) | Err(Errno::INTR) => continue,
                // A stream that cannot be polled is tried.
                _ => {}
            }
            match rustix::io::read(&self.source, &mut *buffer) {
                Err(Errno::INTR | Errno::AGAIN) => {}
                read => return Ok(read?),
            }
        }
    }
}

#[cfg(not(unix))]
impl<S: Read> Read for Cancellable<'_, S> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.token.is_cancelled() {
            return Err(cancelled());
        }
        self.source.read(buffer)
    }
}
