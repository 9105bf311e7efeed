//! A virtual screen, a home folder without settings, and the program running on them.

#![allow(dead_code, reason = "each test file uses its part")]

use std::collections::VecDeque;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::support::process::{PATIENCE, Running, Signal};

/// The viewer.
pub const PROGRAM: &str = env!("CARGO_BIN_EXE_bvhscope");

/// Samples of each pixel: enough to compare pictures by, in a quarter of the time. Screenshots that are kept have as many as users see.
pub static SAMPLES: LazyLock<u32> =
    LazyLock::new(|| if std::env::var_os("UPDATE_SCREENSHOTS").is_some() { 16 } else { 4 });

/// The viewer's log line for the last sample of each pixel.
pub static LAST_SAMPLE: LazyLock<String> = LazyLock::new(|| format!(", {} samples a pixel", *SAMPLES));

/// One window at a time: software rendering takes every core anyway.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// A virtual screen and a home without settings.
pub struct Desktop {
    /// Ends with the desktop.
    _xvfb: Running,
    pub display: String,
    home: tempfile::TempDir,
    _turn: MutexGuard<'static, ()>,
}

/// The viewer running there.
pub struct Program {
    child: Running,
    log: Receiver<String>,
    /// Lines of the log that no test has read yet, oldest first.
    unread: VecDeque<String>,
    /// Number of log lines so far.
    line_count: usize,
    /// True if the last picture has all its samples.
    picture_complete: bool,
}

impl Desktop {
    pub fn new() -> Self {
        Self::with_screen("1280x800x24")
    }

    /// A screen of WIDTHxHEIGHTxDEPTH.
    pub fn with_screen(screen: &str) -> Self {
        let turn = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
        // Without -noreset it restarts when its last client disconnects, and refuses connections meanwhile.
        let mut xvfb = Running::start(
            Command::new("Xvfb")
                .args(["-displayfd", "1", "-screen", "0", screen, "-nolisten", "tcp", "-noreset"])
                .stdout(Stdio::piped())
                .stderr(Stdio::null()),
        );
        let mut number = String::new();
        BufReader::new(xvfb.stdout.as_mut().unwrap()).read_line(&mut number).unwrap();
        let display = format!(":{}", number.trim());
        Self { _xvfb: xvfb, display, home: tempfile::tempdir().unwrap(), _turn: turn }
    }

    /// The program's working folder and home.
    pub fn home(&self) -> &Path {
        self.home.path()
    }

    /// A folder of programs that are found before those of the system.
    pub fn programs(&self) -> PathBuf {
        self.home().join("programs")
    }

    /// The program's settings file.
    pub fn settings(&self) -> PathBuf {
        self.home().join("bvhscope/settings.json")
    }

    /// The file with the place and size of its window.
    pub fn window_place(&self) -> PathBuf {
        self.home().join("bvhscope/window.ron")
    }

    pub fn write_settings(&self, text: &str) {
        std::fs::create_dir_all(self.settings().parent().unwrap()).unwrap();
        std::fs::write(self.settings(), text).unwrap();
    }

    /// A program with this screen and home.
    pub fn command(&self, program: impl AsRef<std::ffi::OsStr>) -> Command {
        let mut command = Command::new(program);
        // Programs that a test puts there stand for those of a desktop.
        let mut path = self.programs().into_os_string();
        path.push(":");
        path.push(std::env::var_os("PATH").unwrap_or_default());
        command
            .current_dir(self.home())
            .env("PATH", path)
            .env("DISPLAY", &self.display)
            .env_remove("WAYLAND_DISPLAY")
            .env("XDG_DATA_HOME", self.home())
            .env("XDG_CONFIG_HOME", self.home())
            .env("XDG_RUNTIME_DIR", self.home())
            .env("WINIT_X11_SCALE_FACTOR", "1")
            .env("RUST_LOG", "bvhscope=info");
        command
    }

