//! Makes and caches the thumbnails of the start page: of built-in scenes by tracing them once, of files from the
//! picture that was shown, so that no file is read for its thumbnail. They are kept in the user's folder for caches, as
//! PNG files named after path, size and time of change of the model; files that are not of the right kind are ignored
//! and replaced.

use std::collections::HashSet;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Weak};
use std::time::Instant;

use image::ImageFormat;

use crate::accel::{Accel, is_same};
use crate::app::state::{AppState, Presented, THUMBNAIL_SIZE, Thumbnail};
use crate::app::studies::latest::{Latest, Polled, WorkerPool};
use crate::export::{Protected, write_bytes};
use crate::render::{Frame, RenderRequest, RenderSettings, Shading, render};
use crate::scene::{BUILTIN_SCENES, LoadOptions, Scene, SceneSource, load};
use crate::view::NamedView;
use crate::worker::Worker;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::BuildSettings;

/// Samples per pixel of a traced thumbnail.
const SAMPLES: u32 = 16;

/// A thumbnail to find or to keep.
enum Job {
    /// Read it from the cache; trace it where it is not there and the scene is built in.
    Find(SceneSource),
    /// Make it from the picture of a model that was opened.
    Keep(SceneSource, Arc<Frame>),
}

/// The outcome of a [`Job`].
struct Found {
    source: SceneSource,
    thumbnail: Option<Thumbnail>,
}

/// Finds the thumbnails that the start page lacks, one after the other.
pub(crate) struct ThumbnailWorker {
    latest: Latest<(), Job, Found>,
    requested: HashSet<SceneSource>,
    /// The scene whose picture was kept last.
    kept: Weak<Scene>,
}

impl ThumbnailWorker {
    /// Starts the thread, which caches in `folder`; `wake` is called from it after each result.
    pub(crate) fn new(folder: Option<PathBuf>, wake: impl Fn() + Send + Sync + 'static) -> std::io::Result<Self> {
        let pool = WorkerPool::default();
        let worker = Worker::new("thumbnails", wake, move |job: Job, token: &CancelToken, _| {
            let (Job::Find(source) | Job::Keep(source, _)) = &job;
            let file = folder.as_ref().and_then(|folder| file_of(folder, source));
            let thumbnail = match &job {
                Job::Keep(_, frame) => reduced(frame).inspect(|thumbnail| save(file.as_ref(), thumbnail)),
                Job::Find(source) => file.as_deref().and_then(read).or_else(|| {
                    // One thread, so that the picture in the window keeps the others.
                    let traced = pool.run("thumbnails", 1, || traced(source, token))?;
                    save(file.as_ref(), &traced);
                    Some(traced)
                }),
            };
            Some(Found { source: source.clone(), thumbnail })
        })?;
        Ok(Self { latest: Latest::new(worker), requested: HashSet::new(), kept: Weak::new() })
    }

    /// Takes a thumbnail that was found, and requests the next one while the other workers are `idle` or the start page is open.
    pub(crate) fn poll(&mut self, state: &mut AppState, idle: bool) {
        match self.latest.poll() {
            Polled::Running => {}
            Polled::Result(Found { source, thumbnail }) => {
                self.latest.finish(&());
                if let Some(thumbnail) = thumbnail {
                    state.layout.thumbnails.insert(source, thumbnail);
                }
            }
            Polled::Failed(text) => log::warn!("a thumbnail was not made: {}", text.unwrap_or_default()),
        }
        // An open start page comes before the samples of the picture behind it.
        if !(idle || state.layout.start_page_open) || self.latest.is_busy() {
            return;
        }
        if let Some(job) = self.next_picture(state).or_else(|| self.next_model(state)) {
            let (Job::Find(source) | Job::Keep(source, _)) = &job;
            self.requested.insert(source.clone());
            self.latest.request((), job, Instant::now());
        }
    }

    /// The picture of the presented file, once a scene.
    fn next_picture(&mut self, state: &AppState) -> Option<Job> {
        let Presented { accel, frame, .. } = state.model.presented.as_ref()?;
        let scene = &accel.scene;
        let is_new = !is_same(&self.kept, scene);
        let suits = frame.settings.shading == Shading::Lit && frame.stats.hits > 0 && scene.source.path().is_some();
        if !is_new || !suits {
            return None;
        }
        self.kept = Arc::downgrade(scene);
        Some(Job::Keep(scene.source.clone(), Arc::clone(frame)))
    }

