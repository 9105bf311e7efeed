//! Tests counted by hand: four triangles in a row, their tree of seven nodes, and rays through the middle of each. What a heat map,
//! a picture and a measurement show of them must be these numbers and no others.

use std::sync::Arc;

use bvhscope::accel::Accel;
use bvhscope::camera::{Camera, Projection};
use bvhscope::catalog::numbers::rows::{
    BYTES_PER_TRIANGLE, CONTAINER_TESTS_PER_RAY, EPO, HITS, LEAF_SIZE, LEAVES, MAX_DEPTH, MEAN_LEAF_DEPTH, NODES,
    PRIMITIVE_TESTS_PER_RAY, RAYS, SAH_COST, TESTS_PER_RAY, TREE_BYTES, TRIANGLE_BYTES,
};
use bvhscope::lab::population::Populations;
use bvhscope::lab::{Measurement, Setup, Subject, TraceView, measure};
use bvhscope::render::{
    HeatKind, RenderRequest, RenderSettings, Shading, count_tests, render, trace_primary, trace_primary_wide,
};
use bvhscope::scene::{LoadOptions, Scene, SceneSource, load};
use bvhscope::view::Place;
use bvhscope_engine::CancelToken;
use bvhscope_engine::geometry::{Aabb, Triangle};
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::settings::{BuildSettings, Preset};
use bvhscope_engine::tree::traverse::{TestCounts, Traversal};
use bvhscope_engine::tree::{ContainerKind, Node};
use glam::Vec3;

/// A triangle whose box is 0.8 wide and 0.9 high, in the middle of the pixel from `x` to `x + 1`.
fn triangle(x: f32, z: f32) -> Triangle {
    Triangle { a: Vec3::new(x + 0.1, 0.0, z), b: Vec3::new(x + 0.9, 0.0, z), c: Vec3::new(x + 0.5, 0.9, z) }
}

/// Two pairs of neighbours, far apart: the root has the pairs as its children, and these the triangles.
fn two_pairs() -> Arc<Scene> {
    let triangles = [0.0, 1.0, 10.0, 11.0].map(|x| triangle(x, 0.0)).to_vec();
    Arc::new(Scene::from_triangles(SceneSource::default_builtin(), triangles))
}

/// The pixels from -1 to 13, each 1 wide and 1 high, seen along -z.
const PIXELS: [u32; 2] = [14, 1];

fn camera() -> Camera {
    let target = Vec3::new(6.0, 0.4, 0.0);
    let fov_y = 2.0 * (0.5_f32 / 4.0).atan();
    Camera { eye: target + Vec3::Z * 4.0, target, up: Vec3::Y, fov_y, projection: Projection::Orthographic }
}

fn settings() -> BuildSettings {
    BuildSettings::preset(Preset::Fast, ContainerKind::Aabb)
}

fn request(scene: &Arc<Scene>, shading: Shading, count_tests: bool) -> RenderRequest {
    let accel = Accel::build(scene, &settings(), &CancelToken::new()).unwrap();
    let settings = RenderSettings { shading, samples: 1, ..RenderSettings::default() };
    RenderRequest { count_tests, ..RenderRequest::new(&Arc::new(accel), camera(), settings, PIXELS) }
}

/// Container tests of each pixel. Beside the root: the root. Between the pairs: the root and its two children. Through a triangle:
/// these and the two triangles' leaves.
const CONTAINERS: [f32; 14] = [1.0, 5.0, 5.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0, 5.0, 5.0, 1.0];
/// Primitive tests of each pixel: the triangle, where there is one.
const PRIMITIVES: [f32; 14] = [0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0];

#[test]
fn heat_maps_show_the_tests_of_each_ray() {
    let scene = two_pairs();
    let kinds = [HeatKind::Containers, HeatKind::Primitives, HeatKind::Both, HeatKind::AllHits, HeatKind::ClosestPoint];
    for (kind, name) in kinds.map(|kind| (kind, kind.counted())) {
        let frame = render(&request(&scene, Shading::Heat(kind), false), &CancelToken::new(), &|_| ()).unwrap();
        let expected: Vec<f32> = match kind {
            HeatKind::Containers => CONTAINERS.to_vec(),
            HeatKind::Primitives => PRIMITIVES.to_vec(),
            // From a point of the plane through the triangles: the children of the root, those of the nearer pair, and the nearest triangle.
            HeatKind::ClosestPoint => vec![5.0; PIXELS[0] as usize],
            // Nothing is behind anything, so that all hits cost what the nearest does.
            _ => CONTAINERS.iter().zip(PRIMITIVES).map(|(a, b)| a + b).collect(),
        };
        assert_eq!(frame.values, expected, "{name} of each pixel");
        // Of the nearest hit, which these queries do not look for.
        let is_of_query = matches!(kind, HeatKind::AllHits | HeatKind::ClosestPoint);
        let per_ray = (!is_of_query).then_some([46.0 / 14.0, 4.0 / 14.0]);
        assert_eq!(frame.stats.tests_per_ray(), per_ray, "{name}");
    }
}

