//! The record of a construction against a replay of its merges.

use bvhscope_engine::builders::{BuildError, build_binary};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::construction::{Construction, MergeOrder, Reduction};
use bvhscope_engine::geometry::{Aabb, Triangle};
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Curve, Pass, Passes};
use bvhscope_engine::tree::{AnyTree, Container, ContainerKind, Tree};
use bvhscope_engine::with_tree;

use crate::trees;

/// Scenes with ties, with several tasks, and with coordinates that have to be scaled.
fn scenes() -> Vec<(&'static str, Vec<Triangle>)> {
    let mut scenes = trees::nasty_scenes();
    scenes.push(("several tasks", trees::soup(30_000, 0.02, 91)));
    scenes.push(("ties in several tasks", trees::grid(100, 1, 0.0)));
    scenes
}

fn all_settings() -> Vec<BuildSettings> {
    let parameters =
        [(6, 0.2, Curve::Morton), (2, 0.5, Curve::Hilbert), (64, 0.0, Curve::Morton), (20, 0.1, Curve::Extended)];
    let of = |container| {
        move |(threshold, epsilon, curve)| BuildSettings {
            container,
            threshold,
            epsilon,
            curve,
            ..BuildSettings::default()
        }
    };
    ContainerKind::ALL.into_iter().flat_map(|container| parameters.map(of(container))).collect()
}

pub fn construct(triangles: &[Triangle], settings: &BuildSettings) -> Construction {
    Construction::new(triangles, settings, &CancelToken::new()).unwrap()
}

#[test]
fn the_tree_is_that_of_a_build_without_passes() {
    for (name, triangles) in scenes() {
        for settings in all_settings() {
            let construction = construct(&triangles, &settings);
            let (built, _) = build_binary(&triangles, &settings, &CancelToken::new()).unwrap();
            assert_eq!(construction.tree == built, !construction.is_too_deep(), "{name}, {settings:?}");
            let with_passes = BuildSettings { optimize: Passes::FINISHED, ..settings };
            assert!(construct(&triangles, &with_passes) == construction, "{name}: passes are not carried out");
        }
    }
}

#[test]
fn the_record_does_not_depend_on_the_number_of_threads() {
    let triangles = trees::soup(40_000, 0.02, 92);
    let with_threads = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| construct(&triangles, &BuildSettings::default()))
    };
    assert!(with_threads(1) == with_threads(3));
}

#[test]
fn merges_happen_in_the_lists_that_the_record_names() {
    for (name, triangles) in scenes() {
        for settings in all_settings() {
            let construction = construct(&triangles, &settings);
            with_tree!(&construction.tree, tree => replay(tree, &construction, &format!("{name}, {settings:?}")));
        }
    }
}

/// Does what a build by one thread does, with the pairs that the record names.
fn replay<C: Container>(tree: &Tree<C>, construction: &Construction, name: &str) {
    let record = &construction.record;
    let count = tree.primitive_indices.len();
    let mut leaf_at = vec![u32::MAX; count];
    for (index, node) in tree.nodes.iter().enumerate().filter(|(_, node)| node.is_leaf()) {
        leaf_at[record.positions()[node.first as usize] as usize] = index as u32;
    }
    assert!(leaf_at.iter().all(|&leaf| leaf != u32::MAX), "{name}: positions are no permutation");
    assert_eq!(record.len(), count - 1, "{name}");
    let (mut stack, mut merges) = (Vec::new(), 0);
    for (index, step) in record.steps().iter().enumerate() {
        let below: Vec<usize> = record.steps_below(index).collect();
        if below.is_empty() {
            stack.extend(step.positions().map(|position| leaf_at[position as usize]));
            assert_eq!(step.first_step as usize, index, "{name}");
        }
        let ranges: Vec<_> = below.iter().map(|&below| record.steps()[below].positions()).collect();
        if let [left, right] = &ranges[..] {
            assert_eq!((left.start, left.end, right.end), (step.positions().start, right.start, step.positions().end));
            assert!(below.iter().all(|&below| record.steps()[below].level == step.level + 1), "{name}");
        }
        let start = stack.len() - step.before as usize;
        assert_eq!(step.merges().start, merges, "{name}: merges are numbered one after another");
        for merge in step.merges() {
            let node = record.nodes()[merge as usize];
            let list = &mut stack[start..];
            assert_eq!(record.list_length(merge), Some(list.len() as u32), "{name}");
            if merge % 61 == 0 || merge as usize + 60 > record.len() {
                let [mut found, mut expected] = [construction.list_before(merge), list.to_vec()];
                found.sort_unstable();
                expected.sort_unstable();
                assert_eq!(found, expected, "{name}: the list before merge {merge}");
            }
            assert_eq!((record.merge_of(node), record.step_of(merge)), (Some(merge), Some(index)), "{name}");
            assert_eq!(record.level_of(node), Some(step.level), "{name}");
            let first = tree.nodes[node as usize].first;
            let low = list.iter().position(|&cluster| cluster == first);
            let high = list.iter().position(|&cluster| cluster == first + 1);
            let (Some(low), Some(high)) = (low, high) else { panic!("{name}: merge {merge} is not in its list") };
            list[low] = node;
            stack.remove(start + high);
            merges += 1;
        }
        assert_eq!(stack.len(), start + step.after as usize, "{name}");
    }
    assert_eq!(stack, [0], "{name}: the root is left");
}

