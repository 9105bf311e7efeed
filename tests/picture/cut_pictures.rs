//! Hidden triangles and the section plane in pictures, heat maps and counts.

use std::collections::HashSet;
use std::sync::Arc;

use bvhscope::accel::Accel;
use bvhscope::camera::Camera;
use bvhscope::overlay::{NodeTable, Selection};
use bvhscope::render::{Frame, HeatKind, RenderRequest, RenderSettings, Shading, count_tests, render};
use bvhscope::scene::{LoadOptions, Scene, SceneSource, load};
use bvhscope::section::SectionPlane;
use bvhscope::visibility::{TriangleSet, Visibility};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::{PreparedRay, Ray, Shear, Triangle};
use bvhscope_engine::settings::{BuildSettings, Pass, Passes};
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::traverse::{TestCounts, Traversal};
use glam::Vec3;

const SIZE: [u32; 2] = [96, 72];

fn scene() -> Arc<Scene> {
    let source = SceneSource::parse("builtin:teapot:3".as_ref()).unwrap();
    Arc::new(load(&source, &LoadOptions::default(), &CancelToken::new()).unwrap())
}

fn accel(scene: &Arc<Scene>, container: ContainerKind) -> Arc<Accel> {
    let settings = BuildSettings { container, ..BuildSettings::default() };
    Arc::new(Accel::build(scene, &settings, &CancelToken::new()).unwrap())
}

fn request(accel: &Arc<Accel>, shading: Shading, section: Option<SectionPlane>) -> RenderRequest {
    RenderRequest::new(
        accel,
        Camera::framing(&accel.scene.bounds, accel.scene.up),
        RenderSettings { shading, section, samples: 1, ..RenderSettings::default() },
        SIZE,
    )
}

fn traced(request: &RenderRequest) -> Frame {
    render(request, &CancelToken::new(), &|_| ()).unwrap()
}

fn planes(scene: &Scene) -> Vec<SectionPlane> {
    let tilted = SectionPlane::through(&scene.bounds, Vec3::new(0.5, -0.7, 0.6));
    let [x, y, z] = Vec3::AXES.map(|axis| SectionPlane::through(&scene.bounds, axis));
    [x, y, z, tilted].into_iter().flat_map(|plane| [plane, SectionPlane { flipped: true, ..plane }]).collect()
}

/// The ray of each pixel's centre.
fn rays(request: &RenderRequest) -> Vec<Ray> {
    let frame = request.camera.for_size(SIZE[0], SIZE[1]);
    let pixel = |index: u32| frame.ray((index % SIZE[0]) as f32 + 0.5, (index / SIZE[0]) as f32 + 0.5);
    (0..SIZE[0] * SIZE[1]).map(pixel).collect()
}

/// Distance to the nearest of all triangles that are neither hidden nor cut off.
fn nearest(scene: &Scene, ray: &Ray, plane: Option<SectionPlane>, hidden: &TriangleSet) -> f32 {
    let (prepared, shear) = (PreparedRay::new(*ray), Shear::new(ray.direction));
    let visible = scene.triangles.iter().enumerate().filter(|(index, _)| !hidden.contains(*index as u32));
    let hits = visible.filter_map(|(_, triangle)| triangle.intersect(&prepared, &shear, f32::INFINITY));
    hits.map(|hit| hit.t).filter(|&t| plane.is_none_or(|plane| plane.keeps(ray.at(t)))).fold(f32::INFINITY, f32::min)
}

fn assert_traced(request: &RenderRequest, hidden: &TriangleSet, what: &str) {
    let (frame, plane) = (traced(request), request.settings.section);
    let expected = rays(request).into_iter().map(|ray| nearest(&request.accel.scene, &ray, plane, hidden));
    let differ = frame.distance.iter().zip(expected).filter(|(found, expected)| (*found - expected).abs() > 1e-4);
    // At the plane itself, rounding decides what is kept.
    let differ = differ.filter(|(found, expected)| found.is_finite() || expected.is_finite()).count();
    assert!(differ <= 4, "{what}: {differ} pixels");
}

#[test]
fn a_cut_model_shows_what_brute_force_finds_in_the_kept_half() {
    let scene = scene();
    let none = TriangleSet::none(scene.triangles.len());
    for container in ContainerKind::ALL {
        let accel = accel(&scene, container);
        for plane in planes(&scene) {
            for shading in
                [Shading::Lit, Shading::AmbientOcclusion, Shading::Heat(HeatKind::Both), Shading::Heat(HeatKind::Steps)]
            {
                let request = request(&accel, shading, Some(plane));
                assert_traced(&request, &none, &format!("{container:?} {plane:?} {}", shading.name()));
                let coarse = RenderRequest { coarseness: 2.0, ..request };
                assert!(traced(&coarse).stats.hits > 0);
            }
        }
    }
}

#[test]
fn heat_maps_of_a_cut_model_count_the_tests_of_the_clipped_rays() {
    let scene = scene();
    let accel = accel(&scene, ContainerKind::Aabb);
    for plane in planes(&scene) {
        let request = request(&accel, Shading::Heat(HeatKind::Both), Some(plane));
        let counts = |ray: &Ray| {
            let mut tests = TestCounts::default();
            accel.closest_hit_with(&plane.clip(ray), Traversal::Ordered, &mut tests);
            tests.total() as f32
        };
        let expected: Vec<f32> = rays(&request).iter().map(counts).collect();
        let frame = traced(&request);
        assert_eq!(frame.values, expected, "{plane:?}");
        let summary = count_tests(&request, &CancelToken::new()).unwrap();
        assert_eq!((summary.rays, summary.hits), (frame.stats.primary_rays, frame.stats.hits));
        let [containers, primitives] = frame.stats.tests_per_ray().unwrap();
        assert_eq!([summary.container_tests_per_ray, summary.primitive_tests_per_ray], [containers, primitives]);
    }
}

