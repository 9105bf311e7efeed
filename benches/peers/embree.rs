//! Embree 3, through the few functions of its C interface that are used here (<https://www.embree.org/api.html>).

#![allow(unsafe_code, reason = "Embree is a C library; only this file and embree_tree.rs touch it")]

use std::collections::HashMap;
use std::ffi::{CString, c_char, c_int, c_uint, c_void};
use std::ptr;
use std::sync::atomic::{AtomicIsize, Ordering};

use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::kernel::SimdLevel;
use glam::Vec3;

use crate::embree_tree::{self, Shape};
use crate::peer::{BuildTimes, Builder, Interface, Judged, Run, timed};
use crate::rays::{Query, Tally, Workload};

/// Its name.
pub const NAME: &str = "embree";
/// Rays in a stream.
const STREAM: usize = 64;

const FORMAT_UINT3: c_uint = 0x5003;
const FORMAT_FLOAT3: c_uint = 0x9003;
const BUFFER_INDEX: c_uint = 0;
const BUFFER_VERTEX: c_uint = 1;
const GEOMETRY_TRIANGLE: c_uint = 0;
const CONTEXT_COHERENT: c_uint = 1;
const INVALID: u32 = u32::MAX;

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
}

impl Quality {
    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Low => "low",
            Self::Medium => "medium",
            Self::High => "high",
        }
    }
}

#[link(name = "embree3")]
unsafe extern "C" {
    fn rtcNewDevice(config: *const c_char) -> *mut c_void;
    fn rtcReleaseDevice(device: *mut c_void);
    fn rtcGetDeviceError(device: *mut c_void) -> c_uint;
    fn rtcSetDeviceMemoryMonitorFunction(
        device: *mut c_void,
        monitor: Option<extern "C" fn(*mut c_void, isize, bool) -> bool>,
        user: *mut c_void,
    );
    fn rtcNewScene(device: *mut c_void) -> *mut c_void;
    fn rtcReleaseScene(scene: *mut c_void);
    fn rtcSetSceneBuildQuality(scene: *mut c_void, quality: c_uint);
    fn rtcCommitScene(scene: *mut c_void);
    fn rtcNewGeometry(device: *mut c_void, kind: c_uint) -> *mut c_void;
    fn rtcReleaseGeometry(geometry: *mut c_void);
    fn rtcSetGeometryBuildQuality(geometry: *mut c_void, quality: c_uint);
    fn rtcSetSharedGeometryBuffer(
        geometry: *mut c_void,
        kind: c_uint,
        slot: c_uint,
        format: c_uint,
        data: *const c_void,
        offset: usize,
        stride: usize,
        count: usize,
    );
    fn rtcCommitGeometry(geometry: *mut c_void);
    fn rtcAttachGeometry(scene: *mut c_void, geometry: *mut c_void) -> c_uint;
    fn rtcIntersect1(scene: *mut c_void, context: *mut Context, ray: *mut RayHit);
    fn rtcIntersect8(valid: *const c_int, scene: *mut c_void, context: *mut Context, rays: *mut RayHits<8>);
    fn rtcIntersect16(valid: *const c_int, scene: *mut c_void, context: *mut Context, rays: *mut RayHits<16>);
    fn rtcIntersect1M(scene: *mut c_void, context: *mut Context, rays: *mut RayHit, count: c_uint, stride: usize);
    fn rtcOccluded1(scene: *mut c_void, context: *mut Context, ray: *mut Ray);
    fn rtcOccluded8(valid: *const c_int, scene: *mut c_void, context: *mut Context, rays: *mut Rays<8>);
    fn rtcOccluded16(valid: *const c_int, scene: *mut c_void, context: *mut Context, rays: *mut Rays<16>);
    fn rtcOccluded1M(scene: *mut c_void, context: *mut Context, rays: *mut Ray, count: c_uint, stride: usize);
}

#[repr(C)]
struct Context {
    flags: c_uint,
    filter: *const c_void,
    instance: [u32; 1],
}

// SAFETY: the pointer is null.
unsafe impl Send for Context {}

/// A committed scene, which any number of threads may trace at once.
#[derive(Clone, Copy)]
struct SceneRef(*mut c_void);

// SAFETY: Embree's queries of a committed scene are thread-safe.
unsafe impl Send for SceneRef {}

impl SceneRef {
    fn get(self) -> *mut c_void {
        self.0
    }
}

impl Context {
    fn new(coherent: bool) -> Self {
        let flags = if coherent { CONTEXT_COHERENT } else { 0 };
        Self { flags, filter: ptr::null(), instance: [INVALID] }
    }
}