#[test]
fn lists_are_reduced_by_f() {
    let triangles = trees::soup(20_000, 0.02, 93);
    for settings in all_settings() {
        let record = construct(&triangles, &settings).record;
        let f = Reduction::of(&settings);
        let (last, others) = record.steps().split_last().unwrap();
        assert_eq!((last.level, last.after, last.primitives), (0, 1, 20_000));
        assert_eq!(last.before as usize, f.reduced_count(20_000));
        assert!(others.iter().all(|step| step.after as usize == f.reduced_count(step.primitives as usize)));
        let levels = record.levels();
        assert!(levels.iter().zip(0..).all(|(level, depth)| level.level == depth), "each level once, the root's first");
        assert_eq!(levels.iter().map(|level| level.steps as usize).sum::<usize>(), others.len());
        let merges: u32 = levels.iter().map(|level| level.merges).sum();
        assert_eq!(merges + last.merges().len() as u32, 19_999);
        for level in &levels {
            let mut after: Vec<u32> =
                others.iter().filter(|step| step.level == level.level).map(|step| step.after).collect();
            after.sort_unstable();
            let spread = (level.after.min, level.after.median, level.after.max);
            assert_eq!(spread, (after[0], after[after.len() / 2], after[after.len() - 1]));
        }
    }
}

#[test]
fn split_triangles_are_recorded_by_their_proxies() {
    let triangles = trees::soup(3_000, 0.9, 94);
    let settings = BuildSettings { optimize: Passes::NONE.with(Pass::Split), ..BuildSettings::default() };
    let construction = construct(&triangles, &settings);
    let (built, _) = build_binary(&triangles, &settings, &CancelToken::new()).unwrap();
    assert!(construction.tree == built);
    assert!(construction.record.len() >= 3_000, "more primitives than triangles");
    with_tree!(&construction.tree, tree => replay(tree, &construction, "proxies"));
}

#[test]
fn exact_clustering_is_one_list() {
    let triangles = trees::soup(500, 0.1, 95);
    for container in ContainerKind::ALL {
        let settings = BuildSettings { builder: BuilderKind::Exact, container, ..BuildSettings::default() };
        let construction = construct(&triangles, &settings);
        let (built, _) = build_binary(&triangles, &settings, &CancelToken::new()).unwrap();
        assert!(construction.tree == built);
        with_tree!(&construction.tree, tree => replay(tree, &construction, "exact"));
        assert_eq!((construction.record.steps().len(), construction.record.levels()[0].merges), (1, 499));
    }
}

#[test]
fn lists_of_h_ploc_are_recorded_as_they_merge() {
    for (name, triangles) in scenes() {
        for container in ContainerKind::ALL {
            let settings = BuildSettings { builder: BuilderKind::Hploc, container, ..BuildSettings::default() };
            let construction = construct(&triangles, &settings);
            let (built, _) = build_binary(&triangles, &settings, &CancelToken::new()).unwrap();
            assert_eq!(construction.tree == built, !construction.is_too_deep(), "{name}");
            with_tree!(&construction.tree, tree => replay(tree, &construction, name));
            assert_eq!(construction.choice(0, &CancelToken::new()), Ok(None), "merges do not choose the closest pair");
            let (last, others) = construction.record.steps().split_last().unwrap();
            assert!(last.after == 1 && others.iter().all(|step| step.after <= 16 && step.before <= 32), "{name}");
        }
    }
}

