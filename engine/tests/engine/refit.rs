//! Trees over triangles that move: every way of keeping one hits what a scan hits, wherever the triangles are.

use bvhscope_engine::builders::build_binary;
use bvhscope_engine::geometry::{Dop14, Hit, Ray, Triangle};
use bvhscope_engine::refit::{WideRefit, grow, refit, refit_and_reinsert, refit_and_rotate};
use bvhscope_engine::tree::statistics::tree_stats;
use bvhscope_engine::tree::validate::validate;
use bvhscope_engine::tree::{Container, Node, Tree};
use bvhscope_engine::wide::{AnyWideTree, NodeForm};
use bvhscope_engine::{
    Aabb, AnyTree, BuildSettings, BuilderKind, CancelToken, ContainerKind, Pass, Passes, Preset, Sphere,
};
use glam::{Quat, Vec3};

use crate::brute_force::{check, check_form};
use crate::random::Random;
use crate::trees::{self, scan};

/// The triangles a while later: turned and moved together, each by itself, or all at one place.
pub fn moved(triangles: &[Triangle], way: usize, seconds: f32) -> Vec<Triangle> {
    let mut random = Random(7);
    let turn = Quat::from_rotation_y(seconds);
    let one = |triangle: &Triangle| {
        let own = random.vector() * seconds;
        let corner = |point: Vec3| match way {
            0 => turn * point + Vec3::X * seconds,
            1 => point + own,
            2 => point + Vec3::Y * (3.0 * point.x + seconds).sin(),
            _ => Vec3::splat(seconds),
        };
        Triangle { a: corner(triangle.a), b: corner(triangle.b), c: corner(triangle.c) }
    };
    triangles.iter().map(one).collect()
}

pub fn scenes() -> Vec<(&'static str, Vec<Triangle>)> {
    let mut scenes = vec![
        ("soup", trees::soup(300, 0.2, 3)),
        ("ball", trees::ball(Vec3::ONE, 1.0, 12)),
        ("one", trees::soup(1, 1.0, 4)),
        ("none", Vec::new()),
    ];
    scenes.push(("twice", [trees::soup(40, 0.3, 5), trees::soup(40, 0.3, 5)].concat()));
    scenes
}

/// Settings of trees with one and with several primitives in a leaf.
pub fn settings() -> Vec<BuildSettings> {
    let mut all: Vec<BuildSettings> =
        ContainerKind::ALL.into_iter().map(|container| BuildSettings::preset(Preset::Fast, container)).collect();
    all.extend(
        all.clone()
            .into_iter()
            .map(|settings| BuildSettings { optimize: Passes::NONE.with(Pass::Collapse), ..settings }),
    );
    all.push(BuildSettings { builder: BuilderKind::BinnedSah, ..all[0] });
    all.push(BuildSettings::preset(Preset::Swift, ContainerKind::Aabb));
    all.push(BuildSettings::preset(Preset::Best, ContainerKind::Aabb));
    all
}

fn built(triangles: &[Triangle], settings: &BuildSettings) -> AnyTree {
    build_binary(triangles, settings, &CancelToken::new()).unwrap().0
}

pub fn expected(triangles: &[Triangle], rays: &[Ray]) -> Vec<Option<Hit>> {
    rays.iter().map(|ray| scan(triangles, ray)).collect()
}

pub fn rays(triangles: &[Triangle], count: usize, seed: u64) -> Vec<Ray> {
    if triangles.is_empty() { vec![Ray::new(Vec3::ZERO, Vec3::X)] } else { trees::rays(triangles, count, seed) }
}

type Way = fn(&mut AnyTree, &[Triangle]);

/// The ways of keeping a tree.
const WAYS: [(&str, Way); 4] = [
    ("grow", |tree, triangles| grow(tree, triangles, &CancelToken::new()).unwrap()),
    ("refit", |tree, triangles| refit(tree, triangles, &CancelToken::new()).unwrap()),
    ("rotate", |tree, triangles| {
        refit_and_rotate(tree, triangles, &CancelToken::new()).unwrap();
    }),
    ("reinsert", |tree, triangles| {
        refit_and_reinsert(tree, triangles, 50, &CancelToken::new()).unwrap();
    }),
];

#[test]
fn every_way_hits_what_a_scan_hits() {
    for (name, at_rest) in scenes() {
        for settings in settings() {
            for (way_name, keep) in WAYS {
                let mut tree = built(&at_rest, &settings);
                for (way, seconds) in [(0, 0.4), (1, 0.5), (2, 1.0), (3, 2.0), (1, 0.0)] {
                    let triangles = moved(&at_rest, way, seconds);
                    let rays = rays(&triangles, 30, 11);
                    let name = format!("{name} {settings:?} by {way_name}, moved by {way}");
                    keep(&mut tree, &triangles);
                    check(&name, &triangles, &tree, &rays, &expected(&triangles, &rays));
                }
            }
        }
    }
}

