//! What rays are traced against: a tree with its triangles in leaf order, the inputs that it was made from and its report.

use std::sync::{Arc, Mutex, OnceLock, Weak};
use std::time::{Duration, Instant};

use fearless_simd::Level;

use crate::budget::Budget;
use crate::scene::Scene;
use bvhscope_engine::build_cache::{BuildCache, NodeRecycler};
use bvhscope_engine::builders::{BuildError, build_with_cache};
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::{Hit, Ray, Triangle};
use bvhscope_engine::kernel::par_collect;
use bvhscope_engine::settings::{BuildSettings, Pass, Passes};
use bvhscope_engine::stage_times::StageTimes;
use bvhscope_engine::tree::ancestry::{Ancestry, path_to_primitive};
use bvhscope_engine::tree::overlap::end_point_overlap;
use bvhscope_engine::tree::statistics::{TreeStats, tree_stats};
use bvhscope_engine::tree::traverse;
use bvhscope_engine::tree::traverse::{Probe, Traversal};
use bvhscope_engine::tree::{AnyTree, Tree};
use bvhscope_engine::wide::collapse;
use bvhscope_engine::wide::tree::AnyWideTree;
use bvhscope_engine::with_tree;

/// Triangles sampled for the end-point overlap of a large scene.
const EPO_SAMPLES: usize = 2_000;

/// Memory that a build and what is derived from its tree hold at once. `tests/memory.rs` measures the peak of the process beyond
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
    wide: OnceLock<Wide>,
    /// Held by who makes the wide tree in [`Accel::widen`].
    widening: Mutex<()>,
    /// What nobody needs for the first picture, made when someone asks.
    leaf_triangles: OnceLock<Vec<Triangle>>,
    epo: OnceLock<f32>,
    ancestry: OnceLock<Ancestry>,
    /// Who gets the memory of the tree.
    recycler: NodeRecycler,
}

/// Builds that follow one another, as while a slider is dragged: each begins with what the one before left, as long as the scene
/// stays the same. Holds up to 92 bytes a triangle in between.
#[derive(Default)]
pub struct BuildSession {
    scene: Weak<Scene>,
    cache: BuildCache,
}

/// How a build went.
#[derive(Debug, Clone, PartialEq)]
pub struct BuildReport {
    /// Time by stage.
    pub stages: StageTimes,
    /// Wall-clock time of the build: the sum of its stages.
    pub build_time: Duration,
    /// Threads of the pool that it ran in.
    pub threads: usize,
    /// Counts and costs.
    pub stats: TreeStats,
    /// Bytes of nodes and of primitive indices.
    pub tree_bytes: usize,
    /// Bytes of the triangles in leaf order.
    pub triangle_bytes: usize,
}

/// The tree eight children wide, which pictures are traced through.
#[derive(Debug)]
pub struct Wide {
    /// Its nodes and triangles.
    pub tree: AnyWideTree,
    /// Wall-clock time of making it; not part of the build time, which is the paper's.
    pub collapse_time: Duration,
    triangles: usize,
}

impl Wide {
    fn new(accel: &Accel, token: &CancelToken) -> Result<Self, Cancelled> {
        let start = Instant::now();
        let triangles = &accel.scene.triangles;
        let tree = with_tree!(&accel.tree, tree => collapse(tree, triangles, token)?.into());
        Ok(Self { tree, collapse_time: start.elapsed(), triangles: triangles.len() })
    }

    /// Bytes of nodes and triangles, for each triangle.
    pub fn bytes_per_triangle(&self) -> f64 {
        (self.tree.node_bytes() + self.tree.triangle_bytes()) as f64 / self.triangles.max(1) as f64
    }
}

impl BuildSession {
    /// What earlier builds of `scene` left.
    fn of(&mut self, scene: &Arc<Scene>) -> &mut BuildCache {
        if !std::ptr::eq(self.scene.as_ptr(), Arc::as_ptr(scene)) {
            *self = Self { scene: Arc::downgrade(scene), cache: BuildCache::default() };
        }
        &mut self.cache
    }
}

/// The memory of the tree goes to who builds the next one.
impl Drop for Accel {
    fn drop(&mut self) {
        let nothing = AnyTree::Aabb(Tree { nodes: Vec::new(), primitive_indices: Vec::new(), max_depth: 0 });
        match std::mem::replace(&mut self.tree, nothing) {
            AnyTree::Aabb(tree) => self.recycler.recycle(tree),
            AnyTree::Sphere(tree) => self.recycler.recycle(tree),
        }
    }
}

impl BuildReport {
    fn triangles(&self) -> usize {
        self.triangle_bytes / size_of::<Triangle>()
    }

