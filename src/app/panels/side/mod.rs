//! The sections of the side panels. Left: headline, statistics and selection. Right: settings of tree, containers and picture.

pub(super) mod containers;
mod control;
mod findings;
pub(super) mod headline;
mod histogram;
pub(super) mod picture;
pub(super) mod selection;
pub(super) mod statistics;
pub(super) mod tree;
