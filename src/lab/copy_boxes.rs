//! How loosely boxes lie around turned copies: those around the turned box of the mesh, and those that the tree over the copies is built on.

use serde::Serialize;

use crate::scene::{Scene, SceneCopies};
use bvhscope_engine::cancel::{CancelToken, Cancelled, MEDIUM_STEPS};
use bvhscope_engine::geometry::{Aabb, Triangle};
use bvhscope_engine::kernel::parallel::par_tasks;

/// Triangles that are placed for the means of all meshes, so that a million copies take less than a second; at least one copy of each mesh.
const MOST_TRIANGLES: usize = 1 << 24;
/// Copies that one thread looks at in a row.
const COPIES_PER_TASK: usize = 64;

/// Surface areas of boxes around copies over that of the box of their triangles, on average of copies. Field names are the JSON names.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BoxRatios {
    /// Of the box around the turned box of the mesh.
    pub mesh_box_ratio: f64,
    /// Of the box that the tree over the copies is built on.
    pub copy_box_ratio: f64,
    /// Number of copies that these are means over.
    pub measured_copies: u64,
}

impl BoxRatios {
    /// The means over as many copies as each of `parts` stands for; `None` without any.
    pub fn mean(parts: impl IntoIterator<Item = (Self, u64)>) -> Option<Self> {
        let (mut sums, mut weights, mut measured_copies) = ([0.0; 2], 0, 0);
        for (part, weight) in parts {
            sums[0] += part.mesh_box_ratio * weight as f64;
            sums[1] += part.copy_box_ratio * weight as f64;
            weights += weight;
            measured_copies += part.measured_copies;
        }
        let [mesh_box_ratio, copy_box_ratio] = sums.map(|sum| sum / weights as f64);
        (weights > 0).then_some(Self { mesh_box_ratio, copy_box_ratio, measured_copies })
    }
}

/// The boxes around the copies of a scene.
pub struct CopyBoxes<'a> {
    scene: &'a Scene,
    copies: &'a SceneCopies,
    /// The box of each mesh, in its own coordinates.
    meshes: Vec<Aabb>,
}

impl<'a> CopyBoxes<'a> {
    /// Those of `copies`, which are the copies of `scene`.
    ///
    /// # Errors
    ///
    /// Once `token` is cancelled.
    pub fn new(scene: &'a Scene, copies: &'a SceneCopies, token: &CancelToken) -> Result<Self, Cancelled> {
        let of_mesh = |mesh: u32| around(copies.mesh(mesh), |triangle| *triangle, token);
        let meshes = (0..copies.mesh_count() as u32).map(of_mesh).collect::<Result<_, _>>()?;
        Ok(Self { scene, copies, meshes })
    }

    /// The means of each mesh; `None` for one whose copies have no areas. Of meshes with more triangles in all copies than `MOST_TRIANGLES` by
    /// the number of meshes, copies at equal distances in the list of all are measured.
    ///
    /// # Errors
    ///
    /// Once `token` is cancelled.
    pub fn of_meshes(&self, token: &CancelToken) -> Result<Vec<Option<BoxRatios>>, Cancelled> {
        self.of_meshes_within(MOST_TRIANGLES, token)
    }

    /// The same where `most` triangles are placed.
    fn of_meshes_within(&self, most: usize, token: &CancelToken) -> Result<Vec<Option<BoxRatios>>, Cancelled> {
        let mut of_mesh: Vec<Vec<u32>> = vec![Vec::new(); self.meshes.len()];
        for copy in 0..self.copies.copies().len() as u32 {
            token.check_every(MEDIUM_STEPS, copy as usize)?;
            of_mesh[self.copies.copies().mesh(copy) as usize].push(copy);
        }
        let most = most / self.meshes.len().max(1);
        let mean = |(mesh, copies): (usize, &Vec<u32>)| {
            let sampled = copies.len().min((most / self.copies.mesh(mesh as u32).len()).max(1));
            let sample: Vec<u32> = (0..sampled).map(|at| copies[at * copies.len() / sampled]).collect();
            let ratios = self.of_copies(&sample, token)?;
            Ok(BoxRatios::mean(ratios.into_iter().flatten().map(|ratios| (ratios, 1))))
        };
        of_mesh.iter().enumerate().map(mean).collect()
    }

    /// Those of each of `copies`; `None` for one without area.
    ///
    /// # Errors
    ///
    /// Once `token` is cancelled.
    pub fn of_copies(&self, copies: &[u32], token: &CancelToken) -> Result<Vec<Option<BoxRatios>>, Cancelled> {
        let parts = par_tasks(copies.chunks(COPIES_PER_TASK), token, |copies, token| {
            copies.iter().map(|&copy| self.of_copy(copy, token)).collect::<Result<Vec<_>, _>>()
        })?;
        Ok(parts.concat())
    }

    fn of_copy(&self, copy: u32, token: &CancelToken) -> Result<Option<BoxRatios>, Cancelled> {
        let (place, mesh) = (self.copies.copies().place(copy), self.copies.copies().mesh(copy));
        let own = around(self.copies.mesh(mesh), |triangle| place.triangle(triangle), token)?;
        let area = |bounds: &Aabb| f64::from(bounds.half_area());
        let boxes = [place.bounds(&self.meshes[mesh as usize]), self.scene.triangles[copy as usize].bounds()];
        let [mesh_box_ratio, copy_box_ratio] = boxes.map(|bounds| area(&bounds) / area(&own));
        Ok((area(&own) > 0.0).then_some(BoxRatios { mesh_box_ratio, copy_box_ratio, measured_copies: 1 }))
    }
}

