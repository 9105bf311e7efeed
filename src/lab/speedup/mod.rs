//! How fast building and tracing would be on more cores than the machine has: a greedy schedule of their tasks, which are logged in
//! runs on one thread and on two.
//!
//! The task graph has work and span (Blumofe, Leiserson, *Scheduling Multithreaded Computations by Work Stealing*, 1999). What it
//! does not have is measured: the price of a fork, and how much longer the same tasks take while two cores are busy, because they
//! share caches and memory. How that goes on with more cores is not known; its extremes are the bounds of the prediction.

mod graph;
mod greedy;

mod clock;
pub mod prediction;
mod prices;
mod runs;

mod predict;

#[cfg(test)]
mod made;

pub use predict::predict;
