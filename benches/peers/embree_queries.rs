//! All hits of a ray and the nearest point of a mesh by Embree: it leaves what is done with a hit, and the distance to a triangle, to
//! functions of its users, which are here as its own tutorials have them.

#![allow(unsafe_code, reason = "Embree is a C library; only the embree*.rs files touch it")]

use std::ffi::{c_int, c_uint, c_void};

use glam::Vec3;

use crate::embree::{Mesh, Scene};
use crate::embree_rays::{Arguments, Calls, Context, INVALID, Ray, native, no_hit_of};
use crate::peer::{Interface, Run};
use crate::rays::{Query, Tally, Workload};

/// Distance and triangle of the hits of a ray.
type Found = Vec<(f32, u32)>;

/// Flag of Embree 4: the arguments have a filter function.
const INVOKE_FILTER: c_uint = 1 << 1;

/// The context of a query with the list that its hits are kept in. Embree 4 has less before the list.
#[repr(C)]
struct Collection<'a> {
    context: Context,
    found: &'a mut Found,
}

/// Arguments of a filter function.
#[repr(C)]
struct FilterArguments {
    valid: *mut c_int,
    geometry: *const c_void,
    context: *mut c_void,
    ray: *const Ray,
    hit: *const [f32; 8],
    lanes: u32,
}

/// Keeps the hit of a ray in the list of its query, and lets the ray go on.
///
/// # Safety
///
/// For a query of a single ray whose context is a [`Collection`].
unsafe extern "C" fn keep_hit(arguments: *const FilterArguments) {
    // SAFETY: Embree passes the arguments of one ray and the context of the query, whose list nobody else uses meanwhile.
    unsafe {
        let arguments = &*arguments;
        let triangle = (*arguments.hit)[5].to_bits();
        (*arguments.context.cast::<Collection>()).found.push(((*arguments.ray).far, triangle));
        *arguments.valid = 0;
    }
}

/// Puts the hits of `ray` into `found`, in any order.
fn collect<const MORE: usize>(calls: &Calls<MORE>, ray: Ray, found: &mut Found) {
    let filter = (keep_hit as unsafe extern "C" fn(*const FilterArguments)) as *const c_void;
    let mut collection = Collection { context: Context { filter, ..calls.context }, found };
    let context: *mut c_void = (&raw mut collection).cast();
    let mut arguments = Arguments { flags: calls.arguments.flags | INVOKE_FILTER, context, filter, ..calls.arguments };
    let mut ray = no_hit_of::<MORE>(ray);
    let ray = (&raw mut ray).cast();
    let [a, b] = if MORE == 0 { [context, ray] } else { [ray, (&raw mut arguments).cast()] };
    // SAFETY: the scene outlives every run of it; the pointers are of the types that this version reads.
    unsafe { (calls.queries.intersect1)(calls.scene, a, b) };
}

/// All hits of each ray in order, as this engine returns them.
pub fn all_hits<'a>(scene: &'a Scene<'a>) -> Interface<'a> {
    Interface {
        engine: scene.library.name,
        setting: scene.mode.name(),
        name: "single, filter",
        prepare: Box::new(move |work| {
            (work.query == Query::All).then(|| match scene.library.streams {
                Some(_) => of_version::<0>(scene, work),
                None => of_version::<1>(scene, work),
            })
        }),
    }
}

fn of_version<'a, const MORE: usize>(scene: &'a Scene<'a>, work: &'a Workload) -> Run<'a> {
    let rays: Vec<Ray> = work.rays.iter().map(native).collect();
    let calls = Calls::<MORE>::new(scene, work);
    Box::new(move || {
        let (mut tally, mut found) = (Tally::default(), Found::new());
        for &ray in &rays {
            found.clear();
            collect(&calls, ray, &mut found);
            found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            // Embree may call the function several times for one hit.
            found.dedup_by_key(|hit| hit.1);
            found.iter().for_each(|hit| tally.add(hit.0));
        }
        tally
    })
}

