//! Decodes mesh primitives into triangles and attributes in mesh space.
//!
//! Only vertices that triangles refer to are read, so that the work is bounded by the number of corners even if many primitives
//! share one long list of vertices.

use std::sync::Arc;

use glam::{Vec2, Vec3, Vec4};
use gltf::Semantic;
use gltf::accessor::DataType;
use gltf::mesh::Mode;

use super::accessor::{Accessor, AccessorError, Accessors, WRONG_TYPE};
use super::attributes::{Attributes, Gather, at, is_unit, reserve_memory};
use super::deform;
use super::document::Fault;
use super::table::extension;
use crate::scene::assemble::{BATCH_SIZE, BYTES_PER_VERTEX, collect_cancellable};
use crate::scene::motion::Shape;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::Aabb;

/// A decoded primitive in mesh space.
#[derive(Default)]
pub(super) struct Primitive {
    /// Positions and normals, tangents of surfaces with a map of normals, and the joints and morph targets that move them.
    pub(super) shape: Arc<Shape>,
    /// The box around those of the positions that are finite.
    pub(super) bounds: [Vec3; 2],
    /// Texture coordinates; as the other attributes empty or as long as the positions.
    pub(super) uvs: Vec<Vec2>,
    pub(super) uvs2: Vec<Vec2>,
    pub(super) colors: Vec<Vec3>,
    /// Opacities, only of surfaces with holes.
    pub(super) alphas: Vec<f32>,
    /// Vertex indices of each triangle, all in range.
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) material: usize,
    /// Missing parts: the number, the kind, and the place in the primitive with details.
    pub(super) faults: Vec<(u64, String, String)>,
}

/// How a primitive uses its material.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct MaterialUse {
    /// The set of texture coordinates.
    pub(super) uv_set: u32,
    /// The set of its other textures, if there is a second one.
    pub(super) second_uv_set: Option<u32>,
    pub(super) has_texture: bool,
    pub(super) has_normal_map: bool,
    /// The opacity of vertices decides about holes.
    pub(super) is_cut_out: bool,
}

/// The contents of a primitive.
pub(super) enum Decoded {
    /// Triangles.
    Surface(Box<Primitive>),
    /// Points or lines, this many vertices.
    Points(u64),
    /// Nothing, which was counted before.
    Lost,
}

impl Primitive {
    /// Whether vertices have more than a position.
    pub(super) fn has_attributes(&self) -> bool {
        !(self.shape.normals.is_empty() && self.uvs.is_empty() && self.uvs2.is_empty() && self.colors.is_empty())
    }
}

/// Number of triangles that a primitive declares; 0 if its corners cannot be read.
pub(super) fn declared_triangles<'a>(
    json: &gltf::Primitive<'a>,
    accessors: &Accessors<'a>,
    token: &CancelToken,
) -> Result<u64, Cancelled> {
    let corners = json.indices().or_else(|| json.get(&Semantic::Positions));
    let corners = match corners.map(|json| accessors.open(&json, token)) {
        Some(Ok(accessor)) => accessor.count as u64,
        Some(Err(AccessorError::Cancelled(cancelled))) => return Err(cancelled),
        Some(Err(AccessorError::Unreadable(_))) | None => 0,
    };
    Ok(match json.mode() {
        Mode::Triangles => corners / 3,
        Mode::TriangleStrip | Mode::TriangleFan => corners.saturating_sub(2),
        _ => 0,
    })
}

