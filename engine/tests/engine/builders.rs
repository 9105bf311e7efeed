//! Every builder on ordinary, empty, flat, equal, huge and tiny input.

use bvhscope_engine::builders::{BuildError, build_binary};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Curve, Preset};
use bvhscope_engine::tree::statistics::collapsed_cost_of;
use bvhscope_engine::tree::{AnyTree, Container, ContainerKind, Tree};
use bvhscope_engine::with_tree;
use glam::Vec3;

use crate::trees;

/// Builders that divide their work among threads.
const FORKING: [BuilderKind; 7] = [
    BuilderKind::Aac,
    BuilderKind::Lbvh,
    BuilderKind::Ploc,
    BuilderKind::Hploc,
    BuilderKind::BinnedSah,
    BuilderKind::Sweep,
    BuilderKind::Sbvh,
];

/// A fixed sequence of numbers between -1 and 1.
fn numbers() -> impl FnMut() -> f32 {
    let mut state = 12345_u32;
    move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 23) as f32 - 1.0
    }
}

/// `count` small triangles in a cube.
fn soup(count: usize) -> Vec<Triangle> {
    let mut number = numbers();
    let mut point = || Vec3::new(number(), number(), number());
    (0..count)
        .map(|_| {
            let a = point();
            Triangle { a, b: a + 0.05 * point(), c: a + 0.05 * point() }
        })
        .collect()
}

/// Every combination that builds `count` triangles.
fn all_settings(count: usize) -> Vec<BuildSettings> {
    let mut all = Vec::new();
    for container in ContainerKind::ALL {
        for builder in BuilderKind::ALL {
            all.push(BuildSettings { builder, ..BuildSettings::preset(Preset::Fast, container) });
        }
        for preset in [Preset::Hq, Preset::AacFast, Preset::AacHq] {
            all.push(BuildSettings { rounds: 6, ..BuildSettings::preset(preset, container) });
        }
        for (builder, curve) in [BuilderKind::Aac, BuilderKind::Lbvh, BuilderKind::Ploc, BuilderKind::Hploc]
            .into_iter()
            .flat_map(|b| [Curve::Hilbert, Curve::Extended].map(|c| (b, c)))
        {
            all.push(BuildSettings { builder, curve, ..BuildSettings::preset(Preset::Fast, container) });
        }
        for (threshold, epsilon) in [(2, 0.0), (2, 0.5), (64, 0.0), (64, 0.5), (5, 0.37)] {
            all.push(BuildSettings { container, threshold, epsilon, ..BuildSettings::default() });
        }
    }
    all.retain(|settings| settings.refusal(count).is_none());
    all
}

/// Fails where `tree` is not a binary hierarchy over `triangles`. `splits` if several leaves may hold one, each for its part.
fn check<C: Container>(tree: &Tree<C>, triangles: &[Triangle], splits: bool, name: &str) {
    let mut seen = vec![false; triangles.len()];
    for &primitive in &tree.primitive_indices {
        let again = std::mem::replace(&mut seen[primitive as usize], true);
        assert!(splits || !again, "{name}: primitive {primitive} twice");
    }
    let mut missing: Vec<u8> = vec![if splits { 0b111 } else { 0 }; triangles.len()];
    assert!(seen.iter().all(|&seen| seen), "{name}: a primitive is missing");
    let mut reached = vec![false; tree.nodes.len()];
    let mut next_primitive = 0;
    let mut open = vec![0_u32];
    reached[0] = true;
    while let Some(at) = open.pop() {
        let node = &tree.nodes[at as usize];
        assert!(node.container.relative_area() >= 0.0, "{name}: {node:?}");
        let size = node.container.bounds().extent().max_element();
        assert!(node.container.bounds().min.is_finite() && node.container.bounds().max.is_finite(), "{name}: {node:?}");
        let slack =
            node.container.bounds().min.abs().max(node.container.bounds().max.abs()).max_element().max(size) * 1e-6;
        if node.is_leaf() {
            assert_eq!(node.first, next_primitive, "{name}: leaves are not in order");
            next_primitive += node.count;
            for &primitive in &tree.primitive_indices[node.first as usize..(node.first + node.count) as usize] {
                let triangle = triangles[primitive as usize];
                for (at, corner) in [triangle.a, triangle.b, triangle.c].into_iter().enumerate() {
                    let holds = node.container.contains_point(corner, slack);
                    assert!(splits || holds, "{name}: {corner} outside {node:?}");
                    missing[primitive as usize] &= !(u8::from(holds) << at);
                }
            }
        } else {
            assert!(node.first > at, "{name}: child before parent");
            for child in [node.first + 1, node.first] {
                assert!(!std::mem::replace(&mut reached[child as usize], true), "{name}: node {child} reached twice");
                let inner = tree.nodes[child as usize].container;
                assert!(node.container.contains(&inner, slack), "{name}: {inner:?} outside {node:?}");
                open.push(child);
            }
        }
    }
    assert_eq!(missing.iter().position(|&corners| corners != 0), None, "{name}: a corner is in no leaf");
    assert!(reached.iter().all(|&reached| reached), "{name}: a node hangs loose");
    assert_eq!(tree.depths(&CancelToken::new()).unwrap().into_iter().max(), Some(tree.max_depth), "{name}: depth");
}

