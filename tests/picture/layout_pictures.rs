//! Heat maps of layouts of wide trees: each pixel shows what the walker counts for its ray.

use std::sync::Arc;

use bvhscope::accel::Accel;
use bvhscope::accel::laid::CountedLayout;
use bvhscope::camera::Camera;
use bvhscope::catalog::layouts::LayoutChoice;
use bvhscope::lab::layouts::{LayoutPlan, kept_nodes, layouts};
use bvhscope::lab::population::{Population, ViewRays};
use bvhscope::render::{Frame, HeatKind, RenderRequest, RenderSettings, Shading, render};
use bvhscope::scene::{LoadOptions, Scene, SceneSource, load};
use bvhscope::visibility::TriangleSet;
use bvhscope_engine::CancelToken;
use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::layouts::{Collapse, Layout, Planes};
use bvhscope_engine::settings::BuildSettings;
use bvhscope_engine::tree::traverse::Traversal;
use glam::Vec3;

const SIZE: [u32; 2] = [90, 64];

fn terrain() -> Arc<Accel> {
    let source = SceneSource::Builtin { name: "terrain".to_owned(), size: Some(40_000) };
    let scene = Arc::new(load(&source, &LoadOptions::default(), &CancelToken::new()).unwrap());
    built(&scene)
}

fn built(scene: &Arc<Scene>) -> Arc<Accel> {
    Arc::new(Accel::build(scene, &BuildSettings::default(), &CancelToken::new()).unwrap())
}

fn request(accel: &Arc<Accel>, kind: HeatKind, choice: Option<LayoutChoice>) -> RenderRequest {
    let settings = RenderSettings { shading: Shading::Heat(kind), ..RenderSettings::default() };
    let camera = Camera::framing(&accel.scene.bounds, accel.scene.up);
    let mut request = RenderRequest::new(accel, camera, settings, SIZE);
    request.layout = choice.map(|choice| {
        let rays = ViewRays::new(Population::Primary, camera, SIZE, &settings);
        let rays = choice.is_by_visits().then_some(&rays);
        let kept = kept_nodes(accel, choice, rays, &CancelToken::new()).expect("a binary tree of boxes");
        CountedLayout { choice, kept: Arc::new(kept) }
    });
    request
}

fn traced(request: &RenderRequest) -> Frame {
    render(request, &CancelToken::new(), &|_| ()).unwrap()
}

fn sum(frame: &Frame) -> u64 {
    frame.values.iter().map(|&value| value as u64).sum()
}

#[test]
fn the_own_tree_as_a_layout_has_the_counts_of_the_tree_that_is_traced() {
    let accel = terrain();
    // Behind hidden triangles rays are traced again, and lines that they read twice count once.
    let first = traced(&request(&accel, HeatKind::Lines, None));
    let mut hidden = TriangleSet::none(accel.scene.triangles.len());
    first.primitive.iter().filter(|&&hit| hit != u32::MAX).for_each(|&hit| hidden.insert(hit));
    let hidden = Arc::new(hidden);
    for kind in [HeatKind::Lines, HeatKind::Steps] {
        let mut sums = Vec::new();
        for hidden in [None, Some(&hidden)] {
            let [own, layout] = [None, Some(LayoutChoice::Engine)]
                .map(|choice| RenderRequest { hidden: hidden.cloned(), ..request(&accel, kind, choice) })
                .map(|request| traced(&request));
            assert_eq!(own.values, layout.values, "{}", kind.counted());
            assert_eq!((sum(&own), &own.primitive), (sum(&layout), &layout.primitive));
            assert_eq!((own.layout, layout.layout), (None, Some(LayoutChoice::Engine)));
            sums.push(sum(&layout));
        }
        assert!(0 < sums[0] && sums[0] < sums[1], "{sums:?}");
    }
}

