//! Layouts of wide trees over one binary tree, and what rays cost in each: `layouts`.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::cost_row::OwnFields;
use super::measure::LabError;
use super::population::{ListedRays, Population, ViewRays, listed};
use crate::accel::Accel;
use crate::budget::Budget;
use crate::catalog::fields::layout_columns;
use crate::catalog::layouts::{LayoutChoice, NamedLayout};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::{Aabb, Triangle};
use bvhscope_engine::layouts::{Collapse, KeptNodes, LaidNumbers, LaidQuery, LaidTree, Layout, MeasuredLayout, Planes};
use bvhscope_engine::tree::binarize::binarize;
use bvhscope_engine::tree::traverse::Traversal;
use bvhscope_engine::tree::visits::{RayQuery, measure_weighted_visits};
use bvhscope_engine::tree::{AnyTree, Tree};
use bvhscope_engine::wide::AnyWideTree;
use bvhscope_engine::wide::trace::CacheLines;

/// The layouts to compare: each value of one axis with each of the others.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct LayoutPlan {
    /// Most children of a node.
    pub children: Vec<u32>,
    /// How they are chosen.
    pub collapses: Vec<Collapse>,
    /// How their boxes are stored.
    pub planes: Vec<Planes>,
    /// Most triangles of a leaf.
    pub leaf_sizes: Vec<u32>,
}

impl Default for LayoutPlan {
    fn default() -> Self {
        Self {
            children: vec![2, 4, 8, 16],
            collapses: vec![Collapse::Optimal],
            planes: vec![Planes::F32, Planes::Bits8],
            leaf_sizes: vec![4],
        }
    }
}

impl LayoutPlan {
    /// True if an axis has no value, so that there are no layouts.
    pub fn is_empty(&self) -> bool {
        self.layouts().is_empty()
    }

    /// The layouts, the leaves varying fastest.
    fn layouts(&self) -> Vec<Layout> {
        let mut all = Vec::new();
        for &children in &self.children {
            for &collapse in &self.collapses {
                for &planes in &self.planes {
                    let of_leaves = |&leaf_size: &u32| Layout { children, collapse, planes, leaf_size };
                    all.extend(self.leaf_sizes.iter().map(of_leaves));
                }
            }
        }
        all
    }
}

/// A tree of one layout and the rays of one population. Field names are the JSON names.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LaidOut {
    /// The layout.
    #[serde(flatten)]
    pub layout: NamedLayout,
    /// Numbers of the tree.
    #[serde(flatten)]
    pub numbers: LayoutNumbers,
    /// The rays.
    pub population: Population,
    /// Their cost.
    #[serde(flatten)]
    pub rays: RayNumbers,
    /// True if no other layout reads fewer bytes and takes fewer tests by these rays.
    pub on_front: bool,
}

impl OwnFields for LaidOut {
    fn columns() -> Vec<&'static str> {
        layout_columns()
    }

    fn population(&self) -> Population {
        self.population
    }
}

/// Numbers of a laid tree, see [`LaidNumbers`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LayoutNumbers {
    /// Number of nodes with children.
    pub layout_nodes: usize,
    /// Number of leaves.
    pub layout_leaves: usize,
    /// Children over the number that the nodes have room for.
    pub fullness: f64,
    /// Mean number of triangles of a leaf.
    pub triangles_per_leaf: f64,
    /// Bytes of the nodes.
    pub node_bytes: usize,
    /// Bytes of the triangles of the leaves.
    pub triangle_bytes: usize,
    /// Cost by the surface area heuristic, of the boxes as they are stored.
    pub layout_sah_cost: f64,
    /// Bytes that a random line through the root reads, of the boxes as they are stored.
    pub msah_bytes: f64,
}

impl From<LaidNumbers> for LayoutNumbers {
    fn from(numbers: LaidNumbers) -> Self {
        Self {
            layout_nodes: numbers.nodes,
            layout_leaves: numbers.leaves,
            fullness: numbers.fullness,
            triangles_per_leaf: numbers.leaf_size,
            node_bytes: numbers.node_bytes,
            triangle_bytes: numbers.triangle_bytes,
            layout_sah_cost: numbers.sah_cost,
            msah_bytes: numbers.msah_bytes,
        }
    }
}

