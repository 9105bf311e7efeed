//! Bounding volume hierarchies over triangles: built by approximate agglomerative clustering and by others to compare with,
//! made better, measured, checked and traced. Knows no file, scene, camera, pixel or window.

pub mod geometry;

pub mod cancel;

pub mod kernel;

pub mod tree;

pub mod settings;
pub mod stage_times;

mod order;

mod aac;

mod optimize;

pub mod builders;

pub mod wide;

pub use aac::build_cache;
