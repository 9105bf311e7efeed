//! The construction that belongs to a tree.

use std::sync::Arc;

use crate::accel::{Accel, build_bytes_per_triangle};
use crate::budget::Budget;
use bvhscope_engine::builders::BuildError;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::construction::{Construction, ReductionLevel, SplitTree};
use bvhscope_engine::settings::{BuilderKind, Pass, Passes};
use bvhscope_engine::tree::AnyTree;

/// Bytes per triangle of a record, a timeline and, where the tree is another one, its copy; beside those of a build.
const RECORD_BYTES_PER_TRIANGLE: u64 = 200;

/// The tree that a record of merges is about.
#[derive(Debug, Clone)]
pub enum TreeOfRecord {
    /// The tree of the request.
    Same,
    /// The tree before passes over it, or before it was balanced.
    Before(Arc<Accel>),
}

/// Steps that made a tree, where they are known.
#[derive(Debug)]
pub enum Origin {
    /// Its merges.
    Merged(Construction),
    /// Its splits.
    Split(SplitTree),
    /// Nothing: it was read from a file, or by a builder that merges blocks, or there is no hierarchy.
    Unknown,
}

/// How a tree came about.
#[derive(Debug)]
pub struct History {
    /// Its recorded merges or splits.
    pub origin: Origin,
    /// The tree that they are about. Held only where it is not the tree of the request.
    pub of: TreeOfRecord,
    /// The reduction that the build had, by level of the recursion.
    pub levels: Vec<ReductionLevel>,
}

/// A tree was made here by merging clusters.
pub fn merges_clusters(accel: &Accel) -> bool {
    accel.file.is_none() && Construction::records(accel.settings.builder)
}

/// A tree was made here, and its merges or splits are known.
pub fn is_recorded(accel: &Accel) -> bool {
    accel.file.is_none() && (merges_clusters(accel) || SplitTree::is_made_by(accel.settings.builder))
}

impl History {
    /// The construction of `accel`'s tree: built again and recorded, where its merges or splits are known. Refused where memory does not
    /// suffice.
    pub fn new(accel: &Accel, token: &CancelToken) -> Result<Self, BuildError> {
        if !is_recorded(accel) {
            return Ok(Self { origin: Origin::Unknown, of: TreeOfRecord::Same, levels: Vec::new() });
        }
        let triangles = accel.scene.built_triangles();
        let build = build_bytes_per_triangle(accel.settings.container);
        let bytes = triangles.len() as u64 * (build + RECORD_BYTES_PER_TRIANGLE);
        let checked = Budget::of_process().check("the record of its construction", bytes);
        checked.map_err(|error| BuildError::Refused(error.to_string()))?;
        let origin = if merges_clusters(accel) {
            Origin::Merged(Construction::new(triangles, &accel.settings, token)?)
        } else {
            Origin::Split(SplitTree::new(triangles, &accel.settings, token)?)
        };
        let tree = match &origin {
            Origin::Merged(Construction { tree, .. }) | Origin::Split(SplitTree { tree, .. }) => tree,
            Origin::Unknown => &accel.tree,
        };
        let of = if *tree == accel.tree {
            TreeOfRecord::Same
        } else {
            TreeOfRecord::Before(Arc::new(Accel::with_tree(&accel.scene, &accel.settings, tree.clone(), token)?))
        };
        let levels = match &origin {
            Origin::Merged(construction) if !construction.record.is_empty() => construction.record.levels(),
            _ => Vec::new(),
        };
        Ok(Self { origin, of, levels })
    }

    /// The recorded merges; `None` where there are none.
    pub fn construction(&self) -> Option<&Construction> {
        if let Origin::Merged(construction) = &self.origin { Some(construction) } else { None }
    }

    /// The splits; `None` where it was not split.
    pub fn splits(&self) -> Option<&SplitTree> {
        if let Origin::Split(splits) = &self.origin { Some(splits) } else { None }
    }

    /// The tree whose nodes the merges make. `accel` is the tree of the request.
    pub fn tree<'a>(&'a self, accel: &'a Accel) -> &'a AnyTree {
        match &self.of {
            TreeOfRecord::Same => &accel.tree,
            TreeOfRecord::Before(before) => &before.tree,
        }
    }

    /// Why the merges are not those of the tree on the screen, in a sentence; `None` where they are.
    pub fn remark(&self, accel: &Accel) -> Option<String> {
        if let Some(file) = &accel.file {
            return Some(format!(
                "This tree of {} was read from a file: these are its nodes in order of their area, smallest first",
                file.builder()
            ));
        }
        let settings = &accel.settings;
        if matches!(self.origin, Origin::Unknown) {
            let label = settings.builder.label();
            return Some(match settings.builder {
                BuilderKind::None => "There is no hierarchy, so nothing was merged".to_owned(),
                _ => format!(
                    "{label} merges blocks of triangles, which is not recorded: these are its nodes in order of their area, smallest \
                     first"
                ),
            });
        }
        if matches!(self.of, TreeOfRecord::Same) {
            return None;
        }
        if accel.levels().is_some_and(|levels| levels.unfolded().is_some()) {
            return Some("These merges made the tree over the copies, without the unfolded ones' meshes".to_owned());
        }
        let passes: Vec<&str> = settings.passes().iter().filter(|pass| *pass != Pass::Split).map(Pass::label).collect();
        if settings.passes().without(Pass::Split) == Passes::NONE {
            let text = match self.origin {
                Origin::Split(_) => "The tree on the screen was fitted after it was split; these are its splits before",
                _ => "The tree on the screen was balanced after it was clustered; these are its merges before",
            };
            return Some(text.to_owned());
        }
        let steps = if self.splits().is_some() { "splits" } else { "merges" };
        Some(format!(
            "These {steps} made the tree before its passes ({}), and its containers are drawn",
            passes.join(", ")
        ))
    }
}
