//! What rays are traced against: a tree with its triangles in leaf order, the inputs that it was made from and its report.

use std::sync::{Arc, Mutex, OnceLock, Weak};
use std::time::Duration;

use crate::budget::Budget;
use crate::scene::Scene;
use bvhscope_engine::build_cache::{BuildCache, NodeRecycler};
use bvhscope_engine::tree::Tree;
use bvhscope_engine::tree::ancestry::{Ancestry, path_to_primitive};
use bvhscope_engine::tree::overlap::end_point_overlap;
use bvhscope_engine::tree::traverse;
use bvhscope_engine::tree::traverse::{Probe, Traversal};
use bvhscope_engine::with_tree;
use bvhscope_engine::{
    AnyTree, BinaryBvh, BuildError, BuildReport, BuildSettings, CancelToken, Cancelled, Hit, Pass, Passes, Ray,
    Triangle, WideBvh,
};

/// Triangles sampled for the end-point overlap of a large scene.
const EPO_SAMPLES: usize = 2_000;

/// Memory that a build and what is derived from its tree hold at once. `tests/memory/peak.rs` measures the peak of the process beyond
/// the scene: 158 a triangle for boxes by AAC, 171 by binned SAH, nodes' parents and counts included. The overlay's lists and
/// the parts of pages that are never filled are the rest.
pub const BUILD_BYTES_PER_TRIANGLE: u64 = 220;
/// More that the passes over the finished tree hold: all of them raised the peak by 98 a triangle on the dragon.
const OPTIMIZE_BYTES_PER_TRIANGLE: u64 = 100;

/// More that fragments hold: 1.1 a triangle with 40 bytes each, as they are made and in one list, and as much more tree.
const SPLIT_BYTES_PER_TRIANGLE: u64 = 120;

/// Time between two looks whether another thread has made the wide tree.
const WIDENING_LOOK: Duration = Duration::from_millis(1);

/// A built tree, ready to be traced.
#[derive(Debug)]
pub struct Accel {
    /// The scene that it was built from.
    pub scene: Arc<Scene>,
    /// The settings that it was built with.
    pub settings: BuildSettings,
    /// The hierarchy.
    pub tree: AnyTree,
    /// Where the time went and what came out.
    pub report: BuildReport,
    wide: OnceLock<WideBvh>,
    /// Held by who makes the wide tree in [`Accel::widen`].
    widening: Mutex<()>,
    /// What nobody needs for the first picture, made when someone asks.
    leaf_triangles: OnceLock<Vec<Triangle>>,
    epo: OnceLock<f32>,
    ancestry: OnceLock<Ancestry>,
    /// Takes the memory of the tree for the next build of the session.
    recycler: NodeRecycler,
}

/// A sequence of builds of the same scene, such as while a slider is dragged: each reuses the sorted primitives and the memory of
/// the ones before. A build of another scene starts over. Holds up to 92 bytes per triangle between builds.
#[derive(Default)]
pub struct BuildSession {
    scene: Weak<Scene>,
    cache: BuildCache,
}

impl BuildSession {
    /// The cache of the builds of `scene`, emptied first if the last build was of another scene.
    fn cache_for(&mut self, scene: &Arc<Scene>) -> &mut BuildCache {
        if !std::ptr::eq(self.scene.as_ptr(), Arc::as_ptr(scene)) {
            *self = Self { scene: Arc::downgrade(scene), cache: BuildCache::default() };
        }
        &mut self.cache
    }
}

/// Gives the tree's memory to the next build of the session.
impl Drop for Accel {
    fn drop(&mut self) {
        let tree = std::mem::replace(&mut self.tree, AnyTree::Aabb(Tree::EMPTY));
        with_tree!(tree, tree => self.recycler.recycle(tree));
    }
}

impl Accel {
    /// Builds the tree of `scene` and the wide one in the calling thread's rayon pool. In debug builds the result passes the
    /// validator.
    pub fn build(scene: &Arc<Scene>, settings: &BuildSettings, token: &CancelToken) -> Result<Self, BuildError> {
        let accel = Self::build_binary(scene, settings, token)?;
        accel.widen(token)?;
        Ok(accel)
    }

