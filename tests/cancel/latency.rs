//! The work between two cancellation checks does not grow with the input, so that a job stops soon however large its model
//! is. Each job runs on one thread over a small and over a large input, and the longest intervals between two checks are
//! compared. Intervals are processor time, which other programs on the machine do not lengthen.

use std::process::Command;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use bvhscope::accel::Accel;
use bvhscope::camera::Camera;
use bvhscope::export::Protected;
use bvhscope::headless::exr::write_distances;
use bvhscope::headless::picture::write_png;
use bvhscope::lab::diagnose::diagnose_scene;
use bvhscope::overlay::NodeTable;
use bvhscope::render::{RenderRequest, RenderSettings, Shading, render};
use bvhscope::scene::{LoadOptions, Scene, SceneSource, load};
use bvhscope_engine::builders::build_binary;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::Aabb;
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Preset};
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::ancestry::Ancestry;
use bvhscope_engine::tree::largest::largest_nodes;
use bvhscope_engine::tree::node_metrics::{self, subtree_sah_shares};
use bvhscope_engine::tree::overlap::end_point_overlap;
use bvhscope_engine::tree::statistics::tree_stats;
use bvhscope_engine::tree::survival::surviving_nodes;
use bvhscope_engine::tree::{Node, Tree};
use bvhscope_engine::tree_file::{Header, TreeFile, write_nodes_csv, write_tree};
use bvhscope_engine::wide::{AnyWideTree, NodeForm};
use bvhscope_engine::with_tree;
use bvhscope_engine::{AnyTree, orient};

/// Size of the large input in that of the small one.
const GROWTH: u32 = 8;
/// Factor by which an interval may be longer with the large input, which fits less well into the caches: well below GROWTH.
const SLACK: u32 = 5;
/// Intervals below this fraction of the whole job, one part in so many, are too short to matter.
const NEGLIGIBLE: u32 = 100;
/// Triangles of the small inputs: more than the work of any job between two checks.
const SMALL: u32 = 40_000;
/// Least and greatest number of runs of a job. The shortest time of each interval counts.
const MIN_RUNS: usize = 3;
const MAX_RUNS: usize = 40;

/// Processor time of all threads of this process.
#[cfg(unix)]
fn processor_time() -> Duration {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Duration::try_from(time).unwrap()
}

/// Time of day, for want of a processor time.
#[cfg(not(unix))]
fn processor_time() -> Duration {
    std::time::SystemTime::UNIX_EPOCH.elapsed().unwrap()
}

/// Shortest time of each interval between two cancellation checks over the runs of a job.
#[derive(Default)]
struct Intervals(Vec<Duration>);

impl Intervals {
    /// Runs the job once more.
    fn run<T>(&mut self, pool: &rayon::ThreadPool, work: impl FnOnce(&CancelToken) -> T + Send)
    where
        T: Send,
    {
        let checks = Arc::new(Mutex::new(Vec::new()));
        let shared = Arc::clone(&checks);
        let token = CancelToken::watched(move |_| {
            shared.lock().unwrap().push(processor_time());
            false
        });
        let start = processor_time();
        let result = pool.install(|| work(&token));
        let end = processor_time();
        drop(result);
        let mut checks = checks.lock().unwrap();
        checks.push(end);
        let before = std::iter::once(&start).chain(checks.iter());
        let times: Vec<Duration> = before.zip(checks.iter()).map(|(from, to)| to.saturating_sub(*from)).collect();
        if self.0.is_empty() {
            self.0 = times;
        } else {
            assert_eq!(self.0.len(), times.len(), "the same job polls equally often each time");
            self.0.iter_mut().zip(times).for_each(|(best, time)| *best = time.min(*best));
        }
    }

    fn longest(&self) -> Duration {
        self.0.iter().copied().max().unwrap()
    }

    fn total(&self) -> Duration {
        self.0.iter().sum()
    }
}

/// Jobs whose longest interval grows with their input.
#[derive(Default)]
struct Growing(Vec<String>);

