//! Layouts of wide trees by their names.

use serde::{Deserialize, Serialize};

use bvhscope_engine::layouts::{Collapse, Layout, MAX_CHILDREN, MAX_LEAF, Planes};

/// Name of the engine's own eight-wide tree among the collapses.
const ENGINE: &str = "engine";
/// Children of a node of the engine's tree, and most triangles of its leaves.
const ENGINE_LIMITS: [u32; 2] = [8, 16];

/// A layout among those of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LayoutChoice {
    /// The program's own eight-wide tree, which pictures are traced through.
    Engine,
    /// A described one.
    Described(Layout),
}

impl LayoutChoice {
    /// A layout that help and messages name.
    const EXAMPLE: Self =
        Self::Described(Layout { children: 4, collapse: Collapse::Optimal, planes: Planes::Bits8, leaf_size: 4 });

    /// The layout that `layouts` prints by this name, see [`NamedLayout::name`], with or without its commas and the word "leaves"; or
    /// `engine`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let words = text.split([' ', ',']).filter(|word| !word.is_empty() && *word != "leaves");
        let found = match words.collect::<Vec<_>>()[..] {
            [ENGINE] | [_, ENGINE, _, _] => Some(Self::Engine),
            [children, collapse, planes, leaf_size] => described([children, collapse, planes, leaf_size]),
            _ => None,
        };
        let example = NamedLayout::from(Self::EXAMPLE).name();
        found.and_then(Self::within_limits).ok_or_else(|| format!("{ENGINE} or a layout is expected, as '{example}'"))
    }

    /// Its nodes are chosen by measured visits.
    pub fn is_by_visits(self) -> bool {
        matches!(self, Self::Described(layout) if layout.collapse == Collapse::Visits)
    }

    /// The same, unless its numbers are beyond what layouts have.
    pub fn within_limits(self) -> Option<Self> {
        let is_within = match self {
            Self::Engine => true,
            Self::Described(Layout { children, leaf_size, .. }) => {
                (2..=MAX_CHILDREN).contains(&children) && (1..=MAX_LEAF).contains(&leaf_size)
            }
        };
        is_within.then_some(self)
    }
}

/// The layout of these words.
fn described([children, collapse, planes, leaf_size]: [&str; 4]) -> Option<LayoutChoice> {
    Some(LayoutChoice::Described(Layout {
        children: children.parse().ok()?,
        collapse: Collapse::ALL.into_iter().find(|known| known.name() == collapse)?,
        planes: Planes::ALL.into_iter().find(|known| known.name() == planes)?,
        leaf_size: leaf_size.parse().ok()?,
    }))
}

/// A layout by its names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct NamedLayout {
    /// Most children of a node.
    pub children: u32,
    /// Name of the collapse.
    pub collapse: &'static str,
    /// Name of the planes.
    pub planes: &'static str,
    /// Most triangles of a leaf.
    pub leaf_limit: u32,
    /// The layout.
    #[serde(skip)]
    pub choice: LayoutChoice,
}

impl NamedLayout {
    /// The engine's own tree with these planes.
    pub const fn engine(planes: &'static str) -> Self {
        let [children, leaf_limit] = ENGINE_LIMITS;
        Self { children, collapse: ENGINE, planes, leaf_limit, choice: LayoutChoice::Engine }
    }

    /// The layout in a table: "8 optimal, f32, leaves 4".
    pub fn name(&self) -> String {
        format!("{} {}, {}, leaves {}", self.children, self.collapse, self.planes, self.leaf_limit)
    }

    /// True for the program's own tree.
    pub fn is_own(&self) -> bool {
        self.choice == LayoutChoice::Engine
    }

    /// The layouts that it is plotted with.
    pub fn group(&self) -> String {
        if self.is_own() { "the program's own tree".to_owned() } else { format!("{} children", self.children) }
    }
}

impl From<LayoutChoice> for NamedLayout {
    fn from(choice: LayoutChoice) -> Self {
        match choice {
            LayoutChoice::Engine => Self::engine("f32"),
            LayoutChoice::Described(layout) => layout.into(),
        }
    }
}

impl From<Layout> for NamedLayout {
    fn from(layout: Layout) -> Self {
        let Layout { children, collapse, planes, leaf_size } = layout;
        let (collapse, planes, choice) = (collapse.name(), planes.name(), LayoutChoice::Described(layout));
        Self { children, collapse, planes, leaf_limit: leaf_size, choice }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layouts_are_read_by_the_names_that_they_are_printed_with() {
        for children in [2, 3, 16] {
            for collapse in Collapse::ALL {
                for planes in Planes::ALL {
                    let choice = LayoutChoice::Described(Layout { children, collapse, planes, leaf_size: 32 });
                    let name = NamedLayout::from(choice).name();
                    assert_eq!(LayoutChoice::parse(&name), Ok(choice), "{name}");
                    assert_eq!(LayoutChoice::parse(&name.replace([',', ' '], ",")), Ok(choice), "{name}");
                }
            }
        }
        for name in ["engine".to_owned(), NamedLayout::engine("f32+8").name()] {
            assert_eq!(LayoutChoice::parse(&name), Ok(LayoutChoice::Engine), "{name}");
        }
        for text in [
            "",
            "8",
            "8 best f32 4",
            "8 optimal f32",
            "8 optimal 12 4",
            "17 optimal f32 4",
            "8 optimal f32 0",
            "engine f32",
        ] {
            let error = LayoutChoice::parse(text);
            let expected = "engine or a layout is expected, as '4 optimal, 8, leaves 4'";
            assert_eq!(error, Err(expected.to_owned()), "{text}");
        }
    }
}