/// Two pairs of triangles, one pair behind the other. Whatever stops a ray, it goes on through the containers behind: beside the
/// triangles of a pair the root and both pairs; through one of each pair their leaves too.
#[test]
fn the_whole_ray_enters_what_is_behind_the_first_surface() {
    let triangles = [(0.0, 0.0), (2.0, 0.0), (0.0, -9.0), (2.0, -9.0)].map(|(x, z)| triangle(x, z)).to_vec();
    let scene = Arc::new(Scene::from_triangles(SceneSource::default_builtin(), triangles));
    for traversal in Traversal::ALL {
        let mut request = request(&scene, Shading::Heat(HeatKind::WholeRay), true);
        request.settings.traversal = traversal;
        let frame = render(&request, &CancelToken::new(), &|_| ()).unwrap();
        let mut expected = [0.0; 14];
        expected[1..4].copy_from_slice(&[5.0, 3.0, 5.0]);
        assert_eq!(frame.values, expected, "{traversal:?}");
        assert_eq!(frame.primitive.iter().filter(|&&primitive| primitive < 2).count(), 2, "the nearer ones are hit");
        let of_heat = render(
            &RenderRequest {
                settings: RenderSettings { shading: Shading::Heat(HeatKind::Both), ..request.settings },
                ..request
            },
            &CancelToken::new(),
            &|_| (),
        );
        assert_eq!(
            frame.stats.tests_per_ray(),
            of_heat.unwrap().stats.tests_per_ray(),
            "tests are those of the traversal"
        );
    }
}

/// Behind a hidden triangle nothing is entered a second time.
#[test]
fn hidden_triangles_do_not_count_a_container_twice() {
    use bvhscope::visibility::TriangleSet;
    let scene = two_pairs();
    let shown = request(&scene, Shading::Heat(HeatKind::WholeRay), false);
    let mut hidden = TriangleSet::none(4);
    hidden.insert(1);
    let without = RenderRequest { hidden: Some(Arc::new(hidden)), ..shown.clone() };
    let [all, without] = [shown, without].map(|request| render(&request, &CancelToken::new(), &|_| ()).unwrap());
    assert_eq!(without.values, all.values);
    assert_eq!([all.stats.hits, without.stats.hits], [4, 3]);
}

#[test]
fn pictures_and_summaries_carry_the_same_counts() {
    let request = request(&two_pairs(), Shading::Lit, true);
    let frame = render(&request, &CancelToken::new(), &|_| ()).unwrap();
    assert_eq!(frame.stats.tests_per_ray(), Some([46.0 / 14.0, 4.0 / 14.0]), "a picture that is lit");
    assert_eq!((frame.stats.primary_rays, frame.stats.hits), (14, 4));
    let summary = count_tests(&request, &CancelToken::new()).unwrap();
    assert_eq!((summary.rays, summary.hits), (14, 4));
    assert_eq!((summary.container_tests_per_ray, summary.primitive_tests_per_ray), (46.0 / 14.0, 4.0 / 14.0));
}

/// Rays that miss the root's box read its node all the same, four lines, and are left out of the mean.
#[test]
fn summaries_count_the_cache_lines_of_the_rays_that_enter_the_root() {
    let source = SceneSource::Builtin { name: "teapot".to_owned(), size: Some(4) };
    let scene = Arc::new(load(&source, &LoadOptions::default(), &CancelToken::new()).unwrap());
    let accel = Arc::new(Accel::build(&scene, &settings(), &CancelToken::new()).unwrap());
    let settings = RenderSettings { shading: Shading::Heat(HeatKind::Lines), ..RenderSettings::default() };
    let request = RenderRequest::new(&accel, Camera::framing(&scene.bounds, scene.up), settings, [60, 50]);
    let frame = render(&request, &CancelToken::new(), &|_| ()).unwrap();
    let summary = count_tests(&request, &CancelToken::new()).unwrap();
    assert!(summary.entering > 500 && summary.entering < summary.rays, "{summary:?}");
    let shown = frame.values.iter().map(|&value| f64::from(value)).sum::<f64>() as u64;
    let lines = summary.lines.nodes + summary.lines.triangles;
    assert_eq!(shown, lines + 4 * (summary.rays - summary.entering));
    let means = summary.of_entering_ray().unwrap();
    let sum = f64::from(means.lines[0] + means.lines[1]) * summary.entering as f64;
    assert!((sum - lines as f64).abs() < 1.0, "{means:?}");
    assert!(summary.lines.triangles > summary.hits, "{summary:?}");
}

