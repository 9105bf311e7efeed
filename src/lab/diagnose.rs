//! Diagnosis of scenes and trees: findings about what slows tracing down, such as duplicates, slivers or deep trees.

use std::cmp::Reverse;
use std::collections::HashSet;
use std::hash::{Hash, Hasher};
use std::sync::Arc;

use glam::Vec3;
use serde::Serialize;

use crate::accel::Accel;
use crate::budget::Budget;
use crate::scene::{Extent, Scene};
use crate::vectors::length;
use crate::visibility::TriangleSet;
use bvhscope_engine::cancel::{CancelToken, Cancelled, MEDIUM_STEPS};
use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::overlap::EndPointOverlap;
use bvhscope_engine::with_tree;

/// Ratio of the longest edge to the height on it above which a triangle counts as a sliver.
const SLIVER_ASPECT: f64 = 100.0;

/// A problem that makes tracing slow or a picture wrong.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// Kind of problem: "deep-tree", "duplicates", "not-examined", "degenerate", "slivers", "huge-triangles", "coarse", "large-leaf",
    /// "overlap".
    pub kind: &'static str,
    /// Number of triangles, nodes or levels concerned.
    pub count: usize,
    /// The problem, its cost and a remedy, in a sentence for the user.
    pub text: String,
    /// Where it can be seen.
    #[serde(skip)]
    pub place: Place,
}

/// Where a finding can be seen.
#[derive(Debug, Clone, PartialEq)]
pub enum Place {
    /// Everywhere, or nowhere.
    Scene,
    /// At these triangles.
    Triangles(Arc<TriangleSet>),
    /// At this node of the tree.
    Node(u32),
}

/// Diagnoses the triangles of a scene. Checks that do not fit into the memory budget are skipped, which is a finding too.
pub fn diagnose_scene(scene: &Scene, token: &CancelToken) -> Result<Vec<Finding>, Cancelled> {
    diagnose_within(Budget::of_process(), scene, token)
}

fn diagnose_within(budget: Budget, scene: &Scene, token: &CancelToken) -> Result<Vec<Finding>, Cancelled> {
    if scene.copies.is_some() {
        // The tree consists of copies, and all of the following is about triangles.
        return Ok(Vec::new());
    }
    let triangles = &scene.triangles;
    let total = triangles.len();
    let mut findings = Vec::new();
    let grouped = |count: usize| crate::text::count(count as u64);
    // The text begins with "1 of 12 triangles is", by the verb for one and for several, and goes on with `rest`.
    let mut add = |kind, set: TriangleSet, verbs: [&str; 2], rest: &str| {
        let count = set.len();
        if count > 0 {
            let verb = verbs[usize::from(count > 1)];
            findings.push(Finding {
                kind,
                count,
                text: format!("{} of {} triangles {verb} {rest}", grouped(count), grouped(total)),
                place: Place::Triangles(Arc::new(set)),
            });
        }
    };
    let mut not_examined = None;
    match budget.check("the search for equal triangles", BYTES_PER_TRIANGLE * total as u64) {
        Ok(()) => {
            let rest = "exactly on another one: each is tested for nothing";
            add("duplicates", duplicates(triangles, token)?, ["lies", "lie"], rest);
        }
        Err(error) => not_examined = Some(format!("not everything was examined: {error}")),
    }
    let degenerate = those(triangles, token, |triangle| triangle.area() == 0.0)?;
    add("degenerate", degenerate, ["has", "have"], "no area: no ray ever hits them");
    let slivers = those(triangles, token, is_sliver)?;
    // Every model has a few slivers; from a twentieth of the triangles on they affect the tree.
    if slivers.len() * 20 >= total {
        let rest = format!(
            "more than {SLIVER_ASPECT} times as long as high: their containers are mostly empty and overlap; remeshing or splitting \
             them helps"
        );
        add("slivers", slivers, ["is", "are"], &rest);
    }
    let half_diagonal = length(scene.bounds.extent()) * 0.5;
    if total > 1000 {
        let huge = those(triangles, token, |triangle| length(triangle.bounds().extent()) > half_diagonal)?;
        let rest = "more than half as large as the whole scene: every container above them is as large, and most rays test them";
        add("huge-triangles", huge, ["is", "are"], rest);
    }
    let corners = [scene.bounds.min, scene.bounds.max].map(glam::Vec3::as_dvec3);
    if Extent::around(corners).offset() != glam::DVec3::ZERO {
        let text = "the coordinates are so far from the origin that single precision rounds them by more than a millionth of the \
                    model's size: export the model nearer to the origin, or with double precision";
        findings.push(Finding { kind: "coarse", count: total, text: text.to_owned(), place: Place::Scene });
    }
    if let Some(text) = not_examined.filter(|_| total > 0) {
        findings.insert(0, Finding { kind: "not-examined", count: total, text, place: Place::Scene });
    }
    Ok(findings)
}

