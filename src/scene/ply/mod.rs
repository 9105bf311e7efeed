//! PLY loader: text, and binary of both byte orders.
//!
//! Not based on ply-rs-bw 4.0, whose text grammar rejects whole files for one `nan`, `.5` or `1.`, for a list continued in the
//! next line and for a Latin-1 comment, and which aborts on elements without properties. Working around that would mean
//! tokenising the file first, which is most of this reader.

mod element;
mod faces;
mod header;
mod values;
mod vertices;

use std::path::Path;

use glam::{DVec3, Vec2, Vec3};

use super::assemble::{Assembly, VertexLists, offset_corners};
use super::error::{FileLocation, LoadError, Warnings};
use super::read::ModelFile;
use crate::text::{counted, quoted};
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::Triangle;
use element::{Element, Encoding};
use faces::Faces;
use values::Source;
use vertices::Vertices;

/// Loads a PLY file from memory; a second time with an offset where the vertices turn out to need one.
pub(super) fn load(file: &ModelFile<'_>, assembly: &mut Assembly) -> Result<(), LoadError> {
    let ModelFile { path, bytes, token, .. } = *file;
    let mut read = read(path, bytes, DVec3::ZERO, false, token)?;
    let offset = read.vertices.extent.offset();
    if offset != DVec3::ZERO {
        drop(read);
        read = self::read(path, bytes, offset, false, token)?;
        assembly.offset = offset;
    }
    let Contents { vertices, mut faces, others, warnings, is_text } = read;
    assembly.other_contents.extend(others.into_iter().take(3));
    assembly.point_count = vertices.positions.len() as u64;
    assembly.mesh_count = 1;
    assembly.warnings.append(warnings);
    cut_polygons(&mut faces, &vertices, is_text, &mut assembly.warnings, token)?;
    add(file, &vertices, &faces, assembly)
}

/// Cuts the polygons among the triangles, and counts those that cannot be cut well.
fn cut_polygons(
    faces: &mut Faces,
    vertices: &Vertices,
    is_text: bool,
    warnings: &mut Warnings,
    token: &CancelToken,
) -> Result<(), Cancelled> {
    faces.cut_polygons(&vertices.positions, token, |flaw, place| {
        warnings.add(flaw, || if is_text { FileLocation::Line(place) } else { FileLocation::Byte(place) });
    })
}

/// The mesh of a file that another one names.
pub(super) struct PlyMesh {
    pub(super) positions: Vec<Vec3>,
    /// Empty, or one for each position.
    pub(super) normals: Vec<Vec3>,
    /// Empty, or one for each position, v down.
    pub(super) uvs: Vec<Vec2>,
    /// Indices of positions.
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) warnings: Warnings,
}

/// Reads a mesh from memory, its positions in single precision.
pub(super) fn read_mesh(path: &Path, bytes: &[u8], token: &CancelToken) -> Result<PlyMesh, LoadError> {
    let Contents { vertices, mut faces, mut warnings, is_text, .. } = read(path, bytes, DVec3::ZERO, true, token)?;
    cut_polygons(&mut faces, &vertices, is_text, &mut warnings, token)?;
    let count = vertices.positions.len();
    faces.corners.retain(|corners| corners.iter().all(|&corner| (corner as usize) < count));
    let Vertices { positions, lists: VertexLists { normals, uvs, .. }, .. } = vertices;
    Ok(PlyMesh { positions, normals, uvs, triangles: faces.corners, warnings })
}

/// Contents of a file.
struct Contents {
    vertices: Vertices,
    faces: Faces,
    /// Elements of other kinds, as in "3 elements 'edge'".
    others: Vec<String>,
    warnings: Warnings,
    is_text: bool,
}

/// Reads all elements, positions less `offset`, texture coordinates only where they are wanted.
fn read(path: &Path, bytes: &[u8], offset: DVec3, wants_uvs: bool, token: &CancelToken) -> Result<Contents, LoadError> {
    let mut source = Source::new(path, bytes, token);
    let elements = header::read(&mut source)?;
    let of_kind = |name: &str| elements.iter().position(|element| element.name == name);
    let vertex_element = of_kind("vertex");
    let vertex_count = vertex_element.and_then(|at| elements.get(at)).map_or(0, |element| element.count);
    let mut vertices = Vertices::new(offset, wants_uvs);
    let mut faces = Faces::new(vertex_count);
    let mut others = Vec::new();
    for (at, element) in elements.iter().enumerate() {
        check_count(&source, element)?;
        match element.name.as_str() {
            "vertex" if Some(at) == vertex_element => vertices.read(&mut source, element)?,
            "face" | "tristrips" => faces.read(&mut source, element)?,
            name => {
                let what = format!("elements {} left out", quoted(name));
                source.warnings.add_many(element.count, &what, || FileLocation::Line(element.line));
                if element.count > 0 {
                    let held = format!("elements {}", quoted(name));
                    others.push(counted(element.count, &held));
                }
                source.skip(element)?;
            }
        }
    }
    source.check_end()?;
    let is_text = source.encoding == Encoding::Text;
    Ok(Contents { vertices, faces, others, warnings: source.warnings, is_text })
}

/// Checks the number of an element against the bytes that follow, before memory is requested for it.
fn check_count(source: &Source, element: &Element) -> Result<(), LoadError> {
    let left = source.rest().len() as u64;
    // The last word of a text needs no separator behind it.
    let least = element.count.saturating_mul(element.min_bytes(source.encoding)).saturating_sub(1);
    let name = quoted(&element.name);
    if element.properties.is_empty() && element.count > 0 {
        let problem = format!("{} elements {name} are declared without a property", element.count);
        return Err(source.fault_with(problem, "correct the header or export the model again"));
    }
    if least > left {
        let count = element.count;
        return Err(source.fault(format!("{count} elements {name} are declared, but only {left} bytes follow")));
    }
    Ok(())
}

fn add(file: &ModelFile<'_>, vertices: &Vertices, faces: &Faces, assembly: &mut Assembly) -> Result<(), LoadError> {
    let ModelFile { path, token, .. } = *file;
    let first = assembly.add_vertices(vertices.positions.len(), &vertices.lists, token)?;
    assembly.reserve(faces.corners.len()).map_err(|error| error.in_file(path))?;
    for (index, &corners) in faces.corners.iter().enumerate() {
        if index % 65_536 == 0 {
            token.check()?;
        }
        // Indices were compared with the declared number, and as many vertices were read.
        let corner = |k: usize| vertices.positions.get(corners[k] as usize).copied();
        if let (Some(a), Some(b), Some(c)) = (corner(0), corner(1), corner(2)) {
            let attributes = offset_corners(corners, first);
            let number = index.saturating_add(1);
            assembly.push(Triangle { a, b, c }, attributes, 0, || FileLocation::Json(format!("triangle {number}")));
        }
    }
    Ok(())
}
