//! Faces of an OBJ file: corners resolved and checked, polygons into fans of triangles.

use std::collections::HashMap;

use glam::{Vec2, Vec3};

use super::super::assemble::{AllocationError, Assembly, MAX_COORDINATE};
use super::super::error::FileLocation;
use super::statement::Statement;
use bvhscope_engine::geometry::Triangle;

/// Bytes of an entry that finds a vertex by its indices, in a table that is half full.
pub(super) const BYTES_PER_KEY: u64 = 2 * size_of::<([u32; 3], u32)>() as u64;

/// What the indices of a face refer to.
pub(super) struct Lists<'a> {
    pub(super) positions: &'a [Vec3],
    /// Linear colours of the first positions.
    pub(super) colors: &'a [Vec3],
    pub(super) texcoords: &'a [Vec2],
    pub(super) normals: &'a [Vec3],
}

/// An index as it stands in a face.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Index {
    /// There is none, as between the slashes of `1//2`.
    Absent,
    /// Counted from 0.
    At(u32),
    /// A whole number out of range.
    OutOfRange,
    NotANumber,
}

/// Indices of a corner from 0; texture coordinate and normal may be absent or wrong.
type Corner = (u32, Index, Index);

/// A point with the index of its attributes in the scene.
type Vertex = (Vec3, Option<u32>);

/// Which attributes the corners of a face have.
#[derive(Clone, Copy)]
struct Coverage {
    some: bool,
    all: bool,
    out_of_range: bool,
}

impl Coverage {
    const START: Self = Self { some: false, all: true, out_of_range: false };

    fn add(&mut self, index: Index) {
        let is_there = matches!(index, Index::At(_));
        self.some |= index != Index::Absent;
        self.all &= is_there;
        self.out_of_range |= matches!(index, Index::OutOfRange | Index::NotANumber);
    }
}

/// Reads faces.
pub(super) struct Faces {
    /// Corners of the face being read.
    corners: Vec<Corner>,
    /// Whether one of them has more than three indices.
    has_more: bool,
    /// Vertices of the scene by position (where it has a colour), texture coordinate and normal, counted from 1.
    vertices: HashMap<[u32; 3], u32>,
    /// Whether the next face begins an object or group.
    object_open: bool,
}

impl Default for Faces {
    fn default() -> Self {
        Self { corners: Vec::new(), has_more: false, vertices: HashMap::new(), object_open: true }
    }
}

impl Faces {
    /// The next face is the first of an object or group.
    pub(super) fn begin_object(&mut self) {
        self.object_open = true;
    }

    /// Number of different vertices with attributes so far.
    pub(super) fn vertex_count(&self) -> usize {
        self.vertices.len()
    }

    /// Appends the triangles of a face, or counts why it is skipped.
    pub(super) fn read(
        &mut self,
        statement: &Statement<'_>,
        lists: &Lists<'_>,
        material: u32,
        assembly: &mut Assembly,
    ) -> Result<(), AllocationError> {
        let location = || FileLocation::Line(statement.line);
        let (texcoords, normals) = match self.read_corners(statement, lists) {
            Ok(coverage) => coverage,
            Err(skipped) => {
                assembly.warnings.add(skipped, location);
                return Ok(());
            }
        };
        for (coverage, kinds) in [(texcoords, &TEXCOORD_FLAWS), (normals, &NORMAL_FLAWS)] {
            if coverage.out_of_range {
                assembly.warnings.add(kinds[0], location);
            } else if coverage.some && !coverage.all {
                assembly.warnings.add(kinds[1], location);
            }
        }
        if self.has_more {
            assembly
                .warnings
                .add("faces with more than 3 indices at a corner, of which the rest is not used", location);
        }
        let begins = std::mem::take(&mut self.object_open);
        assembly.mesh_count = assembly.mesh_count.saturating_add(usize::from(begins));
        assembly.reserve(self.corners.len().saturating_sub(2))?;
        let corners = std::mem::take(&mut self.corners);
        let mut fan: Option<(Vertex, Vertex)> = None;
        let mut first: Option<Vertex> = None;
        for &(position, texcoord, normal) in &corners {
            let texcoord = if texcoords.all { texcoord } else { Index::Absent };
            let normal = if normals.all { normal } else { Index::Absent };
            let point = lists.positions.get(position as usize).copied().unwrap_or_default();
            let vertex = (point, self.vertex(position, texcoord, normal, lists, assembly));
            // Triangles of the first corner and each two that follow one another.
            if let Some((a, b)) = fan {
                let indices = match (a.1, b.1, vertex.1) {
                    (Some(0), Some(0), Some(0)) => None,
                    (Some(a), Some(b), Some(c)) => Some([a, b, c]),
                    _ => None,
                };
                assembly.push(Triangle { a: a.0, b: b.0, c: vertex.0 }, indices, material, location);
            }
            fan = first.map(|first| (first, vertex));
            first = first.or(Some(vertex));
        }
        self.corners = corners;
        Ok(())
    }