fn check_all(triangles: &[Triangle], what: &str) {
    for settings in all_settings(triangles.len()) {
        let name = format!("{what}, {settings:?}");
        let (tree, times) =
            build_binary(triangles, &settings, &CancelToken::new()).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(tree.container_kind(), settings.container);
        assert!(!times.stages.is_empty(), "{name}: no times");
        let splits = settings.builder == BuilderKind::Sbvh;
        with_tree!(&tree, tree => check(tree, triangles, splits, &name));
        let leaves = match settings.builder {
            BuilderKind::None => 1..=1,
            // Up to four primitives in each leaf.
            BuilderKind::Swift => triangles.len().div_ceil(4)..=triangles.len(),
            BuilderKind::Sbvh => triangles.len()..=2 * triangles.len(),
            _ => triangles.len()..=triangles.len(),
        };
        assert!(leaves.contains(&tree.node_count().div_ceil(2)), "{name}: {} nodes", tree.node_count());
    }
}

#[test]
fn no_triangles_give_a_tree_without_nodes() {
    for settings in all_settings(0) {
        let (tree, _) = build_binary(&[], &settings, &CancelToken::new()).unwrap();
        assert_eq!(tree.node_count(), 0);
        assert!(tree.primitive_indices().is_empty());
    }
}

#[test]
fn few_triangles_give_whole_trees() {
    for count in 1..40 {
        check_all(&soup(count), &format!("{count} triangles"));
    }
}

#[test]
fn many_triangles_give_whole_trees() {
    check_all(&soup(3000), "soup");
}

#[test]
fn more_than_one_task_gives_whole_trees() {
    let triangles = soup(30_000);
    for container in ContainerKind::ALL {
        for builder in FORKING {
            let settings = BuildSettings { builder, ..BuildSettings::preset(Preset::Hq, container) };
            if settings.refusal(triangles.len()).is_none() {
                let (tree, _) = build_binary(&triangles, &settings, &CancelToken::new()).unwrap();
                let splits = builder == BuilderKind::Sbvh;
                with_tree!(&tree, tree => check(tree, &triangles, splits, builder.name()));
            }
        }
    }
}

#[test]
fn equal_flat_and_degenerate_triangles_give_whole_trees() {
    let one = soup(1)[0];
    check_all(&[one; 2], "two equal");
    check_all(&[one; 333], "all equal");
    let squashed = |keep: Vec3| -> Vec<Triangle> {
        soup(300).iter().map(|t| Triangle { a: t.a * keep, b: t.b * keep, c: t.c * keep }).collect()
    };
    check_all(&squashed(Vec3::new(1.0, 1.0, 0.0)), "in a plane");
    check_all(&squashed(Vec3::X), "on a line");
    check_all(&squashed(Vec3::ZERO), "in a point");
    let points: Vec<Triangle> = soup(300).iter().map(|t| Triangle { a: t.a, b: t.a, c: t.a }).collect();
    check_all(&points, "points");
}

