//! Meshes that a scene has once, and where their copies stand.

use std::ops::Range;
use std::path::Path;

use glam::Affine3A;

use super::error::LoadError;
use super::motion::CopyMotion;
use super::moving_place::{moving, moving_places};
use bvhscope_engine::builders::BuildError;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::{Aabb, Placement, Triangle};
use bvhscope_engine::{Copies, Placed};

/// Triangles between two cancellation checks.
const BATCH_SIZE: usize = 1 << 16;

/// Copies of the meshes of a scene that has every mesh once, in its own coordinates: the *prototypes*.
#[derive(Debug, Clone, Default)]
pub struct PlacedMeshes {
    /// The triangles of each mesh, in the lists of the prototypes.
    pub meshes: Vec<Range<u32>>,
    /// The copies: which mesh each one is of, and where it stands.
    pub placed: Vec<Placed>,
    /// How they move.
    pub motion: Option<CopyMotion>,
}

impl PlacedMeshes {
    /// Number of triangles of all copies: those of the flat scene.
    pub fn triangle_count(&self) -> u64 {
        total(&self.meshes, &self.placed)
    }

    /// The boxes of the meshes in `triangles`.
    pub(super) fn bounds(&self, triangles: &[Triangle], token: &CancelToken) -> Result<Vec<Aabb>, Cancelled> {
        let bounds = |mesh: &Range<u32>| around(&triangles[mesh.start as usize..mesh.end as usize], token);
        self.meshes.iter().map(bounds).collect()
    }

    /// Where the copies of the meshes in `triangles` stand.
    pub(super) fn places(&self, triangles: &[Triangle], path: &Path, token: &CancelToken) -> Result<Copies, LoadError> {
        let bounds = self.bounds(triangles, token)?;
        if self.motion.is_some() {
            return Ok(moving_places(&self.placed, &bounds));
        }
        Copies::new(&bounds, &self.placed, token).map_err(|error| match error {
            BuildError::Cancelled(cancelled) => LoadError::Cancelled(cancelled),
            BuildError::Refused(text) => {
                let (problem, advice) = text.rsplit_once("; ").unwrap_or((&text, "leave the copy out"));
                LoadError::of_file(path, problem, advice)
            }
        })
    }
}

/// The sum of the lengths of `ranges` over the copies.
pub(super) fn total(ranges: &[Range<u32>], placed: &[Placed]) -> u64 {
    placed.iter().map(|copy| ranges[copy.mesh as usize].len() as u64).sum()
}

/// The box around `triangles`.
pub(super) fn around(triangles: &[Triangle], token: &CancelToken) -> Result<Aabb, Cancelled> {
    let mut bounds = Aabb::EMPTY;
    for batch in triangles.chunks(BATCH_SIZE) {
        token.check()?;
        bounds = batch.iter().fold(bounds, |bounds, triangle| bounds.union(&triangle.bounds()));
    }
    Ok(bounds)
}

/// The meshes of a file that a reader keeps once, and its copies of them.
#[derive(Debug)]
pub(super) struct KeptCopies {
    copies: PlacedMeshes,
    /// The box of each mesh.
    bounds: Vec<Aabb>,
    /// A box around all copies.
    reach: Aabb,
}

impl KeptCopies {
    pub(super) fn new() -> Self {
        Self { copies: PlacedMeshes::default(), bounds: Vec::new(), reach: Aabb::EMPTY }
    }

    /// The last of `triangles`, from `first` on, as a mesh; `None` if there are none.
    pub(super) fn add_mesh(
        &mut self,
        triangles: &[Triangle],
        first: usize,
        token: &CancelToken,
    ) -> Result<Option<u32>, Cancelled> {
        let own = triangles.get(first..).unwrap_or_default();
        if own.is_empty() {
            return Ok(None);
        }
        self.bounds.push(around(own, token)?);
        self.copies.meshes.push(first as u32..triangles.len() as u32);
        Ok(Some(self.copies.meshes.len().saturating_sub(1) as u32))
    }

    /// Adds a copy of a mesh; returns whether there can be one, see [`Placement::new`].
    pub(super) fn place(&mut self, mesh: u32, transform: Affine3A) -> bool {
        let Some(bounds) = self.bounds.get(mesh as usize) else { return false };
        let Ok(place) = Placement::new(&transform, bounds) else { return false };
        self.reach = self.reach.union(&place.bounds(bounds));
        self.copies.placed.push(Placed { mesh, transform });
        true
    }

    /// Adds a copy of a mesh, which moves: it may be pressed flat here.
    pub(super) fn place_moving(&mut self, mesh: u32, transform: Affine3A) {
        if let Some(bounds) = self.bounds.get(mesh as usize) {
            self.reach = self.reach.union(&moving(&transform, bounds).0.bounds(bounds));
            self.copies.placed.push(Placed { mesh, transform });
        }
    }

    /// The last of `triangles`, from `first` on, as a mesh with one copy, where it is.
    pub(super) fn place_here(
        &mut self,
        triangles: &[Triangle],
        first: usize,
        token: &CancelToken,
    ) -> Result<(), Cancelled> {
        if let Some(mesh) = self.add_mesh(triangles, first, token)? {
            self.place(mesh, Affine3A::IDENTITY);
        }
        Ok(())
    }

    /// The meshes with their copies, and a box around these.
    pub(super) fn finish(self) -> (PlacedMeshes, Aabb) {
        (self.copies, self.reach)
    }
}
