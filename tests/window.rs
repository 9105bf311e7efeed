//! The real program in a real X11 window under Xvfb, driven by xdotool as a user's hands would: open, drag, wheel, key,
//! slider, drop a file, close. Screenshots are compared for what must have changed; the log tells when it has.
#![cfg(all(feature = "gui", target_os = "linux"))]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Generous, because the machine may be loaded; nothing measures speed by it.
const PATIENCE: Duration = Duration::from_secs(90);

/// One window at a time: software rendering takes every core anyway.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// A virtual screen with the program on it.
struct Desktop {
    xvfb: Child,
    app: Child,
    display: String,
    window: String,
    log: Receiver<String>,
    home: tempfile::TempDir,
    _turn: MutexGuard<'static, ()>,
}

/// A picture of the whole screen: width, height and pixels as 0xRRGGBB.
struct Screenshot {
    width: usize,
    pixels: Vec<u32>,
}

impl Desktop {
    fn start(arguments: &[&str]) -> Self {
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
        let home = tempfile::tempdir().unwrap();
        let mut app = Command::new(env!("CARGO_BIN_EXE_bvhscope"))
            .args(arguments)
            .current_dir(home.path())
            .env("DISPLAY", &display)
            .env_remove("WAYLAND_DISPLAY")
            .env("XDG_DATA_HOME", home.path())
            .env("XDG_CONFIG_HOME", home.path())
            .env("XDG_RUNTIME_DIR", home.path())
            .env("WINIT_X11_SCALE_FACTOR", "1")
            .env("RUST_LOG", "bvhscope=info")
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let stderr = app.stderr.take().unwrap();
        let (sender, log) = channel();
        std::thread::spawn(move || {
            for line in BufReader::new(stderr).lines().map_while(Result::ok) {
                eprintln!("  {line}");
                if sender.send(line).is_err() {
                    break;
                }
            }
        });
        let mut desktop = Self { xvfb, app, display, window: String::new(), log, home, _turn: turn };
        desktop.window = desktop.find_window();
        desktop.xdotool(&["windowmove", "--sync", &desktop.window.clone(), "0", "0"]);
        desktop.xdotool(&["windowfocus", "--sync", &desktop.window.clone()]);
        desktop
    }

    fn find_window(&mut self) -> String {
        let give_up = Instant::now() + PATIENCE;
        loop {
            let pid = self.app.id().to_string();
            let output = self.run("xdotool", &["search", "--onlyvisible", "--pid", &pid]);
            if let Some(id) = output.lines().last() {
                return id.to_owned();
            }
            if let Some(status) = self.app.try_wait().unwrap() {
                panic!("the program ended before it had a window: {status}");
            }
            assert!(Instant::now() < give_up, "no window came up");
            std::thread::sleep(Duration::from_millis(100));
        }
    }

    fn run(&self, program: &str, arguments: &[&str]) -> String {
        let output = Command::new(program).args(arguments).env("DISPLAY", &self.display).output().unwrap();
        String::from_utf8_lossy(&output.stdout).into_owned()
    }

    fn xdotool(&self, arguments: &[&str]) {
        let status = Command::new("xdotool").args(arguments).env("DISPLAY", &self.display).status().unwrap();
        assert!(status.success(), "xdotool {arguments:?} failed");
    }

    /// Waits for a log line that holds `text` and gives it.
    fn wait_for(&mut self, text: &str) -> String {
        let give_up = Instant::now() + PATIENCE;
        loop {
            match self.log.recv_timeout(Duration::from_millis(200)) {
                Ok(line) if line.contains(text) => return line,
                Ok(_) => {}
                Err(_) => {
                    if let Some(status) = self.app.try_wait().unwrap() {
                        panic!("the program ended ({status}) before it said '{text}'");
                    }
                }
            }
            assert!(Instant::now() < give_up, "the program never said '{text}'");
        }
    }

    /// Waits for the next picture at full resolution; antialiasing may go on.
    fn wait_for_rest(&mut self) {
        self.wait_for("picture at full resolution");
        std::thread::sleep(Duration::from_millis(700));
        while self.log.try_recv().is_ok() {}
    }

    fn screenshot(&self) -> Screenshot {
        let output = Command::new("xwd").args(["-root", "-silent"]).env("DISPLAY", &self.display).output().unwrap();
        Screenshot::from_xwd(&output.stdout)
    }

    fn drag(&self, button: &str, from: [i32; 2], to: [i32; 2]) {
        let [x, y] = from.map(|v| v.to_string());
        self.xdotool(&["mousemove", &x, &y, "mousedown", button]);
        for step in 1..=8 {
            let at = |axis: usize| (from[axis] + (to[axis] - from[axis]) * step / 8).to_string();
            self.xdotool(&["mousemove", &at(0), &at(1)]);
            std::thread::sleep(Duration::from_millis(20));
        }
        self.xdotool(&["mouseup", button]);
    }

    /// Presses a key, with the focus where a click on the window would put it.
    fn key(&self, key: &str) {
        self.xdotool(&["windowfocus", "--sync", &self.window]);
        self.xdotool(&["key", key]);
    }
}

impl Drop for Desktop {
    fn drop(&mut self) {
        let _ = self.app.kill();
        let _ = self.app.wait();
        let _ = self.xvfb.kill();
        let _ = self.xvfb.wait();
    }
}

