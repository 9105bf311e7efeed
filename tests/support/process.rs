//! Processes that tests start.

use std::ops::{Deref, DerefMut};
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Output};
use std::time::{Duration, Instant};

pub use rustix::process::Signal;

/// Longest wait for anything that a test expects of a process. Far more than a loaded machine needs: nothing measures
/// speed by it.
pub const PATIENCE: Duration = Duration::from_mins(10);
/// Pause between two queries of a process's state.
const POLL_INTERVAL: Duration = Duration::from_millis(5);

/// A child process that is killed when the test ends, also by failing.
pub struct Running(Child);

impl Running {
    pub fn start(command: &mut Command) -> Self {
        let child = command.spawn();
        Self(child.unwrap_or_else(|error| {
            panic!("{}: {error} (`make test` installs what tests start)", command.get_program().display())
        }))
    }

    pub fn signal(&self, signal: Signal) {
        rustix::process::kill_process(rustix::process::Pid::from_child(&self.0), signal)
            .expect("the process takes signals");
    }

    /// Waits until the process handles `signal` itself, which ends it otherwise. Known on Linux only.
    pub fn wait_for_handler(&mut self, signal: Signal) {
        if !cfg!(target_os = "linux") {
            return;
        }
        let give_up = Instant::now() + PATIENCE;
        let bit = 1 << (signal.as_raw() - 1);
        let status = format!("/proc/{}/status", self.0.id());
        loop {
            let text = std::fs::read_to_string(&status).expect("the process has a status");
            let caught = text.lines().find_map(|line| line.strip_prefix("SigCgt:")).expect("the signals it handles");
            if u64::from_str_radix(caught.trim(), 16).expect("a set of signals in hexadecimal") & bit != 0 {
                return;
            }
            assert!(self.is_running(), "the process ended before it handled {signal:?}");
            assert!(Instant::now() < give_up, "the process never handles {signal:?}");
            std::thread::sleep(POLL_INTERVAL);
        }
    }

    /// Waits until the process has worked for `time` on a processor: unlike elapsed time, that does not depend on the load of the
    /// machine. Known on Linux only; elsewhere this much time passes.
    pub fn wait_until_it_worked(&mut self, time: Duration) {
        if !cfg!(target_os = "linux") {
            return std::thread::sleep(time);
        }
        let give_up = Instant::now() + PATIENCE;
        while self.worked() < time {
            assert!(self.is_running(), "the process ended before it had worked for {time:?}");
            assert!(Instant::now() < give_up, "the process never works for {time:?}");
            std::thread::sleep(POLL_INTERVAL);
        }
    }

    /// Processor time so far.
    fn worked(&self) -> Duration {
        let text = std::fs::read_to_string(format!("/proc/{}/stat", self.0.id())).unwrap_or_default();
        let fields: Vec<&str> = text.rsplit_once(')').map_or("", |parts| parts.1).split_whitespace().collect();
        // In hundredths of a second: user and system time.
        let ticks = fields.iter().skip(11).take(2).filter_map(|field| field.parse::<u64>().ok()).sum::<u64>();
        Duration::from_millis(10 * ticks)
    }

    pub fn is_running(&mut self) -> bool {
        self.0.try_wait().expect("the process can be waited for").is_none()
    }

    /// Waits for the end of the process.
    pub fn wait_for_end(&mut self) -> ExitStatus {
        let give_up = Instant::now() + PATIENCE;
        loop {
            if let Some(status) = self.0.try_wait().expect("the process can be waited for") {
                return status;
            }
            assert!(Instant::now() < give_up, "process {} is still running", self.0.id());
            std::thread::sleep(POLL_INTERVAL);
        }
    }
}

impl Deref for Running {
    type Target = Child;

    fn deref(&self) -> &Child {
        &self.0
    }
}

impl DerefMut for Running {
    fn deref_mut(&mut self) -> &mut Child {
        &mut self.0
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Waits until `done` returns `true`.
pub fn wait_until(mut done: impl FnMut() -> bool) {
    let give_up = Instant::now() + PATIENCE;
    while !done() {
        assert!(Instant::now() < give_up, "it never happened");
        std::thread::sleep(POLL_INTERVAL);
    }
}

/// Runs a command to its end and collects what it prints; fails where it goes on for longer than `PATIENCE`.
pub fn output(command: Command) -> Output {
    let shown = format!("{command:?}");
    let output = assert_cmd::Command::from_std(command).timeout(PATIENCE).output();
    output.unwrap_or_else(|error| panic!("{shown}: {error}"))
}

/// A copy of the program in a folder that every user may enter, unlike the build's, which may lie in root's home.
pub struct SharedProgram {
    folder: tempfile::TempDir,
}

impl SharedProgram {
    pub fn new() -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        allow_everyone(folder.path(), 0o755);
        let shared = Self { folder };
        std::fs::copy(env!("CARGO_BIN_EXE_bvhscope"), shared.path()).expect("the program can be copied");
        allow_everyone(&shared.path(), 0o755);
        shared
    }

    pub fn path(&self) -> PathBuf {
        self.folder.path().join("bvhscope")
    }
}

pub fn allow_everyone(path: &Path, mode: u32) {
    let permissions = std::fs::Permissions::from_mode(mode);
    std::fs::set_permissions(path, permissions).expect("permissions can be changed");
}
