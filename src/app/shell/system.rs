//! The window's dealings with the system: errors and loss of the graphics device; a clipboard that cannot be reached, which is
//! found out once at start because the window's library does not say so; fonts for names in any script; its size at start; Ctrl-C and
//! termination requests, which close it as its button does, because some graphics drivers crash where a process exits while their
//! threads draw.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// The device of this process was lost while the window was open.
static LOST: AtomicBool = AtomicBool::new(false);

/// The driver reported a loss, as it also does when the window is closed.
static LOSS_REPORTED: AtomicBool = AtomicBool::new(false);

/// Whether the window ended because the device was lost. A panic counts as such where the driver reported a loss.
pub(crate) fn was_lost(panicked: bool) -> bool {
    LOST.load(Ordering::Relaxed) || panicked && LOSS_REPORTED.load(Ordering::Relaxed)
}

/// Maximum number of different errors that are reported.
const MAX_ERRORS: usize = 10;

/// Different errors of the driver.
#[derive(Default)]
struct DeviceErrors {
    texts: Vec<String>,
    /// Number of `texts` that [`Device::take_error`] has returned.
    reported: usize,
}

/// The graphics device's errors and its end.
#[derive(Default)]
pub(crate) struct Device {
    errors: Arc<Mutex<DeviceErrors>>,
    lost: Arc<AtomicBool>,
    /// Lose the device after the first picture: for tests.
    inject_loss: bool,
    /// Cause an error after the first picture: for tests.
    inject_error: bool,
}

impl Device {
    /// Records errors and loss of `device`, and wakes the window for each.
    pub(crate) fn watch(&self, device: &wgpu::Device, ctx: &egui::Context) {
        let (errors, wake) = (Arc::clone(&self.errors), ctx.clone());
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            let text = error.to_string();
            let mut errors = errors.lock().unwrap_or_else(PoisonError::into_inner);
            // An error that recurs in each frame must not request another frame.
            if !errors.texts.contains(&text) && errors.texts.len() < MAX_ERRORS {
                errors.texts.push(text);
                wake.request_repaint();
            }
        }));
        let (lost, wake) = (Arc::clone(&self.lost), ctx.clone());
        device.set_device_lost_callback(move |_, _| {
            lost.store(true, Ordering::Relaxed);
            LOSS_REPORTED.store(true, Ordering::Relaxed);
            wake.request_repaint();
        });
    }

    /// The next error that this has not returned yet.
    pub(crate) fn take_error(&self) -> Option<String> {
        let mut errors = self.errors.lock().unwrap_or_else(PoisonError::into_inner);
        let text = errors.texts.get(errors.reported)?.clone();
        errors.reported += 1;
        Some(text)
    }

    /// Whether the device is lost and nothing can be drawn. The answer is remembered for [`was_lost`].
    pub(crate) fn is_lost(&self) -> bool {
        let lost = self.lost.load(Ordering::Relaxed);
        if lost {
            LOST.store(true, Ordering::Relaxed);
        }
        lost
    }

    /// Sets the faults that [`Device::trigger_faults`] causes: for tests.
    pub(crate) const fn inject_faults(&mut self, loss: bool, error: bool) {
        self.inject_loss = loss;
        self.inject_error = error;
    }

    /// Causes the injected faults, each once.
    pub(crate) fn trigger_faults(&mut self, device: &wgpu::Device) {
        if std::mem::take(&mut self.inject_loss) {
            device.destroy();
            // The callback is called when the device is next polled, which fails now.
            let _ = device.poll(wgpu::PollType::Poll);
        }
        if std::mem::take(&mut self.inject_error) {
            drop(device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("more than there is"),
                size: device.limits().max_buffer_size.saturating_add(4),
                usage: wgpu::BufferUsages::VERTEX,
                mapped_at_creation: false,
            }));
        }
    }
}

/// The answer of the probe, which runs on a thread of its own because the display may be slow.
pub(crate) struct ClipboardProbe {
    answer: Receiver<Option<String>>,
}

impl ClipboardProbe {
    /// Starts the probe; `wake` is called when it has an answer.
    pub(crate) fn start(wake: Arc<dyn Fn() + Send + Sync>) -> Self {
        let (sender, answer) = channel();
        let thread = std::thread::Builder::new().name("clipboard".to_owned()).spawn(move || {
            let _ = sender.send(fault());
            wake();
        });
        if let Err(error) = thread {
            log::warn!("the clipboard is not probed: {error}");
        }
        Self { answer }
    }

    /// The reason why there is no clipboard, once the probe has found one.
    pub(crate) fn fault(&self) -> Option<String> {
        self.answer.try_recv().ok().flatten()
    }
}