/// One triangle behind the other in one pixel: only the papers' order tests both.
#[test]
fn the_near_child_is_tested_first_unless_the_paper_is_followed() {
    for depths in [[0.0, -1.0], [-1.0, 0.0]] {
        let triangles = depths.map(|z| triangle(0.0, z)).to_vec();
        let scene = Arc::new(Scene::from_triangles(SceneSource::default_builtin(), triangles));
        let accel = Accel::build(&scene, &settings(), &CancelToken::new()).unwrap();
        let ray = camera().for_size(PIXELS[0], PIXELS[1]).ray(1.5, 0.5);
        for (traversal, primitives) in [(Traversal::Ordered, 1), (Traversal::Paper, 2)] {
            let mut counts = TestCounts::default();
            let hit = accel.closest_hit_with(&ray, traversal, &mut counts).unwrap();
            assert_eq!(depths[hit.primitive_index as usize], 0.0, "the nearer one is hit");
            let expected = TestCounts { containers: 3, primitives };
            assert_eq!(counts, expected, "{traversal:?}, triangles at {depths:?}");
        }
    }
}

/// The row of the four triangles: every number that does not depend on time.
#[test]
fn measurements_of_a_known_tree_are_exact() {
    let subject = Subject {
        model: "four".to_owned(),
        scene: two_pairs(),
        trees: Vec::new(),
        forms: Vec::new(),
        rays: None,
        load: LoadOptions::default(),
    };
    let view = TraceView {
        camera: camera(),
        place: Place::Given,
        size: PIXELS,
        traversal: Traversal::Ordered,
        simd: SimdLevel::best(),
        repeat: 2,
        populations: Populations::NONE,
        epo_samples: None,
    };
    let setups = [Setup { build: settings(), preset: Some(Preset::Fast), threads: 2 }];
    let mut rows: Vec<Measurement> = Vec::new();
    measure("bench", &subject, &setups, &view, &CancelToken::new(), &mut |row| rows.push(row)).unwrap();
    let row = &rows[0];
    assert_eq!((rows.len(), row.threads, row.repeat, row.triangles), (1, 2, 2, 4));
    assert_eq!((row.number(RAYS), row.number(HITS)), (14.0, 4.0));
    let tests = [row.number(CONTAINER_TESTS_PER_RAY), row.number(PRIMITIVE_TESTS_PER_RAY), row.number(TESTS_PER_RAY)];
    for (found, expected) in tests.into_iter().zip([46.0, 4.0, 50.0]) {
        assert!((found * 14.0 - expected).abs() < 1e-5, "{found} tests a ray instead of {expected} of 14 rays");
    }
    assert_eq!((row.number(NODES), row.number(LEAVES), row.number(MAX_DEPTH)), (7.0, 4.0, 2.0));
    assert_eq!(row.number(MEAN_LEAF_DEPTH), 2.0);
    assert_eq!(row.values.value(LEAF_SIZE), Some(&serde_json::json!([1.0, 1.0, 1.0])));
    // Of boxes 0.9 high: the root is 11.8 wide, its children 1.8, the leaves 0.8. Every test costs 1.
    let cost = (11.8 + 2.0 * 1.8 + 4.0 * 0.8) / 11.8;
    assert!((row.number(SAH_COST) - cost).abs() < 1e-6, "SAH cost {} instead of {cost}", row.number(SAH_COST));
    assert_eq!(row.number(EPO), 0.0, "no triangle reaches into another's boxes");
    // Nodes of 32 bytes, an index of 4 bytes and 36 bytes of coordinates for each triangle.
    assert_eq!(size_of::<Node<Aabb>>(), 32);
    assert_eq!((row.number(TREE_BYTES), row.number(TRIANGLE_BYTES)), ((7 * 32 + 4 * 4) as f64, (4 * 36) as f64));
    assert_eq!(row.number(BYTES_PER_TRIANGLE), (7 * 32 + 4 * 4 + 4 * 36) as f64 / 4.0);
}

#[test]
fn each_trace_takes_the_tree_of_its_name() {
    let wide = request(&two_pairs(), Shading::Lit, false);
    let binary = Accel::build_binary(&two_pairs(), &settings(), &CancelToken::new()).unwrap();
    let binary = RenderRequest { accel: Arc::new(binary), ..wide.clone() };
    let trace = trace_primary(&binary, Traversal::Ordered, &CancelToken::new()).unwrap();
    assert!(binary.accel.known_wide().is_none(), "the binary tree is traced without making the wide one");
    let through_wide = trace_primary_wide(&binary, &CancelToken::new()).unwrap();
    assert!(binary.accel.known_wide().is_some());
    assert_eq!([trace.rays, trace.hits], [14, 4]);
    assert_eq!([through_wide.rays, through_wide.hits], [14, 4]);
}