    /// The same for a program with its first arguments, and further ones.
    pub fn command_as(&self, program: &[&str], arguments: &[&str]) -> Command {
        let mut command = self.command(program[0]);
        command.args(&program[1..]).args(arguments);
        if program.contains(&PROGRAM) {
            command.args(["--samples", &SAMPLES.to_string()]);
        }
        command
    }

    pub fn start(&self, arguments: &[&str]) -> Program {
        self.start_as(&[PROGRAM], arguments)
    }

    /// Starts the viewer by another program that it replaces: `program` is that one with its arguments, then the viewer.
    pub fn start_as(&self, program: &[&str], arguments: &[&str]) -> Program {
        let mut child = Running::start(self.command_as(program, arguments).stderr(Stdio::piped()));
        let stderr = child.stderr.take().unwrap();
        let (sender, log) = channel();
        std::thread::spawn(move || {
            for line in BufReader::new(stderr).lines().map_while(Result::ok) {
                eprintln!("  {line}");
                if sender.send(line).is_err() {
                    break;
                }
            }
        });
        Program { child, log, unread: VecDeque::new(), line_count: 0, picture_complete: false }
    }

    /// Runs `program`; its stdout.
    pub fn run(&self, program: &str, arguments: &[&str]) -> Vec<u8> {
        self.command(program).args(arguments).output().unwrap().stdout
    }

    pub fn xdotool(&self, arguments: &[&str]) {
        let status = self.command("xdotool").args(arguments).status().unwrap();
        assert!(status.success(), "xdotool {arguments:?} failed");
    }

    /// The X11 id of the program's window, once it exists.
    pub fn find_window(&self, program: &mut Program) -> String {
        let give_up = Instant::now() + PATIENCE;
        let pid = program.child.id().to_string();
        loop {
            let output = self.run("xdotool", &["search", "--onlyvisible", "--pid", &pid]);
            if let Some(id) = String::from_utf8_lossy(&output).lines().last() {
                return id.to_owned();
            }
            assert!(program.is_running(), "the program ended before it had a window");
            assert!(Instant::now() < give_up, "no window came up");
            std::thread::sleep(Duration::from_millis(100));
        }
    }
}

impl Program {
    /// Waits for a log line that contains `text` and returns it. No line before it may report a panic, except that of egui's
    /// renderer where the device is lost, which is caught.
    pub fn wait_for(&mut self, text: &str) -> String {
        let line = self.wait_for_line(&[text], "egui-wgpu");
        line.unwrap_or_else(|| panic!("the program ended before it logged '{text}'"))
    }

    /// Waits for a log line that contains one of `texts`; `None` where the program ends without one. No line before it may
    /// report a panic, except that of a library which cannot start a thread, which is caught.
    pub fn wait_for_either(&mut self, texts: &[&str]) -> Option<String> {
        self.wait_for_line(texts, "std/src/thread")
    }

    fn wait_for_line(&mut self, texts: &[&str], caught_panic: &str) -> Option<String> {
        let give_up = Instant::now() + PATIENCE;
        loop {
            while let Some(line) = self.unread.pop_front() {
                if texts.iter().any(|text| line.contains(text)) {
                    return Some(line);
                }
                assert!(!line.contains("panicked") || line.contains(caught_panic), "{line}");
            }
            match self.log.recv_timeout(Duration::from_millis(200)) {
                Ok(line) => self.receive(line),
                // The program has ended, and all its lines are read.
                Err(RecvTimeoutError::Disconnected) => return None,
                Err(RecvTimeoutError::Timeout) => {
                    assert!(Instant::now() < give_up, "the program never logged {texts:?}");
                }
            }
        }
    }

    fn receive(&mut self, line: String) {
        self.line_count += 1;
        if line.contains("presented ") || line.contains("picture at full resolution") {
            self.picture_complete = line.contains(LAST_SAMPLE.as_str());
        }
        self.unread.push_back(line);
    }