/// Diagnoses a tree: its depth, its leaves and its end-point overlap `epo` (Aila et al. 2013), if it has one.
pub fn diagnose_tree(accel: &Accel, epo: Option<EndPointOverlap>) -> Vec<Finding> {
    let stats = &accel.report.stats;
    let mut findings = Vec::new();
    let balanced = (stats.leaves.max(1) as f32).log2().ceil() as u32;
    if stats.max_depth > 2 * balanced + 16 {
        findings.push(Finding {
            kind: "deep-tree",
            count: stats.max_depth as usize,
            text: format!(
                "the tree is {} levels deep where {balanced} would hold its leaves: some branches are nearly lists",
                stats.max_depth
            ),
            place: deepest_leaf(accel).map_or(Place::Scene, Place::Node),
        });
    }
    if stats.max_leaf_size > 64 && stats.leaves > 1 {
        findings.push(Finding {
            kind: "large-leaf",
            count: stats.max_leaf_size as usize,
            text: format!("a leaf holds {} triangles: each ray that reaches it tests them all", stats.max_leaf_size),
            place: largest_leaf(accel).map_or(Place::Scene, Place::Node),
        });
    }
    // EPO has the unit of the SAH cost; near that cost, rays do as much useless as useful work.
    if let Some(epo) = epo.filter(|epo| epo.value > 0.75 * stats.sah_cost) {
        let note = epo.estimate_note().map_or_else(String::new, |note| format!(" ({note})"));
        findings.push(Finding {
            kind: "overlap",
            count: 1,
            text: format!(
                "end-point overlap is {:.2}{note}: much of the surface lies inside containers that do not hold it{}",
                epo.value,
                overlap_remedy(accel)
            ),
            place: Place::Scene,
        });
    }
    findings
}

/// The end of the sentence on overlap: the settings that lower it, and none for a tree from a file, which another builder may have made.
fn overlap_remedy(accel: &Accel) -> &'static str {
    let has_threshold = accel.file.is_none() && accel.settings.builder.is_aac();
    let is_of_spheres = accel.file.is_none() && accel.tree.container_kind() == ContainerKind::Sphere;
    match (has_threshold, is_of_spheres) {
        (true, true) => "; a higher threshold or box containers help",
        (true, false) => "; a higher threshold helps",
        (false, true) => "; box containers help",
        (false, false) => "",
    }
}

/// The first leaf at the greatest depth; `None` for an empty tree.
fn deepest_leaf(accel: &Accel) -> Option<u32> {
    let (mut deepest, mut open) = (None, vec![(0_u32, 0_u32)]);
    with_tree!(&accel.tree, tree => {
        while let Some((index, depth)) = open.pop() {
            let Some(node) = tree.nodes.get(index as usize) else { continue };
            open.extend(node.children().rev().map(|child| (child, depth + 1)));
            if node.is_leaf() && depth == tree.max_depth {
                deepest = Some(index);
                break;
            }
        }
    });
    deepest
}

/// The leaf with the most triangles; `None` for an empty tree.
fn largest_leaf(accel: &Accel) -> Option<u32> {
    with_tree!(&accel.tree, tree => {
        let largest = tree.nodes.iter().enumerate().max_by_key(|(index, node)| (node.slots().len(), Reverse(*index)));
        largest.map(|(index, _)| index as u32)
    })
}

/// The triangles for which `predicate` holds.
fn those(
    triangles: &[Triangle],
    token: &CancelToken,
    mut predicate: impl FnMut(&Triangle) -> bool,
) -> Result<TriangleSet, Cancelled> {
    let mut set = TriangleSet::none(triangles.len());
    for (index, triangle) in triangles.iter().enumerate() {
        token.check_every(MEDIUM_STEPS, index)?;
        if predicate(triangle) {
            set.insert(index as u32);
        }
    }
    Ok(set)
}

/// A triangle that compares equal to those with the same three corners in any order.
struct Corners<'a>(&'a Triangle);

/// Bytes per triangle of a hash set of [`Corners`]: a reference and a control byte per slot, at most 16/7 slots per triangle.
const BYTES_PER_TRIANGLE: u64 = 21;

impl Corners<'_> {
    fn sorted(&self) -> [[u32; 3]; 3] {
        // Adding zero maps −0 to 0.
        let bits = |corner: Vec3| corner.to_array().map(|x| (x + 0.0).to_bits());
        let mut corners = [bits(self.0.a), bits(self.0.b), bits(self.0.c)];
        corners.sort_unstable();
        corners
    }
}

impl PartialEq for Corners<'_> {
    fn eq(&self, other: &Self) -> bool {
        self.sorted() == other.sorted()
    }
}

impl Eq for Corners<'_> {}

impl Hash for Corners<'_> {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.sorted().hash(state);
    }
}

/// The triangles that equal an earlier one.
fn duplicates(triangles: &[Triangle], token: &CancelToken) -> Result<TriangleSet, Cancelled> {
    let mut seen = HashSet::with_capacity(triangles.len());
    let mut set = TriangleSet::none(triangles.len());
    for (index, triangle) in triangles.iter().enumerate() {
        token.check_every(MEDIUM_STEPS, index)?;
        if !seen.insert(Corners(triangle)) {
            set.insert(index as u32);
        }
    }
    Ok(set)
}

