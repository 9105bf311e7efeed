//! PBRT loader: scenes of version 4, and most of version 3, as ray tracing papers publish them.
//!
//! Not based on the crate pbrt4, which its author has left since 2023. Shapes become triangles, materials keep their colours, and
//! the camera is the view that one starts with. Coordinates are those of the file, also where that is left-handed.

mod files;
mod mesh;
mod parameters;
mod placed;
mod reader;
mod shapes;
mod surface;
mod tokens;
mod view;

use std::borrow::Cow;

use glam::Vec3;

use super::assemble::Assembly;
use super::error::LoadError;
use super::read::{ModelFile, beginning};
use reader::Reader;
use tokens::Tokens;

/// Words that begin a scene.
const FIRST_WORDS: [&[u8]; 33] = [
    b"Accelerator",
    b"ActiveTransform",
    b"AreaLightSource",
    b"Attribute",
    b"AttributeBegin",
    b"Camera",
    b"ColorSpace",
    b"ConcatTransform",
    b"CoordSysTransform",
    b"CoordinateSystem",
    b"Film",
    b"Identity",
    b"Import",
    b"Include",
    b"Integrator",
    b"LightSource",
    b"LookAt",
    b"MakeNamedMaterial",
    b"Material",
    b"NamedMaterial",
    b"ObjectBegin",
    b"Option",
    b"PixelFilter",
    b"ReverseOrientation",
    b"Rotate",
    b"Sampler",
    b"Scale",
    b"Shape",
    b"Texture",
    b"Transform",
    b"TransformBegin",
    b"Translate",
    b"WorldBegin",
];

/// Whether a text begins with a statement of a scene.
pub(super) fn is_pbrt(bytes: &[u8]) -> bool {
    let mut rest = beginning(bytes);
    while rest.starts_with(b"#") {
        let end = rest.iter().position(|&byte| byte == b'\n').unwrap_or(rest.len());
        rest = rest[end..].trim_ascii_start();
    }
    let end = rest.iter().position(|byte| !byte.is_ascii_alphabetic()).unwrap_or(rest.len());
    FIRST_WORDS.contains(&&rest[..end]) && rest.get(end).is_none_or(u8::is_ascii_whitespace)
}

/// Loads a scene from memory; returns its up direction.
pub(super) fn load(file: &ModelFile<'_>, assembly: &mut Assembly) -> Result<Vec3, LoadError> {
    let mut reader = Reader::new(file, assembly);
    reader.read(Tokens::new(Cow::Borrowed(file.bytes), None, file.path, file.token))?;
    let Reader { assembly, surfaces, placed, film, .. } = reader;
    surfaces.images.finish(assembly);
    let up = film.finish(assembly);
    placed.finish(file, assembly)?;
    Ok(up)
}
