//! From a source to a scene.

use std::path::Path;

use glam::Vec3;

use super::assemble::Assembly;
use super::read::{beginning, read_model, unusable};
use super::{FileLocation, LoadError, Scene, SceneSource, builtin, gltf, obj, ply, stl};
use bvhscope_engine::cancel::CancelToken;

/// What the user allows a load to do.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct LoadOptions {
    /// Files outside the model's folder may be read as well.
    pub allow_outside: bool,
}

/// Loads a scene. Progress by bytes through `token`, which also cancels it.
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
    let (assembly, up) = read_bytes(path, &bytes, options, token)?;
    drop(bytes);
    token.check()?;
    token.set_progress(1.0);
    assembly.finish(source, up, token)
}

/// Loads a model whose bytes are in memory, as if they were in a file at `path`: its extension and folder count.
pub fn load_bytes(path: &Path, bytes: &[u8], options: &LoadOptions, token: &CancelToken) -> Result<Scene, LoadError> {
    let (assembly, up) = read_bytes(path, bytes, options, token)?;
    assembly.finish(&SceneSource::File(path.to_path_buf()), up, token)
}

/// What is in a file, and which way is up in it.
fn read_bytes(
    path: &Path,
    bytes: &[u8],
    options: &LoadOptions,
    token: &CancelToken,
) -> Result<(Assembly, Vec3), LoadError> {
    let mut assembly = Assembly::new();
    let found = detect(path, bytes);
    if let (Some(found), Some(named)) = (found, Format::by_name(path))
        && found != named
    {
        let what = format!("name that says {}; it is read as {}, which its content is", named.label(), found.label());
        assembly.warnings.add(&what, || FileLocation::File);
    }
    let up = match found {
        Some(Format::Obj) => obj::load(path, bytes, options, &mut assembly, token).map(|()| Vec3::Y),
        Some(Format::Gltf) => gltf::load(path, bytes, options, &mut assembly, token).map(|()| Vec3::Y),
        Some(Format::Ply) => ply::load(path, bytes, &mut assembly, token).map(|()| Vec3::Y),
        // Drawing programs for machine parts, where most STL files come from, have z up.
        Some(Format::Stl) => stl::load(path, bytes, &mut assembly, token).map(|()| Vec3::Z),
        None => Err(unusable(path, "is neither OBJ, glTF, GLB, PLY nor STL")),
    }?;
    Ok((assembly, up))
}

/// File formats.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Obj,
    Gltf,
    Ply,
    Stl,
}

impl Format {
    /// What the extension says.
    fn by_name(path: &Path) -> Option<Self> {
        match path.extension()?.to_string_lossy().to_ascii_lowercase().as_str() {
            "obj" => Some(Self::Obj),
            "gltf" | "glb" => Some(Self::Gltf),
            "ply" => Some(Self::Ply),
            "stl" => Some(Self::Stl),
            _ => None,
        }
    }

    const fn label(self) -> &'static str {
        match self {
            Self::Obj => "OBJ",
            Self::Gltf => "glTF",
            Self::Ply => "PLY",
            Self::Stl => "STL",
        }
    }
}

/// By content first; by extension where the content could be anything.
fn detect(path: &Path, bytes: &[u8]) -> Option<Format> {
    if bytes.starts_with(b"glTF") {
        return Some(Format::Gltf);
    }
    if bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r") {
        return Some(Format::Ply);
    }
    if stl::binary_size(bytes) == Some(bytes.len() as u64) {
        return Some(Format::Stl);
    }
    let text = beginning(bytes);
    if text.starts_with(b"{") {
        return Some(Format::Gltf);
    }
    match Format::by_name(path) {
        Some(format) => Some(format),
        None if text.get(..5).is_some_and(|start| start.eq_ignore_ascii_case(b"solid")) => Some(Format::Stl),
        None => {
            let start = &bytes[..bytes.len().min(4096)];
            let statement = |line: &[u8]| [&b"v "[..], b"o ", b"g ", b"mtllib "].iter().any(|k| line.starts_with(k));
            start.split(|&byte| byte == b'\n').any(statement).then_some(Format::Obj)
        }
    }
}
