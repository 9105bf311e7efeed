//! The construction that belongs to a tree.

use std::sync::Arc;

use crate::accel::{Accel, build_bytes_per_triangle};
use crate::budget::Budget;
use bvhscope_engine::builders::BuildError;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::construction::{Construction, ReductionLevel};
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

/// How a tree came about.
#[derive(Debug)]
pub struct History {
    /// The recorded merges; `None` where the builder merges nothing.
    pub construction: Option<Construction>,
    /// The tree that they are about. Held only where it is not the tree of the request.
    pub of: TreeOfRecord,
    /// The reduction that the build had, by level of the recursion.
    pub levels: Vec<ReductionLevel>,
}

/// A tree was made here by merging clusters.
pub fn merges_clusters(accel: &Accel) -> bool {
    accel.file.is_none() && matches!(accel.settings.builder, BuilderKind::Aac | BuilderKind::Exact)
}

impl History {
    /// The construction of `accel`'s tree: built again and recorded, where its builder merges clusters. Refused where memory does not
    /// suffice.
    pub fn new(accel: &Accel, token: &CancelToken) -> Result<Self, BuildError> {
        if !merges_clusters(accel) {
            return Ok(Self { construction: None, of: TreeOfRecord::Same, levels: Vec::new() });
        }
        let triangles = accel.scene.built_triangles();
        let build = build_bytes_per_triangle(accel.settings.container);
        let bytes = triangles.len() as u64 * (build + RECORD_BYTES_PER_TRIANGLE);
        let checked = Budget::of_process().check("the record of its merges", bytes);
        checked.map_err(|error| BuildError::Refused(error.to_string()))?;
        let construction = Construction::new(triangles, &accel.settings, token)?;
        let of = if construction.tree == accel.tree {
            TreeOfRecord::Same
        } else {
            let tree = construction.tree.clone();
            TreeOfRecord::Before(Arc::new(Accel::with_tree(&accel.scene, &accel.settings, tree, token)?))
        };
        let levels = if construction.record.is_empty() { Vec::new() } else { construction.record.levels() };
        Ok(Self { construction: Some(construction), of, levels })
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
        if self.construction.is_none() {
            let label = settings.builder.label();
            return Some(match settings.builder {
                BuilderKind::None => "There is no hierarchy, so nothing was merged".to_owned(),
                BuilderKind::Swift => format!(
                    "{label} merges blocks of triangles, which is not recorded: these are its nodes in order of their area, smallest \
                     first"
                ),
                BuilderKind::Ploc | BuilderKind::Hploc => format!(
                    "{label} merges clusters in rounds, which are not recorded: these are its nodes in order of their area, smallest first"
                ),
                _ => format!(
                    "{label} splits from the top and merges nothing: these are its nodes in order of their area, smallest first"
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
            return Some(
                "The tree on the screen was balanced after it was clustered; these are its merges before".to_owned(),
            );
        }
        Some(format!(
            "These merges made the tree before its passes ({}), and its containers are drawn",
            passes.join(", ")
        ))
    }
}