/// The longest edge is much longer than the height on it; degenerate triangles do not count.
fn is_sliver(triangle: &Triangle) -> bool {
    let edges = [triangle.b - triangle.a, triangle.c - triangle.b, triangle.a - triangle.c];
    let longest_squared = edges.iter().map(|edge| edge.as_dvec3().length_squared()).fold(0.0, f64::max);
    let doubled_area = 2.0 * triangle.area();
    // Height on the longest edge = doubled area over that edge.
    doubled_area > 0.0 && longest_squared > SLIVER_ASPECT * doubled_area
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::accel::FileTree;
    use crate::budget::MemoryLimit;
    use crate::scene::SceneSource;
    use bvhscope_engine::settings::{BuildSettings, BuilderKind};
    use bvhscope_engine::tree_file::Header;

    #[test]
    fn overlap_is_lowered_by_settings_that_the_tree_was_built_with() {
        let (scene, token) = (crate::lab::sample::teapot(), CancelToken::new());
        let epo = EndPointOverlap { value: 1e6, sampled: 1, triangles: 1, margin: None, visited: 1 };
        let text = |accel: &Accel| diagnose_tree(accel, Some(epo)).pop().unwrap().text;
        let built = |builder, container| {
            let build = BuildSettings { builder, container, ..BuildSettings::default() };
            Accel::build(&scene, &build, &token).unwrap()
        };
        for (builder, container, end) in [
            (BuilderKind::Aac, ContainerKind::Sphere, "hold it; a higher threshold or box containers help"),
            (BuilderKind::Aac, ContainerKind::Aabb, "hold it; a higher threshold helps"),
            (BuilderKind::Lbvh, ContainerKind::Sphere, "hold it; box containers help"),
            (BuilderKind::Lbvh, ContainerKind::Aabb, "do not hold it"),
        ] {
            let text = text(&built(builder, container));
            assert!(text.ends_with(end), "{text}");
        }
        let mut read = built(BuilderKind::Aac, ContainerKind::Sphere);
        let (path, header) = ("mine.bvh".into(), Header::new(1));
        read.file =
            Some(FileTree { path, label: None, header, faults: Vec::new(), empty_nodes: 0, numbers: None, ids: None });
        assert!(text(&read).ends_with("do not hold it"), "another builder has other settings");
    }

    #[test]
    fn duplicates_are_found_in_any_corner_order() {
        let a = Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::Y };
        let b = Triangle { a: Vec3::Y, b: Vec3::new(-0.0, 0.0, 0.0), c: Vec3::X };
        let c = Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::Z };
        let found = |triangles: &[Triangle]| {
            let set = duplicates(triangles, &CancelToken::new()).unwrap();
            (0..triangles.len() as u32).filter(|&triangle| set.contains(triangle)).collect::<Vec<_>>()
        };
        assert_eq!(found(&[a, b, c, a]), [1, 3]);
        assert_eq!(found(&[a, c]), [0_u32; 0]);
    }

    #[test]
    fn checks_over_budget_are_skipped_with_a_finding() {
        let flat = Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::X };
        let scene = Scene::from_triangles(SceneSource::default_builtin(), vec![flat; 3]);
        let kinds = |bytes| {
            let budget = Budget::limited(MemoryLimit::Bytes(bytes));
            let findings = diagnose_within(budget, &scene, &CancelToken::new()).unwrap();
            findings.into_iter().map(|finding| (finding.kind, finding.count, finding.text)).collect::<Vec<_>>()
        };
        let [(kind, 3, text), ("degenerate", 3, _)] = &kinds(1)[..] else { panic!("{:?}", kinds(1)) };
        assert!(*kind == "not-examined" && text.contains("--memory-limit"), "{text}");
        assert!(matches!(&kinds(1 << 40)[..], [("duplicates", 2, _), ("degenerate", 3, _)]));
    }

    #[test]
    fn slivers_are_long_and_low() {
        let thin = Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::new(0.5, 0.001, 0.0) };
        let good = Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::Y };
        for size in [1e-30, 1e-10, 1.0, 1e10, 1e17] {
            let [thin, good, flat] = [thin, good, Triangle { c: Vec3::X * 0.5, ..good }].map(|t| Triangle {
                a: t.a * size,
                b: t.b * size,
                c: t.c * size,
            });
            assert!(is_sliver(&thin), "{size}");
            assert!(!is_sliver(&good), "{size}");
            let scene = Scene::from_triangles(SceneSource::default_builtin(), vec![good, flat]);
            let findings = diagnose_scene(&scene, &CancelToken::new()).unwrap();
            let [Finding { kind: "degenerate", text, .. }] = &findings[..] else { panic!("{size}: {findings:?}") };
            assert!(text.starts_with("1 of 2 triangles has no area"), "{text}");
        }
    }
}