    /// The next model of the open start page without a thumbnail.
    fn next_model(&self, state: &AppState) -> Option<Job> {
        if !state.layout.start_page_open {
            return None;
        }
        let recent = state.preferences.recent.iter().map(|path| SceneSource::File(path.clone()));
        let builtin =
            BUILTIN_SCENES.iter().map(|scene| SceneSource::Builtin { name: scene.name.to_owned(), size: None });
        recent.chain(builtin).find(|source| !self.requested.contains(source)).map(Job::Find)
    }
}

fn save(file: Option<&PathBuf>, thumbnail: &Thumbnail) {
    if let Some(Err(error)) = file.map(|file| write(file, thumbnail)) {
        log::warn!("a thumbnail was not saved: {error}");
    }
}

/// Traces a built-in scene; `None` for files.
fn traced(source: &SceneSource, token: &CancelToken) -> Option<Thumbnail> {
    if source.path().is_some() {
        return None;
    }
    let scene = Arc::new(load(source, &LoadOptions::default(), token).ok()?);
    let accel = Arc::new(Accel::build(&scene, &BuildSettings::default(), token).ok()?);
    let settings = RenderSettings { samples: SAMPLES, ..RenderSettings::default() };
    let camera = NamedView::Default.camera(&scene, scene.up);
    let request = RenderRequest::new(&accel, camera, settings, THUMBNAIL_SIZE);
    let frame = render(&request, token, &|_| {}).ok()?;
    Some(Thumbnail { rgba: frame.rgba })
}

/// The middle of a picture in the size of a thumbnail.
fn reduced(frame: &Frame) -> Option<Thumbnail> {
    let picture = image::RgbaImage::from_raw(frame.width_px, frame.height_px, frame.rgba.as_flattened().to_vec())?;
    let [width, height] = THUMBNAIL_SIZE;
    // As much as fits of the picture with the proportions of a thumbnail.
    let crop_width = frame.width_px.min(frame.height_px * width / height).max(1);
    let crop_height = (crop_width * height / width).clamp(1, frame.height_px);
    let [left, top] = [(frame.width_px - crop_width) / 2, (frame.height_px - crop_height) / 2];
    let middle = image::imageops::crop_imm(&picture, left, top, crop_width, crop_height).to_image();
    let small = image::imageops::thumbnail(&middle, width, height);
    Some(Thumbnail { rgba: small.pixels().map(|pixel| pixel.0).collect() })
}

/// Largest file that is read, in bytes: the pixels of a thumbnail without compression.
const MAX_BYTES: u64 = 4 * THUMBNAIL_SIZE[0] as u64 * THUMBNAIL_SIZE[1] as u64 + 4096;
/// Number of files from which the oldest are removed.
const MAX_FILES: usize = 200;

/// The folder of the cache; `None` where the system has none.
pub(crate) fn cache_folder() -> Option<PathBuf> {
    let given = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let folder = if cfg!(windows) {
        given("LOCALAPPDATA")
    } else if cfg!(target_os = "macos") {
        std::env::home_dir().map(|home| home.join("Library/Caches"))
    } else {
        given("XDG_CACHE_HOME").or_else(|| std::env::home_dir().map(|home| home.join(".cache")))
    };
    Some(folder?.join("bvhscope").join("thumbnails"))
}

/// The file for the thumbnail of a model as it is now; `None` where the model cannot be found.
pub(super) fn file_of(folder: &Path, source: &SceneSource) -> Option<PathBuf> {
    let mut hasher = DefaultHasher::new();
    // Pictures of another version may look different.
    env!("CARGO_PKG_VERSION").hash(&mut hasher);
    source.hash(&mut hasher);
    if let Some(path) = source.path() {
        let metadata = std::fs::metadata(path).ok()?;
        (metadata.len(), metadata.modified().ok()).hash(&mut hasher);
    }
    Some(folder.join(format!("{:016x}.png", hasher.finish())))
}

