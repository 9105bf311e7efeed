//! The trees of Embree's builders. Those inside its scenes cannot be read; `rtcBuildBVH` runs the same builders and hands the
//! nodes to callbacks (<https://www.embree.org/api.html#rtcbuildbvh>).

#![allow(unsafe_code, reason = "Embree is a C library; only the embree*.rs files touch it")]

use std::ffi::{c_uint, c_void};
use std::ptr;

use bvhscope_engine::geometry::{Aabb, Triangle};
use bvhscope_engine::tree::Tree;
use glam::Vec3;

use crate::embree::{Device, Mesh, Mode, Quality, commit, qualities};
use crate::foreign::{Below, tree_below};
use crate::peer::Judged;

/// Most children of a node, which is the width of Embree's own nodes on processors with AVX.
const MOST_CHILDREN: usize = 8;
/// Triangles in a block of Embree's scenes, and most blocks in a leaf.
const BLOCK: c_uint = 4;
const MOST_BLOCKS: c_uint = 7;

/// Shape of a built tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// Two children a node, single triangles in the leaves.
    Binary,
    /// Up to eight children a node and leaves of blocks of four, as Embree traces them.
    Wide,
}

#[derive(Clone)]
#[repr(C, align(32))]
struct BuildPrimitive {
    lower: [f32; 3],
    geometry: u32,
    upper: [f32; 3],
    primitive: u32,
}

#[derive(Clone, Copy)]
#[repr(C, align(16))]
struct Bounds {
    lower: [f32; 4],
    upper: [f32; 4],
}

/// `RTCBuildArguments`.
#[repr(C)]
struct BuildArguments {
    byte_size: usize,
    quality: c_uint,
    flags: c_uint,
    max_branching_factor: c_uint,
    max_depth: c_uint,
    sah_block_size: c_uint,
    min_leaf_size: c_uint,
    max_leaf_size: c_uint,
    traversal_cost: f32,
    intersection_cost: f32,
    bvh: *mut c_void,
    primitives: *mut BuildPrimitive,
    primitive_count: usize,
    primitive_capacity: usize,
    create_node: extern "C" fn(*mut c_void, c_uint, *mut c_void) -> *mut c_void,
    set_children: extern "C" fn(*mut BuiltNode, *const *mut BuiltNode, c_uint, *mut c_void),
    set_bounds: extern "C" fn(*mut BuiltNode, *const *const Bounds, c_uint, *mut c_void),
    create_leaf: extern "C" fn(*mut c_void, *const BuildPrimitive, usize, *mut c_void) -> *mut c_void,
    split: Option<SplitPrimitive>,
    progress: *const c_void,
    user: *mut c_void,
}

type SplitPrimitive = extern "C" fn(*const BuildPrimitive, c_uint, f32, *mut Bounds, *mut Bounds, *mut c_void);

/// A node as the callbacks build it: a leaf with `count` primitives, or an interior node with `count` children.
#[repr(C)]
struct BuiltNode {
    bounds: Aabb,
    count: u32,
    /// Null for an interior node.
    primitives: *mut u32,
    children: [*mut Self; MOST_CHILDREN],
}

/// Data of the callbacks.
struct Build {
    triangles: *const Triangle,
    allocate: unsafe extern "C" fn(*mut c_void, usize, usize) -> *mut c_void,
}

