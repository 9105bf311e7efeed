//! Rays through Embree's scenes: one by one, in packets, and in Embree 3 in streams.

#![allow(unsafe_code, reason = "Embree is a C library; only the embree*.rs files touch it")]

use std::ffi::{c_int, c_uint, c_void};
use std::ptr;

use crate::embree::Scene;
use crate::embree_library::{Queries, Streams};
use crate::peer::{Interface, Run};
use crate::rays::{Query, Tally, Workload};

/// Rays in a stream.
const STREAM: usize = 64;
/// Flags of rays whose neighbours run alike, in either version.
const COHERENT_3: c_uint = 1;
const COHERENT_4: c_uint = 1 << 16;
/// Every feature of Embree 4.
const ALL_FEATURES: c_uint = u32::MAX;
pub const INVALID: u32 = u32::MAX;

#[derive(Clone, Copy)]
#[repr(C, align(16))]
pub struct Ray {
    origin: [f32; 3],
    near: f32,
    direction: [f32; 3],
    time: f32,
    /// Distance of the hit, once there is one.
    pub far: f32,
    mask: u32,
    id: u32,
    flags: u32,
}

/// A hit, with `MORE` numbers of instances than Embree 3 has.
#[derive(Clone, Copy)]
#[repr(C, align(16))]
pub struct Hit<const MORE: usize> {
    normal: [f32; 3],
    u: f32,
    v: f32,
    primitive: u32,
    geometry: u32,
    instance: u32,
    more: [u32; MORE],
}

#[derive(Clone, Copy)]
#[repr(C)]
pub struct RayHit<const MORE: usize> {
    ray: Ray,
    hit: Hit<MORE>,
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

static ALL: Valid = Valid([-1; 16]);

#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Hits<const N: usize, const MORE: usize> {
    normal: [[f32; N]; 3],
    u: [f32; N],
    v: [f32; N],
    primitive: [u32; N],
    geometry: [u32; N],
    instance: [u32; N],
    more: [[u32; N]; MORE],
}

#[derive(Clone, Copy)]
#[repr(C)]
struct RayHits<const N: usize, const MORE: usize> {
    rays: Rays<N>,
    hits: Hits<N, MORE>,
}

/// Argument of each query of Embree 3.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct Context {
    pub flags: c_uint,
    pub filter: *const c_void,
    pub instance: [u32; 1],
}

/// Arguments of each query of Embree 4.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct Arguments {
    pub flags: c_uint,
    pub features: c_uint,
    pub context: *const c_void,
    pub filter: *const c_void,
    pub callback: *const c_void,
    pub least_width: f32,
}

/// The queries of a scene: of Embree 3 where hits have no `MORE` numbers, of Embree 4 where they have.
#[derive(Clone, Copy)]
pub struct Calls<const MORE: usize> {
    pub queries: Queries,
    pub scene: *mut c_void,
    pub context: Context,
    pub arguments: Arguments,
}

// SAFETY: Embree's queries of a committed scene are thread-safe; the other pointers are null.
unsafe impl<const MORE: usize> Send for Calls<MORE> {}

impl<const MORE: usize> Calls<MORE> {
    /// Those of a scene for a workload.
    pub fn new(scene: &Scene, work: &Workload) -> Self {
        let flags = |coherent: c_uint| if work.coherent { coherent } else { 0 };
        let none = ptr::null();
        Self {
            queries: scene.library.queries,
            scene: scene.handle(),
            context: Context { flags: flags(COHERENT_3), filter: none, instance: [INVALID] },
            arguments: Arguments {
                flags: flags(COHERENT_4),
                features: ALL_FEATURES,
                context: none,
                filter: none,
                callback: none,
                least_width: 0.0,
            },
        }
    }

    /// The last two parameters of a query, in the order of the version.
    #[inline(always)]
    fn pair<T>(&mut self, rays: &mut T) -> [*mut c_void; 2] {
        let rays = ptr::from_mut(rays).cast();
        if MORE == 0 { [(&raw mut self.context).cast(), rays] } else { [rays, (&raw mut self.arguments).cast()] }
    }

