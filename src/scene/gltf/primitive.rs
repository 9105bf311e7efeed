//! Decodes mesh primitives into triangles and attributes in mesh space.
//!
//! Only vertices that triangles refer to are read, so that the work is bounded by the number of corners even if many primitives
//! share one long list of vertices.

use glam::{Vec2, Vec3};

use super::accessor::{Accessor, AccessorError, Accessors, Component, WRONG_TYPE};
use super::document::Fault;
use super::json::Whole;
use super::schema::Primitive as JsonPrimitive;
use crate::budget::Budget;
use crate::scene::assemble::{BATCH_SIZE, BYTES_PER_VERTEX, collect_cancellable};
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// A decoded primitive in mesh space.
#[derive(Default)]
pub(super) struct Primitive {
    pub(super) positions: Vec<Vec3>,
    /// Normals; as the other attributes empty or as long as `positions`.
    pub(super) normals: Vec<Vec3>,
    pub(super) uvs: Vec<Vec2>,
    pub(super) uvs2: Vec<Vec2>,
    pub(super) colors: Vec<Vec3>,
    /// Vertex indices of each triangle, all in range.
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) material: usize,
    /// What is missing of it: the number, the kind, and the place in the primitive with details.
    pub(super) faults: Vec<(u64, String, String)>,
}

/// What a primitive needs to know of its material.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct MaterialUse {
    /// The set of texture coordinates.
    pub(super) uv_set: u64,
    /// The set of its other textures, if there is a second one.
    pub(super) second_uv_set: Option<u64>,
    pub(super) has_texture: bool,
}

/// How corners form triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mode {
    Triangles,
    Strip,
    Fan,
}

/// What a primitive consists of.
pub(super) enum Decoded {
    /// Triangles.
    Surface(Primitive),
    /// Points or lines, this many vertices.
    Points(u64),
}

impl Primitive {
    /// Whether vertices have more than a position.
    pub(super) fn has_attributes(&self) -> bool {
        !(self.normals.is_empty() && self.uvs.is_empty() && self.uvs2.is_empty() && self.colors.is_empty())
    }
}

/// Number of triangles that a primitive declares; 0 if its corners cannot be read.
pub(super) fn declared_triangles(
    json: &JsonPrimitive,
    accessors: &Accessors,
    token: &CancelToken,
) -> Result<u64, Cancelled> {
    let corners = json.indices.map(Whole::get).or_else(|| json.attributes.get("POSITION"));
    let corners = match corners.map(|index| accessors.open(index, token)) {
        Some(Ok(accessor)) => accessor.count as u64,
        Some(Err(AccessorError::Cancelled(cancelled))) => return Err(cancelled),
        Some(Err(AccessorError::Unreadable(_))) | None => 0,
    };
    Ok(match json.mode.map_or(4, |mode| mode.0) {
        4 => corners / 3,
        5 | 6 => corners.saturating_sub(2),
        _ => 0,
    })
}

