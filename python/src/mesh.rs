//! Triangles from vertices and faces.

use std::sync::atomic::{AtomicUsize, Ordering};

use bvhscope_engine::cancel::LIGHT_STEPS;
use bvhscope_engine::geometry::Extent;
use bvhscope_engine::glam::{DVec3, Vec3};
use bvhscope_engine::kernel::parallel::{par_collect, par_tasks};
use bvhscope_engine::tree_file::MAX_COORDINATE;
use bvhscope_engine::{CancelToken, Triangle};
use pyo3::prelude::*;

use crate::arrays::{Floats, Integers, shape_text};
use crate::error::{Failure, value_error};

/// Most triangles: numbers of triangles are signed, of 32 bits.
const MAX_TRIANGLES: usize = i32::MAX as usize;

/// The arrays of a mesh.
pub(crate) struct Mesh {
    vertices: Floats,
    vertex_count: usize,
    /// Three numbers of vertices for each triangle; none where all triangles have their own vertices.
    faces: Option<Integers>,
    /// Number of triangles.
    count: usize,
}

/// The triangles of a mesh, less an offset.
pub(crate) struct Gathered {
    /// The triangles.
    pub(crate) triangles: Vec<Triangle>,
    /// Subtracted from all coordinates.
    pub(crate) offset: DVec3,
}

impl Mesh {
    /// The mesh of two arguments: vertices (n, 3) and faces (m, 3), or triangles (m, 3, 3).
    pub(crate) fn read(vertices: &Bound<'_, PyAny>, faces: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let (vertices, shape) = Floats::read("vertices", vertices)?;
        let (faces, vertex_count, count) = match (faces, &shape[..]) {
            (None, &[count, 3, 3]) => (None, 3 * count, count),
            (Some(faces), &[vertex_count, 3]) => {
                let (faces, shape) = Integers::read("faces", faces)?;
                let count = match shape[..] {
                    [count, 3] => count,
                    [0] => 0,
                    _ => {
                        return Err(value_error(
                            "faces",
                            format!("shape {}: give three vertices each, as (m, 3)", shape_text(&shape)),
                        ));
                    }
                };
                (Some(faces), vertex_count, count)
            }
            (None, _) => {
                let message =
                    format!("shape {}: give triangles as (m, 3, 3), or faces beside (n, 3)", shape_text(&shape));
                return Err(value_error("vertices", message));
            }
            (Some(_), _) => {
                return Err(value_error("vertices", format!("shape {}: give (n, 3) with faces", shape_text(&shape))));
            }
        };
        if count > MAX_TRIANGLES {
            return Err(value_error("faces", format!("{count} triangles: give at most {MAX_TRIANGLES}")));
        }
        Ok(Self { vertices, vertex_count, faces, count })
    }

    /// The triangles, less `offset` or, where that is not given, less the offset that they need. The arrays may change meanwhile: all
    /// that is kept was checked after it was read.
    pub(crate) fn gather(&self, offset: Option<DVec3>, token: &CancelToken) -> Result<Gathered, Failure> {
        let faces = self.faces.as_ref().map(|indices| self.checked_faces(indices, token)).transpose()?;
        let corners = |triangle: usize| match &faces {
            Some(faces) => faces[triangle].map(|vertex| vertex as usize),
            None => [3 * triangle, 3 * triangle + 1, 3 * triangle + 2],
        };
        let offset = match (offset, &self.vertices) {
            (Some(offset), _) => offset,
            (None, Floats::F32(_)) => DVec3::ZERO,
            (None, Floats::F64(_)) => self.extent(corners, token)?.offset(),
        };
        let faulty = AtomicUsize::new(usize::MAX);
        let triangles = par_collect(self.count, token, |index| {
            let [a, b, c] = corners(index).map(|vertex| self.vertex(vertex, offset));
            let triangle = Triangle { a, b, c };
            if ![a, b, c].into_iter().all(is_usable) {
                faulty.fetch_min(index, Ordering::Relaxed);
            }
            triangle
        })?;
        match faulty.into_inner() {
            usize::MAX => Ok(Gathered { triangles, offset }),
            index => Err(coordinate_fault(index, corners(index), &triangles[index])),
        }
    }

    fn vertex(&self, vertex: usize, offset: DVec3) -> Vec3 {
        let at = |axis| self.vertices.less(3 * vertex + axis, offset[axis]);
        Vec3::new(at(0), at(1), at(2))
    }

    /// The box around all corners.
    fn extent(&self, corners: impl Fn(usize) -> [usize; 3] + Sync, token: &CancelToken) -> Result<Extent, Failure> {
        let exact = |vertex: usize| DVec3::from_array([0, 1, 2].map(|axis| self.vertices.exact(3 * vertex + axis)));
        let parts = par_tasks((0..self.count).step_by(LIGHT_STEPS), token, |first, _| {
            let end = self.count.min(first + LIGHT_STEPS);
            Ok(Extent::around((first..end).flat_map(&corners).map(exact)))
        })?;
        Ok(parts.iter().fold(Extent::EMPTY, Extent::union))
    }

    /// The numbers of vertices, all of which exist.
    fn checked_faces(&self, indices: &Integers, token: &CancelToken) -> Result<Vec<[u32; 3]>, Failure> {
        let faulty = AtomicUsize::new(usize::MAX);
        let faces = par_collect(self.count, token, |face| {
            [0, 1, 2].map(|corner| {
                let index = indices.at(3 * face + corner);
                let vertex = usize::try_from(index).ok().filter(|&vertex| vertex < self.vertex_count);
                vertex.and_then(|vertex| u32::try_from(vertex).ok()).unwrap_or_else(|| {
                    faulty.fetch_min(3 * face + corner, Ordering::Relaxed);
                    0
                })
            })
        })?;
        match faulty.into_inner() {
            usize::MAX => Ok(faces),
            place => Err(Failure::Value(format!(
                "faces: row {} names vertex {}: there are {} vertices, counted from 0",
                place / 3,
                indices.at(place),
                self.vertex_count
            ))),
        }
    }
}

/// Whether the engine takes a point.
fn is_usable(point: Vec3) -> bool {
    point.to_array().into_iter().all(|coordinate| coordinate.abs() <= MAX_COORDINATE)
}

/// The fault of a triangle, one of whose vertices the engine does not take.
fn coordinate_fault(index: usize, vertices: [usize; 3], triangle: &Triangle) -> Failure {
    let corners = vertices.into_iter().zip([triangle.a, triangle.b, triangle.c]);
    let of = corners.into_iter().find(|(_, point)| !is_usable(*point));
    let (vertex, [x, y, z]) = of.map_or((vertices[0], [f32::NAN; 3]), |(vertex, point)| (vertex, point.to_array()));
    Failure::Value(format!(
        "vertices: vertex {vertex} of triangle {index} is ({x}, {y}, {z}): give finite coordinates up to 1e18, or leave the triangle out"
    ))
}