impl Growing {
    fn assert_none(self) {
        assert!(self.0.is_empty(), "{:#?}", self.0);
    }

    /// Records `work` unless its longest interval is as long with `inputs[1]` as with `inputs[0]`, which is `GROWTH` times
    /// smaller. What it consumes is prepared for each run.
    fn check<I: Sync, P: Send, T: Send>(
        &mut self,
        name: &str,
        inputs: [&I; 2],
        prepare: impl Fn(&I) -> P,
        work: impl Fn(P, &CancelToken) -> T + Sync,
    ) {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let [mut small, mut large] = [Intervals::default(), Intervals::default()];
        for run in 1..=MAX_RUNS {
            for (intervals, input) in [&mut small, &mut large].into_iter().zip(inputs) {
                let prepared = prepare(input);
                intervals.run(&pool, |token| work(prepared, token));
            }
            if run < MIN_RUNS {
                continue;
            }
            let (expected, longest) = (small.longest(), large.longest());
            let report = format!(
                "{name}: {longest:.1?} between two checks, {expected:.1?} with the small input; {:.1?} and {} checks in all, {run} runs",
                large.total(),
                large.0.len()
            );
            if longest <= expected * SLACK || longest <= large.total() / NEGLIGIBLE {
                return println!("{report}");
            }
            if run == MAX_RUNS {
                let at = large.0.iter().position(|&time| time == longest).unwrap();
                self.0.push(format!("{report}: before check {}", at + 1));
            }
        }
    }
}

/// Runs the test `name` again in a process of its own. There the allocator gets large lists from the system, which zeroes
/// their pages as they are first written; lists that it reuses it would zero at once. True where that was done, false in
/// that process.
fn run_with_fresh_memory(name: &str) -> bool {
    const FRESH_MEMORY: (&str, &str) = ("MALLOC_MMAP_THRESHOLD_", "65536");
    if std::env::var_os(FRESH_MEMORY.0).is_some() {
        return false;
    }
    // One after the other: side by side they would slow each other's memory down.
    static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
    let _turn = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    let mut test = Command::new(std::env::current_exe().unwrap());
    test.args(["--exact", name, "--nocapture"]).env(FRESH_MEMORY.0, FRESH_MEMORY.1);
    assert!(test.status().unwrap().success());
    true
}

fn terrain(triangles: u32) -> Arc<Scene> {
    let source = SceneSource::Builtin { name: "terrain".to_owned(), size: Some(triangles) };
    Arc::new(load(&source, &LoadOptions::default(), &CancelToken::new()).unwrap())
}

#[test]
fn builders() {
    if run_with_fresh_memory("latency::builders") {
        return;
    }
    let scenes = [terrain(SMALL), terrain(SMALL * GROWTH)];
    let mut all: Vec<BuildSettings> = BuilderKind::ALL
        .into_iter()
        .filter(|&builder| builder != BuilderKind::Exact)
        .flat_map(|builder| {
            ContainerKind::ALL.map(|container| BuildSettings { builder, container, ..BuildSettings::default() })
        })
        .collect();
    all.push(BuildSettings::preset(Preset::Best, ContainerKind::Aabb));
    all.push(BuildSettings { rounds: 2, ..BuildSettings::preset(Preset::Finest, ContainerKind::Aabb) });
    let mut growing = Growing::default();
    for settings in all.into_iter().filter(|settings| settings.refusal(0).is_none()) {
        let name = format!("{} {} {}", settings.builder.name(), settings.container.name(), settings.optimize);
        growing.check(&name, [&scenes[0], &scenes[1]], Arc::clone, |scene, token| {
            build_binary(&scene.triangles, &settings, token).unwrap()
        });
    }
    growing.assert_none();
}

