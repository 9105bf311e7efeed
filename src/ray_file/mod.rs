//! Ray files: rays of any program, with what it found along them and how much each counts. `docs/ray-file.md` has the format.
//!
//! [`RayReader`] streams them in chunks, from a file of this format, an array of NumPy or lines of text, and counts the rays that
//! nothing can be traced along; [`write_rays`] writes them. Knows bytes and the offset of a model; no trees.

// Numbers from files are not trusted: no arithmetic on them may wrap or panic.
#![warn(clippy::arithmetic_side_effects)]

mod error;

mod layout;

mod ray;

mod native;

mod npy;

mod text;

mod faults;

mod reader;

mod write;

use std::path::Path;

pub use error::RayFileError;
pub use faults::{RayFault, RayFaults};
pub use layout::{MISS, RayHeader};
pub use ray::{CHUNK_RAYS, FileRay, Seekable};
pub use reader::{RayReader, RaySet, append_rays};
pub use write::write_rays;

/// How names of ray files and of arrays of NumPy end.
pub const EXTENSIONS: [&str; 2] = ["rays", "npy"];

/// Whether the name is that of a file of rays; files of other names may hold rays, too.
pub fn is_ray_file(path: &Path) -> bool {
    path.extension().is_some_and(|extension| EXTENSIONS.iter().any(|known| extension.eq_ignore_ascii_case(known)))
}