#[derive(Clone, Copy)]
#[repr(C, align(16))]
struct Ray {
    origin: [f32; 3],
    near: f32,
    direction: [f32; 3],
    time: f32,
    far: f32,
    mask: u32,
    id: u32,
    flags: u32,
}

#[derive(Clone, Copy)]
#[repr(C, align(16))]
struct Hit {
    normal: [f32; 3],
    u: f32,
    v: f32,
    primitive: u32,
    geometry: u32,
    instance: u32,
}

#[derive(Clone, Copy)]
#[repr(C)]
struct RayHit {
    ray: Ray,
    hit: Hit,
}

/// A packet of rays; lanes that are not used have an empty interval.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Rays<const N: usize> {
    origin: [[f32; N]; 3],
    near: [f32; N],
    direction: [[f32; N]; 3],
    time: [f32; N],
    far: [f32; N],
    mask: [u32; N],
    id: [u32; N],
    flags: [u32; N],
}

/// Which lanes of a packet count (-1), aligned as Embree wants it.
#[repr(C, align(64))]
struct Valid([c_int; 16]);

#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Hits<const N: usize> {
    normal: [[f32; N]; 3],
    u: [f32; N],
    v: [f32; N],
    primitive: [u32; N],
    geometry: [u32; N],
    instance: [u32; N],
}

#[derive(Clone, Copy)]
#[repr(C)]
struct RayHits<const N: usize> {
    rays: Rays<N>,
    hits: Hits<N>,
}

/// Bytes that Embree holds.
static HELD_BYTES: AtomicIsize = AtomicIsize::new(0);

extern "C" fn monitor(_: *mut c_void, bytes: isize, _: bool) -> bool {
    HELD_BYTES.fetch_add(bytes, Ordering::Relaxed);
    true
}

/// Embree with a number of threads.
pub struct Device(*mut c_void);

impl Device {
    /// Starts it.
    pub fn new(threads: usize) -> Self {
        // Up to the level that this engine is limited to.
        let isa = match SimdLevel::of_builds() {
            SimdLevel::Sse2 => ",isa=sse2",
            SimdLevel::Sse4 => ",isa=sse4.2",
            SimdLevel::Avx2 => ",isa=avx2",
            SimdLevel::Avx512 | SimdLevel::Neon => "",
        };
        let config = CString::new(format!("threads={threads},set_affinity=0{isa}")).expect("no zero in it");
        // SAFETY: the text outlives the call; a null device is refused below.
        let device = unsafe { rtcNewDevice(config.as_ptr()) };
        assert!(!device.is_null(), "Embree does not start");
        // SAFETY: the device is alive; the monitor is a static function that ignores its user pointer.
        unsafe { rtcSetDeviceMemoryMonitorFunction(device, Some(monitor), ptr::null_mut()) };
        Self(device)
    }

    /// The device as Embree's functions want it.
    pub fn handle(&self) -> *mut c_void {
        self.0
    }

    /// Fails where Embree has reported an error.
    pub fn check(&self) {
        // SAFETY: the device is alive.
        let error = unsafe { rtcGetDeviceError(self.0) };
        assert!(error == 0, "Embree reports error {error}");
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: released once; scenes hold references of their own.
        unsafe { rtcReleaseDevice(self.0) };
    }
}

/// Triangles with shared vertices, as Embree wants them.
pub struct Mesh {
    vertices: Vec<[f32; 3]>,
    indices: Vec<[u32; 3]>,
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
    scene: *mut c_void,
    /// Bytes of tree and triangles; the shared vertices are not counted.
    bytes: usize,
    mesh: std::marker::PhantomData<&'a Mesh>,
}

impl Drop for Scene<'_> {
    fn drop(&mut self) {
        // SAFETY: released once, by its only owner.
        unsafe { rtcReleaseScene(self.scene) };
    }
}

/// Builds.
pub fn commit<'a>(device: &Device, mesh: &'a Mesh, quality: Quality) -> Scene<'a> {
    let before = HELD_BYTES.load(Ordering::Relaxed);
    // SAFETY: device, scene and geometry are alive; the shared buffers belong to `mesh`, which the result borrows, and
    // have the counts, strides and padding that Embree asks for.
    let scene = unsafe {
        let scene = rtcNewScene(device.0);
        rtcSetSceneBuildQuality(scene, quality as c_uint);
        let geometry = rtcNewGeometry(device.0, GEOMETRY_TRIANGLE);
        rtcSetGeometryBuildQuality(geometry, quality as c_uint);
        let (vertices, indices) = (mesh.vertices.as_ptr().cast(), mesh.indices.as_ptr().cast());
        let count = mesh.vertices.len() - 1;
        rtcSetSharedGeometryBuffer(geometry, BUFFER_VERTEX, 0, FORMAT_FLOAT3, vertices, 0, 12, count);
        rtcSetSharedGeometryBuffer(geometry, BUFFER_INDEX, 0, FORMAT_UINT3, indices, 0, 12, mesh.indices.len());
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene, geometry);
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene);
        scene
    };
    device.check();
    let bytes = HELD_BYTES.load(Ordering::Relaxed) - before;
    Scene { scene, bytes: bytes.max(0) as usize, mesh: std::marker::PhantomData }
}