    /// Receives the log lines that have arrived.
    fn read_log(&mut self) {
        while let Ok(line) = self.log.try_recv() {
            self.receive(line);
        }
    }

    /// The number of log lines so far, and whether the last picture that they report has all its samples.
    pub fn progress(&mut self) -> (usize, bool) {
        self.read_log();
        (self.line_count, self.picture_complete)
    }

    /// Processor time of the program so far.
    pub fn spent(&self) -> Duration {
        self.stat().map_or(Duration::ZERO, |stat| stat.1)
    }

    /// Waits for the end of the program. Returns its processor time, and for how long all of its threads slept while this waited:
    /// unlike elapsed time, neither grows with the load of the machine.
    pub fn spent_and_slept_at_its_end(&self) -> (Duration, Duration) {
        let give_up = Instant::now() + PATIENCE;
        let look = Duration::from_millis(2);
        let mut slept = Duration::ZERO;
        loop {
            match self.stat() {
                Some(('Z', spent)) => return (spent, slept),
                Some(_) => {
                    slept += if self.all_sleep() { look } else { Duration::ZERO };
                    std::thread::sleep(look);
                }
                None => panic!("the program was waited for already"),
            }
            assert!(Instant::now() < give_up, "the program goes on");
        }
    }

    /// True if no thread of the program is running or runnable.
    fn all_sleep(&self) -> bool {
        let threads = std::fs::read_dir(format!("/proc/{}/task", self.child.id())).into_iter().flatten().flatten();
        // The file of a thread that has just ended is gone.
        let mut states = threads.filter_map(|thread| {
            let text = std::fs::read_to_string(thread.path().join("stat")).ok()?;
            text.rsplit_once(')')?.1.trim_start().chars().next()
        });
        states.all(|state| state == 'S')
    }

    /// State of the process, `Z` once it has ended, and its processor time.
    fn stat(&self) -> Option<(char, Duration)> {
        let text = std::fs::read_to_string(format!("/proc/{}/stat", self.child.id())).ok()?;
        let fields: Vec<&str> = text.rsplit_once(')')?.1.split_whitespace().collect();
        // In hundredths of a second: user and system time.
        let ticks = fields[11].parse::<u64>().ok()? + fields[12].parse::<u64>().ok()?;
        Some((fields[0].chars().next()?, Duration::from_millis(10 * ticks)))
    }

    /// Waits until all of the program's threads sleep and go on sleeping, so that it has dealt with everything so far. A thread
    /// that wants to run and has no processor does not sleep, so the load of the machine makes no difference. `look` is called
    /// again and again meanwhile.
    pub fn wait_until_idle(&mut self, mut look: impl FnMut(&mut Self)) {
        let give_up = Instant::now() + PATIENCE;
        let mut looks_asleep = 0;
        while looks_asleep < 20 {
            assert!(self.is_running(), "the program ended");
            assert!(Instant::now() < give_up, "the program is never idle");
            look(self);
            let (before, was_asleep) = (self.spent(), self.all_sleep());
            std::thread::sleep(Duration::from_millis(20));
            looks_asleep = if was_asleep && self.spent() == before { looks_asleep + 1 } else { 0 };
        }
    }

    /// True if a line with `text` has been logged and not been waited for.
    pub fn has_logged(&mut self, text: &str) -> bool {
        self.read_log();
        self.unread.iter().any(|line| line.contains(text))
    }

    /// The log lines since those that were waited for.
    pub fn unread_lines(&mut self) -> Vec<String> {
        self.read_log();
        self.unread.drain(..).collect()
    }

    pub fn is_running(&mut self) -> bool {
        self.child.is_running()
    }

    pub fn signal(&self, signal: Signal) {
        self.child.signal(signal);
    }

    pub fn wait(&mut self) -> ExitStatus {
        self.child.wait_for_end()
    }
}
