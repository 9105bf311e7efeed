//! What stands around primitives: boxes or spheres, behind one trait. ("Bounding volume" in the literature.)

use serde::{Deserialize, Serialize};

use crate::geometry::{Aabb, Ray, Sphere, Triangle};

/// Which container a tree is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ContainerKind {
    /// Axis-aligned boxes.
    #[serde(rename = "box")]
    Aabb,
    /// Spheres.
    Sphere,
}

impl ContainerKind {
    /// Both, boxes first.
    pub const ALL: [Self; 2] = [Self::Aabb, Self::Sphere];

    /// The name on the command line and in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Aabb => "box",
            Self::Sphere => "sphere",
        }
    }

    /// The name in the window.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Aabb => "Box",
            Self::Sphere => "Sphere",
        }
    }
}

/// A ray with what its container tests need, computed once.
#[derive(Debug, Clone, Copy)]
pub struct PreparedRay {
    /// The ray itself.
    pub ray: Ray,
    /// 1 / direction, per axis; ±infinity where the direction is zero.
    pub inverse_direction: glam::Vec3,
    /// direction · direction.
    pub direction_squared: f32,
}

impl PreparedRay {
    /// Prepares `ray`.
    pub fn new(ray: Ray) -> Self {
        Self { ray, inverse_direction: ray.direction.recip(), direction_squared: ray.direction.length_squared() }
    }
}

/// A bounding volume. Both kinds go through the same builder, traversal and statistics.
pub trait Container: Copy + Send + Sync + PartialEq + std::fmt::Debug + 'static {
    /// Which kind this is.
    const KIND: ContainerKind;
    /// Holds nothing; neutral in [`Container::union`].
    const EMPTY: Self;
    /// The container of one triangle.
    fn of_triangle(triangle: &Triangle) -> Self;
    /// The smallest container around both.
    #[must_use]
    fn union(&self, other: &Self) -> Self;
    /// Surface area up to a constant factor of the kind: half of it for boxes, r² for spheres. Enough for ratios.
    fn relative_area(&self) -> f32;
    /// Where a ray enters, at least `t_min`; `None` where it misses or enters beyond `t_max`. Never misses because of NaN.
    fn entry(&self, ray: &PreparedRay, t_min: f32, t_max: f32) -> Option<f32>;
    /// The smallest box around it.
    fn bounds(&self) -> Aabb;
    /// Whether `point` lies inside, within `slack` in world units.
    fn contains_point(&self, point: glam::Vec3, slack: f32) -> bool;
    /// Whether `other` lies inside, within `slack` in world units.
    fn contains(&self, other: &Self, slack: f32) -> bool;
    /// Volume-free measure of how much two containers overlap: the relative area of the intersection (boxes) or of
    /// the largest sphere in the lens (spheres); 0 where they do not touch.
    fn overlap(&self, other: &Self) -> f32;
    /// Wraps a tree of this kind.
    fn into_any(tree: super::Tree<Self>) -> super::AnyTree
    where
        Self: Sized;
}

impl Container for Aabb {
    const KIND: ContainerKind = ContainerKind::Aabb;
    const EMPTY: Self = Aabb::EMPTY;

    fn of_triangle(triangle: &Triangle) -> Self {
        triangle.bounds()
    }

    #[inline]
    fn union(&self, other: &Self) -> Self {
        Aabb::union(self, other)
    }

    #[inline]
    fn relative_area(&self) -> f32 {
        self.half_area()
    }

    #[inline]
    fn entry(&self, ray: &PreparedRay, t_min: f32, t_max: f32) -> Option<f32> {
        let t0 = (self.min - ray.ray.origin) * ray.inverse_direction;
        let t1 = (self.max - ray.ray.origin) * ray.inverse_direction;
        // f32::min and max drop a NaN (0·∞ on a slab's plane) in favour of the other operand.
        let near = t0.x.min(t1.x).max(t0.y.min(t1.y)).max(t0.z.min(t1.z)).max(t_min);
        // Rounded up by 2 ulp so that a ray along a shared face is never lost (Ize, 2013).
        let far = t0.x.max(t1.x).min(t0.y.max(t1.y)).min(t0.z.max(t1.z)) * 1.000_000_3;
        (near <= far.min(t_max)).then_some(near)
    }

    fn bounds(&self) -> Aabb {
        *self
    }

    fn contains_point(&self, point: glam::Vec3, slack: f32) -> bool {
        self.contains(&Aabb { min: point, max: point }, slack)
    }

    fn contains(&self, other: &Self, slack: f32) -> bool {
        Aabb::contains(self, other, slack)
    }

    fn overlap(&self, other: &Self) -> f32 {
        self.intersection(other).half_area()
    }

    fn into_any(tree: super::Tree<Self>) -> super::AnyTree {
        super::AnyTree::Aabb(tree)
    }
}

impl Container for Sphere {
    const KIND: ContainerKind = ContainerKind::Sphere;
    const EMPTY: Self = Sphere { center: glam::Vec3::ZERO, radius: -1.0 };

    fn of_triangle(_triangle: &Triangle) -> Self {
        todo!("bvh")
    }

    fn union(&self, _other: &Self) -> Self {
        todo!("bvh")
    }

    fn relative_area(&self) -> f32 {
        todo!("bvh")
    }

    fn entry(&self, _ray: &PreparedRay, _t_min: f32, _t_max: f32) -> Option<f32> {
        todo!("bvh")
    }

    fn bounds(&self) -> Aabb {
        todo!("bvh")
    }

    fn contains_point(&self, _point: glam::Vec3, _slack: f32) -> bool {
        todo!("bvh")
    }

    fn contains(&self, _other: &Self, _slack: f32) -> bool {
        todo!("bvh")
    }

    fn overlap(&self, _other: &Self) -> f32 {
        todo!("bvh")
    }

    fn into_any(tree: super::Tree<Self>) -> super::AnyTree {
        super::AnyTree::Sphere(tree)
    }
}
