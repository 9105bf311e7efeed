//! Pictures and measurements: shading modes, the overlay and its shaders, and the tables of the lab.

#![allow(clippy::pedantic, reason = "tests and measurements may be plainer than the libraries")]
#![allow(clippy::unwrap_used, reason = "a failed step is a failed test")]

mod counts;
mod cuts;
mod determinism;
mod golden_images;
mod invariants;
mod lab;
mod overlay;
mod overlays;
mod surfaces;

#[cfg(feature = "gui")]
mod overlay_pictures;
#[cfg(feature = "gui")]
mod shaders;
