//! A height field of fractal value noise, coloured by height and slope.

use glam::Vec3;

use super::shapes::paint;
use crate::scene::assemble::{Assembly, VertexLists, collect_cancellable};
use crate::scene::error::FileLocation;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::kernel::parallel::par_tasks;

/// A square of side 2 with about, and at most, `triangles` triangles; at least 2.
pub(super) fn build(triangles: u32, assembly: &mut Assembly, token: &CancelToken) -> Result<(), Cancelled> {
    let cells = (triangles / 2).isqrt().max(1);
    let side = cells + 1;
    assembly.materials.push(paint("ground", [1.0; 3]));
    let step = 2.0 / cells as f32;
    let rows: Vec<Vec<(Vec3, Vec3, Vec3)>> = par_tasks(0..side, token, |row, _| {
        Ok((0..side).map(|column| vertex(column as f32 * step - 1.0, row as f32 * step - 1.0)).collect())
    })?;
    let vertices = collect_cancellable((side * side) as usize, rows.into_iter().flatten(), token)?;
    token.set_progress(0.6);
    let lists = VertexLists {
        normals: collect_cancellable(vertices.len(), vertices.iter().map(|vertex| vertex.1), token)?,
        colors: collect_cancellable(vertices.len(), vertices.iter().map(|vertex| vertex.2), token)?,
        ..VertexLists::default()
    };
    let first = assembly.add_vertices(vertices.len(), &lists, token)?;
    for row in 0..cells {
        token.check()?;
        for column in 0..cells {
            let a = row * side + column;
            let [b, c, d] = [a + side, a + side + 1, a + 1];
            for corners in [[a, b, c], [a, c, d]] {
                let [a, b, c] = corners.map(|corner| vertices[corner as usize].0);
                assembly.push(Triangle { a, b, c }, first.map(|f| corners.map(|k| f + k)), 0, || FileLocation::File);
            }
        }
    }
    Ok(())
}

/// Position, normal and colour of the vertex at (x, z).
fn vertex(x: f32, z: f32) -> (Vec3, Vec3, Vec3) {
    const STEP: f32 = 1e-3;
    let y = height(x, z);
    let normal = Vec3::new(y - height(x + STEP, z), STEP, y - height(x, z + STEP)).normalize();
    let grass = Vec3::new(0.22, 0.32, 0.10);
    let rock = Vec3::new(0.38, 0.31, 0.25);
    let snow = Vec3::new(0.85, 0.86, 0.88);
    let smooth = |low: f32, high: f32, value: f32| {
        let t = ((value - low) / (high - low)).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    };
    let color = rock.lerp(grass, smooth(0.55, 0.8, normal.y)).lerp(snow, smooth(0.42, 0.55, y));
    (Vec3::new(x, y, z), normal, color)
}

/// Twelve octaves of noise, each with half the amplitude and twice the frequency; the fine ones are damped in the valleys.
fn height(x: f32, z: f32) -> f32 {
    let (mut sum, mut amplitude, mut frequency) = (0.0_f32, 0.4, 1.5);
    for octave in 0..12 {
        sum += amplitude * noise(x * frequency, z * frequency, octave) * if octave < 2 { 1.0 } else { 0.4 + sum };
        amplitude *= 0.5;
        frequency *= 2.0;
    }
    sum
}

/// Value noise: random values in 0..1 at integer coordinates with smooth interpolation.
pub(super) fn noise(x: f32, z: f32, seed: u32) -> f32 {
    let (fx, fz) = (x.floor(), z.floor());
    let smooth = |t: f32| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let (u, v) = (smooth(x - fx), smooth(z - fz));
    let value = |dx: i32, dz: i32| {
        let (x, z) = ((fx as i32).wrapping_add(dx).cast_unsigned(), (fz as i32).wrapping_add(dz).cast_unsigned());
        let mut h = x.wrapping_mul(0x9E37_79B1) ^ z.wrapping_mul(0x85EB_CA77) ^ seed.wrapping_mul(0xC2B2_AE3D);
        h = (h ^ h >> 15).wrapping_mul(0x2C1B_3C6D);
        h = (h ^ h >> 12).wrapping_mul(0x297A_2D39);
        ((h ^ h >> 15) >> 8) as f32 / (1 << 24) as f32
    };
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    mix(mix(value(0, 0), value(1, 0), u), mix(value(0, 1), value(1, 1), u), v)
}
