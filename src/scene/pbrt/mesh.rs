//! Meshes of PBRT shapes: lists of vertices as they are, curved surfaces as grids.

use glam::{DMat4, DVec3, Vec2, Vec3};

use crate::scene::error::FileLocation;

/// Quads of a full circle, and of half of one from pole to pole.
const SEGMENTS: [usize; 2] = [32, 16];
/// Quads along each side of a patch that is not flat.
const PATCH_SEGMENTS: usize = 8;
/// Distance of the fourth corner of a flat patch from the plane of the others, relative to the size of the patch.
const FLATNESS: f64 = 1e-6;

/// A triangle mesh of one material.
#[derive(Default)]
pub(super) struct Mesh {
    pub(super) positions: Vec<DVec3>,
    /// Empty, or one for each position.
    pub(super) normals: Vec<Vec3>,
    /// Empty, or one for each position, v down.
    pub(super) uvs: Vec<Vec2>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) material: u32,
    /// The place of the shape.
    pub(super) place: Option<FileLocation>,
}

/// A point of a surface and its normal.
type Sample = (DVec3, DVec3);

impl Mesh {
    /// Samples a surface at `columns` + 1 times `rows` + 1 points with u and v from 0 to 1. Triangles that have no area, as at
    /// poles, are left out.
    fn grid([columns, rows]: [usize; 2], sample: impl Fn(f64, f64) -> Sample) -> Self {
        let mut mesh = Self::default();
        for row in 0..=rows {
            for column in 0..=columns {
                let (u, v) = (column as f64 / columns as f64, row as f64 / rows as f64);
                let (point, normal) = sample(u, v);
                mesh.positions.push(point);
                mesh.normals.push(normal.as_vec3());
                mesh.uvs.push(Vec2::new(u as f32, 1.0 - v as f32));
            }
        }
        let width = columns.saturating_add(1);
        let at = |column: usize, row: usize| row.saturating_mul(width).saturating_add(column);
        for row in 0..rows {
            for column in 0..columns {
                let (right, up) = (column.saturating_add(1), row.saturating_add(1));
                let [a, b, c, d] = [at(column, row), at(right, row), at(right, up), at(column, up)];
                for corners in [[a, b, c], [a, c, d]] {
                    let [p, q, r] = corners.map(|corner| mesh.positions[corner]);
                    if p != q && q != r && r != p {
                        mesh.triangles.push(corners.map(|corner| corner as u32));
                    }
                }
            }
        }
        mesh
    }

    /// A sphere around the origin between two heights, `phi_max` radians around z.
    pub(super) fn sphere(radius: f64, z: [f64; 2], phi_max: f64) -> Self {
        let [from, to] = [z[0].min(z[1]), z[0].max(z[1])].map(|z| (z / radius).clamp(-1.0, 1.0).acos());
        let rows = parts(SEGMENTS[1], (from - to) / std::f64::consts::PI);
        Self::grid([parts(SEGMENTS[0], phi_max / std::f64::consts::TAU), rows], |u, v| {
            let (theta, phi) = (from + (to - from) * v, phi_max * u);
            // The poles are points, whatever rounding makes of π.
            let ring = if theta.sin().abs() < 1e-12 { 0.0 } else { theta.sin() };
            let normal = around(phi, ring) + DVec3::Z * theta.cos();
            (normal * radius, normal)
        })
    }

    /// A ring or disk at a height, facing z.
    pub(super) fn disk(height: f64, radius: f64, inner: f64, phi_max: f64) -> Self {
        Self::grid([parts(SEGMENTS[0], phi_max / std::f64::consts::TAU), 1], |u, v| {
            (around(phi_max * u, radius + (inner - radius) * v) + DVec3::Z * height, DVec3::Z)
        })
    }

    /// The side of a cylinder around z.
    pub(super) fn cylinder(radius: f64, z: [f64; 2], phi_max: f64) -> Self {
        let [from, to] = [z[0].min(z[1]), z[0].max(z[1])];
        Self::grid([parts(SEGMENTS[0], phi_max / std::f64::consts::TAU), 1], |u, v| {
            let normal = around(phi_max * u, 1.0);
            (normal * radius + DVec3::Z * (from + (to - from) * v), normal)
        })
    }

