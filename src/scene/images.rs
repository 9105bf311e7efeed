//! Files that a model names: resolved inside its folder, images decoded once each and within limits.

use std::cell::{OnceCell, RefCell};
use std::collections::{BTreeSet, HashMap};
use std::ffi::OsString;
use std::path::{Component, Path, PathBuf};

use glam::Affine2;
use image::ImageDecoder as _;

use super::assemble::Assembly;
use super::bump;
use super::error::{FileLocation, Warnings};
use super::exponents;
use super::material::{Texture, WrapMode};
use super::options::LoadOptions;
use super::read::{ModelFile, read_file};
use crate::budget::{Budget, format_bytes};
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// Maximum width and height of an image in pixels.
const MAX_SIDE: u32 = 16_384;
/// Maximum number of bytes of one decoded image.
const MAX_IMAGE: u64 = 256 << 20;
/// Maximum number of bytes of all textures of a model.
const MAX_TOTAL: u64 = 1 << 30;

/// Meaning of an image's texels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Content {
    /// Colours or numbers, which are kept as they are.
    Texels,
    /// Heights, which become normals; or normals, which many files name where heights belong.
    Bump,
    /// Exponents of highlights in the red channel, which become roughness; the bits of the one that white stands for.
    Exponents(u32),
}

/// Textures in KTX2 files are read.
pub(super) const READS_KTX2: bool = cfg!(any(feature = "ktx2", test));
/// How to get a model whose textures are read in any build.
pub(super) const UNPACK_TEXTURES: &str = "convert them with 'gltf-transform ktxdecompress IN OUT'";
/// The first bytes of a KTX2 file (Khronos, *KTX File Format Specification* 2.0, section 3.1).
const KTX2_SIGNATURE: &[u8] = b"\xabKTX 20\xbb\r\n\x1a\n";

/// How a texture lies on surfaces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TextureUse {
    pub(super) wrap: [WrapMode; 2],
    pub(super) uv_transform: Affine2,
    pub(super) uv_set: u8,
    /// The texels are numbers rather than colours.
    pub(super) is_linear: bool,
}

impl TextureUse {
    /// Repeated, with the first set of coordinates.
    pub(super) const fn repeated(is_linear: bool) -> Self {
        Self { wrap: [WrapMode::Repeat; 2], uv_transform: Affine2::IDENTITY, uv_set: 0, is_linear }
    }
}

/// Original, wrap modes, transform, set of coordinates, and whether the texels are numbers.
type VariantKey = (u32, [WrapMode; 2], [u32; 6], u8, bool);

/// The textures of one model.
pub(super) struct Images<'a> {
    folder: PathBuf,
    options: LoadOptions,
    /// Cancels loading; polled by everything that reads files named by the model.
    pub(super) token: &'a CancelToken,
    textures: Vec<Texture>,
    /// The folder without links.
    true_folder: OnceCell<Result<PathBuf, String>>,
    /// Textures by name in the model and content; `None` for unusable files.
    by_name: HashMap<(String, Content), Option<u32>>,
    /// Textures by file and content: a file may have many names.
    by_file: HashMap<(PathBuf, Content), Option<u32>>,
    /// Textures by original and use.
    variants: HashMap<VariantKey, Option<u32>>,
    /// Names in lower case and as they are, of every folder in which a name was not found.
    listings: RefCell<HashMap<PathBuf, HashMap<String, OsString>>>,
    /// Bytes of all textures so far.
    total: u64,
    /// Every file that was opened.
    files_read: RefCell<BTreeSet<PathBuf>>,
    warnings: Warnings,
}

impl<'a> Images<'a> {
    pub(super) fn new(model: &ModelFile<'a>) -> Self {
        let folder = model.path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Self {
            folder: folder.to_path_buf(),
            options: model.options.clone(),
            token: model.token,
            textures: Vec::new(),
            true_folder: OnceCell::new(),
            by_name: HashMap::new(),
            by_file: HashMap::new(),
            variants: HashMap::new(),
            listings: RefCell::default(),
            total: 0,
            files_read: RefCell::new(BTreeSet::new()),
            warnings: Warnings::default(),
        }
    }

    /// Moves the textures, the names of the files read and the warnings so far into `assembly`.
    pub(super) fn finish(self, assembly: &mut Assembly) {
        assembly.warnings.append(self.warnings);
        assembly.files_read.extend(self.files_read.into_inner());
        assembly.textures = self.textures;
    }