/// A point with the radius in which the nearest point is sought (`RTCPointQuery`).
#[repr(C, align(16))]
struct PointQuery {
    point: [f32; 3],
    time: f32,
    radius: f32,
}

/// Instances that the query is in (`RTCPointQueryContext`): none.
#[repr(C, align(16))]
struct PointContext {
    matrices: [f32; 32],
    /// Identifiers of instances, of which Embree 4 has more, then their number.
    instances: [u32; 4],
}

/// Arguments of a function that measures the distance to a triangle.
#[repr(C, align(16))]
struct PointArguments {
    query: *mut PointQuery,
    search: *mut c_void,
    primitive: u32,
    geometry: u32,
    context: *const c_void,
    scale: f32,
}

/// The mesh, and the nearest point so far.
struct Search<'a> {
    mesh: &'a Mesh,
    nearest: Option<(f32, u32)>,
}

/// Measures the distance to a triangle; true where it is the nearest so far.
///
/// # Safety
///
/// For a query that was started with a [`Search`] over the mesh of its scene.
unsafe extern "C" fn measure_triangle(arguments: *mut c_void) -> bool {
    // SAFETY: Embree passes the query and what it was started with, which nobody else holds.
    let (query, search, triangle) = unsafe {
        let arguments = &*arguments.cast::<PointArguments>();
        (&mut *arguments.query, &mut *arguments.search.cast::<Search>(), arguments.primitive)
    };
    let corners = search.mesh.indices[triangle as usize].map(|index| search.mesh.vertices[index as usize].into());
    let point = Vec3::from(query.point);
    let distance = nearest_point(corners, point).distance(point);
    let is_nearer = distance < query.radius;
    if is_nearer {
        query.radius = distance;
        search.nearest = Some((distance, triangle));
    }
    is_nearer
}

/// The point of a triangle nearest to `p` (Ericson, *Real-Time Collision Detection*, 2005, section 5.1.5), in single precision, as in
/// Embree's tutorial `closest_point`.
fn nearest_point([a, b, c]: [Vec3; 3], p: Vec3) -> Vec3 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let scale = 1.0 / (va + vb + vc);
    a + ab * (vb * scale) + ac * (vc * scale)
}

/// The nearest point of the mesh for each origin.
pub fn closest_point<'a>(scene: &'a Scene<'a>, mesh: &'a Mesh) -> Interface<'a> {
    Interface {
        engine: scene.library.name,
        setting: scene.mode.name(),
        name: "single",
        prepare: Box::new(move |work| (work.query == Query::Point).then(|| search_points(scene, mesh, work))),
    }
}

fn search_points<'a>(scene: &'a Scene<'a>, mesh: &'a Mesh, work: &'a Workload) -> Run<'a> {
    let function = scene.library.queries.point_query;
    let is_third = scene.library.streams.is_some();
    // The number of instances follows one identifier in Embree 3, two in Embree 4.
    let instances = if is_third { [INVALID, 0, 0, 0] } else { [INVALID, INVALID, 0, 0] };
    let scene = SharedScene(scene.handle());
    Box::new(move || {
        let scene = &scene;
        let mut tally = Tally::default();
        for ray in &work.rays {
            let mut query = PointQuery { point: ray.origin.into(), time: 0.0, radius: f32::INFINITY };
            let mut context = PointContext { matrices: [0.0; 32], instances };
            let mut search = Search { mesh, nearest: None };
            let (query, context) = ((&raw mut query).cast(), (&raw mut context).cast());
            // SAFETY: the scene outlives every run of it and was built from `mesh`; the others live until the call returns.
            unsafe { function(scene.0, query, context, Some(measure_triangle), (&raw mut search).cast()) };
            tally.add(search.nearest.map_or(f32::INFINITY, |nearest| nearest.0));
        }
        tally
    })
}

struct SharedScene(*mut c_void);

// SAFETY: Embree's queries of a committed scene are thread-safe.
unsafe impl Send for SharedScene {}