/// The qualities that are measured.
pub fn qualities(slow: bool) -> &'static [Quality] {
    if slow { &[Quality::Low, Quality::Medium, Quality::High] } else { &[Quality::Low, Quality::Medium] }
}

/// Every build.
pub fn builders<'a>(device: &'a Device, mesh: &'a Mesh, threads: usize, slow: bool) -> Vec<Builder<'a>> {
    let builder = |&quality: &Quality| Builder {
        engine: NAME,
        name: quality.name().to_owned(),
        threads,
        // Rays are traced through what is committed; Embree hands out no binary tree of it.
        build: Box::new(move || BuildTimes { binary: None, ready: timed(|| commit(device, mesh, quality)) }),
    };
    qualities(slow).iter().map(builder).collect()
}

/// The tree to be measured: the binary tree of the builder of the same quality, and the bytes of the scene. Trees with spatial
/// splits are written by `--dump`, and not judged.
pub fn judged(device: &Device, triangles: &[Triangle], mesh: &Mesh, slow: bool) -> Vec<Judged> {
    let judge = |&quality: &Quality| {
        let tree = (quality != Quality::High).then(|| embree_tree::build(device, triangles, quality, Shape::Binary));
        let indices = tree.as_ref().map_or(&[][..], |tree| &tree.primitive_indices[..]);
        Judged {
            engine: NAME,
            name: quality.name().to_owned(),
            leaf_triangles: indices.iter().map(|&index| triangles[index as usize]).collect(),
            tree,
            bytes: Some(commit(device, mesh, quality).bytes),
        }
    };
    qualities(slow).iter().map(judge).collect()
}

/// Every way to trace a scene.
pub fn interfaces<'a>(scene: &'a Scene<'a>, quality: Quality) -> Vec<Interface<'a>> {
    let interface = |name: &'static str, prepare: fn(SceneRef, &'a Workload) -> Run<'a>| Interface {
        engine: NAME,
        setting: quality.name().to_owned(),
        name,
        prepare: Box::new(move |work| Some(prepare(SceneRef(scene.scene), work))),
    };
    vec![
        interface("single", single),
        interface("packet 8", |scene, work| {
            packets::<8>(
                work,
                // SAFETY: the scene outlives the run; eight lanes each are valid and aligned.
                move |valid, context, rays| unsafe { rtcIntersect8(valid, scene.get(), context, rays) },
                // SAFETY: as above.
                move |valid, context, rays| unsafe { rtcOccluded8(valid, scene.get(), context, rays) },
            )
        }),
        interface("packet 16", |scene, work| {
            packets::<16>(
                work,
                // SAFETY: the scene outlives the run; sixteen lanes each are valid and aligned.
                move |valid, context, rays| unsafe { rtcIntersect16(valid, scene.get(), context, rays) },
                // SAFETY: as above.
                move |valid, context, rays| unsafe { rtcOccluded16(valid, scene.get(), context, rays) },
            )
        }),
        interface("stream", stream),
    ]
}

const NO_HIT: Hit = Hit { normal: [0.0; 3], u: 0.0, v: 0.0, primitive: INVALID, geometry: INVALID, instance: INVALID };

fn native(ray: &bvhscope_engine::geometry::Ray) -> Ray {
    Ray {
        origin: ray.origin.into(),
        near: ray.t_min,
        direction: ray.direction.into(),
        time: 0.0,
        far: ray.t_max,
        mask: u32::MAX,
        id: 0,
        flags: 0,
    }
}

/// A ray that was occluded is marked by an end of minus infinity.
fn is_occluded(far: f32) -> bool {
    far < 0.0
}

