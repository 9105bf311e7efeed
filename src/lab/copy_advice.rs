//! The cost of rays with other meshes: one in parts, or two as one. `copies --advice`.

use std::cmp::Reverse;
use std::sync::Arc;

use serde::Serialize;

use super::copy_costs::copies_of;
use super::copy_forms::{Ended, FormCost, Traced, differing};
use super::cost_row::OwnFields;
use super::measure::LabError;
use super::mesh_changes::MeshChanges;
use super::mesh_pairs::{MeshPair, mesh_pairs};
use super::population::{ListedRays, Population, ViewRays, listed};
use crate::accel::Accel;
use crate::catalog::fields::advice_columns;
use crate::scene::SceneCopies;
use bvhscope_engine::Instances;
use bvhscope_engine::cancel::CancelToken;

/// Meshes whose parts are measured, and among which pairs are looked for: those with most tests.
const MOST_MESHES: usize = 8;
/// Pairs of meshes that are measured.
const MOST_PAIRS: usize = 8;
/// Numbers of parts.
const PARTS: [usize; 3] = [2, 4, 8];
/// Part of a distance by which it may differ where two meshes are one, whose corners are rounded elsewhere.
const SAME_DISTANCE: f32 = 1e-4;

/// A scene with other meshes and what the rays of one population cost in it. Field names are the JSON names.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CostOfChange {
    /// The rays.
    pub population: Population,
    /// The change.
    #[serde(flatten)]
    pub change: MeshChange,
    /// Bytes of what rays read: wide trees of all levels, and the places of copies.
    pub traced_bytes: usize,
    /// Their cost.
    #[serde(flatten)]
    pub cost: FormCost,
    /// Differences that the change makes.
    #[serde(flatten)]
    pub differences: Differences,
    /// Number of changes that were measured.
    #[serde(flatten)]
    pub extent: Extent,
}

impl OwnFields for CostOfChange {
    fn columns() -> Vec<&'static str> {
        advice_columns()
    }

    fn population(&self) -> Population {
        self.population
    }
}

/// Another division of a scene's triangles among meshes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(tag = "change", rename_all = "kebab-case")]
pub enum MeshChange {
    /// The scene as it is.
    None,
    /// A mesh in parts.
    Split {
        /// Index of the mesh.
        mesh: u32,
        /// Number of parts.
        parts: usize,
    },
    /// Two meshes as one.
    Merge {
        /// Index of the first mesh.
        mesh: u32,
        /// Index of the second one.
        with_mesh: u32,
    },
}

/// Differences from the scene as it is, as a part of what that has; `None` where that has nothing.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Differences {
    /// Of nodes that rays visit.
    pub nodes_change: Option<f64>,
    /// Of blocks that they visit.
    pub blocks_change: Option<f64>,
    /// Of both.
    pub visits_change: Option<f64>,
    /// Of bytes of what rays read.
    pub bytes_change: Option<f64>,
}

/// The number of possible changes, and of those that are measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Extent {
    /// Meshes that rays are carried into.
    pub entered_meshes: usize,
    /// Those whose parts are measured, and among which pairs are looked for.
    pub measured_meshes: usize,
    /// Pairs of these whose copies stand together.
    pub pairs: usize,
    /// Pairs that are measured.
    pub measured_pairs: usize,
}

/// The cost of the rays of each population in the scene of `accel`, which has two levels, as it is, with each of the meshes with most tests in
/// parts, and with each two of these as one whose copies stand together. Trees above are built anew with the settings of `accel`.
/// Changes that were measured before a cancellation are kept.
///
/// # Errors
///
/// [`LabError::Refused`] for a flat scene and for settings that a tree over copies cannot have, and once `token` is cancelled.
pub fn copy_advice(
    accel: &Arc<Accel>,
    rays: &[ViewRays],
    token: &CancelToken,
    row: &mut dyn FnMut(CostOfChange),
) -> Result<(), LabError> {
    let copies = copies_of(&accel.scene)?;
    let Some(levels) = accel.levels() else { unreachable!("it has copies") };
    let [of_list, of_tests, of_changes] = [token.part(0, 3), token.part(1, 3), token.part(2, 3)];
    let lists = listed(rays, accel, &of_list)?;
    let mut meshes = entered_meshes(accel, copies, &lists, &of_tests)?;
    let entered_meshes = meshes.len();
    meshes.truncate(MOST_MESHES);
    let mut pairs = mesh_pairs(copies, &meshes, &of_tests)?;
    let mut extent =
        Extent { entered_meshes, measured_meshes: meshes.len(), pairs: pairs.len(), measured_pairs: pairs.len() };
    // By the tests of both: those of the first meshes come first.
    let place = |mesh: u32| meshes.iter().position(|&other| other == mesh);
    pairs.sort_by_key(|pair| {
        let [a, b] = pair.meshes.map(place);
        (a.max(b), a.min(b))
    });
    pairs.truncate(MOST_PAIRS);
    extent.measured_pairs = pairs.len();
    let changes = changes(&meshes, &pairs);
    let scene = MeshChanges::new(copies, levels.wide().copies(), &accel.settings);
    let mut measuring = Measuring { lists: &lists, extent, as_it_is: Vec::new() };
    for (at, (change, pair)) in changes.iter().enumerate() {
        let token = of_changes.part(at, changes.len());
        let instances = match (change, pair) {
            (MeshChange::Split { mesh, parts }, _) => scene.split(*mesh, *parts, &token)?,
            (_, Some(pair)) => Some(scene.merge(pair, &token)?),
            (_, None) => Some(Instances::of(Arc::clone(levels.wide().copies()), &accel.settings, 1.0, &token)?),
        };
        if let Some(instances) = instances {
            measuring.measure(*change, &instances, &token, row)?;
        }
    }
    Ok(())
}