#[test]
fn derived_data() {
    if run_with_fresh_memory("latency::derived_data") {
        return;
    }
    let scenes = [terrain(SMALL), terrain(SMALL * GROWTH)];
    let mut growing = Growing::default();
    for container in ContainerKind::ALL {
        let settings = BuildSettings { builder: BuilderKind::Lbvh, container, ..BuildSettings::default() };
        let accels = scenes.each_ref().map(|scene| {
            let accel = Accel::build_binary(scene, &settings, &CancelToken::new()).unwrap();
            Arc::new(accel)
        });
        let mut check = |what: &str, work: &(dyn Fn(&Arc<Accel>, &CancelToken) + Sync)| {
            let name = format!("{what}, {}", container.name());
            growing.check(&name, [&accels[0], &accels[1]], Arc::clone, |accel, token| work(&accel, token));
        };
        check("statistics", &|accel, token| drop(tree_stats(&accel.tree, token).unwrap()));
        check("list of nodes", &|accel, token| NodeTable::new(accel).list(None, token).unwrap());
        check("diagnosis", &|accel, token| drop(diagnose_scene(&accel.scene, token).unwrap()));
        check("ancestry", &|accel, token| {
            with_tree!(&accel.tree, tree => drop(Ancestry::new(tree, token).unwrap()));
        });
        check("shares of cost and largest nodes", &|accel, token| {
            with_tree!(&accel.tree, tree => {
                drop(subtree_sah_shares(tree, token).unwrap());
                let value = |node: u32| node_metrics::empty_space(tree, node).unwrap_or(0.0);
                drop(largest_nodes(tree.nodes.len(), 100, value, token).unwrap());
            });
        });
        check("surviving nodes", &|accel, token| {
            with_tree!(&accel.tree, tree => drop(surviving_nodes(tree, tree, token).unwrap()));
        });
        check("overlap", &|accel, token| {
            end_point_overlap(&accel.tree, &accel.scene.triangles, 100, token).unwrap();
        });
        for form in [NodeForm::Full, NodeForm::Compact] {
            let name = format!("wide tree, {}", container.name());
            // The tree is returned: handing its memory back to the system is no part of making it.
            growing.check(&name, [&accels[0], &accels[1]], Arc::clone, |accel, token| {
                AnyWideTree::new(&accel.tree, &accel.scene.triangles, form, token).unwrap()
            });
        }
        let table = |accel: &Arc<Accel>| NodeTable::new(accel);
        let name = format!("containers of the kind other than {}", container.name());
        growing.check(&name, [&accels[0], &accels[1]], table, |table, token| {
            table.complete(ContainerKind::WITH_ORIENTED.into_iter().collect(), token).unwrap();
            table
        });
    }
    // Where all triangles are equal, each sample of the overlap visits all nodes.
    let settings = BuildSettings { builder: BuilderKind::Lbvh, ..BuildSettings::default() };
    let stacks = scenes.each_ref().map(|scene| {
        let triangles = vec![scene.triangles[0]; scene.triangles.len()];
        let (tree, _) = build_binary(&triangles, &settings, &CancelToken::new()).unwrap();
        (tree, triangles)
    });
    growing.check(
        "overlap of one triangle many times",
        [&0, &1],
        |&which: &usize| which,
        |which, token| {
            let (tree, triangles) = &stacks[which];
            end_point_overlap(tree, triangles, 10, token).unwrap()
        },
    );
    growing.assert_none();
}

/// A tree with a level for each triangle: every interior node has a leaf and the next interior node.
fn list_of_nodes(scene: &Arc<Scene>) -> Arc<Accel> {
    let (triangles, mut around) = (&scene.triangles, Aabb::EMPTY);
    let last = triangles.len() as u32 - 1;
    let mut nodes = Vec::with_capacity(2 * triangles.len());
    for (at, triangle) in triangles.iter().enumerate().rev() {
        let at = at as u32;
        let leaf = Node { container: triangle.bounds(), first: at, count: 1 };
        around = around.union(&leaf.container);
        // Backwards: the leaf of an interior node stands behind it.
        nodes.push(leaf);
        if at < last {
            nodes.push(Node::interior(around, 2 * at + 1, 2));
        }
    }
    nodes.reverse();
    let tree = AnyTree::Aabb(Tree { nodes, primitive_indices: (0..=last).collect(), max_depth: last });
    Arc::new(Accel::with_tree(scene, &BuildSettings::default(), tree, &CancelToken::new()).unwrap())
}