    /// The bytes of a file named by the model.
    pub(super) fn read_relative(&self, name: &str) -> Result<Vec<u8>, String> {
        self.read(&self.resolve(name)?)
    }

    fn read(&self, path: &Path) -> Result<Vec<u8>, String> {
        self.files_read.borrow_mut().insert(path.to_path_buf());
        read_file(path, None, self.token).map_err(|error| error.to_string())
    }

    /// Index of the texture in an image file that the model names at `location`; `None`, with a warning, if it cannot be used.
    pub(super) fn texture_named(
        &mut self,
        name: &str,
        content: Content,
        location: impl FnOnce() -> FileLocation,
    ) -> Option<u32> {
        if self.token.is_cancelled() {
            return None;
        }
        let key = (name.to_owned(), content);
        if let Some(cached) = self.by_name.get(&key) {
            return *cached;
        }
        let texture = match self.resolve(name) {
            Ok(file) => {
                let file_key = (file, content);
                if let Some(known) = self.by_file.get(&file_key) {
                    *known
                } else {
                    let bytes = self.read(&file_key.0);
                    let texture = self.texture(bytes, content, name, location);
                    self.by_file.insert(file_key, texture);
                    texture
                }
            }
            Err(reason) => self.texture(Err(reason), content, name, location),
        };
        self.by_name.insert(key, texture);
        texture
    }

    /// Index of the texture in the bytes of an image file, or in the file called `name`; `None`, with a warning, if it cannot be
    /// used.
    pub(super) fn texture(
        &mut self,
        bytes: Result<Vec<u8>, String>,
        content: Content,
        name: &str,
        location: impl FnOnce() -> FileLocation,
    ) -> Option<u32> {
        if self.token.is_cancelled() {
            return None;
        }
        let left = MAX_TOTAL.saturating_sub(self.total);
        let decoded = match bytes {
            Ok(bytes) => decode_on_thread(bytes, left, self.token)?,
            Err(reason) => Err(reason),
        };
        match decoded {
            Ok((width, height, texels)) => {
                let mut texels = texels;
                let texels = match content {
                    Content::Texels => texels,
                    Content::Exponents(white) => {
                        exponents::to_roughness(&mut texels, f32::from_bits(white));
                        texels
                    }
                    Content::Bump => bump::normals([width, height], texels, self.token)?,
                };
                self.add(Texture::new(width, height, texels))
            }
            Err(reason) if name.is_empty() => {
                self.warn_at(&format!("images left out: {reason}"), location);
                None
            }
            Err(reason) => {
                self.warnings.add_named(["images left out: ", &format!(": {reason}")], name, location);
                None
            }
        }
    }

    /// Index of a texture with the same texels, which both share, for another use.
    pub(super) fn variant(&mut self, texture: u32, used: TextureUse) -> Option<u32> {
        let TextureUse { wrap, uv_transform, uv_set, is_linear } = used;
        let variant = Texture { is_linear, uv_set, wrap, uv_transform, ..self.textures.get(texture as usize)?.clone() };
        if self.textures.get(texture as usize).is_some_and(|original| original.is_used_as(&variant)) {
            return Some(texture);
        }
        let key = (texture, wrap, uv_transform.to_cols_array().map(f32::to_bits), uv_set, is_linear);
        if let Some(known) = self.variants.get(&key) {
            return *known;
        }
        let index = u32::try_from(self.textures.len()).ok();
        self.textures.push(variant);
        self.variants.insert(key, index);
        index
    }

    fn add(&mut self, texture: Texture) -> Option<u32> {
        let index = u32::try_from(self.textures.len()).ok()?;
        self.total = self.total.saturating_add(texture.bytes());
        self.textures.push(texture);
        Some(index)
    }

    /// Counts a warning about images or textures.
    pub(super) fn warn_at(&mut self, what: &str, location: impl FnOnce() -> FileLocation) {
        self.warnings.add(what, location);
    }

