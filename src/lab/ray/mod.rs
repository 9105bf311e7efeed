//! One ray through a tree, step by step: which containers it enters and misses, what it puts on the stack, what it tests, and what
//! of this was wasted.
//!
//! The steps are those of the traversals that trace pictures, which tell them to a probe; nothing here traverses a tree. Start at
//! [`record()`].

mod request;

mod step;

mod span;

mod ray_record;

mod chord;
mod record;
mod recorder;
mod table;
mod tree_nodes;

pub use ray_record::RayRecord;
pub use record::record;
pub use request::{RayMethod, RayRequest};
pub use span::{Span, Visit};
pub use step::{RayStep, Step};
pub use table::ray_table;
