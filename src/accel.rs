//! The tree of a scene, ready to be traced: the inputs that it was built from, its report, and what is derived from it on
//! request.

mod copy_tracer;
mod file_tree;
mod follow;
pub mod followed;
pub mod laid;
pub mod node_values;
mod read;
mod reading;
mod trace;
pub mod tracer;
mod two_levels;
pub mod written;

use std::sync::{Arc, Mutex, OnceLock, PoisonError, Weak};
use std::time::{Duration, Instant};

use bvhscope_engine::build_cache::{BuildCache, NodeRecycler};
use bvhscope_engine::construction::{BYTES_PER_TRIANGLE, RegretLimits, Regrets, regrets};
use bvhscope_engine::fingerprint;
use bvhscope_engine::tree::ancestry::{Ancestry, path_to_primitive};
use bvhscope_engine::tree::overlap::{EndPointOverlap, end_point_overlap};
use bvhscope_engine::tree::statistics::tree_stats;
use bvhscope_engine::tree::visits::RayQuery;
use bvhscope_engine::tree::{ContainerKind, Tree};
use bvhscope_engine::with_tree;
use bvhscope_engine::{
    AnyTree, BinaryBvh, BuildError, BuildReport, BuildSettings, BuilderKind, CancelToken, Cancelled, LevelNode, Pass,
    Passes, Ray, Triangle, WideBvh,
};

use crate::budget::Budget;
use crate::catalog::reading::{EnteringReading, Times};
use crate::scene::Scene;

pub use file_tree::FileTree;
pub use follow::Follow;
pub use two_levels::{MeshTrees, TwoLevels};

/// Peak memory per triangle of a build and of what is derived from its tree. `tests/memory/peak.rs` measures the peak of the
/// process beyond the scene: 158 bytes per triangle for boxes by AAC, 171 by binned SAH, ancestry included. The rest is for the
/// overlay's lists and for pages that are partly filled. Nodes of polytopes have 64 bytes instead of 32: 267 by LBVH.
pub const fn build_bytes_per_triangle(container: ContainerKind) -> u64 {
    match container {
        ContainerKind::Aabb | ContainerKind::Sphere => 220,
        // Nodes of oriented boxes have 92 bytes, and wide ones 704.
        ContainerKind::Dop14 => 340,
        ContainerKind::Oriented => 560,
    }
}

/// Additional peak of the passes over the finished tree: all of them together raised it by 98 bytes per triangle on the dragon.
const OPTIMIZE_BYTES_PER_TRIANGLE: u64 = 100;

/// Additional peak of splitting: 1.1 references per triangle of 40 bytes each, held twice while they are joined into one list,
/// and a larger tree.
const SPLIT_BYTES_PER_TRIANGLE: u64 = 120;
/// Additional peak of spatial splits, which may double the references: 252 bytes per triangle were measured in all where few triangles are
/// cut, and 313 with 1.91 references per triangle, as many with passes over the tree.
const SBVH_BYTES_PER_TRIANGLE: u64 = 140;
/// Additional peak of annealing, which takes 1.1 times two nodes of 64 bytes a triangle: with splitting and the other passes, 376
/// bytes per triangle were measured in all.
const ANNEAL_BYTES_PER_TRIANGLE: u64 = 80;

/// Additional peak of choosing oriented boxes: for each node its extreme corners in 56 bytes and the range of its triangles in 8, beside
/// both trees.
const ORIENT_BYTES_PER_TRIANGLE: u64 = 200;

/// Peak memory per triangle of a build with `settings` and of what is derived from its tree.
pub fn peak_bytes_per_triangle(settings: &BuildSettings) -> u64 {
    let passes = settings.passes();
    let of_pass = |is_wanted: bool, bytes: u64| if is_wanted { bytes } else { 0 };
    build_bytes_per_triangle(settings.tree_container())
        + of_pass(passes.contains(Pass::Orient), ORIENT_BYTES_PER_TRIANGLE)
        + of_pass(settings.builder == BuilderKind::Sbvh, SBVH_BYTES_PER_TRIANGLE)
        + of_pass(passes.contains(Pass::Split), SPLIT_BYTES_PER_TRIANGLE)
        + of_pass(passes.without(Pass::Split).without(Pass::Orient) != Passes::NONE, OPTIMIZE_BYTES_PER_TRIANGLE)
        + of_pass(passes.contains(Pass::Anneal), ANNEAL_BYTES_PER_TRIANGLE)
}

