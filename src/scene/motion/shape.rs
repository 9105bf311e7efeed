//! The vertices of a mesh as its file has them, and where joints and morph targets move them.

use glam::{Mat4, Vec3, Vec3A, Vec4};

use crate::vectors::direction;

/// Joints that hold a vertex, and their shares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::scene) struct Hold {
    /// Indices of joints.
    pub(in crate::scene) joints: [u16; 4],
    /// Shares of the joints; those of all sets of a vertex sum up to one.
    pub(in crate::scene) weights: [f32; 4],
}

/// Displacements of all vertices by a morph target of weight one.
#[derive(Debug, Clone, Default)]
pub(in crate::scene) struct MorphTarget {
    /// Empty where positions stay.
    pub(in crate::scene) positions: Vec<Vec3>,
    /// Changes of normals; empty where they stay.
    pub(in crate::scene) normals: Vec<Vec3>,
    /// Changes of the directions of tangents; empty where they stay.
    pub(in crate::scene) tangents: Vec<Vec3>,
}

/// Vertices in mesh space.
#[derive(Debug, Clone, Default)]
pub(in crate::scene) struct Shape {
    pub(in crate::scene) positions: Vec<Vec3>,
    /// Normals; empty or one for each position.
    pub(in crate::scene) normals: Vec<Vec3>,
    /// Tangents with the sign of the bitangent; empty or one for each position.
    pub(in crate::scene) tangents: Vec<Vec4>,
    /// The joints of each vertex, one list for each four joints that may hold one; none for a mesh without a skin.
    pub(in crate::scene) holds: Vec<Vec<Hold>>,
    pub(in crate::scene) targets: Vec<MorphTarget>,
}

/// Vertices of a shape in a row, to be written.
pub(in crate::scene) struct Vertices<'a> {
    pub(in crate::scene) positions: &'a mut [Vec3],
    /// One for each position; empty where they are not wanted.
    pub(in crate::scene) normals: &'a mut [Vec3],
    /// As the normals.
    pub(in crate::scene) tangents: &'a mut [Vec4],
}

/// Columns of an affine transform.
pub(in crate::scene) type Columns = [Vec3A; 4];

/// The columns of a matrix.
#[inline]
pub(in crate::scene) fn columns(matrix: &Mat4) -> Columns {
    [matrix.x_axis, matrix.y_axis, matrix.z_axis, matrix.w_axis].map(Vec3A::from_vec4)
}

/// A point moved by a transform, rounded as [`Placement::point`](bvhscope_engine::geometry::Placement::point) rounds, so that a flat scene
/// and one of two levels have the same hits.
#[inline]
fn moved([x, y, z, w]: Columns, point: Vec3) -> Vec3 {
    (x * point.x + y * point.y + z * point.z + w).into()
}

/// A normal turned by a transform: by its cofactors, which are the inverse transpose up to a factor and also exist for singular
/// transforms. `scale` keeps their products within the range of single precision.
#[inline]
pub(in crate::scene) fn turned([x, y, z, _]: Columns, scale: f32, normal: Vec3) -> Vec3 {
    let [x, y, z] = [x * scale, y * scale, z * scale];
    let [yz, zx, xy] = [y.cross(z), z.cross(x), x.cross(y)];
    let turned = yz * normal.x + zx * normal.y + xy * normal.z;
    // A mirrored surface keeps its front.
    (turned * 1.0_f32.copysign(x.dot(yz))).normalize_or_zero().into()
}

/// A tangent turned and stretched with the surface, of unit length; its bitangent is mirrored with it. Zero where that has no direction.
pub(in crate::scene) fn turned_tangent([x, y, z, _]: Columns, tangent: Vec4) -> Vec4 {
    let turned = x * tangent.x + y * tangent.y + z * tangent.z;
    direction(turned.into()).unwrap_or_default().extend(tangent.w * 1.0_f32.copysign(x.dot(y.cross(z))))
}

/// The reciprocal of the largest element of the linear parts of `transforms`.
pub(in crate::scene) fn scale_of(transforms: &[Mat4]) -> f32 {
    let elements = transforms.iter().flat_map(|m| [m.x_axis, m.y_axis, m.z_axis].map(|axis| axis.truncate().abs()));
    1.0 / elements.fold(f32::MIN_POSITIVE, |most, axis| most.max(axis.max_element())).min(f32::MAX)
}