/// Why there is no clipboard, if so.
fn fault() -> Option<String> {
    // On Wayland the window's own connection is the clipboard.
    let wayland = ["WAYLAND_DISPLAY", "WAYLAND_SOCKET"]
        .iter()
        .any(|name| std::env::var_os(name).is_some_and(|it| !it.is_empty()));
    if cfg!(target_os = "linux") && wayland {
        return None;
    }
    arboard::Clipboard::new().err().map(|error| error.to_string().trim_end_matches('.').to_owned())
}

/// The system's fonts, for characters that the program's own have no glyphs for, as in names of files. They are read when the first
/// such character is shown.
pub(crate) struct SystemFonts {
    folders: Vec<PathBuf>,
    /// Blocks of 256 characters for one of which no font was found: there is no second search.
    missing: Mutex<BTreeSet<u32>>,
}

/// Size in bytes above which a font is not read: collections of all CJK styles have 20 million.
const MAX_FONT_SIZE: u64 = 64 << 20;

impl SystemFonts {
    /// The fonts in the folders where systems keep them.
    pub(crate) fn new() -> Self {
        let mut folders: Vec<PathBuf> = Vec::new();
        if cfg!(target_os = "macos") {
            folders.extend(["/System/Library/Fonts", "/Library/Fonts"].map(PathBuf::from));
        } else if cfg!(windows) {
            let windows = std::env::var_os("WINDIR").unwrap_or_else(|| "C:\\Windows".into());
            folders.push(PathBuf::from(windows).join("Fonts"));
        } else {
            folders.extend(["/usr/share/fonts", "/usr/local/share/fonts"].map(PathBuf::from));
            folders.extend(std::env::home_dir().map(|home| home.join(".local/share/fonts")));
        }
        Self::in_folders(folders)
    }

    fn in_folders(folders: Vec<PathBuf>) -> Self {
        Self { folders, missing: Mutex::default() }
    }

    /// All files of fonts. Those of other weights than the regular one come last: their names are longer as a rule.
    fn files(&self) -> Vec<PathBuf> {
        let mut files = Vec::new();
        let mut folders = self.folders.clone();
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(&folder).into_iter().flatten().flatten() {
                let path = entry.path();
                // Links to folders could lead in circles.
                if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                    folders.push(path);
                } else if is_font(&path) {
                    files.push(path);
                }
            }
        }
        files.sort_by_cached_key(|path| (path.file_name().map(std::ffi::OsStr::len), path.clone()));
        files
    }

    /// The first font with a glyph for `character`, and its index in its file.
    fn find(&self, character: char) -> Option<(Vec<u8>, u32)> {
        self.files().into_iter().find_map(|path| {
            fs::metadata(&path).ok().filter(|file| file.is_file() && file.len() <= MAX_FONT_SIZE)?;
            let data = fs::read(&path).ok()?;
            let has_glyph = |index: &u32| {
                ttf_parser::Face::parse(&data, *index).is_ok_and(|face| face.glyph_index(character).is_some())
            };
            let index = (0..ttf_parser::fonts_in_collection(&data).unwrap_or(1)).find(has_glyph)?;
            Some((data, index))
        })
    }
}

/// True for the name of a font's file.
fn is_font(path: &Path) -> bool {
    let extension = path.extension().map(std::ffi::OsStr::to_ascii_lowercase);
    extension.is_some_and(|extension| ["ttf", "otf", "ttc", "otc"].iter().any(|known| extension == *known))
}

impl egui::FontProvider for SystemFonts {
    fn font_for(&self, request: &egui::FallbackRequest<'_>) -> Option<egui::FontInsert> {
        let character = request.cluster.chars().next()?;
        let block = u32::from(character) >> 8;
        let mut missing = self.missing.lock().unwrap_or_else(PoisonError::into_inner);
        if missing.contains(&block) {
            return None;
        }
        let Some((data, index)) = self.find(character) else {
            missing.insert(block);
            return None;
        };
        let family = egui::InsertFontFamily { family: request.family.clone(), priority: egui::FontPriority::Lowest };
        let data = egui::FontData { index, ..egui::FontData::from_owned(data) };
        Some(egui::FontInsert { name: format!("system font for {character}"), data, families: vec![family] })
    }
}

/// Minimum width and height of the window in points.
pub(crate) const MIN_SIZE: [f32; 2] = [640.0, 400.0];
/// Width and height of the window at first start in points.
pub(crate) const DEFAULT_SIZE: [f32; 2] = [1280.0, 800.0];

