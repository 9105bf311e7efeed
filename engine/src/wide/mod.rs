//! The wide tree: up to eight children per node and four triangles per block, tested side by side with SIMD. Collapsed
//! from a binary tree, with exactly the same hits.
//!
//! Depends only on geometry, cancellation, kernels and the binary tree: neither on builders nor on settings.
//!
//! # Layout
//!
//! ```text
//! WideTree
//!   root: Child                          None without triangles
//!   nodes: [WideNode]                    parents before their children
//!     bounds    8 containers, one per lane: lower x of all eight, lower y, …
//!     children  8 × Child, the used lanes first
//!   compact_nodes: [WideNode]            the same with planes of 8 bits, rounded outwards; only in large trees
//!   leaves: Leaves                       triangles in leaf order, without gaps
//!     block     1 to 4 triangles: x of all first corners, x of all second corners, …, then their indices
//!
//! Child, 32 bits
//!   0 c iiiiii…                          node: index i in `nodes`, or in `compact_nodes` if c is 1
//!   1 nnnn sss…                          leaf: n + 1 triangles from slot s on; n = 15: number s in a list of longer leaves
//! ```
//!
//! # Making it
//!
//! [`collapse()`] goes through the binary tree twice. Bottom-up it computes, for each node, the least cost of everything below as a
//! leaf, or in 1 to 8 lanes of the node above (`collapse/optimal.rs`, `collapse/chunk.rs`); top-down it follows the cheapest choices
//! and writes nodes and blocks (`collapse/emit.rs`).
//!
//! # A ray's way through it
//!
//! This function finds what [`trace`] finds, one container and one triangle at a time:
//!
//! ```
//! use bvhscope_engine::geometry::{PreparedRay, Shear};
//! use bvhscope_engine::wide::{AnyWideTree, WideTree};
//! use bvhscope_engine::{Aabb, Hit, Ray};
//! # use bvhscope_engine::{BuildSettings, CancelToken, Triangle, build, glam::Vec3};
//!
//! fn closest_hit(tree: &WideTree<Aabb>, ray: &Ray) -> Option<Hit> {
//!     let (prepared, shear) = (PreparedRay::new(*ray), Shear::new(ray.direction));
//!     let mut nearest: Option<Hit> = None;
//!     // Children to visit, the nearest on top, with the distances at which the ray enters them.
//!     let mut stack = Vec::from_iter(tree.root.map(|root| (ray.t_min, root)));
//!     while let Some((entry, child)) = stack.pop() {
//!         let t_max = nearest.map_or(ray.t_max, |hit| hit.t);
//!         if entry > t_max {
//!             continue;
//!         }
//!         if child.is_leaf() {
//!             for block in tree.leaves.blocks(child) {
//!                 for lane in 0..block.count() {
//!                     let primitive_index = block.primitive_index(lane);
//!                     let hit = block.triangle(lane).intersect(&prepared, &shear, t_max);
//!                     let hit = hit.map(|hit| Hit { t: hit.t, u: hit.u, v: hit.v, primitive_index });
//!                     // Equal distances go to the lower index.
//!                     let key = |hit: &Hit| (hit.t, hit.primitive_index);
//!                     nearest = hit.into_iter().chain(nearest).min_by(|a, b| key(a).partial_cmp(&key(b)).unwrap());
//!                 }
//!             }
//!         } else {
//!             let (node, waiting) = (tree.node(child), stack.len());
//!             for (lane, child) in tree.children_of(child).enumerate() {
//!                 let entry = node.load(lane).entry(&prepared, ray.t_min, t_max);
//!                 stack.extend(entry.map(|entry| (entry, child)));
//!             }
//!             stack[waiting..].sort_by(|a, b| b.0.total_cmp(&a.0));
//!         }
//!     }
//!     nearest
//! }
//!
//! # let point = |i: u32| Vec3::new((i * 7 % 10) as f32, (i * 3 % 11) as f32, (i * 5 % 13) as f32);
//! # let triangles: Vec<_> = (0..500).map(|i| Triangle { a: point(i), b: point(i + 1), c: point(i + 300) }).collect();
//! let bvh = build(&triangles, &BuildSettings::default(), &CancelToken::new())?;
//! let AnyWideTree::Aabb(tree) = &bvh.wide().tree else { unreachable!("boxes are the default") };
//! for i in 0..100 {
//!     let ray = Ray::new(Vec3::new(-1.0, 5.0, 6.0), point(i) + Vec3::new(1.0, -5.1, -6.2));
//!     assert_eq!(closest_hit(tree, &ray), bvh.closest_hit(&ray));
//! }
//! # Ok::<(), bvhscope_engine::BuildError>(())
//! ```
//!
//! In [`trace`] a visit is the same, with three differences. `box_lanes.rs` and `sphere_bounds.rs` test the eight containers at once,
//! and `block.rs` the four triangles. `trace/single.rs` keeps the nearest child out of the stack. And rays are traced by what they
//! have in common: `trace/packet.rs` takes up to 256 rays from one point through the tree together, `trace/stream.rs` any rays in
//! small groups, each of which has reached the same child.

pub mod layout;

pub(crate) mod fused_box;
pub(crate) mod ray_lanes;

pub mod block;
pub mod bounds;
pub mod box_bounds;
pub mod box_lanes;
pub mod child;
pub mod compact;
pub mod leaves;
pub mod sphere_bounds;
pub mod tree;

mod collapse;
mod to_tree;
pub mod trace;

pub use block::TriangleBlock;
pub use bounds::{CompactBounds, WideContainer};
pub use child::Child;
pub use collapse::collapse;
pub use leaves::Leaves;
pub use tree::{AnyWideTree, NodeForm, NodeRef, WideNode, WideTree};
