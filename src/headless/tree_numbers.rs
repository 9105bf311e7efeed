//! Tree, settings and numbers as `info`, `render` and `ray` print them with `--json`.

use serde::Serialize;

use crate::accel::{Accel, FileTree};
use crate::catalog::reading::TreeReading;
use crate::catalog::settings::{Stated, preset_name};
use crate::catalog::values::Values;
use bvhscope_engine::tree_file::{Fault, WhichTree};

/// Statistics of a tree. Field names are the JSON names.
#[derive(Debug, Serialize)]
pub struct TreeNumbers {
    pub builder: String,
    /// Name of the preset that has these settings, if any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub preset: Option<String>,
    pub container: &'static str,
    /// The settings of the build.
    #[serde(flatten)]
    pub settings: Stated,
    /// The file that holds the tree, what it says of its settings, and what is wrong with it; absent for a tree that was built.
    #[serde(flatten)]
    pub file: Option<FileNumbers>,
    pub threads: usize,
    /// The numbers of the catalogue.
    #[serde(flatten)]
    pub values: Values,
}

/// Statements of a tree file about its tree, and their faults.
#[derive(Debug, Serialize)]
pub struct FileNumbers {
    pub tree: String,
    /// Most children of a node, as the file states it.
    pub max_arity: u32,
    pub builder_settings: Option<String>,
    pub empty_nodes: u32,
    pub faults: Vec<FaultNumbers>,
}

/// All faults of one kind, numbered as in the file.
#[derive(Debug, Serialize)]
pub struct FaultNumbers {
    pub kind: &'static str,
    pub count: u64,
    pub first: u32,
    /// In two levels: the mesh of the first; absent for the tree over the copies.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<u32>,
    pub excess: f32,
    /// The fault as a sentence.
    #[serde(skip)]
    pub text: String,
}

impl From<&Fault> for FaultNumbers {
    fn from(fault: &Fault) -> Self {
        let &Fault { kind, tree, count, first, excess, .. } = fault;
        let mesh = if let WhichTree::Mesh(mesh) = tree { Some(mesh) } else { None };
        Self { kind: kind.name(), count, first, mesh, excess, text: fault.to_string() }
    }
}

impl From<&FileTree> for FileNumbers {
    fn from(file: &FileTree) -> Self {
        Self {
            tree: file.path.display().to_string(),
            max_arity: file.header.arity,
            builder_settings: file.header.settings_text(),
            empty_nodes: file.empty_nodes,
            faults: file.faults.iter().map(FaultNumbers::from).collect(),
        }
    }
}

impl TreeNumbers {
    /// The numbers of `tree`, which was read from `accel`.
    pub fn new(accel: &Accel, tree: &TreeReading<'_>) -> Self {
        let settings = &accel.settings;
        Self {
            builder: accel.builder_name().into_owned(),
            preset: if accel.file.is_some() { None } else { preset_name(settings) },
            container: accel.tree.container_kind().name(),
            settings: if accel.file.is_some() { Stated::default() } else { Stated::of(settings) },
            file: accel.file.as_ref().map(FileNumbers::from),
            threads: accel.report.threads,
            values: Values::of(tree),
        }
    }
}
