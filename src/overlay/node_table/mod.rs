//! The nodes of a tree by depth, what is drawn of each, and the choice of those that are drawn.

mod table;

mod shown;

pub use shown::Shown;
pub use table::NodeTable;