    /// A bilinear patch between corners at (0, 0), (1, 0), (0, 1) and (1, 1), with their normals if there are such.
    pub(super) fn patch(corners: [DVec3; 4], normals: Option<[DVec3; 4]>) -> Self {
        let blend =
            |values: [DVec3; 4], u: f64, v: f64| values[0].lerp(values[1], u).lerp(values[2].lerp(values[3], u), v);
        let [a, b, c, d] = corners;
        let plane = (b - a).cross(c - a);
        let size = [b, c, d].into_iter().map(|corner| (corner - a).length()).fold(0.0, f64::max);
        let is_flat = (d - a).dot(plane).abs() <= FLATNESS * size * plane.length();
        let side = if is_flat { 1 } else { PATCH_SEGMENTS };
        let mut mesh = Self::grid([side; 2], |u, v| {
            let along_u = (b - a).lerp(d - c, v);
            let along_v = (c - a).lerp(d - b, u);
            let normal = normals.map_or_else(|| along_u.cross(along_v), |normals| blend(normals, u, v));
            (blend(corners, u, v), normal.normalize_or_zero())
        });
        if is_flat && normals.is_none() {
            mesh.normals.clear();
        }
        mesh
    }

    /// Appends another mesh with the same lists.
    pub(super) fn append(&mut self, other: Self) {
        let first = self.positions.len() as u32;
        self.positions.extend(other.positions);
        self.normals.resize(if other.normals.is_empty() { 0 } else { first as usize }, Vec3::ZERO);
        self.normals.extend(other.normals);
        self.uvs.extend(other.uvs);
        self.triangles.extend(other.triangles.iter().map(|corners| corners.map(|corner| corner.saturating_add(first))));
    }

    /// Moves the mesh from the space of its shape to that of the scene. A mirrored shape keeps its front; a reversed one does not.
    pub(super) fn transform(&mut self, transform: DMat4, is_reversed: bool) {
        for point in &mut self.positions {
            *point = transform.transform_point3(*point);
        }
        let side = if is_reversed { -1.0 } else { 1.0 };
        let to_scene = normal_transform(transform);
        for normal in &mut self.normals {
            *normal = (to_scene.transform_vector3(normal.as_dvec3()) * side).as_vec3().normalize_or_zero();
        }
        if is_mirrored(transform) != is_reversed {
            self.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
        }
    }

    /// Bytes of the lists, about.
    pub(super) fn bytes(&self) -> u64 {
        let lists = [
            size_of_val(&self.positions[..]),
            size_of_val(&self.normals[..]),
            size_of_val(&self.uvs[..]),
            size_of_val(&self.triangles[..]),
            size_of::<Self>(),
        ];
        lists.into_iter().fold(0, |sum: u64, bytes| sum.saturating_add(bytes as u64))
    }
}

/// Whether a transform turns left into right.
pub(super) fn is_mirrored(transform: DMat4) -> bool {
    let [x, y, z] =
        [transform.x_axis, transform.y_axis, transform.z_axis].map(|axis| axis.truncate().normalize_or_zero());
    x.cross(y).dot(z) < 0.0
}

/// The transform of normals: the cofactor matrix, which is the inverse transpose up to a factor and also exists for singular
/// transforms.
pub(super) fn normal_transform(transform: DMat4) -> DMat4 {
    let [x, y, z] = [transform.x_axis, transform.y_axis, transform.z_axis].map(glam::DVec4::truncate);
    // Products of very small or large numbers leave the range.
    let largest = x.abs().max(y.abs()).max(z.abs()).max_element().max(f64::MIN_POSITIVE);
    let [x, y, z] = [x / largest, y / largest, z / largest];
    let sign = if is_mirrored(transform) { -1.0 } else { 1.0 };
    let [x, y, z] = [y.cross(z), z.cross(x), x.cross(y)].map(|axis| (axis * sign).extend(0.0));
    DMat4::from_cols(x, y, z, glam::DVec4::W)
}

