//! Approximate agglomerative clustering, the paper: [`build`] is its figure 5, [`subtree`] figure 6, [`combine`] figure 7.

pub(crate) mod cluster;
pub(crate) mod reduction;

pub(crate) mod combine;
mod combine_long;
pub(crate) mod combine_short;

mod subtree;

mod leaf_order;

pub(crate) mod build;

pub mod build_cache;