/// Decodes a primitive. The last of `materials` is the default one.
pub(super) fn read(
    json: &JsonPrimitive,
    accessors: &Accessors,
    materials: &[MaterialUse],
    token: &CancelToken,
) -> Result<Decoded, AccessorError> {
    let position = json.attributes.get("POSITION");
    let mode = match json.mode.map_or(4, |mode| mode.0) {
        4 => Mode::Triangles,
        5 => Mode::Strip,
        6 => Mode::Fan,
        0..=3 => return Ok(Decoded::Points(position.map_or(0, |index| accessors.declared(index)))),
        mode => return Err(Fault::new("an unknown mode", format!("mode {mode} is none of 0 to 6")).into()),
    };
    let mut primitive = Primitive::default();
    let Some(position) = position else {
        let detail = match json.extensions.draco {
            Some(_) => format!("it is compressed by Draco; {}", super::advice::UNPACK),
            None => "it has no POSITION".to_owned(),
        };
        return Err(Fault::new("no positions", detail).into());
    };
    let positions = accessors.open(position, token)?;
    let shape = |accessor: &Accessor| [accessor.width, accessor.component.size().saturating_mul(8)];
    if positions.width != 3 || positions.component == Component::U32 {
        let [width, bits] = shape(&positions);
        let detail = format!("POSITION has {width} components of {bits} bits instead of 3 floats");
        return Err(Fault::new(WRONG_TYPE, detail).into());
    }
    let what = "the indices of one primitive";
    let corners: Vec<u32> = if let Some(index) = json.indices {
        let indices = accessors.open_indices(index.get(), token)?;
        reserve_memory(what, indices.count, size_of::<u32>() as u64)?;
        collect_cancellable(indices.count, (0..indices.count).map(|k| indices.vertex_index(k)), token)?
    } else {
        reserve_memory(what, positions.count, size_of::<u32>() as u64)?;
        collect_cancellable(positions.count, (0..positions.count).map(|k| k as u32), token)?
    };
    let place = if json.indices.is_some() { "indices" } else { "attributes.POSITION" };
    let left_over = match mode {
        Mode::Triangles => corners.len() % 3,
        Mode::Strip | Mode::Fan => Some(corners.len()).filter(|&length| length < 3).unwrap_or(0),
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
    primitive.positions = gather.all(&positions, |[x, y, z, _]| Vec3::new(x, y, z))?;
    let fallback = materials.len().saturating_sub(1);
    primitive.material = json.material.map_or(fallback, Whole::get);
    if primitive.material > fallback || (json.material.is_some() && primitive.material == fallback) {
        let detail = format!("materials[{}] does not exist, there are {fallback}", primitive.material);
        primitive.faults.push((
            1,
            "primitives whose material does not exist shown in clay".to_owned(),
            at("material", &detail),
        ));
        primitive.material = fallback;
    }
    read_attributes(&mut primitive, json, accessors, materials, &gather)?;
    Ok(Decoded::Surface(primitive))
}

/// A place in a primitive with what is wrong there.
fn at(place: &str, detail: &str) -> String {
    if detail.is_empty() { place.to_owned() } else { format!("{place}: {detail}") }
}

fn reserve_memory(what: &str, count: usize, size: u64) -> Result<(), Fault> {
    let bytes = (count as u64).saturating_mul(size);
    Budget::of_process().check(what, bytes).map_err(|error| Fault::new("too little memory", error.to_string()))
}

fn triangles(mode: Mode, corners: &[u32], token: &CancelToken) -> Result<Vec<[u32; 3]>, AccessorError> {
    let count = if mode == Mode::Triangles { corners.len() / 3 } else { corners.len().saturating_sub(2) };
    reserve_memory("the triangles of one primitive", count, size_of::<[u32; 3]>() as u64)?;
    Ok(match mode {
        Mode::Triangles => collect_cancellable(count, corners.as_chunks().0.iter().copied(), token)?,
        Mode::Strip => {
            // Every other triangle would show its back.
            let triangle = |(k, w): (usize, &[u32])| if k % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] };
            collect_cancellable(count, corners.windows(3).enumerate().map(triangle), token)?
        }
        Mode::Fan => {
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

/// Reads the elements of the vertices in use.
struct Gather<'a> {
    /// The vertices in use; `None` for all.
    used: Option<&'a [u32]>,
    /// Number of vertices in the file.
    count: usize,
    token: &'a CancelToken,
}

impl Gather<'_> {
    fn len(&self) -> usize {
        self.used.map_or(self.count, <[u32]>::len)
    }

    fn all<T>(&self, accessor: &Accessor, convert: impl Fn([f32; 4]) -> T) -> Result<Vec<T>, Cancelled> {
        let index = |k: usize| self.used.map_or(k, |used| used[k] as usize);
        collect_cancellable(self.len(), (0..self.len()).map(|k| convert(accessor.element(index(k)))), self.token)
    }
}

/// Reads normals, texture coordinates and colours; those that cannot be read are left out with a warning.
fn read_attributes(
    primitive: &mut Primitive,
    json: &JsonPrimitive,
    accessors: &Accessors,
    materials: &[MaterialUse],
    gather: &Gather,
) -> Result<(), Cancelled> {
    let mut faults = Vec::new();
    let mut optional = |name: &str, what: &str, accepts: &dyn Fn(&Accessor) -> bool| {
        let Some(index) = json.attributes.get(name) else { return Ok(None) };
        let fault = match accessors.open(index, gather.token) {
            Err(AccessorError::Cancelled(cancelled)) => return Err(cancelled),
            Err(AccessorError::Unreadable(fault)) => fault,
            Ok(accessor) if !accepts(&accessor) => {
                let kind = if accessor.normalized { "normalised" } else { "plain" };
                let detail = format!("{} {kind} {:?} each", accessor.width, accessor.component);
                Fault::new(WRONG_TYPE, format!("accessors[{index}]: {detail}"))
            }
            Ok(accessor) if accessor.count < gather.count => {
                let detail = format!("accessors[{index}]: {} for {} vertices", accessor.count, gather.count);
                Fault::new("fewer than vertices", detail)
            }
            Ok(accessor) => {
                if accessor.count > gather.count {
                    let detail = format!("{} for {} vertices", accessor.count, gather.count);
                    let what = format!("primitives with more {what} than vertices");
                    faults.push((1, what, at(&format!("attributes.{name}"), &detail)));
                }
                return Ok(Some(accessor));
            }
        };
        let what = format!("primitives shown without {what}: {}", fault.kind);
        faults.push((1, what, at(&format!("attributes.{name}"), &fault.detail)));
        Ok(None)
    };
    let is_float = |accessor: &Accessor| accessor.component == Component::F32;
    let is_unit = |accessor: &Accessor| is_float(accessor) || accessor.normalized;
    let normals = optional("NORMAL", "normals", &|accessor| accessor.width == 3 && is_unit(accessor))?;
    let material = materials.get(primitive.material).copied().unwrap_or_default();
    let uv_name = |set: u64| format!("TEXCOORD_{set}");
    let is_uv = |accessor: &Accessor| accessor.width == 2 && accessor.component != Component::U32;
    let uvs = optional(&uv_name(material.uv_set), "texture coordinates", &is_uv)?;
    let uvs2 = match material.second_uv_set {
        Some(set) => optional(&uv_name(set), "texture coordinates", &is_uv)?,
        None => None,
    };
    let colors = optional("COLOR_0", "colours", &|accessor| matches!(accessor.width, 3 | 4) && is_unit(accessor))?;
    let vector = |[x, y, z, _]: [f32; 4]| Vec3::new(x, y, z);
    if let Some(accessor) = normals {
        primitive.normals = gather.all(&accessor, vector)?;
    }
    if let Some(accessor) = uvs {
        primitive.uvs = gather.all(&accessor, |[u, v, _, _]| Vec2::new(u, v))?;
    }
    if let Some(accessor) = uvs2 {
        primitive.uvs2 = gather.all(&accessor, |[u, v, _, _]| Vec2::new(u, v))?;
    }
    if let Some(accessor) = colors {
        primitive.colors = gather.all(&accessor, vector)?;
    }
    let sets = [material.has_texture.then_some(material.uv_set), material.second_uv_set];
    for name in sets.into_iter().flatten().map(uv_name) {
        if json.attributes.get(&name).is_none() {
            let what = "primitives without the texture coordinates of their texture".to_owned();
            faults.push((1, what, at("attributes", &format!("no {name}"))));
        }
    }
    let unknown = |name: &&str| {
        let stem = name.split_once('_').map_or(*name, |(stem, _)| stem);
        let known = ["POSITION", "NORMAL", "TANGENT", "TEXCOORD", "COLOR", "JOINTS", "WEIGHTS"];
        // Names of applications start with a line, those of extensions with their prefix and a colon.
        !stem.is_empty() && !name.contains(':') && !known.contains(&stem)
    };
    let mut others = json.attributes.0.iter().map(|(name, _)| name.as_str()).filter(unknown);
    if let Some(name) = others.next() {
        let count = others.count().saturating_add(1) as u64;
        let detail = crate::text::quoted(name);
        faults.push((count, "attributes of unknown names ignored".to_owned(), at("attributes", &detail)));
    }
    primitive.faults.append(&mut faults);
    Ok(())
}