/// Builds a tree of a quality; [`Quality::High`] splits triangles.
pub fn build(device: &Device, triangles: &[Triangle], quality: Quality, shape: Shape) -> Tree<Aabb> {
    if triangles.is_empty() {
        return Tree::EMPTY;
    }
    let primitive = |(index, triangle): (usize, &Triangle)| {
        let Aabb { min, max } = triangle.bounds();
        BuildPrimitive { lower: min.into(), geometry: 0, upper: max.into(), primitive: index as u32 }
    };
    let mut primitives: Vec<BuildPrimitive> = triangles.iter().enumerate().map(primitive).collect();
    if quality == Quality::High {
        // Room for the parts of split triangles.
        primitives.extend_from_within(..);
    }
    let (branching, block, largest) = match shape {
        Shape::Binary => (2, 1, 1),
        Shape::Wide => (MOST_CHILDREN as c_uint, BLOCK, BLOCK * MOST_BLOCKS),
    };
    let functions = &device.library.common;
    let mut build = Build { triangles: triangles.as_ptr(), allocate: functions.allocate };
    // SAFETY: the device is alive.
    let bvh = unsafe { (functions.new_bvh)(device.handle()) };
    let arguments = BuildArguments {
        byte_size: size_of::<BuildArguments>(),
        quality: quality as c_uint,
        flags: 0,
        max_branching_factor: branching,
        max_depth: 1024,
        sah_block_size: block,
        min_leaf_size: block,
        max_leaf_size: largest,
        traversal_cost: 1.0,
        intersection_cost: 1.0,
        bvh,
        primitives: primitives.as_mut_ptr(),
        primitive_count: triangles.len(),
        primitive_capacity: primitives.len(),
        create_node,
        set_children,
        set_bounds,
        create_leaf,
        split: (quality == Quality::High).then_some(split),
        progress: ptr::null(),
        user: (&raw mut build).cast(),
    };
    // SAFETY: the arguments point to live memory, the callbacks have the signatures that Embree requires.
    let root: *const BuiltNode = unsafe { (functions.build_bvh)((&raw const arguments).cast()) }.cast();
    device.check();
    assert!(!root.is_null(), "Embree built no tree");
    let tree = tree_below(root, |&node| {
        // SAFETY: Embree linked the nodes that the callbacks below made and wrote; its memory lives until the tree is released.
        let node = unsafe { &*node };
        let count = node.count as usize;
        if node.primitives.is_null() {
            return (
                node.bounds,
                Below::Children(node.children[..count].iter().map(|child| child.cast_const()).collect()),
            );
        }
        // SAFETY: `create_leaf` wrote as many numbers.
        (node.bounds, Below::Primitives(unsafe { std::slice::from_raw_parts(node.primitives, count) }))
    });
    // SAFETY: released once; no node is read after this.
    unsafe { (functions.release_bvh)(bvh) };
    tree
}

/// The tree to be measured: the binary tree of the builder of the same quality, and the bytes of the scene. Trees with spatial
/// splits are written by `--dump`, and not judged.
pub fn judged(device: &Device, triangles: &[Triangle], mesh: &Mesh, slow: bool) -> Vec<Judged> {
    let judge = |&quality: &Quality| {
        let tree = (quality != Quality::High).then(|| build(device, triangles, quality, Shape::Binary));
        let indices = tree.as_ref().map_or(&[][..], |tree| &tree.primitive_indices[..]);
        Judged {
            engine: device.library.name,
            name: quality.name().to_owned(),
            leaf_triangles: indices.iter().map(|&index| triangles[index as usize]).collect(),
            tree,
            bytes: Some(commit(device, mesh, Mode { quality, is_robust: false, has_filter: false }).bytes),
        }
    };
    qualities(slow).iter().map(judge).collect()
}

fn new_node(allocator: *mut c_void, count: u32, build: &Build) -> *mut BuiltNode {
    let node = BuiltNode {
        bounds: Aabb::EMPTY,
        count,
        primitives: ptr::null_mut(),
        children: [ptr::null_mut(); MOST_CHILDREN],
    };
    // SAFETY: Embree's allocator gives memory of this size and alignment that nobody else uses.
    unsafe {
        let place: *mut BuiltNode = (build.allocate)(allocator, size_of::<BuiltNode>(), 16).cast();
        place.write(node);
        place
    }
}

extern "C" fn create_node(allocator: *mut c_void, count: c_uint, build: *mut c_void) -> *mut c_void {
    // SAFETY: Embree hands over the pointer that it was given, which lives until the tree is built.
    let build = unsafe { &*build.cast::<Build>() };
    new_node(allocator, count, build).cast()
}