/// Counts of the rays of a population, on average of a ray.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RayNumbers {
    /// Number of rays.
    pub rays: u64,
    /// Those that hit something.
    pub hits: u64,
    /// Rays with another hit than in the engine's own tree.
    pub differing_hits: u64,
    /// Nodes with children that a ray visits.
    pub nodes_per_ray: f64,
    /// Leaves that it visits.
    pub leaves_per_ray: f64,
    /// Boxes that it is tested against.
    pub container_tests_per_ray: f64,
    /// Triangles that it is tested against.
    pub primitive_tests_per_ray: f64,
    /// Both.
    pub tests_per_ray: f64,
    /// Bytes of the nodes visited and the triangles tested.
    pub bytes_per_ray: f64,
    /// Distinct lines of 64 bytes that these lie in.
    pub lines_64_per_ray: f64,
    /// Those of 128 bytes.
    pub lines_128_per_ray: f64,
    /// Most nodes that wait on the stack of a ray.
    pub greatest_stack: u64,
}

impl From<MeasuredLayout> for RayNumbers {
    fn from(measured: MeasuredLayout) -> Self {
        let MeasuredLayout { rays, counts, hits, differing_hits } = measured;
        let mean = |count: u64| if rays > 0 { count as f64 / rays as f64 } else { 0.0 };
        let [lines_64_per_ray, lines_128_per_ray] =
            counts.lines.map(|CacheLines { nodes, triangles }| mean(nodes + triangles));
        Self {
            rays,
            hits,
            differing_hits,
            nodes_per_ray: mean(counts.nodes),
            leaves_per_ray: mean(counts.leaves),
            container_tests_per_ray: mean(counts.container_tests),
            primitive_tests_per_ray: mean(counts.triangle_tests),
            tests_per_ray: mean(counts.container_tests + counts.triangle_tests),
            bytes_per_ray: mean(counts.bytes),
            lines_64_per_ray,
            lines_128_per_ray,
            greatest_stack: counts.greatest_stack,
        }
    }
}

/// Trees and rays that the layouts are made from and measured by.
struct Subject<'a> {
    binary: &'a Tree<Aabb>,
    leaf_triangles: Vec<Triangle>,
    wide: &'a AnyWideTree,
    rays: Vec<ListedRays>,
    /// Visits of the nodes of the binary tree by all rays, where a layout is chosen by them.
    visits: Option<Vec<u32>>,
}

/// Lays the tree of `accel`, which consists of boxes, out as the engine does and by each layout of `plan`, and takes all `rays` through each.
/// `row` gets each layout with the rays of each population; which are on the front is not known yet, see [`mark_front`]. Of the rows so far
/// those before a cancellation are kept.
pub fn layouts(
    accel: &Arc<Accel>,
    plan: &LayoutPlan,
    rays: &[ViewRays],
    token: &CancelToken,
    row: &mut dyn FnMut(LaidOut),
) -> Result<(), LabError> {
    let layouts = plan.layouts();
    let [of_setup, of_layouts] = [token.part(0, 2), token.part(1, 2)];
    let binary = binarize(tree_of(accel)?, &of_setup)?;
    check_memory(&binary, plan.children.iter().copied().max().unwrap_or_default())?;
    let wide = accel.widen(&of_setup)?;
    let by_visits = plan.collapses.contains(&Collapse::Visits);
    let subject = Subject::new(accel, &binary, &wide.tree, (rays, by_visits), &of_setup)?;
    if let AnyWideTree::Aabb(own) = &wide.tree {
        let planes = if own.compact_nodes.is_empty() { "f32" } else { "f32+8" };
        let own = LaidTree::of_wide(own, &binary, token)?;
        subject.measure(&own, NamedLayout::engine(planes), token, row)?;
    }
    for (index, &layout) in layouts.iter().enumerate() {
        let token = of_layouts.part(index, layouts.len());
        let laid = LaidTree::new(&binary, layout, subject.visits.as_deref(), &token)?;
        subject.measure(&laid, layout.into(), &token, row)?;
        token.set_progress(1.0);
    }
    Ok(())
}

/// The tree of `accel`, if it has layouts.
fn tree_of(accel: &Accel) -> Result<&Tree<Aabb>, LabError> {
    let AnyTree::Aabb(tree) = &accel.tree else {
        let kind = accel.tree.container_kind().plural();
        return Err(LabError::Refused(format!("layouts are those of trees of boxes, and this is one of {kind}")));
    };
    if accel.scene.copies.is_some() {
        let text = "the tree of a scene of copies has two levels, and layouts have one; load it with --instances flat";
        return Err(LabError::Refused(text.to_owned()));
    }
    Ok(tree)
}

/// Refuses what takes more memory than there is.
fn check_memory(binary: &Tree<Aabb>, most_children: u32) -> Result<(), LabError> {
    Budget::of_process()
        .check("the layouts", LaidTree::peak_bytes(binary.nodes.len(), most_children))
        .map_err(|error| LabError::Refused(error.to_string()))
}

