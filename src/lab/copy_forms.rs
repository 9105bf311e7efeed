//! The forms of a scene of copies: flat, in two levels, and with the tree over the copies opened: what each takes to build, to hold and to
//! trace. `copies --open`.

use std::sync::Arc;
use std::time::{Duration, Instant};

use serde::Serialize;

use super::copy_costs::copies_of;
use super::cost_row::OwnFields;
use super::measure::LabError;
use super::measurement::millis;
use super::population::{ListedRays, Population, ViewRays, listed};
use crate::accel::Accel;
use crate::budget::Budget;
use crate::catalog::fields::form_columns;
use crate::scene::Scene;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::kernel::parallel::{par_collect, par_tasks};
use bvhscope_engine::tree::traverse::Probe;
use bvhscope_engine::tree::visits::RayQuery;
use bvhscope_engine::wide::trace::LineProbe;
use bvhscope_engine::{BuildSettings, InstanceHit, Instances, Ray, Triangle, WideBvh};

/// Rays that one thread traces at a time.
const RAYS_PER_TASK: usize = 1 << 10;

/// A form of a scene and what the rays of one population cost in it. Field names are the JSON names.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CostInForm {
    /// The form.
    #[serde(flatten)]
    pub form: Form,
    /// The rays.
    pub population: Population,
    /// Their cost.
    #[serde(flatten)]
    pub cost: FormCost,
}

impl OwnFields for CostInForm {
    fn columns() -> Vec<&'static str> {
        form_columns()
    }

    fn population(&self) -> Population {
        self.population
    }
}

/// A form of a scene of copies.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Form {
    /// "flat" or "two-level".
    pub form: &'static str,
    /// Parts that there are for each copy at most; `None` of the flat scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub open: Option<f32>,
    /// Parts of copies that the tree above is built of; `None` of the flat scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub parts: Option<usize>,
    /// Wall-clock time until rays can be traced, of one build.
    pub ready_ms: f64,
    /// Bytes of what rays read: wide trees of all levels, and the places of copies.
    pub traced_bytes: usize,
}

impl Form {
    /// The form in a table.
    pub fn name(&self) -> String {
        form_name(self.open)
    }
}

/// A form by the most parts for each copy; `None` for the flat scene.
pub fn form_name(open: Option<f32>) -> String {
    match open {
        None => "flat".to_owned(),
        Some(open) if open <= 1.0 => "two levels".to_owned(),
        Some(open) => format!("two levels, opened to {open}"),
    }
}

/// Cost of rays in a form, on average of a ray.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FormCost {
    /// Number of rays, each as many times as rays it stands for.
    pub rays: u64,
    /// Those that hit something.
    pub hits: u64,
    /// Rays with another hit than in the first form.
    pub differing_hits: u64,
    /// Copies, or parts of them, that a ray is carried into; `None` of the flat scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub entered_per_ray: Option<f64>,
    /// Wide nodes that a ray visits in both levels: up to eight boxes are tested at once in each.
    pub nodes_per_ray: f64,
    /// Blocks of up to four triangles, or of up to four boxes of parts of copies.
    pub blocks_per_ray: f64,
    /// Distinct lines of 64 bytes that nodes and blocks lie in.
    pub lines_64_per_ray: f64,
}

impl FormCost {
    /// Nodes and blocks.
    pub fn visits_per_ray(&self) -> f64 {
        self.nodes_per_ray + self.blocks_per_ray
    }
}

/// The hit that ends a ray: the number of its triangle in the flat scene and its distance; both 0 where any suffices.
pub(super) type Ended = Option<(u32, f32)>;

/// The number of the triangle of a hit.
type Number<'a> = &'a (dyn Fn(&InstanceHit) -> u32 + Sync);

/// A tree that rays are counted in.
pub(super) enum Traced<'a> {
    Flat(&'a WideBvh),
    Levels(&'a Instances, Number<'a>),
}

/// Counts in a wide tree.
struct WideCounts<'a> {
    nodes: u64,
    blocks: u64,
    entered: u64,
    lines: LineProbe<'a>,
}

