//! Which nodes of a table are drawn: those that depth range and filters choose, or the largest of them if they exceed the budget.

use std::collections::BinaryHeap;
use std::ops::Range;

use rayon::prelude::*;

use super::table::{NodeTable, area};
use crate::catalog::metric_scale::MetricScale;
use crate::catalog::metrics;
use crate::overlay::container_set::ContainerSet;
use crate::overlay::node::OverlayNode;
use crate::overlay::ramp::ColorScale;
use crate::overlay::selection::Selection;
use crate::overlay::settings::{ColorBy, OverlaySettings};
use crate::overlay::viewpoint::{Measure, Viewpoint};
use crate::section::SectionPlane;
use bvhscope_engine::geometry::{Aabb, OrientedBox, OrientedKind};
use bvhscope_engine::tree::{Container, ContainerKind, Tree};
use bvhscope_engine::with_tree;

/// Containers that look smaller than this are drawn as dots where there are many: their lines would cover each other.
const DOT_PX: f32 = 5.0;
/// Number of containers up to which all are drawn with lines.
const FEW_LINES: usize = 2_000;
/// Number of containers drawn with lines at most, the largest on screen: 10,000 boxes take a software renderer about 0.1 s.
const MOST_LINES: usize = 10_000;
/// A best-first walk pays off if the budget is at most one in this many of the chosen nodes.
const FEW: u32 = 8;
/// A container outside of the picture ranks as one this much smaller.
const OUTSIDE: f32 = 1e-6;

/// The nodes of a table that are drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Shown {
    /// Node indices, at most `budget` of them: those drawn with lines, then those drawn as dots.
    pub nodes: Vec<u32>,
    /// Depth of each node; the root's is 0.
    pub depths: Vec<u32>,
    /// Number of nodes that depth range and filters choose, before the budget cuts them.
    pub wanted: usize,
    /// Number of nodes drawn with lines.
    pub outlined: usize,
    /// Another viewpoint may choose other nodes, or draw others as dots.
    pub depends_on_view: bool,
    /// Smallest and largest of `depths`: levels between them are told apart by width and lightness.
    pub levels: [u32; 2],
    /// Place of each node on the colour scale, 0 to 1.
    pub places: Vec<f32>,
    /// Smallest and largest of `places`.
    pub span: [f32; 2],
    /// The meaning of `places`.
    pub colors: ColorScale,
}

impl Shown {
    /// No nodes.
    pub const NOTHING: Self = Self {
        nodes: Vec::new(),
        depths: Vec::new(),
        wanted: 0,
        outlined: 0,
        depends_on_view: false,
        levels: [0; 2],
        places: Vec::new(),
        span: [0.0, 1.0],
        colors: ColorScale::Metric(MetricScale { metric: metrics::DEPTH, ends: [0.0, 1.0] }),
    };

    /// These nodes with the colours of `places`.
    #[must_use]
    pub fn with_colors(self, places: Vec<f32>, colors: ColorScale) -> Self {
        let ends = places.iter().fold([1.0_f32, 0.0], |[low, high], &place| [low.min(place), high.max(place)]);
        Self { span: if places.is_empty() { [0.0, 1.0] } else { ends }, places, colors, ..self }
    }
}

impl NodeTable {
    /// The instance data of the shown nodes, computed in parallel.
    pub fn instances(&self, shown: &Shown, settings: &OverlaySettings) -> Vec<OverlayNode> {
        let nodes = shown.nodes.par_iter().with_min_len(1_024).zip(&shown.depths).zip(&shown.places);
        let instance = |((&node, &depth), &place)| OverlayNode { place, ..self.instance(node, depth, settings) };
        nodes.map(instance).collect()
    }