/// No job on a tree does work between two checks that grows with its depth.
#[test]
fn deep_trees() {
    if run_with_fresh_memory("latency::deep_trees") {
        return;
    }
    let accels = [terrain(SMALL), terrain(SMALL * GROWTH)].map(|scene| list_of_nodes(&scene));
    let oriented =
        accels.each_ref().map(|accel| orient(&accel.tree, &accel.scene.triangles, &CancelToken::new()).unwrap());
    let mut growing = Growing::default();
    let mut check = |what: &str, work: &(dyn Fn(usize, &CancelToken) + Sync)| {
        growing.check(&format!("{what}, a list of nodes"), [&0, &1], |&which: &usize| which, work);
    };
    check("statistics", &|which, token| drop(tree_stats(&accels[which].tree, token).unwrap()));
    check("list of nodes", &|which, token| NodeTable::new(&accels[which]).list(None, token).unwrap());
    check("ancestry", &|which, token| {
        with_tree!(&accels[which].tree, tree => drop(Ancestry::new(tree, token).unwrap()));
    });
    check("shares of cost", &|which, token| {
        with_tree!(&accels[which].tree, tree => drop(subtree_sah_shares(tree, token).unwrap()));
    });
    check("surviving nodes", &|which, token| {
        with_tree!(&accels[which].tree, tree => drop(surviving_nodes(tree, tree, token).unwrap()));
    });
    check("overlap", &|which, token| {
        end_point_overlap(&accels[which].tree, &accels[which].scene.triangles, 10, token).unwrap();
    });
    check("orient", &|which, token| {
        orient(&accels[which].tree, &accels[which].scene.triangles, token).unwrap();
    });
    check("wide tree", &|which, token| {
        AnyWideTree::new(&accels[which].tree, &accels[which].scene.triangles, NodeForm::Full, token).unwrap();
    });
    for (name, trees) in [("box", accels.each_ref().map(|accel| &accel.tree)), ("oriented", oriented.each_ref())] {
        let files = [0, 1].map(|which: usize| {
            let mut bytes = Vec::new();
            let header = Header::new(accels[which].scene.triangles.len());
            write_tree(trees[which], &header, None, &mut bytes, &CancelToken::new()).unwrap();
            bytes
        });
        check(&format!("reading, {name}"), &|which, token| {
            let triangles = Some(&accels[which].scene.triangles[..]);
            let file = TreeFile::read(&files[which], triangles, u64::MAX, token).unwrap();
            assert_eq!(file.faults.len(), usize::from(name == "oriented"), "{:?}", file.faults);
        });
    }
    growing.assert_none();
}

#[test]
fn tree_files() {
    if run_with_fresh_memory("latency::tree_files") {
        return;
    }
    let scenes = [terrain(SMALL), terrain(SMALL * GROWTH)];
    let mut growing = Growing::default();
    for container in ContainerKind::ALL {
        let settings = BuildSettings { builder: BuilderKind::Lbvh, container, ..BuildSettings::default() };
        let files = scenes.each_ref().map(|scene| {
            let (tree, _) = build_binary(&scene.triangles, &settings, &CancelToken::new()).unwrap();
            let mut bytes = Vec::new();
            let header = Header::new(scene.triangles.len());
            write_tree(&tree, &header, Some(&scene.triangles), &mut bytes, &CancelToken::new()).unwrap();
            (Arc::clone(scene), tree, bytes)
        });
        let mut check = |what: &str, work: &(dyn Fn(&File, &CancelToken) + Sync)| {
            let name = format!("{what}, {}", container.name());
            let sizes = [&0_usize, &1];
            growing.check(&name, sizes, |&which| which, |which, token| work(&files[which], token));
        };
        check("reading", &|(_, _, bytes), token| drop(TreeFile::read(bytes, None, u64::MAX, token).unwrap()));
        check("reading over a mesh", &|(scene, _, bytes), token| {
            drop(TreeFile::read(bytes, Some(&scene.triangles), u64::MAX, token).unwrap());
        });
        check("writing", &|(scene, tree, _), token| {
            let header = Header::new(scene.triangles.len());
            write_tree(tree, &header, Some(&scene.triangles), &mut std::io::sink(), token).unwrap();
        });
        check("table", &|(_, tree, _), token| write_nodes_csv(tree, &mut std::io::sink(), token).unwrap());
    }
    growing.assert_none();
}

