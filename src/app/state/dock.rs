//! The dock above the depth bar: which of its views is open, and its height.

use serde::{Deserialize, Deserializer, Serialize};

/// A view of the dock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum DockView {
    /// The construction, merge by merge.
    Merges,
    /// The tree as an icicle.
    Icicle,
    /// One ray through the tree, step by step.
    Ray,
    /// The nodes that cost most.
    Nodes,
    /// Nodes and trees as plots.
    Plots,
    /// The paper's tables and figures.
    Paper,
}

impl DockView {
    /// All views, in the order of their tabs and keys.
    pub const ALL: [Self; 6] = [Self::Merges, Self::Icicle, Self::Ray, Self::Nodes, Self::Plots, Self::Paper];

    /// The name on its tab.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Merges => "Merges",
            Self::Icicle => "Icicle",
            Self::Ray => "Ray",
            Self::Nodes => "Nodes",
            Self::Plots => "Plots",
            Self::Paper => "Paper",
        }
    }

    /// What it is for, in one sentence.
    pub const fn purpose(self) -> &'static str {
        match self {
            Self::Merges => "How the tree was built, merge by merge: scrub, play, and ask why two clusters were merged",
            Self::Ray => {
                "What one ray does in the tree, step by step: what it enters, skips and tests, and what was in vain"
            }
            Self::Icicle => {
                "The whole tree at a glance: each node below its parent, as wide as its share of cost, visits or triangles"
            }
            Self::Nodes => "Which nodes make rays slow: the worst by cost, overlap, empty space or measured visits",
            Self::Plots => {
                "What the SAH predicts against what rays really do: visits of nodes, cost of trees, and what quality takes to build"
            }
            Self::Paper => "Measure the paper's tables and figures on the open model",
        }
    }
}

/// The dock, as saved between runs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Dock {
    /// The open view; `None` while the dock is closed.
    pub open: Option<DockView>,
    /// Height in points that the user gave it.
    pub height: f32,
}

impl Default for Dock {
    fn default() -> Self {
        Self { open: None, height: 288.0 }
    }
}

impl Dock {
    /// Opens a view, or closes the dock where it shows that view.
    pub fn toggle(&mut self, view: DockView) {
        self.open = (self.open != Some(view)).then_some(view);
    }
}

/// Reads a saved dock. Version 0.1 saved whether its paper panel was open.
pub(super) fn from_saved<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Dock, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Saved {
        PaperOpen(bool),
        Dock(Dock),
    }
    Ok(match Saved::deserialize(deserializer)? {
        Saved::PaperOpen(open) => Dock { open: open.then_some(DockView::Paper), ..Dock::default() },
        Saved::Dock(dock) => dock,
    })
}