    /// [`Accel::build`] without the wide tree, which then is made when it is asked for.
    pub fn build_binary(scene: &Arc<Scene>, settings: &BuildSettings, token: &CancelToken) -> Result<Self, BuildError> {
        Self::build_with_session(scene, settings, None, token)
    }

    /// [`Accel::build_binary`] that reuses intermediate results of earlier builds of the `session`: the same tree, sooner.
    pub fn build_with_session(
        scene: &Arc<Scene>,
        settings: &BuildSettings,
        mut session: Option<&mut BuildSession>,
        token: &CancelToken,
    ) -> Result<Self, BuildError> {
        let passes = settings.passes();
        let split = if passes.contains(Pass::Split) { SPLIT_BYTES_PER_TRIANGLE } else { 0 };
        let finished = if passes.without(Pass::Split) == Passes::NONE { 0 } else { OPTIMIZE_BYTES_PER_TRIANGLE };
        let passes = split + finished;
        let bytes = scene.triangles.len() as u64 * (BUILD_BYTES_PER_TRIANGLE + passes);
        let mut room = Budget::of_process().check("the tree", bytes);
        if let (Err(_), Some(session)) = (&room, &mut session) {
            // What earlier builds left may be what is missing.
            **session = BuildSession::default();
            room = Budget::of_process().check("the tree", bytes);
        }
        room.map_err(|error| BuildError::Refused(error.to_string()))?;
        let cache = session.map(|session| session.cache_for(scene));
        let recycler = cache.as_ref().map(|cache| cache.recycler()).unwrap_or_default();
        let BinaryBvh { tree, report } = BinaryBvh::build_with_cache(&scene.triangles, settings, cache, token)?;
        Ok(Self {
            scene: Arc::clone(scene),
            settings: *settings,
            tree,
            report,
            wide: OnceLock::new(),
            widening: Mutex::new(()),
            leaf_triangles: OnceLock::new(),
            epo: OnceLock::new(),
            ancestry: OnceLock::new(),
            recycler,
        })
    }

    /// The wide tree, made when asked for the first time. Threads that ask for a missing one at once each make it: better
    /// call [`Accel::widen`] before.
    pub fn wide(&self) -> &WideBvh {
        if let Some(wide) = self.wide.get() {
            return wide;
        }
        // Not within the lock, which a thread that waits for the others here could want once more.
        match WideBvh::new(&self.tree, &self.scene.triangles, &CancelToken::new()) {
            Ok(wide) => self.wide.get_or_init(|| wide),
            Err(Cancelled { .. }) => unreachable!("nobody else has this token"),
        }
    }

    /// The wide tree where it has been made.
    pub fn known_wide(&self) -> Option<&WideBvh> {
        self.wide.get()
    }

    /// Makes the wide tree in the calling thread's rayon pool unless it is there; waits where another pool is at it. Not for
    /// parallel loops, whose threads could wait for themselves.
    pub fn widen(&self, token: &CancelToken) -> Result<&WideBvh, Cancelled> {
        loop {
            if let Some(wide) = self.wide.get() {
                return Ok(wide);
            }
            if let Ok(_maker) = self.widening.try_lock() {
                let wide = WideBvh::new(&self.tree, &self.scene.triangles, token)?;
                return Ok(self.wide.get_or_init(|| wide));
            }
            token.check()?;
            std::thread::sleep(WIDENING_LOOK);
        }
    }

    /// The triangles in leaf order, so that a leaf's range indexes them directly: what the binary tree is traced with. Copied
    /// when asked for the first time.
    pub fn leaf_triangles(&self) -> &[Triangle] {
        if let Some(triangles) = self.leaf_triangles.get() {
            return triangles;
        }
        match self.leaf_triangles_unless(&CancelToken::new()) {
            Ok(triangles) => triangles,
            Err(Cancelled { .. }) => unreachable!("nobody else has this token"),
        }
    }

