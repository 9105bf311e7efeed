//! The triangles that a builder gets: those given, proxies of them where large ones are split, or scaled ones where areas would
//! overflow or vanish. A tree over them becomes one over the given triangles by [`PreparedInput::restore`].

use std::borrow::Cow;
use std::time::Instant;

use crate::builders::presplit::{Presplit, presplit};
use crate::builders::scale;
use crate::cancel::{CancelToken, Cancelled, MEDIUM_STEPS};
use crate::geometry::{Triangle, area_scale};
use crate::order::{InputBounds, input_bounds};
use crate::settings::{BuildSettings, Pass};
use crate::stage_times::StageTimes;
use crate::tree::{Container, Tree};

/// Number of primitives from which on 32 bits cannot index the nodes, of which there are twice as many.
pub(super) const MAX_PRIMITIVES: usize = 1 << 31;
/// The triangles that a builder gets, and their bounds.
pub(crate) struct PreparedInput<'a> {
    pub triangles: Cow<'a, [Triangle]>,
    pub bounds: InputBounds,
    change: Change,
}

/// Difference from the triangles given.
enum Change {
    None,
    /// All coordinates are multiplied by this power of two.
    Scaled(f32),
    /// Proxies, with the index of each one's triangle.
    Split(Vec<u32>),
}

impl<'a> PreparedInput<'a> {
    /// Prepares `triangles`, at least one, with these `bounds` for a build with `settings`. Scaled triangles are never split: their
    /// leaves are refitted to whole triangles. Adds the stage "scale" or "split" where one runs.
    pub fn new(
        triangles: &'a [Triangle],
        bounds: InputBounds,
        settings: &BuildSettings,
        token: &CancelToken,
        times: &mut StageTimes,
    ) -> Result<Self, Cancelled> {
        let start = Instant::now();
        let factor = area_scale(bounds.max_coordinate);
        if factor != 1.0 {
            let scaled = scale::scaled(triangles, factor, token)?;
            let bounds = input_bounds(&scaled, token)?;
            times.stages.push(("scale", start.elapsed()));
            return Ok(Self { triangles: scaled.into(), bounds, change: Change::Scaled(factor) });
        }
        let mut input = Self { triangles: triangles.into(), bounds, change: Change::None };
        if settings.passes().contains(Pass::Split) {
            let split = presplit(triangles, token)?.filter(|split| split.source_index.len() < MAX_PRIMITIVES);
            if let Some(Presplit { proxy_triangles, source_index }) = split {
                let bounds = input_bounds(&proxy_triangles, token)?;
                input = Self { triangles: proxy_triangles.into(), bounds, change: Change::Split(source_index) };
            }
            times.stages.push((Pass::Split.name(), start.elapsed()));
        }
        Ok(input)
    }

    /// Whether these are the triangles given.
    pub fn is_unchanged(&self) -> bool {
        matches!(self.change, Change::None)
    }

    /// Factor from given coordinates to these.
    pub fn scale(&self) -> f32 {
        if let Change::Scaled(factor) = self.change { factor } else { 1.0 }
    }

    /// For each primitive the given triangle that it is a part of, where some are split.
    pub fn sources(&self) -> Option<&[u32]> {
        if let Change::Split(source_index) = &self.change { Some(source_index) } else { None }
    }

    /// Index of the given triangle that the primitive `index` is, or is a part of.
    pub fn source_index(&self, index: u32) -> u32 {
        self.sources().map_or(index, |sources| sources[index as usize])
    }

    /// Makes `tree`, over these triangles, one over those given, each in its `container`. Adds the stage "refit" where containers are
    /// computed again.
    pub fn restore<C: Container>(
        &self,
        tree: &mut Tree<C>,
        container: impl Fn(u32) -> C,
        token: &CancelToken,
        times: &mut StageTimes,
    ) -> Result<(), Cancelled> {
        match &self.change {
            Change::None => {}
            Change::Scaled(_) => {
                let start = Instant::now();
                scale::refit(tree, container, token)?;
                times.stages.push(("refit", start.elapsed()));
            }
            Change::Split(source_index) => {
                for batch in tree.primitive_indices.chunks_mut(MEDIUM_STEPS) {
                    token.check()?;
                    for index in batch {
                        *index = source_index[*index as usize];
                    }
                }
            }
        }
        Ok(())
    }
}
