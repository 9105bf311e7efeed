//! Scenes of thin and slanted things, which boxes along the axes fit badly: curled hair, a meadow, tilted boards.

use std::f32::consts::TAU;

use glam::{Quat, Vec3};

use super::classics::PALETTE;
use super::shapes::{Random, paint, quad};
use crate::scene::assemble::{Assembly, VertexLists};
use crate::scene::error::FileLocation;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::Triangle;

/// Triangles of a strand of hair: a tube of three sides.
pub(super) const STRAND: u32 = 2 * SIDES * SEGMENTS;
const SIDES: u32 = 3;
const SEGMENTS: u32 = 16;
/// Triangles of a blade of grass: a strip that ends in a point.
pub(super) const BLADE: u32 = 7;

/// Hair of curled tubes on the upper half of a head of radius 1, with at most `triangles` triangles; at least [`STRAND`].
pub(super) fn hair(triangles: u32, assembly: &mut Assembly, token: &CancelToken) -> Result<(), Cancelled> {
    assembly.materials = vec![paint("dark", [0.22, 0.11, 0.05]), paint("light", [0.45, 0.26, 0.12])];
    let mut random = Random(3);
    let strands = triangles / STRAND;
    for strand in 0..strands {
        if strand.is_multiple_of(64) {
            token.check()?;
            token.set_progress(strand as f32 / strands as f32);
        }
        let root = random.direction();
        let root = Vec3::new(root.x, root.y.abs(), root.z);
        let curl =
            Curl { root, length: 0.9 + 0.6 * random.unit(), radius: 0.02 + 0.05 * random.unit(), phase: random.unit() };
        tube(&curl, strand % 2, assembly, token)?;
    }
    assembly.mesh_count = strands as usize;
    Ok(())
}

/// The course of a strand: away from the head, drawn down by its weight, around in a helix that widens towards its end.
struct Curl {
    root: Vec3,
    length: f32,
    radius: f32,
    /// Angle at which the helix begins, in turns.
    phase: f32,
}

impl Curl {
    /// Number of turns of the helix.
    const TURNS: f32 = 2.0;

    /// The point at a part of the length, 0 to 1.
    fn at(&self, part: f32) -> Vec3 {
        let (u, v) = self.root.any_orthonormal_pair();
        let (sin, cos) = (TAU * (self.phase + Self::TURNS * part)).sin_cos();
        let out = self.root * (1.0 + self.length * part * (1.0 - 0.5 * part));
        // Combed to the outside, so that a strand that rises on top of the head does not fall back into itself.
        let combed = Vec3::new(self.root.x, 0.0, self.root.z).normalize_or(Vec3::X) * (0.6 * self.length * part);
        out + combed + Vec3::NEG_Y * (0.9 * self.length * part * part) + (u * cos + v * sin) * (self.radius * part)
    }
}

/// A tube of three sides around `curl`, thinner towards its end.
fn tube(curl: &Curl, material: u32, assembly: &mut Assembly, token: &CancelToken) -> Result<(), Cancelled> {
    let (mut points, mut normals) = (Vec::new(), Vec::new());
    // Carried along without a twist: one that is taken from a fixed direction turns over where the strand runs along that.
    let mut u = curl.root.any_orthonormal_vector();
    for segment in 0..=SEGMENTS {
        let [before, part, after] =
            [segment.saturating_sub(1), segment, segment + 1].map(|segment| segment as f32 / SEGMENTS as f32);
        let along = (curl.at(after) - curl.at(before)).normalize_or(curl.root);
        u = u.reject_from_normalized(along).normalize_or(along.any_orthonormal_vector());
        let v = along.cross(u);
        for side in 0..SIDES {
            let (sin, cos) = (TAU * side as f32 / SIDES as f32).sin_cos();
            normals.push(u * cos + v * sin);
            points.push(curl.at(part) + (u * cos + v * sin) * (0.006 * (1.0 - 0.8 * part)));
        }
    }
    let lists = VertexLists { normals, ..VertexLists::default() };
    let first = assembly.add_vertices(points.len(), &lists, token)?;
    let mut add = |corners: [u32; 3]| {
        let [a, b, c] = corners.map(|corner| points[corner as usize]);
        let vertices = first.map(|first| corners.map(|corner| first + corner));
        assembly.push(Triangle { a, b, c }, vertices, material, || FileLocation::File);
    };
    for segment in 0..SEGMENTS {
        for side in 0..SIDES {
            let [a, b] = [side, (side + 1) % SIDES].map(|side| segment * SIDES + side);
            add([a, b, b + SIDES]);
            add([a, b + SIDES, a + SIDES]);
        }
    }
    Ok(())
}

