//! Rays and points from arrays, and results as arrays of their shape.

use bvhscope_engine::Ray;
use bvhscope_engine::glam::{DVec3, Vec3};
use numpy::{Element, PyArray1, PyArrayMethods};
use pyo3::prelude::*;

use crate::arrays::{Floats, Shape, shape_text};
use crate::error::value_error;

/// Points or directions: an array whose last axis has three coordinates.
pub(crate) struct Points {
    coordinates: Floats,
    /// The axes before the last: none for a single point.
    pub(crate) shape: Shape,
}

impl Points {
    /// The points of the argument `field`.
    pub(crate) fn read(field: &str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let (coordinates, mut shape) = Floats::read(field, value)?;
        if shape.last() != Some(&3) {
            let found = shape_text(&shape);
            return Err(value_error(field, format!("shape {found}: give x, y, z along the last axis, as in (n, 3)")));
        }
        shape.pop();
        Ok(Self { coordinates, shape })
    }

    /// Number of points.
    pub(crate) fn count(&self) -> usize {
        self.shape.iter().product()
    }

    /// The point at `index` less `offset`.
    #[inline(always)]
    pub(crate) fn less(&self, index: usize, offset: DVec3) -> Vec3 {
        let at = |axis| self.coordinates.less(3 * index + axis, offset[axis]);
        Vec3::new(at(0), at(1), at(2))
    }
}

/// One limit for all rays, or one for each.
enum Limits {
    Same(f32),
    Each(Floats),
}

impl Limits {
    fn read(field: &str, value: &Bound<'_, PyAny>, shape: &[usize]) -> PyResult<Self> {
        if let Ok(limit) = value.extract::<f64>() {
            return Ok(Self::Same(limit as f32));
        }
        let (limits, found) = Floats::read(field, value)?;
        if found == shape {
            return Ok(Self::Each(limits));
        }
        let (found, shape) = (shape_text(&found), shape_text(shape));
        Err(value_error(
            field,
            format!("shape {found}: give one number, or an array of the shape of the rays, {shape}"),
        ))
    }

    #[inline(always)]
    fn at(&self, index: usize) -> f32 {
        match self {
            Self::Same(limit) => *limit,
            Self::Each(limits) => limits.less(index, 0.0),
        }
    }
}

/// Rays: as many origins as directions, or one of either for all.
pub(crate) struct Rays {
    origins: Points,
    directions: Points,
    t_min: Limits,
    t_max: Limits,
    /// Shape of the results.
    pub(crate) shape: Shape,
}

impl Rays {
    /// The rays of four arguments.
    pub(crate) fn read(
        origins: &Bound<'_, PyAny>,
        directions: &Bound<'_, PyAny>,
        t_min: &Bound<'_, PyAny>,
        t_max: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let (origins, directions) = (Points::read("origins", origins)?, Points::read("directions", directions)?);
        let shape = if origins.shape == directions.shape || directions.shape.is_empty() {
            origins.shape.clone()
        } else if origins.shape.is_empty() {
            directions.shape.clone()
        } else {
            let [from, along] = [&origins, &directions].map(|points| shape_text(&[&points.shape[..], &[3]].concat()));
            let message = format!("shape {along} with origins of shape {from}: give as many of both, or one of either");
            return Err(value_error("directions", message));
        };
        let (t_min, t_max) = (Limits::read("t_min", t_min, &shape)?, Limits::read("t_max", t_max, &shape)?);
        Ok(Self { origins, directions, t_min, t_max, shape })
    }

    /// Number of rays.
    pub(crate) fn count(&self) -> usize {
        self.shape.iter().product()
    }

    /// The ray at `index` in a tree whose coordinates are less by `offset`.
    #[inline(always)]
    pub(crate) fn ray(&self, index: usize, offset: DVec3) -> Ray {
        let of = |points: &Points| if points.shape.is_empty() { 0 } else { index };
        Ray {
            origin: self.origins.less(of(&self.origins), offset),
            direction: self.directions.less(of(&self.directions), DVec3::ZERO),
            t_min: self.t_min.at(index),
            t_max: self.t_max.at(index),
        }
    }
}

/// `numbers` as an array, which takes their memory: of the axes in `shape`, followed by one of `last` numbers unless that is 1.
pub(crate) fn shaped<'py, T: Element>(
    py: Python<'py>,
    numbers: Vec<T>,
    shape: &[usize],
    last: usize,
) -> PyResult<Bound<'py, PyAny>> {
    let array = PyArray1::from_vec(py, numbers);
    if shape.len() == 1 && last == 1 {
        return Ok(array.into_any());
    }
    let axes = if last == 1 { shape.to_vec() } else { [shape, &[last]].concat() };
    Ok(array.reshape(axes)?.into_any())
}
