//! The faces and triangle strips of a PLY file.

use glam::{DVec3, Vec3};

use super::element::{Element, Number, Property};
use super::values::Source;
use crate::scene::assemble::{BATCH_SIZE, BYTES_PER_TRIANGLE};
use crate::scene::error::{FileLocation, LoadError};
use crate::scene::polygon::PolygonCutter;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// An index that stands for none: indices in a file are below it, since so many vertices cannot be.
const NONE: u32 = u32::MAX;

/// A polygon of more than three corners among the triangles.
pub(super) struct Polygon {
    /// Index of the first triangle of its fan.
    pub(super) first: usize,
    /// Number of its corners, two more than that of the triangles.
    pub(super) corners: usize,
    /// Its line, or its byte in a binary file.
    pub(super) place: u64,
}

/// Triangles read so far, each with indices below the number of vertices.
pub(super) struct Faces {
    pub(super) corners: Vec<[u32; 3]>,
    /// The fans among the triangles; vertices may come after the faces, so polygons are cut once everything is read.
    pub(super) polygons: Vec<Polygon>,
    vertex_count: u64,
    /// The number of triangles for which memory was checked.
    checked: u64,
}

/// Bytes of a corner of the polygon being read, and cut.
const BYTES_PER_CORNER: u64 = 2 * (size_of::<u32>() + size_of::<DVec3>()) as u64;

/// Whether a property lists the corners of a face or strip.
fn is_corners(property: &Property) -> bool {
    property.list.is_some() && matches!(property.name.as_str(), "vertex_indices" | "vertex_index")
}

impl Faces {
    pub(super) fn new(vertex_count: u64) -> Self {
        Self { corners: Vec::new(), polygons: Vec::new(), vertex_count, checked: 0 }
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

    /// Checks that `more` triangles fit into memory, which are then in the list and in the scene. A list that outgrows what was
    /// checked doubles, and its old part is there until it is copied.
    fn check_memory(&mut self, source: &Source, more: u64) -> Result<(), LoadError> {
        const LISTED: u64 = size_of::<[u32; 3]>() as u64;
        const POLYGON: u64 = 2 * size_of::<Polygon>() as u64;
        let wanted = more.saturating_add(self.corners.len() as u64);
        if wanted > self.checked {
            let is_first = self.checked == 0;
            self.checked = if is_first { wanted } else { wanted.saturating_mul(2) };
            let each = BYTES_PER_TRIANGLE.saturating_add(if is_first { LISTED } else { 2 * LISTED });
            let polygons = (self.polygons.len() as u64).saturating_mul(POLYGON);
            source.check_memory("the faces", self.checked.saturating_mul(each).saturating_add(polygons))?;
            if is_first {
                // Where that fails the list grows as it is filled.
                let _ = self.corners.try_reserve_exact(usize::try_from(wanted).unwrap_or(usize::MAX));
            }
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
        // A polygon has two triangles less than corners, a strip as many at most.
        self.check_memory(source, length.saturating_sub(2))?;
        source.check_memory("the faces", length.saturating_mul(BYTES_PER_CORNER))?;
        polygon.clear();
        let restart = match property.number {
            Number::U8 => 255.0,
            Number::U16 => 65_535.0,
            Number::U32 => 4_294_967_295.0,
            Number::U64 => u64::MAX as f64,
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

    /// A fan from the first corner; one that misses no vertex is cut later.
    fn add_face(&mut self, source: &mut Source, polygon: &[u32], place: &FileLocation) {
        let Some((&first, rest)) = polygon.split_first().filter(|(_, rest)| rest.len() >= 2) else {
            return source.warn("faces with fewer than 3 corners skipped", place.clone());
        };
        if polygon.len() > 3 && !polygon.contains(&NONE) {
            let (FileLocation::Line(place) | FileLocation::Byte(place)) = *place else { return };
            self.polygons.push(Polygon { first: self.corners.len(), corners: polygon.len(), place });
        }
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

    /// Cuts the polygons among the triangles; in place of those that this makes fewer, [`NONE`] is left.
    pub(super) fn cut_polygons(
        &mut self,
        positions: &[Vec3],
        token: &CancelToken,
        mut warn: impl FnMut(&str, u64),
    ) -> Result<(), Cancelled> {
        let mut cutter = PolygonCutter::default();
        let (mut indices, mut points) = (Vec::new(), Vec::new());
        for (index, polygon) in self.polygons.iter().enumerate() {
            token.check_every(BATCH_SIZE, index)?;
            let end = polygon.first.saturating_add(polygon.corners).saturating_sub(2);
            let Some(fan) = self.corners.get_mut(polygon.first..end) else { continue };
            indices.clear();
            indices.extend(fan.first().into_iter().flat_map(|first| &first[..2]));
            indices.extend(fan.iter().map(|triangle| triangle[2]));
            points.clear();
            points.extend(indices.iter().filter_map(|&k| positions.get(k as usize)).map(|point| point.as_dvec3()));
            if points.len() < indices.len() || !points.iter().all(|point| point.is_finite()) {
                continue;
            }
            let cut = cutter.cut(&points, token)?;
            if let Some(flaw) = cut.flaw {
                warn(flaw, polygon.place);
            }
            if let Some(ears) = cut.ears {
                fan.fill([NONE; 3]);
                for (triangle, ear) in fan.iter_mut().zip(ears) {
                    *triangle = ear.map(|corner| indices.get(corner as usize).copied().unwrap_or(NONE));
                }
            }
        }
        Ok(())
    }
}
