//! Copies of meshes that move as they are: flat, with triangles for each, or in two levels, where each moment has other places.

use std::ops::Range;
use std::sync::Arc;

use super::attributes::Attributes;
use super::error::LoadError;
use super::motion::{Moment, Mover, Pose, Rig};
use super::moving_place::moving_places;
use super::scene_copies::SceneCopies;
use super::spread::{flat_triangles, flat_vectors};
use bvhscope_engine::Placed;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::{Aabb, Triangle};

/// The copies of a scene of two levels.
#[derive(Debug)]
pub(super) struct LevelMover {
    /// At rest.
    pub(super) still: SceneCopies,
    pub(super) rig: Arc<Rig>,
}

impl Mover for LevelMover {
    fn triangle_count(&self) -> usize {
        self.still.triangle_count() as usize
    }

    fn pose(&self, moment: Moment, pose: &mut Pose, token: &CancelToken) -> Result<(), LoadError> {
        let (copies, lost) = self.still.moved(&self.rig.of_copies(moment), token)?;
        pose.triangles = copies.stand_ins(token)?;
        (pose.copies, pose.lost) = (Some(Arc::new(copies)), lost);
        Ok(())
    }

    fn bytes(&self) -> usize {
        self.rig.bytes()
    }
}

/// The copies of a flat scene.
#[derive(Debug)]
pub(super) struct FlatMover {
    /// Those of all meshes, with their attributes.
    pub(super) triangles: Vec<Triangle>,
    pub(super) attributes: Option<Attributes>,
    /// The triangles of each mesh, its vertices and its box.
    pub(super) meshes: Vec<Range<u32>>,
    pub(super) vertices: Vec<Range<u32>>,
    pub(super) bounds: Vec<Aabb>,
    /// At rest.
    pub(super) placed: Vec<Placed>,
    pub(super) rig: Arc<Rig>,
}

impl Mover for FlatMover {
    fn triangle_count(&self) -> usize {
        self.placed.iter().map(|copy| self.meshes[copy.mesh as usize].len()).sum()
    }

    fn pose(&self, moment: Moment, pose: &mut Pose, token: &CancelToken) -> Result<(), LoadError> {
        let transforms = self.rig.of_copies(moment);
        let placed = self.placed.iter().zip(transforms).map(|(copy, transform)| Placed { transform, ..*copy });
        let placed: Vec<Placed> = placed.collect();
        let places = moving_places(&placed, &self.bounds);
        pose.triangles = flat_triangles(&self.triangles, &self.meshes, &placed, &places, token)?;
        if let Some(attributes) = &self.attributes {
            (pose.normals, pose.tangents) = flat_vectors(attributes, &self.vertices, &placed, token)?;
        }
        Ok(())
    }

    fn bytes(&self) -> usize {
        [self.rig.bytes(), size_of_val(&self.triangles[..]), size_of_val(&self.placed[..])].into_iter().sum()
    }
}