impl Shape {
    /// Writes the vertices from `first` on.
    ///
    /// `transforms` lead from mesh space to the scene: one of the mesh, or one of each joint, which must exist for all joints of
    /// [`Shape::holds`]. `weights` are those of the morph targets; missing ones are 0.
    pub(in crate::scene) fn place(&self, first: usize, transforms: &[Mat4], weights: &[f32], vertices: Vertices<'_>) {
        let Vertices { positions, normals, tangents } = vertices;
        let range = first..first + positions.len();
        positions.copy_from_slice(&self.positions[range.clone()]);
        if !normals.is_empty() {
            normals.copy_from_slice(&self.normals[range.clone()]);
        }
        if !tangents.is_empty() {
            tangents.copy_from_slice(&self.tangents[range.clone()]);
        }
        for (target, &weight) in self.targets.iter().zip(weights).filter(|(_, weight)| **weight != 0.0) {
            let add = |list: &mut [Vec3], moves: &[Vec3]| {
                if let Some(moves) = moves.get(range.clone()) {
                    list.iter_mut().zip(moves).for_each(|(vector, change)| *vector += *change * weight);
                }
            };
            add(positions, &target.positions);
            add(normals, &target.normals);
            if let Some(moves) = target.tangents.get(range.clone()) {
                tangents.iter_mut().zip(moves).for_each(|(tangent, change)| *tangent += (*change * weight).extend(0.0));
            }
        }
        let vertices = Vertices { positions, normals, tangents };
        let scale = scale_of(transforms);
        let is_held = transforms.len() > 1;
        match &self.holds[..] {
            [holds] if is_held => {
                let holds = &holds[range];
                apply(vertices, scale, |k| blend(transforms, [Vec3A::ZERO; 4], &holds[k]));
            }
            [_, ..] if is_held => {
                apply(vertices, scale, |k| self.blend_all(first + k, transforms));
            }
            _ => {
                let columns = columns(&transforms[0]);
                apply(vertices, scale, |_| columns);
            }
        }
    }

    /// Whether the transform of a vertex mirrors it, see [`Shape::place`].
    pub(in crate::scene) fn is_mirrored(&self, vertex: usize, transforms: &[Mat4]) -> bool {
        if transforms.len() == 1 || self.holds.is_empty() {
            return transforms[0].determinant() < 0.0;
        }
        let [x, y, z, _] = self.blend_all(vertex, transforms);
        x.dot(y.cross(z)) < 0.0
    }

    /// The transform of a vertex by the joints of all sets.
    fn blend_all(&self, vertex: usize, transforms: &[Mat4]) -> Columns {
        self.holds.iter().fold([Vec3A::ZERO; 4], |sum, set| blend(transforms, sum, &set[vertex]))
    }

    /// Whether joint `index` or a later one holds a vertex, for how many vertices; each of them is then held by the other joints
    /// alone, or by joint 0 where there is no other.
    pub(in crate::scene) fn drop_joints(&mut self, index: usize) -> u64 {
        let mut faulty = 0;
        for vertex in 0..self.positions.len() {
            let mut total = 0.0;
            let mut is_faulty = false;
            for hold in self.holds.iter_mut().map(|holds| &mut holds[vertex]) {
                for (joint, weight) in hold.joints.iter_mut().zip(&mut hold.weights) {
                    if usize::from(*joint) >= index {
                        is_faulty |= *weight > 0.0;
                        (*joint, *weight) = (0, 0.0);
                    }
                    total += *weight;
                }
            }
            if is_faulty {
                faulty += 1;
                share(self.holds.iter_mut().map(|holds| &mut holds[vertex]), total);
            }
        }
        faulty
    }

    /// Bytes in memory.
    pub(in crate::scene) fn bytes(&self) -> usize {
        let vectors = |list: &[Vec3]| size_of_val(list);
        let of_target = |one: &MorphTarget| vectors(&one.positions) + vectors(&one.normals) + vectors(&one.tangents);
        let targets: usize = self.targets.iter().map(of_target).sum();
        let holds: usize = self.holds.iter().map(|holds| size_of_val(&holds[..])).sum();
        vectors(&self.positions) + vectors(&self.normals) + size_of_val(&self.tangents[..]) + holds + targets
    }
}

/// Divides the shares of a vertex by their `total`; joint 0 gets all where there is none.
pub(in crate::scene) fn share<'a>(holds: impl Iterator<Item = &'a mut Hold>, total: f32) {
    for (set, hold) in holds.enumerate() {
        if total > 0.0 {
            hold.weights = hold.weights.map(|weight| weight / total);
        } else {
            *hold = Hold { joints: [0; 4], weights: [if set == 0 { 1.0 } else { 0.0 }, 0.0, 0.0, 0.0] };
        }
    }
}