/// Why there can be no tree with `settings` over copies of meshes; `None` where there can.
fn refusal_of_copies(settings: &BuildSettings) -> Option<String> {
    let passes = settings.passes();
    let needing_triangles = [Pass::Split, Pass::Orient].into_iter().find(|pass| passes.contains(*pass));
    let reason = match (settings.container, needing_triangles) {
        (ContainerKind::Aabb, None) if settings.builder.needs_triangles() => {
            format!("the builder '{}' works on triangles, not on copies", settings.builder.name())
        }
        (ContainerKind::Aabb, None) => return None,
        (ContainerKind::Aabb, Some(pass)) => format!("the pass '{}' works on triangles, not on copies", pass.name()),
        (container, _) => format!("copies have boxes, not {}", container.plural()),
    };
    Some(format!("{reason}; choose another, or load the scene with --instances flat"))
}

/// A ray by its index, with its purpose and the number of rays that it stands for.
pub type WeightedRay<'a> = &'a (dyn Fn(u32) -> (Ray, RayQuery, u32) + Sync);

/// Interval at which a thread checks whether another has made the wide tree.
const WIDENING_POLL_INTERVAL: Duration = Duration::from_millis(1);

/// The tree of a scene, ready to be traced.
#[derive(Debug)]
pub struct Accel {
    /// The scene that it was built from.
    pub scene: Arc<Scene>,
    /// The settings that it was built with.
    pub settings: BuildSettings,
    /// The hierarchy.
    pub tree: AnyTree,
    /// Times, statistics and sizes.
    pub report: BuildReport,
    /// The file that the tree comes from; `None` for a tree that was built here.
    pub file: Option<FileTree>,
    /// How the tree of a moment was made; normal for all others.
    pub follow: Follow,
    /// Surface area of each node when it was built, where the tree has kept its nodes since.
    built_areas: Option<Arc<Vec<f32>>>,
    wide: OnceLock<Arc<WideBvh>>,
    /// Both levels of a scene of copies, above and below the tree over them; `None` for a flat scene.
    levels: Option<TwoLevels>,
    /// Locked by the thread that makes the wide tree in [`Accel::widen`].
    widening: Mutex<()>,
    // Derived on request, because the first picture needs none of it.
    leaf_triangles: OnceLock<Vec<Triangle>>,
    epo: OnceLock<EndPointOverlap>,
    hash: OnceLock<u64>,
    at_rest: Mutex<Option<Arc<RestReadings>>>,
    entering: OnceLock<Option<EnteringReading>>,
    estimate: OnceLock<Option<EnteringReading>>,
    ancestry: OnceLock<Ancestry>,
    regrets: OnceLock<Regrets>,
    /// Takes the memory of the tree for the next build of the session.
    recycler: NodeRecycler,
}

/// Readings of a tree that were taken at rest, in rounds.
#[derive(Debug, Clone, PartialEq)]
pub struct RestReadings {
    /// Identifies the session: trees of one were measured in turn.
    pub session: u64,
    /// Repeated builds; `None` where they cannot be repeated.
    pub builds: Option<WholeBuilds>,
    /// Number of primary rays of the measuring view.
    pub rays: u64,
    /// Times of tracing them through the wide tree, without shading.
    pub traces: Times,
    /// Time of each round in milliseconds.
    pub trace_rounds: Vec<f64>,
}

/// Repeated builds of a tree, none of which reused anything.
#[derive(Debug, Clone, PartialEq)]
pub struct WholeBuilds {
    /// Times of the builds.
    pub times: Times,
    /// Time of each round in milliseconds.
    pub rounds: Vec<f64>,
    /// Name and duration of each stage in the build of median time.
    pub stages: Vec<(&'static str, Duration)>,
}

/// A sequence of builds of the same scene, such as while a slider is dragged: each reuses the sorted primitives and the memory
/// of the ones before. A build of another scene starts over, but for the trees of meshes, which moments of a scene of copies share. Holds up to
/// 92 bytes per triangle between builds.
#[derive(Default)]
pub struct BuildSession {
    scene: Weak<Scene>,
    cache: BuildCache,
    meshes: MeshTrees,
}

impl BuildSession {
    /// The cache of the builds of `scene`, emptied first if the last build was of another scene.
    fn cache_for(&mut self, scene: &Arc<Scene>) -> &mut BuildCache {
        if !is_same(&self.scene, scene) {
            (self.scene, self.cache) = (Arc::downgrade(scene), BuildCache::default());
        }
        &mut self.cache
    }

