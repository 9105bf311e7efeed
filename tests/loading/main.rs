//! Reading models: sound, damaged and hostile files of every format, and the built-in scenes.

#![allow(clippy::pedantic, reason = "tests and measurements may be plainer than the libraries")]
#![allow(clippy::unwrap_used, reason = "a failed step is a failed test")]

#[path = "../../engine/tests/engine/random.rs"]
mod random;
#[path = "../support/sound_gltf.rs"]
mod sound_gltf;
#[path = "../support/mod.rs"]
mod support;

mod builtin_scenes;
mod entry_points;
mod formats;
mod gltf_compressed;
mod gltf_fields;
mod gltf_geometry;
mod gltf_motion;
mod gltf_oracle;
mod gltf_places;
mod gltf_second_opinion;
mod gltf_warnings;
#[cfg(target_os = "linux")]
mod hostile_files;
mod hostile_gltf;
mod interiors;
mod kept_copies;
#[cfg(target_os = "linux")]
mod messages;
mod mutations;
mod obj;
mod packed;
mod pbrt;
mod ply_values;
mod polygons;
mod recognition;
mod scan_warnings;
mod sequences;
mod text_forms;
