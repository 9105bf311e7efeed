//! The same triangles and settings give the identical tree, node for node, on any number of threads and at each SIMD level.

use bvhscope_engine::BinaryBvh;
use bvhscope_engine::build_cache::BuildCache;
use bvhscope_engine::builders::build_binary;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::fingerprint;
use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Curve, Pass, Passes, Preset};
use bvhscope_engine::tree::statistics::{TreeStats, tree_stats};
use bvhscope_engine::tree::{AnyTree, ContainerKind};
use bvhscope_engine::wide::NodeForm;
use bvhscope_engine::wide::tree::AnyWideTree;
use glam::Vec3;

/// A bumpy sheet of `2 · side²` triangles, in no helpful order, every tenth one twice.
fn sheet(side: u32) -> Vec<Triangle> {
    let at = |x: u32, y: u32| {
        let (x, y) = (x as f32 / side as f32, y as f32 / side as f32);
        Vec3::new(x, y, 0.1 * (7.0 * x).sin() * (11.0 * y).cos())
    };
    let mut triangles = Vec::new();
    for x in 0..side {
        for y in 0..side {
            triangles.push(Triangle { a: at(x, y), b: at(x + 1, y), c: at(x + 1, y + 1) });
            triangles.push(Triangle { a: at(x, y), b: at(x + 1, y + 1), c: at(x, y + 1) });
        }
    }
    let twice: Vec<Triangle> = triangles.iter().step_by(10).copied().collect();
    triangles.extend(twice);
    let count = triangles.len();
    (0..count).map(|index| triangles[index * 7919 % count]).collect()
}

fn build_with_threads(triangles: &[Triangle], settings: &BuildSettings, threads: usize) -> AnyTree {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| build_binary(triangles, settings, &CancelToken::new())).unwrap().0
}

/// The wide tree in both forms.
fn widen_with_threads(triangles: &[Triangle], tree: &AnyTree, threads: usize) -> [AnyWideTree; 2] {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    [NodeForm::Full, NodeForm::Compact]
        .map(|form| pool.install(|| AnyWideTree::new(tree, triangles, form, &CancelToken::new()).unwrap()))
}

#[test]
fn trees_do_not_depend_on_the_number_of_threads() {
    let triangles = sheet(120);
    let others = [
        BuilderKind::Swift,
        BuilderKind::Lbvh,
        BuilderKind::Ploc,
        BuilderKind::Hploc,
        BuilderKind::BinnedSah,
        BuilderKind::Sweep,
        BuilderKind::Sbvh,
    ]
    .map(|builder| (builder, Curve::Morton));
    for (builder, curve) in Curve::ALL.into_iter().map(|curve| (BuilderKind::Aac, curve)).chain(others) {
        for container in ContainerKind::ALL {
            let settings = BuildSettings { builder, container, curve, ..BuildSettings::default() };
            if settings.refusal(triangles.len()).is_some() {
                continue;
            }
            let one = build_with_threads(&triangles, &settings, 1);
            for threads in [2, 3, 7] {
                let many = build_with_threads(&triangles, &settings, threads);
                assert!(one == many, "{} {}: {threads} threads make another tree", builder.name(), container.name());
                let equal = widen_with_threads(&triangles, &one, 1) == widen_with_threads(&triangles, &many, threads);
                assert!(equal, "{} {}: {threads} threads make another wide tree", builder.name(), container.name());
            }
        }
    }
}

/// A build with a cache sums them up while it writes the nodes, task by task.
#[test]
fn statistics_of_a_build_with_a_cache_are_those_of_its_tree() {
    let triangles = sheet(120);
    for container in ContainerKind::ALL {
        let settings = BuildSettings { container, ..BuildSettings::default() };
        let mut cache = BuildCache::default();
        let built = BinaryBvh::build_with_cache(&triangles, &settings, Some(&mut cache), &CancelToken::new()).unwrap();
        let (summed, counted) = (built.report.stats, tree_stats(&built.tree, &CancelToken::new()).unwrap());
        assert!(
            (summed.sah_cost / counted.sah_cost - 1.0).abs() < 1e-5,
            "{} and {}",
            summed.sah_cost,
            counted.sah_cost
        );
        assert_eq!(TreeStats { sah_cost: counted.sah_cost, ..summed }, counted, "{container:?}");
    }
}

#[test]
fn a_build_repeats() {
    let triangles = sheet(30);
    for builder in BuilderKind::ALL {
        for threshold in [2, 6, 64] {
            let settings = BuildSettings { builder, threshold, ..BuildSettings::default() };
            let first = build_binary(&triangles, &settings, &CancelToken::new()).unwrap().0;
            let second = build_binary(&triangles, &settings, &CancelToken::new()).unwrap().0;
            assert!(first == second, "{} with threshold {threshold}", builder.name());
        }
    }
}

#[test]
fn the_tree_follows_the_triangles_not_the_pool_it_was_built_in_before() {
    let (small, large) = (sheet(10), sheet(60));
    let settings = BuildSettings::default();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let fresh = build_with_threads(&small, &settings, 2);
    let after_another = pool.install(|| {
        build_binary(&large, &settings, &CancelToken::new()).unwrap();
        build_binary(&small, &settings, &CancelToken::new()).unwrap().0
    });
    assert!(fresh == after_another);
}

