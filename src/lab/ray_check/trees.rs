//! The trees that rays are checked in, and all ways to trace them.

use std::sync::Arc;

use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::{Hit, PreparedRay, Ray};
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::kernel::parallel::par_tasks;
use bvhscope_engine::settings::{BuildSettings, Pass, Passes};
use bvhscope_engine::tree::traverse::{NoProbe, Traversal};
use bvhscope_engine::tree::{Container, ContainerKind, Tree};
use bvhscope_engine::with_tree;

use super::finding::{Blamed, CheckedRay, Finding};
use super::judge::{Agreement, Judge};
use crate::accel::Accel;

/// Rounds of the pass that takes minutes otherwise: its moves are the same.
const ROUNDS: u32 = 6;

/// Rays that are traced together.
const RAYS_PER_TASK: usize = 256;

/// Settings of trees of all containers and passes over so many triangles, with their names.
pub(super) fn checked_settings(triangles: usize) -> Vec<(String, BuildSettings)> {
    let base = BuildSettings { rounds: ROUNDS, ..BuildSettings::default() };
    let mut list = Vec::new();
    for container in ContainerKind::WITH_ORIENTED {
        let plain = base.for_container(container);
        list.push((container.name().to_owned(), plain));
        let with = |passes: Passes| passes.iter().fold(plain.optimize, Passes::with);
        let one = Pass::ALL.into_iter().map(|pass| (pass.name(), with(Passes::NONE.with(pass))));
        for (name, optimize) in one.chain([("all passes", with(Passes::ALL))]) {
            let settings = BuildSettings { optimize, ..plain };
            let is_other = list.iter().all(|(_, known)| {
                known.passes() != settings.passes() || known.tree_container() != settings.tree_container()
            });
            if is_other && settings.tree_container() == container && settings.refusal(triangles).is_none() {
                list.push((format!("{}, {name}", container.name()), settings));
            }
        }
    }
    list
}

/// A way to trace a tree.
#[derive(Clone, Copy)]
enum Method {
    Binary(Traversal),
    Wide(SimdLevel),
    /// All rays at once.
    Together(SimdLevel),
}

impl Method {
    fn all() -> Vec<Self> {
        let levels = || SimdLevel::ALL.into_iter().filter(|level| level.is_available());
        let binary = Traversal::ALL.map(Self::Binary).into_iter();
        binary.chain(levels().map(Self::Wide)).chain(levels().map(Self::Together)).collect()
    }

    fn name(self) -> String {
        match self {
            Self::Binary(traversal) => format!("{} binary", traversal.name()),
            Self::Wide(level) => format!("wide, {}", level.name()),
            Self::Together(level) => format!("wide together, {}", level.name()),
        }
    }

    /// The nearest hits of `rays`.
    fn nearest(self, accel: &Accel, rays: &[Ray]) -> Vec<Option<Hit>> {
        let wide = &accel.wide().tree;
        match self {
            Self::Binary(traversal) => {
                rays.iter().map(|ray| accel.closest_hit_with(ray, traversal, &mut NoProbe)).collect()
            }
            Self::Wide(level) => rays.iter().map(|ray| wide.closest_hit(level.level(), ray)).collect(),
            Self::Together(level) => {
                let mut hits = vec![None; rays.len()];
                wide.closest_hits(level.level(), rays, &mut hits);
                hits
            }
        }
    }

    /// Whether anything lies on each of `rays`.
    fn any(self, accel: &Accel, rays: &[Ray]) -> Vec<bool> {
        let wide = &accel.wide().tree;
        match self {
            Self::Binary(_) => rays.iter().map(|ray| accel.any_hit_with(ray, &mut NoProbe)).collect(),
            Self::Wide(level) => rays.iter().map(|ray| wide.any_hit(level.level(), ray)).collect(),
            Self::Together(level) => {
                let mut blocked = vec![false; rays.len()];
                wide.any_hits(level.level(), rays, &mut blocked);
                blocked
            }
        }
    }
}

