//! Embree's devices, scenes and builds.

#![allow(unsafe_code, reason = "Embree is a C library; only the embree*.rs files touch it")]

use std::collections::HashMap;
use std::ffi::{CString, c_uint, c_void};
use std::ptr;
use std::sync::atomic::{AtomicIsize, Ordering};

use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::kernel::SimdLevel;
use glam::Vec3;

use crate::embree_library::{Common, Library};
use crate::peer::{BuildTimes, Builder, timed};

pub const FORMAT_UINT3: c_uint = 0x5003;
pub const FORMAT_FLOAT3: c_uint = 0x9003;
pub const BUFFER_INDEX: c_uint = 0;
pub const BUFFER_VERTEX: c_uint = 1;
pub const GEOMETRY_TRIANGLE: c_uint = 0;
const GEOMETRY_INSTANCE: c_uint = 121;
const FORMAT_FLOAT3X4_ROW_MAJOR: c_uint = 0x9134;
/// Flag of scenes in which no ray slips between triangles that share an edge (`RTC_SCENE_FLAG_ROBUST`).
const SCENE_ROBUST: c_uint = 4;
/// Flag of scenes whose queries may bring a filter function of their own: `RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION`, in Embree 4
/// `RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS`.
const SCENE_FILTER: c_uint = 8;

/// How carefully Embree builds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Quality {
    /// Its Morton builder.
    Low = 0,
    /// Binned SAH.
    Medium = 1,
    /// SAH with spatial splits.
    High = 2,
    /// Of a geometry that has a tree: its containers are fitted.
    Refit = 3,
}

impl Quality {
    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Low => "low",
            Self::Medium => "medium",
            Self::High => "high",
            Self::Refit => "refit",
        }
    }
}

/// How a scene is built and traced.
#[derive(Debug, Clone, Copy)]
pub struct Mode {
    /// Build quality.
    pub quality: Quality,
    /// Watertight, as this engine is: rays take another test of triangles and boxes.
    pub is_robust: bool,
    /// Whether queries bring a filter function.
    pub has_filter: bool,
}

impl Mode {
    /// Its name in tables.
    pub fn name(self) -> String {
        format!("{}{}", self.quality.name(), if self.is_robust { " robust" } else { "" })
    }
}

/// Bytes that Embree holds.
static HELD_BYTES: AtomicIsize = AtomicIsize::new(0);

extern "C" fn monitor(_: *mut c_void, bytes: isize, _: bool) -> bool {
    HELD_BYTES.fetch_add(bytes, Ordering::Relaxed);
    true
}

/// Embree with a number of threads.
pub struct Device {
    /// The library that it belongs to.
    pub library: &'static Library,
    device: *mut c_void,
}

impl Device {
    /// Starts it.
    pub fn new(library: &'static Library, threads: usize) -> Self {
        // Up to the level that this engine is limited to.
        let isa = match SimdLevel::of_builds() {
            SimdLevel::Sse2 => ",isa=sse2",
            SimdLevel::Avx2 => ",isa=avx2",
            SimdLevel::Avx512 | SimdLevel::Neon => "",
        };
        let config = CString::new(format!("threads={threads},set_affinity=0{isa}")).expect("no zero in it");
        // SAFETY: the text outlives the call; a null device is refused below.
        let device = unsafe { (library.common.new_device)(config.as_ptr()) };
        assert!(!device.is_null(), "Embree does not start");
        // SAFETY: the device is alive; the monitor is a static function that ignores its user pointer.
        unsafe { (library.common.set_monitor)(device, Some(monitor), ptr::null_mut()) };
        Self { library, device }
    }

    /// The device as Embree's functions want it.
    pub fn handle(&self) -> *mut c_void {
        self.device
    }

    /// Fails where Embree has reported an error.
    pub fn check(&self) {
        // SAFETY: the device is alive.
        let error = unsafe { (self.library.common.device_error)(self.device) };
        assert!(error == 0, "{} reports error {error}", self.library.name);
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: released once; scenes hold references of their own.
        unsafe { (self.library.common.release_device)(self.device) };
    }
}

/// Triangles with shared vertices, as Embree wants them.
pub struct Mesh {
    /// Each once, and one more as padding.
    pub vertices: Vec<[f32; 3]>,
    /// The vertices of each triangle.
    pub indices: Vec<[u32; 3]>,
}

impl Mesh {
    /// Finds the vertices that triangles share.
    pub fn new(triangles: &[Triangle]) -> Self {
        let mut known: HashMap<[u32; 3], u32> = HashMap::with_capacity(triangles.len() / 2);
        let mut vertices = Vec::new();
        let mut vertex = |corner: Vec3| {
            *known.entry(corner.to_array().map(f32::to_bits)).or_insert_with(|| {
                vertices.push(corner.to_array());
                vertices.len() as u32 - 1
            })
        };
        let indices = triangles.iter().map(|t| [t.a, t.b, t.c].map(&mut vertex)).collect();
        // Embree reads the last vertex with a load of 16 bytes.
        vertices.push([0.0; 3]);
        Self { vertices, indices }
    }
}

/// A committed scene. Refers to the mesh that it was built from.
pub struct Scene<'a> {
    /// The library that it belongs to.
    pub library: &'static Library,
    /// Build quality and test.
    pub mode: Mode,
    scene: *mut c_void,
    /// Bytes of tree and triangles; the shared vertices are not counted.
    pub bytes: usize,
    mesh: std::marker::PhantomData<&'a Mesh>,
}

