//! Recorded rays: their steps are those of the rays that pictures and counters trace, and their visits are counted right.

use std::collections::HashSet;
use std::sync::Arc;

use bvhscope::accel::Accel;
use bvhscope::camera::Camera;
use bvhscope::lab::ray::{RayMethod, RayRecord, RayRequest, Step, Visit, record};
use bvhscope::overlay::{NodeTable, Selection};
use bvhscope::render::{HeatKind, RayKind, RayStart, RenderRequest, RenderSettings, Shading, render};
use bvhscope::scene::{LoadOptions, Scene, SceneSource, load};
use bvhscope::section::SectionPlane;
use bvhscope::visibility::TriangleSet;
use bvhscope_engine::CancelToken;
use bvhscope_engine::geometry::{Ray, Triangle};
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::settings::{BuildSettings, Pass, Passes};
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::traverse::{RayEvent, TestCounts, Traversal};
use glam::Vec3;

const SIZE: [u32; 2] = [40, 30];

fn teapot(container: ContainerKind, optimize: Passes) -> Arc<Accel> {
    let token = CancelToken::new();
    let source = SceneSource::Builtin { name: "teapot".to_owned(), size: Some(3) };
    let scene = Arc::new(load(&source, &LoadOptions::default(), &token).unwrap());
    let settings = BuildSettings { container, optimize, ..BuildSettings::default() };
    Arc::new(Accel::build(&scene, &settings, &token).unwrap())
}

/// Boxes and spheres, with one and with several triangles a leaf.
fn trees() -> Vec<Arc<Accel>> {
    let collapsed = Passes::NONE.with(Pass::Collapse);
    vec![
        teapot(ContainerKind::Aabb, Passes::NONE),
        teapot(ContainerKind::Sphere, Passes::NONE),
        teapot(ContainerKind::Aabb, collapsed),
        teapot(ContainerKind::Sphere, collapsed),
    ]
}

fn request(accel: &Accel, method: RayMethod) -> RayRequest {
    RayRequest {
        start: RayStart::Pixel([0, 0]),
        kind: RayKind::Primary,
        method,
        camera: Camera::framing(&accel.scene.bounds, accel.scene.up),
        size_px: SIZE,
        settings: RenderSettings::default(),
        hidden: None,
    }
}

fn pixels() -> impl Iterator<Item = [u32; 2]> {
    (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| [x, y]))
}

fn recorded(accel: &Arc<Accel>, request: &RayRequest) -> Option<RayRecord> {
    record(accel, request, &CancelToken::new()).unwrap().ok()
}

/// The tests that each pixel of a heat map shows.
fn heat(accel: &Arc<Accel>, request: &RayRequest) -> Vec<f32> {
    match request.method {
        RayMethod::Binary(traversal) => heat_of(accel, request, HeatKind::Both, traversal),
        RayMethod::Wide => heat_of(accel, request, HeatKind::Steps, Traversal::Ordered),
    }
}

/// The value of each pixel of a heat map.
fn heat_of(accel: &Arc<Accel>, request: &RayRequest, kind: HeatKind, traversal: Traversal) -> Vec<f32> {
    let picture = RenderRequest {
        hidden: request.hidden.clone(),
        ..RenderRequest::new(
            accel,
            request.camera,
            RenderSettings { shading: Shading::Heat(kind), traversal, ..request.settings },
            SIZE,
        )
    };
    render(&picture, &CancelToken::new(), &|_| ()).unwrap().values
}

#[test]
fn the_steps_of_each_pixel_count_up_to_its_heat() {
    for accel in trees() {
        for method in RayMethod::ALL {
            let request = request(&accel, method);
            let values = heat(&accel, &request);
            let mut hits = 0;
            for (pixel, value) in pixels().zip(values) {
                let record =
                    recorded(&accel, &RayRequest { start: RayStart::Pixel(pixel), ..request.clone() }).unwrap();
                let last = record.steps.last().map_or_else(TestCounts::default, |step| step.counts);
                let name = format!("{:?}, {method:?}, {pixel:?}", accel.settings.container);
                assert_eq!(last, record.counts, "{name}");
                assert_eq!((last.containers + last.primitives) as f32, value, "{name}");
                assert_eq!(record.steps.last().map_or(0, |step| step.waiting), 0, "{name}: all were popped");
                assert!(record.steps.windows(2).all(|pair| {
                    pair[0].counts.containers <= pair[1].counts.containers
                        && pair[0].counts.primitives <= pair[1].counts.primitives
                }));
                hits += usize::from(record.hit.is_some());
            }
            assert!(hits > 100, "{hits}");
        }
    }
}