/// The box around `triangles`, each as `placed` has it.
fn around(
    triangles: &[Triangle],
    placed: impl Fn(&Triangle) -> Triangle,
    token: &CancelToken,
) -> Result<Aabb, Cancelled> {
    let mut bounds = Aabb::EMPTY;
    for (index, triangle) in triangles.iter().enumerate() {
        token.check_every(MEDIUM_STEPS, index)?;
        bounds = bounds.union(&placed(triangle).bounds());
    }
    Ok(bounds)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use std::sync::Arc;

    use glam::Vec3;

    use super::*;
    use crate::scene::{Instancing, LoadOptions, SceneSource, load};

    fn forest() -> Arc<Scene> {
        let options = LoadOptions { instances: Instancing::TwoLevel, ..LoadOptions::default() };
        Arc::new(
            load(&SceneSource::parse("builtin:forest:120".as_ref()).unwrap(), &options, &CancelToken::new()).unwrap(),
        )
    }

    /// Surface area of the box around `points`, in double precision.
    fn area(points: impl Iterator<Item = Vec3>) -> f64 {
        let [mut min, mut max] = [Vec3::INFINITY, Vec3::NEG_INFINITY];
        points.for_each(|point| (min, max) = (min.min(point), max.max(point)));
        let size = (max - min).as_dvec3();
        2.0 * (size.x * size.y + size.y * size.z + size.z * size.x)
    }

    #[test]
    fn ratios_are_those_of_boxes_around_corners() {
        let (scene, token) = (forest(), CancelToken::new());
        let copies = scene.copies.as_deref().unwrap();
        let all: Vec<u32> = (0..copies.copies().len() as u32).collect();
        let boxes = CopyBoxes::new(&scene, copies, &token).unwrap();
        let found = boxes.of_copies(&all, &token).unwrap();
        let mut first = 0;
        for (&copy, found) in all.iter().zip(&found) {
            let (place, mesh) = (copies.copies().place(copy), copies.mesh(copies.copies().mesh(copy)));
            let numbers = first..first + mesh.len() as u32;
            first = numbers.end;
            let own = area(numbers.map(|number| copies.triangle(number)).flat_map(|own| [own.a, own.b, own.c]));
            let corners: Vec<Vec3> = mesh.iter().flat_map(|own| [own.a, own.b, own.c]).collect();
            let [min, max] = [corners.iter().copied().reduce(Vec3::min), corners.iter().copied().reduce(Vec3::max)];
            let [min, max] = [min.unwrap(), max.unwrap()];
            let turned = (0..8).map(|corner| {
                let side = |axis: usize| if corner >> axis & 1 == 0 { min[axis] } else { max[axis] };
                place.point(Vec3::new(side(0), side(1), side(2)))
            });
            let found = found.unwrap();
            assert!((found.mesh_box_ratio - area(turned) / own).abs() < 1e-3, "copy {copy}: {found:?}");
            assert!((1.0..=found.mesh_box_ratio).contains(&found.copy_box_ratio), "copy {copy}: {found:?}");
        }
        let loosest = found.iter().flatten().map(|ratios| ratios.mesh_box_ratio).fold(0.0, f64::max);
        assert!(loosest > 1.2, "some are turned: {loosest}");
    }

    #[test]
    fn means_are_over_copies_at_equal_distances_where_there_are_too_many() {
        let (scene, token) = (forest(), CancelToken::new());
        let copies = scene.copies.as_deref().unwrap();
        let boxes = CopyBoxes::new(&scene, copies, &token).unwrap();
        let of_mesh =
            |mesh: u32| (0..copies.copies().len() as u32).filter(move |&copy| copies.copies().mesh(copy) == mesh);
        let mean = |copies: Vec<u32>| {
            let ratios = boxes.of_copies(&copies, &token).unwrap();
            ratios.iter().flatten().map(|ratios| ratios.mesh_box_ratio).sum::<f64>() / copies.len() as f64
        };
        for (mesh, ratios) in boxes.of_meshes(&token).unwrap().into_iter().enumerate() {
            let (all, ratios) = (of_mesh(mesh as u32).collect::<Vec<_>>(), ratios.unwrap());
            assert_eq!(ratios.measured_copies, all.len() as u64);
            assert!((ratios.mesh_box_ratio - mean(all)).abs() < 1e-12);
        }
        // Room for ten copies of the mesh of most, and one of each other.
        let most = (0..copies.mesh_count() as u32).max_by_key(|&mesh| of_mesh(mesh).count()).unwrap();
        let triangles = 10 * copies.mesh(most).len() * copies.mesh_count();
        let sampled = boxes.of_meshes_within(triangles, &token).unwrap()[most as usize].unwrap();
        let all: Vec<u32> = of_mesh(most).collect();
        assert!(all.len() > 20, "{}", all.len());
        let expected = mean((0..10).map(|at| all[at * all.len() / 10]).collect());
        assert_eq!(sampled.measured_copies, 10);
        assert!((sampled.mesh_box_ratio - expected).abs() < 1e-12);
        let none = boxes.of_meshes_within(0, &token).unwrap();
        assert!(none.iter().all(|ratios| ratios.unwrap().measured_copies == 1), "one at least of each");
    }

    #[test]
    fn means_count_each_copy_once() {
        let of = |ratio: f64| BoxRatios { mesh_box_ratio: ratio, copy_box_ratio: 2.0 * ratio, measured_copies: 5 };
        let mean = BoxRatios::mean([(of(1.0), 30), (of(2.0), 10)]).unwrap();
        assert_eq!((mean.mesh_box_ratio, mean.copy_box_ratio, mean.measured_copies), (1.25, 2.5, 10));
        assert_eq!(BoxRatios::mean([]), None);
    }
}
