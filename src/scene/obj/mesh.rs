//! The meshes that tobj read, put into the scene: colours decoded, polygons cut into triangles.

use glam::{DVec3, Vec2, Vec3};

use super::super::assemble::{Assembly, VertexLists, check_vertices, collect_cancellable, offset_corners};
use super::super::error::{FileLocation, LoadError};
use super::super::material::linear_from_srgb;
use super::super::offset::{Extent, moved};
use super::super::polygon::PolygonCutter;
use super::super::read::ModelFile;
use super::rules::Parts;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::Triangle;

/// Progress at which the file has been read and meshes are put together.
pub(super) const MESH_PROGRESS: f32 = 0.8;

/// Appends the triangles of all meshes, each named by the index of its part.
pub(super) fn add(
    file: &ModelFile<'_>,
    models: Vec<tobj::Model>,
    parts: &Parts,
    assembly: &mut Assembly,
) -> Result<(), LoadError> {
    let ModelFile { path, token, .. } = *file;
    assembly.reserve(parts.triangles).map_err(|error| error.in_file(path))?;
    let mut extent = Extent::EMPTY;
    for model in &models {
        token.check()?;
        model.mesh.positions.as_chunks::<3>().0.iter().for_each(|&point| extent.add(point.into()));
    }
    assembly.offset = extent.offset();
    let mut cutter = PolygonCutter::default();
    let mut lines = parts.polygon_lines.iter();
    let count = models.len();
    for (index, tobj::Model { mesh, name }) in models.into_iter().enumerate() {
        token.check()?;
        token.set_progress(MESH_PROGRESS + (0.95 - MESH_PROGRESS) * index as f32 / count as f32);
        let Some(part) = name.parse().ok().and_then(|part: usize| parts.list.get(part)) else { continue };
        let points = mesh.positions.as_chunks::<3>().0.iter();
        let points: Vec<DVec3> = points.map(|&point| moved(point.into(), assembly.offset)).collect();
        let lists = attributes(&mesh, token)?;
        let has_attributes = !(lists.normals.is_empty() && lists.uvs.is_empty() && lists.colors.is_empty());
        if has_attributes {
            check_vertices(points.len()).map_err(|error| error.in_file(path))?;
        }
        let first = assembly.add_vertices(points.len(), &lists, token)?;
        let target = Target { points: &points, first, material: part.material };
        if mesh.face_arities.is_empty() {
            mesh.indices.as_chunks::<3>().0.iter().for_each(|&corners| target.push(corners, 0, assembly));
        } else {
            target.cut_faces(&mesh, &mut lines, &mut cutter, assembly, token)?;
        }
    }
    Ok(())
}

/// The part of the scene that a mesh becomes.
struct Target<'a> {
    points: &'a [DVec3],
    /// The first of its vertices in the scene, if they have attributes.
    first: Option<u32>,
    material: u32,
}

impl Target<'_> {
    fn push(&self, corners: [u32; 3], line: u64, assembly: &mut Assembly) {
        let [a, b, c] =
            corners.map(|corner| self.points.get(corner as usize).map_or(Vec3::NAN, |point| point.as_vec3()));
        let attributes = offset_corners(corners, self.first);
        assembly.push(Triangle { a, b, c }, attributes, self.material, || FileLocation::Line(line));
    }

    /// Appends faces of any number of corners; `lines` are those of the faces of more than three.
    fn cut_faces<'l>(
        &self,
        mesh: &tobj::Mesh,
        lines: &mut impl Iterator<Item = &'l u32>,
        cutter: &mut PolygonCutter,
        assembly: &mut Assembly,
        token: &CancelToken,
    ) -> Result<(), Cancelled> {
        let mut rest = &mesh.indices[..];
        let mut polygon = Vec::new();
        for &arity in &mesh.face_arities {
            let Some((corners, after)) = rest.split_at_checked(arity as usize) else { break };
            rest = after;
            if let [a, b, c] = *corners {
                self.push([a, b, c], 0, assembly);
                continue;
            }
            let line = lines.next().map_or(0, |&line| u64::from(line));
            polygon.clear();
            polygon.extend(corners.iter().map(|&corner| self.points.get(corner as usize).copied().unwrap_or_default()));
            let cut = cutter.cut(&polygon, token)?;
            if let Some(flaw) = cut.flaw {
                assembly.warnings.add(flaw, || FileLocation::Line(line));
            }
            let mut push = |[a, b, c]: [usize; 3]| {
                let corner = |k: usize| corners.get(k).copied().unwrap_or(u32::MAX);
                self.push([corner(a), corner(b), corner(c)], line, assembly);
            };
            match cut.ears {
                Some(ears) => ears.iter().for_each(|ear| push(ear.map(|k| k as usize))),
                None => (2..corners.len()).for_each(|k| push([0, k.saturating_sub(1), k])),
            }
        }
        Ok(())
    }
}

/// Attributes of the vertices of a mesh, with v down and colours in linear light.
fn attributes(mesh: &tobj::Mesh, token: &CancelToken) -> Result<VertexLists, Cancelled> {
    let vector = |values: &[f64; 3]| DVec3::from_array(*values).as_vec3();
    let [normals, colors] = [&mesh.normals, &mesh.vertex_color].map(|list| list.as_chunks::<3>().0);
    let texcoords = mesh.texcoords.as_chunks::<2>().0;
    Ok(VertexLists {
        normals: collect_cancellable(normals.len(), normals.iter().map(|v| vector(v).normalize_or_zero()), token)?,
        uvs: collect_cancellable(
            texcoords.len(),
            texcoords.iter().map(|&[u, v]| Vec2::new(u as f32, (1.0 - v) as f32)),
            token,
        )?,
        colors: collect_cancellable(colors.len(), colors.iter().map(|v| linear_from_srgb(vector(v))), token)?,
        ..VertexLists::default()
    })
}
