//! Building blocks of the built-in scenes: quads, spheres and random numbers.

use glam::{Vec2, Vec3};

use crate::scene::assemble::{Assembly, VertexLists};
use crate::scene::error::FileLocation;
use crate::scene::material::Material;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::Triangle;

/// The SplitMix64 generator (Steele, Lea, Flood 2014): the same numbers on every machine.
pub(super) struct Random(pub(super) u64);

impl Random {
    /// The numbers of one of many things, which do not depend on those of the others.
    pub(super) fn of(seed: u64, index: usize) -> Self {
        Self(seed << 48 | (index as u64) << 8)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ z >> 31
    }

    /// A uniform number in [0, 1).
    pub(super) fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1_u64 << 24) as f32
    }

    /// A uniform point in the cube from -1 to 1.
    pub(super) fn cube(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }

    /// A uniform random unit vector.
    pub(super) fn direction(&mut self) -> Vec3 {
        let y = self.unit() * 2.0 - 1.0;
        let turn = Vec2::from_angle(self.unit() * std::f32::consts::TAU) * (1.0 - y * y).max(0.0).sqrt();
        Vec3::new(turn.x, y, turn.y)
    }
}

/// A diffuse material.
pub(super) fn paint(name: &str, base_color: [f32; 3]) -> Material {
    Material { name: name.to_owned(), base_color: Vec3::from_array(base_color), ..Material::clay() }
}

/// A parallelogram of two triangles, with the winding of `u × v`.
pub(super) fn quad(assembly: &mut Assembly, corner: Vec3, u: Vec3, v: Vec3, material: u32) {
    let [a, b, c, d] = [corner, corner + u, corner + u + v, corner + v];
    assembly.push(Triangle { a, b, c }, None, material, || FileLocation::File);
    assembly.push(Triangle { a, b: c, c: d }, None, material, || FileLocation::File);
}

/// A sphere of `2 * slices * (stacks - 1)` triangles with smooth normals.
pub(super) fn sphere(
    assembly: &mut Assembly,
    center: Vec3,
    radius: f32,
    [slices, stacks]: [u32; 2],
    material: u32,
    token: &CancelToken,
) -> Result<(), Cancelled> {
    let mut normals = Vec::new();
    for stack in 0..=stacks {
        let (height, y) = (std::f32::consts::PI * stack as f32 / stacks as f32).sin_cos();
        for slice in 0..slices {
            let turn = Vec2::from_angle(std::f32::consts::TAU * slice as f32 / slices as f32) * height;
            normals.push(Vec3::new(turn.x, y, -turn.y).normalize_or(Vec3::Y));
        }
    }
    let lists = VertexLists { normals: normals.clone(), ..VertexLists::default() };
    let first = assembly.add_vertices(normals.len(), &lists, token)?;
    let mut add = |corners: [u32; 3]| {
        let [a, b, c] = corners.map(|k| center + radius * normals[k as usize]);
        assembly.push(Triangle { a, b, c }, first.map(|f| corners.map(|k| f + k)), material, || FileLocation::File);
    };
    for stack in 0..stacks {
        for slice in 0..slices {
            let next = (slice + 1) % slices;
            let [a, b] = [stack * slices + slice, stack * slices + next];
            let [c, d] = [a + slices, b + slices];
            if stack > 0 {
                add([a, d, b]);
            }
            if stack + 1 < stacks {
                add([a, c, d]);
            }
        }
    }
    Ok(())
}