#[test]
fn behind_hidden_triangles_and_section_planes_too() {
    let accel = teapot(ContainerKind::Aabb, Passes::NONE);
    let table = NodeTable::new(&accel);
    let hidden = table.visibility(&Selection { hidden: [1].into(), ..Selection::default() }).unwrap();
    let section = SectionPlane::through(&accel.scene.bounds, Vec3::new(0.3, 0.2, 1.0));
    for method in RayMethod::ALL {
        let request = RayRequest {
            hidden: Some(Arc::clone(&hidden.triangles)),
            settings: RenderSettings { section: Some(section), ..RenderSettings::default() },
            ..request(&accel, method)
        };
        let values = heat(&accel, &request);
        let mut again = 0;
        for (pixel, value) in pixels().zip(values) {
            let record = recorded(&accel, &RayRequest { start: RayStart::Pixel(pixel), ..request.clone() }).unwrap();
            assert_eq!((record.counts.containers + record.counts.primitives) as f32, value, "{method:?}, {pixel:?}");
            assert!(record.hit.is_none_or(|(_, triangle)| !hidden.triangles.contains(triangle)));
            again += record.steps.iter().filter(|step| matches!(step.what, Step::Again { .. })).count();
        }
        assert!(again > 50, "{method:?}: {again}");
    }
}

/// Also behind hidden triangles, where rays are traced in several parts.
#[test]
fn records_of_the_wide_tree_read_the_lines_that_the_heat_map_shows() {
    let mut more = 0;
    for accel in trees() {
        let wide = request(&accel, RayMethod::Wide);
        let table = NodeTable::new(&accel);
        let hidden = table.visibility(&Selection { hidden: [1].into(), ..Selection::default() }).unwrap();
        let without = RayRequest { hidden: Some(Arc::clone(&hidden.triangles)), ..wide.clone() };
        let [all, rest] = [wide, without].map(|request| {
            let values = heat_of(&accel, &request, HeatKind::Lines, Traversal::Ordered);
            for (pixel, &value) in pixels().zip(&values) {
                let record =
                    recorded(&accel, &RayRequest { start: RayStart::Pixel(pixel), ..request.clone() }).unwrap();
                let lines = record.lines.expect("of the wide tree");
                assert_eq!((lines.nodes + lines.triangles) as f32, value, "{pixel:?}");
                assert!(lines.nodes > 0 && (record.hit.is_none() || lines.triangles > 0), "{pixel:?}");
            }
            values
        });
        for (all, rest) in all.iter().zip(&rest) {
            assert!(rest >= all, "what is read again does not count again, and nothing less is read");
            more += usize::from(rest > all);
        }
        let binary = request(&accel, RayMethod::Binary(Traversal::Ordered));
        assert_eq!(recorded(&accel, &binary).unwrap().lines, None);
    }
    assert!(more > 20, "{more}");
}