impl Scene<'_> {
    /// Owns a scene of Embree's, of this many bytes, that refers to a mesh.
    pub fn owning(library: &'static Library, mode: Mode, scene: *mut c_void, bytes: usize) -> Self {
        Self { library, mode, scene, bytes, mesh: std::marker::PhantomData }
    }

    /// The scene as Embree's functions want it.
    pub fn handle(&self) -> *mut c_void {
        self.scene
    }
}

impl Drop for Scene<'_> {
    fn drop(&mut self) {
        // SAFETY: released once, by its only owner.
        unsafe { (self.library.common.release_scene)(self.scene) };
    }
}

/// Builds.
pub fn commit<'a>(device: &Device, mesh: &'a Mesh, mode: Mode) -> Scene<'a> {
    let before = HELD_BYTES.load(Ordering::Relaxed);
    let Common {
        new_geometry,
        set_geometry_quality,
        set_buffer,
        commit_geometry,
        attach_geometry,
        release_geometry,
        commit_scene,
        ..
    } = device.library.common;
    // SAFETY: device, scene and geometry are alive; the shared buffers belong to `mesh`, which the result borrows, and
    // have the counts, strides and padding that Embree requires.
    let scene = unsafe {
        let scene = empty_scene(device, mode);
        let geometry = new_geometry(device.device, GEOMETRY_TRIANGLE);
        set_geometry_quality(geometry, mode.quality as c_uint);
        let (vertices, indices) = (mesh.vertices.as_ptr().cast(), mesh.indices.as_ptr().cast());
        let count = mesh.vertices.len() - 1;
        set_buffer(geometry, BUFFER_VERTEX, 0, FORMAT_FLOAT3, vertices, 0, 12, count);
        set_buffer(geometry, BUFFER_INDEX, 0, FORMAT_UINT3, indices, 0, 12, mesh.indices.len());
        commit_geometry(geometry);
        attach_geometry(scene, geometry);
        release_geometry(geometry);
        commit_scene(scene);
        scene
    };
    device.check();
    let bytes = (HELD_BYTES.load(Ordering::Relaxed) - before).max(0) as usize;
    Scene::owning(device.library, mode, scene, bytes)
}

/// A scene without geometries, which is not committed.
fn empty_scene(device: &Device, Mode { quality, is_robust, has_filter }: Mode) -> *mut c_void {
    let Common { new_scene, set_scene_flags, set_scene_quality, .. } = device.library.common;
    // SAFETY: the device and the scene are alive.
    unsafe {
        let scene = new_scene(device.device);
        set_scene_flags(scene, if is_robust { SCENE_ROBUST } else { 0 } | if has_filter { SCENE_FILTER } else { 0 });
        set_scene_quality(scene, quality as c_uint);
        scene
    }
}

/// Builds the scenes of `meshes` and one over their copies: the mesh of each, and the rows of its transform.
pub fn commit_copies<'a>(
    device: &Device,
    meshes: &'a [Mesh],
    copies: impl Iterator<Item = (u32, &'a [[f32; 4]; 3])>,
    mode: Mode,
) -> Scene<'a> {
    let before = HELD_BYTES.load(Ordering::Relaxed);
    let Common {
        new_geometry,
        set_instanced_scene,
        set_transform,
        commit_geometry,
        attach_geometry,
        release_geometry,
        commit_scene,
        ..
    } = device.library.common;
    let below: Vec<Scene> = meshes.iter().map(|mesh| commit(device, mesh, mode)).collect();
    let scene = empty_scene(device, mode);
    for (mesh, rows) in copies {
        // SAFETY: device, scenes and geometry are alive; the transform has twelve numbers, which are copied. An instance holds a reference of
        // its own to the scene of its mesh.
        unsafe {
            let geometry = new_geometry(device.device, GEOMETRY_INSTANCE);
            set_instanced_scene(geometry, below[mesh as usize].scene);
            set_transform(geometry, 0, FORMAT_FLOAT3X4_ROW_MAJOR, rows.as_ptr().cast());
            commit_geometry(geometry);
            attach_geometry(scene, geometry);
            release_geometry(geometry);
        }
    }
    // SAFETY: the scene is alive.
    unsafe { commit_scene(scene) };
    device.check();
    let bytes = (HELD_BYTES.load(Ordering::Relaxed) - before).max(0) as usize;
    Scene::owning(device.library, mode, scene, bytes)
}

/// The qualities that are measured.
pub fn qualities(slow: bool) -> &'static [Quality] {
    if slow { &[Quality::Low, Quality::Medium, Quality::High] } else { &[Quality::Low, Quality::Medium] }
}

/// The ways to build and to trace that are measured.
pub fn modes(slow: bool) -> Vec<Mode> {
    let both = |&quality: &Quality| [false, true].map(|is_robust| Mode { quality, is_robust, has_filter: false });
    qualities(slow).iter().flat_map(both).collect()
}

/// Every build.
pub fn builders<'a>(device: &'a Device, mesh: &'a Mesh, threads: usize, slow: bool) -> Vec<Builder<'a>> {
    let builder = |mode: Mode| Builder {
        engine: device.library.name,
        name: mode.name(),
        threads,
        // Rays are traced through what is committed; Embree hands out no binary tree of it.
        build: Box::new(move || BuildTimes { binary: None, ready: timed(|| commit(device, mesh, mode)) }),
    };
    modes(slow).into_iter().map(builder).collect()
}
