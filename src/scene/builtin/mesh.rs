//! A mesh under construction, of which a scene has copies: its triangles, with normals and colours.

use std::f32::consts::{PI, TAU};
use std::ops::Range;

use glam::{Vec2, Vec3};

use crate::scene::assemble::{Assembly, VertexLists};
use crate::scene::error::FileLocation;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::Triangle;

/// Triangles with normals and colours, in the mesh's own coordinates.
pub(super) struct Mesh {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    colors: Vec<Vec3>,
    triangles: Vec<([u32; 3], u32)>,
    /// The material of triangles that are added next.
    pub(super) material: u32,
    /// The colour of vertices that are added next: multiplies that of the material.
    pub(super) tint: Vec3,
}

impl Mesh {
    /// An empty mesh, of the first material.
    pub(super) fn new() -> Self {
        let (positions, normals, colors) = (Vec::new(), Vec::new(), Vec::new());
        Self { positions, normals, colors, triangles: Vec::new(), material: 0, tint: Vec3::ONE }
    }

    /// Adds the mesh to the scene of all meshes, and returns the indices of its triangles there.
    pub(super) fn finish(self, assembly: &mut Assembly, token: &CancelToken) -> Result<Range<u32>, Cancelled> {
        let start = assembly.triangle_count() as u32;
        let lists = VertexLists { normals: self.normals, colors: self.colors, ..VertexLists::default() };
        let first = assembly.add_vertices(self.positions.len(), &lists, token)?;
        for (index, (corners, material)) in self.triangles.iter().enumerate() {
            token.check_every(1 << 14, index)?;
            let [a, b, c] = corners.map(|corner| self.positions[corner as usize]);
            let corners = first.map(|first| corners.map(|corner| first + corner));
            assembly.push(Triangle { a, b, c }, corners, *material, || FileLocation::File);
        }
        Ok(start..assembly.triangle_count() as u32)
    }

    /// Sets material and tint.
    pub(super) fn paint(&mut self, material: u32, tint: impl Into<Vec3>) {
        (self.material, self.tint) = (material, tint.into());
    }

    pub(super) fn vertex(&mut self, position: Vec3, normal: Vec3) -> u32 {
        self.positions.push(position);
        self.normals.push(normal);
        self.colors.push(self.tint);
        self.positions.len() as u32 - 1
    }

    /// A triangle of three vertices.
    pub(super) fn triangle(&mut self, corners: [u32; 3]) {
        self.triangles.push((corners, self.material));
    }

    /// A flat, convex polygon, anticlockwise as seen from its front.
    pub(super) fn face(&mut self, points: &[Vec3]) {
        let normal = (points[1] - points[0]).cross(points[2] - points[0]).normalize_or(Vec3::Y);
        let first = self.positions.len() as u32;
        for point in points {
            self.vertex(*point, normal);
        }
        (2..points.len() as u32).for_each(|corner| self.triangle([first, first + corner - 1, first + corner]));
    }

    /// A block with these halves of its edges, which are at right angles, the third along the cross product of the others.
    pub(super) fn block(&mut self, center: Vec3, [x, y, z]: [Vec3; 3]) {
        for (n, u, v) in [(x, y, z), (y, z, x), (z, x, y)] {
            self.face(&[center + n - u - v, center + n + u - v, center + n + u + v, center + n - u + v]);
            self.face(&[center - n - u - v, center - n - u + v, center - n + u + v, center - n + u - v]);
        }
    }

    /// A block along the axes.
    pub(super) fn cuboid(&mut self, center: impl Into<Vec3>, size: impl Into<Vec3>) {
        let half = size.into() * 0.5;
        self.block(center.into(), [Vec3::X * half.x, Vec3::Y * half.y, Vec3::Z * half.z]);
    }

    /// A tube around a path of points with radii, open at both ends.
    pub(super) fn tube(&mut self, path: &[(Vec3, f32)], sides: u32) {
        let first = self.positions.len() as u32;
        let mut u = Vec3::ZERO;
        for (index, (point, radius)) in path.iter().enumerate() {
            let [before, after] = [index.saturating_sub(1), (index + 1).min(path.len() - 1)].map(|at| path[at].0);
            let along = (after - before).normalize_or(Vec3::Y);
            // Carried along without a twist.
            u = u.reject_from_normalized(along).normalize_or(along.any_orthonormal_vector());
            let v = along.cross(u);
            for side in 0..sides {
                let around = Vec2::from_angle(TAU * side as f32 / sides as f32);
                let normal = u * around.x + v * around.y;
                self.vertex(point + normal * *radius, normal);
            }
        }
        for segment in 1..path.len() as u32 {
            for side in 0..sides {
                let [c, d] = [side, (side + 1) % sides].map(|side| first + segment * sides + side);
                let [a, b] = [c - sides, d - sides];
                self.triangle([a, b, d]);
                self.triangle([a, d, c]);
            }
        }
    }

    /// A ball of `2 * slices * (stacks - 1)` triangles.
    pub(super) fn ball(&mut self, center: Vec3, radius: Vec3, [slices, stacks]: [u32; 2]) {
        let first = self.positions.len() as u32;
        for stack in 0..=stacks {
            let (width, y) = (PI * stack as f32 / stacks as f32).sin_cos();
            for slice in 0..slices {
                let around = Vec2::from_angle(TAU * slice as f32 / slices as f32) * width;
                let direction = Vec3::new(around.x, y, -around.y);
                self.vertex(center + direction * radius, (direction / radius).normalize_or(Vec3::Y));
            }
        }
        for stack in 0..stacks {
            for slice in 0..slices {
                let [a, b] = [slice, (slice + 1) % slices].map(|slice| first + stack * slices + slice);
                let [c, d] = [a + slices, b + slices];
                if stack > 0 {
                    self.triangle([a, d, b]);
                }
                if stack + 1 < stacks {
                    self.triangle([a, c, d]);
                }
            }
        }
    }

    /// A leaf of two triangles, folded along its middle: from `base` to its tip, half as wide as `across` is long on either side, shaded
    /// as part of a surface that faces `outward`.
    pub(super) fn leaf(&mut self, base: Vec3, along: Vec3, across: Vec3, outward: Vec3) {
        let fold = outward * (0.3 * across.length());
        let [right, left] = [1.0, -1.0].map(|side| base + along * 0.45 + across * side + fold);
        let tip = base + along;
        let own = across.cross(along).normalize_or(outward);
        let normal = (outward + own * (0.5 * own.dot(outward).signum())).normalize_or(outward);
        let corners = [base, right, tip, left].map(|point| self.vertex(point, normal));
        for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
            let [p, q, r] = [a, b, c].map(|corner: usize| self.positions[corners[corner] as usize]);
            // Its front is the side that the normal shows.
            let is_front = (q - p).cross(r - p).dot(normal) >= 0.0;
            self.triangle(if is_front { [a, b, c] } else { [a, c, b] }.map(|corner| corners[corner]));
        }
    }
}
