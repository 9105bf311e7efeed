//! A hierarchy over items of the caller's own.

use std::ops::ControlFlow;

use crate::builders::{BuildError, Items, build_over_items};
use crate::bvh::report::{BuildReport, LazyReport};
use crate::bvh::wide::WideBvh;
use crate::cancel::CancelToken;
use crate::geometry::Ray;
use crate::settings::BuildSettings;
use crate::tree::AnyTree;

/// A bounding volume hierarchy over items of the caller's own, such as curves, points, solids or whole meshes, of which it knows the
/// containers alone: boxes, spheres or 14-DOPs. Queries hand over the items whose boxes a ray meets, and the caller intersects them.
/// Immutable, `Send` and `Sync`.
///
/// A query finds what a test of every item finds, as long as no item is hit outside of its container: give containers the room that the
/// rounding of your intersection needs.
///
/// ```
/// use bvhscope_engine::glam::Vec3;
/// use bvhscope_engine::{BuildSettings, CancelToken, ItemBvh, Ray, Sphere};
///
/// let balls: Vec<Sphere> = (0..100).map(|i| Sphere { center: Vec3::Z * (3.0 * i as f32), radius: 1.0 }).collect();
/// let bvh = ItemBvh::build(&balls[..], &BuildSettings::default(), &CancelToken::new())?;
/// // Where a ray along its axis enters a ball.
/// let enter = |item: u32, ray: &Ray| Some((balls[item as usize].center.z - 1.0 - ray.origin.z) / ray.direction.z);
/// let hit = bvh.closest_hit(&Ray::new(Vec3::Z * 7.0, Vec3::Z), enter);
/// assert_eq!(hit.map(|hit| (hit.item, hit.t)), Some((3, 1.0)));
/// # Ok::<(), bvhscope_engine::BuildError>(())
/// ```
#[derive(Debug)]
pub struct ItemBvh {
    tree: AnyTree,
    wide: WideBvh,
    report: LazyReport,
}

/// The nearest hit of a ray with an item.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ItemHit {
    /// Index of the item in the list that the tree was built from.
    pub item: u32,
    /// Distance along the ray in multiples of its direction.
    pub t: f32,
}

impl ItemBvh {
    /// Builds a hierarchy over `items` in the calling thread's rayon pool, with their kind of container, whatever `settings` say of
    /// containers. Reports progress through `token`. An empty list gives an empty tree. Equal items and settings give the identical tree
    /// on any number of threads; boxes that triangles have give the tree of these triangles.
    ///
    /// # Errors
    ///
    /// [`BuildError::Cancelled`] once `token` is cancelled. [`BuildError::Refused`] for a container that is empty or not finite, for the
    /// passes [`Split`](crate::Pass::Split) and [`Orient`](crate::Pass::Orient) and the builder [`Sbvh`](crate::BuilderKind::Sbvh), which
    /// need triangles, and for settings that cannot build so many items, see [`BuildSettings::refusal`].
    pub fn build<'a>(
        items: impl Into<Items<'a>>,
        settings: &BuildSettings,
        token: &CancelToken,
    ) -> Result<Self, BuildError> {
        let items = items.into();
        let stand_ins = items.stand_ins(token)?;
        let (tree, stages) = build_over_items(&items, &stand_ins, settings, token)?;
        let report = LazyReport::new(stages, size_of_val(&stand_ins[..]));
        let wide = WideBvh::new(&tree, &stand_ins, token)?;
        Ok(Self { tree, wide, report })
    }

    /// The binary tree: its primitives are the items.
    pub fn tree(&self) -> &AnyTree {
        &self.tree
    }

    /// The wide tree, which queries go through. Its leaves have a triangle between two corners of each item's box.
    pub fn wide(&self) -> &WideBvh {
        &self.wide
    }

    /// The wide tree alone.
    pub fn into_wide(self) -> WideBvh {
        self.wide
    }

    /// Times, statistics and sizes of the build; an item counts as a triangle. The first call takes a pass over the tree.
    pub fn report(&self) -> &BuildReport {
        self.report.of(&self.tree)
    }

    /// Calls `visit` with each item whose box `ray` meets between its `t_min` and `t_max`, items in nearer containers first, and with the
    /// distance up to which hits are still wanted. It returns that distance from there on, or breaks where no more are wanted. An item
    /// comes once; for rounding, one whose box the ray just misses may come, too.
    ///
    /// ```
    /// # use bvhscope_engine::glam::Vec3;
    /// # use bvhscope_engine::{Aabb, BuildSettings, CancelToken, ItemBvh, Ray};
    /// use std::ops::ControlFlow;
    ///
    /// let at = |z: f32| Aabb { min: Vec3::new(-1.0, -1.0, z), max: Vec3::new(1.0, 1.0, z) };
    /// let sheets = [at(0.0), at(1.0), at(2.0)];
    /// let bvh = ItemBvh::build(&sheets[..], &BuildSettings::default(), &CancelToken::new())?;
    /// let mut pierced = 0;
    /// bvh.visit(&Ray::new(Vec3::Z * 3.0, Vec3::NEG_Z), |_, t_max| {
    ///     pierced += 1;
    ///     ControlFlow::Continue(t_max)
    /// });
    /// assert_eq!(pierced, 3);
    /// # Ok::<(), bvhscope_engine::BuildError>(())
    /// ```
    pub fn visit(&self, ray: &Ray, visit: impl FnMut(u32, f32) -> ControlFlow<(), f32>) {
        self.wide.visit_items(ray, visit);
    }

    /// The nearest hit of `ray`. `intersect` gets an item and the ray, whose `t_max` is the distance of the nearest hit so far, and returns
    /// the distance where the ray hits the item. Equal distances go to the lower index; distances outside of the ray's interval are no hits.
    pub fn closest_hit(&self, ray: &Ray, mut intersect: impl FnMut(u32, &Ray) -> Option<f32>) -> Option<ItemHit> {
        let mut nearest: Option<ItemHit> = None;
        self.visit(ray, |item, t_max| {
            let wanted = ray.t_min..=t_max;
            if let Some(t) = intersect(item, &Ray { t_max, ..*ray }).filter(|t| wanted.contains(t))
                && nearest.is_none_or(|nearest| t < nearest.t || item < nearest.item)
            {
                nearest = Some(ItemHit { item, t });
                return ControlFlow::Continue(t);
            }
            ControlFlow::Continue(t_max)
        });
        nearest
    }

    /// Whether `ray` hits any item: whether `intersect` returns true for one of those that it meets.
    pub fn any_hit(&self, ray: &Ray, mut intersect: impl FnMut(u32, &Ray) -> bool) -> bool {
        let mut is_hit = false;
        self.visit(ray, |item, t_max| {
            is_hit = intersect(item, ray);
            if is_hit { ControlFlow::Break(()) } else { ControlFlow::Continue(t_max) }
        });
        is_hit
    }
}