#[test]
fn huge_tiny_and_mixed_coordinates_give_whole_trees() {
    let scaled = |scale: f32| -> Vec<Triangle> {
        soup(200).iter().map(|t| Triangle { a: t.a * scale, b: t.b * scale, c: t.c * scale }).collect()
    };
    for scale in [1e30, 1e18, 1e-20, 1e-30, 1e-41] {
        check_all(&scaled(scale), &format!("scaled by {scale:e}"));
    }
    let mut outlier = soup(200);
    outlier.push(Triangle { a: Vec3::splat(1e30), b: Vec3::splat(0.9e30), c: Vec3::new(1e30, 0.0, 0.0) });
    check_all(&outlier, "one far away");
    let mixed: Vec<Triangle> = soup(200)
        .iter()
        .enumerate()
        .map(|(index, t)| {
            let scale = (index as f32 * 0.6 - 60.0).exp2();
            Triangle { a: t.a * scale, b: t.b * scale, c: t.c * scale }
        })
        .collect();
    check_all(&mixed, "sizes from 2^-60 to 2^59");
}

#[test]
fn equal_triangles_do_not_make_a_list() {
    let triangles = vec![soup(1)[0]; 20_000];
    let limit = 2 * triangles.len().ilog2() + 16;
    for container in ContainerKind::ALL {
        for preset in Preset::ALL {
            let settings = BuildSettings { rounds: 6, ..BuildSettings::preset(preset, container) };
            let (tree, _) = build_binary(&triangles, &settings, &CancelToken::new()).unwrap();
            assert!(tree.max_depth() <= limit, "{settings:?}: depth {} of {limit}", tree.max_depth());
        }
        for builder in [BuilderKind::Lbvh, BuilderKind::Ploc, BuilderKind::Hploc, BuilderKind::Sweep, BuilderKind::Sbvh]
        {
            let settings = BuildSettings { builder, container, ..BuildSettings::default() };
            if settings.refusal(triangles.len()).is_none() {
                let (tree, _) = build_binary(&triangles, &settings, &CancelToken::new()).unwrap();
                assert!(tree.max_depth() <= limit, "{settings:?}: depth {} of {limit}", tree.max_depth());
            }
        }
    }
    let settings = BuildSettings { builder: BuilderKind::Exact, ..BuildSettings::default() };
    let (tree, _) = build_binary(&triangles[..1000], &settings, &CancelToken::new()).unwrap();
    assert!(tree.max_depth() <= 2 * 10 + 16, "exact: depth {}", tree.max_depth());
}

/// The cost that all builders try to keep low: areas of all inner nodes, as a multiple of the root's.
fn cost(tree: &AnyTree) -> f64 {
    with_tree!(tree, tree => {
        tree.nodes.iter().filter(|node| !node.is_leaf()).map(|node| f64::from(node.container.relative_area())).sum::<f64>()
            / f64::from(tree.nodes[0].container.relative_area())
    })
}