    /// The vertex of the scene with these attributes: 0 if there are none, `None` if there are too many vertices.
    fn vertex(
        &mut self,
        position: u32,
        texcoord: Index,
        normal: Index,
        lists: &Lists<'_>,
        assembly: &mut Assembly,
    ) -> Option<u32> {
        let at = |index: Index| if let Index::At(index) = index { Some(index) } else { None };
        let (texcoord, normal) = (at(texcoord), at(normal));
        let color = lists.colors.get(position as usize).copied();
        let key = [color.map(|_| position), texcoord, normal].map(|index| index.map_or(0, |k| k.saturating_add(1)));
        if key == [0; 3] {
            return Some(0);
        }
        if let Some(&known) = self.vertices.get(&key) {
            return Some(known);
        }
        let uv = texcoord.and_then(|index| lists.texcoords.get(index as usize).copied());
        let normal = normal.and_then(|index| lists.normals.get(index as usize).copied());
        let made = assembly.add_vertex(normal, uv, color)?;
        self.vertices.insert(key, made);
        Some(made)
    }

    /// Reads the corners of a face and which of them have texture coordinates and normals; `Err` says why it is skipped.
    fn read_corners(
        &mut self,
        statement: &Statement<'_>,
        lists: &Lists<'_>,
    ) -> Result<(Coverage, Coverage), &'static str> {
        self.corners.clear();
        self.has_more = false;
        let (mut texcoords, mut normals) = (Coverage::START, Coverage::START);
        let mut is_unusable = false;
        for word in statement.words() {
            let mut parts = word.split(|&byte| byte == b'/');
            let mut index = |count: usize| parts.next().map_or(Index::Absent, |part| resolve(part, count));
            let position = match index(lists.positions.len()) {
                Index::At(position) => position,
                Index::OutOfRange => return Err("faces with a vertex that does not exist (yet) skipped"),
                Index::Absent | Index::NotANumber => {
                    return Err("faces with a corner that is not a whole number skipped");
                }
            };
            let point = lists.positions.get(position as usize).copied().unwrap_or(Vec3::NAN);
            is_unusable |= !point.is_finite() || point.abs().max_element() > MAX_COORDINATE;
            let (texcoord, normal) = (index(lists.texcoords.len()), index(lists.normals.len()));
            texcoords.add(texcoord);
            normals.add(normal);
            self.has_more |= parts.next().is_some();
            self.corners.push((position, texcoord, normal));
        }
        if is_unusable {
            return Err("faces with coordinates that are not numbers or beyond 1e18 skipped");
        }
        if self.corners.len() < 3 {
            return Err("faces with fewer than 3 corners skipped");
        }
        Ok((texcoords, normals))
    }
}

/// Warnings about texture coordinates that are out of range, and that only some corners have.
const TEXCOORD_FLAWS: [&str; 2] = [
    "faces with a texture coordinate that does not exist (yet) drawn without any",
    "faces with texture coordinates at some of their corners drawn without any",
];

/// Warnings about normals that are out of range, and that only some corners have.
const NORMAL_FLAWS: [&str; 2] = [
    "faces with a normal that does not exist (yet) drawn flat",
    "faces with normals at some of their corners drawn flat",
];

/// Resolves an index counted from 1, or from the end if negative, into a list of `count`.
fn resolve(part: &[u8], count: usize) -> Index {
    if part.is_empty() {
        return Index::Absent;
    }
    let Some(index) = std::str::from_utf8(part).ok().and_then(|text| text.parse::<i64>().ok()) else {
        let digits = part.strip_prefix(b"-").or_else(|| part.strip_prefix(b"+")).unwrap_or(part);
        let is_whole = !digits.is_empty() && digits.iter().all(u8::is_ascii_digit);
        return if is_whole { Index::OutOfRange } else { Index::NotANumber };
    };
    let from_start = match index {
        1.. => index.checked_sub(1),
        _ => i64::try_from(count).ok().and_then(|count| count.checked_add(index)).filter(|_| index < 0),
    };
    let found = from_start.and_then(|index| u32::try_from(index).ok()).filter(|&index| (index as usize) < count);
    found.map_or(Index::OutOfRange, Index::At)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_index_wraps() {
        for (text, expected) in [
            ("1", Index::At(0)),
            ("+5", Index::At(4)),
            ("-1", Index::At(4)),
            ("-5", Index::At(0)),
            ("", Index::Absent),
            ("0", Index::OutOfRange),
            ("-0", Index::OutOfRange),
            ("6", Index::OutOfRange),
            ("-6", Index::OutOfRange),
            ("4294967296", Index::OutOfRange),
            ("4294967297", Index::OutOfRange),
            ("-4294967297", Index::OutOfRange),
            ("9223372036854775807", Index::OutOfRange),
            ("9223372036854775808", Index::OutOfRange),
            ("-9223372036854775808", Index::OutOfRange),
            ("18446744073709551617", Index::OutOfRange),
            ("1.0", Index::NotANumber),
            ("1e3", Index::NotANumber),
            ("x", Index::NotANumber),
            ("-", Index::NotANumber),
            ("--1", Index::NotANumber),
        ] {
            assert!(resolve(text.as_bytes(), 5) == expected, "{text}");
        }
    }
}
