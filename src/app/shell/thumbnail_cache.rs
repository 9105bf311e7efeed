//! Thumbnails in the user's folder for caches: PNG files named after path, size and time of change of the model. Files that are not
//! of the right kind are ignored and replaced.

use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::path::{Path, PathBuf};

use image::ImageFormat;

use crate::app::state::{THUMBNAIL_SIZE, Thumbnail};
use crate::export::{Protected, write_bytes};
use crate::scene::SceneSource;

/// Largest file that is read, in bytes: the pixels of a thumbnail without compression.
const MAX_BYTES: u64 = 4 * THUMBNAIL_SIZE[0] as u64 * THUMBNAIL_SIZE[1] as u64 + 4096;
/// Number of files from which the oldest are removed.
const MAX_FILES: usize = 200;

/// The folder of the cache; `None` where the system has none.
pub(crate) fn default_folder() -> Option<PathBuf> {
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
