//! Ray files: rays of any program, with what it found along them and how much each counts. `docs/ray-file.md` has the format.
//!
//! [`RayReader`] streams them in chunks, from a file of this format, an array of NumPy or lines of text, and counts the rays that
//! nothing can be traced along; [`write_rays`] writes them. Knows bytes and the offset of a model; no trees.

// Numbers from files are not trusted: no arithmetic on them may wrap or panic.
#![warn(clippy::arithmetic_side_effects)]

mod error;

mod layout;

mod native;

mod npy;

mod text;

mod faults;

mod reader;

mod write;

use std::path::Path;

use bvhscope_engine::geometry::Ray;

pub use error::RayFileError;
pub use faults::{RayFault, RayFaults};
pub use layout::{MISS, RayHeader};
pub use reader::{CHUNK_RAYS, RayReader, RaySet, Seekable, append_rays};
pub use write::write_rays;

/// How names of ray files and of arrays of NumPy end.
pub const EXTENSIONS: [&str; 2] = ["rays", "npy"];

/// Whether the name is that of a file of rays; files of other names may hold rays, too.
pub fn is_ray_file(path: &Path) -> bool {
    path.extension().is_some_and(|extension| EXTENSIONS.iter().any(|known| extension.eq_ignore_ascii_case(known)))
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
    /// The triangle that another program found, [`MISS`] for none.
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
