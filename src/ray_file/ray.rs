//! A ray, as a file has it and in the coordinates of a scene.

use std::io::{Read, Seek};

use bvhscope_engine::geometry::Ray;

/// Rays of a chunk: 1.3 MB.
pub const CHUNK_RAYS: usize = 1 << 14;

/// A source that can be read at any place.
pub trait Seekable: Read + Seek {}
impl<S: Read + Seek> Seekable for S {}

/// A ray as a file has it.
#[derive(Debug, Clone, Copy)]
pub(super) struct RawRay {
    /// Origin, t_min, direction, t_max.
    pub(super) numbers: [f64; 8],
    pub(super) any: bool,
    pub(super) expected_triangle: Option<u32>,
    pub(super) expected_t: Option<f32>,
    pub(super) weight: f32,
    pub(super) pixel: Option<[u32; 2]>,
}

impl RawRay {
    /// A ray of six or eight numbers; `None` for others.
    pub(super) fn of_numbers(numbers: &[f64]) -> Option<Self> {
        let numbers = match *numbers {
            [x, y, z, dx, dy, dz] => [x, y, z, 0.0, dx, dy, dz, f64::INFINITY],
            _ => <[f64; 8]>::try_from(numbers).ok()?,
        };
        Some(Self { numbers, any: false, expected_triangle: None, expected_t: None, weight: 1.0, pixel: None })
    }
}

/// A ray of a file, in the coordinates of the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FileRay {
    /// Its number in the file, from 0.
    pub index: u64,
    /// The ray.
    pub ray: Ray,
    /// True for a shadow ray: any hit ends it.
    pub any: bool,
    /// How many rays it stands for.
    pub weight: f32,
    /// The triangle that another program found, [`MISS`](super::MISS) for none.
    pub expected_triangle: Option<u32>,
    /// The distance that another program found, infinite for none.
    pub expected_t: Option<f32>,
    /// Column and row of the picture that it belongs to.
    pub pixel: Option<[u32; 2]>,
}

impl FileRay {
    /// A ray that looks for the nearest hit and stands for itself.
    pub const fn new(index: u64, ray: Ray) -> Self {
        Self { index, ray, any: false, weight: 1.0, expected_triangle: None, expected_t: None, pixel: None }
    }
}
