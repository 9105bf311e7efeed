//! Building a hierarchy that is ready to be traced: the binary tree, the wide tree made from it, and the report of the build.

mod items;
mod report;
mod wide;

use std::ops::ControlFlow;

use glam::Vec3;

use crate::aac::build_cache::BuildCache;
use crate::builders::{BuildError, build_binary_with_cache};
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::{Hit, Ray, Triangle};
use crate::query::{self, ClosestPoint, HitLists};
use crate::settings::BuildSettings;
use crate::stage_times::StageTimes;
use crate::tree::AnyTree;
use crate::tree::overlap::{EndPointOverlap, end_point_overlap};
use crate::tree::statistics::{TreeStats, tree_stats};
use crate::tree::traverse::{self, IndexedTriangles, TestCounts, Traversal};
use crate::tree::validate::validate;
use crate::with_tree;

pub use items::{ItemBvh, ItemHit};
pub use report::BuildReport;

use report::LazyReport;
pub use wide::WideBvh;

/// A bounding volume hierarchy over a list of triangles, ready to be traced. Made by [`build`]; immutable, `Send` and `Sync`.
///
/// Holds no copy of the list: what needs the triangles as they were given to [`build`] takes them as an argument. The wide tree,
/// through which rays are traced, has its own blocks of them.
///
/// ```
/// use bvhscope_engine::glam::Vec3;
/// use bvhscope_engine::{BuildSettings, CancelToken, Ray, Triangle, build};
///
/// let triangles = [Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::Y }];
/// let bvh = build(&triangles, &BuildSettings::default(), &CancelToken::new())?;
/// let hit = bvh.closest_hit(&Ray::new(Vec3::new(0.25, 0.5, 3.0), Vec3::NEG_Z)).expect("the ray meets the triangle");
/// assert_eq!((hit.primitive_index, hit.t, hit.u, hit.v), (0, 3.0, 0.25, 0.5));
/// # Ok::<(), bvhscope_engine::BuildError>(())
/// ```
#[derive(Debug)]
pub struct Bvh {
    tree: AnyTree,
    wide: WideBvh,
    report: LazyReport,
}

/// The binary tree of a build with its report, not yet collapsed into a wide one.
#[derive(Debug)]
pub struct BinaryBvh {
    /// The binary tree.
    pub tree: AnyTree,
    /// Times, statistics and sizes.
    pub report: BuildReport,
}

/// Builds a hierarchy over `triangles` (all coordinates finite) in the calling thread's rayon pool. Reports progress through
/// `token`. An empty list gives an empty tree, which every ray misses.
///
/// Equal triangles and settings give the identical tree, node for node, on any number of threads.
///
/// # Errors
///
/// [`BuildError::Cancelled`] once `token` is cancelled; [`BuildError::Refused`] where the settings cannot build these triangles,
/// see [`BuildSettings::refusal`].
///
/// # Panics
///
/// In debug builds where the builder breaks an invariant that [`validate`] checks.
///
/// ```
/// use bvhscope_engine::glam::Vec3;
/// use bvhscope_engine::{BuildSettings, CancelToken, ContainerKind, Preset, Triangle, build};
///
/// let triangles: Vec<Triangle> = (0..100)
///     .map(|i| Vec3::new(i as f32, 0.0, 0.0))
///     .map(|a| Triangle { a, b: a + Vec3::Y, c: a + Vec3::Z })
///     .collect();
/// let settings = BuildSettings::preset(Preset::Hq, ContainerKind::Aabb);
/// let bvh = build(&triangles, &settings, &CancelToken::new())?;
/// assert_eq!(bvh.statistics().leaves, 100);
/// assert_eq!(bvh.statistics().nodes, 199);
/// # Ok::<(), bvhscope_engine::BuildError>(())
/// ```
pub fn build(triangles: &[Triangle], settings: &BuildSettings, token: &CancelToken) -> Result<Bvh, BuildError> {
    let (tree, stages) = checked_tree(triangles, settings, None, token)?;
    let wide = WideBvh::new(&tree, triangles, token)?;
    Ok(Bvh { tree, wide, report: LazyReport::new(stages, size_of_val(triangles)) })
}

