//! Unfolding copies of a scene in two levels: their triangles become primitives of the tree.

use std::path::Path;
use std::sync::{Arc, OnceLock};

use super::error::LoadError;
use super::model::Scene;
use super::smooth::SmoothNormals;
use super::unfolded::{CopyRanges, UnfoldedCopies};
use crate::budget::Budget;
use bvhscope_engine::UnfoldedCopy;
use bvhscope_engine::cancel::CancelToken;

/// Bytes of a triangle of an unfolded copy: itself in both orders, two nodes of oriented boxes with their origins and numbers, and what is
/// derived from them.
const UNFOLDED_BYTES: u64 = 560;

impl Scene {
    /// Those of `copies` that the scene has: none of a flat scene.
    pub fn copies_among(&self, copies: &CopyRanges) -> CopyRanges {
        copies.within(self.copies.as_ref().map_or(0, |own| own.copies().len() as u32))
    }

    /// The scene of copies with these unfolded, and no others: their triangles are primitives of the tree in place of them.
    pub fn with_unfolded(&self, wanted: &CopyRanges, token: &CancelToken) -> Result<Self, LoadError> {
        let mut triangles = self.built_triangles().to_vec();
        let mut unfolded = UnfoldedCopies { ranges: wanted.clone(), copies: Vec::new() };
        if let Some(copies) = &self.copies {
            let count = copies.copies().len() as u32;
            unfolded.ranges = self.copies_among(wanted);
            let size = |copy| copies.mesh(copies.copies().mesh(copy)).len() as u64;
            let all: u64 = wanted.iter(count).map(size).sum();
            if let Err(error) = Budget::of_process().check("the unfolded copies", UNFOLDED_BYTES.saturating_mul(all)) {
                return Err(LoadError::over_budget(Path::new(&self.source.to_string()), &error));
            }
            if all.saturating_add(triangles.len() as u64) > u64::from(u32::MAX) {
                let problem = "more triangles would be unfolded than indices of 32 bits can tell apart";
                let path = self.source.to_string();
                return Err(LoadError::of_file(Path::new(&path), problem, "unfold fewer copies"));
            }
            for copy in wanted.iter(count) {
                token.check()?;
                unfolded.copies.push(UnfoldedCopy { copy, first: triangles.len() as u32 });
                let place = copies.copies().place(copy);
                triangles
                    .extend(copies.mesh(copies.copies().mesh(copy)).iter().map(|triangle| place.triangle(triangle)));
            }
        }
        Ok(Self {
            source: self.source.clone(),
            triangles,
            copies: self.copies.clone(),
            unfolded,
            cameras: self.cameras.clone(),
            lights: Arc::clone(&self.lights),
            scene_names: self.scene_names.clone(),
            attributes: self.attributes.clone(),
            material_indices: Arc::clone(&self.material_indices),
            materials: self.materials.clone(),
            textures: self.textures.clone(),
            smooth_normals: SmoothNormals::default(),
            edges: OnceLock::new(),
            motion: self.motion.clone(),
            files_read: self.files_read.clone(),
            warnings: self.warnings.clone(),
            ..*self
        })
    }

    /// The copy that a primitive of the tree is, or whose triangle it is, with the index of that in the mesh; `None` of a flat scene.
    pub fn copy_of(&self, primitive: u32) -> Option<(u32, Option<u32>)> {
        self.copies.as_ref()?;
        let triangle = self.unfolded.find(primitive);
        Some(triangle.map_or((primitive, None), |(copy, triangle)| (copy, Some(triangle))))
    }

    /// A triangle of a primitive of the tree by the number that hits name it by: whatever is unfolded, [`Scene::primitive_of`] finds the
    /// primitive that has it.
    pub fn hit_of(&self, primitive: u32) -> u32 {
        let Some(copies) = &self.copies else { return primitive };
        match self.unfolded.find(primitive) {
            Some((copy, triangle)) => copies.number(copy, triangle),
            None => copies.number(primitive, 0),
        }
    }
}