/// A hidden or isolated subtree gives the picture of a model without the hidden triangles.
#[test]
fn hidden_triangles_are_missing_in_every_shading() {
    let scene = scene();
    for container in ContainerKind::ALL {
        let accel = accel(&scene, container);
        let table = NodeTable::new(&accel);
        let (first, second) = (table.children(0).start, table.children(0).start + 1);
        let deeper = table.children(second).start;
        for (hidden, isolated) in
            [(vec![first], None), (vec![deeper], None), (vec![], Some(second)), (vec![deeper], Some(second))]
        {
            let selection = Selection { hidden: hidden.into_iter().collect(), isolated, ..Selection::default() };
            let visibility = table.visibility(&selection).unwrap();
            assert!(Arc::ptr_eq(&visibility, &table.visibility(&selection).unwrap()), "the same until it changes");
            for shading in [Shading::Lit, Shading::Heat(HeatKind::Both), Shading::Heat(HeatKind::Steps)] {
                for section in [None, Some(SectionPlane::through(&scene.bounds, Vec3::Z))] {
                    let request = request(&accel, shading, section);
                    let whole = traced(&request).stats.hits;
                    let request = RenderRequest { hidden: Some(Arc::clone(&visibility.triangles)), ..request };
                    assert_traced(&request, &visibility.triangles, &format!("{selection:?} {}", shading.name()));
                    assert!(traced(&request).stats.hits <= whole);
                }
            }
        }
    }
}

#[test]
fn rays_that_pass_hidden_triangles_count_all_their_tests() {
    let accel = accel(&scene(), ContainerKind::Aabb);
    let table = NodeTable::new(&accel);
    let first = table.children(0).start;
    let visibility = table.visibility(&Selection { hidden: [first].into(), ..Selection::default() }).unwrap();
    let whole = request(&accel, Shading::Heat(HeatKind::Both), None);
    let part = RenderRequest { hidden: Some(Arc::clone(&visibility.triangles)), ..whole.clone() };
    let (whole, part) = (traced(&whole), traced(&part));
    for (index, (before, after)) in whole.values.iter().zip(&part.values).enumerate() {
        let passes = whole.primitive[index] != u32::MAX && visibility.triangles.contains(whole.primitive[index]);
        assert_eq!(passes, after > before, "pixel {index}: {before}, then {after}");
    }
}

#[test]
fn shadows_and_occlusion_know_what_is_missing() {
    let scene = scene();
    let accel = accel(&scene, ContainerKind::Aabb);
    let mut all_but_one = TriangleSet::none(scene.triangles.len());
    (0..scene.triangles.len() as u32).for_each(|triangle| all_but_one.insert(triangle));
    let whole = traced(&request(&accel, Shading::AmbientOcclusion, None));
    let seen = whole.primitive.iter().copied().find(|&triangle| triangle != u32::MAX).unwrap();
    all_but_one.remove(seen);
    let alone = RenderRequest {
        hidden: Some(Arc::new(all_but_one)),
        settings: RenderSettings { samples: 1, ..request(&accel, Shading::AmbientOcclusion, None).settings },
        ..request(&accel, Shading::AmbientOcclusion, None)
    };
    let frame = traced(&alone);
    let of_triangle = frame.primitive.iter().zip(&frame.rgba).filter(|(triangle, _)| **triangle == seen);
    let inner: Vec<u8> = of_triangle.map(|(_, [r, ..])| *r).collect();
    assert!(!inner.is_empty() && inner.contains(&242), "a triangle alone is open to all sides: {inner:?}");
}

/// A triangle that was split is hidden only with all its parts.
#[test]
fn a_split_triangle_is_hidden_with_its_last_part() {
    let mut random = 1_u32;
    let mut number = || {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (random >> 8) as f32 / (1 << 24) as f32 * 10.0
    };
    let mut point = || Vec3::new(number(), number(), number());
    let triangles = (0..500).map(|_| Triangle { a: point(), b: point(), c: point() }).collect();
    let scene = Arc::new(Scene::from_triangles(SceneSource::default_builtin(), triangles));
    let settings = BuildSettings { optimize: Passes::NONE.with(Pass::Split), ..BuildSettings::default() };
    let accel = Arc::new(Accel::build(&scene, &settings, &CancelToken::new()).unwrap());
    let table = NodeTable::new(&accel);
    let indices = accel.tree.primitive_indices();
    assert!(indices.len() > scene.triangles.len(), "some triangles are split");
    let parts = |triangle: u32| indices.iter().filter(|&&index| index == triangle).count();
    let mut shared = 0;
    for node in (0..table.len() as u32).step_by(29) {
        let hidden = Visibility::new(&accel, &[node].into(), None, None).triangles;
        let isolated = Visibility::new(&accel, &HashSet::new(), Some(node), None).triangles;
        let below = table.triangles_below(node);
        for triangle in 0..scene.triangles.len() as u32 {
            assert_eq!(isolated.contains(triangle), !below.contains(triangle), "any part is enough to stay");
            assert!(!hidden.contains(triangle) || below.contains(triangle));
            if below.contains(triangle) && !hidden.contains(triangle) {
                assert!(parts(triangle) > 1, "another part of triangle {triangle} is visible");
                shared += 1;
            }
        }
    }
    assert!(shared > 0, "some triangles have parts on both sides");
}
