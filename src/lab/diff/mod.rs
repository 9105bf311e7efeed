//! Two trees of one scene side by side: their numbers, the nodes that both have, and where one tests more than the other.

mod colors;
mod map;
mod trees;

pub use colors::diverging;
pub use map::DifferenceMap;
pub use trees::{TreeDifference, diff, survivors};
