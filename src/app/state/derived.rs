//! Data derived from the trees on the screen in the background, which panels, picture and several views read.

use std::sync::{Arc, Weak};

use crate::accel::node_values::KnownVisits;
use crate::accel::{Accel, is_same};
use crate::app::state::ray_file::RayFile;
use crate::app::state::study::{OtherTree, Study};
use crate::lab::diagnose::Finding;
use crate::lab::population::{MeasuredVisits, Population, ViewRays};
use crate::scene::Scene;
use bvhscope_engine::tree::survival::Survival;

/// Data derived from the trees on the screen, and the rays by which visits are measured.
#[derive(Debug, Default)]
pub struct Derived {
    /// Problems of the model or its tree that make rays slow.
    pub findings: Study<(), Vec<Finding>>,
    /// The nodes of the first tree that the second has too, and the other way round.
    pub survival: Study<OtherTree, [Survival; 2]>,
    /// The nodes of the first tree that it had before its passes too, and the other way round.
    pub moved: Study<(), [Survival; 2]>,
    /// Savings from rebuilding subtrees, which the tree keeps.
    pub regrets: Study<(), ()>,
    /// How the triangles meet in their edges, which the scene keeps.
    pub edges: Study<(), ()>,
    /// The edges of a model are counted whatever its size.
    pub counts_edges: bool,
    /// Estimates of the tests of a ray in the first tree and in this second one, which the trees keep.
    pub estimates: Study<Option<OtherTree>, ()>,
    /// Readings that are taken while nothing else happens.
    pub at_rest: AtRestState,
    /// The kind of rays that visits are measured by.
    pub population: Population,
    /// The rays of a file.
    pub ray_file: RayFile,
    /// How often the chosen rays visit each node.
    pub visits: Study<ViewRays, MeasuredVisits>,
    /// The primary rays by whose view visits are measured, and their scene: the view when visits were first wanted, so that numbers stay
    /// the same while the user looks at nodes from elsewhere, and can be compared from tree to tree.
    pub(in crate::app::state) rays: Option<(Weak<Scene>, ViewRays)>,
}

impl Derived {
    /// Triangles of a model up to which its edges are counted unasked: a second or two, and 200 MB meanwhile.
    pub const MOST_EDGES_AT_ONCE: usize = 2_000_000;

    /// The rays of the chosen population by which visits in `scene` are measured, if that was begun.
    pub fn rays(&self, scene: &Arc<Scene>) -> Option<ViewRays> {
        let (_, rays) = self.rays.as_ref().filter(|(of, _)| is_same(of, scene))?;
        Some(self.with_file(rays.clone()).of(self.population))
    }

    /// The same rays, and those of the file.
    pub fn with_file(&self, rays: ViewRays) -> ViewRays {
        rays.with_file(self.ray_file.rays().map(|read| Arc::clone(&read.set)))
    }

    /// The populations that there are, in the order of menus.
    pub fn populations(&self) -> impl Iterator<Item = Population> {
        Population::of_rows().filter(|&of| of != Population::File || self.ray_file.rays().is_some())
    }

    /// Measures visits by the rays of the view of these primary ones from now on.
    pub fn measure_by(&mut self, scene: &Arc<Scene>, rays: ViewRays) {
        self.rays = Some((Arc::downgrade(scene), rays));
        self.visits.resume();
    }

    /// The visits of `accel` by the chosen rays, with these; `None` while they are not known.
    pub fn measured(&self, accel: &Arc<Accel>) -> Option<(ViewRays, &Arc<MeasuredVisits>)> {
        let rays = self.rays(&accel.scene)?;
        let measured = self.visits.get(accel, &rays)?;
        Some((rays, measured))
    }

    /// Whether the user has stopped what measures the visits of `accel`, or what rebuilds its subtrees.
    pub fn is_measuring_stopped(&self, accel: &Arc<Accel>) -> bool {
        self.regrets.is_cancelled(accel, &())
            || self.rays(&accel.scene).is_some_and(|rays| self.visits.is_cancelled(accel, &rays))
    }

    /// Begins again with what measures visits or rebuilds subtrees, where the user has stopped it.
    pub fn resume_measuring(&mut self) {
        self.visits.resume();
        self.regrets.resume();
    }

    /// The visits of `accel` where they are `needed`; an error while they are not known.
    pub(in crate::app) fn needed_visits(&self, accel: &Arc<Accel>, needed: bool) -> Result<Option<KnownVisits>, ()> {
        if needed { self.known_visits(accel).map(Some).ok_or(()) } else { Ok(None) }
    }

    /// The visits of `accel` that were measured last, by whichever rays.
    pub fn known_visits(&self, accel: &Arc<Accel>) -> Option<KnownVisits> {
        self.visits.of_tree(accel).map(|measured| KnownVisits(Arc::clone(&measured.visits)))
    }
}

/// Readings of both trees that no window moves; see [`measure_at_rest`](crate::lab::at_rest::measure_at_rest). The trees keep them.
#[derive(Debug, Default)]
pub struct AtRestState {
    /// Those of the first tree, by the number of threads and the second tree, with which it is measured in turn.
    pub readings: Study<(usize, Option<OtherTree>), ()>,
    /// The user has just pressed or moved something.
    pub is_disturbed: bool,
    /// None are taken, for tests of other things.
    pub is_off: bool,
}

impl AtRestState {
    /// Readings may be taken now, where building and tracing are `idle`.
    pub const fn may_measure(&self, idle: bool) -> bool {
        idle && !self.is_disturbed && !self.is_off
    }
}
