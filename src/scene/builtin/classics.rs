//! Small scenes: the Cornell box, the sphere flake, slivers and clusters.

use glam::{Quat, Vec3};

use super::shapes::{Random, paint, quad, sphere};
use crate::scene::assemble::Assembly;
use crate::scene::error::FileLocation;
use crate::scene::material::Material;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::Triangle;

/// Base colours of the materials, linear RGB.
pub(super) const PALETTE: [[f32; 3]; 6] = [
    [0.62, 0.42, 0.32],
    [0.70, 0.52, 0.22],
    [0.30, 0.46, 0.40],
    [0.22, 0.38, 0.55],
    [0.58, 0.25, 0.24],
    [0.66, 0.62, 0.54],
];

fn add_palette(assembly: &mut Assembly) {
    for color in PALETTE {
        assembly.materials.push(paint("", color));
    }
}

/// The room of the Cornell box: of width 2, open at the front, with a light panel.
pub(super) fn room(assembly: &mut Assembly) {
    let light = Material { emissive: Vec3::new(4.0, 3.6, 3.0), ..paint("light", [0.8; 3]) };
    assembly.materials = vec![
        paint("white", [0.72, 0.71, 0.68]),
        paint("red", [0.57, 0.05, 0.05]),
        paint("green", [0.12, 0.42, 0.10]),
        light,
    ];
    let (x, y, z) = (Vec3::X * 2.0, Vec3::Y * 2.0, Vec3::Z * 2.0);
    let corner = Vec3::new(-1.0, 0.0, -1.0);
    quad(assembly, corner, z, x, 0);
    quad(assembly, corner + y, x, z, 0);
    quad(assembly, corner, x, y, 0);
    quad(assembly, corner, y, z, 1);
    quad(assembly, corner + x, z, y, 2);
    quad(assembly, Vec3::new(-0.3, 1.99, -0.3), x * 0.3, z * 0.3, 3);
    assembly.mesh_count = 6;
}

/// The Cornell box: its room with two boxes.
pub(super) fn cornell(assembly: &mut Assembly) {
    room(assembly);
    for (center, half, turn) in [
        (Vec3::new(-0.35, 0.6, -0.35), Vec3::new(0.3, 0.6, 0.3), 0.3),
        (Vec3::new(0.35, 0.3, 0.35), Vec3::splat(0.3), -0.3),
    ] {
        let turn = Quat::from_rotation_y(turn);
        let [x, y, z] = [Vec3::X * half.x, Vec3::Y * half.y, Vec3::Z * half.z].map(|axis| turn * axis);
        for (n, u, v) in [(x, y, z), (y, z, x), (z, x, y)] {
            quad(assembly, center + n - u - v, u * 2.0, v * 2.0, 0);
            quad(assembly, center - n - u - v, v * 2.0, u * 2.0, 0);
        }
    }
    assembly.mesh_count += 2;
}

/// The sphere flake (Haines, "A Proposal for Standard Graphics Environments", 1987): nine spheres of a third of the radius on
/// each sphere of the previous level.
pub(super) fn flake(levels: u32, assembly: &mut Assembly, token: &CancelToken) -> Result<(), Cancelled> {
    add_palette(assembly);
    let mut stack = vec![(Vec3::ZERO, 1.0_f32, Vec3::Y, 0)];
    while let Some((center, radius, up, level)) = stack.pop() {
        assembly.mesh_count += 1;
        let slices = [48, 32, 20, 12, 8, 6][level as usize % 6];
        sphere(assembly, center, radius, [slices, slices / 2], level, token)?;
        if level == levels {
            continue;
        }
        let turn = Quat::from_rotation_arc(Vec3::Y, up);
        for k in 0..9_u32 {
            // Six around the equator and three above.
            let (height, angle) = if k < 6 { (0.0, k as f32) } else { (0.816_496_6, 2.0 * k as f32 + 0.5) };
            let (sin, cos) = (angle * std::f32::consts::FRAC_PI_3).sin_cos();
            let flat = (1.0_f32 - height * height).sqrt();
            let direction = turn * Vec3::new(cos * flat, height, sin * flat);
            let child = radius / 3.0;
            stack.push((center + direction * (radius + child), child, direction.normalize(), level + 1));
        }
    }
    Ok(())
}

/// Randomly oriented triangles, a hundred times longer than wide.
pub(super) fn slivers(count: u32, assembly: &mut Assembly, token: &CancelToken) -> Result<(), Cancelled> {
    add_palette(assembly);
    let mut random = Random(1);
    for index in 0..count {
        if index % 16_384 == 0 {
            token.check()?;
            token.set_progress(index as f32 / count as f32);
        }
        let center = random.cube();
        let along = random.direction() * (0.1 + 0.3 * random.unit());
        let across = along.cross(random.direction()).normalize_or(Vec3::X) * along.length() * 0.01;
        let triangle = Triangle { a: center - along, b: center + along, c: center + across };
        assembly.push(triangle, None, index % PALETTE.len() as u32, || FileLocation::File);
    }
    Ok(())
}

/// Spheres of varying size in eight dense groups far apart.
pub(super) fn clusters(count: u32, assembly: &mut Assembly, token: &CancelToken) -> Result<(), Cancelled> {
    add_palette(assembly);
    let mut random = Random(2);
    let groups: [Vec3; 8] = std::array::from_fn(|_| random.cube() * 20.0);
    for index in 0..count {
        if index % 64 == 0 {
            token.set_progress(index as f32 / count as f32);
        }
        let group = groups[index as usize % groups.len()];
        let center = group + random.direction() * random.unit() * 1.5;
        let radius = 0.05 + 0.25 * random.unit() * random.unit();
        sphere(assembly, center, radius, [16, 8], index % PALETTE.len() as u32, token)?;
    }
    assembly.mesh_count = count as usize;
    Ok(())
}
