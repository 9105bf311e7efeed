//! Sequences: rows of numbered model files, each a frame of the one clip.
//!
//! All frames are read when the sequence is loaded, so that faults are counted then, and as many stay in memory as have room; the others
//! are read again when they are shown. Frames may have one topology or each its own.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;

use super::attributes::Surface;
use super::error::{FileLocation, LoadError};
use super::model::Scene;
use super::motion::{Clip, Moment, Motion, Mover, Pose};
use super::options::{Instancing, LoadOptions};
use super::row::{FileRow, NumberedFile};
use super::source::SceneSource;
use crate::budget::Budget;
use crate::text::{counted, file_name, quoted};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::Triangle;

/// Frames a second where none are chosen: those of films.
pub const FRAMES_PER_SECOND: f32 = 24.0;
/// Name of the clip.
const CLIP: &str = "sequence";
/// Frames at most.
const MAX_FRAMES: usize = 10_000;
/// Part of the memory that is left for which frames stay in it: the rest is for trees and pictures.
const KEPT_PART: u64 = 2;
/// Part of a frame by which times may be before it: rounding should not show the frame before.
const SLACK: f32 = 1e-3;

/// Reads a model file as one that stands still.
pub(super) type ReadFrame = fn(&Path, &SceneSource, &LoadOptions, &CancelToken) -> Result<Scene, LoadError>;

/// The frames of a sequence.
#[derive(Debug)]
struct Frames {
    /// In the order of their places, at least one.
    list: Vec<Frame>,
    seconds: f32,
    read: ReadFrame,
    options: LoadOptions,
    /// Of the first frame: subtracted from the coordinates of all.
    offset: DVec3,
    /// Of the first frame: others share what is equal.
    surface: Arc<Surface>,
}

/// A frame.
#[derive(Debug)]
struct Frame {
    path: PathBuf,
    /// Place in the clip, counted in frames: there are none where files are missing.
    place: u64,
    triangle_count: usize,
    /// The model in it, where there is room for it.
    kept: Option<Still>,
}

/// The model in a frame.
#[derive(Debug)]
struct Still {
    triangles: Vec<Triangle>,
    surface: Arc<Surface>,
}

/// Loads the files of a row as one model with a clip. `read` reads one of them.
pub(super) fn load(
    row: &FileRow,
    source: &SceneSource,
    options: &LoadOptions,
    read: ReadFrame,
    token: &CancelToken,
) -> Result<Scene, LoadError> {
    load_within(row, source, options, read, Budget::of_process().allowance() / KEPT_PART, token)
}

/// [`load`] with `room` in memory for frames, in bytes.
fn load_within(
    row: &FileRow,
    source: &SceneSource,
    options: &LoadOptions,
    read: ReadFrame,
    room: u64,
    token: &CancelToken,
) -> Result<Scene, LoadError> {
    // Moments are flat.
    let options = &LoadOptions { instances: Instancing::Flat, ..options.clone() };
    let mut files = row.files(token)?;
    let beyond = files.len().saturating_sub(MAX_FRAMES);
    files.truncate(MAX_FRAMES);
    let of_file = |index: usize| {
        let path = &files[index].path;
        check_inside(path, options)?;
        read(path, &SceneSource::File(path.clone()), options, &token.part(index, files.len()))
    };
    let mut scene = of_file(0)?;
    (scene.source, scene.motion, scene.repeats_meshes) = (source.clone(), None, false);
    let mut all = Frames {
        list: Vec::with_capacity(files.len()),
        seconds: 1.0 / options.fps.unwrap_or(FRAMES_PER_SECOND),
        read,
        options: options.clone(),
        offset: scene.offset,
        surface: Arc::new(surface_of(&scene)),
    };
    let first = Still { triangles: scene.triangles.clone(), surface: Arc::clone(&all.surface) };
    let place = places(&files);
    all.add(&files[0], &place, first, room);
    let mut reach = scene.bounds;
    for (index, file) in files.iter().enumerate().skip(1) {
        match of_file(index) {
            Ok(mut frame) => {
                scene.warnings.append(std::mem::take(&mut frame.warnings));
                scene.files_read.append(&mut frame.files_read);
                let still = all.still(frame);
                reach = still.triangles.iter().fold(reach, |all, triangle| all.union(&triangle.bounds()));
                all.add(file, &place, still, room);
            }
            Err(LoadError::Cancelled(cancelled)) => return Err(cancelled.into()),
            Err(LoadError::Unusable { problem, .. }) => {
                let what = ["frames left out: ", &format!(": {problem}")];
                scene.warnings.add_named(what, file_name(&file.path).as_bytes(), || FileLocation::File);
            }
        }
    }
    scene.files_read.sort_unstable();
    scene.files_read.dedup();
    count_faults(&all, &files, beyond, &mut scene);
    if all.list.len() > 1 {
        let end = all.list.last().map_or(0.0, |last| last.place as f32 * all.seconds);
        let clip = Clip { name: CLIP.to_owned(), start: 0.0, end };
        scene.motion = Some(Arc::new(Motion::within_reach(clip, Box::new(all), reach)));
    }
    Ok(scene)
}