/// `sum` and the transforms of the joints that hold a vertex, by their shares.
#[inline]
fn blend(transforms: &[Mat4], sum: Columns, hold: &Hold) -> Columns {
    hold.joints.iter().zip(hold.weights).fold(sum, |[x, y, z, w], (&joint, weight)| {
        let [jx, jy, jz, jw] = columns(&transforms[usize::from(joint)]);
        [x + jx * weight, y + jy * weight, z + jz * weight, w + jw * weight]
    })
}

/// Moves vertices and turns their normals and tangents, where there are any, each by a transform of its own.
#[inline]
fn apply(vertices: Vertices<'_>, scale: f32, transform: impl Fn(usize) -> Columns) {
    let Vertices { positions, normals, tangents } = vertices;
    tangents.iter_mut().enumerate().for_each(|(k, tangent)| *tangent = turned_tangent(transform(k), *tangent));
    if normals.is_empty() {
        positions.iter_mut().enumerate().for_each(|(k, position)| *position = moved(transform(k), *position));
        return;
    }
    for (k, (position, normal)) in positions.iter_mut().zip(normals).enumerate() {
        let columns = transform(k);
        (*position, *normal) = (moved(columns, *position), turned(columns, scale, *normal));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Quat;

    fn hold(joints: [u16; 4], weights: [f32; 4]) -> Hold {
        Hold { joints, weights }
    }

    /// A vertex at (1, 0, 0) with a normal along x.
    fn shape(holds: Vec<Vec<Hold>>) -> Shape {
        let tangents = vec![Vec4::new(0.0, 1.0, 0.0, 1.0)];
        Shape { positions: vec![Vec3::X], normals: vec![Vec3::X], tangents, holds, targets: Vec::new() }
    }

    fn placed(shape: &Shape, transforms: &[Mat4], weights: &[f32]) -> [Vec3; 2] {
        let (mut position, mut normal) = ([Vec3::ZERO], [Vec3::ZERO]);
        let vertices = Vertices { positions: &mut position, normals: &mut normal, tangents: &mut [] };
        shape.place(0, transforms, weights, vertices);
        [position[0], normal[0]]
    }

    fn placed_tangent(shape: &Shape, transforms: &[Mat4], weights: &[f32]) -> Vec4 {
        let (mut position, mut tangent) = ([Vec3::ZERO], [Vec4::ZERO]);
        let vertices = Vertices { positions: &mut position, normals: &mut [], tangents: &mut tangent };
        shape.place(0, transforms, weights, vertices);
        tangent[0]
    }

    #[test]
    fn tangents_lie_along_moved_surfaces_and_bitangents_are_mirrored_with_them() {
        let near = |found: Vec4, expected: Vec4| assert!(found.distance(expected) < 1e-6, "{found}");
        let quarter = Mat4::from_quat(Quat::from_rotation_z(std::f32::consts::FRAC_PI_2));
        // Along y, and a quarter turn takes y to -x.
        near(placed_tangent(&shape(Vec::new()), &[quarter], &[]), Vec4::new(-1.0, 0.0, 0.0, 1.0));
        let mirrored = Mat4::from_scale(Vec3::new(-3.0, 1.0, 1.0));
        near(placed_tangent(&shape(Vec::new()), &[mirrored], &[]), Vec4::new(0.0, 1.0, 0.0, -1.0));
        // Half by a joint that turns it and half by one that stays.
        let held = shape(vec![vec![hold([0, 1, 0, 0], [0.5, 0.5, 0.0, 0.0])]]);
        let half = std::f32::consts::FRAC_1_SQRT_2;
        near(placed_tangent(&held, &[quarter, Mat4::IDENTITY], &[]), Vec4::new(-half, half, 0.0, 1.0));
        // A slope stretched along x: (1, 1, 0) becomes (2, 1, 0).
        let slope = Shape { tangents: vec![Vec4::new(half, half, 0.0, -1.0)], ..shape(Vec::new()) };
        let along = Vec3::new(2.0, 1.0, 0.0).normalize();
        near(placed_tangent(&slope, &[Mat4::from_scale(Vec3::new(2.0, 1.0, 1.0))], &[]), along.extend(-1.0));
        // Half of a target that turns it by a right angle.
        let target = MorphTarget { tangents: vec![Vec3::new(1.0, -1.0, 0.0)], ..MorphTarget::default() };
        let morphed = Shape { targets: vec![target], ..shape(Vec::new()) };
        near(placed_tangent(&morphed, &[Mat4::IDENTITY], &[0.5]), Vec4::new(half, half, 0.0, 1.0));
        near(placed_tangent(&morphed, &[Mat4::from_scale(Vec3::ZERO)], &[0.5]), Vec4::new(0.0, 0.0, 0.0, 1.0));
    }

    #[test]
    fn a_second_set_of_joints_counts_too() {
        let moves = [1.0, 2.0, 4.0, 8.0, 16.0].map(|y| Mat4::from_translation(Vec3::Y * y));
        let both = shape(vec![
            vec![hold([0, 1, 2, 3], [0.25, 0.125, 0.125, 0.25])],
            vec![hold([4, 0, 0, 0], [0.25, 0.0, 0.0, 0.0])],
        ]);
        // 0.25 · 1 + 0.125 · 2 + 0.125 · 4 + 0.25 · 8 + 0.25 · 16.
        assert_eq!(placed(&both, &moves, &[])[0], Vec3::new(1.0, 7.0, 0.0));
    }

    #[test]
    fn normals_stand_upright_on_stretched_and_mirrored_surfaces() {
        let normal = Vec3::new(1.0, 1.0, 0.0).normalize();
        let slope = Shape { normals: vec![normal], ..shape(Vec::new()) };
        // The surface x + y = 0 becomes x / 2 + y = 0.
        let [_, stretched] = placed(&slope, &[Mat4::from_scale(Vec3::new(2.0, 1.0, 1.0))], &[]);
        assert!(stretched.distance(Vec3::new(0.5, 1.0, 0.0).normalize()) < 1e-6, "{stretched}");
        let [_, mirrored] = placed(&slope, &[Mat4::from_scale(Vec3::new(-1.0, 1.0, 1.0))], &[]);
        assert!(mirrored.distance(Vec3::new(-1.0, 1.0, 0.0).normalize()) < 1e-6, "{mirrored}");
        // Tiny and huge transforms turn them all the same, and flat ones leave the one direction that there is.
        for size in [1e-25, 1e25] {
            let turn = Mat4::from_scale(Vec3::splat(size))
                * Mat4::from_quat(Quat::from_rotation_z(std::f32::consts::FRAC_PI_2));
            let [_, turned] = placed(&shape(Vec::new()), &[turn], &[]);
            assert!(turned.distance(Vec3::Y) < 1e-6, "{turned}");
        }
        let [position, flat] = placed(&slope, &[Mat4::from_scale(Vec3::new(1.0, 0.0, 1.0))], &[]);
        assert!(position == Vec3::X && flat.distance(Vec3::Y) < 1e-6, "{position}, {flat}");
    }

    #[test]
    fn joints_of_scale_zero_pull_to_a_point_without_numbers_that_are_none() {
        let joints = [Mat4::from_scale(Vec3::ZERO), Mat4::from_translation(Vec3::Y)];
        let held = |weights| shape(vec![vec![hold([0, 1, 0, 0], weights)]]);
        assert_eq!(placed(&held([1.0, 0.0, 0.0, 0.0]), &joints, &[]), [Vec3::ZERO, Vec3::ZERO]);
        assert_eq!(placed(&held([0.5, 0.5, 0.0, 0.0]), &joints, &[]), [Vec3::new(0.5, 0.5, 0.0), Vec3::X]);
    }

    #[test]
    fn morph_targets_add_up_and_missing_weights_are_zero() {
        let target =
            |by: Vec3, turn: Vec<Vec3>| MorphTarget { positions: vec![by], normals: turn, tangents: Vec::new() };
        let mut shape = shape(Vec::new());
        shape.targets =
            vec![target(Vec3::Y, vec![Vec3::Y]), target(Vec3::Z * 2.0, Vec::new()), target(Vec3::X, Vec::new())];
        let [position, normal] = placed(&shape, &[Mat4::IDENTITY], &[1.0, 0.5]);
        assert_eq!(position, Vec3::new(1.0, 1.0, 1.0));
        assert!(normal.distance(Vec3::new(1.0, 1.0, 0.0).normalize()) < 1e-6);
        assert_eq!(placed(&shape, &[Mat4::IDENTITY], &[])[0], Vec3::X);
    }

    #[test]
    fn joints_that_do_not_exist_hold_nothing() {
        let mut shape = Shape {
            positions: vec![Vec3::ZERO; 3],
            holds: vec![vec![
                hold([1, 2, 0, 0], [0.25, 0.75, 0.0, 0.0]),
                hold([9, 0, 0, 0], [1.0, 0.0, 0.0, 0.0]),
                hold([0, 9, 0, 0], [1.0, 0.0, 0.0, 0.0]),
            ]],
            ..Shape::default()
        };
        assert_eq!(shape.drop_joints(2), 2, "the last names one that holds nothing");
        let found: Vec<_> = shape.holds[0].iter().map(|hold| (hold.joints[0], hold.weights[0])).collect();
        assert_eq!(found, [(1, 1.0), (0, 1.0), (0, 1.0)]);
    }
}
