//! The program's window on a virtual screen, driven by xdotool, and pictures of that screen.

use std::time::{Duration, Instant};

use crate::desktop::{Desktop, LAST_SAMPLE, Program};
use crate::support::process::PATIENCE;

/// The centre of the viewport at 1280×800, clear of legend, gizmo and messages.
pub const VIEWPORT: [usize; 4] = [420, 150, 860, 560];

/// The program in its window, at the top left of the screen.
pub struct Window {
    pub program: Program,
    pub desktop: Desktop,
    pub id: String,
}

/// A picture of the whole screen: width, height and pixels as 0xRRGGBB.
pub struct Screenshot {
    pub width: usize,
    pub pixels: Vec<u32>,
}

impl Window {
    pub fn open(arguments: &[&str]) -> Self {
        Self::open_on(Desktop::new(), arguments)
    }

    pub fn open_on(desktop: Desktop, arguments: &[&str]) -> Self {
        let mut program = desktop.start(arguments);
        let id = desktop.find_window(&mut program);
        desktop.xdotool(&["windowmove", "--sync", &id, "0", "0"]);
        desktop.xdotool(&["windowfocus", "--sync", &id]);
        Self { program, desktop, id }
    }

    /// The screen after the last sample of a picture, when nothing more is drawn.
    pub fn at_rest(&mut self) -> Screenshot {
        self.program.wait_for(&LAST_SAMPLE);
        self.once(|_| true)
    }

    /// The screen once it shows what is expected and stays the same: the picture has all its samples, nothing is logged and
    /// nothing changes for a while.
    pub fn once(&mut self, expected: impl Fn(&Screenshot) -> bool) -> Screenshot {
        self.once_complete(true, expected)
    }

    /// The same; unless `all_samples` holds, in a mode whose pictures have a single sample.
    pub fn once_complete(&mut self, all_samples: bool, expected: impl Fn(&Screenshot) -> bool) -> Screenshot {
        let give_up = Instant::now() + PATIENCE;
        let (mut before, mut progress) = (self.screenshot(), self.program.progress());
        loop {
            std::thread::sleep(Duration::from_millis(700));
            let (screen, now) = (self.screenshot(), self.program.progress());
            let changed = screen.changed(&before, VIEWPORT);
            let settled = now.0 == progress.0 && (now.1 || !all_samples) && changed < 0.001;
            let is_expected = expected(&screen);
            if settled && is_expected {
                return screen;
            }
            assert!(
                Instant::now() < give_up,
                "the screen never shows what is expected; log lines and completeness: {now:?}; changed by {changed}; \
                as expected: {is_expected}"
            );
            (before, progress) = (screen, now);
        }
    }

    /// A file in the program's folder, once it is there: it appears as a whole.
    pub fn file(&self, name: &str) -> Vec<u8> {
        let give_up = Instant::now() + PATIENCE;
        loop {
            match std::fs::read(self.desktop.home().join(name)) {
                Ok(bytes) => return bytes,
                Err(_) if Instant::now() < give_up => std::thread::sleep(Duration::from_millis(50)),
                Err(error) => panic!("{name}: {error}"),
            }
        }
    }

    pub fn screenshot(&self) -> Screenshot {
        Screenshot::from_xwd(&self.desktop.run("xwd", &["-root", "-silent"]))
    }

    /// Drags in the viewport and releases the button once the picture has followed: on a loaded machine all events may arrive
    /// within one frame otherwise, and a button that is up again drags nothing.
    pub fn drag(&mut self, button: &str, from: [i32; 2], to: [i32; 2]) {
        self.move_to(from);
        let before = self.once(|_| true);
        self.desktop.xdotool(&["mousedown", button]);
        self.glide(from, to);
        self.once(|screen| screen.changed(&before, VIEWPORT) > 0.02);
        self.desktop.xdotool(&["mouseup", button]);
    }

    pub fn move_to(&self, at: [i32; 2]) {
        let [x, y] = at.map(|v| v.to_string());
        self.desktop.xdotool(&["mousemove", &x, &y]);
    }

    /// Moves the pointer in small steps, as a user does.
    pub fn glide(&self, from: [i32; 2], to: [i32; 2]) {
        for step in 1..=8 {
            self.move_to([0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * step / 8));
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Presses a key, with the focus where a click on the window would put it.
    pub fn key(&self, key: &str) {
        self.desktop.xdotool(&["windowfocus", "--sync", &self.id]);
        self.desktop.xdotool(&["key", key]);
    }
}

impl Screenshot {
    /// Reads the X window dump format, version 7: a header of big-endian words, a colour table, rows of pixels.
    pub fn from_xwd(bytes: &[u8]) -> Self {
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

    /// Fraction of pixels inside `x0..x1`, `y0..y1` that differ from `other`'s by more than antialiasing does to a surface.
    pub fn changed(&self, other: &Self, [x0, y0, x1, y1]: [usize; 4]) -> f64 {
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
    pub fn colors(&self, [x0, y0, x1, y1]: [usize; 4]) -> usize {
        let rows = (y0..y1).flat_map(|y| &self.pixels[y * self.width + x0..y * self.width + x1]);
        rows.collect::<std::collections::HashSet<_>>().len()
    }
}