/// Every builder, preset, curve and pass, in either container.
fn all_settings(count: usize) -> Vec<BuildSettings> {
    let mut settings = Vec::new();
    for container in ContainerKind::ALL {
        let plain = BuildSettings { container, rounds: 6, ..BuildSettings::default() };
        settings.extend(BuilderKind::ALL.map(|builder| BuildSettings { builder, ..plain }));
        settings
            .extend(Preset::ALL.map(|preset| BuildSettings { rounds: 6, ..BuildSettings::preset(preset, container) }));
        settings.extend([2, 64].map(|threshold| BuildSettings { threshold, ..plain }));
        settings.extend(Curve::ALL.map(|curve| BuildSettings { curve, ..plain }));
        settings.extend(Pass::ALL.map(|pass| BuildSettings { optimize: Passes::NONE.with(pass), ..plain }));
        settings.push(BuildSettings { optimize: Passes::ALL, ..plain });
    }
    settings.retain(|settings| settings.refusal(count).is_none());
    settings
}

/// The only test of this program that limits builds, as the limit is the process's.
#[test]
fn trees_do_not_depend_on_the_simd_level() {
    let token = CancelToken::new();
    let hit_and_miss = |at: u32| Vec3::new((at % 13) as f32, (at % 7) as f32, (at % 29) as f32);
    // Long and short, many of them alike, some without an area, on both sides of zero.
    let soup: Vec<Triangle> = (0..3000_u32)
        .map(|at| {
            let a = hit_and_miss(at * 31) - 6.0;
            Triangle { a, b: a + hit_and_miss(at * 17) * 0.1, c: a - hit_and_miss(at / 3) * 0.7 }
        })
        .collect();
    // One million units across and a thousandth: products that rounding differs for where they are fused.
    let askew: Vec<Triangle> = sheet(30)
        .into_iter()
        .map(|triangle| {
            let skew = |p: Vec3| Vec3::new(p.x * 1e6 + 1.0 / 3.0, p.y * 0.1 - p.x, p.z / 7.0 + p.y);
            Triangle { a: skew(triangle.a), b: skew(triangle.b), c: skew(triangle.c) }
        })
        .collect();
    let levels: Vec<SimdLevel> = SimdLevel::ALL.into_iter().filter(|level| level.is_available()).collect();
    for (name, triangles) in [("sheet", sheet(80)), ("soup", soup), ("askew", askew)] {
        for settings in all_settings(triangles.len()) {
            let mut expected: Option<(AnyTree, u64, [AnyWideTree; 2], [u64; 2])> = None;
            for &level in &levels {
                SimdLevel::limit_builds(Some(level));
                assert_eq!(SimdLevel::of_builds(), level);
                let tree = build_with_threads(&triangles, &settings, 2);
                let wide = widen_with_threads(&triangles, &tree, 2);
                let of_tree = fingerprint::of_tree(&tree, &token).unwrap();
                let of_wide = wide.each_ref().map(|wide| fingerprint::of_wide_tree(wide, &token).unwrap());
                let (first, first_hash, first_wide, first_wide_hash) =
                    expected.get_or_insert_with(|| (tree.clone(), of_tree, wide.clone(), of_wide));
                let what = format!("{name} at {} and {}: {settings:?}", levels[0].name(), level.name());
                assert!(*first == tree && *first_hash == of_tree, "{what}");
                assert!(*first_wide == wide && *first_wide_hash == of_wide, "wide tree, {what}");
            }
        }
    }
    SimdLevel::limit_builds(None);
    assert_eq!(SimdLevel::of_builds(), SimdLevel::best());
}

#[test]
fn a_fingerprint_depends_on_every_part_of_a_tree() {
    let token = CancelToken::new();
    let triangles = sheet(60);
    let tree = build_with_threads(&triangles, &BuildSettings::default(), 2);
    let hash = |tree: &AnyTree| fingerprint::of_tree(tree, &token).unwrap();
    let expected = hash(&tree);
    let AnyTree::Aabb(tree) = tree else { panic!("the default is boxes") };
    let last = tree.nodes.len() - 1;
    let changes: [fn(&mut bvhscope_engine::tree::Tree<bvhscope_engine::Aabb>, usize); 6] = [
        |tree, at| tree.nodes[at].container.max.z = tree.nodes[at].container.max.z.next_up(),
        |tree, at| tree.nodes[at].first ^= 1,
        |tree, at| tree.nodes[at].count ^= 1,
        |tree, _| tree.primitive_indices.swap(7, 4099),
        |tree, _| tree.max_depth += 1,
        |tree, _| tree.nodes.truncate(tree.nodes.len() - 1),
    ];
    for (index, change) in changes.into_iter().enumerate() {
        for at in [0, 4095, last] {
            let mut other = tree.clone();
            change(&mut other, at);
            assert_ne!(hash(&other.into()), expected, "change {index} of node {at}");
        }
    }
    let mut moved = tree.clone();
    moved.nodes.swap(1, 4097);
    assert_ne!(hash(&moved.into()), expected, "the order of nodes");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    assert_eq!(pool.install(|| hash(&tree.into())), expected, "the number of threads");
}