    /// Resolves a file name of the model to a path inside its folder, ignoring case and accepting either slash. Where a path does
    /// not exist, as one of another machine, its file may lie beside the model.
    pub(super) fn resolve(&self, name: &str) -> Result<PathBuf, String> {
        if name.contains("://") && !name.starts_with("file:") {
            return Err("not fetched: this program never uses the network".to_owned());
        }
        if name.contains('\0') || name.is_empty() {
            return Err("that is not a file name".to_owned());
        }
        let name = name.replace('\\', "/");
        let relative = Path::new(&name);
        let beside = relative.file_name().map(Path::new).filter(|beside| *beside != relative);
        let found = |relative: &Path| {
            let direct = self.folder.join(relative);
            let path = if direct.exists() { direct } else { self.find_ignoring_case(relative).unwrap_or(direct) };
            path.canonicalize()
        };
        let path = found(relative).or_else(|error| beside.and_then(|beside| found(beside).ok()).ok_or(error));
        let path = path.map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound => "there is no such file".to_owned(),
            _ => format!("it cannot be opened: {error}"),
        })?;
        let folder = || self.folder.canonicalize().map_err(|error| error.to_string());
        let folder = self.true_folder.get_or_init(folder).as_ref().map_err(Clone::clone)?;
        if self.options.allow_outside || path.starts_with(folder) {
            Ok(path)
        } else {
            Err("it lies outside the model's folder; --allow-outside lets it be read".to_owned())
        }
    }

    fn find_ignoring_case(&self, relative: &Path) -> Option<PathBuf> {
        let mut path = self.folder.clone();
        for component in relative.components() {
            let Component::Normal(wanted) = component else {
                if component == Component::CurDir {
                    continue;
                }
                return None;
            };
            let exact = path.join(wanted);
            path = if exact.exists() { exact } else { path.join(self.listed(&path, &wanted.to_string_lossy())?) };
        }
        Some(path)
    }

    /// The name in `folder` that equals `wanted` but for its case. A folder is listed once, however many names it lacks.
    fn listed(&self, folder: &Path, wanted: &str) -> Option<OsString> {
        let mut listings = self.listings.borrow_mut();
        if !listings.contains_key(folder) {
            let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
            let entries = entries.take_while(|_| !self.token.is_cancelled()).map(|entry| entry.file_name());
            let names = entries.map(|name| (name.to_string_lossy().to_lowercase(), name)).collect();
            listings.insert(folder.to_path_buf(), names);
        }
        listings.get(folder)?.get(&wanted.to_lowercase()).cloned()
    }
}

/// Width, height and texels in sRGB.
type Decoded = Result<(u32, u32, Vec<[u8; 4]>), String>;

/// Files below this many bytes are decoded on the calling thread: compressed as well as possible, they decode to some ten
/// megabytes.
const SMALL_FILE: usize = 1 << 14;

/// Runs [`decode`] so that cancelling does not have to wait for it; `None` once cancelled.
fn decode_on_thread(bytes: Vec<u8>, budget: u64, token: &CancelToken) -> Option<Decoded> {
    // The decoder of KTX2 may panic, which ends its thread.
    if bytes.len() < SMALL_FILE && !bytes.starts_with(KTX2_SIGNATURE) {
        return Some(decode(&bytes, budget));
    }
    let decoded = run_on_thread(move || decode(&bytes, budget), token).ok()?;
    Some(decoded.unwrap_or_else(|| Err("its decoder failed".to_owned())))
}

/// Runs `work`, which takes long and cannot be interrupted, on a thread of its own; `None` if it panics. Once `token` is
/// cancelled the thread is left alone, and frees its memory when it is done. If no thread can be started, it runs on this one.
pub(super) fn run_on_thread<T: Send + 'static>(
    work: impl Fn() -> T + Send + Sync + 'static,
    token: &CancelToken,
) -> Result<Option<T>, Cancelled> {
    let (sender, receiver) = std::sync::mpsc::channel();
    let work = std::sync::Arc::new(work);
    let shared_work = std::sync::Arc::clone(&work);
    // The receiver may be gone after a cancellation.
    let run = move || drop(sender.send(shared_work()));
    if std::thread::Builder::new().name("long work".to_owned()).spawn(run).is_err() {
        return Ok(Some(work()));
    }
    loop {
        match receiver.recv_timeout(std::time::Duration::from_millis(10)) {
            Ok(done) => return Ok(Some(done)),
            Err(std::sync::mpsc::RecvTimeoutError::Timeout) => token.check()?,
            Err(std::sync::mpsc::RecvTimeoutError::Disconnected) => return Ok(None),
        }
    }
}

#[cfg(any(feature = "ktx2", test))]
use super::ktx2::decode as decode_ktx2;

#[cfg(not(any(feature = "ktx2", test)))]
fn decode_ktx2(_: &[u8], _: u32, _: u64) -> Decoded {
    Err(format!("it is a KTX2 file; {UNPACK_TEXTURES}"))
}

