//! Loading: recognises the format of a file and dispatches to its loader.

use std::borrow::Cow;
use std::path::Path;

use glam::Vec3;

use super::assemble::Assembly;
use super::error::{FileLocation, LoadError};
use super::flatten::flatten;
use super::format::FileFormat;
use super::gzip::unpacked;
use super::model::Scene;
use super::options::{Instancing, LoadOptions};
use super::read::{ModelFile, read_model};
use super::recognise::{recognise, unlike_obj};
use super::row::FileRow;
use super::source::SceneSource;
use super::two_levels::two_levels;
use super::{builtin, gltf, interior, obj, pbrt, ply, sequence, stl, subject, tree_file};
use bvhscope_engine::cancel::CancelToken;

/// Loads a scene from a file or a row of numbered files, see [`FileRow`], or makes a built-in one. `token` cancels it and receives the
/// progress.
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
    let mut scene = match source {
        SceneSource::Builtin { name, size } => builtin::build(name, *size, source, options.instances, token)?,
        SceneSource::File(path) => match FileRow::of(path) {
            Some(row) => sequence::load(&row, source, options, load_file, token)?,
            None => load_file(path, source, options, token)?,
        },
    };
    scene.subject = subject::subject(&scene.triangles, &scene.bounds, token)?;
    scene.interior = interior::find(&scene.triangles, &scene.subject, scene.up, token)?;
    scene.frame_first_clip(token)?;
    scene.check_normals();
    Ok(scene)
}

fn load_file(
    path: &Path,
    source: &SceneSource,
    options: &LoadOptions,
    token: &CancelToken,
) -> Result<Scene, LoadError> {
    let bytes = unpacked(path, Cow::Owned(read_model(path, token)?), token)?;
    let (mut assembly, up) = read_bytes(&ModelFile { path, bytes: &bytes, options, token })?;
    drop(bytes);
    assembly.files_read.insert(0, path.to_path_buf());
    token.check()?;
    token.set_progress(1.0);
    finish(assembly, source, up, options, token)
}

/// The scene of what was read, in two levels where its copies were kept, unless it is to be flat all the same.
fn finish(
    mut assembly: Assembly,
    source: &SceneSource,
    up: Vec3,
    options: &LoadOptions,
    token: &CancelToken,
) -> Result<Scene, LoadError> {
    let copies = assembly.copies.take();
    let scene = assembly.finish(source, up, token)?;
    match copies {
        Some(copies) if options.instances == Instancing::Flat => {
            let flat = flatten(&scene, &copies, source, token)?;
            Ok(Scene { files_read: scene.files_read, warnings: scene.warnings, ..flat })
        }
        Some(copies) => two_levels(scene, copies, token),
        None => Ok(scene),
    }
}

/// Loads a model from `bytes` as if they were the contents of a file at `path`, whose extension and folder are used.
pub fn load_bytes(path: &Path, bytes: &[u8], options: &LoadOptions, token: &CancelToken) -> Result<Scene, LoadError> {
    let bytes = unpacked(path, Cow::Borrowed(bytes), token)?;
    let (assembly, up) = read_bytes(&ModelFile { path, bytes: &bytes, options, token })?;
    finish(assembly, &SceneSource::File(path.to_path_buf()), up, options, token)
}

/// Reads the contents of a file; also returns its up direction.
fn read_bytes(file: &ModelFile<'_>) -> Result<(Assembly, Vec3), LoadError> {
    let ModelFile { path, bytes, .. } = *file;
    let mut assembly = Assembly::new();
    let found = recognise(path, bytes)?;
    if let Some(named) = FileFormat::from_extension(path)
        && found != named
    {
        let what = format!("names of another format: the file is {}, not {}", found.name(), named.name());
        assembly.warnings.add(&what, || FileLocation::File);
    }
    let up = match found {
        FileFormat::Obj => obj::load(file, &mut assembly).map(|()| Vec3::Y),
        FileFormat::Gltf => gltf::load(file, &mut assembly).map(|()| Vec3::Y),
        FileFormat::Ply => ply::load(file, &mut assembly).map(|()| Vec3::Y),
        // Most STL files come from CAD programs, where z is up.
        FileFormat::Stl => stl::load(file, &mut assembly).map(|()| Vec3::Z),
        FileFormat::Pbrt => pbrt::load(file, &mut assembly),
        FileFormat::Bvh => tree_file::load(file, &mut assembly).map(|()| Vec3::Y),
    };
    // An OBJ file is known by its name only, and its reader passes over what it does not know.
    if found == FileFormat::Obj
        && assembly.is_empty()
        && !up.as_ref().is_err_and(|error| matches!(error, LoadError::Cancelled(_)))
        && let Some(seems) = unlike_obj(bytes, up.is_err())
    {
        let advice = "it may be another file under a wrong name, or damaged: copy or export it again";
        return Err(LoadError::of_file(path, format!("is {seems}, not OBJ"), advice));
    }
    let up = up?;
    Ok((assembly, up))
}