    /// Frees what is held for another build of the same scene.
    pub fn forget_scene(&mut self) {
        (self.scene, self.cache) = (Weak::new(), BuildCache::default());
    }
}

/// Whether `known` is `current`. A dropped value equals none.
pub fn is_same<T>(known: &Weak<T>, current: &Arc<T>) -> bool {
    std::ptr::eq(known.as_ptr(), Arc::as_ptr(current))
}

/// Whether both are the same value or none.
pub fn are_same<T>(a: Option<&Arc<T>>, b: Option<&Arc<T>>) -> bool {
    a.map(Arc::as_ptr) == b.map(Arc::as_ptr)
}

/// Gives the tree's memory to the next build of the session.
impl Drop for Accel {
    fn drop(&mut self) {
        let tree = std::mem::replace(&mut self.tree, AnyTree::Aabb(Tree::EMPTY));
        with_tree!(tree, tree => self.recycler.recycle(tree));
    }
}

impl Accel {
    /// Builds the binary tree of `scene` and the wide one in the calling thread's rayon pool. Debug builds validate the result.
    pub fn build(scene: &Arc<Scene>, settings: &BuildSettings, token: &CancelToken) -> Result<Self, BuildError> {
        let accel = Self::build_binary(scene, settings, token)?;
        accel.widen(token)?;
        Ok(accel)
    }

    /// Why there can be no tree of `scene` with `settings`, where it is the scene that cannot have it.
    pub fn refusal(scene: &Scene, settings: &BuildSettings) -> Option<String> {
        scene.copies.as_ref().and_then(|_| refusal_of_copies(settings))
    }

    /// Refuses a tree of `scene` with `settings` that memory does not suffice for.
    pub fn check_memory(scene: &Scene, settings: &BuildSettings) -> Result<(), BuildError> {
        let bytes = scene.built_triangles().len() as u64 * peak_bytes_per_triangle(settings);
        Budget::of_process().check("the tree", bytes).map_err(|error| BuildError::Refused(error.to_string()))
    }

    /// [`Accel::build`] without the wide tree, which then is made on request.
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
        let mut meshes = session.as_mut().map(|session| std::mem::take(&mut session.meshes)).unwrap_or_default();
        let built = Self::build_above(scene, settings, session.as_deref_mut(), &mut meshes, token);
        if let Some(session) = session {
            session.meshes = meshes;
        }
        built
    }

    /// [`Accel::build_with_session`] above trees of `meshes`, which are built where they are others.
    fn build_above(
        scene: &Arc<Scene>,
        settings: &BuildSettings,
        mut session: Option<&mut BuildSession>,
        meshes: &mut MeshTrees,
        token: &CancelToken,
    ) -> Result<Self, BuildError> {
        if let Some(reason) = Self::refusal(scene, settings) {
            return Err(BuildError::Refused(reason));
        }
        let mut within_budget = Self::check_memory(scene, settings);
        if let (Err(_), Some(session)) = (&within_budget, &mut session) {
            // The cache of earlier builds may hold the memory that is missing.
            **session = BuildSession::default();
            within_budget = Self::check_memory(scene, settings);
        }
        within_budget?;
        let cache = session.map(|session| session.cache_for(scene));
        let recycler = cache.as_ref().map(|cache| cache.recycler()).unwrap_or_default();
        let BinaryBvh { tree, mut report } =
            BinaryBvh::build_with_cache(scene.built_triangles(), settings, cache, token)?;
        let Some(copies) = &scene.copies else { return Ok(Self::new(scene, settings, tree, report, recycler)) };
        let wide = Arc::new(WideBvh::new(&tree, scene.built_triangles(), token)?);
        let start = Instant::now();
        let meshes = meshes.of(copies, settings, token)?;
        report.add_stage("meshes", start.elapsed());
        let accel = Self::new(scene, settings, tree, report, recycler);
        accel.above(TwoLevels::over(copies, meshes, &wide)?, wide, token)
    }

    /// The tree over the copies, with `wide`, above the trees of the meshes, which go on below the copies that the scene unfolds.
    fn above(mut self, mut levels: TwoLevels, wide: Arc<WideBvh>, token: &CancelToken) -> Result<Self, BuildError> {
        let tree = std::mem::replace(&mut self.tree, AnyTree::Aabb(Tree::EMPTY));
        self.tree = levels.unfold(tree, &self.scene.unfolded.copies, token)?;
        if levels.unfolded().is_some() {
            (self.report.stats, self.report.tree_bytes) = (tree_stats(&self.tree, token)?, self.tree.bytes());
        }
        (self.wide, self.levels) = (wide.into(), Some(levels));
        Ok(self)
    }