    /// Place of each of `nodes` on the scale that fits them, and the scale.
    fn colors(&self, color_by: ColorBy, nodes: &[u32], depths: &[u32]) -> (Vec<f32>, ColorScale) {
        let at_depths = || nodes.par_iter().with_min_len(1_024).zip(depths);
        match color_by {
            ColorBy::Metric(metric) => {
                let visits = self.visits();
                let values = self.values(visits.as_ref());
                let value = |(&node, &depth)| values.at_depth(metric, node, depth).unwrap_or(metric.form.neutral());
                let values: Vec<f32> = at_depths().map(value).collect();
                let scale = MetricScale::fitting(metric, &self.stats(), values.iter().copied());
                let places = values.into_par_iter().with_min_len(1_024).map(|value| scale.position(value));
                (places.collect(), ColorScale::Metric(scale))
            }
            ColorBy::Planes => {
                let place = |(&node, _)| match self.node_kind(node) {
                    None | Some(OrientedKind::Plain) => 0.0,
                    Some(OrientedKind::Fitted) => 0.5,
                    Some(OrientedKind::Skewed) => 1.0,
                };
                (at_depths().map(place).collect(), ColorScale::Planes)
            }
            // Until the other tree is known, which the table does not know.
            ColorBy::Survival => (vec![0.0; nodes.len()], ColorScale::Survival),
        }
    }

    /// The budget is so small a part of the nodes in the depth range that a best-first walk from the first depth finds
    /// them faster.
    pub(super) fn is_cut_from_the_top(&self, settings: &OverlaySettings) -> bool {
        let (_, [from, last]) = self.depths(settings);
        let run = self.levels.ranges[last as usize].end - self.levels.ranges[from as usize].start;
        !settings.leaves_only && settings.at_most() < run / FEW
    }

    /// The first depth of the range, and the first and last depth drawn (which includes the parents if these are shown).
    pub(super) fn depths(&self, settings: &OverlaySettings) -> (u32, [u32; 2]) {
        let [first, last] = self.drawn_depths(settings);
        (first, [if settings.parents { 0 } else { first }, last])
    }

    /// The nodes that `settings` choose without the hidden ones and those that the section plane cuts away. If they exceed the budget,
    /// the largest: on screen as seen from `viewpoint`, by surface area without one. The selected and hovered nodes are drawn
    /// separately, see [`highlighted`](crate::overlay::highlighted).
    pub fn shown(&self, settings: &OverlaySettings, selection: &Selection, viewpoint: Option<&Viewpoint>) -> Shown {
        if self.is_empty() {
            return Shown::NOTHING;
        }
        let (first, [from, last]) = self.depths(settings);
        let ranges = &self.levels.ranges;
        // The list is ordered by depth, so a range of depths is one range of slots.
        let run = ranges[from as usize].start..ranges[last as usize].end;
        let budget = settings.at_most() as usize;
        let measure = viewpoint.map(Viewpoint::measure);
        let visibility = self.visibility(selection);
        let section = viewpoint.and_then(|viewpoint| viewpoint.section);
        if visibility.is_none() && section.is_none() && self.is_cut_from_the_top(settings) {
            let [nodes, depths] = self.largest_from_the_top([from, last], measure.as_ref(), budget);
            return self.finish(settings, nodes, depths, run.len(), measure.as_ref());
        }
        let nodes = self.by_depth(run.end);
        let chosen = ranges[first as usize].start;
        let kept = |place: &u32| {
            let node = nodes[*place as usize];
            // "Leaves only" applies to the depth range; parents above it are shown for context.
            let leaf = !settings.leaves_only || *place < chosen || self.is_leaf(node);
            leaf && visibility.as_ref().is_none_or(|visibility| !visibility.hides(node))
                && section.is_none_or(|plane| !self.is_cut_away(node, &plane, settings))
        };
        let mut places: Vec<u32> = if settings.leaves_only || visibility.is_some() || section.is_some() {
            run.into_par_iter().with_min_len(4_096).filter(kept).collect()
        } else {
            run.collect()
        };
        let wanted = places.len();
        // Parents come first.
        let parents =
            if settings.takes_largest_leaves() { places.partition_point(|&place| place < chosen) } else { wanted };
        let leaves = places.split_off(parents);
        let is_reduced = leaves.len() > self.suits();
        if is_reduced {
            places.extend(self.largest(nodes, &leaves, measure.as_ref(), self.suits()));
        } else {
            places.extend(leaves);
        }
        if places.len() > budget {
            places = self.largest(nodes, &places, measure.as_ref(), budget);
        }
        let depths = places.iter().map(|&place| ranges.partition_point(|range| range.end <= place) as u32).collect();
        let nodes = places.into_iter().map(|place| nodes[place as usize]).collect();
        let shown = self.finish(settings, nodes, depths, wanted, measure.as_ref());
        Shown { depends_on_view: shown.depends_on_view || is_reduced && measure.is_some(), ..shown }
    }

