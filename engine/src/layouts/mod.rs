//! Layouts of wide trees, described and counted instead of programmed: how many children a node has, how they are chosen from the binary
//! tree, how their boxes are stored, and how many triangles a leaf has at most.
//!
//! Tracers differ in these, and what they cost a ray differs with them: tests, nodes, cache lines and bytes. A [`LaidTree`] is the
//! hierarchy of one [`Layout`] with the boxes that its planes stand for, and the place of each node in memory. One walker takes rays
//! through all of them and counts. Described so, the engine's own eight-wide tree ([`LaidTree::of_wide`]) takes the same tests and reads
//! the same lines as it does when it is traced. [`KeptNodes`] are the nodes of the binary tree that are left in one.
//!
//! Knows nothing of builders. Start at [`Layout`], then read [`LaidTree`] and [`LaidTree::measure`].

mod grid;
mod layout;
mod plan;

mod lay;
mod trace;

mod kept;

pub use kept::KeptNodes;
pub use lay::{LaidNumbers, LaidTree};
pub use layout::{Collapse, Layout, MAX_CHILDREN, MAX_LEAF, Planes, TRIANGLE_BYTES};
pub use trace::{LaidQuery, LaidRay, MeasuredLayout, RayCounts, WalkMemory};