/// Decodes a primitive. The last of `materials` is the default one.
#[expect(clippy::too_many_lines, reason = "one attribute after another")]
pub(super) fn read<'a>(
    json: &gltf::Primitive<'a>,
    accessors: &Accessors<'a>,
    materials: &[MaterialUse],
    token: &CancelToken,
) -> Result<Decoded, AccessorError> {
    if json.extension_value(extension::LOST).is_some() {
        return Ok(Decoded::Lost);
    }
    let position = json.get(&Semantic::Positions);
    let mode = json.mode();
    if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
        return Ok(Decoded::Points(position.map_or(0, |json| accessors.declared(&json))));
    }
    let mut primitive = Primitive::default();
    let Some(position) = position else {
        return Err(Fault::new("no positions", "it has no POSITION").into());
    };
    let positions = accessors.open(&position, token)?;
    if positions.width != 3 || positions.component == DataType::U32 {
        let (width, bits) = (positions.width, positions.component.size().saturating_mul(8));
        let detail = format!("POSITION has {width} components of {bits} bits instead of 3 floats");
        return Err(Fault::new(WRONG_TYPE, detail).into());
    }
    let what = "the indices of one primitive";
    let corners: Vec<u32> = if let Some(indices) = json.indices() {
        let indices = accessors.open_indices(&indices, token)?;
        reserve_memory(what, indices.count, size_of::<u32>() as u64)?;
        collect_cancellable(indices.count, (0..indices.count).map(|k| indices.vertex_index(k)), token)?
    } else {
        reserve_memory(what, positions.count, size_of::<u32>() as u64)?;
        collect_cancellable(positions.count, (0..positions.count).map(|k| k as u32), token)?
    };
    let place = if json.indices().is_some() { "indices" } else { "attributes.POSITION" };
    let left_over = match mode {
        Mode::Triangles => corners.len() % 3,
        _ => Some(corners.len()).filter(|&length| length < 3).unwrap_or(0),
    };
    if left_over > 0 {
        let detail = format!("{} of them", corners.len());
        primitive.faults.push((
            left_over as u64,
            "indices left over after the last triangle".to_owned(),
            at(place, &detail),
        ));
    }
    let mut triangles = triangles(mode, &corners, token)?;
    let total = triangles.len();
    let exists = |corners: &[u32; 3]| corners.iter().all(|&corner| (corner as usize) < positions.count);
    let mut first_wrong = None;
    for (k, part) in triangles.chunks(BATCH_SIZE).enumerate() {
        token.check()?;
        if first_wrong.is_none() {
            first_wrong = part.iter().find(|corners| !exists(corners)).copied().map(|corners| (k, corners));
        }
    }
    if let Some((_, wrong)) = first_wrong {
        triangles.retain(exists);
        let lost = total.saturating_sub(triangles.len()) as u64;
        let vertex = wrong.into_iter().max().unwrap_or(0);
        let detail = format!("vertex {vertex} of {}", positions.count);
        primitive.faults.push((
            lost,
            "triangles with a vertex that does not exist skipped".to_owned(),
            at(place, &detail),
        ));
    }
    let used = compact(&mut triangles, positions.count, token)?;
    primitive.triangles = triangles;
    let gather = Gather { used: used.as_deref(), count: positions.count, token };
    reserve_memory("the vertices of one primitive", gather.len(), BYTES_PER_VERTEX)?;
    let positions = gather.all(&positions, |[x, y, z]| Vec3::new(x, y, z))?;
    let bounds = Aabb::around(positions.iter().copied().filter(|point| point.is_finite()));
    primitive.bounds = [bounds.min, bounds.max];
    primitive.material = json.material().index().unwrap_or(materials.len().saturating_sub(1));
    let mut shape = Shape { positions, ..Shape::default() };
    let faults = std::mem::take(&mut primitive.faults);
    let mut attributes = Attributes { json, accessors, gather: &gather, faults };
    let material = materials.get(primitive.material).copied().unwrap_or_default();
    read_attributes(&mut primitive, &mut shape, &mut attributes, material)?;
    shape.holds = deform::holds(&mut attributes)?;
    shape.targets = deform::targets(&mut attributes, !shape.tangents.is_empty())?;
    (primitive.faults, primitive.shape) = (attributes.faults, Arc::new(shape));
    Ok(Decoded::Surface(Box::new(primitive)))
}