/// Reads a thumbnail; `None` where there is none or something else.
pub(super) fn read(file: &Path) -> Option<Thumbnail> {
    let metadata = std::fs::metadata(file).ok()?;
    if !metadata.is_file() || metadata.len() > MAX_BYTES {
        return None;
    }
    let mut reader =
        image::ImageReader::with_format(std::io::BufReader::new(std::fs::File::open(file).ok()?), ImageFormat::Png);
    let mut limits = image::Limits::default();
    (limits.max_image_width, limits.max_image_height) = (Some(THUMBNAIL_SIZE[0]), Some(THUMBNAIL_SIZE[1]));
    reader.limits(limits);
    let picture = reader.decode().ok()?.into_rgba8();
    (picture.dimensions() == THUMBNAIL_SIZE.into())
        .then(|| Thumbnail { rgba: picture.pixels().map(|pixel| pixel.0).collect() })
}

/// Writes a thumbnail, and removes the oldest ones of too many.
pub(super) fn write(file: &Path, thumbnail: &Thumbnail) -> Result<(), String> {
    let mut png = std::io::Cursor::new(Vec::new());
    let [width, height] = THUMBNAIL_SIZE;
    let pixels = thumbnail.rgba.as_flattened();
    image::write_buffer_with_format(&mut png, pixels, width, height, image::ExtendedColorType::Rgba8, ImageFormat::Png)
        .map_err(|error| error.to_string())?;
    let folder = file.parent().unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder).map_err(|error| error.to_string())?;
    write_bytes(file, &Protected::default(), png.get_ref()).map_err(|error| error.to_string())?;
    remove_oldest(folder);
    Ok(())
}

fn remove_oldest(folder: &Path) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    let file = |entry: std::fs::DirEntry| Some((entry.metadata().ok()?.modified().ok()?, entry.path()));
    let mut files: Vec<_> = entries.filter_map(|entry| file(entry.ok()?)).collect();
    files.retain(|(_, path)| path.extension().is_some_and(|extension| extension == "png"));
    files.sort();
    for (_, path) in files.iter().take(files.len().saturating_sub(MAX_FILES)) {
        // Another run may have removed it.
        let _ = std::fs::remove_file(path);
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    #[test]
    fn a_built_in_scene_is_traced_and_a_file_is_not_read() {
        let token = CancelToken::new();
        let source = SceneSource::Builtin { name: "teapot".to_owned(), size: Some(2) };
        let thumbnail = traced(&source, &token).unwrap();
        assert_eq!(thumbnail.rgba.len() as u32, THUMBNAIL_SIZE[0] * THUMBNAIL_SIZE[1]);
        let (corner, middle) = (thumbnail.rgba[0], thumbnail.rgba[(60 * THUMBNAIL_SIZE[0] + 96) as usize]);
        assert_ne!(corner, middle, "the teapot is in the middle");
        assert_eq!(traced(&SceneSource::File("Cargo.toml".into()), &token), None);
    }

    fn grey(level: u8) -> Thumbnail {
        Thumbnail { rgba: vec![[level, level, level, 255]; (THUMBNAIL_SIZE[0] * THUMBNAIL_SIZE[1]) as usize] }
    }

    #[test]
    fn thumbnails_survive_and_bad_files_are_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let file = file_of(&folder.path().join("new"), &SceneSource::default_builtin()).unwrap();
        write(&file, &grey(7)).unwrap();
        assert_eq!(read(&file), Some(grey(7)));
        for bad in [&b"no picture"[..], b"", &vec![0; MAX_BYTES as usize + 1]] {
            std::fs::write(&file, bad).unwrap();
            assert_eq!(read(&file), None);
        }
        let other = image::RgbaImage::new(3, 3);
        other.save_with_format(&file, ImageFormat::Png).unwrap();
        assert_eq!(read(&file), None, "a picture of another size");
        write(&file, &grey(9)).unwrap();
        assert_eq!(read(&file), Some(grey(9)));
    }

    #[test]
    fn a_changed_model_has_another_file() {
        let folder = tempfile::tempdir().unwrap();
        let model = folder.path().join("a.obj");
        std::fs::write(&model, "v 0 0 0\n").unwrap();
        let source = SceneSource::File(model.clone());
        let before = file_of(folder.path(), &source).unwrap();
        assert_eq!(file_of(folder.path(), &source), Some(before.clone()));
        std::fs::write(&model, "v 0 0 0\nv 1 0 0\n").unwrap();
        assert_ne!(file_of(folder.path(), &source), Some(before));
        std::fs::remove_file(&model).unwrap();
        assert_eq!(file_of(folder.path(), &source), None);
    }
}