#[test]
fn the_pixels_of_a_layout_add_up_to_its_row_of_primary_rays() {
    let accel = terrain();
    let plan = LayoutPlan {
        children: vec![4, 16],
        collapses: vec![Collapse::Greedy, Collapse::Visits],
        planes: vec![Planes::F32, Planes::Bits8],
        leaf_sizes: vec![6],
    };
    let of_tree = traced(&request(&accel, HeatKind::Both, None));
    let rays = ViewRays::new(Population::Primary, of_tree.camera, SIZE, &of_tree.settings);
    let mut rows = Vec::new();
    layouts(&accel, &plan, &[rays], &CancelToken::new(), &mut |row| rows.push(row)).unwrap();
    assert_eq!(rows.len(), 9);
    let mut all = Vec::new();
    for row in rows {
        let per_ray = |kind: HeatKind| {
            let counted = RenderRequest { count_tests: true, ..request(&accel, kind, Some(row.layout.choice)) };
            let frame = traced(&counted);
            assert_eq!(frame.primitive, of_tree.primitive, "the picture stays the same");
            assert_eq!(frame.stats.tests_per_ray(), of_tree.stats.tests_per_ray(), "tests of a frame are its tree's");
            sum(&frame) as f64 / frame.stats.primary_rays as f64
        };
        let found = [HeatKind::Containers, HeatKind::Primitives, HeatKind::Both, HeatKind::Lines].map(per_ray);
        let rays = &row.rays;
        let expected =
            [rays.container_tests_per_ray, rays.primitive_tests_per_ray, rays.tests_per_ray, rays.lines_64_per_ray];
        assert_eq!(found, expected, "{}", row.layout.name());
        all.push(found.map(f64::to_bits));
    }
    all.sort_unstable();
    all.dedup();
    assert_eq!(all.len(), 9, "no two layouts cost the same");
}

#[test]
fn whole_rays_enter_the_boxes_that_are_stored_and_queries_stay_those_of_the_tree() {
    // Three pairs, one behind the other.
    let triangles = [0.0_f32, -9.0, -30.0].into_iter().flat_map(|z| {
        [0.0, 2.0].map(|x| Triangle {
            a: Vec3::new(x, 0.0, z),
            b: Vec3::new(x + 1.0, 0.0, z),
            c: Vec3::new(x + 0.5, 1.0, z),
        })
    });
    let scene = Arc::new(Scene::from_triangles(SceneSource::default_builtin(), triangles.collect()));
    let accel = built(&scene);
    let target = Vec3::new(1.5, 0.5, 0.0);
    let along_z = Camera { eye: target + Vec3::Z * 8.0, target, ..Camera::framing(&scene.bounds, Vec3::Y) };
    let binary = Layout { children: 2, collapse: Collapse::Greedy, planes: Planes::F32, leaf_size: 1 };
    for traversal in Traversal::ALL {
        let values = |kind: HeatKind, choice: Option<LayoutChoice>| {
            let mut request = request(&accel, kind, choice);
            request.settings.traversal = traversal;
            request.camera = along_z;
            traced(&request)
        };
        let layout = Some(LayoutChoice::Described(binary));
        let [tree, laid] = [None, layout].map(|choice| values(HeatKind::WholeRay, choice).values);
        // The box of the root is stored nowhere, and the same boxes are below it.
        let below_root: Vec<f32> = tree.iter().map(|boxes| (boxes - 1.0).max(0.0)).collect();
        assert_eq!(laid, below_root);
        assert!(laid.iter().any(|&boxes| boxes > 5.0));
        // Each ray tests the two children of the root, which the tree does after the root.
        let [tree, laid] = [None, layout].map(|choice| values(HeatKind::Containers, choice).values);
        let after_root: Vec<f32> = tree.iter().map(|&tests| if tests == 1.0 { 2.0 } else { tests - 1.0 }).collect();
        assert_eq!(laid, after_root, "{traversal:?}");
        for kind in [HeatKind::Copies, HeatKind::AllHits, HeatKind::ClosestPoint] {
            let [tree, laid] = [None, layout].map(|choice| values(kind, choice));
            assert_eq!((&tree.values, laid.layout), (&laid.values, None), "{}", kind.counted());
        }
    }
}