    /// [`Accel::leaf_triangles`], unless `token` is cancelled.
    pub fn leaf_triangles_unless(&self, token: &CancelToken) -> Result<&[Triangle], Cancelled> {
        if let Some(triangles) = self.leaf_triangles.get() {
            return Ok(triangles);
        }
        // Not within the lock, which a thread that waits for the others here could want once more.
        let triangles = self.tree.leaf_triangles(&self.scene.triangles, token)?;
        Ok(self.leaf_triangles.get_or_init(|| triangles))
    }

    /// Makes what [`Accel::ancestry`] and [`Accel::epo`] tell, unless `token` is cancelled.
    pub fn study(&self, token: &CancelToken) -> Result<(), Cancelled> {
        self.compute_ancestry(token)?;
        self.epo(token).map(|_| ())
    }

    /// Makes what [`Accel::ancestry`] tells, unless `token` is cancelled.
    pub fn compute_ancestry(&self, token: &CancelToken) -> Result<&Ancestry, Cancelled> {
        if let Some(ancestry) = self.known_ancestry() {
            return Ok(ancestry);
        }
        let ancestry = with_tree!(&self.tree, tree => Ancestry::new(tree, token))?;
        Ok(self.ancestry.get_or_init(|| ancestry))
    }

    /// The nearest hit, through the wide tree with the best vector instructions of this machine. See [`Accel::wide`] for
    /// other levels.
    pub fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        self.wide().closest_hit(ray)
    }

    /// The nearest hits of `rays`, into the first elements of `hits`. Fastest where the rays come from one point in similar
    /// directions and neighbours stand together in eights, such as a camera's tile of 16×16 rays in Z order.
    pub fn closest_hits(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        self.wide().closest_hits(rays, hits);
    }

    /// The nearest hit through the binary tree in the chosen order, watched by `probe`: the same hit.
    pub fn closest_hit_with<P: Probe>(&self, ray: &Ray, traversal: Traversal, probe: &mut P) -> Option<Hit> {
        with_tree!(&self.tree, tree => traverse::closest_hit(tree, self.leaf_triangles(), ray, traversal, probe))
    }

    /// Whether anything lies on `ray` between its `t_min` and `t_max`.
    pub fn any_hit(&self, ray: &Ray) -> bool {
        self.wide().any_hit(ray)
    }

    /// Whether anything lies on each of `rays`, into the first elements of `blocked`: faster than ray by ray.
    pub fn any_hits(&self, rays: &[Ray], blocked: &mut [bool]) {
        self.wide().any_hits(rays, blocked);
    }

    /// The leaf that holds the triangle `primitive_index` and the path to it: node indices from the root to the leaf.
    /// Empty where there is no such triangle.
    pub fn path_to(&self, primitive_index: u32) -> Vec<u32> {
        let Some(triangle) = self.scene.triangles.get(primitive_index as usize) else { return Vec::new() };
        with_tree!(&self.tree, tree => path_to_primitive(tree, triangle, primitive_index))
    }

    /// End-point overlap, estimated from a sample on large scenes, unless `token` is cancelled. When asked for the first time, it
    /// takes some tens of milliseconds on a million triangles, and minutes where all lie on one another; see
    /// [`Accel::known_epo`] for a UI thread.
    pub fn epo(&self, token: &CancelToken) -> Result<f32, Cancelled> {
        if let Some(epo) = self.known_epo() {
            return Ok(epo);
        }
        let epo = end_point_overlap(&self.tree, &self.scene.triangles, EPO_SAMPLES, token)?;
        Ok(*self.epo.get_or_init(|| epo))
    }

    /// End-point overlap where [`Accel::epo`] has computed it already.
    pub fn known_epo(&self) -> Option<f32> {
        self.epo.get().copied()
    }

    /// Parents and primitive counts of all nodes where they have been read.
    pub fn known_ancestry(&self) -> Option<&Ancestry> {
        self.ancestry.get()
    }

    /// Parents and primitive counts of all nodes. Reads the whole tree when asked for the first time: not for a UI frame.
    pub fn ancestry(&self) -> &Ancestry {
        match self.compute_ancestry(&CancelToken::new()) {
            Ok(ancestry) => ancestry,
            Err(Cancelled { .. }) => unreachable!("nobody else has this token"),
        }
    }
}