/// Decodes an image file to RGBA within `budget` bytes.
fn decode(bytes: &[u8], budget: u64) -> Decoded {
    // The decoder's buffer, the RGBA image and the texels exist at the same time.
    let limit = MAX_IMAGE.min(budget).min(Budget::of_process().left() / 3);
    if bytes.starts_with(KTX2_SIGNATURE) {
        return decode_ktx2(bytes, MAX_SIDE, limit);
    }
    let damaged = |error: &dyn std::fmt::Display| format!("its data are damaged: {error}");
    let mut reader =
        image::ImageReader::new(std::io::Cursor::new(bytes)).with_guessed_format().map_err(|error| damaged(&error))?;
    if reader.format().is_none_or(|format| !format.reading_enabled()) {
        return Err("it is neither PNG, JPEG nor WebP; convert it".to_owned());
    }
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(limit);
    reader.limits(limits);
    let explain = |error: image::ImageError| match error {
        image::ImageError::Limits(_) => format!("it exceeds the limit of {MAX_SIDE} pixels a side or of memory"),
        error => damaged(&error),
    };
    let decoder = reader.into_decoder().map_err(explain)?;
    let (width, height) = decoder.dimensions();
    let texels = u64::from(width).saturating_mul(u64::from(height));
    let bytes = decoder.total_bytes().max(texels.saturating_mul(4));
    if bytes > MAX_IMAGE {
        return Err(format!("{width}x{height} pixels are more than fit into {}", format_bytes(MAX_IMAGE)));
    }
    if bytes > budget {
        return Err("all textures together are too large".to_owned());
    }
    let picture = image::DynamicImage::from_decoder(decoder).map_err(explain)?.into_rgba8();
    let (width, height) = picture.dimensions();
    if width == 0 || height == 0 {
        return Err("it has no pixels".to_owned());
    }
    Ok((width, height, picture.into_raw().as_chunks().0.to_vec()))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    fn png(side: u32) -> Vec<u8> {
        let mut bytes = std::io::Cursor::new(Vec::new());
        image::RgbaImage::new(side, side).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn images_stay_within_their_budget() {
        let picture = png(64);
        assert!(decode(&picture, 1 << 20).is_ok());
        let message = decode(&picture, 5_000).unwrap_err();
        assert!(message.contains("all textures together") || message.contains("limit"), "{message}");
        let mut wide = std::io::Cursor::new(Vec::new());
        image::GrayImage::new(MAX_SIDE + 1, 1).write_to(&mut wide, image::ImageFormat::Png).unwrap();
        let too_wide = decode(wide.get_ref(), 1 << 30).unwrap_err();
        assert!(too_wide.contains("limit"), "{too_wide}");

        // Only three of eight fit: the others are dropped with a warning.
        let token = CancelToken::new();
        let options = LoadOptions::default();
        let mut images =
            Images::new(&ModelFile { path: Path::new("a.gltf"), bytes: &[], options: &options, token: &token });
        images.total = MAX_TOTAL - 3 * 64 * 64 * 4;
        let made: Vec<_> =
            (0..8).map(|_| images.texture(Ok(picture.clone()), Content::Texels, "a", || FileLocation::File)).collect();
        assert_eq!(made.iter().flatten().count(), 3);
        assert_eq!(
            images.texture(Ok(b"no picture at all".to_vec()), Content::Texels, "b", || FileLocation::File),
            None
        );
        let half = picture[..picture.len() / 2].to_vec();
        assert_eq!(images.texture(Ok(half), Content::Texels, "c", || FileLocation::File), None);
        let mut assembly = Assembly::new();
        images.finish(&mut assembly);
        assert_eq!(assembly.textures.len(), 3);
        let counts: Vec<u64> = assembly.warnings.entries.iter().map(|warning| warning.count).collect();
        // The damaged one is left out for want of memory, too.
        assert_eq!(counts, [6, 1], "{:?}", assembly.warnings);
    }

    #[test]
    fn cancelling_does_not_wait_for_a_decoder() {
        let (let_go, held) = std::sync::mpsc::channel::<()>();
        let held = std::sync::Mutex::new(held);
        let token = CancelToken::watched(|poll| poll == 3);
        assert!(run_on_thread(move || held.lock().unwrap().recv().is_err(), &token).is_err());
        assert!(token.is_cancelled());
        drop(let_go);
        assert_eq!(run_on_thread(|| 7, &CancelToken::new()), Ok(Some(7)));
        assert_eq!(run_on_thread(|| -> u8 { panic!("a decoder that fails") }, &CancelToken::new()), Ok(None));
    }
}