/// The meshes that rays are carried into, those with most tests first.
fn entered_meshes(
    accel: &Accel,
    copies: &SceneCopies,
    lists: &[ListedRays],
    token: &CancelToken,
) -> Result<Vec<u32>, LabError> {
    let mut tests = vec![0; copies.mesh_count()];
    for (index, rays) in lists.iter().enumerate() {
        let token = token.part(index, lists.len());
        let Some(costs) = accel.copy_costs(rays.list.len() as u32, &rays.ray(), &token)? else {
            unreachable!("it has copies")
        };
        for (copy, cost) in (0..).zip(&costs.copies) {
            tests[copies.copies().mesh(copy) as usize] += cost.tests.total();
        }
    }
    let mut meshes: Vec<u32> = (0..tests.len() as u32).filter(|&mesh| tests[mesh as usize] > 0).collect();
    meshes.sort_by_key(|&mesh| Reverse(tests[mesh as usize]));
    Ok(meshes)
}

/// The scene as it is, each of `meshes` in parts, and each of `pairs` as one, in the order of rows.
fn changes<'a>(meshes: &[u32], pairs: &'a [MeshPair]) -> Vec<(MeshChange, Option<&'a MeshPair>)> {
    let splits = meshes.iter().flat_map(|&mesh| PARTS.map(|parts| (MeshChange::Split { mesh, parts }, None)));
    let merges = pairs.iter().map(|pair| {
        let [mesh, with_mesh] = pair.meshes;
        (MeshChange::Merge { mesh, with_mesh }, Some(pair))
    });
    [(MeshChange::None, None)].into_iter().chain(splits).chain(merges).collect()
}

/// Rays that are counted in changed scenes.
struct Measuring<'a> {
    lists: &'a [ListedRays],
    extent: Extent,
    /// The row of each population in the scene as it is, and where its rays end.
    as_it_is: Vec<(CostOfChange, Vec<Ended>)>,
}

impl Measuring<'_> {
    /// Takes the rays through `instances`, the scene with `change`. The first scene is the one that others are compared with.
    fn measure(
        &mut self,
        change: MeshChange,
        instances: &Instances,
        token: &CancelToken,
        row: &mut dyn FnMut(CostOfChange),
    ) -> Result<(), LabError> {
        // Triangles have other numbers in each scene, and of several at one distance another may come first.
        let traced = Traced::Levels(instances, &|_| 0);
        for (index, rays) in self.lists.iter().enumerate() {
            let (cost, ended) = traced.costs(rays, &token.part(index, self.lists.len()))?;
            let mut measured = CostOfChange {
                population: rays.population,
                change,
                traced_bytes: instances.bytes(),
                cost,
                differences: Differences::default(),
                extent: self.extent,
            };
            if let Some((before, ended_before)) = self.as_it_is.get(index) {
                measured.differences = Differences::between(before, &measured);
                let slack = if matches!(change, MeshChange::Merge { .. }) { SAME_DISTANCE } else { 0.0 };
                measured.cost.differing_hits =
                    differing(rays, ended_before, &ended, |a, b| is_same_distance(a, b, slack));
            } else {
                self.as_it_is.push((measured, ended));
            }
            row(measured);
        }
        Ok(())
    }
}

/// Tells if two rays end at the same distance, up to `slack` as a part of it.
fn is_same_distance(a: &Ended, b: &Ended, slack: f32) -> bool {
    match (a, b) {
        (Some((_, a)), Some((_, b))) => (a - b).abs() <= slack * a.abs().max(b.abs()),
        _ => a.is_none() && b.is_none(),
    }
}

impl Differences {
    fn between(before: &CostOfChange, after: &CostOfChange) -> Self {
        let change = |number: fn(&CostOfChange) -> f64| {
            let (before, after) = (number(before), number(after));
            (before > 0.0).then(|| after / before - 1.0)
        };
        Self {
            nodes_change: change(|row| row.cost.nodes_per_ray),
            blocks_change: change(|row| row.cost.blocks_per_ray),
            visits_change: change(|row| row.cost.visits_per_ray()),
            bytes_change: change(|row| row.traced_bytes as f64),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_end_at_the_same_distance_up_to_the_slack() {
        let at = |distance: f32| Some((0, distance));
        let cases = [
            (at(10.0), at(10.0), [true, true]),
            (at(10.0), at(10.000_5), [false, true]),
            (at(10.000_5), at(10.0), [false, true]),
            (at(10.0), at(10.002), [false, false]),
            (at(0.0), None, [false, false]),
            (None, at(0.0), [false, false]),
            (None, None, [true, true]),
        ];
        for (a, b, expected) in cases {
            assert_eq!([0.0, SAME_DISTANCE].map(|slack| is_same_distance(&a, &b, slack)), expected, "{a:?}, {b:?}");
        }
    }
}