extern "C" fn create_leaf(
    allocator: *mut c_void,
    primitives: *const BuildPrimitive,
    count: usize,
    build: *mut c_void,
) -> *mut c_void {
    // SAFETY: as above.
    let build = unsafe { &*build.cast::<Build>() };
    let leaf = new_node(allocator, count as u32, build);
    // SAFETY: Embree hands over `count` primitives and allocates as many numbers; the leaf is not known to anyone yet.
    unsafe {
        let primitives = std::slice::from_raw_parts(primitives, count);
        let place: *mut u32 = (build.allocate)(allocator, count * size_of::<u32>(), 16).cast();
        for (slot, primitive) in primitives.iter().enumerate() {
            let bounds = Aabb { min: primitive.lower.into(), max: primitive.upper.into() };
            (*leaf).bounds = (*leaf).bounds.union(&bounds);
            place.add(slot).write(primitive.primitive);
        }
        (*leaf).primitives = place;
    }
    leaf.cast()
}

extern "C" fn set_children(node: *mut BuiltNode, children: *const *mut BuiltNode, count: c_uint, _: *mut c_void) {
    // SAFETY: `node` comes from `create_node`, and there are as many children as were announced.
    unsafe {
        let children = std::slice::from_raw_parts(children, count as usize);
        (&mut (*node).children)[..children.len()].copy_from_slice(children);
    }
}

extern "C" fn set_bounds(node: *mut BuiltNode, bounds: *const *const Bounds, count: c_uint, _: *mut c_void) {
    for child in 0..count as usize {
        // SAFETY: `node` comes from `create_node`, and there are as many bounds as were announced.
        unsafe {
            let Bounds { lower: [ax, ay, az, _], upper: [bx, by, bz, _] } = **bounds.add(child);
            let child = Aabb { min: Vec3::new(ax, ay, az), max: Vec3::new(bx, by, bz) };
            (*node).bounds = (*node).bounds.union(&child);
        }
    }
}

/// Bounds of the part of a triangle on either side of a plane, within those that it has already.
extern "C" fn split(
    primitive: *const BuildPrimitive,
    axis: c_uint,
    position: f32,
    left: *mut Bounds,
    right: *mut Bounds,
    build: *mut c_void,
) {
    // SAFETY: Embree hands over a primitive of its list, and with the pointer the triangles that the list was made from.
    let (primitive, triangle) = unsafe {
        let primitive = &*primitive;
        (primitive, *(*build.cast::<Build>()).triangles.add(primitive.primitive as usize))
    };
    let axis = axis as usize;
    let mut sides = [Aabb::EMPTY; 2];
    let mut add = |side: usize, point: Vec3| sides[side] = sides[side].union(&Aabb { min: point, max: point });
    let corners = [triangle.a, triangle.b, triangle.c];
    for (a, b) in [(0, 1), (1, 2), (2, 0)].map(|(a, b)| (corners[a], corners[b])) {
        if a[axis] <= position {
            add(0, a);
        }
        if a[axis] >= position {
            add(1, a);
        }
        if (a[axis] < position && position < b[axis]) || (b[axis] < position && position < a[axis]) {
            let mut cut = a + (b - a) * ((position - a[axis]) / (b[axis] - a[axis]));
            cut[axis] = position;
            add(0, cut);
            add(1, cut);
        }
    }
    let (low, high) = (Vec3::from(primitive.lower), Vec3::from(primitive.upper));
    for (side, out) in sides.iter().zip([left, right]) {
        // Clamped at both ends, so that no rounding turns a flat box inside out.
        let (min, max) = (side.min.clamp(low, high), side.max.clamp(low, high));
        // SAFETY: Embree gives two places for the results.
        unsafe { out.write(Bounds { lower: min.extend(0.0).into(), upper: max.extend(0.0).into() }) };
    }
}
