//! What the source text itself must keep to. This program links neither the library nor the engine.

#![allow(clippy::unwrap_used, reason = "a failed step is a failed test")]

mod layering;
mod reliability;
