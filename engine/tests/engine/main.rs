//! The engine as its users see it: trees of every builder and setting, against a linear scan, the validator and each other.

#![allow(clippy::pedantic, reason = "tests and measurements may be plainer than the libraries")]
#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

mod oracle;
mod random;
mod trees;

mod against_exact;
mod any_arity;
mod brute_force;
mod builders;
mod by_hand;
mod cache_lines;
mod construction;
mod curve_cells;
mod cuts;
mod degenerate;
mod determinism;
mod follow;
mod instances;
mod invariants;
mod items;
mod layouts;
mod merge_choices;
mod moving_copies;
mod needles;
mod node_metrics;
mod optimize;
mod oriented;
mod queries;
mod ray_events;
mod reference_builders;
mod refit;
mod regret;
mod spatial_splits;
mod subtrees;
mod survival;
mod tie_breaking;
#[cfg(feature = "tree-file")]
mod tree_file;
mod visits;