#[test]
fn rounds_of_ploc_merge_clusters_that_are_each_others_nearest() {
    for (name, triangles) in scenes() {
        let settings = BuildSettings { builder: BuilderKind::Ploc, ..BuildSettings::default() };
        let construction = construct(&triangles, &settings);
        let (built, _) = build_binary(&triangles, &settings, &CancelToken::new()).unwrap();
        assert_eq!(construction.tree == built, !construction.is_too_deep(), "{name}");
        let AnyTree::Aabb(tree) = &construction.tree else { panic!("not boxes") };
        let record = &construction.record;
        let mut list = vec![0; tree.primitive_indices.len()];
        for (index, node) in tree.nodes.iter().enumerate().filter(|(_, node)| node.is_leaf()) {
            list[record.positions()[node.first as usize] as usize] = index as u32;
        }
        let mut merges = 0;
        for (step, level) in record.steps().iter().zip((0..record.steps().len() as u32).rev()) {
            assert_eq!((step.level, step.before as usize, step.merges().start), (level, list.len(), merges), "{name}");
            let mut next = list.clone();
            let mut last = None;
            for node in step.merges().map(|merge| record.nodes()[merge as usize]) {
                let place = |child: u32| list.iter().position(|&cluster| cluster == child);
                let first = tree.nodes[node as usize].first;
                let (low, high) = (place(first).unwrap(), place(first + 1).unwrap());
                assert!(low < high && high <= low + 8 && last < Some(low), "{name}: along the list, of one round");
                last = Some(low);
                if list.len() < 400 && step.merges().len() >= list.len().div_ceil(32) {
                    check_mutual(tree, &list, [low, high]);
                }
                (next[low], next[high]) = (node, u32::MAX);
                merges += 1;
            }
            next.retain(|&cluster| cluster != u32::MAX);
            assert_eq!(next.len(), step.after as usize, "{name}");
            list = next;
        }
        assert_eq!(list, [0], "{name}: the root is left");
        let timelines = [MergeOrder::Built, MergeOrder::Level]
            .map(|order| construction.timeline(order, &CancelToken::new()).unwrap().nodes().to_vec());
        assert_eq!(timelines[0], timelines[1], "rounds are levels");
    }
}

/// No other cluster within 8 places is closer to one of a pair than they are to each other.
fn check_mutual(tree: &Tree<Aabb>, list: &[u32], pair: [usize; 2]) {
    let container = |place: usize| tree.nodes[list[place] as usize].container;
    let area = |a: usize, b: usize| container(a).union(&container(b)).half_area();
    for own in pair {
        let near = (own.saturating_sub(8)..list.len().min(own + 9)).filter(|&other| other != own);
        assert!(near.into_iter().all(|other| area(own, other) >= area(pair[0], pair[1])), "{pair:?}");
    }
}

#[test]
fn few_triangles_and_other_builders() {
    let settings = BuildSettings::default();
    let empty = construct(&[], &settings);
    assert!(empty.record.is_empty() && empty.tree == AnyTree::Aabb(Tree::EMPTY) && !empty.is_too_deep());
    let timeline = empty.timeline(MergeOrder::Built, &CancelToken::new()).unwrap();
    assert_eq!((timeline.standing(0), timeline.largest_at(0, 5)), (0, vec![]));
    let one = construct(&trees::soup(1, 0.1, 96), &settings);
    assert_eq!((one.record.len(), one.record.steps().len(), one.record.step_of(0)), (0, 2, None));
    assert_eq!(one.timeline(MergeOrder::Level, &CancelToken::new()).unwrap().largest_at(3, 5), [0]);
    let lbvh = BuildSettings { builder: BuilderKind::Lbvh, ..settings };
    let refused = Construction::new(&trees::soup(3, 0.1, 97), &lbvh, &CancelToken::new());
    assert!(matches!(refused, Err(BuildError::Refused(text)) if text.contains("merges no clusters")));
    let swift = BuildSettings { builder: BuilderKind::Swift, ..settings };
    let refused = Construction::new(&trees::soup(3, 0.1, 97), &swift, &CancelToken::new());
    assert!(matches!(refused, Err(BuildError::Refused(text)) if text.contains("merges blocks of triangles")));
}