    /// The plane cuts away everything that is drawn of a node.
    fn is_cut_away(&self, node: u32, plane: &SectionPlane, settings: &OverlaySettings) -> bool {
        let own = self.container_kind();
        let kinds = settings.kinds(own);
        let drawn = if kinds.is_empty() { ContainerSet::of(own) } else { kinds };
        drawn.iter().all(|kind| match kind {
            ContainerKind::Aabb => plane.cuts_away(&self.node_box(node)),
            ContainerKind::Sphere => plane.cuts_away_sphere(&self.node_sphere(node)),
            // A polytope lies in its box.
            ContainerKind::Dop14 => plane.cuts_away(&self.node_dop(node).bounds),
            ContainerKind::Oriented => plane.cuts_away(&around_corners(&self.node_oriented(node))),
        })
    }

    /// These `nodes` without the hidden ones and those that the section plane cuts away, as the largest of `all`: drawn as `settings`
    /// say, whatever depths these choose.
    pub fn shown_of(
        &self,
        nodes: &[u32],
        all: usize,
        settings: &OverlaySettings,
        selection: &Selection,
        viewpoint: Option<&Viewpoint>,
    ) -> Shown {
        let visibility = self.visibility(selection);
        let exists = |node: &&u32| (**node as usize) < self.len();
        let section = viewpoint.and_then(|viewpoint| viewpoint.section);
        let visible = |node: &&u32| {
            visibility.as_ref().is_none_or(|visibility| !visibility.hides(**node))
                && section.is_none_or(|plane| !self.is_cut_away(**node, &plane, settings))
        };
        let nodes: Vec<u32> = nodes.iter().filter(exists).filter(visible).copied().collect();
        let depths = nodes.par_iter().with_min_len(1_024).map(|&node| self.depth(node)).collect();
        self.finish(settings, nodes, depths, all, viewpoint.map(Viewpoint::measure).as_ref())
    }

    /// Moves the nodes that are drawn as dots to the end, and colours all.
    fn finish(
        &self,
        settings: &OverlaySettings,
        nodes: Vec<u32>,
        depths: Vec<u32>,
        wanted: usize,
        measure: Option<&Measure>,
    ) -> Shown {
        let levels = [depths.iter().min(), depths.iter().max()].map(|depth| depth.copied().unwrap_or(0));
        let mut shown = Shown { outlined: nodes.len(), nodes, depths, wanted, levels, ..Shown::NOTHING };
        if let Some(measure) = measure.filter(|_| wanted > FEW_LINES) {
            self.part_dots(&mut shown, measure);
        }
        let (places, colors) = self.colors(settings.color_by, &shown.nodes, &shown.depths);
        shown.with_colors(places, colors)
    }