/// Corrects a restored size in the first UI frame. Not every desktop enforces the minimum size, and a window that is larger
/// than the driver's largest texture cannot be drawn.
pub(crate) fn correct_size_on_first_frame(ctx: &egui::Context) {
    if ctx.cumulative_frame_nr() != 1 {
        return;
    }
    let max_side = ctx.input(|input| input.max_texture_side) as f32 / ctx.pixels_per_point();
    ctx.send_viewport_cmd(egui::ViewportCommand::MaxInnerSize(egui::Vec2::splat(max_side)));
    let size = ctx.input(|input| input.viewport().inner_rect.map(|rect| rect.size()));
    let too_small = size.is_some_and(|size| size.x < MIN_SIZE[0] * 0.5 || size.y < MIN_SIZE[1] * 0.5);
    if too_small {
        ctx.send_viewport_cmd(egui::ViewportCommand::InnerSize(egui::Vec2::from(DEFAULT_SIZE)));
    }
}

/// Number of UI frames in which a window that is larger than its screen is made smaller: a desktop adds the title bar late.
const FITTING_FRAMES: u64 = 30;

/// Makes a window that has just opened no larger than its screen.
pub(crate) fn fit_screen(ctx: &egui::Context) {
    if ctx.cumulative_frame_nr() > FITTING_FRAMES {
        return;
    }
    let size = ctx.input(|input| {
        let window = input.viewport();
        fitting_size(window.inner_rect?.size(), window.outer_rect?.size(), window.monitor_size?)
    });
    if let Some(size) = size {
        ctx.send_viewport_cmd(egui::ViewportCommand::InnerSize(size));
    }
}

/// The size inside a window's frame at which the `outer` one fits a screen; `None` where it does.
fn fitting_size(inner: egui::Vec2, outer: egui::Vec2, screen: egui::Vec2) -> Option<egui::Vec2> {
    let fitting = inner.min(screen - (outer - inner).max(egui::Vec2::ZERO));
    // A pixel more or less is rounding.
    let is_larger = (inner - fitting).max_elem() > 1.0 && screen.min_elem() > 0.0;
    is_larger.then(|| fitting.max(egui::Vec2::from(MIN_SIZE))).filter(|size| *size != inner)
}

/// The window of this process.
static WINDOW: OnceLock<egui::Context> = OnceLock::new();
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Closes the open window. Returns `false` where there is none, or where a previous call has not closed it.
pub fn interrupt() -> bool {
    let Some(window) = WINDOW.get() else { return false };
    let is_first = !INTERRUPTED.swap(true, Ordering::Relaxed);
    window.request_repaint();
    is_first
}

/// Whether [`interrupt`] was called.
pub fn was_interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

/// Sets the window that [`interrupt`] closes.
pub(crate) fn watch_interrupts(ctx: &egui::Context) {
    // A process opens only one window, so it is never set already.
    let _ = WINDOW.set(ctx.clone());
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    #[test]
    fn a_window_with_its_frame_fits_the_screen() {
        let vec = egui::Vec2::new;
        let (inner, frame) = (vec(1280.0, 800.0), vec(2.0, 29.0));
        assert_eq!(fitting_size(inner, inner + frame, vec(1920.0, 1080.0)), None);
        assert_eq!(fitting_size(inner, inner, inner), None, "without a frame");
        assert_eq!(fitting_size(inner, inner + frame, inner), Some(inner - frame));
        assert_eq!(fitting_size(inner, inner + frame, vec(1366.0, 768.0)), Some(vec(1280.0, 739.0)));
        assert_eq!(fitting_size(inner, inner, vec(320.0, 200.0)), Some(vec(640.0, 400.0)), "not below the least size");
        assert_eq!(fitting_size(inner, inner, egui::Vec2::ZERO), None, "an unknown screen");
    }

    #[test]
    fn a_font_of_the_system_has_what_the_own_ones_lack() {
        let folder = tempfile::tempdir().unwrap();
        let inner = folder.path().join("truetype/ubuntu");
        fs::create_dir_all(&inner).unwrap();
        // Shorter names come first.
        fs::write(folder.path().join("a.ttf"), b"no font").unwrap();
        fs::write(folder.path().join("b.txt"), b"no name of a font").unwrap();
        let definitions = egui::FontDefinitions::default();
        fs::write(inner.join("Ubuntu.TTF"), definitions.font_data["Ubuntu-Light"].bytes()).unwrap();
        let fonts = SystemFonts::in_folders(vec![folder.path().to_path_buf(), folder.path().join("none")]);
        let find = |cluster: &str| {
            let family = egui::FontFamily::Proportional;
            egui::FontProvider::font_for(&fonts, &egui::FallbackRequest { cluster, family: &family })
        };
        let found = find("\u{416}").expect("the font has Cyrillic letters");
        assert_eq!(found.data.bytes(), definitions.font_data["Ubuntu-Light"].bytes());
        assert_eq!(found.families.len(), 1);
        assert!(find("\u{4e2d}").is_none(), "the font has no Chinese characters");
        assert!(fonts.missing.lock().unwrap().contains(&0x4e), "searched once");
        assert!(find("").is_none());
    }
}
