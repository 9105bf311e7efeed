//! Screenshots: the viewport's picture and containers as a PNG, drawn and written on a thread of their own.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

use crate::app::state::{AppState, Presented};
use crate::app::viewport::draw::picture_input;
use crate::app::viewport::tint::Tint;
use crate::export::write_new;
use crate::overlay::{DrawInput, OverlaySettings, Selection, Shown, draw_offscreen};
use crate::render::Background;

/// Everything that a screenshot shows, captured so that later changes in the window do not affect it.
pub struct Screenshot {
    presented: Presented,
    overlay: Option<OverlaySettings>,
    shown: Arc<Shown>,
    selection: Selection,
    show_geometry: bool,
    pixels_per_point: f32,
    /// The picture with the selected triangles tinted.
    tinted: Option<Arc<Vec<[u8; 4]>>>,
    name: String,
}

impl Screenshot {
    /// Captures the present viewport; `None` before the first picture.
    pub fn capture(state: &AppState, pixels_per_point: f32) -> Option<Self> {
        let presented = state.model.presented.clone()?;
        let label = presented.accel.scene.source.label();
        let stem = Path::new(&label).file_stem().map_or_else(|| label.clone(), |stem| stem.to_string_lossy().into());
        let tinted = Tint::default().update(state, &presented).map(|tinted| tinted.rgba);
        Some(Self {
            name: stem,

            presented,
            overlay: state.preferences.show_containers.then_some(state.wanted.overlay),
            shown: state.graphics.shown.clone().unwrap_or_else(|| Arc::new(Shown::NOTHING)),
            selection: state.selection.nodes.clone(),
            show_geometry: state.preferences.show_geometry,
            pixels_per_point,
            tinted,
        })
    }

    /// Writes a PNG into `folder` under an unused name; the file appears complete or not at all. Returns the path and, where the
    /// containers could not be drawn, the reason.
    pub fn save(&self, folder: &Path) -> Result<(PathBuf, Option<String>), String> {
        let frame = &self.presented.frame;
        let table = self.overlay.is_some().then_some(&self.presented.table);
        let mut picture = picture_input(frame, self.presented.frame_id);
        if let Some(tinted) = &self.tinted {
            picture.rgba = tinted;
        }
        let input = DrawInput {
            picture,
            camera: frame.camera,
            table,
            shown: &self.shown,
            settings: self.overlay.unwrap_or_default(),
            selection: &self.selection,
            show_picture: self.show_geometry,
            section: frame.settings.section,
            neutral_lines: frame.settings.shading.is_coded(),
            light_background: frame.settings.background == Background::Light,
            viewport_px: [0, 0, frame.width_px, frame.height_px],
            pixels_per_point: self.pixels_per_point,
        };
        let drawn = (table.is_some() || !self.show_geometry).then(|| draw_offscreen(&input));
        let (pixels, warning) = match drawn {
            Some(Ok(pixels)) => (pixels, None),
            Some(Err(error)) => (picture.rgba.to_vec(), Some(format!("the containers are missing in it: {error}"))),
            None => (picture.rgba.to_vec(), None),
        };
        let path = write_png(folder, &self.name, [frame.width_px, frame.height_px], &pixels)?;
        Ok((path, warning))
    }
}

/// Writes RGBA pixels as a PNG under an unused name in `folder`.
fn write_png(folder: &Path, name: &str, size_px: [u32; 2], pixels: &[[u8; 4]]) -> Result<PathBuf, String> {
    let failed = |error: &dyn std::fmt::Display| format!("The screenshot could not be written: {error}");
    let mut png = std::io::Cursor::new(Vec::new());
    image::write_buffer_with_format(
        &mut png,
        pixels.as_flattened(),
        size_px[0],
        size_px[1],
        image::ExtendedColorType::Rgba8,
        image::ImageFormat::Png,
    )
    .map_err(|error| failed(&error))?;
    write_new(folder, name, "png", png.get_ref()).map_err(|error| failed(&error))
}

/// Path of the written file and, where the containers could not be drawn, the reason; or an error message.
pub type Outcome = Result<(PathBuf, Option<String>), String>;

/// Saves `screenshot` in the current folder on a thread of its own, sends the outcome, then calls `wake`.
///
/// # Errors
///
/// Fails where the thread cannot be started.
pub fn save_in_background(
    screenshot: Screenshot,
    outcome: std::sync::mpsc::Sender<Outcome>,
    wake: Arc<dyn Fn() + Send + Sync>,
) -> std::io::Result<()> {
    let pending = PendingScreenshot::begin();
    std::thread::Builder::new().name("screenshot".to_owned()).spawn(move || {
        let _pending = pending;
        let folder = std::env::current_dir().unwrap_or_else(|_| PathBuf::from("."));
        // Sending fails where the window was closed meanwhile, which is fine.
        let _ = outcome.send(screenshot.save(&folder));
        wake();
    })?;
    Ok(())
}

/// Number of unfinished screenshots, and a signal for its changes.
static PENDING: (Mutex<usize>, Condvar) = (Mutex::new(0), Condvar::new());

/// Counts an unfinished screenshot until it is dropped, also by a panic.
struct PendingScreenshot;

impl PendingScreenshot {
    fn begin() -> Self {
        *PENDING.0.lock().unwrap_or_else(PoisonError::into_inner) += 1;
        Self
    }
}

impl Drop for PendingScreenshot {
    fn drop(&mut self) {
        *PENDING.0.lock().unwrap_or_else(PoisonError::into_inner) -= 1;
        PENDING.1.notify_all();
    }
}

/// Waits until all screenshots are finished, at most for `timeout`. Graphics drivers have been seen to crash when the process
/// ends while they draw.
pub fn wait_for_all(timeout: Duration) {
    let (count, changed) = &PENDING;
    let count = count.lock().unwrap_or_else(PoisonError::into_inner);
    drop(changed.wait_timeout_while(count, timeout, |count| *count > 0));
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    #[test]
    fn names_never_overwrite_each_other() {
        let folder = tempfile::tempdir().unwrap();
        let pixels = vec![[1, 2, 3, 255]; 6];
        let first = write_png(folder.path(), "a", [3, 2], &pixels).unwrap();
        let second = write_png(folder.path(), "a", [3, 2], &pixels).unwrap();
        assert_eq!(first, folder.path().join("a-001.png"));
        assert_eq!(second, folder.path().join("a-002.png"));
        assert_eq!(image::open(&second).unwrap().to_rgba8().get_pixel(2, 1).0, [1, 2, 3, 255]);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2, "no temporary file is left");
    }

    #[test]
    fn a_folder_that_is_not_there_is_named() {
        let error = write_png(Path::new("/nowhere/at/all"), "a", [1, 1], &[[0; 4]]).unwrap_err();
        assert!(error.contains("/nowhere/at/all"), "{error}");
    }
}
