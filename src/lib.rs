//! Builds, traces and shows bounding volume hierarchies made by agglomerative clustering.
//!
//! # Map of the code
//!
//! Modules in the order in which a newcomer should read them; each may import only what stands above it.

#![warn(clippy::pedantic)]
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    clippy::cast_possible_wrap,
    reason = "indices are checked to fit u32 when a scene is loaded; pixels, counts and times are rounded on purpose"
)]
#![allow(clippy::many_single_char_names, clippy::similar_names, reason = "formulas keep the letters of their papers")]
#![allow(clippy::must_use_candidate, reason = "pure functions are the rule here; the attribute would stand everywhere")]
#![allow(clippy::module_name_repetitions, reason = "types are imported by name, without their module")]
#![allow(clippy::missing_errors_doc, reason = "error types say themselves when they occur")]
#![allow(clippy::missing_panics_doc, reason = "panics are bugs; the ones left guard invariants")]
#![allow(clippy::inline_always, reason = "probes and kernels must vanish into their loops, also where these are large")]
#![allow(clippy::doc_markdown, reason = "names of formats and programs are words, not code")]
#![allow(clippy::needless_pass_by_value, reason = "small values that are handed over read better without a reference")]
#![allow(clippy::struct_excessive_bools, reason = "preferences are switches")]
#![allow(clippy::float_cmp, reason = "bounds and keys are compared exactly on purpose")]
#![allow(clippy::too_many_lines, reason = "a file's length is watched, not a function's")]

pub mod geometry;

pub mod cancel;

pub mod budget;

pub mod camera;

pub mod view;

pub mod scene;

pub mod bvh;

pub mod accel;

pub mod render;

pub mod overlay;

pub mod lab;

pub mod export;

pub mod worker;

#[cfg(feature = "gui")]
pub mod app;

pub mod headless;

pub mod cli;