    #[inline(always)]
    fn intersect(&mut self, ray: &mut RayHit<MORE>) {
        let [a, b] = self.pair(ray);
        // SAFETY: the scene outlives every run of it; the pointers are of the types that this version reads.
        unsafe { (self.queries.intersect1)(self.scene, a, b) };
    }

    #[inline(always)]
    fn occluded(&mut self, ray: &mut Ray) {
        let [a, b] = self.pair(ray);
        // SAFETY: as above.
        unsafe { (self.queries.occluded1)(self.scene, a, b) };
    }

    #[inline(always)]
    fn intersect_packet<const N: usize>(&mut self, rays: &mut RayHits<N, MORE>) {
        let [a, b] = self.pair(rays);
        let function = if N == 8 { self.queries.intersect8 } else { self.queries.intersect16 };
        // SAFETY: as above; eight or sixteen lanes each are valid and aligned.
        unsafe { function(ALL.0.as_ptr(), self.scene, a, b) };
    }

    #[inline(always)]
    fn occluded_packet<const N: usize>(&mut self, rays: &mut Rays<N>) {
        let [a, b] = self.pair(rays);
        let function = if N == 8 { self.queries.occluded8 } else { self.queries.occluded16 };
        // SAFETY: as above.
        unsafe { function(ALL.0.as_ptr(), self.scene, a, b) };
    }
}

impl Calls<0> {
    fn intersect_stream(&mut self, streams: Streams, rays: &mut [RayHit<0>]) {
        let (first, count, stride) = (rays.as_mut_ptr().cast(), rays.len() as c_uint, size_of::<RayHit<0>>());
        // SAFETY: the scene outlives every run of it; the pointer, count and stride are the slice's.
        unsafe { (streams.intersect)(self.scene, (&raw mut self.context).cast(), first, count, stride) };
    }

    fn occluded_stream(&mut self, streams: Streams, rays: &mut [Ray]) {
        let (first, count, stride) = (rays.as_mut_ptr().cast(), rays.len() as c_uint, size_of::<Ray>());
        // SAFETY: as above.
        unsafe { (streams.occluded)(self.scene, (&raw mut self.context).cast(), first, count, stride) };
    }
}

/// Every way to trace a scene.
pub fn interfaces<'a>(scene: &'a Scene<'a>) -> Vec<Interface<'a>> {
    match scene.library.streams {
        Some(streams) => {
            let mut interfaces = of_version::<0>(scene);
            interfaces.push(interface(scene, "stream", move |work| stream(Calls::new(scene, work), streams, work)));
            interfaces
        }
        None => of_version::<1>(scene),
    }
}

fn of_version<'a, const MORE: usize>(scene: &'a Scene<'a>) -> Vec<Interface<'a>> {
    let calls = move |work: &Workload| Calls::<MORE>::new(scene, work);
    vec![
        interface(scene, "single", move |work| single(calls(work), work)),
        interface(scene, "packet 8", move |work| packets::<8, MORE>(calls(work), work)),
        interface(scene, "packet 16", move |work| packets::<16, MORE>(calls(work), work)),
    ]
}

fn interface<'a>(
    scene: &Scene,
    name: &'static str,
    prepare: impl Fn(&'a Workload) -> Option<Run<'a>> + 'a,
) -> Interface<'a> {
    Interface { engine: scene.library.name, setting: scene.mode.name(), name, prepare: Box::new(prepare) }
}

/// A ray that has not hit anything yet.
pub fn no_hit_of<const MORE: usize>(ray: Ray) -> RayHit<MORE> {
    RayHit { ray, hit: no_hit() }
}

fn no_hit<const MORE: usize>() -> Hit<MORE> {
    Hit {
        normal: [0.0; 3],
        u: 0.0,
        v: 0.0,
        primitive: INVALID,
        geometry: INVALID,
        instance: INVALID,
        more: [INVALID; MORE],
    }
}