/// A point of a circle around z.
fn around(phi: f64, radius: f64) -> DVec3 {
    DVec3::new(radius * phi.cos(), radius * phi.sin(), 0.0)
}

/// Number of quads of a part of what has `whole`, at least one.
fn parts(whole: usize, part: f64) -> usize {
    ((whole as f64 * part.clamp(0.0, 1.0)).ceil() as usize).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(mesh: &Mesh) -> DVec3 {
        let parts = mesh.triangles.iter().map(|corners| {
            let [a, b, c] = corners.map(|corner| mesh.positions[corner as usize]);
            (b - a).cross(c - a) * 0.5
        });
        parts.fold(DVec3::ZERO, |sum, part| sum + part)
    }

    /// Six times the volume that the mesh encloses around the origin.
    fn volume(mesh: &Mesh) -> f64 {
        let parts = mesh.triangles.iter().map(|corners| {
            let [a, b, c] = corners.map(|corner| mesh.positions[corner as usize]);
            a.dot(b.cross(c))
        });
        parts.sum::<f64>() / 6.0
    }

    #[test]
    fn curved_surfaces_face_outward() {
        let sphere = Mesh::sphere(2.0, [-2.0, 2.0], std::f64::consts::TAU);
        // 32 · 16 quads, of which those at the poles are triangles.
        assert_eq!(sphere.triangles.len(), 32 * 16 * 2 - 2 * 32);
        let exact = 4.0 / 3.0 * std::f64::consts::PI * 8.0;
        assert!((0.96..1.0).contains(&(volume(&sphere) / exact)), "{}", volume(&sphere) / exact);
        let disk = Mesh::disk(3.0, 2.0, 1.0, std::f64::consts::TAU);
        let exact = 3.0 * std::f64::consts::PI;
        assert!((0.98..1.0).contains(&(area(&disk).z / exact)) && disk.positions.iter().all(|point| point.z == 3.0));
        let cylinder = Mesh::cylinder(1.0, [1.0, -1.0], std::f64::consts::TAU);
        assert!(volume(&cylinder) > 0.0 && area(&cylinder).length() < 1e-12);
        for mesh in [sphere, disk, cylinder] {
            let fronts = mesh.triangles.iter().all(|corners| {
                let [a, b, c] = corners.map(|corner| mesh.positions[corner as usize]);
                let normal = mesh.normals[corners[0] as usize].as_dvec3();
                (b - a).cross(c - a).dot(normal) > 0.0
            });
            assert!(fronts);
        }
    }

    #[test]
    fn only_bent_patches_are_cut_finely() {
        let corner = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let square = [corner(0.0, 0.0, 0.0), corner(1.0, 0.0, 0.0), corner(0.0, 1.0, 0.0), corner(1.0, 1.0, 0.0)];
        let flat = Mesh::patch(square, None);
        assert_eq!((flat.triangles.len(), area(&flat)), (2, DVec3::Z));
        let mut bent = square;
        bent[3].z = 1.0;
        let bent = Mesh::patch(bent, None);
        assert_eq!(bent.triangles.len(), 2 * PATCH_SEGMENTS * PATCH_SEGMENTS);
        // The middle of the patch is a quarter up.
        assert!(bent.positions.contains(&corner(0.5, 0.5, 0.25)));
    }

    #[test]
    fn mirrored_meshes_keep_their_front_and_reversed_ones_do_not() {
        let mirror = DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0));
        for (transform, is_reversed, side) in
            [(DMat4::IDENTITY, false, 1.0), (mirror, false, 1.0), (DMat4::IDENTITY, true, -1.0), (mirror, true, -1.0)]
        {
            let mut disk = Mesh::disk(0.0, 1.0, 0.0, std::f64::consts::TAU);
            disk.transform(transform, is_reversed);
            assert!(
                area(&disk).z * side > 0.0 && disk.normals[0] == Vec3::Z * side as f32,
                "{transform} {is_reversed}"
            );
        }
    }
}
