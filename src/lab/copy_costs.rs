//! The cost of rays in the copies of a scene of two levels: `copies`.

use std::cmp::Reverse;
use std::sync::Arc;

use serde::Serialize;

use super::copy_boxes::{BoxRatios, CopyBoxes};
use super::cost_row::OwnFields;
use super::measure::LabError;
use super::population::{Population, ViewRays, listed};
use crate::accel::Accel;
use crate::catalog::fields::copy_columns;
use crate::scene::{Scene, SceneCopies};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::tree::traverse::TestCounts;
use bvhscope_engine::{CopyCost, CopyCosts};

/// A part of a scene of copies and what the rays of one population cost in it. Field names are the JSON names.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CostInPart {
    /// The rays.
    pub population: Population,
    /// Number of rays.
    pub rays: u64,
    /// The part.
    #[serde(flatten)]
    pub part: CopyPart,
    /// Its cost.
    #[serde(flatten)]
    pub cost: PartCost,
}

impl OwnFields for CostInPart {
    fn columns() -> Vec<&'static str> {
        copy_columns()
    }

    fn population(&self) -> Population {
        self.population
    }
}

/// Kind of a part of a scene of copies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PartKind {
    /// The whole scene.
    All,
    /// The tree over the copies.
    Above,
    /// All copies of a mesh.
    Mesh,
    /// One copy.
    Copy,
}

/// A part of a scene of copies.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CopyPart {
    /// Kind of the part.
    pub part: PartKind,
    /// Index of the mesh, of parts of one mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<u32>,
    /// Index of the copy, of a part that is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub copy: Option<u32>,
    /// Number of copies in it.
    pub copies: u64,
    /// Triangles of a copy, of parts of one mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh_triangles: Option<usize>,
    /// Middle of its box, of one copy.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub center: Option<[f32; 3]>,
    /// How loosely boxes lie around its copies; `None` above these.
    #[serde(flatten)]
    pub boxes: Option<BoxRatios>,
}

/// Cost of a part, on average of a ray.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PartCost {
    /// Copies of it that a ray is carried into.
    pub entered_per_ray: f64,
    /// Part of the rays that end on it.
    pub hits_per_ray: f64,
    /// Part of the entries after which the ray does not end on that copy; `None` where there are none.
    pub wasted_share: Option<f64>,
    /// Tests of containers.
    pub container_tests_per_ray: f64,
    /// Tests of triangles.
    pub primitive_tests_per_ray: f64,
    /// Both.
    pub tests_per_ray: f64,
    /// Part of all tests of the scene; `None` where there are none.
    pub share_of_tests: Option<f64>,
}

/// The cost of the rays of each population in the whole scene, above the copies, in each mesh, and in the `most` copies that take most
/// tests, in this order. Populations that were measured before a cancellation are kept.
///
/// # Errors
///
/// [`LabError::Refused`] for a flat scene, and once `token` is cancelled.
pub fn copy_costs(
    accel: &Arc<Accel>,
    rays: &[ViewRays],
    most: usize,
    token: &CancelToken,
    row: &mut dyn FnMut(CostInPart),
) -> Result<(), LabError> {
    let copies = copies_of(&accel.scene)?;
    let [of_boxes, of_list, of_rays] = [token.part(0, 3), token.part(1, 3), token.part(2, 3)];
    let boxes = CopyBoxes::new(&accel.scene, copies, &of_boxes)?;
    let parts = Parts { copies, accel, most, of_meshes: boxes.of_meshes(&of_boxes)?, boxes };
    let lists = listed(rays, accel, &of_list)?;
    for (index, rays) in lists.iter().enumerate() {
        let token = of_rays.part(index, lists.len());
        let count = rays.list.len() as u32;
        let Some(costs) = accel.copy_costs(count, &rays.ray(), &token)? else { unreachable!("it has copies") };
        for (part, cost) in parts.list(&costs, &token)? {
            row(CostInPart { population: rays.population, rays: u64::from(count), part, cost });
        }
    }
    Ok(())
}

/// The copies of the scene of `accel`.
///
/// # Errors
///
/// [`LabError::Refused`] for a flat scene.
pub(super) fn copies_of(scene: &Scene) -> Result<&SceneCopies, LabError> {
    scene.copies.as_deref().ok_or_else(|| LabError::Refused("the scene is flat: it has no copies of meshes".to_owned()))
}

/// The parts of a scene that rows are of.
struct Parts<'a> {
    copies: &'a SceneCopies,
    accel: &'a Accel,
    /// Number of copies that have rows.
    most: usize,
    boxes: CopyBoxes<'a>,
    /// How loose those of each mesh are.
    of_meshes: Vec<Option<BoxRatios>>,
}