#[test]
fn a_grown_tree_serves_all_moments_that_it_has_seen() {
    for settings in settings() {
        let at_rest = trees::soup(200, 0.2, 8);
        let moments: Vec<_> = [0.0, 0.5, 1.0].map(|seconds| moved(&at_rest, 1, seconds)).into();
        let mut tree = built(&moments[0], &settings);
        for triangles in &moments {
            grow(&mut tree, triangles, &CancelToken::new()).unwrap();
        }
        for triangles in &moments {
            let rays = rays(triangles, 100, 3);
            check("grown", triangles, &tree, &rays, &expected(triangles, &rays));
        }
    }
}

#[test]
fn a_wide_tree_is_fitted_with_its_binary_one() {
    for (name, at_rest) in scenes() {
        for settings in settings() {
            for form in [NodeForm::Full, NodeForm::Compact] {
                let token = CancelToken::new();
                let mut tree = built(&at_rest, &settings);
                let mut wide = AnyWideTree::new(&tree, &at_rest, form, &token).unwrap();
                let lanes = WideRefit::new(&wide, &tree, &token).unwrap();
                let before = wide.clone();
                lanes.apply(&mut wide, &tree, &at_rest, &token).unwrap();
                assert!(wide == before, "{name}, {form:?}: fitted to where the triangles are already");
                for (way, seconds) in [(0, 0.4), (1, 0.5), (3, 2.0), (2, 1.0)] {
                    let triangles = moved(&at_rest, way, seconds);
                    let rays = rays(&triangles, 60, 11);
                    refit(&mut tree, &triangles, &token).unwrap();
                    lanes.apply(&mut wide, &tree, &triangles, &token).unwrap();
                    let name = format!("{name} {settings:?} {form:?}, moved by {way}");
                    check_form(&name, &wide, &rays, &expected(&triangles, &rays));
                }
            }
        }
    }
}

#[test]
fn trees_do_not_depend_on_the_number_of_threads() {
    // Several chunks of nodes, and leaves of several primitives.
    let at_rest = trees::soup(30_000, 0.02, 9);
    let triangles = moved(&at_rest, 1, 0.3);
    for settings in settings() {
        for (name, keep) in WAYS {
            let on = |threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| {
                    let mut tree = built(&at_rest, &settings);
                    keep(&mut tree, &triangles);
                    tree
                })
            };
            let (one, three) = (on(1), on(3));
            assert!(one == three, "{name}, {settings:?}");
            validate(&one, &triangles).unwrap();
        }
    }
}

#[test]
fn a_tree_that_is_fitted_where_it_was_built_stays_as_it_is() {
    let triangles = trees::soup(20_000, 0.02, 2);
    let tree = built(&triangles, &BuildSettings::default());
    let mut fitted = tree.clone();
    refit(&mut fitted, &triangles, &CancelToken::new()).unwrap();
    assert!(fitted == tree);
}

#[test]
fn a_tree_of_any_arity_is_fitted() {
    fn of<C: Container>()
    where
        AnyTree: From<Tree<C>>,
    {
        let triangles = trees::soup(5, 0.3, 6);
        let leaf = |first, count| Node { container: C::EMPTY, first, count };
        let nodes =
            vec![Node::interior(C::EMPTY, 1, 3), leaf(0, 1), Node::interior(C::EMPTY, 4, 1), leaf(2, 3), leaf(1, 1)];
        let mut tree = AnyTree::from(Tree { nodes, primitive_indices: (0..5).collect(), max_depth: 2 });
        refit(&mut tree, &triangles, &CancelToken::new()).unwrap();
        let rays = rays(&triangles, 100, 1);
        check("any arity", &triangles, &tree, &rays, &expected(&triangles, &rays));
    }
    of::<Aabb>();
    of::<Sphere>();
    of::<Dop14>();
}

#[test]
fn rotations_and_reinsertions_repair_what_refitting_leaves() {
    // Halves by place, whose triangles then change places.
    let at_rest = trees::soup(4_000, 0.02, 1);
    let triangles = moved(&at_rest, 1, 0.8);
    let cost = |keep: Way| {
        let mut tree = built(&at_rest, &BuildSettings::default());
        keep(&mut tree, &triangles);
        let first = tree_stats(&tree, &CancelToken::new()).unwrap().sah_cost;
        keep(&mut tree, &triangles);
        [first, tree_stats(&tree, &CancelToken::new()).unwrap().sah_cost]
    };
    let [grown, fitted, rotated, reinserted] = WAYS.map(|(_, keep)| cost(keep));
    assert!(fitted[0] == fitted[1] && grown[0] == grown[1]);
    assert!(rotated[0] < fitted[0] * 0.9 && rotated[1] < rotated[0], "{rotated:?} of {fitted:?}");
    assert!(reinserted[0] < fitted[0] && reinserted[1] < reinserted[0], "{reinserted:?} of {fitted:?}");
    assert!(fitted[0] <= grown[0] * 1.001, "{fitted:?} of {grown:?}");
}