#[test]
fn rays_that_leave_the_surface_are_counted_as_they_are_traced() {
    let level = SimdLevel::best().level();
    for accel in trees() {
        for kind in [RayKind::Shadow, RayKind::AmbientOcclusion, RayKind::Bounce] {
            let (mut traced, mut hits) = (0, 0);
            for pixel in pixels() {
                for method in RayMethod::ALL {
                    let request = RayRequest { start: RayStart::Pixel(pixel), kind, ..request(&accel, method) };
                    let Some(record) = recorded(&accel, &request) else { continue };
                    let mut counts = TestCounts::default();
                    let found = match method {
                        RayMethod::Binary(Traversal::Ordered) if kind.ends_at_any_hit() => {
                            accel.any_hit_with(&record.ray, &mut counts)
                        }
                        RayMethod::Binary(traversal) => {
                            accel.closest_hit_with(&record.ray, traversal, &mut counts).is_some()
                        }
                        RayMethod::Wide if kind.ends_at_any_hit() => {
                            accel.wide().tree.any_hit_with(level, &record.ray, &mut counts)
                        }
                        RayMethod::Wide => {
                            accel.wide().tree.closest_hit_with(level, &record.ray, &mut counts).is_some()
                        }
                    };
                    assert_eq!(
                        (record.counts, record.hit.is_some()),
                        (counts, found),
                        "{kind:?}, {method:?}, {pixel:?}"
                    );
                    if let Some((t, triangle)) = record.hit {
                        assert!(t <= record.ray.t_max);
                        let tested = RayEvent::Triangle { index: triangle, t: Some(t) };
                        assert!(record.steps.iter().any(|step| step.what == Step::Event(tested)));
                    }
                    traced += 1;
                    hits += usize::from(found);
                }
            }
            assert!(traced > 300 && hits > 3, "{kind:?}: {hits} of {traced}");
        }
    }
}

/// Each visit is judged again by the parents of nodes, which the recorder does not use.
#[test]
fn wasted_are_the_visits_in_which_nothing_nearer_is_found() {
    let mut kinds = [0; 3];
    for accel in trees() {
        let parents = &accel.ancestry().parents;
        let with_parents = |mut node: u32| {
            let mut path = vec![node];
            while node != 0 {
                node = parents[node as usize];
                path.push(node);
            }
            path
        };
        for method in RayMethod::ALL {
            for pixel in pixels().step_by(7) {
                let request = RayRequest { start: RayStart::Pixel(pixel), ..request(&accel, method) };
                let record = recorded(&accel, &request).unwrap();
                let nearer =
                    record.steps.iter().filter(|step| matches!(step.what, Step::Event(RayEvent::Nearer { .. })));
                let useful: HashSet<u32> = nearer.flat_map(|step| with_parents(step.tree_node)).collect();
                let visited: Vec<u32> = record
                    .steps
                    .iter()
                    .filter(|step| matches!(step.what, Step::Event(RayEvent::Visit { .. })))
                    .map(|step| step.tree_node)
                    .collect();
                for span in &record.spans {
                    let expected = match (visited.contains(&span.tree_node), useful.contains(&span.tree_node)) {
                        (true, true) => Visit::Useful,
                        (true, false) => Visit::Wasted,
                        (false, _) => Visit::Skipped,
                    };
                    assert_eq!(span.visit, expected, "{method:?}, {pixel:?}, {span:?}");
                    assert_eq!(span.visited.is_some(), expected != Visit::Skipped);
                    kinds[expected as usize] += 1;
                    if let RayMethod::Binary(_) = method {
                        assert_eq!(span.depth as usize, with_parents(span.tree_node).len() - 1);
                        let parent =
                            record.spans.iter().find(|other| other.tree_node == parents[span.tree_node as usize]);
                        let [from, to] = parent.filter(|_| span.tree_node != 0).map_or(span.t, |parent| parent.t);
                        let slack = 1e-3 * accel.scene.bounds.extent().length();
                        // Spheres of children may stick out of their parent's by rounding alone.
                        assert!(span.t[0] >= from - slack && span.t[1] <= to + slack, "{span:?} in {from} to {to}");
                    }
                    assert!(span.t[0] <= span.t[1]);
                }
                assert_eq!(record.visits()[0], visited.len());
            }
        }
    }
    assert!(kinds.iter().all(|&count| count > 100), "{kinds:?}");
}