fn single(scene: SceneRef, work: &Workload) -> Run<'_> {
    let mut context = Context::new(work.coherent);
    let rays: Vec<Ray> = work.rays.iter().map(native).collect();
    match work.query {
        Query::Closest => Box::new(move || {
            let mut tally = Tally::default();
            for &ray in &rays {
                let mut ray = RayHit { ray, hit: NO_HIT };
                // SAFETY: the scene outlives the run; context and ray are this function's own.
                unsafe { rtcIntersect1(scene.get(), &raw mut context, &raw mut ray) };
                tally.add(if ray.hit.geometry == INVALID { f32::INFINITY } else { ray.ray.far });
            }
            tally
        }),
        Query::Any => Box::new(move || {
            let mut hits = 0;
            for &ray in &rays {
                let mut ray = ray;
                // SAFETY: as above.
                unsafe { rtcOccluded1(scene.get(), &raw mut context, &raw mut ray) };
                hits += u64::from(is_occluded(ray.far));
            }
            Tally { hits, distance: 0.0 }
        }),
    }
}

fn packets<'a, const N: usize>(
    work: &'a Workload,
    intersect: impl Fn(*const c_int, *mut Context, *mut RayHits<N>) + Send + 'a,
    occluded: impl Fn(*const c_int, *mut Context, *mut Rays<N>) + Send + 'a,
) -> Run<'a> {
    static ALL: Valid = Valid([-1; 16]);
    let mut context = Context::new(work.coherent);
    let packets: Vec<Rays<N>> = work.rays.chunks(N).map(packet).collect();
    let no_hits = Hits {
        normal: [[0.0; N]; 3],
        u: [0.0; N],
        v: [0.0; N],
        primitive: [INVALID; N],
        geometry: [INVALID; N],
        instance: [INVALID; N],
    };
    match work.query {
        Query::Closest => Box::new(move || {
            let mut tally = Tally::default();
            for &rays in &packets {
                let mut rays = RayHits { rays, hits: no_hits };
                intersect(ALL.0.as_ptr(), &raw mut context, &raw mut rays);
                for lane in 0..N {
                    let hit = rays.hits.geometry[lane] != INVALID;
                    tally.add(if hit { rays.rays.far[lane] } else { f32::INFINITY });
                }
            }
            tally
        }),
        Query::Any => Box::new(move || {
            // Unused lanes of the last packet end before they begin, which also marks occlusion.
            let unused = (packets.len() * N - work.rays.len()) as u64;
            let mut hits = 0;
            for &rays in &packets {
                let mut rays = rays;
                occluded(ALL.0.as_ptr(), &raw mut context, &raw mut rays);
                hits += rays.far.iter().filter(|&&far| is_occluded(far)).count() as u64;
            }
            Tally { hits: hits - unused, distance: 0.0 }
        }),
    }
}

fn packet<const N: usize>(rays: &[bvhscope_engine::geometry::Ray]) -> Rays<N> {
    let mut packet = Rays {
        origin: [[0.0; N]; 3],
        near: [0.0; N],
        direction: [[1.0; N]; 3],
        time: [0.0; N],
        far: [f32::NEG_INFINITY; N],
        mask: [u32::MAX; N],
        id: [0; N],
        flags: [0; N],
    };
    for (lane, ray) in rays.iter().enumerate() {
        for axis in 0..3 {
            packet.origin[axis][lane] = ray.origin[axis];
            packet.direction[axis][lane] = ray.direction[axis];
        }
        packet.near[lane] = ray.t_min;
        packet.far[lane] = ray.t_max;
    }
    packet
}

fn stream(scene: SceneRef, work: &Workload) -> Run<'_> {
    let mut context = Context::new(work.coherent);
    let rays: Vec<Ray> = work.rays.iter().map(native).collect();
    match work.query {
        Query::Closest => Box::new(move || {
            let mut tally = Tally::default();
            let mut hits = Vec::with_capacity(STREAM);
            for rays in rays.chunks(STREAM) {
                hits.clear();
                hits.extend(rays.iter().map(|&ray| RayHit { ray, hit: NO_HIT }));
                let stride = size_of::<RayHit>();
                // SAFETY: the scene outlives the run; the pointer, count and stride are the vector's.
                unsafe {
                    rtcIntersect1M(scene.get(), &raw mut context, hits.as_mut_ptr(), hits.len() as c_uint, stride)
                };
                for hit in &hits {
                    tally.add(if hit.hit.geometry == INVALID { f32::INFINITY } else { hit.ray.far });
                }
            }
            tally
        }),
        Query::Any => Box::new(move || {
            let mut count = 0;
            let mut stream = Vec::with_capacity(STREAM);
            for rays in rays.chunks(STREAM) {
                stream.clear();
                stream.extend_from_slice(rays);
                let stride = size_of::<Ray>();
                // SAFETY: as above.
                unsafe {
                    rtcOccluded1M(scene.get(), &raw mut context, stream.as_mut_ptr(), stream.len() as c_uint, stride)
                };
                count += stream.iter().filter(|ray| is_occluded(ray.far)).count() as u64;
            }
            Tally { hits: count, distance: 0.0 }
        }),
    }
}