/// A scene, its tree and the file of that.
type File = (Arc<Scene>, AnyTree, Vec<u8>);

#[test]
fn pictures() {
    if run_with_fresh_memory("latency::pictures") {
        return;
    }
    let scene = terrain(2_000);
    let accel = Arc::new(Accel::build(&scene, &BuildSettings::default(), &CancelToken::new()).unwrap());
    let mut camera = Camera::framing(&scene.bounds, scene.up);
    // Away from the model, so that the time of a pixel is not that of its ray.
    camera.target = camera.eye + (camera.eye - camera.target);
    let request = |shading: Shading, size: [u32; 2]| RenderRequest {
        count_tests: true,
        ..RenderRequest::new(
            &accel,
            camera,
            RenderSettings { shading, samples: 2, mesh_edges: true, ..RenderSettings::default() },
            size,
        )
    };
    let sizes = [[320, 200], [320 * 2, 200 * GROWTH / 2]];
    // Cached by the first picture.
    accel.leaf_triangles();
    let mut growing = Growing::default();
    for shading in Shading::ALL {
        let requests = sizes.map(|size| request(shading, size));
        growing.check(shading.name(), [&requests[0], &requests[1]], Clone::clone, |request, token| {
            // The receiver frees the frames.
            let delivered = Mutex::new(Vec::new());
            let frame = render(&request, token, &|frame| delivered.lock().unwrap().push(frame)).unwrap();
            (frame, delivered)
        });
    }
    let folder = tempfile::tempdir().unwrap();
    let frames = sizes.map(|size| render(&request(Shading::Lit, size), &CancelToken::new(), &|_| ()).unwrap());
    growing.check("PNG", [&frames[0], &frames[1]], Clone::clone, |frame, token| {
        write_png(
            &folder.path().join("a.png"),
            &Protected::default(),
            [frame.width_px, frame.height_px],
            &frame.rgba,
            token,
        )
        .unwrap();
    });
    growing.check("EXR", [&frames[0], &frames[1]], Clone::clone, |frame, token| {
        write_distances(&folder.path().join("a.exr"), &Protected::default(), &frame, token).unwrap();
    });
    growing.assert_none();
}

