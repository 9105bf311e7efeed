//! Where a ray is inside of a container. The traversals know only where it enters; this is for showing, in double precision.

use glam::{DVec3, Vec3};

use bvhscope_engine::geometry::{Aabb, Dop14, OrientedBox, Ray, Sphere};
use bvhscope_engine::tree::AnyTree;

/// The distances between which `ray` is inside of the container of `node`, cut to its interval; `None` where it misses.
pub(super) fn chord(tree: &AnyTree, node: u32, ray: &Ray) -> Option<[f32; 2]> {
    let [near, far] = match tree {
        AnyTree::Aabb(tree) => in_box(&tree.nodes.get(node as usize)?.container, ray),
        AnyTree::Sphere(tree) => in_sphere(&tree.nodes.get(node as usize)?.container, ray)?,
        AnyTree::Dop14(tree) => in_dop(&tree.nodes.get(node as usize)?.container, ray),
        AnyTree::Oriented(tree) => in_oriented(&tree.nodes.get(node as usize)?.container, ray),
    };
    let [near, far] = [near.max(f64::from(ray.t_min.max(0.0))), far.min(f64::from(ray.t_max))];
    (near <= far).then_some([near as f32, far as f32])
}

/// The slabs' intersection; the first is the greater where the ray misses.
fn in_box(container: &Aabb, ray: &Ray) -> [f64; 2] {
    let whole = [f64::NEG_INFINITY, f64::INFINITY];
    Vec3::AXES
        .into_iter()
        .enumerate()
        .fold(whole, |inside, (axis, normal)| in_slab(inside, normal, [container.min[axis], container.max[axis]], ray))
}

fn in_dop(container: &Dop14, ray: &Ray) -> [f64; 2] {
    Dop14::DIAGONALS.into_iter().enumerate().fold(in_box(&container.bounds, ray), |inside, (at, normal)| {
        in_slab(inside, normal, [container.low[at], container.high[at]], ray)
    })
}

fn in_oriented(container: &OrientedBox, ray: &Ray) -> [f64; 2] {
    let whole = [f64::NEG_INFINITY, f64::INFINITY];
    container
        .normals
        .into_iter()
        .enumerate()
        .fold(whole, |inside, (at, normal)| in_slab(inside, normal, [container.low[at], container.high[at]], ray))
}

/// The part of `inside` between two planes at the dot products `planes` with `normal`.
fn in_slab(inside: [f64; 2], normal: Vec3, planes: [f32; 2], ray: &Ray) -> [f64; 2] {
    let [origin, direction] = [ray.origin, ray.direction].map(|v| v.as_dvec3().dot(normal.as_dvec3()));
    let planes = planes.map(f64::from);
    if direction == 0.0 {
        let is_between = (planes[0]..=planes[1]).contains(&origin);
        return if is_between { inside } else { [f64::INFINITY, f64::NEG_INFINITY] };
    }
    let [a, b] = planes.map(|plane| (plane - origin) / direction);
    [inside[0].max(a.min(b)), inside[1].min(a.max(b))]
}

fn in_sphere(container: &Sphere, ray: &Ray) -> Option<[f64; 2]> {
    let direction = ray.direction.as_dvec3();
    let to: DVec3 = container.center.as_dvec3() - ray.origin.as_dvec3();
    let length_squared = direction.length_squared();
    let middle = to.dot(direction) / length_squared;
    let aside = (to - direction * middle).length_squared();
    let radius = f64::from(container.radius);
    let inside = radius * radius - aside;
    (inside >= 0.0).then(|| {
        let half = (inside / length_squared).sqrt();
        [middle - half, middle + half]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chords_of_boxes_and_spheres_are_those_of_the_ray() {
        let unit = Aabb { min: Vec3::ZERO, max: Vec3::ONE };
        let ray = Ray::new(Vec3::new(-1.0, 0.5, 0.5), Vec3::X * 2.0);
        assert_eq!(in_box(&unit, &ray), [0.5, 1.0]);
        let beside = Ray::new(Vec3::new(-1.0, 1.5, 0.5), Vec3::X);
        let [near, far] = in_box(&unit, &beside);
        assert!(near > far);
        let octahedron = Dop14 { bounds: Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE }, low: [-1.0; 4], high: [1.0; 4] };
        assert_eq!(in_dop(&octahedron, &Ray::new(Vec3::new(-2.0, 0.5, 0.0), Vec3::X)), [1.5, 2.5]);
        let [near, far] = in_dop(&octahedron, &Ray::new(Vec3::new(-2.0, 0.75, 0.5), Vec3::X));
        assert!(near > far, "through a corner of its box");
        let ball = Sphere { center: Vec3::ZERO, radius: 5.0 };
        let across = Ray::new(Vec3::new(-10.0, 3.0, 0.0), Vec3::X * 2.0);
        assert_eq!(in_sphere(&ball, &across), Some([3.0, 7.0]));
        assert_eq!(in_sphere(&ball, &Ray::new(Vec3::Y * 6.0, Vec3::X)), None);
    }
}
