//! Rays against a test of every triangle in double precision: what trees of all containers and passes find along them, and what another
//! program found.

mod exact;

mod finding;

mod judge;

mod trees;

mod table;

use std::sync::Arc;

use bvhscope_engine::cancel::{CancelToken, TaskProgress};
use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::kernel::parallel::par_tasks;

use super::LabError;
use crate::accel::Accel;
use crate::ray_file::{FileRay, MISS};
use crate::scene::Scene;
use exact::Reference;
use finding::CheckedRay;
use judge::Judge;
use trees::{checked_settings, results};

pub use exact::ExactHit;
pub use finding::{Blamed, Compared, Finding, RayCheck};
pub use judge::Agreement;
pub use table::check_table;

/// Number of rays that are listed as the worst.
pub const WORST: usize = 10;

/// The name of what a file expects, in place of that of a tree.
const EXPECTED: &str = "the file";

/// Checks `rays` of `scene` in `given`, a tree with its name, and in trees of all containers and passes. In the calling thread's rayon
/// pool.
///
/// # Errors
///
/// Where a tree cannot be built, or a ray expects a triangle that the scene lacks.
pub fn check_rays(
    scene: &Arc<Scene>,
    given: Option<(&str, &Arc<Accel>)>,
    rays: &[FileRay],
    token: &CancelToken,
) -> Result<RayCheck, LabError> {
    let triangles = &scene.triangles;
    let is_missing = |&triangle: &u32| triangle != MISS && triangle as usize >= triangles.len();
    if let Some((ray, triangle)) =
        rays.iter().find_map(|ray| Some((ray.index, ray.expected_triangle.filter(is_missing)?)))
    {
        return Err(LabError::Refused(format!(
            "ray {ray} expects triangle {triangle}, and the model has {}; name the model that the rays belong to",
            triangles.len()
        )));
    }
    let progress = TaskProgress::new(rays.len() as u64);
    let scanning = token.part(0, 2);
    let reference = |index: u32, _: &CancelToken| {
        let ray = rays[index as usize];
        let reference = Reference::new(triangles, &ray.ray);
        progress.add(1, &scanning);
        Ok(CheckedRay { ray, reference })
    };
    let checked = par_tasks(0..rays.len() as u32, &scanning, reference)?;
    let mut check = RayCheck {
        rays: rays.len(),
        hits: checked.iter().filter(|ray| ray.reference.exact.is_some()).count(),
        compared: Vec::new(),
        worst: Vec::new(),
    };
    check.add_expected(triangles, &checked);
    let token = token.part(1, 2);
    let built = checked_settings(triangles.len());
    let parts = built.len() + 1;
    if let Some((name, accel)) = given {
        check.add_tree(name, accel, &checked, &token.part(0, parts))?;
    }
    for (index, (name, settings)) in built.into_iter().enumerate() {
        let token = token.part(index + 1, parts);
        let accel = Arc::new(Accel::build_binary(scene, &settings, &token)?);
        check.add_tree(&name, &accel, &checked, &token)?;
    }
    Ok(check)
}

impl RayCheck {
    /// The hits that the program found which wrote the rays.
    fn add_expected(&mut self, triangles: &[Triangle], rays: &[CheckedRay]) {
        let mut compared = Compared::new(EXPECTED);
        for CheckedRay { ray, reference } in rays {
            let t = ray.expected_t;
            let is_miss = ray.expected_triangle.map_or(t.is_some_and(f32::is_infinite), |triangle| triangle == MISS);
            let judge = Judge::new(triangles, &ray.ray, reference.exact);
            let agreement = match (ray.expected_triangle, t) {
                (None, None) => continue,
                _ if ray.any => judge.any(!is_miss),
                _ if is_miss => judge.nearest(None),
                (Some(triangle), t) => judge.nearest(Some((triangle, t.map(f64::from)))),
                (None, Some(t)) => judge.distance(f64::from(t)),
            };
            compared.rays[agreement as usize] += 1;
            if agreement.is_fault() {
                self.add(Finding {
                    ray: *ray,
                    name: EXPECTED.to_owned(),
                    method: ray_kind(ray).to_owned(),
                    agreement,
                    exact: reference.exact,
                    found: (!is_miss).then_some((ray.expected_triangle, t)),
                    blamed: None,
                });
            }
        }
        if compared.rays != [0; Agreement::ALL.len()] {
            self.compared.push(compared);
        }
    }

    /// The hits of a tree.
    fn add_tree(
        &mut self,
        name: &str,
        accel: &Arc<Accel>,
        rays: &[CheckedRay],
        token: &CancelToken,
    ) -> Result<(), LabError> {
        let mut compared = Compared::new(name);
        for found in results(accel, name, rays, token)? {
            compared.rays[found.agreement as usize] += 1;
            compared.unlike_scan += u64::from(found.is_unlike_scan);
            found.finding.into_iter().for_each(|finding| self.add(finding));
        }
        self.compared.push(compared);
        Ok(())
    }

    /// Keeps a finding if it is among the worst.
    fn add(&mut self, finding: Finding) {
        self.worst.push(finding);
        self.worst.sort_by(|a, b| {
            let by_distance = || b.difference().total_cmp(&a.difference());
            b.agreement.cmp(&a.agreement).then_with(by_distance).then(a.ray.index.cmp(&b.ray.index))
        });
        let mut seen = Vec::new();
        self.worst.retain(|finding| {
            let is_new = !seen.contains(&finding.ray.index);
            seen.push(finding.ray.index);
            is_new
        });
        self.worst.truncate(WORST);
    }
}

/// How a ray is traced.
fn ray_kind(ray: &FileRay) -> &'static str {
    if ray.any { "any hit" } else { "nearest hit" }
}
