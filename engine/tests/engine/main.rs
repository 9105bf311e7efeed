//! The engine as its users see it: trees of every builder and setting, against a linear scan, the validator and each other.

#![allow(clippy::pedantic, reason = "tests and measurements may be plainer than the libraries")]
#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

mod oracle;
mod random;
mod trees;

mod brute_force;
mod builders;
mod by_hand;
mod degenerate;
mod determinism;
mod invariants;
mod optimize;
mod tie_breaking;
