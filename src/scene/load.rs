//! Loading: recognises the format of a file and dispatches to its loader.

use std::path::Path;

use glam::Vec3;

use super::assemble::Assembly;
use super::error::{FileLocation, LoadError};
use super::format::{FileFormat, format_names};
use super::model::Scene;
use super::options::LoadOptions;
use super::read::{beginning, read_model};
use super::source::SceneSource;
use super::{builtin, gltf, obj, ply, stl};
use bvhscope_engine::cancel::CancelToken;

/// Loads a scene from a file or makes a built-in one. `token` cancels it and receives the progress.
///
/// ```
/// use bvhscope::scene::{LoadOptions, SceneSource, load};
/// use bvhscope_engine::cancel::CancelToken;
///
/// let source = SceneSource::parse("builtin:terrain:1000".as_ref())?;
/// let scene = load(&source, &LoadOptions::default(), &CancelToken::new()).expect("built-in scenes always load");
/// assert_eq!(scene.triangles.len(), 968);
/// # Ok::<(), String>(())
/// ```
pub fn load(source: &SceneSource, options: &LoadOptions, token: &CancelToken) -> Result<Scene, LoadError> {
    token.check()?;
    token.set_progress(0.0);
    match source {
        SceneSource::Builtin { name, size } => builtin::build(name, *size, source, token),
        SceneSource::File(path) => load_file(path, source, options, token),
    }
}

fn load_file(
    path: &Path,
    source: &SceneSource,
    options: &LoadOptions,
    token: &CancelToken,
) -> Result<Scene, LoadError> {
    let bytes = read_model(path, token)?;
    let (mut assembly, up) = read_bytes(path, &bytes, options, token)?;
    drop(bytes);
    assembly.files_read.insert(0, path.to_path_buf());
    token.check()?;
    token.set_progress(1.0);
    assembly.finish(source, up, token)
}

/// Loads a model from `bytes` as if they were the contents of a file at `path`, whose extension and folder are used.
pub fn load_bytes(path: &Path, bytes: &[u8], options: &LoadOptions, token: &CancelToken) -> Result<Scene, LoadError> {
    let (assembly, up) = read_bytes(path, bytes, options, token)?;
    assembly.finish(&SceneSource::File(path.to_path_buf()), up, token)
}

/// Reads the contents of a file; also returns its up direction.
fn read_bytes(
    path: &Path,
    bytes: &[u8],
    options: &LoadOptions,
    token: &CancelToken,
) -> Result<(Assembly, Vec3), LoadError> {
    let mut assembly = Assembly::new();
    let found = detect(path, bytes);
    if let (Some(found), Some(named)) = (found, FileFormat::from_extension(path))
        && found != named
    {
        let what = format!("name that says {}; it is read as {}, which its content is", named.name(), found.name());
        assembly.warnings.add(&what, || FileLocation::File);
    }
    let up = match found {
        Some(FileFormat::Obj) => obj::load(path, bytes, options, &mut assembly, token).map(|()| Vec3::Y),
        Some(FileFormat::Gltf) => gltf::load(path, bytes, options, &mut assembly, token).map(|()| Vec3::Y),
        Some(FileFormat::Ply) => ply::load(path, bytes, &mut assembly, token).map(|()| Vec3::Y),
        // Most STL files come from CAD programs, where z is up.
        Some(FileFormat::Stl) => stl::load(path, bytes, &mut assembly, token).map(|()| Vec3::Z),
        None => {
            let problem = format!("is neither {}", format_names("nor"));
            Err(LoadError::of_file(path, problem, "export the model in one of these formats"))
        }
    }?;
    Ok((assembly, up))
}

/// Recognises the format by content first, then by extension.
fn detect(path: &Path, bytes: &[u8]) -> Option<FileFormat> {
    if bytes.starts_with(b"glTF") {
        return Some(FileFormat::Gltf);
    }
    if bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r") {
        return Some(FileFormat::Ply);
    }
    if stl::binary_size(bytes) == Some(bytes.len() as u64) {
        return Some(FileFormat::Stl);
    }
    let text = beginning(bytes);
    if text.starts_with(b"{") {
        return Some(FileFormat::Gltf);
    }
    match FileFormat::from_extension(path) {
        Some(format) => Some(format),
        None if text.get(..5).is_some_and(|start| start.eq_ignore_ascii_case(b"solid")) => Some(FileFormat::Stl),
        None => {
            let start = &bytes[..bytes.len().min(4096)];
            let statement = |line: &[u8]| [&b"v "[..], b"o ", b"g ", b"mtllib "].iter().any(|k| line.starts_with(k));
            start.split(|&byte| byte == b'\n').any(statement).then_some(FileFormat::Obj)
        }
    }
}
