//! tinybvh, as the crate tinybvh-rs compiles it (<https://github.com/jbikker/tinybvh>).
//!
//! The crate hands out neither the builder with vector instructions nor rays through its fastest tree nor occlusion, and its rays
//! are shorter than what the library writes. So its own functions are called here, by the names that C++ gives them.

#![allow(unsafe_code, reason = "tinybvh is a C++ library; only this file touches it")]

use std::ffi::c_void;
use std::mem::MaybeUninit;

use bvhscope_engine::geometry::{Aabb, Triangle};
// Links the library.
use tinybvh_rs as _;

/// Three in a row are a triangle.
#[repr(C, align(16))]
pub struct Vertex([f32; 4]);

/// `tinybvh::bvhvec4slice`.
#[repr(C)]
struct Vertices {
    first: *const Vertex,
    count: u32,
    stride: u32,
}

/// `tinybvh::Ray`.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub struct Ray {
    origin: [f32; 3],
    mask: u32,
    direction: [f32; 3],
    instance: u32,
    inverse: [f32; 3],
    hit_instance: u32,
    /// Where the ray ends; where it hits, once it is traced.
    pub t: f32,
    u: f32,
    v: f32,
    primitive: u32,
    user: [u32; 16],
}

/// A node of the binary tree: children, or `first` and `count` in the list of primitives.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Node {
    min: [f32; 3],
    /// The first child, or the first primitive of a leaf.
    pub first: u32,
    max: [f32; 3],
    /// Primitives of a leaf; 0 of an interior node.
    pub count: u32,
}

impl Node {
    /// Its container.
    pub fn bounds(&self) -> Aabb {
        Aabb { min: self.min.into(), max: self.max.into() }
    }
}

/// A node with up to eight children, as far as it is read here.
#[repr(C)]
struct WideNode {
    bounds: [u32; 7],
    primitive_count: u32,
    children: [u32; 8],
    child_count: u32,
    rest: [u32; 3],
}

/// A C++ value that is returned in memory, as `std::unique_ptr` is: by every ABI, a structure of this size is.
#[repr(C)]
struct Returned {
    pointer: *mut c_void,
    rest: [MaybeUninit<usize>; 2],
}

/// `rust::Slice`.
#[repr(C)]
struct Slice<T> {
    first: *const T,
    length: usize,
}

unsafe extern "C" {
    #[link_name = "_ZN7tinybvh7BVH_newEv"]
    fn new_binary() -> Returned;
    #[link_name = "_ZN7tinybvh3BVHD1Ev"]
    fn destroy_binary(tree: *mut c_void);
    #[link_name = "_ZN7tinybvh3BVH12BuildDefaultERKNS_12bvhvec4sliceE"]
    fn build(tree: *mut c_void, vertices: *const Vertices);
    #[link_name = "_ZN7tinybvh3BVH7BuildHQERKNS_12bvhvec4sliceE"]
    fn build_hq(tree: *mut c_void, vertices: *const Vertices);
    #[link_name = "_ZN7tinybvh3BVH15PrepareBuild4_8Ev"]
    fn prepare_for_wide(tree: *mut c_void);
    #[link_name = "_ZN7tinybvh3BVH7CompactEv"]
    fn compact(tree: *mut c_void);
    #[link_name = "_ZN7tinybvh9BVH_nodesERKNS_3BVHE"]
    fn nodes(tree: *const c_void) -> Slice<Node>;
    #[link_name = "_ZN7tinybvh11BVH_indicesERKNS_3BVHE"]
    fn indices(tree: *const c_void) -> Slice<u32>;

    #[link_name = "_ZN7tinybvh9MBVH8_newEv"]
    fn new_collapsed() -> Returned;
    #[link_name = "_ZN7tinybvh4MBVHILi8EED1Ev"]
    fn destroy_collapsed(tree: *mut c_void);
    #[link_name = "_ZN7tinybvh4MBVHILi8EE11ConvertFromERKNS_3BVHEb"]
    fn collapse(tree: *mut c_void, binary: *const c_void, compact: bool);
    #[link_name = "_ZN7tinybvh11MBVH8_nodesERKNS_4MBVHILi8EEE"]
    fn wide_nodes(tree: *const c_void) -> Slice<WideNode>;

    #[link_name = "_ZN7tinybvh12BVH8_CPU_newEv"]
    fn new_wide() -> Returned;
    #[link_name = "_ZN7tinybvh8BVH8_CPUD1Ev"]
    fn destroy_wide(tree: *mut c_void);
    #[link_name = "_ZN7tinybvh8BVH8_CPU11ConvertFromERKNS_4MBVHILi8EEE"]
    fn convert(tree: *mut c_void, collapsed: *const c_void);
    #[link_name = "_ZNK7tinybvh8BVH8_CPU9IntersectERNS_3RayE"]
    fn intersect(tree: *const c_void, ray: *mut Ray) -> i32;
    #[link_name = "_ZNK7tinybvh8BVH8_CPU10IsOccludedERKNS_3RayE"]
    fn is_occluded(tree: *const c_void, ray: *const Ray) -> bool;

    #[link_name = "_ZdlPv"]
    fn delete(object: *mut c_void);
}

/// An object of the library.
struct Object {
    pointer: *mut c_void,
    destroy: unsafe extern "C" fn(*mut c_void),
}

// SAFETY: the library's objects have no thread affinity, and calls from several threads only read them.
unsafe impl Send for Object {}
// SAFETY: as above.
unsafe impl Sync for Object {}

