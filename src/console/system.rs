//! The streams as the system has them. Where it does not tell whether they are ready, they can only be waited for.

use std::io;
use std::time::Duration;

/// Which of the two streams for output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Output,
    Error,
}

#[cfg(unix)]
fn descriptor(kind: Kind) -> std::os::fd::BorrowedFd<'static> {
    match kind {
        Kind::Output => rustix::stdio::stdout(),
        Kind::Error => rustix::stdio::stderr(),
    }
}

/// Waits until the stream takes text, or fails, without waiting; at most for `wait`, which is less than a second.
#[cfg(unix)]
pub(super) fn is_ready(kind: Kind, wait: Duration) -> bool {
    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    let wait = Timespec { tv_sec: 0, tv_nsec: wait.subsec_nanos().into() };
    let mut descriptors = [PollFd::from_borrowed_fd(descriptor(kind), PollFlags::OUT)];
    match poll(&mut descriptors, Some(&wait)) {
        Ok(count) => count > 0,
        Err(rustix::io::Errno::INTR) => false,
        // A stream that cannot be polled is tried.
        Err(_) => true,
    }
}

#[cfg(not(unix))]
pub(super) fn is_ready(_: Kind, _: Duration) -> bool {
    true
}

/// Writes some of `bytes`; none where the stream would have to be waited for all the same.
#[cfg(unix)]
pub(super) fn write(kind: Kind, bytes: &[u8]) -> io::Result<usize> {
    use rustix::io::Errno;
    match rustix::io::write(descriptor(kind), bytes) {
        Ok(count) => Ok(count),
        // Another program may have set the stream, which it shares, to return at once.
        Err(Errno::AGAIN | Errno::INTR) => {
            std::thread::sleep(Duration::from_millis(1));
            Ok(0)
        }
        Err(error) => Err(error.into()),
    }
}

#[cfg(not(unix))]
pub(super) fn write(kind: Kind, bytes: &[u8]) -> io::Result<usize> {
    use std::io::Write as _;
    match kind {
        Kind::Output => {
            let mut stream = io::stdout().lock();
            stream.write_all(bytes)?;
            stream.flush()?;
        }
        Kind::Error => io::stderr().lock().write_all(bytes)?,
    }
    Ok(bytes.len())
}