/// The binary tree over `triangles`, which debug builds validate, and the time of its stages.
fn checked_tree(
    triangles: &[Triangle],
    settings: &BuildSettings,
    cache: Option<&mut BuildCache>,
    token: &CancelToken,
) -> Result<(AnyTree, StageTimes), BuildError> {
    let (tree, stages) = build_binary_with_cache(triangles, settings, cache, token)?;
    if cfg!(debug_assertions)
        && let Err(broken) = validate(&tree, triangles)
    {
        unreachable!("the builder made a broken tree: {broken}");
    }
    token.check()?;
    Ok((tree, stages))
}

impl BinaryBvh {
    /// Builds the binary tree over `triangles` and its report: [`build`](crate::build) without the wide tree.
    pub fn build(triangles: &[Triangle], settings: &BuildSettings, token: &CancelToken) -> Result<Self, BuildError> {
        Self::build_with_cache(triangles, settings, None, token)
    }

    /// [`BinaryBvh::build`] with what earlier builds of the very same triangles left in `cache`: the same tree, sooner.
    pub fn build_with_cache(
        triangles: &[Triangle],
        settings: &BuildSettings,
        mut cache: Option<&mut BuildCache>,
        token: &CancelToken,
    ) -> Result<Self, BuildError> {
        let (tree, stages) = checked_tree(triangles, settings, cache.as_deref_mut(), token)?;
        let stats = match cache.and_then(BuildCache::take_stats) {
            Some(stats) => stats,
            None => tree_stats(&tree, token)?,
        };
        let report = BuildReport::new(stages, &tree, stats, size_of_val(triangles));
        Ok(Self { tree, report })
    }
}

impl Bvh {
    /// A hierarchy whose `tree` over `triangles`, of any arity, was made elsewhere, such as one of a file: makes the wide tree. The times of
    /// its report are zero.
    ///
    /// # Errors
    ///
    /// Once `token` is cancelled.
    pub fn of_tree(tree: AnyTree, triangles: &[Triangle], token: &CancelToken) -> Result<Self, Cancelled> {
        let wide = WideBvh::new(&tree, triangles, token)?;
        Ok(Self { tree, wide, report: LazyReport::new(StageTimes::default(), size_of_val(triangles)) })
    }

    /// The binary tree as the builder made it.
    pub fn tree(&self) -> &AnyTree {
        &self.tree
    }

    /// The wide tree, which [`Bvh::closest_hit`] and the like trace.
    pub fn wide(&self) -> &WideBvh {
        &self.wide
    }

    /// Times, statistics and sizes of the build. The first call takes a pass over the tree, in the calling thread's rayon pool.
    pub fn report(&self) -> &BuildReport {
        self.report.of(&self.tree)
    }

    /// Statistics of the binary tree: counts of nodes and leaves, depths, leaf sizes, SAH cost.
    ///
    /// ```
    /// # use bvhscope_engine::glam::Vec3;
    /// # use bvhscope_engine::{BuildSettings, CancelToken, Triangle, build};
    /// # let triangles = [Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::Y }; 4];
    /// let bvh = build(&triangles, &BuildSettings::default(), &CancelToken::new())?;
    /// let statistics = bvh.statistics();
    /// assert_eq!((statistics.nodes, statistics.leaves, statistics.max_depth), (7, 4, 2));
    /// // Four equal boxes: three interior nodes and four triangles are tested by every ray that enters the root.
    /// assert_eq!(statistics.sah_cost, 7.0);
    /// # Ok::<(), bvhscope_engine::BuildError>(())
    /// ```
    pub fn statistics(&self) -> &TreeStats {
        &self.report().stats
    }