fn triangles(mode: Mode, corners: &[u32], token: &CancelToken) -> Result<Vec<[u32; 3]>, AccessorError> {
    let count = if mode == Mode::Triangles { corners.len() / 3 } else { corners.len().saturating_sub(2) };
    reserve_memory("the triangles of one primitive", count, size_of::<[u32; 3]>() as u64)?;
    Ok(match mode {
        Mode::Triangles => collect_cancellable(count, corners.as_chunks().0.iter().copied(), token)?,
        Mode::TriangleStrip => {
            // Every other triangle would show its back.
            let triangle = |(k, w): (usize, &[u32])| if k % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] };
            collect_cancellable(count, corners.windows(3).enumerate().map(triangle), token)?
        }
        _ => {
            let rim = corners.get(1..).unwrap_or_default();
            collect_cancellable(count, rim.windows(2).map(|w| [w[0], w[1], corners[0]]), token)?
        }
    })
}

/// If less than all `count` vertices can be in use, renumbers the corners and returns the vertices that are, in ascending order.
fn compact(triangles: &mut [[u32; 3]], count: usize, token: &CancelToken) -> Result<Option<Vec<u32>>, Cancelled> {
    let corners = triangles.as_flattened_mut();
    if corners.len() >= count {
        return Ok(None);
    }
    let mut used = collect_cancellable(corners.len(), corners.iter().copied(), token)?;
    used.sort_unstable();
    used.dedup();
    for part in corners.chunks_mut(BATCH_SIZE) {
        token.check()?;
        for corner in part {
            *corner = used.binary_search(corner).map_or(0, |place| place as u32);
        }
    }
    Ok(Some(used))
}

/// Reads normals, tangents, texture coordinates and colours.
fn read_attributes(
    primitive: &mut Primitive,
    shape: &mut Shape,
    attributes: &mut Attributes,
    material: MaterialUse,
) -> Result<(), Cancelled> {
    let gather = attributes.gather;
    let vector = |[x, y, z]: [f32; 3]| Vec3::new(x, y, z);
    let is_normal = |found: &Accessor| found.width == 3 && is_unit(found);
    if let Some(normals) = attributes.open(&Semantic::Normals, "normals", is_normal)? {
        shape.normals = gather.all(&normals, vector)?;
    }
    if material.has_normal_map
        && !shape.normals.is_empty()
        && let Some(tangents) =
            attributes.open(&Semantic::Tangents, "tangents", |found| found.width == 4 && is_unit(found))?
    {
        shape.tangents = gather.all(&tangents, Vec4::from_array)?;
    }
    let is_uv = |accessor: &Accessor| accessor.width == 2 && accessor.component != DataType::U32;
    if let Some(uvs) = attributes.open(&Semantic::TexCoords(material.uv_set), "texture coordinates", is_uv)? {
        primitive.uvs = gather.all(&uvs, Vec2::from_array)?;
    }
    if let Some(set) = material.second_uv_set
        && let Some(uvs) = attributes.open(&Semantic::TexCoords(set), "texture coordinates", is_uv)?
    {
        primitive.uvs2 = gather.all(&uvs, Vec2::from_array)?;
    }
    let is_color = |accessor: &Accessor| matches!(accessor.width, 3 | 4) && is_unit(accessor);
    if let Some(colors) = attributes.open(&Semantic::Colors(0), "colours", is_color)? {
        primitive.colors = gather.all(&colors, vector)?;
        if colors.width == 4 && material.is_cut_out {
            primitive.alphas = gather.all(&colors, |[_, _, _, alpha]| alpha)?;
        }
    }
    let sets = [material.has_texture.then_some(material.uv_set), material.second_uv_set];
    for set in sets.into_iter().flatten() {
        if attributes.json.get(&Semantic::TexCoords(set)).is_none() {
            let what = "primitives without the texture coordinates of their texture".to_owned();
            attributes.faults.push((1, what, at("attributes", &format!("no TEXCOORD_{set}"))));
        }
    }
    Ok(())
}