impl Probe for WideCounts<'_> {
    fn container_test(&mut self) {
        self.nodes += 1;
    }
    fn primitive_test(&mut self) {
        self.blocks += 1;
        self.lines.primitive_test();
    }
    fn carried(&mut self, _: u32) {
        self.entered += 1;
    }
    fn visited(&mut self, node: u32) {
        self.lines.visited(node);
    }
}

/// The scene of the copies in `accel` in its flat form, of triangles alone, with a tree of the same settings.
///
/// # Errors
///
/// Those of [`flat_scene`].
pub fn flat_form(accel: &Accel, token: &CancelToken) -> Result<Accel, LabError> {
    Ok(Accel::build(&flat_scene(&accel.scene, &accel.settings, token)?, &accel.settings, token)?)
}

/// The flat form of a scene of copies, of triangles alone, of which a tree with `settings` can be built.
///
/// # Errors
///
/// [`LabError::Refused`] where memory does not suffice and for a scene that is flat already, and once `token` is cancelled.
pub fn flat_scene(scene: &Scene, settings: &BuildSettings, token: &CancelToken) -> Result<Arc<Scene>, LabError> {
    let copies = copies_of(scene)?;
    let count = copies.triangle_count();
    let bytes = count * size_of::<Triangle>() as u64;
    let checked = Budget::of_process().check("the triangles of all copies", bytes);
    checked.map_err(|error| LabError::Refused(error.to_string()))?;
    let triangles = par_collect(count as usize, token, |number| copies.triangle(number as u32))?;
    let flat = Arc::new(Scene::from_triangles(scene.source.clone(), triangles));
    Accel::check_memory(&flat, settings)?;
    Ok(flat)
}

/// The cost of the rays of each population in the scene of `accel`, which has two levels, in these forms: as that of `flat`, if it is
/// given, and with the tree over the copies built anew and opened by each of `open`.
/// Forms that were measured before a cancellation are kept.
///
/// # Errors
///
/// [`LabError::Refused`] for a flat scene and for settings that a tree over copies cannot have, and once `token` is cancelled.
pub fn copy_forms(
    accel: &Arc<Accel>,
    flat: Option<&Accel>,
    open: &[f32],
    rays: &[ViewRays],
    token: &CancelToken,
    row: &mut dyn FnMut(CostInForm),
) -> Result<(), LabError> {
    copies_of(&accel.scene)?;
    let Some(levels) = accel.levels() else { unreachable!("it has copies") };
    let [of_list, of_forms] = [token.part(0, 2), token.part(1, 2)];
    let lists = listed(rays, accel, &of_list)?;
    let mut first: Vec<Vec<Ended>> = Vec::new();
    let forms = usize::from(flat.is_some()) + open.len();
    let mut measure = |at: usize, form: Form, traced: &Traced<'_>| -> Result<(), LabError> {
        for (index, rays) in lists.iter().enumerate() {
            let token = of_forms.part(at * lists.len() + index, forms * lists.len());
            let (mut cost, ended) = traced.costs(rays, &token)?;
            match first.get(index) {
                Some(first) => cost.differing_hits = differing(rays, first, &ended, |first, ended| first == ended),
                None => first.push(ended),
            }
            row(CostInForm { form, population: rays.population, cost });
        }
        Ok(())
    };
    if let Some(flat) = flat {
        let wide = flat.widen(token)?;
        let form = Form {
            form: "flat",
            open: None,
            parts: None,
            ready_ms: millis(flat.report.build_time + wide.collapse_time),
            traced_bytes: flat.traced_bytes(),
        };
        measure(0, form, &Traced::Flat(wide))?;
    }
    let meshes: Duration = accel.stages().iter().filter(|(stage, _)| *stage == "meshes").map(|(_, time)| *time).sum();
    for (at, &open) in open.iter().enumerate() {
        let start = Instant::now();
        let instances = Instances::of(Arc::clone(levels.wide().copies()), &accel.settings, open, token)?;
        let form = Form {
            form: "two-level",
            open: Some(open),
            parts: Some(instances.top().triangle_count()),
            ready_ms: millis(meshes + start.elapsed()),
            traced_bytes: instances.bytes(),
        };
        measure(usize::from(flat.is_some()) + at, form, &Traced::Levels(&instances, &|hit| levels.number(hit)))?;
    }
    Ok(())
}