    /// [`Accel::build_binary`] of a scene of copies whose rays go through a tree over parts of them, up to `open` for each. Its stages are
    /// those of what they go through; nodes and statistics remain those of the tree over whole copies, which has them.
    pub fn build_opened(
        scene: &Arc<Scene>,
        settings: &BuildSettings,
        open: f32,
        token: &CancelToken,
    ) -> Result<Self, BuildError> {
        let mut accel = Self::build_binary(scene, settings, token)?;
        let Some(levels) = &accel.levels else { return Ok(accel) };
        let start = Instant::now();
        let levels = levels.opened(settings, open, token)?;
        let took = start.elapsed().saturating_sub(levels.wide().top().collapse_time);
        accel.report.keep_stage("meshes");
        accel.report.add_stage("parts", took);
        accel.levels = Some(levels);
        Ok(accel)
    }

    /// The wide tree that rays enter first: of a scene of copies that over them or over parts of them.
    pub fn entered_first(&self) -> &WideBvh {
        self.levels.as_ref().map_or_else(|| self.wide(), |levels| levels.wide().top())
    }

    /// Bytes of what rays read: the wide trees, and of two levels the places of the copies.
    pub fn traced_bytes(&self) -> usize {
        let flat = || self.wide().tree.node_bytes() + self.wide().tree.leaf_bytes();
        self.levels.as_ref().map_or_else(flat, |levels| levels.wide().bytes())
    }

    /// A tree over `scene` that was made elsewhere, of any arity, such as one before its passes. Its times are zero.
    pub fn with_tree(
        scene: &Arc<Scene>,
        settings: &BuildSettings,
        tree: AnyTree,
        token: &CancelToken,
    ) -> Result<Self, Cancelled> {
        let report = BuildReport::of_tree(&tree, &scene.triangles, token)?;
        Ok(Self::new(scene, settings, tree, report, NodeRecycler::default()))
    }

    fn new(
        scene: &Arc<Scene>,
        settings: &BuildSettings,
        tree: AnyTree,
        report: BuildReport,
        recycler: NodeRecycler,
    ) -> Self {
        Self {
            scene: Arc::clone(scene),
            settings: *settings,
            tree,
            report,
            file: None,
            follow: Follow::default(),
            built_areas: None,
            wide: OnceLock::new(),
            levels: None,
            widening: Mutex::new(()),
            leaf_triangles: OnceLock::new(),
            epo: OnceLock::new(),
            hash: OnceLock::new(),
            at_rest: Mutex::default(),
            entering: OnceLock::new(),
            estimate: OnceLock::new(),
            ancestry: OnceLock::new(),
            regrets: OnceLock::new(),
            recycler,
        }
    }

    /// The copy and the node in the tree of its mesh that a node stands for; `None` for nodes above the meshes, and in flat scenes.
    pub fn node_of_mesh(&self, node: u32) -> Option<(u32, u32)> {
        match self.levels.as_ref()?.unfolded()?.origins.get(node as usize)? {
            LevelNode::Above { .. } => None,
            LevelNode::Below { copy, node } => Some((*copy, *node)),
        }
    }

    /// The node that holds a copy: its leaf, or the root of its mesh where that is unfolded; `None` of a flat scene.
    pub fn node_of_copy(&self, copy: u32) -> Option<u32> {
        let root = self.levels.as_ref()?.unfolded().and_then(|unfolded| unfolded.root_of(copy));
        root.or_else(|| self.path_to(copy).last().copied())
    }

    /// The number that the author of the tree's file gave to a copy; `None` where the file has none.
    pub fn copy_id(&self, copy: u32) -> Option<u32> {
        self.file.as_ref()?.ids.as_ref()?.get(copy as usize).copied()
    }

    /// Both levels of a scene of copies; `None` for a flat scene.
    pub fn levels(&self) -> Option<&TwoLevels> {
        self.levels.as_ref()
    }

    /// Whether the tree follows a moving model and was built at another moment.
    pub fn is_followed(&self) -> bool {
        self.follow != Follow::default()
    }

