//! Header and faults of a tree file.

use std::borrow::Cow;
use std::path::PathBuf;

use serde_json::Value;

use crate::text::file_name;
use bvhscope_engine::tree_file::{Fault, Header};
use bvhscope_engine::{LevelNode, Unfolded};

/// Header and faults of a tree that was read from a file.
#[derive(Debug, Clone, PartialEq)]
pub struct FileTree {
    /// The file.
    pub path: PathBuf,
    /// Name of the tree in tables and plots in place of the file's.
    pub label: Option<String>,
    /// The file's header.
    pub header: Header,
    /// Faults of the tree.
    pub faults: Vec<Fault>,
    /// Number of nodes that were left out because they are empty.
    pub empty_nodes: u32,
    /// The number of each node in the file; `None` where all have the same.
    pub numbers: Option<Vec<u32>>,
    /// In two levels: the numbers that the author of the file gave to the copies; `None` where it has none.
    pub ids: Option<Vec<u32>>,
}

impl FileTree {
    /// Numbers nodes and faults as they are in a tree in which meshes are unfolded; those of a mesh have their numbers in its tree.
    pub(super) fn unfold(&mut self, unfolded: &Unfolded) {
        for fault in &mut self.faults {
            fault.nodes.iter_mut().for_each(|node| *node = unfolded.above()[*node as usize]);
            fault.nodes.sort_unstable();
        }
        let before = self.numbers.take();
        let number = |origin: &LevelNode| match (*origin, &before) {
            (LevelNode::Above { node }, Some(numbers)) => numbers[node as usize],
            (LevelNode::Above { node } | LevelNode::Below { node, .. }, _) => node,
        };
        self.numbers = Some(unfolded.origins.iter().map(number).collect());
    }

    /// Name of the file without its folder.
    pub fn name(&self) -> Cow<'_, str> {
        file_name(&self.path)
    }

    /// The settings that the file states, in words: "threshold=6 epsilon=0.2".
    pub fn settings_in_words(&self) -> Option<String> {
        let text = |value: &Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        Some(match self.header.settings.as_ref()? {
            Value::Object(fields) => {
                let fields: Vec<String> =
                    fields.iter().map(|(name, value)| format!("{name}={}", text(value))).collect();
                fields.join(" ")
            }
            settings => text(settings),
        })
    }

    /// The name of its builder, or of the file where that is not known.
    pub fn builder(&self) -> Cow<'_, str> {
        let of_file = || self.path.file_stem().map_or(Cow::Borrowed("unknown"), |stem| stem.to_string_lossy());
        self.header.builder.as_deref().map_or_else(of_file, Cow::Borrowed)
    }
}
