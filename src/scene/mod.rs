//! Scenes: triangles with materials and attributes, from model files (one format a module) and from built-in generators.
//!
//! Knows nothing of trees, cameras, pixels or windows. Start at [`load()`], then read [`Scene`]; a new file format gets a
//! module of its own, a row in [`FILE_FORMATS`] and an arm in `load.rs`.

// Numbers from files are not trusted: no arithmetic on them may wrap or panic.
#![warn(clippy::arithmetic_side_effects)]

#[allow(clippy::arithmetic_side_effects, reason = "sizes of lists in memory")]
mod attributes;

mod error;

mod material;

mod source;

mod model;

#[allow(clippy::arithmetic_side_effects, reason = "numbers of triangles that were added up within 32 bits, and floats")]
mod scene_copies;

#[allow(clippy::arithmetic_side_effects, reason = "indices of a list, and sums that stop at the largest number")]
mod unfolded;

mod unfold;

mod file_camera;

mod file_light;

mod format;

mod gzip;

mod options;

mod load;

mod read;

#[allow(clippy::arithmetic_side_effects, reason = "indices of a map of fixed size, and floats")]
mod interior;

#[allow(clippy::arithmetic_side_effects, reason = "floats, and indices of lists that were checked when they were made")]
mod motion;

mod row;

#[allow(clippy::arithmetic_side_effects, reason = "floats, vectors, and sizes of lists in memory")]
mod sequence;

mod subject;

mod recognise;

mod offset;

mod assemble;

#[allow(clippy::arithmetic_side_effects, reason = "sizes of lists in memory, which were checked, and vectors")]
mod flatten;

#[allow(clippy::arithmetic_side_effects, reason = "indices of lists in memory, whose sizes were checked, and vectors")]
mod spread;

#[allow(clippy::arithmetic_side_effects, reason = "a sum of 64 bits of lengths of 32")]
mod placed_meshes;

mod two_levels;

mod moving_copies;
mod moving_place;

#[allow(clippy::arithmetic_side_effects, reason = "indices of triangles that exist, and vectors")]
mod smooth;

mod images;
#[cfg(any(feature = "ktx2", test))]
mod ktx2;

#[allow(clippy::arithmetic_side_effects, reason = "sizes of an image that was decoded, and floats")]
mod bump;

#[allow(clippy::arithmetic_side_effects, reason = "vectors, and indices of corners that exist")]
mod polygon;

mod exponents;

mod numbers;

mod obj;

mod gltf;

mod ply;

mod stl;

mod pbrt;

mod tree_file;

#[allow(clippy::arithmetic_side_effects, reason = "reads no file; sizes are clamped to the limits in BUILTIN_SCENES")]
mod builtin;

pub use attributes::Attributes;
pub use error::{FileLocation, LoadError, Warning, Warnings};
pub use file_camera::FileCamera;
pub use file_light::FileLight;
pub use format::{FILE_FORMATS, FileFormat, FormatInfo, format_names, model_extensions};
pub use interior::Interior;
pub use load::{load, load_bytes};
pub use material::{Material, Texture, WrapMode};
pub use model::Scene;
pub use motion::{Clip, Moment, Motion, Pose};
pub(crate) use offset::Extent;
pub use offset::{from_file, to_file};
pub use options::{Instancing, LoadOptions};
pub(crate) use read::read_file;
pub use row::FileRow;
pub use scene_copies::{SceneCopies, SceneMeshes};
pub use sequence::FRAMES_PER_SECOND;
pub use smooth::{CornerNormals, SmoothNormals};
pub use source::{BUILTIN_SCENES, BuiltinScene, SceneSource};
pub use tree_file::is_tree_alone;
pub use unfolded::{CopyRanges, UnfoldedCopies};