impl Object {
    fn new(create: unsafe extern "C" fn() -> Returned, destroy: unsafe extern "C" fn(*mut c_void)) -> Self {
        // SAFETY: a constructor without requirements.
        let pointer = unsafe { create() }.pointer;
        Self { pointer, destroy }
    }
}

impl Drop for Object {
    fn drop(&mut self) {
        // SAFETY: made by `new` of C++, and destroyed and freed once, by its only owner.
        unsafe {
            (self.destroy)(self.pointer);
            delete(self.pointer);
        }
    }
}

/// How a tree is built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quality {
    /// Binned SAH with vector instructions.
    Default,
    /// With spatial splits.
    High,
}

/// The triangles as the library reads them.
pub fn vertices(triangles: &[Triangle]) -> Vec<Vertex> {
    triangles.iter().flat_map(|t| [t.a, t.b, t.c]).map(|corner| Vertex(corner.extend(0.0).to_array())).collect()
}

/// A binary tree. Refers to the vertices that it was built from.
pub struct BinaryTree<'a> {
    object: Object,
    triangles: usize,
    vertices: std::marker::PhantomData<&'a [Vertex]>,
}

impl<'a> BinaryTree<'a> {
    /// Builds; from 50,000 triangles with all the threads that the library has started on this thread.
    pub fn build(vertices: &'a [Vertex], quality: Quality) -> Self {
        let object = Object::new(new_binary, destroy_binary);
        let slice =
            Vertices { first: vertices.as_ptr(), count: vertices.len() as u32, stride: size_of::<Vertex>() as u32 };
        let build = match quality {
            Quality::Default => build,
            Quality::High => build_hq,
        };
        // SAFETY: the object is alive; pointer, count and stride are those of the vertices, which outlive the result.
        unsafe { build(object.pointer, &raw const slice) };
        Self { object, triangles: vertices.len() / 3, vertices: std::marker::PhantomData }
    }

    /// Its nodes, of which the second is not used, and its primitives in the order of the leaves.
    pub fn parts(&self) -> (&[Node], &[u32]) {
        // SAFETY: the object is alive, and lends memory that lives as long.
        unsafe {
            let (nodes, indices) = (nodes(self.object.pointer), indices(self.object.pointer));
            assert_eq!(indices.length, self.triangles, "the library names as many primitives as there are triangles");
            let nodes = std::slice::from_raw_parts(nodes.first, nodes.length);
            // Primitives that were split are listed several times.
            let listed = nodes.iter().filter(|node| node.count > 0).map(|leaf| leaf.first + leaf.count).max();
            (nodes, std::slice::from_raw_parts(indices.first, listed.unwrap_or(0) as usize))
        }
    }

    /// The tree that rays are traced through fastest. Leaves of this one are merged and split until they have up to four triangles.
    pub fn into_wide(self) -> WideTree {
        let binary = self.object;
        let collapsed = Object::new(new_collapsed, destroy_collapsed);
        let wide = Object::new(new_wide, destroy_wide);
        // SAFETY: the objects are alive. Each conversion copies the data that rays need from the previous tree and the vertices.
        let nodes = unsafe {
            prepare_for_wide(binary.pointer);
            compact(binary.pointer);
            collapse(collapsed.pointer, binary.pointer, true);
            convert(wide.pointer, collapsed.pointer);
            let nodes = wide_nodes(collapsed.pointer);
            std::slice::from_raw_parts(nodes.first, nodes.length)
        };
        // Nodes that were taken into their parents are still in the list.
        let (mut bytes, mut stack) = (0, vec![0]);
        while let Some(index) = stack.pop() {
            let node = &nodes[index as usize];
            let is_leaf = node.primitive_count > 0;
            bytes += if is_leaf { WIDE_LEAF_BYTES } else { WIDE_NODE_BYTES };
            stack.extend(&node.children[..if is_leaf { 0 } else { node.child_count as usize }]);
        }
        WideTree { bytes, object: wide, sources: vec![collapsed, binary] }
    }
}

/// Bytes of a node of eight boxes, and of four triangles.
const WIDE_NODE_BYTES: usize = 256;
const WIDE_LEAF_BYTES: usize = 192;

/// A tree of eight-wide nodes and blocks of four triangles.
pub struct WideTree {
    // Before what it was made from, to whose memory it has pointers.
    object: Object,
    sources: Vec<Object>,
    /// Bytes of nodes and triangles.
    pub bytes: usize,
}

impl WideTree {
    /// Frees what rays do not need.
    pub fn trim(&mut self) {
        self.sources.clear();
    }

    /// Sets `t` to the distance of the nearest hit before it.
    #[inline(always)]
    pub fn intersect(&self, ray: &mut Ray) {
        // SAFETY: the tree is alive; the ray has the layout and size of the library's.
        unsafe { intersect(self.object.pointer, ray) };
    }

    /// True if anything is hit before `t`.
    #[inline(always)]
    pub fn is_occluded(&self, ray: &Ray) -> bool {
        // SAFETY: as above.
        unsafe { is_occluded(self.object.pointer, ray) }
    }
}

/// The library's infinity.
pub const FAR: f32 = 1e30;

impl Ray {
    /// A ray of this crate, which begins at 0.
    pub fn new(ray: &bvhscope_engine::geometry::Ray) -> Self {
        let inverse = |x: f32| if x.abs() > 1e-12 { 1.0 / x } else { FAR.copysign(x) };
        let direction = ray.direction.to_array();
        Self {
            origin: ray.origin.into(),
            mask: 0xffff,
            direction,
            instance: 0,
            inverse: direction.map(inverse),
            hit_instance: 0,
            t: ray.t_max.min(FAR),
            u: 0.0,
            v: 0.0,
            primitive: 0,
            user: [0; 16],
        }
    }
}