    /// Moves the nodes that are drawn as dots to the end.
    fn part_dots(&self, shown: &mut Shown, measure: &Measure) {
        let sizes: Vec<f32> = with_tree!(&self.accel.tree, tree => {
            let size = |&node: &u32| measure.extent(&tree.nodes[node as usize].container.bounds()).diameter_px;
            shown.nodes.par_iter().with_min_len(1_024).map(size).collect()
        });
        let mut smallest = DOT_PX;
        if sizes.len() > MOST_LINES {
            let mut sorted = sizes.clone();
            let (.., next, _) = sorted.select_nth_unstable_by(MOST_LINES, |a, b| b.total_cmp(a));
            // Of those of the same size all are dots.
            smallest = smallest.max(next.next_up());
        }
        let is_large: Vec<bool> = sizes.into_iter().map(|size| size >= smallest).collect();
        let partitioned = |values: &[u32]| -> Vec<u32> {
            let of = |large: bool| {
                values.iter().zip(&is_large).filter(move |(_, is)| **is == large).map(|(&value, _)| value)
            };
            of(true).chain(of(false)).collect()
        };
        (shown.nodes, shown.depths) = (partitioned(&shown.nodes), partitioned(&shown.depths));
        shown.outlined = is_large.iter().filter(|&&large| large).count();
        shown.depends_on_view = true;
    }

    /// The `budget` largest of the `places`: largest first, ties in list order.
    fn largest(&self, nodes: &[u32], places: &[u32], measure: Option<&Measure>, budget: usize) -> Vec<u32> {
        let mut keys: Vec<u64> = with_tree!(&self.accel.tree, tree => {
            let keyed = |&place: &u32| key(rank(tree, nodes[place as usize], measure), place);
            places.par_iter().with_min_len(4_096).map(keyed).collect()
        });
        if budget > 0 && budget < keys.len() {
            keys.select_nth_unstable_by(budget, |a, b| b.cmp(a));
        }
        keys.truncate(budget);
        keys.par_sort_unstable_by(|a, b| b.cmp(a));
        keys.into_iter().map(|key| !(key as u32)).collect()
    }

    /// The same by a best-first walk from the first depth, in which no container counts as larger than its parent, so only that
    /// level and the nodes drawn are visited. Returns node indices and depths; ties are ordered by index.
    fn largest_from_the_top(&self, [from, last]: [u32; 2], measure: Option<&Measure>, budget: usize) -> [Vec<u32>; 2] {
        with_tree!(&self.accel.tree, tree => {
            let Range { start, end } = self.levels.ranges[from as usize].clone();
            let top = &self.by_depth(end)[start as usize..end as usize];
            let keyed = |&node: &u32| (key(rank(tree, node, measure), node), from);
            let mut open: BinaryHeap<_> = top.par_iter().with_min_len(4_096).map(keyed).collect::<Vec<_>>().into();
            let (mut nodes, mut depths) = (Vec::with_capacity(budget), Vec::with_capacity(budget));
            while nodes.len() < budget
                && let Some((found, depth)) = open.pop()
            {
                let node = !(found as u32);
                nodes.push(node);
                depths.push(depth);
                if depth < last {
                    // Rounding may make a sphere slightly larger than its parent's, and a child may be nearer to the eye.
                    let around = f32::from_bits((found >> 32) as u32);
                    let child = |child| (key(rank(tree, child, measure).min(around), child), depth + 1);
                    open.extend(self.below(node).map(child));
                }
            }
            [nodes, depths]
        })
    }
}

/// The box along the axes around an oriented box, which may reach farther than what it encloses.
fn around_corners(container: &OrientedBox) -> Aabb {
    Aabb::around(container.corners().map(glam::DVec3::as_vec3))
}

/// Rank of a node in the budget: its size on screen, or its area where there is no viewpoint.
fn rank<C: Container>(tree: &Tree<C>, node: u32, measure: Option<&Measure>) -> f32 {
    let Some(measure) = measure else { return area(tree, node) };
    let extent = measure.extent(&tree.nodes[node as usize].container.bounds());
    if extent.is_inside { extent.diameter_px } else { extent.diameter_px * OUTSIDE }
}

/// Sort key: by rank, then lower numbers first. The bits of non-negative floats order like the floats.
fn key(rank: f32, number: u32) -> u64 {
    u64::from(rank.max(0.0).to_bits()) << 32 | u64::from(!number)
}