/// The worst result of a ray in a tree.
pub(super) struct TreeResult {
    pub(super) agreement: Agreement,
    pub(super) is_unlike_scan: bool,
    /// Where it is wrong.
    pub(super) finding: Option<Finding>,
}

/// The results of `rays` in a tree, all ways to trace it.
pub(super) fn results(
    accel: &Arc<Accel>,
    name: &str,
    rays: &[CheckedRay],
    token: &CancelToken,
) -> Result<Vec<TreeResult>, Cancelled> {
    accel.widen(token)?;
    accel.compute_leaf_triangles(token)?;
    let chunks: Vec<&[CheckedRay]> = rays.chunks(RAYS_PER_TASK).collect();
    let task = |task: u32, _: &CancelToken| Ok(results_of(accel, name, chunks[task as usize]));
    let results = par_tasks(0..chunks.len() as u32, token, task)?;
    Ok(results.into_iter().flatten().collect())
}

fn results_of(accel: &Accel, name: &str, rays: &[CheckedRay]) -> Vec<TreeResult> {
    let plain: Vec<Ray> = rays.iter().map(|checked| checked.ray.ray).collect();
    let start = || TreeResult { agreement: Agreement::Same, is_unlike_scan: false, finding: None };
    let mut worst: Vec<TreeResult> = rays.iter().map(|_| start()).collect();
    for method in Method::all() {
        let (hits, blocked) = (method.nearest(accel, &plain), method.any(accel, &plain));
        for ((checked, worst), (hit, is_blocked)) in rays.iter().zip(&mut worst).zip(hits.into_iter().zip(blocked)) {
            let (exact, own) = (checked.reference.exact, checked.reference.own);
            let judge = Judge::new(&accel.scene.triangles, &checked.ray.ray, exact);
            // A shadow ray has no nearest hit, but every ray may be asked for any.
            let any = (judge.any(is_blocked), is_blocked != own.is_some(), is_blocked.then_some((None, None)));
            let nearest = || {
                let found = hit.map(|hit| (hit.primitive_index, Some(f64::from(hit.t))));
                let shown = hit.map(|hit| (Some(hit.primitive_index), Some(hit.t)));
                (judge.nearest(found), hit != own, shown)
            };
            let kinds = if checked.ray.any { [Some(any), None] } else { [Some(nearest()), Some(any)] };
            for (agreement, is_unlike_scan, found) in kinds.into_iter().flatten() {
                worst.is_unlike_scan |= is_unlike_scan;
                if agreement <= worst.agreement {
                    continue;
                }
                worst.agreement = agreement;
                if agreement.is_fault() {
                    let lost = own.filter(|_| is_unlike_scan);
                    let (ray, name, method) = (checked.ray, name.to_owned(), method.name());
                    let blamed = lost.and_then(|hit| blamed(accel, &ray.ray, &hit));
                    worst.finding = Some(Finding { ray, name, method, agreement, exact, found, blamed });
                }
            }
        }
    }
    worst
}

/// The first node on the way to the triangle of `hit` that its ray does not enter.
fn blamed(accel: &Accel, ray: &Ray, hit: &Hit) -> Option<Blamed> {
    let path = accel.path_to(hit.primitive_index);
    with_tree!(&accel.tree, tree => not_entered(tree, &path, ray, hit.t))
}

fn not_entered<C: Container>(tree: &Tree<C>, path: &[u32], ray: &Ray, t_max: f32) -> Option<Blamed> {
    let ray = PreparedRay::new(*ray);
    let part = C::ray_part(&ray);
    let is_passed = |node: u32| tree.nodes[node as usize].container.entry(&ray, &part, ray.ray.t_min, t_max).is_none();
    let depth = path.iter().position(|&node| is_passed(node))?;
    Some(Blamed { node: path[depth], depth: depth as u32 })
}