impl Parts<'_> {
    /// The parts with their `costs`, in the order of rows.
    fn list(&self, costs: &CopyCosts, token: &CancelToken) -> Result<Vec<(CopyPart, PartCost)>, LabError> {
        let mut of_meshes = vec![CopyCost::default(); self.copies.mesh_count()];
        let mut counts = vec![0; self.copies.mesh_count()];
        for (copy, cost) in costs.copies.iter().enumerate() {
            let mesh = self.mesh_of(copy) as usize;
            of_meshes[mesh] = sum(&of_meshes[mesh], cost);
            counts[mesh] += 1;
        }
        let above = TestCounts { containers: costs.containers_above, primitives: 0 };
        let above = CopyCost { tests: above, ..CopyCost::default() };
        let all = CopyCost { hits: costs.hits, ..of_meshes.iter().fold(above, |all, cost| sum(&all, cost)) };
        let cost = |part: &CopyCost| PartCost::new(part, &all, costs.rays);
        let of_all = self.of_meshes.iter().zip(&counts).filter_map(|(boxes, &copies)| Some(((*boxes)?, copies)));
        let whole =
            CopyPart { boxes: BoxRatios::mean(of_all), ..CopyPart::of(PartKind::All, costs.copies.len() as u64) };
        // No ray ends in the tree over the copies, and none is carried into it.
        let mut parts = vec![(whole, cost(&all)), (CopyPart::of(PartKind::Above, 0), cost(&above))];
        let mut meshes: Vec<u32> = (0..self.copies.mesh_count() as u32).collect();
        meshes.sort_by_key(|&mesh| Reverse(of_meshes[mesh as usize].tests.total()));
        parts.extend(meshes.iter().map(|&mesh| {
            let part = self.of_mesh(mesh, CopyPart::of(PartKind::Mesh, counts[mesh as usize]));
            (CopyPart { boxes: self.of_meshes[mesh as usize], ..part }, cost(&of_meshes[mesh as usize]))
        }));
        let mut dearest: Vec<u32> = (0..costs.copies.len() as u32).collect();
        dearest.retain(|&copy| costs.copies[copy as usize].entered > 0);
        dearest.sort_by_key(|&copy| Reverse(costs.copies[copy as usize].tests.total()));
        dearest.truncate(self.most);
        let boxes = self.boxes.of_copies(&dearest, token)?;
        parts.extend(dearest.into_iter().zip(boxes).map(|(copy, boxes)| {
            let center =
                self.accel.scene.triangles.get(copy as usize).map(|across| across.bounds().center().to_array());
            let part = CopyPart { copy: Some(copy), center, boxes, ..CopyPart::of(PartKind::Copy, 1) };
            (self.of_mesh(self.mesh_of(copy as usize), part), cost(&costs.copies[copy as usize]))
        }));
        Ok(parts)
    }

    fn mesh_of(&self, copy: usize) -> u32 {
        self.copies.copies().mesh(copy as u32)
    }

    fn of_mesh(&self, mesh: u32, part: CopyPart) -> CopyPart {
        CopyPart { mesh: Some(mesh), mesh_triangles: Some(self.copies.mesh(mesh).len()), ..part }
    }
}

impl CopyPart {
    /// A part that is of no mesh.
    const fn of(part: PartKind, copies: u64) -> Self {
        Self { part, mesh: None, copy: None, copies, mesh_triangles: None, center: None, boxes: None }
    }
}

fn sum(a: &CopyCost, b: &CopyCost) -> CopyCost {
    CopyCost { entered: a.entered + b.entered, hits: a.hits + b.hits, tests: a.tests + b.tests }
}

impl PartCost {
    /// Of `part` of `all`, by so many rays.
    fn new(part: &CopyCost, all: &CopyCost, rays: u64) -> Self {
        let ratio = |count: u64, of: u64| (of > 0).then(|| count as f64 / of as f64);
        let per_ray = |count: u64| ratio(count, rays).unwrap_or(0.0);
        Self {
            entered_per_ray: per_ray(part.entered),
            hits_per_ray: per_ray(part.hits),
            wasted_share: ratio(part.entered - part.hits, part.entered),
            container_tests_per_ray: per_ray(part.tests.containers),
            primitive_tests_per_ray: per_ray(part.tests.primitives),
            tests_per_ray: per_ray(part.tests.total()),
            share_of_tests: ratio(part.tests.total(), all.tests.total()),
        }
    }
}
