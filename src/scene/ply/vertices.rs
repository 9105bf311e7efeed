//! The vertices of a PLY file: positions, normals and colours.

use glam::{DVec3, Vec2, Vec3};

use super::element::{Element, Encoding, Number, Property};
use super::values::Source;
use crate::scene::assemble::{BYTES_PER_VERTEX, VertexLists};
use crate::scene::error::LoadError;
use crate::scene::material::linear_from_srgb;
use crate::scene::offset::{Extent, moved};

/// Names of the properties that make a vertex. The names of colours have two older spellings.
const NAMES: [&[&str]; 12] = [
    &["x"],
    &["y"],
    &["z"],
    &["nx"],
    &["ny"],
    &["nz"],
    &["red", "r", "diffuse_red"],
    &["green", "g", "diffuse_green"],
    &["blue", "b", "diffuse_blue"],
    &["u", "s", "texture_u", "texture_s"],
    &["v", "t", "texture_v", "texture_t"],
    &["alpha"],
];

/// Measures of scans, which are no part of any scene.
const MEASURES: [&str; 8] =
    ["confidence", "intensity", "quality", "flags", "curvature", "radius", "value", "scalar_Scalar_field"];

/// The vertices read so far.
pub(super) struct Vertices {
    pub(super) positions: Vec<Vec3>,
    pub(super) lists: VertexLists,
    /// Whether texture coordinates are read: a PLY file alone has no textures.
    wants_uvs: bool,
    /// Subtracted from all coordinates.
    pub(super) offset: DVec3,
    /// The box around the positions, unless they were written in single precision.
    pub(super) extent: Extent,
}

/// The place of a property in [`NAMES`].
fn slot(property: &Property) -> Option<usize> {
    let is_named = |names: &&[&str]| names.contains(&property.name.as_str());
    NAMES.iter().position(is_named).filter(|_| property.list.is_none())
}

/// Factor from a colour in numbers of a type to one from 0 to 1.
fn color_scale(number: Number) -> f64 {
    match number {
        Number::F32 | Number::F64 => 1.0,
        Number::U16 | Number::I16 => 1.0 / 65_535.0,
        Number::U8 | Number::I8 | Number::U32 | Number::I32 | Number::U64 | Number::I64 => 1.0 / 255.0,
    }
}

impl Vertices {
    /// None, with an offset for those to come.
    pub(super) fn new(offset: DVec3, wants_uvs: bool) -> Self {
        Self { positions: Vec::new(), lists: VertexLists::default(), wants_uvs, offset, extent: Extent::EMPTY }
    }

    /// Reads all vertices.
    pub(super) fn read(&mut self, source: &mut Source, element: &Element) -> Result<(), LoadError> {
        for name in ["x", "y", "z"] {
            if element.scalar(name).is_none() {
                let problem = format!("the vertices have no property '{name}'");
                return Err(source.fault_with(problem, "export the model again with x, y and z of each vertex"));
            }
        }
        let slots: Vec<Option<usize>> = element.properties.iter().map(slot).collect();
        let has = |range: std::ops::Range<usize>| range.into_iter().all(|wanted| slots.contains(&Some(wanted)));
        let (has_normals, has_colors, has_uvs) = (has(3..6), has(6..9), self.wants_uvs && has(9..11));
        source.warn_of_unused(element, |property| match slot(property) {
            Some(3..6) => has_normals,
            Some(6..9) => has_colors,
            Some(9..11) => has_uvs,
            Some(_) => true,
            None => MEASURES.contains(&property.name.as_str()),
        });
        source.check_memory("the vertices", element.count.saturating_mul(BYTES_PER_VERTEX))?;
        let is_exact = |name| element.scalar(name).is_some_and(|property| property.number == Number::F32);
        let is_single = source.encoding != Encoding::Text && ["x", "y", "z"].into_iter().all(is_exact);
        for index in 0..element.count {
            source.poll(index)?;
            let place = source.place();
            let mut values = [0.0_f64, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
            for (property, slot) in element.properties.iter().zip(&slots) {
                match slot.and_then(|slot| values.get_mut(slot).zip(Some(slot))) {
                    Some((value, 6..9 | 11)) => *value = source.number(property.number)? * color_scale(property.number),
                    Some((value, _)) => *value = source.number(property.number)?,
                    None => source.skip_property(property)?,
                }
            }
            let [_, _, _, _, _, _, color @ .., u, v, alpha] = values;
            let [x, y, z, ..] = values;
            let position = DVec3::new(x, y, z);
            if !is_single {
                self.extent.add(position);
            }
            self.positions.push(moved(position, self.offset).as_vec3());
            let [_, _, _, nx, ny, nz, r, g, b, ..] = values.map(|value| value as f32);
            if has_normals {
                self.lists.normals.push(Vec3::new(nx, ny, nz).normalize_or_zero());
            }
            if has_uvs {
                self.lists.uvs.push(Vec2::new(u as f32, (1.0 - v) as f32));
            }
            if has_colors {
                self.lists.colors.push(linear_from_srgb(Vec3::new(r, g, b)));
                if color.iter().any(|part| !(0.0..=1.0).contains(part)) {
                    source.warn("vertices with a colour out of range, which is limited", place.clone());
                }
            }
            if alpha != 1.0 {
                source.warn("vertices with transparency, shown opaque", place);
            }
            source.end_element(element)?;
        }
        Ok(())
    }
}
