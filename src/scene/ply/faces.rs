//! The faces and triangle strips of a PLY file.

use super::element::{Element, Number, Property};
use super::values::Source;
use crate::scene::assemble::BYTES_PER_TRIANGLE;
use crate::scene::error::{FileLocation, LoadError};

/// An index that stands for none: indices in a file are below it, since so many vertices cannot be.
const NONE: u32 = u32::MAX;

/// Triangles read so far, each with indices below the number of vertices.
pub(super) struct Faces {
    pub(super) corners: Vec<[u32; 3]>,
    vertex_count: u64,
    /// The number of triangles for which memory was checked.
    checked: u64,
}

/// Whether a property lists the corners of a face or strip.
fn is_corners(property: &Property) -> bool {
    property.list.is_some() && matches!(property.name.as_str(), "vertex_indices" | "vertex_index")
}

impl Faces {
    pub(super) fn new(vertex_count: u64) -> Self {
        Self { corners: Vec::new(), vertex_count, checked: 0 }
    }

    /// Reads all faces or strips.
    pub(super) fn read(&mut self, source: &mut Source, element: &Element) -> Result<(), LoadError> {
        let is_strip = element.name == "tristrips";
        if element.properties.iter().any(is_corners) {
            source.warn_of_unused(element, |property| is_corners(property) || property.name == "flags");
        } else {
            let what = "faces without a list 'vertex_indices' skipped";
            source.warnings.add_many(element.count, what, || FileLocation::Line(element.line));
        }
        self.check_memory(source, element.count)?;
        let mut polygon: Vec<u32> = Vec::new();
        for index in 0..element.count {
            source.poll(index)?;
            for property in &element.properties {
                if !is_corners(property) {
                    source.skip_property(property)?;
                    continue;
                }
                let place = source.place();
                self.polygon(source, property, is_strip, &mut polygon)?;
                if is_strip {
                    self.add_strips(source, &polygon, &place);
                } else {
                    self.add_face(source, &polygon, &place);
                }
            }
            source.end_element(element)?;
        }
        Ok(())
    }

    /// Checks that `more` triangles fit into memory, which are then in the list and in the scene; the list doubles as it grows.
    fn check_memory(&mut self, source: &Source, more: u64) -> Result<(), LoadError> {
        const BYTES_PER_FACE: u64 = 2 * size_of::<[u32; 3]>() as u64 + BYTES_PER_TRIANGLE;
        let wanted = more.saturating_add(self.corners.len() as u64);
        if wanted > self.checked {
            self.checked = if self.checked == 0 { wanted } else { wanted.saturating_mul(2) };
            source.check_memory("the faces", self.checked.saturating_mul(BYTES_PER_FACE))?;
        }
        Ok(())
    }

    /// Reads a list of corners. One that is no vertex becomes [`NONE`], and so does the end of a strip.
    fn polygon(
        &mut self,
        source: &mut Source,
        property: &Property,
        is_strip: bool,
        polygon: &mut Vec<u32>,
    ) -> Result<(), LoadError> {
        let length = property.list.map_or(Ok(0), |count| source.list_length(count))?;
        self.check_memory(source, length)?;
        polygon.clear();
        let restart = match property.number {
            Number::U8 => 255.0,
            Number::U16 => 65_535.0,
            Number::U32 => 4_294_967_295.0,
            _ => -1.0,
        };
        for k in 1..=length {
            source.poll(k)?;
            let place = source.place();
            let corner = source.number(property.number)?;
            let is_end = is_strip && (corner == -1.0 || corner == restart && corner >= self.vertex_count as f64);
            let is_vertex = corner >= 0.0 && corner < self.vertex_count as f64 && corner.fract() == 0.0;
            if !is_vertex && !is_end {
                let is_whole = corner.fract() == 0.0;
                let range = "indices out of range: triangles left out";
                let what = if is_whole { range } else { "indices with a fraction: triangles left out" };
                source.warn(what, place);
            }
            // A strip has no triangle across an index that is no vertex, and none across its end.
            polygon.push(if is_vertex { u32::try_from(corner as u64).unwrap_or(NONE) } else { NONE });
        }
        Ok(())
    }

    /// A fan from the first corner.
    fn add_face(&mut self, source: &mut Source, polygon: &[u32], place: &FileLocation) {
        let Some((&first, rest)) = polygon.split_first().filter(|(_, rest)| rest.len() >= 2) else {
            return source.warn("faces with fewer than 3 corners skipped", place.clone());
        };
        let triangles = rest.windows(2).map(|pair| [first, pair[0], pair[1]]);
        self.corners.extend(triangles.filter(|corners| !corners.contains(&NONE)));
    }

    fn add_strips(&mut self, source: &mut Source, polygon: &[u32], place: &FileLocation) {
        for strip in polygon.split(|&corner| corner == NONE) {
            if matches!(strip.len(), 1 | 2) {
                source.warn("strips with fewer than 3 corners skipped", place.clone());
            }
            for (k, window) in strip.windows(3).enumerate() {
                let [a, b, c] = [window[0], window[1], window[2]];
                // Equal corners join the parts of a strip.
                if a != b && b != c && c != a {
                    self.corners.push(if k % 2 == 0 { [a, b, c] } else { [b, a, c] });
                }
            }
        }
    }
}
