//! Wavefront OBJ loader: tobj behind a sanitizing reader, with a material loader of its own.

mod mtl;
mod sanitize;

use std::cell::RefCell;
use std::path::Path;

use glam::{Vec2, Vec3};

use super::assemble::{Assembly, BATCH_SIZE, VertexLists, collect_cancellable, offset_corners};
use super::error::{FileLocation, LoadError, Warnings};
use super::images::Images;
use super::material::Material;
use super::material::linear_from_srgb;
use super::options::LoadOptions;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::Triangle;

/// Loads an OBJ file from memory.
pub(super) fn load(
    path: &Path,
    bytes: &[u8],
    options: &LoadOptions,
    assembly: &mut Assembly,
    token: &CancelToken,
) -> Result<(), LoadError> {
    if bytes.starts_with(b"\xFF\xFE") || bytes.starts_with(b"\xFE\xFF") {
        return Err(LoadError::of_file(path, "is UTF-16 text", "save it as UTF-8"));
    }
    let images = RefCell::new(Images::new(path, options, token));
    let materials = RefCell::new((Vec::new(), Warnings::default()));
    let mut reader = sanitize::Sanitizer::new(bytes, token);
    let settings = tobj::LoadOptions { single_index: true, triangulate: true, ..tobj::LoadOptions::default() };
    let result = tobj::load_obj_buf(&mut reader, &settings, |name| {
        let (all, warnings) = &mut *materials.borrow_mut();
        let found = mtl::load(&name.to_string_lossy(), &mut images.borrow_mut(), warnings);
        let names = found.iter().map(|m| tobj::Material { name: m.name.clone(), ..tobj::Material::default() });
        let names: Vec<_> = names.collect();
        let map = names.iter().enumerate().map(|(k, material)| (material.name.clone(), k)).collect();
        all.extend(found);
        Ok((names, map))
    });
    token.check()?;
    let models = match (result, &reader.fault) {
        (_, Some((location, message))) => {
            return Err(LoadError::at(
                path,
                location.clone(),
                message.clone(),
                "correct the line or export the model again",
            ));
        }
        (Err(error), None) => {
            let (location, problem) = (FileLocation::Line(reader.line), format!("cannot be understood: {error}"));
            return Err(LoadError::at(path, location, problem, "correct the line or export the model again"));
        }
        (Ok((models, _)), None) => models,
    };
    let (materials, warnings) = materials.into_inner();
    assembly.mesh_count = reader.mesh_count;
    assembly.point_count = reader.positions();
    assembly.warnings = reader.warnings;
    assembly.warnings.append(warnings);
    images.into_inner().finish(assembly);
    assembly.materials = materials;
    let default_material = assembly.materials.len() as u32;
    if models.iter().any(|model| model.mesh.material_id.is_none()) {
        assembly.materials.push(Material::clay());
    }
    for model in models {
        token.check()?;
        let mesh = model.mesh;
        let material = mesh.material_id.map_or(default_material, |index| index as u32);
        add_mesh(&mesh, material, path, assembly, token)?;
    }
    Ok(())
}

fn add_mesh(
    mesh: &tobj::Mesh,
    material: u32,
    path: &Path,
    assembly: &mut Assembly,
    token: &CancelToken,
) -> Result<(), LoadError> {
    let vectors = |flat: &[f32], transform: &dyn Fn(Vec3) -> Vec3| {
        collect_cancellable(flat.len() / 3, flat.as_chunks().0.iter().map(|&v| transform(Vec3::from_array(v))), token)
    };
    let positions = vectors(&mesh.positions, &|point| point)?;
    // The sanitizer separates faces with and without an attribute, so a list is complete or empty.
    let is_complete = |count: usize| count == positions.len();
    let mut lists = VertexLists::default();
    if is_complete(mesh.normals.len() / 3) {
        lists.normals = vectors(&mesh.normals, &Vec3::normalize_or_zero)?;
    }
    if is_complete(mesh.texcoords.len() / 2) {
        let uvs = mesh.texcoords.as_chunks().0;
        lists.uvs = collect_cancellable(uvs.len(), uvs.iter().map(|&[u, v]| Vec2::new(u, 1.0 - v)), token)?;
    }
    if is_complete(mesh.vertex_color.len() / 3) {
        lists.colors = vectors(&mesh.vertex_color, &linear_from_srgb)?;
    }
    let first = assembly.add_vertices(positions.len(), &lists, token)?;
    assembly.reserve(mesh.indices.len() / 3).map_err(|error| error.in_file(path))?;
    for (at, corners) in mesh.indices.as_chunks::<3>().0.iter().enumerate() {
        if at.is_multiple_of(BATCH_SIZE) {
            token.check()?;
        }
        let corner = |k: usize| positions.get(corners[k] as usize).copied();
        if let (Some(a), Some(b), Some(c)) = (corner(0), corner(1), corner(2)) {
            assembly.push(Triangle { a, b, c }, offset_corners(*corners, first), material, || FileLocation::File);
        }
    }
    Ok(())
}
