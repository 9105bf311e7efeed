//! Tree files: one bounding volume hierarchy of any builder, written down in `docs/tree-file.md` of the repository.
//!
//! Binary and n-ary trees of boxes, spheres or polytopes with up to 32 children per node, in two lines of text and plain arrays.
//! [`TwoLevelFile`] and [`write_two_levels`] are of files with a tree of each mesh below one over copies of them.
//! [`TreeFile::read`] checks everything that the memory of this process depends on, brings the nodes into the order of
//! [`Tree`](crate::tree::Tree), and lists what is wrong with a tree that can be shown all the same. [`write_tree`] writes any
//! tree, [`write_nodes_csv`] and [`write_nodes_json`] its nodes for notebooks. Knows bytes, readers of which are the caller's;
//! neither paths nor builders.
//!
//! ```
//! use bvhscope_engine::glam::Vec3;
//! use bvhscope_engine::tree_file::{Header, TreeFile, write_tree};
//! use bvhscope_engine::{BuildSettings, CancelToken, Triangle, build};
//!
//! let triangles: Vec<Triangle> = (0..100)
//!     .map(|i| Vec3::new(i as f32, 0.0, 0.0))
//!     .map(|a| Triangle { a, b: a + Vec3::Y, c: a + Vec3::Z })
//!     .collect();
//! let token = CancelToken::new();
//! let bvh = build(&triangles, &BuildSettings::default(), &token)?;
//!
//! let mut bytes = Vec::new();
//! let header = Header { builder: Some("aac".to_owned()), ..Header::new(triangles.len()) };
//! write_tree(bvh.tree(), &header, Some(&triangles), &mut bytes, &token)?;
//!
//! let file = TreeFile::read(&bytes, None, u64::MAX, &token)?;
//! assert_eq!(&file.tree, bvh.tree());
//! assert_eq!((file.corners.as_ref(), file.faults.len()), (Some(&triangles), 0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

// Numbers from files are not trusted: no arithmetic on them may wrap or panic.
#![warn(clippy::arithmetic_side_effects)]

mod layout;

mod bounds_problem;

mod which_tree;

mod instance;

mod error;

mod header;

mod arrays;

mod bounds;

mod links;

mod assemble;

mod found;

mod cuts;

mod faults;

mod read;

mod top_faults;

mod two_levels;

mod write;

mod write_levels;

mod nodes;

pub use bounds::MAX_COORDINATE;
pub use bounds_problem::BoundsProblem;
pub use error::TreeFileError;
pub use faults::{Fault, FaultKind};
pub use header::Header;
pub use instance::{Instance, KnownScene};
pub use layout::{ArrayName, VERSION, VERSION_TWO_LEVELS};
pub use nodes::{write_level_nodes_csv, write_level_nodes_json, write_nodes_csv, write_nodes_json};
pub use read::{TreeFile, has_corners, is_tree_file, is_two_levels, read_corners, read_header};
pub use serde_json;
pub use two_levels::{FileMesh, LevelTree, TwoLevelFile, TwoLevelModel};
pub use which_tree::{Items, WhichTree};
pub use write::{write_corners, write_tree};
pub use write_levels::{TwoLevelTrees, write_two_levels};
