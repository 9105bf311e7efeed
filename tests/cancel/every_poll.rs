//! Work that is cancelled at its n-th poll of the token, for every n: it stops, nothing panics, no half file is left, and
//! the next job is right.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use bvhscope::accel::Accel;
use bvhscope::accel::node_values::KnownVisits;
use bvhscope::camera::Camera;
use bvhscope::export::Protected;
use bvhscope::headless::exr::write_distances;
use bvhscope::headless::picture::write_png;
use bvhscope::lab::LabError;
use bvhscope::lab::copy_advice::copy_advice;
use bvhscope::lab::copy_costs::copy_costs;
use bvhscope::lab::copy_forms::copy_forms;
use bvhscope::lab::diagnose::diagnose_scene;
use bvhscope::lab::layouts::{LayoutPlan, layouts};
use bvhscope::lab::motion::{MotionPlan, MotionStudy};
use bvhscope::lab::population::{Population, Populations, RayPlan, ViewRays};
use bvhscope::lab::visit_scatter::VisitScatter;
use bvhscope::overlay::NodeTable;
use bvhscope::render::{RenderRequest, RenderSettings, Shading, render};
use bvhscope::scene::{Instancing, LoadError, LoadOptions, Scene, SceneSource, load, load_bytes};
use bvhscope::view::Place;
use bvhscope_engine::builders::{BuildError, build_binary};
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::follow::Policy;
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::layouts::{Collapse, Planes};
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Pass, Passes, Preset};
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::largest::largest_nodes;
use bvhscope_engine::tree::node_metrics::{overlap, subtree_sah_shares};
use bvhscope_engine::tree::random_lines::RandomLines;
use bvhscope_engine::tree::survival::surviving_nodes;
use bvhscope_engine::tree::traverse::Traversal;
use bvhscope_engine::tree::visits::{RayQuery, measure_visits};
use bvhscope_engine::tree_file::{
    Header, TreeFile, TreeFileError, TwoLevelFile, write_level_nodes_csv, write_level_nodes_json, write_nodes_csv,
    write_nodes_json, write_tree,
};
use bvhscope_engine::wide::AnyWideTree;
use bvhscope_engine::{AnyTree, WideBvh, with_tree};

/// Maximum number of polls at which a job is cancelled, spread evenly over all of them.
const MAX_POLLS: u64 = 12;

/// Runs `work` to its end, then once for each poll of the token, cancelled there. `work` returns whether it was cancelled.
fn at_every_poll(name: &str, work: impl Fn(&CancelToken) -> bool) {
    let polls = Arc::new(AtomicU64::new(0));
    let counted = Arc::clone(&polls);
    let token = CancelToken::watched(move |_| {
        counted.fetch_add(1, Ordering::Relaxed);
        false
    });
    assert!(!work(&token), "{name}: cancelled by itself");
    let polls = polls.load(Ordering::Relaxed);
    assert!(polls > 0, "{name}: the token is never polled");
    for k in 0..polls.min(MAX_POLLS) {
        let n = 1 + k * polls / polls.min(MAX_POLLS);
        let token = CancelToken::watched(move |poll| poll >= n);
        assert!(work(&token), "{name}: went on after poll {n} of {polls}");
    }
    assert!(!work(&CancelToken::new()), "{name}: the next job is cancelled too");
}

fn one_thread() -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap()
}

fn terrain(size: u32) -> Arc<Scene> {
    let source = SceneSource::Builtin { name: "terrain".to_owned(), size: Some(size) };
    Arc::new(load(&source, &LoadOptions::default(), &CancelToken::new()).unwrap())
}

fn is_cancelled(result: Result<Scene, LoadError>) -> bool {
    match result {
        Ok(_) => false,
        Err(LoadError::Cancelled(_)) => true,
        Err(error) => panic!("{error}"),
    }
}

