//! Builds a tree with the record of its merges.

use crate::aac::{ClusterContainer, build_bvh_with_recursion};
use crate::builders::clustered::MergeLog;
use crate::builders::depth_limit::depth_limit;
use crate::builders::exact;
use crate::builders::hploc;
use crate::builders::ploc;
use crate::builders::prepared::PreparedInput;
use crate::builders::{BuildError, StageTimes, check_size};
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::{Aabb, Dop14, Sphere, Triangle};
use crate::order::input_bounds;
use crate::settings::{BuildSettings, BuilderKind};
use crate::tree::{AnyTree, ContainerKind, Tree};

use super::record::MergeRecord;

/// An agglomerative tree as it was clustered, and the record of its merges.
#[derive(Debug, Clone, PartialEq)]
pub struct Construction {
    /// The tree before all passes over it, and before its depth is limited (see [`Construction::is_too_deep`]).
    pub tree: AnyTree,
    /// Order, level and list of each merge.
    pub record: MergeRecord,
    /// The builder.
    pub builder: BuilderKind,
    /// The tree over scaled triangles, in whose coordinates it was clustered; `None` where coordinates need no scaling.
    scaled: Option<AnyTree>,
}

impl Construction {
    /// The builders whose merges are recorded.
    pub const BUILDERS: [BuilderKind; 4] =
        [BuilderKind::Aac, BuilderKind::Exact, BuilderKind::Ploc, BuilderKind::Hploc];

    /// The merges of a builder are recorded.
    pub fn records(builder: BuilderKind) -> bool {
        Self::BUILDERS.contains(&builder)
    }

    /// Each merge chose the closest pair of its list. PLOC and H-PLOC merge all pairs of a list at once that are each other's nearest.
    pub fn chooses_closest(&self) -> bool {
        matches!(self.builder, BuilderKind::Aac | BuilderKind::Exact)
    }

    /// Builds the tree of `triangles` by a builder that [`Construction::records`], with `settings`, in the rayon pool of the calling
    /// thread, and records its merges. Coordinates must be finite. Without triangles tree and record are empty. Refused for other
    /// builders.
    pub fn new(triangles: &[Triangle], settings: &BuildSettings, token: &CancelToken) -> Result<Self, BuildError> {
        if !Self::records(settings.builder) {
            let label = settings.builder.label();
            let reason = if settings.builder.is_aac() { "merges blocks of triangles" } else { "merges no clusters" };
            let others = Self::BUILDERS.map(BuilderKind::label).join(", ");
            return Err(BuildError::Refused(format!("{label} {reason}: choose one of {others}")));
        }
        check_size(triangles.len(), settings)?;
        match settings.container {
            ContainerKind::Aabb => Ok(construct::<Aabb>(triangles, settings, token)?),
            ContainerKind::Sphere => Ok(construct::<Sphere>(triangles, settings, token)?),
            ContainerKind::Dop14 => Ok(construct::<Dop14>(triangles, settings, token)?),
            ContainerKind::Oriented => unreachable!("refused above"),
        }
    }

    /// The tree with the containers whose distances were compared: [`Self::tree`], unless coordinates were so large or small that
    /// they had to be scaled.
    pub(crate) fn clustered(&self) -> &AnyTree {
        self.scaled.as_ref().unwrap_or(&self.tree)
    }

    /// Whether the builder would balance parts of this tree, because nested containers made it deeper than its limit: the tree of a
    /// build then differs from this one.
    pub fn is_too_deep(&self) -> bool {
        self.tree.max_depth() > depth_limit(self.tree.primitive_indices().len().max(1))
    }
}

/// [`Construction::new`] for one kind of container.
fn construct<C: ClusterContainer>(
    triangles: &[Triangle],
    settings: &BuildSettings,
    token: &CancelToken,
) -> Result<Construction, Cancelled>
where
    AnyTree: From<Tree<C>>,
{
    if triangles.is_empty() {
        let (tree, record) = (Tree::<C>::EMPTY.into(), MergeRecord::default());
        return Ok(Construction { tree, record, builder: settings.builder, scaled: None });
    }
    let mut times = StageTimes::default();
    let bounds = input_bounds(triangles, token)?;
    let input = PreparedInput::new(triangles, bounds, settings, token, &mut times)?;
    let (triangles_of_input, bounds, curve) = (&*input.triangles, &input.bounds, settings.curve);
    let mut log = MergeLog::default();
    let (mut tree, record) = match settings.builder {
        BuilderKind::Exact => {
            let tree = exact::build::<C>(triangles_of_input, token, &mut times)?;
            let record = MergeRecord::of_one_list(&tree, token)?;
            (tree, record)
        }
        BuilderKind::Ploc | BuilderKind::Hploc => {
            let clustered = if settings.builder == BuilderKind::Hploc {
                hploc::cluster::<C>(triangles_of_input, bounds, curve, Some(&mut log), token, &mut times)?
            } else {
                let (clustered, rounds) = ploc::cluster::<C>(triangles_of_input, bounds, curve, token, &mut times)?;
                log = MergeLog { steps: rounds, slots: (0..clustered.slots.len() as u32).collect(), level: 0 };
                clustered
            };
            let (tree, recursion) = clustered.finish_with_merges(log, token, &mut times)?;
            let record = MergeRecord::of_recursion(&tree, recursion, token)?;
            (tree, record)
        }
        _ => {
            let (tree, recursion) = build_bvh_with_recursion::<C>(triangles_of_input, bounds, settings, token)?;
            let record = MergeRecord::of_recursion(&tree, recursion, token)?;
            (tree, record)
        }
    };
    let scaled = (input.scale() != 1.0).then(|| tree.clone().into());
    let container = |index: u32| C::of_triangle(&triangles[index as usize]);
    input.restore(&mut tree, container, token, &mut times)?;
    Ok(Construction { tree: tree.into(), record, builder: settings.builder, scaled })
}