#[test]
fn nodes_of_the_wide_tree_are_named_by_the_binary_nodes_that_they_replace() {
    let mut tested = 0;
    for accel in trees() {
        let table = NodeTable::new(&accel);
        for pixel in pixels().step_by(5) {
            let request = RayRequest { start: RayStart::Pixel(pixel), ..request(&accel, RayMethod::Wide) };
            let record = recorded(&accel, &request).unwrap();
            let mut leaf: Option<(u32, TriangleSet)> = None;
            for step in &record.steps {
                match step.what {
                    Step::Event(RayEvent::Visit { .. }) => {
                        let span = &record.spans[step.span.unwrap() as usize];
                        leaf = span.is_leaf.then(|| (step.tree_node, table.triangles_below(step.tree_node)));
                    }
                    Step::Event(RayEvent::Triangle { index, .. }) => {
                        let (node, below) = leaf.as_ref().unwrap();
                        assert!(below.contains(index), "triangle {index} is not below node {node}");
                        assert!(below.len() <= 16, "node {node} is far above: {}", below.len());
                        tested += 1;
                    }
                    _ => {}
                }
            }
        }
    }
    assert!(tested > 1000, "{tested}");
}

#[test]
fn the_stack_and_the_next_hit_are_those_of_the_steps() {
    let accel = teapot(ContainerKind::Aabb, Passes::NONE);
    let request =
        RayRequest { start: RayStart::Pixel([20, 15]), ..request(&accel, RayMethod::Binary(Traversal::Ordered)) };
    let record = recorded(&accel, &request).unwrap();
    let mut stack: Vec<u32> = Vec::new();
    for (index, step) in record.steps.iter().enumerate() {
        match step.what {
            Step::Event(RayEvent::Push { node }) => stack.insert(0, node),
            Step::Event(RayEvent::Pop { node }) => assert_eq!(stack.remove(0), node),
            _ => {}
        }
        let nodes: Vec<u32> = record.stack_after(index).iter().map(|&span| record.spans[span as usize].node).collect();
        assert_eq!(nodes, stack);
        assert_eq!(step.waiting as usize, stack.len());
    }
    let hits: Vec<usize> = std::iter::successors(record.next_hit(0), |&step| record.next_hit(step)).collect();
    assert!(!hits.is_empty());
    assert_eq!(record.steps[*hits.last().unwrap()].nearest, record.hit.unwrap().0);
    assert_eq!(record.next_hit(record.steps.len()), None);
}

#[test]
fn rays_that_can_hit_nothing_have_no_steps() {
    let token = CancelToken::new();
    let triangle = Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::Y };
    for triangles in [vec![], vec![triangle], vec![triangle; 9]] {
        let scene = Arc::new(Scene::from_triangles(SceneSource::default_builtin(), triangles.clone()));
        for container in ContainerKind::ALL {
            let settings = BuildSettings { container, ..BuildSettings::default() };
            let accel = Arc::new(Accel::build(&scene, &settings, &token).unwrap());
            for method in RayMethod::ALL {
                let of = |origin, direction| {
                    let start = RayStart::Given(Ray::new(origin, direction));
                    recorded(&accel, &RayRequest { start, ..request(&accel, method) }).unwrap()
                };
                for direction in [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY, Vec3::splat(1e-30)] {
                    let record = of(Vec3::new(0.2, 0.2, 1.0), direction);
                    assert_eq!((record.steps.len(), record.hit, record.visits()), (0, None, [0; 3]), "{direction}");
                    assert_eq!(record.reach(), [0.0, 1.0]);
                }
                let through = of(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z);
                assert_eq!(through.hit, (!triangles.is_empty()).then_some((1.0, 0)), "{method:?}");
                assert_eq!(through.steps.is_empty(), triangles.is_empty());
                let beside = of(Vec3::new(9.0, 0.2, 1.0), Vec3::NEG_Z);
                assert_eq!((beside.hit, beside.visits()[0] - beside.visits()[1]), (None, 0));
            }
        }
    }
}

#[test]
fn recording_is_cancelled() {
    let accel = teapot(ContainerKind::Aabb, Passes::NONE);
    let token = CancelToken::new();
    token.cancel();
    let request = request(&accel, RayMethod::Binary(Traversal::Ordered));
    let through = RayRequest { start: RayStart::Pixel([20, 15]), ..request };
    assert!(record(&accel, &through, &token).is_err());
}