/// The nodes that a layout of the tree of `accel` keeps of it, which is binary and consists of boxes. `rays` are those by whose visits
/// children are chosen, where they are.
pub fn kept_nodes(
    accel: &Arc<Accel>,
    choice: LayoutChoice,
    rays: Option<&ViewRays>,
    token: &CancelToken,
) -> Result<KeptNodes, LabError> {
    let binary = tree_of(accel)?;
    if !binary.is_binary(token)? {
        let text = "layouts are made of binary trees, and nodes of this one have other numbers of children";
        return Err(LabError::Refused(text.to_owned()));
    }
    let laid = match choice {
        LayoutChoice::Engine => match &accel.widen(token)?.tree {
            AnyWideTree::Aabb(own) => LaidTree::of_wide(own, binary, token)?,
            _ => return Err(LabError::Refused("the program's own tree is not one of boxes".to_owned())),
        },
        LayoutChoice::Described(layout) => {
            check_memory(binary, layout.children)?;
            let visits = match rays {
                Some(rays) => {
                    let leaf_triangles = binary.leaf_triangles(&accel.scene.triangles, token)?;
                    Some(summed_visits(binary, &leaf_triangles, &[rays.listed(accel, token)?], token)?)
                }
                None => None,
            };
            LaidTree::new(binary, layout, visits.as_deref(), token)?
        }
    };
    Ok(KeptNodes::new(laid, binary, token)?)
}

/// Visits of the nodes of a tree by all of `rays`.
fn summed_visits(
    binary: &Tree<Aabb>,
    leaf_triangles: &[Triangle],
    rays: &[ListedRays],
    token: &CancelToken,
) -> Result<Vec<u32>, LabError> {
    let mut sums = vec![0_u32; binary.nodes.len()];
    for rays in rays {
        let of_rays = measure_weighted_visits(binary, leaf_triangles, rays.list.len() as u32, rays.ray(), token)?;
        sums.iter_mut().zip(of_rays.counts).for_each(|(sum, count)| *sum = sum.saturating_add(count));
    }
    Ok(sums)
}

impl<'a> Subject<'a> {
    fn new(
        accel: &Arc<Accel>,
        binary: &'a Tree<Aabb>,
        wide: &'a AnyWideTree,
        (rays, by_visits): (&[ViewRays], bool),
        token: &CancelToken,
    ) -> Result<Self, LabError> {
        let leaf_triangles = binary.leaf_triangles(&accel.scene.triangles, token)?;
        let rays = listed(rays, accel, token)?;
        let visits = if by_visits { Some(summed_visits(binary, &leaf_triangles, &rays, token)?) } else { None };
        Ok(Self { binary, leaf_triangles, wide, rays, visits })
    }

    fn measure(
        &self,
        laid: &LaidTree,
        layout: NamedLayout,
        token: &CancelToken,
        row: &mut dyn FnMut(LaidOut),
    ) -> Result<(), LabError> {
        debug_assert_eq!(laid.tree.primitive_indices, self.binary.primitive_indices);
        let numbers = laid.numbers(token)?;
        for rays in &self.rays {
            let weighted = rays.ray();
            let ray = |index: usize| {
                let (ray, query, weight) = weighted(index as u32);
                let query = match query {
                    RayQuery::AnyHit => LaidQuery::Any,
                    RayQuery::ClosestHit(Traversal::Ordered) => LaidQuery::Closest,
                    RayQuery::ClosestHit(Traversal::Paper) => LaidQuery::Through,
                };
                (ray, query, weight)
            };
            let measured = laid.measure(&self.leaf_triangles, self.wide, rays.list.len(), ray, token)?;
            let (numbers, population) = (numbers.into(), rays.population);
            row(LaidOut { layout, numbers, population, rays: measured.into(), on_front: false });
        }
        Ok(())
    }
}

/// Marks the rows of each population that no other one beats: that reads no more bytes and takes no more tests, and less of one.
pub fn mark_front<'a>(rows: impl Iterator<Item = &'a mut LaidOut>) {
    let mut rows: Vec<&mut LaidOut> = rows.collect();
    let costs: Vec<(Population, [f64; 2])> =
        rows.iter().map(|row| (row.population, [row.rays.bytes_per_ray, row.rays.tests_per_ray])).collect();
    for (row, (population, own)) in rows.iter_mut().zip(&costs) {
        let beats = |other: &[f64; 2]| other[0] <= own[0] && other[1] <= own[1] && other != own;
        row.on_front = !costs.iter().any(|(of, other)| of == population && beats(other));
    }
}
