//! The real program under Xvfb when things go wrong around it: damaged settings, a start that died, a driver that ends, a
//! window closed in the middle of the work.
#![cfg(all(feature = "gui", target_os = "linux"))]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Generous, because the machine may be loaded.
const PATIENCE: Duration = Duration::from_secs(120);

/// One window at a time: software rendering takes every core anyway.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// A virtual screen and a home without settings.
struct Desktop {
    xvfb: Child,
    display: String,
    home: tempfile::TempDir,
    _turn: MutexGuard<'static, ()>,
}

struct Program {
    child: Child,
    log: Receiver<String>,
}

impl Desktop {
    fn new() -> Self {
        let turn = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
        let mut xvfb = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1280x800x24", "-nolisten", "tcp"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Xvfb is missing: `make test` installs it");
        let mut number = String::new();
        BufReader::new(xvfb.stdout.as_mut().unwrap()).read_line(&mut number).unwrap();
        let display = format!(":{}", number.trim());
        Self { xvfb, display, home: tempfile::tempdir().unwrap(), _turn: turn }
    }

    fn settings(&self) -> PathBuf {
        self.home.path().join("bvhscope/app.ron")
    }

    fn write_settings(&self, text: &str) {
        std::fs::create_dir_all(self.settings().parent().unwrap()).unwrap();
        std::fs::write(self.settings(), text).unwrap();
    }

    fn start(&self, arguments: &[&str]) -> Program {
        let mut child = Command::new(env!("CARGO_BIN_EXE_bvhscope"))
            .args(arguments)
            .current_dir(self.home.path())
            .env("DISPLAY", &self.display)
            .env_remove("WAYLAND_DISPLAY")
            .env("XDG_DATA_HOME", self.home.path())
            .env("XDG_CONFIG_HOME", self.home.path())
            .env("XDG_RUNTIME_DIR", self.home.path())
            .env("WINIT_X11_SCALE_FACTOR", "1")
            .env("RUST_LOG", "bvhscope=info")
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
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
        Program { child, log }
    }
}

impl Drop for Desktop {
    fn drop(&mut self) {
        let _ = self.xvfb.kill();
        let _ = self.xvfb.wait();
    }
}

impl Program {
    /// Waits for a log line that holds `text`; none before it may tell of a panic, but for egui's renderer, which panics
    /// where the device is lost; that is caught.
    fn wait_for(&mut self, text: &str) {
        let give_up = Instant::now() + PATIENCE;
        loop {
            match self.log.recv_timeout(Duration::from_millis(200)) {
                Ok(line) if line.contains(text) => return,
                Ok(line) => assert!(!line.contains("panicked") || line.contains("egui-wgpu"), "{line}"),
                Err(_) => {
                    let status = self.child.try_wait().unwrap();
                    assert!(status.is_none(), "the program ended ({status:?}) before it said '{text}'");
                }
            }
            assert!(Instant::now() < give_up, "the program never said '{text}'");
        }
    }

    fn signal(&self, signal: &str) {
        let status = Command::new("kill").args([signal, &self.child.id().to_string()]).status().unwrap();
        assert!(status.success());
    }

    fn wait(&mut self) -> ExitStatus {
        let give_up = Instant::now() + PATIENCE;
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status;
            }
            assert!(Instant::now() < give_up, "the program is still running");
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn damaged_settings_are_kept_aside_and_the_window_opens() {
    let desktop = Desktop::new();
    let size = |size: &str| {
        let window = format!(
            "(inner_position_pixels:None,outer_position_pixels:None,fullscreen:false,maximized:false,inner_size_points:Some((x:{size},y:{size})))"
        );
        format!("{{\"window\":\"{window}\",\"bvhscope\":\"{{}}\"}}")
    };
    for (text, complains) in [
        ("garbage".to_owned(), true),
        (String::new(), true),
        ("{\"bvhscope\":\"{\\\"wanted\\\":7".to_owned(), true),
        (size("1.0"), true),
        (size("NaN"), true),
        ("{\"egui_memory_v2\":\"(options:(zoom_factor:NaN))\",\"unknown\":\"1\"}".to_owned(), true),
    ] {
        desktop.write_settings(&text);
        let mut program = desktop.start(&["builtin:teapot:2"]);
        if complains {
            program.wait_for("could not be read");
        }
        program.wait_for("presented teapot");
        let kept = desktop.settings().with_extension("ron.bad");
        assert_eq!(std::fs::read_to_string(kept).unwrap(), text);
        program.signal("-INT");
        assert_eq!(program.wait().code(), Some(130), "an interrupted window says so");
    }
}

#[test]
fn a_start_that_died_makes_the_next_one_safe() {
    let desktop = Desktop::new();
    let mut program = desktop.start(&["builtin:cornell"]);
    program.wait_for("presented cornell");
    program.signal("-KILL");
    program.wait();
    let mut program = desktop.start(&["builtin:cornell"]);
    // On a slow machine the first start may have outlived its trial.
    if desktop.home.path().join("bvhscope/starting").exists() {
        program.wait_for("this one is safe");
        program.wait_for("presented teapot");
    }
    program.signal("-INT");
    program.wait();
    let mut program = desktop.start(&["builtin:cornell"]);
    program.wait_for("presented cornell");
}

#[test]
fn a_lost_device_opens_the_window_again_with_what_was_shown() {
    let desktop = Desktop::new();
    let mut program = desktop.start(&["builtin:cornell", "--lose-device"]);
    program.wait_for("presented cornell");
    program.wait_for("the window is opened again");
    program.wait_for("presented cornell");
    assert!(program.child.try_wait().unwrap().is_none());
}

#[test]
fn a_run_without_settings_writes_none() {
    let desktop = Desktop::new();
    let mut program = desktop.start(&["builtin:teapot:2", "--no-config"]);
    program.wait_for("presented teapot");
    program.signal("-TERM");
    assert_eq!(program.wait().code(), Some(130));
    assert!(!desktop.settings().exists() && !Path::new(&desktop.home.path().join("bvhscope")).exists());
}