    /// Surface area of each node when it was built; `None` of a tree that was built as it is, or has other nodes since.
    pub fn built_areas(&self) -> Option<&[f32]> {
        self.built_areas.as_deref().map(Vec::as_slice)
    }

    /// The wide tree, made on the first request. Threads that request it at the same time each make it: call [`Accel::widen`]
    /// before.
    pub fn wide(&self) -> &WideBvh {
        if let Some(wide) = self.wide.get() {
            return wide;
        }
        // Not under the lock: a thread that waits for rayon tasks here may run one that requests the wide tree too.
        match WideBvh::new(&self.tree, &self.scene.triangles, &CancelToken::new()) {
            Ok(wide) => self.wide.get_or_init(|| Arc::new(wide)),
            Err(Cancelled { .. }) => unreachable!("this token is never cancelled"),
        }
    }

    /// The wide tree, if it has been made.
    pub fn known_wide(&self) -> Option<&WideBvh> {
        self.wide.get().map(Arc::as_ref)
    }

    /// Makes the wide tree in the calling thread's rayon pool, or waits for another thread that is making it. Not for use in
    /// parallel loops, where a thread could wait for itself.
    pub fn widen(&self, token: &CancelToken) -> Result<&WideBvh, Cancelled> {
        loop {
            if let Some(wide) = self.wide.get() {
                return Ok(wide);
            }
            if let Ok(_maker) = self.widening.try_lock() {
                let wide = WideBvh::new(&self.tree, &self.scene.triangles, token)?;
                return Ok(self.wide.get_or_init(|| Arc::new(wide)));
            }
            token.check()?;
            std::thread::sleep(WIDENING_POLL_INTERVAL);
        }
    }

    /// The triangles in leaf order, with which the tree is traced. Copied on the first request.
    pub fn leaf_triangles(&self) -> &[Triangle] {
        if let Some(triangles) = self.leaf_triangles.get() {
            return triangles;
        }
        match self.compute_leaf_triangles(&CancelToken::new()) {
            Ok(triangles) => triangles,
            Err(Cancelled { .. }) => unreachable!("this token is never cancelled"),
        }
    }

    /// [`Accel::leaf_triangles`] that can be cancelled.
    pub fn compute_leaf_triangles(&self, token: &CancelToken) -> Result<&[Triangle], Cancelled> {
        if let Some(triangles) = self.leaf_triangles.get() {
            return Ok(triangles);
        }
        // Outside of `get_or_init`: a thread that waits for rayon tasks here may run one that requests the triangles too.
        let triangles = self.tree.leaf_triangles(&self.scene.triangles, token)?;
        Ok(self.leaf_triangles.get_or_init(|| triangles))
    }

    /// Computes [`Accel::ancestry`], [`Accel::hash`] and the exact [`Accel::epo`].
    pub fn compute_derived(&self, token: &CancelToken) -> Result<(), Cancelled> {
        self.compute_ancestry(token)?;
        self.hash(token)?;
        self.epo(None, token).map(|_| ())
    }

    /// [`Accel::ancestry`] that can be cancelled.
    pub fn compute_ancestry(&self, token: &CancelToken) -> Result<&Ancestry, Cancelled> {
        if let Some(ancestry) = self.known_ancestry() {
            return Ok(ancestry);
        }
        let ancestry = with_tree!(&self.tree, tree => Ancestry::new(tree, token))?;
        Ok(self.ancestry.get_or_init(|| ancestry))
    }

    /// Hash of the binary tree, computed on the first request: the same on every machine.
    pub fn hash(&self, token: &CancelToken) -> Result<u64, Cancelled> {
        if let Some(hash) = self.known_hash() {
            return Ok(hash);
        }
        let hash = fingerprint::of_tree(&self.tree, token)?;
        Ok(*self.hash.get_or_init(|| hash))
    }

    /// The hash, if it has been computed.
    pub fn known_hash(&self) -> Option<u64> {
        self.hash.get().copied()
    }

