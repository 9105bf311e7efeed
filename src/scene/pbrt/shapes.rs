//! The shapes of PBRT scenes as meshes, in the space of the shape.

use std::path::Path;

use glam::{DVec3, Vec2, Vec3};

use super::files::read_named;
use super::mesh::Mesh;
use super::parameters::Parameters;
use crate::scene::error::{FileLocation, LoadError, Warnings};
use crate::scene::images::Images;
use crate::scene::ply;
use crate::text::quoted;

/// Angle around the axis of a curved shape unless the file says otherwise, in degrees.
const FULL_TURN: f64 = 360.0;

/// The mesh of a shape; `None`, with a warning, where there is none.
pub(super) fn read(
    class: &str,
    parameters: &Parameters,
    place: &FileLocation,
    images: &Images,
    warnings: &mut Warnings,
) -> Result<Option<Mesh>, LoadError> {
    let number = |name: &str, default: f64| parameters.number(name).unwrap_or(default);
    let angle = || number("phimax", FULL_TURN).clamp(0.0, FULL_TURN).to_radians();
    let mesh = match class {
        "trianglemesh" => triangles(parameters, place, warnings),
        "loopsubdiv" => {
            warnings.add("surfaces shown as the mesh that controls the subdivision", || place.clone());
            let _ = parameters.get("levels");
            triangles(parameters, place, warnings)
        }
        "plymesh" => ply_mesh(parameters, place, images, warnings)?,
        "bilinearmesh" => patches(parameters, place, warnings),
        "sphere" => {
            let radius = number("radius", 1.0).abs();
            let z = [number("zmin", -radius), number("zmax", radius)];
            Some(Mesh::sphere(radius, z, angle()))
        }
        "disk" => Some(Mesh::disk(number("height", 0.0), number("radius", 1.0), number("innerradius", 0.0), angle())),
        "cylinder" => {
            let z = [number("zmin", -1.0), number("zmax", 1.0)];
            Some(Mesh::cylinder(number("radius", 1.0), z, angle()))
        }
        _ => {
            warnings.add(&format!("shapes of the kind {} not shown", quoted(class)), || place.clone());
            return Ok(None);
        }
    };
    if mesh.is_some() {
        parameters.count_unused("shapes", warnings);
    }
    Ok(mesh)
}

/// The points of a list of coordinates.
fn points(parameters: &Parameters, name: &str, place: &FileLocation, warnings: &mut Warnings) -> Option<Vec<DVec3>> {
    let (numbers, rest) = parameters.numbers(name)?.as_chunks::<3>();
    let what = format!("numbers of {} left over after the last point", quoted(name));
    warnings.add_many(rest.len() as u64, &what, || place.clone());
    Some(numbers.iter().map(|&point| DVec3::from_array(point)).collect())
}

/// The vertices of a mesh: positions, and normals and texture coordinates where there are as many.
fn vertices(parameters: &Parameters, place: &FileLocation, warnings: &mut Warnings) -> Option<Mesh> {
    let Some(positions) = points(parameters, "P", place, warnings).filter(|positions| !positions.is_empty()) else {
        warnings.add("meshes without positions (P) left out", || place.clone());
        return None;
    };
    let normals = points(parameters, "N", place, warnings).unwrap_or_default();
    let pairs = ["uv", "st"].into_iter().find_map(|name| parameters.numbers(name)).unwrap_or_default().as_chunks::<2>();
    let mut mesh = Mesh { positions, ..Mesh::default() };
    let count = mesh.positions.len();
    let mut is_whole = |found: usize, what: &str| {
        if found != 0 && found != count {
            warnings.add(what, || place.clone());
        }
        found == count
    };
    if is_whole(normals.len(), "meshes with fewer normals than positions, or more, shown without") {
        mesh.normals = normals.iter().map(|normal| normal.as_vec3().normalize_or_zero()).collect();
    }
    if is_whole(pairs.0.len(), "meshes with fewer texture coordinates than positions, or more, shown without") {
        mesh.uvs = pairs.0.iter().map(|&[u, v]| Vec2::new(u as f32, (1.0 - v) as f32)).collect();
    }
    Some(mesh)
}

