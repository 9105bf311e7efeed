//! The nodes of a tree by depth, the instance data of each, and the selection of those that are drawn.

mod of_layout;
mod other_kind;

mod table;

mod shown;

mod overlap;

mod collecting;

pub use shown::Shown;
pub use table::NodeTable;