#[test]
fn better_settings_make_better_trees() {
    // Sizes from fine to coarse, as in architecture; among equal sizes evenly spread the builders hardly differ.
    let triangles: Vec<Triangle> = soup(4000)
        .iter()
        .enumerate()
        .map(|(index, t)| {
            let size = (index as f32 * 0.618).fract().powi(4) * 20.0 + 0.1;
            Triangle { a: t.a, b: t.a + (t.b - t.a) * size, c: t.a + (t.c - t.a) * size }
        })
        .collect();
    let cost_of = |builder: BuilderKind, preset: Preset| {
        let settings = BuildSettings { builder, ..BuildSettings::preset(preset, ContainerKind::Aabb) };
        cost(&build_binary(&triangles, &settings, &CancelToken::new()).unwrap().0)
    };
    let lbvh = cost_of(BuilderKind::Lbvh, Preset::Fast);
    let fast = cost_of(BuilderKind::Aac, Preset::Fast);
    let hq = cost_of(BuilderKind::Aac, Preset::Hq);
    let swift = cost_of(BuilderKind::Swift, Preset::Fast);
    let sah = cost_of(BuilderKind::BinnedSah, Preset::Fast);
    assert!(hq < fast && fast < lbvh, "AAC HQ {hq}, AAC Fast {fast}, LBVH {lbvh}");
    assert!(sah < lbvh, "binned SAH {sah}, LBVH {lbvh}");
    let [sweep, ploc] = [BuilderKind::Sweep, BuilderKind::Ploc].map(|builder| cost_of(builder, Preset::Fast));
    assert!(sweep < sah, "sweep SAH {sweep}, binned SAH {sah}");
    assert!(ploc < 0.9 * lbvh, "PLOC {ploc}, LBVH {lbvh}");
    let [sbvh, hploc] = [BuilderKind::Sbvh, BuilderKind::Hploc].map(|builder| cost_of(builder, Preset::Fast));
    assert!(sbvh < sweep, "SBVH {sbvh}, sweep SAH {sweep}");
    assert!(hploc < 0.9 * lbvh && hploc < 1.1 * ploc, "H-PLOC {hploc}, PLOC {ploc}, LBVH {lbvh}");
    assert!(swift < lbvh, "AAC of leaf blocks {swift}, LBVH {lbvh}");
}

#[test]
fn leaf_blocks_make_as_good_a_tree_with_half_the_leaves() {
    let triangles = trees::ball(Vec3::ONE, 2.0, 100);
    for container in ContainerKind::ALL {
        let built = |preset| {
            let settings = BuildSettings::preset(preset, container);
            build_binary(&triangles, &settings, &CancelToken::new()).unwrap().0
        };
        let [fast, swift] = [Preset::Fast, Preset::Swift].map(built);
        // Both with their best leaves: Fast has leaves of one triangle each.
        let cost = |tree: &AnyTree| with_tree!(tree, tree => collapsed_cost_of(tree));
        let ratio = cost(&swift) / cost(&fast);
        assert!(ratio < 1.04, "{container:?}: {ratio}");
        let sizes: Vec<u32> = with_tree!(&swift, tree => tree.nodes.iter().filter(|node| node.is_leaf()).map(|node| node.count).collect());
        assert!(sizes.iter().all(|&size| size <= 4), "{container:?}");
        let share = sizes.len() as f64 / triangles.len() as f64;
        assert!((0.3..0.6).contains(&share), "{container:?}: {share} leaves a triangle");
    }
}

/// Exact clustering by the text: all pairs, each time.
fn naive_exact(triangles: &[Triangle]) -> Vec<f32> {
    let mut clusters: Vec<_> = triangles.iter().map(|triangle| (triangle.bounds(), 1_u32)).collect();
    let mut areas = Vec::new();
    while clusters.len() > 1 {
        let mut best = (f32::INFINITY, u32::MAX, 0, 0);
        for i in 0..clusters.len() {
            for j in i + 1..clusters.len() {
                let found = (clusters[i].0.union(&clusters[j].0).half_area(), clusters[i].1 + clusters[j].1, i, j);
                if found < best {
                    best = found;
                }
            }
        }
        let (_, count, i, j) = best;
        let union = clusters[i].0.union(&clusters[j].0);
        areas.push(union.half_area());
        clusters[i] = (union, count);
        clusters.swap_remove(j);
    }
    areas.sort_by(f32::total_cmp);
    areas
}

#[test]
fn exact_clustering_always_takes_the_closest_pair() {
    for count in [2, 3, 7, 8, 9, 17, 150] {
        let triangles = soup(count);
        let settings = BuildSettings { builder: BuilderKind::Exact, ..BuildSettings::default() };
        let (tree, _) = build_binary(&triangles, &settings, &CancelToken::new()).unwrap();
        let AnyTree::Aabb(tree) = tree else { panic!("not boxes") };
        let mut areas: Vec<f32> =
            tree.nodes.iter().filter(|node| !node.is_leaf()).map(|node| node.container.half_area()).collect();
        areas.sort_by(f32::total_cmp);
        assert_eq!(areas, naive_exact(&triangles), "{count} triangles");
    }
}