/// Index lists of `N`; those that name a vertex that does not exist are left out and counted. Without any, there is one.
fn indices<const N: usize>(
    parameters: &Parameters,
    count: usize,
    place: &FileLocation,
    warnings: &mut Warnings,
) -> Vec<[u32; N]> {
    let Some(numbers) = parameters.numbers("indices") else {
        if count == N {
            return vec![std::array::from_fn(|corner| corner as u32)];
        }
        warnings.add("meshes without indices left out", || place.clone());
        return Vec::new();
    };
    let (lists, rest) = numbers.as_chunks::<N>();
    warnings.add_many(rest.len() as u64, "indices left over after the last face", || place.clone());
    let is_vertex = |&index: &f64| index >= 0.0 && index < count as f64 && index.fract() == 0.0;
    let sound = lists.iter().filter(|list| list.iter().all(is_vertex)).map(|list| list.map(|index| index as u32));
    let sound: Vec<[u32; N]> = sound.collect();
    let lost = lists.len().saturating_sub(sound.len()) as u64;
    warnings.add_many(lost, "faces with a vertex that does not exist skipped", || place.clone());
    sound
}

fn triangles(parameters: &Parameters, place: &FileLocation, warnings: &mut Warnings) -> Option<Mesh> {
    let mut mesh = vertices(parameters, place, warnings)?;
    mesh.triangles = indices(parameters, mesh.positions.len(), place, warnings);
    Some(mesh)
}

/// Bilinear patches, each of its own vertices.
fn patches(parameters: &Parameters, place: &FileLocation, warnings: &mut Warnings) -> Option<Mesh> {
    let vertices = vertices(parameters, place, warnings)?;
    let mut mesh = Mesh::default();
    let lists: Vec<[u32; 4]> = indices(parameters, vertices.positions.len(), place, warnings);
    for corners in lists {
        let normals = (!vertices.normals.is_empty()).then_some(&vertices.normals);
        let normals = normals.map(|normals| corners.map(|corner| normals[corner as usize].as_dvec3()));
        let mut patch = Mesh::patch(corners.map(|corner| vertices.positions[corner as usize]), normals);
        if !vertices.uvs.is_empty() {
            let [a, b, c, d] = corners.map(|corner| vertices.uvs[corner as usize]);
            for uv in &mut patch.uvs {
                // The patch's own coordinates, v up.
                let (u, v) = (uv.x, 1.0 - uv.y);
                *uv = a.lerp(b, u).lerp(c.lerp(d, u), v);
            }
        }
        mesh.append(patch);
    }
    Some(mesh)
}

/// The mesh in a PLY file.
fn ply_mesh(
    parameters: &Parameters,
    place: &FileLocation,
    images: &Images,
    warnings: &mut Warnings,
) -> Result<Option<Mesh>, LoadError> {
    let Some(name) = parameters.text("filename") else {
        warnings.add("meshes without the name of a file left out", || place.clone());
        return Ok(None);
    };
    let read = match read_named(name, images)? {
        Ok(bytes) => ply::read_mesh(Path::new(name), &bytes, images.token),
        Err(reason) => {
            warnings.add_named(["meshes ", &format!(" left out: {reason}")], name, || place.clone());
            return Ok(None);
        }
    };
    let contents = match read {
        Ok(contents) => contents,
        Err(LoadError::Cancelled(cancelled)) => return Err(cancelled.into()),
        Err(error) => {
            warnings.add_named(["meshes ", &format!(" left out: {error}")], name, || place.clone());
            return Ok(None);
        }
    };
    for warning in contents.warnings.entries {
        let first = match warning.first {
            FileLocation::Line(line) => FileLocation::LineIn(name.to_owned(), line),
            FileLocation::Byte(byte) => FileLocation::Json(format!("{name}: byte {byte}")),
            other => other,
        };
        warnings.add_many(warning.count, &warning.what, || first);
    }
    Ok(Some(Mesh {
        positions: contents.positions.iter().map(|point: &Vec3| point.as_dvec3()).collect(),
        normals: contents.normals,
        uvs: contents.uvs,
        triangles: contents.triangles,
        ..Mesh::default()
    }))
}
