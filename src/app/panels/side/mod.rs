//! The sections of the side panels. Left: headline, statistics and selection. Right: settings of tree, containers and picture.

mod annealing;
pub(super) mod containers;
mod curve;
mod findings;
pub(super) mod headline;
mod histogram;
mod memory;
pub(super) mod picture;
mod recent_changes;
pub(super) mod section_plane;
pub(super) mod selection;
pub(super) mod statistics;
pub(super) mod tree;
