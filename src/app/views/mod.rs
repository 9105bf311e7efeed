//! The views of the dock, a folder each.

mod axes;
mod controls;
mod node_row;

pub(crate) mod icicle;
pub(crate) mod merges;
pub(crate) mod nodes;
pub(crate) mod paper;
pub(crate) mod plots;
pub(crate) mod ray;