    /// The nearest hit of `ray`; `None` where it misses. Equal distances go to the lower primitive index.
    ///
    /// ```
    /// # use bvhscope_engine::glam::Vec3;
    /// # use bvhscope_engine::{BuildSettings, CancelToken, Ray, Triangle, build};
    /// # let triangles = [Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::Y }];
    /// # let bvh = build(&triangles, &BuildSettings::default(), &CancelToken::new())?;
    /// let ray = Ray::new(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z);
    /// assert_eq!(bvh.closest_hit(&ray).map(|hit| hit.primitive_index), Some(0));
    /// // Only hits between `t_min` and `t_max` count.
    /// assert_eq!(bvh.closest_hit(&Ray { t_max: 0.5, ..ray }), None);
    /// # Ok::<(), bvhscope_engine::BuildError>(())
    /// ```
    #[inline]
    pub fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        self.wide.closest_hit(ray)
    }

    /// The nearest hits of `rays`, into the first elements of `hits`; exactly those that [`Bvh::closest_hit`] finds one by one.
    ///
    /// Fastest where the rays come from one point in similar directions and neighbours stand together in sixteens, such as a
    /// camera's tile of 16×16 rays in Z order. Runs on the calling thread alone: give each thread its own tile.
    ///
    /// # Panics
    ///
    /// Where `hits` is shorter than `rays`.
    ///
    /// ```
    /// # use bvhscope_engine::glam::Vec3;
    /// # use bvhscope_engine::{BuildSettings, CancelToken, Ray, Triangle, build};
    /// # let triangles = [Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::Y }];
    /// # let bvh = build(&triangles, &BuildSettings::default(), &CancelToken::new())?;
    /// let rays: Vec<Ray> = (0..16).map(|i| Ray::new(Vec3::Z, Vec3::new(i as f32 / 8.0, 0.1, -1.0))).collect();
    /// let mut hits = vec![None; rays.len()];
    /// bvh.closest_hits(&rays, &mut hits);
    /// assert_eq!(hits.iter().flatten().count(), 8);
    /// # Ok::<(), bvhscope_engine::BuildError>(())
    /// ```
    pub fn closest_hits(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        self.wide.closest_hits(rays, hits);
    }

    /// Whether anything lies on `ray` between its `t_min` and `t_max`: the query of shadow rays.
    #[inline]
    pub fn any_hit(&self, ray: &Ray) -> bool {
        self.wide.any_hit(ray)
    }

    /// Whether anything lies on each of `rays`, into the first elements of `blocked`: the same as [`Bvh::any_hit`] one by one,
    /// and faster, the more so the larger the tree is. Runs on the calling thread alone.
    ///
    /// # Panics
    ///
    /// Where `blocked` is shorter than `rays`.
    ///
    /// ```
    /// # use bvhscope_engine::glam::Vec3;
    /// # use bvhscope_engine::{BuildSettings, CancelToken, Ray, Triangle, build};
    /// # let triangles = [Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::Y }];
    /// # let bvh = build(&triangles, &BuildSettings::default(), &CancelToken::new())?;
    /// let from = Vec3::new(0.2, 0.2, 1.0);
    /// let mut blocked = [false; 2];
    /// bvh.any_hits(&[Ray::new(from, Vec3::NEG_Z), Ray::new(from, Vec3::Z)], &mut blocked);
    /// assert_eq!(blocked, [true, false]);
    /// # Ok::<(), bvhscope_engine::BuildError>(())
    /// ```
    pub fn any_hits(&self, rays: &[Ray], blocked: &mut [bool]) {
        self.wide.any_hits(rays, blocked);
    }

    /// The hits of `ray` between its `t_min` and `t_max`, into `hits`: each triangle once, by distance, at equal distances by index, at
    /// most the `max` nearest. Returns whether there are more. Replaces what `hits` held, whose memory is used again.
    ///
    /// ```
    /// # use bvhscope_engine::glam::Vec3;
    /// # use bvhscope_engine::{BuildSettings, CancelToken, Ray, Triangle, build};
    /// let at = |z: f32| Triangle { a: Vec3::Z * z, b: Vec3::X + Vec3::Z * z, c: Vec3::Y + Vec3::Z * z };
    /// let bvh = build(&[at(2.0), at(0.0), at(1.0)], &BuildSettings::default(), &CancelToken::new())?;
    /// let ray = Ray::new(Vec3::new(0.2, 0.2, 5.0), Vec3::NEG_Z);
    /// let mut hits = Vec::new();
    /// assert!(!bvh.all_hits(&ray, usize::MAX, &mut hits));
    /// let found: Vec<_> = hits.iter().map(|hit| (hit.primitive_index, hit.t)).collect();
    /// assert_eq!(found, [(0, 3.0), (2, 4.0), (1, 5.0)]);
    /// assert!(bvh.all_hits(&ray, 2, &mut hits) && hits.len() == 2);
    /// # Ok::<(), bvhscope_engine::BuildError>(())
    /// ```
    pub fn all_hits(&self, ray: &Ray, max: usize, hits: &mut Vec<Hit>) -> bool {
        self.wide.all_hits(ray, max, hits)
    }

    /// [`Bvh::all_hits`] of each of `rays`, into `lists`. Replaces what they held, whose memory is used again.
    ///
    /// ```
    /// # use bvhscope_engine::glam::Vec3;
    /// # use bvhscope_engine::{BuildSettings, CancelToken, Ray, Triangle, build};
    /// use bvhscope_engine::query::HitLists;
    ///
    /// # let triangles = [Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::Y }; 2];
    /// # let bvh = build(&triangles, &BuildSettings::default(), &CancelToken::new())?;
    /// let from = Vec3::new(0.2, 0.2, 1.0);
    /// let mut lists = HitLists::default();
    /// bvh.hit_lists(&[Ray::new(from, Vec3::Z), Ray::new(from, Vec3::NEG_Z)], usize::MAX, &mut lists);
    /// assert_eq!((lists.of(0).len(), lists.of(1).len()), (0, 2));
    /// # Ok::<(), bvhscope_engine::BuildError>(())
    /// ```
    pub fn hit_lists(&self, rays: &[Ray], max: usize, lists: &mut HitLists) {
        self.wide.hit_lists(rays, max, lists);
    }

    /// Calls `visit` with the hits of `ray` in the order of [`Bvh::all_hits`] until it breaks. Only as many are sought as it takes.
    ///
    /// ```
    /// # use bvhscope_engine::glam::Vec3;
    /// # use bvhscope_engine::{BuildSettings, CancelToken, Ray, Triangle, build};
    /// use std::ops::ControlFlow;
    ///
    /// # let triangles = [Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::Y }; 3];
    /// # let bvh = build(&triangles, &BuildSettings::default(), &CancelToken::new())?;
    /// # let ray = Ray::new(Vec3::new(0.2, 0.2, 5.0), Vec3::NEG_Z);
    /// // The first hit of a triangle that is not a cut-out.
    /// let mut seen = None;
    /// bvh.visit_hits(&ray, |hit| {
    ///     let is_opaque = hit.primitive_index != 0;
    ///     seen = is_opaque.then_some(*hit);
    ///     if is_opaque { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    /// });
    /// assert_eq!(seen.map(|hit| hit.primitive_index), Some(1));
    /// # Ok::<(), bvhscope_engine::BuildError>(())
    /// ```
    pub fn visit_hits(&self, ray: &Ray, visit: impl FnMut(&Hit) -> ControlFlow<()>) {
        self.wide.visit_hits(ray, visit);
    }

    /// Number of the hits of `ray`.
    pub fn count_hits(&self, ray: &Ray) -> usize {
        self.wide.count_hits(ray)
    }

    /// The point of the triangles that is nearest to `point`; `None` where none lies within `radius`, in world units, which may be
    /// infinite. Equal distances go to the lower primitive index.
    ///
    /// ```
    /// # use bvhscope_engine::glam::Vec3;
    /// # use bvhscope_engine::{BuildSettings, CancelToken, Triangle, build};
    /// use bvhscope_engine::geometry::Feature;
    ///
    /// # let triangles = [Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::Y }];
    /// # let bvh = build(&triangles, &BuildSettings::default(), &CancelToken::new())?;
    /// let above = Vec3::new(0.25, 0.5, 2.0);
    /// let nearest = bvh.closest_point(above, f32::INFINITY).expect("there is a triangle");
    /// assert_eq!((nearest.distance, nearest.u, nearest.v, nearest.feature), (2.0, 0.25, 0.5, Feature::Face));
    /// assert_eq!(bvh.closest_point(above, 1.5), None);
    /// # Ok::<(), bvhscope_engine::BuildError>(())
    /// ```
    pub fn closest_point(&self, point: Vec3, radius: f32) -> Option<ClosestPoint> {
        self.wide.closest_point(point, radius)
    }

    /// [`Bvh::closest_point`] of each of `points`, written to the first elements of `found`. Faster than point by point, above all where
    /// the nearest points of neighbours in the list lie close together.
    ///
    /// # Panics
    ///
    /// If `found` is shorter than `points`.
    ///
    /// ```
    /// # use bvhscope_engine::glam::Vec3;
    /// # use bvhscope_engine::{BuildSettings, CancelToken, Triangle, build};
    /// # let triangles = [Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::Y }];
    /// # let bvh = build(&triangles, &BuildSettings::default(), &CancelToken::new())?;
    /// let mut found = [None; 2];
    /// bvh.closest_points(&[Vec3::Z, Vec3::Z * 3.0], 2.0, &mut found);
    /// assert_eq!(found.map(|found| found.map(|found| found.distance)), [Some(1.0), None]);
    /// # Ok::<(), bvhscope_engine::BuildError>(())
    /// ```
    pub fn closest_points(&self, points: &[Vec3], radius: f32, found: &mut [Option<ClosestPoint>]) {
        self.wide.closest_points(points, radius, found);
    }

    /// Whether `point` lies inside of the mesh, which must be closed ([`Edges::is_closed`](crate::query::closed::Edges::is_closed)); for
    /// another mesh the answer means nothing. A point on the surface, but for rounding, may lie on either side.
    pub fn contains(&self, point: Vec3) -> bool {
        self.wide.contains(point)
    }

    /// Distance of `point` to the mesh, which must be closed, negative inside; `None` for a mesh without triangles and for a point that is
    /// not finite. See [`Bvh::contains`].
    pub fn signed_distance(&self, point: Vec3) -> Option<f64> {
        self.wide.signed_distance(point)
    }

    /// [`Bvh::all_hits`] through the binary tree, with the number of container and primitive tests. `triangles` is the list that the
    /// tree was built from.
    pub fn all_hits_counted(
        &self,
        ray: &Ray,
        triangles: &[Triangle],
        max: usize,
        hits: &mut Vec<Hit>,
    ) -> (bool, TestCounts) {
        let mut counts = TestCounts::default();
        let leaf_triangles = IndexedTriangles { triangles, indices: self.tree.primitive_indices() };
        let has_more = with_tree!(&self.tree, tree =>
            query::all_hits_counted(tree, leaf_triangles, ray, max, hits, &mut counts));
        (has_more, counts)
    }

    /// [`Bvh::closest_point`] through the binary tree, with the number of container and primitive tests. `triangles` is the list that
    /// the tree was built from.
    pub fn closest_point_counted(
        &self,
        point: Vec3,
        triangles: &[Triangle],
        radius: f32,
    ) -> (Option<ClosestPoint>, TestCounts) {
        let mut counts = TestCounts::default();
        let leaf_triangles = IndexedTriangles { triangles, indices: self.tree.primitive_indices() };
        let found = with_tree!(&self.tree, tree =>
            query::closest_point(tree, leaf_triangles, point, radius, &mut counts));
        (found, counts)
    }

    /// [`Bvh::closest_hit`] through the binary tree, with the number of container and primitive tests that `traversal` takes.
    /// `triangles` is the list that the tree was built from.
    ///
    /// ```
    /// # use bvhscope_engine::glam::Vec3;
    /// # use bvhscope_engine::{BuildSettings, CancelToken, Ray, Triangle, build};
    /// use bvhscope_engine::{TestCounts, Traversal};
    ///
    /// let at = |z: f32| Triangle { a: Vec3::Z * z, b: Vec3::X + Vec3::Z * z, c: Vec3::Y + Vec3::Z * z };
    /// let triangles = [at(0.0), at(1.0)];
    /// let bvh = build(&triangles, &BuildSettings::default(), &CancelToken::new())?;
    /// let ray = Ray::new(Vec3::new(0.2, 0.2, 5.0), Vec3::NEG_Z);
    /// let (hit, ordered) = bvh.closest_hit_counted(&ray, &triangles, Traversal::Ordered);
    /// let (same, paper) = bvh.closest_hit_counted(&ray, &triangles, Traversal::Paper);
    /// assert_eq!(hit, same);
    /// // Ordered, the second triangle lies behind the first hit and is culled.
    /// assert_eq!(ordered, TestCounts { containers: 3, primitives: 1 });
    /// assert_eq!(paper, TestCounts { containers: 3, primitives: 2 });
    /// # Ok::<(), bvhscope_engine::BuildError>(())
    /// ```
    pub fn closest_hit_counted(
        &self,
        ray: &Ray,
        triangles: &[Triangle],
        traversal: Traversal,
    ) -> (Option<Hit>, TestCounts) {
        let mut counts = TestCounts::default();
        let leaf_triangles = IndexedTriangles { triangles, indices: self.tree.primitive_indices() };
        let hit =
            with_tree!(&self.tree, tree => traverse::closest_hit(tree, leaf_triangles, ray, traversal, &mut counts));
        (hit, counts)
    }

    /// [`Bvh::any_hit`] through the binary tree, with the number of container and primitive tests. `triangles` is the list that
    /// the tree was built from.
    pub fn any_hit_counted(&self, ray: &Ray, triangles: &[Triangle]) -> (bool, TestCounts) {
        let mut counts = TestCounts::default();
        let leaf_triangles = IndexedTriangles { triangles, indices: self.tree.primitive_indices() };
        let hit = with_tree!(&self.tree, tree => traverse::any_hit_with(tree, leaf_triangles, ray, &mut counts));
        (hit, counts)
    }

    /// End-point overlap (EPO) of the binary tree over `triangles`, the list that it was built from; see [`end_point_overlap`].
    pub fn end_point_overlap(
        &self,
        triangles: &[Triangle],
        max_samples: usize,
        token: &CancelToken,
    ) -> Result<EndPointOverlap, Cancelled> {
        end_point_overlap(&self.tree, triangles, max_samples, token)
    }

    /// Checks the binary tree over `triangles`, the list that it was built from; see [`validate`].
    ///
    /// # Errors
    ///
    /// The first invariant that is broken, in words.
    ///
    /// ```
    /// # use bvhscope_engine::glam::Vec3;
    /// # use bvhscope_engine::{BuildSettings, CancelToken, Triangle, build};
    /// let triangles = [Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::Y }; 3];
    /// let bvh = build(&triangles, &BuildSettings::default(), &CancelToken::new())?;
    /// assert_eq!(bvh.validate(&triangles), Ok(()));
    /// assert!(bvh.validate(&triangles[..2]).is_err());
    /// # Ok::<(), bvhscope_engine::BuildError>(())
    /// ```
    pub fn validate(&self, triangles: &[Triangle]) -> Result<(), String> {
        validate(&self.tree, triangles)
    }
}