/// Refuses a frame that is a link out of the folder of its row, as the user has named but a pattern.
fn check_inside(path: &Path, options: &LoadOptions) -> Result<(), LoadError> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let (Ok(file), Ok(folder)) = (path.canonicalize(), folder.canonicalize()) else {
        // Reading it says why it cannot be.
        return Ok(());
    };
    if options.allow_outside || file.starts_with(folder) {
        return Ok(());
    }
    Err(LoadError::of_file(path, "is a link out of the folder", "--allow-outside lets it be read"))
}

/// Place of a file in the clip: its number, counted from the first one in the steps by which all go up.
fn places(files: &[NumberedFile]) -> impl Fn(u64) -> u64 + use<> {
    let first = files.first().map_or(0, |file| file.number);
    let distances = files.iter().map(|file| file.number.saturating_sub(first));
    let step = distances.fold(0, greatest_common_divisor).max(1);
    move |number| number.saturating_sub(first).checked_div(step).unwrap_or(0)
}

fn greatest_common_divisor(a: u64, b: u64) -> u64 {
    match a.checked_rem(b) {
        None => a,
        Some(rest) => greatest_common_divisor(b, rest),
    }
}

/// Counts frames that are missing, beyond the most, or of other triangles than the first.
fn count_faults(all: &Frames, files: &[NumberedFile], beyond: usize, scene: &mut Scene) {
    let place = places(files);
    let last = files.last().map_or(0, |file| place(file.number));
    let missing = last.saturating_add(1).saturating_sub(files.len() as u64);
    let gap = files.windows(2).find(|pair| place(pair[1].number) > place(pair[0].number).saturating_add(1));
    if let Some(pair) = gap {
        let before = quoted(file_name(&pair[0].path).as_bytes());
        let what = format!("frames missing, each shown as the one before it: the first after {before}");
        scene.warnings.add_many(missing, &what, || FileLocation::File);
    }
    let what = format!("frames beyond the first {MAX_FRAMES} left out");
    scene.warnings.add_many(beyond as u64, &what, || FileLocation::File);
    let count = scene.triangles.len();
    let others = all.list.iter().filter(|frame| frame.triangle_count != count).count();
    let what = format!("frames of another number of triangles than the {count} of the first: trees are built for each");
    scene.warnings.add_many(others as u64, &what, || FileLocation::File);
}

/// The surface of a frame.
fn surface_of(scene: &Scene) -> Surface {
    Surface {
        attributes: scene.attributes.clone(),
        material_indices: Arc::clone(&scene.material_indices),
        materials: scene.materials.clone(),
        textures: scene.textures.clone(),
    }
}

impl Frames {
    /// Adds a frame, which stays in memory while all together have `room`, in bytes.
    fn add(&mut self, file: &NumberedFile, place: impl Fn(u64) -> u64, still: Still, room: u64) {
        let own = size_of_val(&still.triangles[..]) + still.surface.bytes_beside(&self.surface);
        let has_room = self.bytes() + own <= room as usize;
        self.list.push(Frame {
            path: file.path.clone(),
            place: place(file.number),
            triangle_count: still.triangles.len(),
            kept: has_room.then_some(still),
        });
    }

    /// A frame that was read, in the coordinates of the first one.
    fn still(&self, frame: Scene) -> Still {
        let mut surface = surface_of(&frame);
        surface.share_with(&self.surface);
        let surface = if surface == *self.surface { Arc::clone(&self.surface) } else { Arc::new(surface) };
        let mut triangles = frame.triangles;
        let shift = (frame.offset - self.offset).as_vec3();
        if frame.offset != self.offset {
            for triangle in &mut triangles {
                let Triangle { a, b, c } = *triangle;
                *triangle = Triangle { a: a + shift, b: b + shift, c: c + shift };
            }
        }
        Still { triangles, surface }
    }

    /// The frame that is shown at a time.
    fn at(&self, seconds: f32) -> &Frame {
        let place = (seconds / self.seconds + SLACK) as u64;
        let after = self.list.partition_point(|frame| frame.place <= place);
        &self.list[after.saturating_sub(1)]
    }