impl Screenshot {
    /// Reads the X window dump format, version 7: a header of big-endian words, a colour table, rows of pixels.
    fn from_xwd(bytes: &[u8]) -> Self {
        let word = |index: usize| u32::from_be_bytes(bytes[index * 4..index * 4 + 4].try_into().unwrap()) as usize;
        let (header, width, height) = (word(0), word(4), word(5));
        let (bits, stride, colors) = (word(11), word(12), word(19));
        assert_eq!(bits, 32, "Xvfb was started with 24 bits a pixel in 32");
        let start = header + colors * 12;
        let pixels = (0..height)
            .flat_map(|y| (0..width).map(move |x| start + y * stride + x * 4))
            .map(|at| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) & 0xff_ff_ff)
            .collect();
        Self { width, pixels }
    }

    /// Share of pixels inside `x0..x1`, `y0..y1` that differ from `other`'s by more than antialiasing does to a surface.
    fn changed(&self, other: &Self, [x0, y0, x1, y1]: [usize; 4]) -> f64 {
        let mut changed = 0;
        for y in y0..y1 {
            for x in x0..x1 {
                let at = y * self.width + x;
                let channels = |color: u32| [color >> 16 & 255, color >> 8 & 255, color & 255];
                let (a, b) = (channels(self.pixels[at]), channels(other.pixels[at]));
                changed += usize::from((0..3).any(|c| a[c].abs_diff(b[c]) > 24));
            }
        }
        changed as f64 / ((x1 - x0) * (y1 - y0)) as f64
    }

    /// Number of different colours inside a rectangle.
    fn colors(&self, [x0, y0, x1, y1]: [usize; 4]) -> usize {
        let rows = (y0..y1).flat_map(|y| &self.pixels[y * self.width + x0..y * self.width + x1]);
        rows.collect::<std::collections::HashSet<_>>().len()
    }
}

/// The middle of the viewport at 1280×800, clear of legend, gizmo and messages.
const VIEWPORT: [usize; 4] = [420, 150, 860, 560];

#[test]
fn a_user_orbits_zooms_toggles_and_rebuilds() {
    let mut desktop = Desktop::start(&["builtin:teapot:6"]);
    desktop.wait_for_rest();
    let start = desktop.screenshot();
    assert!(start.colors(VIEWPORT) > 200, "a shaded picture has many colours, this has {}", start.colors(VIEWPORT));

    desktop.drag("1", [640, 380], [760, 430]);
    desktop.wait_for_rest();
    let orbited = desktop.screenshot();
    assert!(orbited.changed(&start, VIEWPORT) > 0.1, "a drag must turn the model");

    desktop.xdotool(&["mousemove", "600", "330", "click", "4", "click", "4"]);
    desktop.wait_for_rest();
    let zoomed = desktop.screenshot();
    assert!(zoomed.changed(&orbited, VIEWPORT) > 0.05, "the wheel must zoom");

    desktop.key("b");
    std::thread::sleep(Duration::from_secs(1));
    let bare = desktop.screenshot();
    let share = bare.changed(&zoomed, VIEWPORT);
    assert!(share > 0.005 && share < 0.6, "B must take the lines away and nothing else: {share} changed");
    desktop.key("b");
    std::thread::sleep(Duration::from_secs(1));
    assert!(desktop.screenshot().changed(&zoomed, VIEWPORT) < 0.02, "B twice must restore the picture");
}

#[test]
fn a_dropped_file_is_opened() {
    let mut desktop = Desktop::start(&["builtin:cornell"]);
    desktop.wait_for_rest();
    let before = desktop.screenshot();
    let model = desktop.home.path().join("two triangles.obj");
    std::fs::write(&model, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n").unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/drop_file.py");
    // Debian's python has the module that Debian's package brings; another python in the PATH may not.
    let status = Command::new("/usr/bin/python3")
        .arg(script)
        .args([desktop.window.as_str(), model.to_str().unwrap()])
        .env("DISPLAY", &desktop.display)
        .status()
        .unwrap();
    assert!(status.success(), "the drop was not accepted");
    let line = desktop.wait_for("presented two triangles.obj");
    assert!(line.contains("2 triangles"), "{line}");
    desktop.wait_for_rest();
    assert!(desktop.screenshot().changed(&before, VIEWPORT) > 0.1, "the dropped model must be shown");
}

#[test]
fn an_unusable_file_keeps_the_window_and_says_why() {
    let home = tempfile::tempdir().unwrap();
    let broken = home.path().join("broken.obj");
    std::fs::write(&broken, "v 0 0 zero\nf 1 1 1\n").unwrap();
    let mut desktop = Desktop::start(&[broken.to_str().unwrap()]);
    let line = desktop.wait_for("broken.obj");
    assert!(!line.contains("panicked"), "{line}");
    std::thread::sleep(Duration::from_secs(1));
    assert!(desktop.app.try_wait().unwrap().is_none(), "the window must stay open");
}

#[test]
fn closing_the_window_ends_the_program() {
    let mut desktop = Desktop::start(&["builtin:terrain:300000"]);
    desktop.key("ctrl+q");
    let give_up = Instant::now() + PATIENCE;
    let status = loop {
        if let Some(status) = desktop.app.try_wait().unwrap() {
            break status;
        }
        assert!(Instant::now() < give_up, "the program is still running");
        std::thread::sleep(Duration::from_millis(50));
    };
    assert!(status.success(), "it ended with {status}");
}