    /// The newest readings at rest; `None` until they were taken.
    pub fn at_rest(&self) -> Option<Arc<RestReadings>> {
        self.at_rest.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Keeps readings at rest in place of older ones.
    pub fn keep_at_rest(&self, readings: RestReadings) {
        *self.at_rest.lock().unwrap_or_else(PoisonError::into_inner) = Some(Arc::new(readings));
    }

    /// Repeated builds with its settings, none of which reused anything; `None` until they were measured.
    pub fn whole_builds(&self) -> Option<WholeBuilds> {
        self.at_rest()?.builds.clone()
    }

    /// Name and duration of each stage that ran: of the median of whole builds once they were measured, before that of its own build.
    pub fn stages(&self) -> Vec<(&'static str, Duration)> {
        self.whole_builds().map_or_else(|| self.report.stages.stages.clone(), |builds| builds.stages)
    }

    /// Names of the stages of [`Accel::stages`] that reused the result of an earlier build instead of running.
    pub fn reused_stages(&self) -> &[&'static str] {
        if self.whole_builds().is_some() { &[] } else { &self.report.stages.reused }
    }

    /// Counts of a ray that enters the scene's box in the measuring view; `None` until they were counted, and where no ray does.
    pub fn entering(&self) -> Option<EnteringReading> {
        self.entering.get().copied().flatten()
    }

    /// Keeps the counts of a ray that enters the scene's box, `None` where no ray does. The first ones are kept.
    pub fn keep_entering(&self, counts: Option<EnteringReading>) {
        self.entering.get_or_init(|| counts);
    }

    /// The same by fewer rays of that view, which are counted in a moment; `None` until they were, and where no ray does.
    pub fn entering_estimate(&self) -> Option<EnteringReading> {
        self.estimate.get().copied().flatten()
    }

    /// Whether [`Accel::keep_estimate`] was called.
    pub fn is_estimated(&self) -> bool {
        self.estimate.get().is_some()
    }

    /// Keeps the counts by fewer rays, `None` where none enters the scene's box. The first ones are kept.
    pub fn keep_estimate(&self, counts: Option<EnteringReading>) {
        self.estimate.get_or_init(|| counts);
    }

    /// Indices of the nodes from the root to the leaf that holds the triangle `primitive_index`. Empty where there is no such
    /// triangle.
    pub fn path_to(&self, primitive_index: u32) -> Vec<u32> {
        let Some(triangle) = self.scene.triangles.get(primitive_index as usize) else { return Vec::new() };
        with_tree!(&self.tree, tree => path_to_primitive(tree, triangle, primitive_index))
    }

    /// End-point overlap: exact, or on request estimated from that many samples, unless it is known already. The first request takes
    /// about as long as a build; a UI thread uses [`Accel::known_epo`].
    ///
    /// `None` where there is none, see [`Accel::has_epo`].
    pub fn epo(&self, samples: Option<usize>, token: &CancelToken) -> Result<Option<EndPointOverlap>, Cancelled> {
        if self.known_epo().is_none() && self.has_epo() {
            let epo = end_point_overlap(&self.tree, &self.scene.triangles, samples.unwrap_or(usize::MAX), token)?;
            self.epo.get_or_init(|| epo);
        }
        Ok(self.known_epo())
    }

    /// Whether the tree has an end-point overlap: one over copies does not have their surface.
    pub const fn has_epo(&self) -> bool {
        self.levels.is_none()
    }

    /// End-point overlap, if [`Accel::epo`] has computed it.
    pub fn known_epo(&self) -> Option<EndPointOverlap> {
        self.epo.get().copied()
    }

    /// Parents and primitive counts of all nodes, if they have been computed.
    pub fn known_ancestry(&self) -> Option<&Ancestry> {
        self.ancestry.get()
    }

    /// Savings from rebuilding each subtree, computed on the first request: some seconds for large trees. Subtrees that memory does
    /// not suffice for are left out.
    pub fn compute_regrets(&self, token: &CancelToken) -> Result<&Regrets, Cancelled> {
        if let Some(regrets) = self.known_regrets() {
            return Ok(regrets);
        }
        let triangles = (Budget::of_process().allowance() / BYTES_PER_TRIANGLE) as usize;
        let limits = RegretLimits { triangles, ..RegretLimits::default() };
        let regrets = regrets(&self.tree, &self.scene.triangles, limits, token)?;
        Ok(self.regrets.get_or_init(|| regrets))
    }

    /// Savings from rebuilding each subtree, if [`Accel::compute_regrets`] has computed them.
    pub fn known_regrets(&self) -> Option<&Regrets> {
        self.regrets.get()
    }

    /// Parents and primitive counts of all nodes. The first request reads the whole tree: not for a UI frame.
    pub fn ancestry(&self) -> &Ancestry {
        match self.compute_ancestry(&CancelToken::new()) {
            Ok(ancestry) => ancestry,
            Err(Cancelled { .. }) => unreachable!("this token is never cancelled"),
        }
    }
}