    /// Reads a frame again that had no room in memory.
    fn read_again(&self, frame: &Frame, token: &CancelToken) -> Result<Still, LoadError> {
        let path = &frame.path;
        check_inside(path, &self.options)?;
        let still = self.still((self.read)(path, &SceneSource::File(path.clone()), &self.options, token)?);
        let [now, before] = [still.triangles.len(), frame.triangle_count];
        if now != before {
            let problem = format!(
                "has changed since the sequence was opened: {} instead of {before}",
                counted(now as u64, "triangles")
            );
            return Err(LoadError::of_file(path, problem, "open the sequence again"));
        }
        Ok(still)
    }
}

impl Mover for Frames {
    fn triangle_count(&self) -> usize {
        self.list.iter().map(|frame| frame.triangle_count).max().unwrap_or(0)
    }

    fn keeps_triangles(&self) -> bool {
        self.list.iter().all(|frame| frame.triangle_count == self.list[0].triangle_count)
    }

    fn frame_seconds(&self) -> Option<f32> {
        Some(self.seconds)
    }

    fn pose(&self, moment: Moment, pose: &mut Pose, token: &CancelToken) -> Result<(), LoadError> {
        token.check()?;
        let frame = self.at(moment.seconds);
        let again;
        let still = if let Some(kept) = &frame.kept {
            kept
        } else {
            again = self.read_again(frame, token)?;
            &again
        };
        pose.triangles.clone_from(&still.triangles);
        pose.surface = Some(Arc::clone(&still.surface));
        Ok(())
    }

    fn bytes(&self) -> usize {
        let kept = self.list.iter().filter_map(|frame| frame.kept.as_ref());
        kept.map(|still| size_of_val(&still.triangles[..]) + still.surface.bytes_beside(&self.surface)).sum()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use glam::Vec3;

    use super::*;

    /// As many triangles as the file has bytes, at the place along x that the first of them names.
    fn read(path: &Path, source: &SceneSource, _: &LoadOptions, token: &CancelToken) -> Result<Scene, LoadError> {
        token.check()?;
        let gone = |error: std::io::Error| LoadError::of_file(path, error.to_string(), "");
        let bytes = std::fs::read(path).map_err(gone)?;
        let a = Vec3::X * f32::from(bytes[0]);
        Ok(Scene::from_triangles(source.clone(), vec![Triangle { a, b: a + Vec3::X, c: a + Vec3::Y }; bytes.len()]))
    }

    #[test]
    fn frames_without_room_are_read_again_and_refused_where_they_have_changed() {
        let folder = tempfile::tempdir().unwrap();
        let write = |number: u8, bytes: &[u8]| std::fs::write(folder.path().join(format!("w{number}")), bytes).unwrap();
        (0..4).for_each(|number| write(number, &[number; 3]));
        let pattern = folder.path().join("w#");
        let (row, source) = (FileRow::of(&pattern).unwrap(), SceneSource::File(pattern));
        let options = LoadOptions { fps: Some(1.0), ..LoadOptions::default() };
        let token = CancelToken::new();
        // Of two frames.
        let room = 2 * 3 * size_of::<Triangle>() as u64;
        let scene = load_within(&row, &source, &options, read, room, &token).unwrap();
        let motion = scene.motion.as_ref().unwrap();
        assert_eq!(motion.bytes() as u64, room);
        let x = |seconds: f32| {
            let mut pose = Pose::default();
            motion.pose(Moment { clip: 0, seconds }, &mut pose, &token)?;
            Ok::<_, LoadError>(pose.triangles[0].a.x)
        };
        assert_eq!([0.0, 1.0, 2.0, 3.0].map(|seconds| x(seconds).unwrap()), [0.0, 1.0, 2.0, 3.0]);
        // As many triangles elsewhere are shown; other ones, or none, are not.
        write(2, &[9; 3]);
        write(3, &[3; 4]);
        assert_eq!(x(2.0).unwrap(), 9.0);
        let changed = x(3.0).unwrap_err().to_string();
        assert!(
            changed.ends_with(
                "w3: has changed since the sequence was opened: 4 triangles instead of 3; open the sequence again"
            ),
            "{changed}"
        );
        std::fs::remove_file(folder.path().join("w2")).unwrap();
        assert!(x(2.0).unwrap_err().to_string().contains("w2: "));
        assert_eq!([0.0, 1.0].map(|seconds| x(seconds).unwrap()), [0.0, 1.0], "nothing is lost");
        let cancelled = CancelToken::new();
        cancelled.cancel();
        assert!(matches!(load_within(&row, &source, &options, read, room, &cancelled), Err(LoadError::Cancelled(_))));
    }
}