/// Number of rays that end elsewhere than in the first form, where `is_same` says so.
pub(super) fn differing(
    rays: &ListedRays,
    first: &[Ended],
    ended: &[Ended],
    is_same: impl Fn(&Ended, &Ended) -> bool,
) -> u64 {
    let weighted = rays.ray();
    let differs = (0..first.len()).filter(|&index| !is_same(&first[index], &ended[index]));
    differs.map(|index| u64::from(weighted(index as u32).2)).sum()
}

impl<'a> Traced<'a> {
    /// The cost of `rays`, and where each of them ends.
    pub(super) fn costs(&self, rays: &ListedRays, token: &CancelToken) -> Result<(FormCost, Vec<Ended>), LabError> {
        let weighted = rays.ray();
        let starts = (0..rays.list.len()).step_by(RAYS_PER_TASK);
        let parts = par_tasks(starts, token, |start, _| {
            let mut probes = self.probes();
            let (mut sums, mut ended) = ([0; 6], Vec::with_capacity(RAYS_PER_TASK));
            for index in start..rays.list.len().min(start + RAYS_PER_TASK) {
                let (ray, query, weight) = weighted(index as u32);
                let end = if weight > 0 { self.trace(&ray, query, &mut probes) } else { None };
                let mut of_ray = [1, u64::from(end.is_some()), 0, 0, 0, 0];
                for probe in &mut probes {
                    let lines = probe.lines.take();
                    let of_tree = [probe.entered, probe.nodes, probe.blocks, lines.nodes + lines.triangles];
                    of_ray[2..].iter_mut().zip(of_tree).for_each(|(sum, of_tree)| *sum += of_tree);
                    (probe.entered, probe.nodes, probe.blocks) = (0, 0, 0);
                }
                sums.iter_mut().zip(of_ray).for_each(|(sum, of_ray)| *sum += of_ray * u64::from(weight));
                ended.push(end);
            }
            Ok((sums, ended))
        })?;
        let mut sums = [0; 6];
        let mut ended = Vec::with_capacity(rays.list.len());
        for (of_part, of_rays) in parts {
            sums.iter_mut().zip(of_part).for_each(|(sum, of_part)| *sum += of_part);
            ended.extend(of_rays);
        }
        let [rays, hits, entered, nodes, blocks, lines] = sums;
        let per_ray = |count: u64| if rays > 0 { count as f64 / rays as f64 } else { 0.0 };
        let cost = FormCost {
            rays,
            hits,
            differing_hits: 0,
            entered_per_ray: matches!(self, Self::Levels(..)).then(|| per_ray(entered)),
            nodes_per_ray: per_ray(nodes),
            blocks_per_ray: per_ray(blocks),
            lines_64_per_ray: per_ray(lines),
        };
        Ok((cost, ended))
    }

    /// A probe for each tree, the last one for that above.
    fn probes(&self) -> Vec<WideCounts<'a>> {
        let of_tree =
            |wide: &'a WideBvh| WideCounts { nodes: 0, blocks: 0, entered: 0, lines: LineProbe::new(&wide.tree) };
        match self {
            Self::Flat(wide) => vec![of_tree(wide)],
            Self::Levels(instances, _) => {
                let meshes = instances.copies().meshes().iter().map(|mesh| mesh.wide());
                meshes.chain([instances.top()]).map(of_tree).collect()
            }
        }
    }

    fn trace(&self, ray: &Ray, query: RayQuery, probes: &mut [WideCounts<'_>]) -> Ended {
        let (above, meshes) = probes.split_last_mut()?;
        let level = SimdLevel::of_builds().level();
        match (self, query) {
            (Self::Flat(wide), RayQuery::ClosestHit(_)) => {
                wide.tree.closest_hit_with(level, ray, above).map(|hit| (hit.primitive_index, hit.t))
            }
            (Self::Flat(wide), RayQuery::AnyHit) => wide.tree.any_hit_with(level, ray, above).then_some((0, 0.0)),
            (Self::Levels(instances, number), RayQuery::ClosestHit(_)) => {
                let hit = instances.closest_hit_with(ray, above, meshes)?;
                Some((number(&hit), hit.t))
            }
            (Self::Levels(instances, _), RayQuery::AnyHit) => {
                instances.any_hit_with(ray, above, meshes).then_some((0, 0.0))
            }
        }
    }
}