    /// Millions of triangles built in a second.
    pub fn mtriangles_per_s(&self) -> f64 {
        self.triangles() as f64 / self.build_time.as_secs_f64().max(1e-9) / 1e6
    }

    /// Bytes of the binary tree and of the triangles in leaf order, for each triangle.
    pub fn bytes_per_triangle(&self) -> f64 {
        (self.tree_bytes + self.triangle_bytes) as f64 / self.triangles().max(1) as f64
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

    /// [`Accel::build_binary`] as one of a succession of builds: the same tree, sooner.
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
        let mut cache = session.map(|session| session.of(scene));
        let recycler = cache.as_ref().map(|cache| cache.recycler()).unwrap_or_default();
        let (tree, stages) = build_with_cache(&scene.triangles, settings, cache.as_deref_mut(), token)?;
        if cfg!(debug_assertions)
            && let Err(broken) = bvhscope_engine::tree::validate::validate(&tree, &scene.triangles)
        {
            unreachable!("the builder made a broken tree: {broken}");
        }
        token.check()?;
        let stats = match cache.and_then(BuildCache::take_stats) {
            Some(stats) => stats,
            None => tree_stats(&tree, token)?,
        };
        let report = BuildReport {
            build_time: stages.total(),
            stages,
            threads: rayon::current_num_threads(),
            stats,
            tree_bytes: with_tree!(&tree, tree => size_of_val(&tree.nodes[..]) + size_of_val(&tree.primitive_indices[..])),
            triangle_bytes: scene.triangles.len() * size_of::<Triangle>(),
        };
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
    pub fn wide(&self) -> &Wide {
        if let Some(wide) = self.wide.get() {
            return wide;
        }
        // Not within the lock, which a thread that waits for the others here could want once more.
        match Wide::new(self, &CancelToken::new()) {
            Ok(wide) => self.wide.get_or_init(|| wide),
            Err(Cancelled { .. }) => unreachable!("nobody else has this token"),
        }
    }

    /// The wide tree where it has been made.
    pub fn known_wide(&self) -> Option<&Wide> {
        self.wide.get()
    }

    /// Makes the wide tree in the calling thread's rayon pool unless it is there; waits where another pool is at it. Not for
    /// parallel loops, whose threads could wait for themselves.
    pub fn widen(&self, token: &CancelToken) -> Result<&Wide, Cancelled> {
        loop {
            if let Some(wide) = self.wide.get() {
                return Ok(wide);
            }
            if let Ok(_maker) = self.widening.try_lock() {
                let wide = Wide::new(self, token)?;
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
        let indices = self.tree.primitive_indices();
        let triangles = par_collect(indices.len(), token, |slot| self.scene.triangles[indices[slot] as usize])?;
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
        self.wide().tree.closest_hit(Level::new(), ray)
    }

    /// The nearest hits of `rays`, into the first elements of `hits`. Fastest where the rays come from one point in similar
    /// directions and neighbours stand together in eights, such as a camera's tile of 16×16 rays in Z order.
    pub fn closest_hits(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        self.wide().tree.closest_hits(Level::new(), rays, hits);
    }

    /// The nearest hit through the binary tree in the chosen order, watched by `probe`: the same hit.
    pub fn closest_hit_with<P: Probe>(&self, ray: &Ray, traversal: Traversal, probe: &mut P) -> Option<Hit> {
        with_tree!(&self.tree, tree => traverse::closest_hit(tree, self.leaf_triangles(), ray, traversal, probe))
    }

    /// Whether anything lies on `ray` between its `t_min` and `t_max`.
    pub fn any_hit(&self, ray: &Ray) -> bool {
        self.wide().tree.any_hit(Level::new(), ray)
    }

    /// Whether anything lies on each of `rays`, into the first elements of `blocked`: faster than ray by ray.
    pub fn any_hits(&self, rays: &[Ray], blocked: &mut [bool]) {
        self.wide().tree.any_hits(Level::new(), rays, blocked);
    }

    /// The leaf that holds the triangle `primitive_index` and the path to it: node indices from the root to the leaf.
    /// Empty where there is no such triangle.
    pub fn path_to(&self, primitive_index: u32) -> Vec<u32> {
        let Some(triangle) = self.scene.triangles.get(primitive_index as usize) else { return Vec::new() };
        with_tree!(&self.tree, tree => path_to_primitive(tree, triangle, primitive_index))
    }

    /// A triangle below `node`: the first one of the leaf that first children lead to; `None` where there is no such node.
    pub fn triangle_below(&self, node: u32) -> Option<u32> {
        with_tree!(&self.tree, tree => {
            let mut node = tree.nodes.get(node as usize)?;
            while !node.is_leaf() {
                node = &tree.nodes[node.first as usize];
            }
            tree.primitive_indices.get(node.first as usize).copied()
        })
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
