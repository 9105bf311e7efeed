//! Screenshots: the viewport's picture and containers as a PNG with the legend of their colours below, as `bvhscope render` writes it,
//! drawn and written on a thread of their own.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

use crate::app::state::{AppState, CompareView, Presented};
use crate::app::viewport::choice::{drawable, drawn_selection, drawn_table};
use crate::app::viewport::draw::Tint;
use crate::app::viewport::draw::picture_input;
use crate::export::{first_writable, write_new};
use crate::legend;
use crate::overlay::{DrawInput, NodeTable, OverlaySettings, Selection, Shown, draw_offscreen};

/// Everything that a screenshot shows, captured so that later changes in the window do not affect it.
pub struct Screenshot {
    /// The pictures, each from a column of the whole on: one, or two side by side.
    pictures: Vec<(u32, Picture)>,
    show_containers: bool,
    show_geometry: bool,
    pixels_per_point: f32,
    name: String,
}

/// The picture through one tree with its containers.
struct Picture {
    presented: Presented,
    /// The tree whose containers are drawn.
    table: Arc<NodeTable>,
    overlay: OverlaySettings,
    shown: Arc<Shown>,
    selection: Selection,
    /// Other colours for the picture: with the selected triangles tinted, or those of the difference of two trees.
    colors: Option<Arc<Vec<[u8; 4]>>>,
    /// The largest difference that has a colour of its own, where the picture is the difference of two trees.
    difference: Option<f32>,
}

impl Screenshot {
    /// Captures the present viewport; `None` before the first picture.
    pub fn capture(state: &AppState, pixels_per_point: f32) -> Option<Self> {
        let first = first_picture(state)?;
        let label = first.presented.accel.scene.source.label();
        let stem = Path::new(&label).file_stem().map_or_else(|| label.clone(), |stem| stem.to_string_lossy().into());
        let seam = state.wanted.second.map_or(0.5, |second| second.seam);
        let seam_px = (first.presented.frame.width_px as f32 * seam).round() as u32;
        let pictures = match (state.shown_view(), second_picture(state)) {
            (CompareView::B, Some(second)) => vec![(0, second)],
            (CompareView::Split, Some(second)) => vec![(0, first), (seam_px, second)],
            _ => vec![(0, first)],
        };
        let (show_containers, show_geometry) = (state.shows_containers(), state.preferences.show_geometry);
        Some(Self { name: stem, pictures, show_containers, show_geometry, pixels_per_point })
    }

    /// Writes a PNG into `folder` under an unused name; the file appears complete or not at all. Returns the path and, where the
    /// containers could not be drawn, the reason.
    pub fn save(&self, folder: &Path) -> Result<(PathBuf, Option<String>), String> {
        let (mut whole, mut size, mut warning) = (Vec::new(), [0, 0], None);
        for (from, picture) in &self.pictures {
            let frame = &picture.presented.frame;
            let (pixels, fault) = self.draw(picture);
            warning = warning.or(fault);
            if whole.is_empty() {
                (whole, size) = (pixels, [frame.width_px, frame.height_px]);
            } else if size == [frame.width_px, frame.height_px] {
                let rows = whole.chunks_mut(size[0] as usize).zip(pixels.chunks(size[0] as usize));
                rows.for_each(|(left, right)| left[*from as usize..].copy_from_slice(&right[*from as usize..]));
            }
        }
        size[1] = self.append_legend(&mut whole, size);
        let path = write_png(folder, &self.name, size, &whole)?;
        Ok((path, warning))
    }

    /// Appends what the colours of the first picture stand for, and returns the new height.
    fn append_legend(&self, pixels: &mut Vec<[u8; 4]>, size: [u32; 2]) -> u32 {
        let Some((_, picture)) = self.pictures.first().filter(|_| legend::is_wanted(None, size[0])) else {
            return size[1];
        };
        let frame = &picture.presented.frame;
        let keys = if let Some(limit) = picture.difference.filter(|_| self.show_geometry) {
            vec![legend::of_difference(limit)]
        } else {
            let containers = self.show_containers.then_some((&*picture.table, &*picture.shown));
            legend::of_picture(frame, self.show_geometry, containers)
        };
        legend::append(pixels, size, &keys, frame.settings.background)
    }

    /// The pixels of a picture with its containers and, where these could not be drawn, the reason.
    fn draw(&self, picture: &Picture) -> (Vec<[u8; 4]>, Option<String>) {
        let frame = &picture.presented.frame;
        let table = self.show_containers.then_some(&picture.table);
        let mut input = picture_input(frame, picture.presented.frame_id);
        if let Some(colors) = &picture.colors {
            input.rgba = colors;
        }
        let input = DrawInput {
            picture: input,
            camera: frame.camera,
            table,
            shown: &picture.shown,
            settings: picture.overlay,
            selection: &picture.selection,
            show_picture: self.show_geometry,
            section: frame.settings.section,
            neutral_lines: frame.settings.shading.is_coded(),
            backdrop: frame.settings.background.backdrop(),
            viewport_px: [0, 0, frame.width_px, frame.height_px],
            pixels_per_point: self.pixels_per_point,
        };
        if table.is_none() && self.show_geometry {
            return (input.picture.rgba.to_vec(), None);
        }
        match draw_offscreen(&input) {
            Ok(pixels) => (pixels, None),
            Err(error) => (input.picture.rgba.to_vec(), Some(format!("the containers are missing in it: {error}"))),
        }
    }
}

/// The picture through the first tree, or the difference of the two where that is shown.
fn first_picture(state: &AppState) -> Option<Picture> {
    let mut presented = state.model.presented.clone()?;
    let shows_merges = state.layout.graphics.standing.is_some();
    let tinted = if shows_merges { None } else { Tint::default().update(state, &presented) };
    let (mut colors, mut limit) = (tinted.map(|tinted| tinted.rgba), None);
    let table = Arc::clone(drawn_table(state, &presented));
    if let (CompareView::Difference, Some(difference)) = (state.shown_view(), &state.model.difference) {
        presented.frame = Arc::clone(&difference.map.frames[0]);
        (colors, limit) = (Some(Arc::clone(&difference.map.rgba)), Some(difference.map.limit));
    }
    let shown = state.layout.graphics.shown.clone().unwrap_or_else(|| Arc::new(Shown::NOTHING));
    let selection = drawn_selection(state);
    let overlay = drawable(state, &table);
    Some(Picture { presented, table, overlay, shown, selection, colors, difference: limit })
}

/// The picture through the second tree.
fn second_picture(state: &AppState) -> Option<Picture> {
    let presented = state.model.second.clone()?;
    let shown = state.layout.graphics.second_shown.clone().unwrap_or_else(|| Arc::new(Shown::NOTHING));
    let table = Arc::clone(&presented.table);
    let (overlay, selection) = (drawable(state, &table), Selection::default());
    Some(Picture { presented, table, overlay, shown, selection, colors: None, difference: None })
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

/// Saves `screenshot` in the first of `folders` that can be written, on a thread of its own, sends the outcome, then calls `wake`.
///
/// # Errors
///
/// Fails where the thread cannot be started.
pub fn save_in_background(
    screenshot: Screenshot,
    folders: Vec<PathBuf>,
    outcome: std::sync::mpsc::Sender<Outcome>,
    wake: Arc<dyn Fn() + Send + Sync>,
) -> std::io::Result<()> {
    let pending = PendingScreenshot::begin();
    std::thread::Builder::new().name("screenshot".to_owned()).spawn(move || {
        let _pending = pending;
        let folder = first_writable(&folders);
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