/// A ray as Embree wants it.
pub fn native(ray: &bvhscope_engine::geometry::Ray) -> Ray {
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

fn single<'a, const MORE: usize>(mut calls: Calls<MORE>, work: &Workload) -> Option<Run<'a>> {
    let rays: Vec<Ray> = work.rays.iter().map(native).collect();
    match work.query {
        Query::Closest => Some(Box::new(move || {
            let mut tally = Tally::default();
            for &ray in &rays {
                let mut ray = no_hit_of(ray);
                calls.intersect(&mut ray);
                tally.add(if ray.hit.geometry == INVALID { f32::INFINITY } else { ray.ray.far });
            }
            tally
        })),
        Query::Any => Some(Box::new(move || {
            let mut hits = 0;
            for &ray in &rays {
                let mut ray = ray;
                calls.occluded(&mut ray);
                hits += u64::from(is_occluded(ray.far));
            }
            Tally { hits, distance: 0.0 }
        })),
        Query::All | Query::Point => None,
    }
}

fn packets<'a, const N: usize, const MORE: usize>(mut calls: Calls<MORE>, work: &Workload) -> Option<Run<'a>> {
    let packets: Vec<Rays<N>> = work.rays.chunks(N).map(packet).collect();
    let no_hits = Hits {
        normal: [[0.0; N]; 3],
        u: [0.0; N],
        v: [0.0; N],
        primitive: [INVALID; N],
        geometry: [INVALID; N],
        instance: [INVALID; N],
        more: [[INVALID; N]; MORE],
    };
    match work.query {
        Query::Closest => Some(Box::new(move || {
            let mut tally = Tally::default();
            for &rays in &packets {
                let mut rays = RayHits { rays, hits: no_hits };
                calls.intersect_packet(&mut rays);
                for lane in 0..N {
                    let hit = rays.hits.geometry[lane] != INVALID;
                    tally.add(if hit { rays.rays.far[lane] } else { f32::INFINITY });
                }
            }
            tally
        })),
        Query::Any => {
            // Unused lanes of the last packet end before they begin, which also marks occlusion.
            let unused = (packets.len() * N - work.rays.len()) as u64;
            Some(Box::new(move || {
                let mut hits = 0;
                for &rays in &packets {
                    let mut rays = rays;
                    calls.occluded_packet(&mut rays);
                    hits += rays.far.iter().filter(|&&far| is_occluded(far)).count() as u64;
                }
                Tally { hits: hits - unused, distance: 0.0 }
            }))
        }
        Query::All | Query::Point => None,
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

fn stream<'a>(mut calls: Calls<0>, streams: Streams, work: &Workload) -> Option<Run<'a>> {
    let rays: Vec<Ray> = work.rays.iter().map(native).collect();
    match work.query {
        Query::Closest => Some(Box::new(move || {
            let mut tally = Tally::default();
            let mut hits: Vec<RayHit<0>> = Vec::with_capacity(STREAM);
            for rays in rays.chunks(STREAM) {
                hits.clear();
                hits.extend(rays.iter().map(|&ray| no_hit_of(ray)));
                calls.intersect_stream(streams, &mut hits);
                for hit in &hits {
                    tally.add(if hit.hit.geometry == INVALID { f32::INFINITY } else { hit.ray.far });
                }
            }
            tally
        })),
        Query::Any => Some(Box::new(move || {
            let mut count = 0;
            let mut stream: Vec<Ray> = Vec::with_capacity(STREAM);
            for rays in rays.chunks(STREAM) {
                stream.clear();
                stream.extend_from_slice(rays);
                calls.occluded_stream(streams, &mut stream);
                count += stream.iter().filter(|ray| is_occluded(ray.far)).count() as u64;
            }
            Tally { hits: count, distance: 0.0 }
        })),
        Query::All | Query::Point => None,
    }
}