/// A strip of `count` triangles in each format.
fn files(count: u32) -> Vec<(&'static str, Vec<u8>)> {
    let vertex = |k: u32| format!("{k} {} 0", (k % 1_000).pow(2) % 97);
    let mut obj = String::new();
    let mut ply = format!(
        "ply\nformat ascii 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {count}\nproperty list uchar int vertex_indices\nend_header\n"
    );
    let mut binary_ply = ply.replace("ascii", "binary_little_endian").into_bytes();
    let mut stl = String::from("solid a\n");
    let mut binary_stl = vec![0; 80];
    binary_stl.extend(count.to_le_bytes());
    let mut buffer = Vec::new();
    let mut pbrt = String::from("WorldBegin\nShape \"trianglemesh\" \"point3 P\" [\n");
    let mut indices = String::new();
    for k in 0..count {
        pbrt += &format!("{}\n", vertex(k));
        indices += &format!("{k} {} {}\n", (k + 1) % count, (k + 2) % count);
        obj += &format!("v {}\n", vertex(k));
        ply += &format!("{}\n", vertex(k));
        let corner = [k as f32, ((k % 1_000).pow(2) % 97) as f32, 0.0].map(f32::to_le_bytes);
        binary_ply.extend(corner.as_flattened());
        buffer.extend(corner.as_flattened());
        stl += "facet normal 0 0 0\nouter loop\n";
        binary_stl.extend([0; 12]);
        for j in k..k + 3 {
            stl += &format!("vertex {}\n", vertex(j));
            binary_stl.extend([j as f32, ((j % 1_000).pow(2) % 97) as f32, 0.0].map(f32::to_le_bytes).as_flattened());
        }
        binary_stl.extend([0; 2]);
        stl += "endloop\nendfacet\n";
    }
    for k in 0..count {
        let [a, b, c] = [k, (k + 1) % count, (k + 2) % count];
        obj += &format!("f {} {} {}\n", a + 1, b + 1, c + 1);
        ply += &format!("3 {a} {b} {c}\n");
        binary_ply.push(3);
        binary_ply.extend([a, b, c].map(u32::to_le_bytes).as_flattened());
        buffer.extend([a, b, c].map(u32::to_le_bytes).as_flattened());
    }
    pbrt += &format!("] \"integer indices\" [\n{indices}]\n");
    let json = format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"nodes\":[{{\"mesh\":0}}],\"buffers\":[{{\"byteLength\":{}}}],\
         \"bufferViews\":[{{\"buffer\":0,\"byteOffset\":0,\"byteLength\":{half}}},\
         {{\"buffer\":0,\"byteOffset\":{half},\"byteLength\":{half}}}],\
         \"accessors\":[{{\"bufferView\":0,\"componentType\":5126,\"count\":{count},\"type\":\"VEC3\"}},\
         {{\"bufferView\":1,\"componentType\":5125,\"count\":{},\"type\":\"SCALAR\"}}],\
         \"meshes\":[{{\"primitives\":[{{\"attributes\":{{\"POSITION\":0,\"NORMAL\":0}},\"indices\":1}}]}}]}}",
        buffer.len(),
        3 * count,
        half = 12 * count,
    );
    let json = format!("{json:0$}", json.len().next_multiple_of(4));
    let mut glb = b"glTF\x02\0\0\0".to_vec();
    glb.extend((28 + json.len() as u32 + buffer.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", json.as_bytes()), (b"BIN\0", &buffer)] {
        glb.extend((chunk.len() as u32).to_le_bytes());
        glb.extend(kind);
        glb.extend(chunk);
    }
    vec![
        ("text.obj", obj.into_bytes()),
        ("text.ply", ply.into_bytes()),
        ("binary.ply", binary_ply),
        ("text.stl", stl.into_bytes()),
        ("binary.stl", binary_stl),
        ("text.pbrt", pbrt.into_bytes()),
        ("binary.glb", glb),
    ]
}

#[test]
fn models() {
    if run_with_fresh_memory("latency::models") {
        return;
    }
    let folders = [SMALL, SMALL * GROWTH].map(|count| {
        let folder = tempfile::tempdir().unwrap();
        for (name, bytes) in files(count) {
            std::fs::write(folder.path().join(name), bytes).unwrap();
        }
        folder
    });
    let mut growing = Growing::default();
    let mut check = |name: &str, sources: [SceneSource; 2]| {
        growing.check(name, [&sources[0], &sources[1]], Clone::clone, |source, token| {
            load(&source, &LoadOptions::default(), token).unwrap()
        });
    };
    for (name, _) in files(3) {
        check(name, folders.each_ref().map(|folder| SceneSource::File(folder.path().join(name))));
    }
    // A teapot grows with the square of its number, a flake to nine times its size with each level.
    for (name, small, large) in [
        ("teapot", 40, 120),
        ("sphereflake", 3, 4),
        ("terrain", 4 * SMALL, 4 * SMALL * GROWTH),
        ("slivers", SMALL, SMALL * GROWTH),
        ("hair", SMALL, SMALL * GROWTH),
        ("foliage", SMALL, SMALL * GROWTH),
        ("tilted", SMALL / 12, SMALL * GROWTH / 12),
        ("clusters", 400, 400 * GROWTH),
    ] {
        check(name, [small, large].map(|size| SceneSource::Builtin { name: name.to_owned(), size: Some(size) }));
    }
    growing.assert_none();
}
