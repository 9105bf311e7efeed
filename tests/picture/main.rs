//! Pictures and measurements: shading modes, the overlay and its shaders, and the tables of the lab.

#![allow(clippy::pedantic, reason = "tests and measurements may be plainer than the libraries")]
#![allow(clippy::unwrap_used, reason = "a failed step is a failed test")]

#[path = "../support/mod.rs"]
mod support;

mod any_arity;
mod copies;
mod counts;
mod cut_pictures;
mod golden_formats;
mod golden_images;
mod lab;
mod layout_pictures;
mod overlay;
mod overlays;
mod picture_invariants;
mod pinned_trees;
mod query_pictures;
mod ray_pictures;
mod same_pictures;
mod surfaces;

#[cfg(feature = "gui")]
mod overlay_pictures;
#[cfg(feature = "gui")]
mod shaders;
