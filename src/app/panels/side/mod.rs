//! The sections of the side panels. Left: statistics and selection. Right: settings of tree, containers and picture.

pub(super) mod containers;
mod histogram;
pub(super) mod picture;
mod recent_changes;
pub(super) mod selection;
pub(super) mod statistics;
pub(super) mod tree;