#[test]
fn a_threshold_above_the_number_of_triangles_is_exact_clustering() {
    let triangles = soup(63);
    let exact = BuildSettings { builder: BuilderKind::Exact, ..BuildSettings::default() };
    let aac = BuildSettings { builder: BuilderKind::Aac, threshold: 64, ..BuildSettings::default() };
    let exact = build_binary(&triangles, &exact, &CancelToken::new()).unwrap().0;
    let aac = build_binary(&triangles, &aac, &CancelToken::new()).unwrap().0;
    assert!((cost(&exact) - cost(&aac)).abs() < 1e-6);
}

#[test]
fn refused_settings_say_why() {
    let triangles = soup(10);
    let settings =
        BuildSettings { builder: BuilderKind::BinnedSah, container: ContainerKind::Sphere, ..BuildSettings::default() };
    let error = build_binary(&triangles, &settings, &CancelToken::new()).unwrap_err();
    assert!(matches!(&error, BuildError::Refused(text) if text.contains("box")), "{error}");
    let many = vec![triangles[0]; BuildSettings::MAX_EXACT_PRIMITIVES + 1];
    let settings = BuildSettings { builder: BuilderKind::Exact, ..BuildSettings::default() };
    let error = build_binary(&many, &settings, &CancelToken::new()).unwrap_err();
    assert!(matches!(&error, BuildError::Refused(text) if text.contains("20000")), "{error}");
}

#[test]
fn a_cancelled_build_stops() {
    let triangles = soup(2000);
    let token = CancelToken::new();
    token.cancel();
    for settings in all_settings(triangles.len()) {
        assert!(
            matches!(build_binary(&triangles, &settings, &token), Err(BuildError::Cancelled(_))),
            "{settings:?} went on"
        );
    }
}

#[test]
fn a_build_cancelled_at_any_check_point_stops_and_the_next_one_is_right() {
    let triangles = soup(20_000);
    for container in ContainerKind::ALL {
        for builder in FORKING {
            let settings = BuildSettings { builder, ..BuildSettings::preset(Preset::Hq, container) };
            if settings.refusal(triangles.len()).is_some() {
                continue;
            }
            let (expected, _) = build_binary(&triangles, &settings, &CancelToken::new()).unwrap();
            let mut look = 0;
            // Each build polls at the same points, but how far other tasks get once one is cancelled varies.
            while let Err(error) = build_binary(&triangles, &settings, &CancelToken::watched(move |seen| seen > look)) {
                assert!(matches!(error, BuildError::Cancelled(_)), "{settings:?}, look {look}: {error}");
                look = look * 5 / 4 + 1;
            }
            assert!(look > 8, "{settings:?}: {look} check points are too few");
            let (again, _) = build_binary(&triangles, &settings, &CancelToken::new()).unwrap();
            assert!(again == expected, "{settings:?}: a cancelled build left something behind");
        }
    }
}

#[test]
fn exact_clustering_stops_in_the_middle_of_equal_triangles() {
    let triangles = vec![soup(1)[0]; 3000];
    let settings = BuildSettings { builder: BuilderKind::Exact, ..BuildSettings::default() };
    // All are each other's best match: nearly all the time goes into the searches of a few merges.
    let result = build_binary(&triangles, &settings, &CancelToken::watched(|seen| seen > 2000));
    assert!(matches!(result, Err(BuildError::Cancelled(_))));
}

#[test]
fn progress_ends_at_one() {
    let triangles = soup(20_000);
    for builder in FORKING.into_iter().chain([BuilderKind::None]) {
        let token = CancelToken::new();
        let settings = BuildSettings { builder, ..BuildSettings::default() };
        build_binary(&triangles, &settings, &token).unwrap();
        assert_eq!(token.progress(), 1.0, "{}", builder.name());
    }
}