/// A meadow of bent blades of grass on a square of side 2, with at most `triangles` triangles; at least that of the ground and one
/// blade.
pub(super) fn foliage(triangles: u32, assembly: &mut Assembly, token: &CancelToken) -> Result<(), Cancelled> {
    let greens = [[0.10, 0.25, 0.05], [0.20, 0.38, 0.08], [0.34, 0.42, 0.12]];
    assembly.materials = greens.iter().map(|color| paint("grass", *color)).collect();
    assembly.materials.push(paint("soil", [0.16, 0.10, 0.06]));
    quad(assembly, Vec3::new(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, 3);
    let mut random = Random(4);
    let blades = (triangles - 2) / BLADE;
    // As high where they are dense as where they are not, and thinner.
    let width = (0.5 / (blades as f32).sqrt()).clamp(0.000_5, 0.03);
    for blade in 0..blades {
        if blade.is_multiple_of(1024) {
            token.check()?;
            token.set_progress(blade as f32 / blades as f32);
        }
        let (place, towards) = (random.cube(), random.direction());
        let lean = Vec3::new(towards.x, 0.0, towards.z).normalize_or(Vec3::X);
        let (height, reach) = (0.15 + 0.25 * random.unit(), 0.1 + 0.35 * random.unit());
        let across = lean.cross(Vec3::Y) * width;
        let middle = |part: f32| {
            Vec3::new(place.x, 0.0, place.z) + Vec3::Y * (height * part * (2.0 - part)) + lean * (reach * part * part)
        };
        let edge = |step: u32, side: f32| {
            let part = step as f32 / 4.0;
            middle(part) + across * (side * (1.0 - part))
        };
        let mut add = |a: Vec3, b: Vec3, c: Vec3| {
            assembly.push(Triangle { a, b, c }, None, blade % 3, || FileLocation::File);
        };
        for step in 0..3 {
            let [a, b] = [edge(step, -1.0), edge(step, 1.0)];
            let [c, d] = [edge(step + 1, -1.0), edge(step + 1, 1.0)];
            add(a, b, d);
            add(a, d, c);
        }
        add(edge(3, -1.0), edge(3, 1.0), middle(1.0));
    }
    assembly.mesh_count = blades as usize + 1;
    Ok(())
}

/// The room of the Cornell box with `boards` boards in it, each turned its own way.
pub(super) fn tilted(boards: u32, assembly: &mut Assembly, token: &CancelToken) -> Result<(), Cancelled> {
    super::classics::room(assembly);
    let first = assembly.materials.len() as u32;
    assembly.materials.extend(PALETTE.map(|color| paint("board", color)));
    let mut random = Random(5);
    // The same share of the room for any number.
    let size = (boards as f32).cbrt().recip();
    for board in 0..boards {
        if board.is_multiple_of(1024) {
            token.check()?;
            token.set_progress(board as f32 / boards as f32);
        }
        let turn = Quat::from_axis_angle(random.direction(), TAU * random.unit());
        let center = random.cube() * 0.8 + Vec3::Y;
        let [x, y, z] = [Vec3::X * 0.7, Vec3::Y * 0.02, Vec3::Z * 0.16].map(|half| turn * half * size);
        for (n, u, v) in [(x, y, z), (y, z, x), (z, x, y)] {
            quad(assembly, center + n - u - v, u * 2.0, v * 2.0, first + board % PALETTE.len() as u32);
            quad(assembly, center - n - u - v, v * 2.0, u * 2.0, first + board % PALETTE.len() as u32);
        }
    }
    assembly.mesh_count += boards as usize;
    Ok(())
}