/// Whether a build was cancelled; it must not fail otherwise.
fn build_is_cancelled<T>(built: Result<T, BuildError>) -> bool {
    match built {
        Ok(_) => false,
        Err(BuildError::Cancelled(_)) => true,
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn loading_stops_at_every_poll() {
    let folder = tempfile::tempdir().unwrap();
    let vertices = 30_000;
    let mut obj = String::new();
    for k in 0..vertices {
        obj += &format!("v {k} {} 0\n", k * k % 97);
    }
    for k in 3..vertices {
        obj += &format!("f {} {} {k}\n", k - 2, k - 1);
    }
    let mut ply = format!(
        "ply\nformat ascii 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {vertices}\nproperty list uchar int vertex_indices\nend_header\n"
    );
    for k in 0..vertices {
        ply += &format!("{k} {} 0\n", k * k % 97);
    }
    for k in 0..vertices {
        ply += &format!("3 {k} {} {}\n", (k + 1) % vertices, (k + 7) % vertices);
    }
    let mut stl = String::from("solid a\n");
    for k in 0..vertices {
        stl += &format!(
            "facet normal 0 0 0\nouter loop\nvertex {k} 0 0\nvertex {k} 1 0\nvertex {k} 0 1\nendloop\nendfacet\n"
        );
    }
    let nodes: Vec<String> = (0..400).map(|k| format!("{{\"mesh\":0,\"translation\":[{k},0,0]}}")).collect();
    let roots: Vec<String> = (0..400).map(|k| k.to_string()).collect();
    let gltf = format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"scenes\":[{{\"nodes\":[{}]}}],\"nodes\":[{}],\
         \"meshes\":[{{\"primitives\":[{{\"attributes\":{{\"POSITION\":0}}}}]}}],\
         \"accessors\":[{{\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}}]}}",
        roots.join(","),
        nodes.join(",")
    );
    let mut pbrt = String::from("WorldBegin ObjectBegin \"a\" Shape \"sphere\" ObjectEnd\n");
    for k in 0..400 {
        pbrt += &format!("Translate {k} 0 0 ObjectInstance \"a\" Shape \"disk\"\n");
    }
    for (name, text) in [("a.pbrt", pbrt), ("a.obj", obj), ("a.ply", ply), ("a.stl", stl), ("a.gltf", gltf)] {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        let source = SceneSource::File(path);
        at_every_poll(name, |token| is_cancelled(load(&source, &LoadOptions::default(), token)));
    }
    for scene in bvhscope::scene::BUILTIN_SCENES {
        let size = scene.size.map(|(_, least, _, most)| (least * 2).min(most));
        let source = SceneSource::Builtin { name: scene.name.to_owned(), size };
        at_every_poll(scene.name, |token| is_cancelled(load(&source, &LoadOptions::default(), token)));
    }
}

#[test]
fn reading_and_writing_trees_stops_at_every_poll() {
    let scene = terrain(30_000);
    let token = CancelToken::new();
    for container in ContainerKind::ALL {
        let settings = BuildSettings::preset(Preset::Fast, container);
        let (tree, _) = build_binary(&scene.triangles, &settings, &token).unwrap();
        let header = Header::new(scene.triangles.len());
        let mut bytes = Vec::new();
        write_tree(&tree, &header, Some(&scene.triangles), &mut bytes, &token).unwrap();
        let pool = one_thread();
        for (name, mesh) in [("with its triangles", None), ("with those of the model", Some(&scene.triangles[..]))] {
            at_every_poll(&format!("{} tree {name}", container.name()), |token| {
                let read = pool.install(|| TreeFile::read(&bytes, mesh, u64::MAX, token));
                matches!(read.map(|file| assert_eq!(file.faults, [])), Err(TreeFileError::Cancelled(_)))
            });
        }
        type Write<'a> = &'a dyn Fn(&mut Vec<u8>, &CancelToken) -> std::io::Result<()>;
        let writers: [(&str, Write<'_>); 3] = [
            ("tree file", &|bytes, token| write_tree(&tree, &header, Some(&scene.triangles), bytes, token)),
            ("CSV", &|bytes, token| write_nodes_csv(&tree, bytes, token)),
            ("JSON", &|bytes, token| write_nodes_json(&tree, &header, bytes, token)),
        ];
        for (name, write) in writers {
            at_every_poll(name, |token| {
                let error = write(&mut Vec::new(), token).err();
                error.is_some_and(|error| error.get_ref().is_some_and(|inner| inner.is::<Cancelled>()))
            });
        }
        let wide = collapse_any(&tree, &scene);
        at_every_poll("wide tree as a tree", |token| wide.to_tree(&tree, token).is_err());
    }
}

#[test]
fn reading_and_writing_trees_in_two_levels_stops_at_every_poll() {
    let options = LoadOptions { instances: Instancing::TwoLevel, ..LoadOptions::default() };
    let source = SceneSource::parse("builtin:stack:9000".as_ref()).unwrap();
    let scene = Arc::new(load(&source, &options, &CancelToken::new()).unwrap());
    let accel = Accel::build_binary(&scene, &BuildSettings::default(), &CancelToken::new()).unwrap();
    let trees = accel.file_trees(false, &CancelToken::new()).unwrap();
    let levels = trees.levels().unwrap();
    let mut bytes = Vec::new();
    trees.write(true, &mut bytes, &CancelToken::new()).unwrap();
    let pool = one_thread();
    at_every_poll("reading two levels", |token| {
        let read = pool.install(|| TwoLevelFile::read(&bytes, None, u64::MAX, token));
        matches!(read.map(|file| assert_eq!(file.faults, [])), Err(TreeFileError::Cancelled(_)))
    });
    at_every_poll("loading two levels", |token| is_cancelled(load_bytes(Path::new("a.bvh"), &bytes, &options, token)));
    type Write<'a> = &'a dyn Fn(&mut Vec<u8>, &CancelToken) -> std::io::Result<()>;
    let writers: [(&str, Write<'_>); 3] = [
        ("two levels", &|bytes, token| trees.write(true, bytes, token)),
        ("CSV of two levels", &|bytes, token| write_level_nodes_csv(&levels, bytes, token)),
        ("JSON of two levels", &|bytes, token| write_level_nodes_json(&levels, &trees.header(), bytes, token)),
    ];
    for (name, write) in writers {
        at_every_poll(name, |token| {
            let error = write(&mut Vec::new(), token).err();
            error.is_some_and(|error| error.get_ref().is_some_and(|inner| inner.is::<Cancelled>()))
        });
    }
}

fn collapse_any(tree: &AnyTree, scene: &Scene) -> AnyWideTree {
    WideBvh::new(tree, &scene.triangles, &CancelToken::new()).unwrap().tree
}

/// Text that nothing needs is read as well, and stops as soon.
#[test]
fn long_json_is_polled_while_it_is_read() {
    let load = |length: usize, token: &CancelToken| {
        let text = format!(
            "{{\"asset\":{{\"version\":\"2.0\",\"extras\":\"{}\"}},\"scenes\":[{{\"nodes\":[0]}}],\"nodes\":[{{\"mesh\":0}}],\
             \"meshes\":[{{\"primitives\":[{{\"attributes\":{{\"POSITION\":0}}}}]}}],\
             \"accessors\":[{{\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}}]}}",
            "x".repeat(length)
        );
        is_cancelled(load_bytes(Path::new("a.gltf"), text.as_bytes(), &LoadOptions::default(), token))
    };
    let polls = |length: usize| {
        let polls = Arc::new(AtomicU64::new(0));
        let counted = Arc::clone(&polls);
        let token = CancelToken::watched(move |_| {
            counted.fetch_add(1, Ordering::Relaxed);
            false
        });
        assert!(!load(length, &token));
        polls.load(Ordering::Relaxed)
    };
    // Once while its brackets are counted, once while it is read.
    assert!(polls(4 << 20) >= polls(0) + 2 * 15, "{} and {}", polls(0), polls(4 << 20));
    at_every_poll("JSON", |token| load(4 << 20, token));
}

#[test]
fn building_stops_at_every_poll() {
    let pool = one_thread();
    for builder in BuilderKind::ALL {
        let scene = terrain(if builder == BuilderKind::Exact { 600 } else { 10_000 });
        for container in ContainerKind::ALL {
            let settings = BuildSettings { builder, container, ..BuildSettings::default() };
            if settings.refusal(scene.triangles.len()).is_some() {
                continue;
            }
            at_every_poll(&format!("{} {}", builder.name(), container.name()), |token| {
                build_is_cancelled(pool.install(|| Accel::build(&scene, &settings, token)))
            });
        }
    }
}

#[test]
fn optimizing_stops_at_every_poll() {
    let pool = one_thread();
    let scene = terrain(40_000);
    let settings = BuildSettings::preset(Preset::Best, ContainerKind::Aabb);
    at_every_poll("best", |token| {
        build_is_cancelled(pool.install(|| build_binary(&scene.triangles, &settings, token)))
    });
}

#[test]
fn following_a_model_that_moves_stops_at_every_poll() {
    let source = SceneSource::Builtin { name: "walker".to_owned(), size: Some(3_000) };
    let scene = Arc::new(load(&source, &LoadOptions::default(), &CancelToken::new()).unwrap());
    let settings = RenderSettings::default();
    let camera = Camera::framing(&scene.subject, scene.up);
    for policy in Policy::ALL {
        let plan = MotionPlan {
            policies: vec![policy],
            build: BuildSettings::default(),
            clip: 0,
            frames: 3,
            rays: vec![ViewRays::new(Population::Primary, camera, [64; 2], &settings)],
            simd: settings.simd,
            repeat: 1,
            epo_samples: None,
        };
        let study = |token: &CancelToken| -> Result<(), LabError> {
            let mut study = MotionStudy::new(&scene, plan.clone(), token)?;
            while study.next_frame(token)?.is_some() {}
            Ok(())
        };
        one_thread().install(|| {
            at_every_poll(policy.name(), |token| match study(token) {
                Ok(()) => false,
                Err(LabError::Cancelled(_)) => true,
                Err(error) => panic!("{error}"),
            });
        });
    }
}

#[test]
fn deriving_from_a_tree_stops_at_every_poll() {
    let pool = one_thread();
    let scene = terrain(40_000);
    let tree = || {
        let built = Accel::build_binary(&scene, &BuildSettings::default(), &CancelToken::new());
        Arc::new(pool.install(|| built).unwrap())
    };
    let is_cancelled = |work: &(dyn Fn(&Accel) -> Result<(), Cancelled> + Sync)| {
        let accel = tree();
        pool.install(|| work(&accel)).is_err()
    };
    at_every_poll("the wide tree", |token| is_cancelled(&|accel| accel.widen(token).map(|_| ())));
    at_every_poll("the triangles in leaf order", |token| {
        is_cancelled(&|accel| accel.compute_leaf_triangles(token).map(|_| ()))
    });
    at_every_poll("ancestry and overlap", |token| is_cancelled(&|accel| accel.compute_derived(token)));
    let accel = tree();
    at_every_poll("the list of nodes", |token| NodeTable::new(&accel).list(None, token).is_err());
    at_every_poll("diagnosis", |token| diagnose_scene(&scene, token).is_err());
    with_tree!(&accel.tree, tree => {
        let lines = RandomLines::new(tree.nodes[0].container, 1);
        let query = RayQuery::ClosestHit(Traversal::Ordered);
        let triangles = accel.leaf_triangles();
        let visits = |token: &CancelToken| measure_visits(tree, triangles, 4_000, |i| lines.ray(i), query, token);
        at_every_poll("visits", |token| pool.install(|| visits(token)).is_err());
        let counted = visits(&CancelToken::new()).unwrap();
        at_every_poll("sums of visits", |token| counted.sums(tree, token).is_err());
        at_every_poll("cost of visits", |token| counted.cost(tree, token).is_err());
        at_every_poll("shares of cost", |token| subtree_sah_shares(tree, token).is_err());
        let value = |node: u32| overlap(tree, node).unwrap_or(0.0);
        at_every_poll("largest nodes", |token| {
            pool.install(|| largest_nodes(tree.nodes.len(), 100, value, token)).is_err()
        });
        at_every_poll("surviving nodes", |token| surviving_nodes(tree, tree, token).is_err());
    });
    let camera = Camera::framing(&scene.bounds, scene.up);
    for population in Population::ALL {
        let rays = ViewRays::new(population, camera, [40, 30], &RenderSettings::default());
        // The scene keeps the normals by crease angle, which are polled for once only.
        let measured = rays.measure(&accel, &CancelToken::new()).unwrap();
        let visits = KnownVisits(measured.visits);
        at_every_poll(population.name(), |token| pool.install(|| rays.measure(&accel, token)).is_err());
        at_every_poll("the scatter of visits", |token| {
            pool.install(|| VisitScatter::new(&accel, measured.sums.clone(), &visits, token)).is_err()
        });
    }
    let settings = BuildSettings { optimize: Passes::NONE.with(Pass::Split), ..BuildSettings::default() };
    let (split, _) = build_binary(&scene.triangles, &settings, &CancelToken::new()).unwrap();
    with_tree!(&split, tree => {
        at_every_poll("surviving nodes with split triangles", |token| surviving_nodes(tree, tree, token).is_err());
    });
}

/// A picture with counted tests.
fn small_picture(accel: &Arc<Accel>, settings: RenderSettings) -> RenderRequest {
    let camera = Camera::framing(&accel.scene.bounds, accel.scene.up);
    RenderRequest { count_tests: true, ..RenderRequest::new(accel, camera, settings, [70, 50]) }
}

#[test]
fn tracing_stops_at_every_poll() {
    let pool = one_thread();
    let scene = terrain(2_000);
    let accel = Arc::new(Accel::build(&scene, &BuildSettings::default(), &CancelToken::new()).unwrap());
    for shading in Shading::ALL {
        let request = small_picture(&accel, RenderSettings { shading, samples: 2, ..RenderSettings::default() });
        at_every_poll(shading.name(), |token| pool.install(|| render(&request, token, &|_| ())).is_err());
    }
}

#[test]
fn writing_pictures_stops_at_every_poll() {
    let folder = tempfile::tempdir().unwrap();
    let (png, exr) = (folder.path().join("a.png"), folder.path().join("a.exr"));
    let size = [400, 300_u32];
    let pixels: Vec<[u8; 4]> = (0..size[0] * size[1]).map(|k| k.wrapping_mul(2_654_435_769).to_le_bytes()).collect();
    at_every_poll("PNG", |token| {
        let _ = std::fs::remove_file(&png);
        let written = write_png(&png, &Protected::default(), size, &pixels, token);
        assert_eq!(written.is_ok(), png.exists(), "whole or not at all");
        written.is_err()
    });
    assert_eq!(image::open(&png).unwrap().to_rgba8().into_raw(), pixels.as_flattened());
    let scene = terrain(2_000);
    let accel = Arc::new(Accel::build(&scene, &BuildSettings::default(), &CancelToken::new()).unwrap());
    let request = small_picture(&accel, RenderSettings { samples: 1, ..RenderSettings::default() });
    let frame = render(&request, &CancelToken::new(), &|_| ()).unwrap();
    at_every_poll("EXR", |token| {
        let _ = std::fs::remove_file(&exr);
        let written = write_distances(&exr, &Protected::default(), &frame, token);
        assert_eq!(written.is_ok(), exr.exists(), "whole or not at all");
        written.is_err()
    });
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2, "no temporary file is left");
}

#[test]
fn measuring_stops_at_every_poll() {
    use bvhscope::lab::{Setup, Subject, TraceView, measure};
    let scene = terrain(1_000);
    let view = TraceView {
        camera: Camera::framing(&scene.bounds, scene.up),
        place: Place::Given,
        size: [20, 20],
        traversal: bvhscope_engine::tree::traverse::Traversal::Ordered,
        simd: SimdLevel::best(),
        repeat: 2,
        populations: bvhscope::lab::population::Populations::ALL,
        epo_samples: None,
    };
    let subject = Subject {
        model: "terrain".to_owned(),
        scene,
        trees: Vec::new(),
        forms: Vec::new(),
        rays: None,
        load: LoadOptions::default(),
    };
    let setups = [Setup { build: BuildSettings::default(), preset: None, threads: 1 }];
    at_every_poll("measure", |token| match measure("bench", &subject, &setups, &view, token, &mut |_| ()) {
        Ok(()) => false,
        Err(LabError::Cancelled(_)) => true,
        Err(error) => panic!("{error}"),
    });
}

fn lab_is_cancelled(result: Result<(), LabError>) -> bool {
    match result {
        Ok(()) => false,
        Err(LabError::Cancelled(_)) => true,
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn layouts_and_costs_of_copies_stop_at_every_poll() {
    let pool = one_thread();
    let rays = |scene: &Scene| RayPlan {
        populations: Populations::ALL,
        camera: Camera::framing(&scene.bounds, scene.up),
        size: [30, 20],
        settings: RenderSettings::default(),
        file: None,
    };
    let scene = terrain(3_000);
    let accel = Arc::new(Accel::build(&scene, &BuildSettings::default(), &CancelToken::new()).unwrap());
    for collapse in Collapse::ALL {
        let plan = LayoutPlan {
            children: vec![2, 8],
            collapses: vec![collapse],
            planes: vec![Planes::Bits8],
            leaf_sizes: vec![4],
        };
        let lay = |token: &CancelToken| layouts(&accel, &plan, &rays(&scene).views(), token, &mut |_| ());
        at_every_poll(collapse.name(), |token| lab_is_cancelled(pool.install(|| lay(token))));
    }
    let options = LoadOptions { instances: Instancing::TwoLevel, ..LoadOptions::default() };
    let village = SceneSource::parse("builtin:village:30".as_ref()).unwrap();
    let scene = Arc::new(load(&village, &options, &CancelToken::new()).unwrap());
    let accel = Arc::new(Accel::build(&scene, &BuildSettings::default(), &CancelToken::new()).unwrap());
    let costs = |token: &CancelToken| copy_costs(&accel, &rays(&scene).views(), 5, token, &mut |_| ());
    at_every_poll("costs of copies", |token| lab_is_cancelled(pool.install(|| costs(token))));
    let forms = |token: &CancelToken| copy_forms(&accel, None, &[1.0, 2.0], &rays(&scene).views(), token, &mut |_| ());
    at_every_poll("forms of copies", |token| lab_is_cancelled(pool.install(|| forms(token))));
    let advice = |token: &CancelToken| copy_advice(&accel, &rays(&scene).views()[..1], token, &mut |_| ());
    at_every_poll("other meshes", |token| lab_is_cancelled(pool.install(|| advice(token))));
}

#[test]
fn a_cancelled_load_says_nothing_else() {
    let token = CancelToken::watched(|_| true);
    let result =
        load_bytes(Path::new("a.obj"), b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", &LoadOptions::default(), &token);
    assert!(matches!(result, Err(LoadError::Cancelled(_))), "{result:?}");
}
