//! Vehicles on round lanes, of which neighbours go opposite ways: copies that move as they are.

use std::f32::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DMat4, DQuat, DVec3, Vec3};

use super::ground::Ground;
use super::mesh::Mesh;
use super::shapes::{Random, paint};
use crate::scene::assemble::Assembly;
use crate::scene::motion::{
    Clip, CopyMotion, Curve, Interpolation, Local, Moment, Rig, RigCopy, RigNode, Target, Track,
};
use crate::scene::placed_meshes::PlacedMeshes;
use bvhscope_engine::Placed;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// Radius of the innermost lane.
const FIRST: f32 = 8.0;
/// Distance between lanes.
const WIDTH: f32 = 3.5;
/// Distance from one vehicle of a lane to the next, or a little more.
const SPACING: f32 = 7.0;
/// Length of the clip in seconds.
const SECONDS: f32 = 4.0;
/// Keys of a clip after the first, between which a lane turns by less than half a turn.
const KEYS: u16 = 8;
/// Number of cells along a side of the ground.
const CELLS: u32 = 32;
/// Upper bound of the number of triangles of ground and vehicles, each counted once.
pub(super) const MESH_TRIANGLES: usize = 2 * 32 * 32 + 8 * 32 + 3 * 500;

/// A ground with `vehicles` vehicles.
pub(super) fn build(vehicles: u32, assembly: &mut Assembly, token: &CancelToken) -> Result<PlacedMeshes, Cancelled> {
    let colors = [
        ("asphalt", [0.2; 3]),
        ("red", [0.5, 0.07, 0.06]),
        ("white", [0.7; 3]),
        ("blue", [0.1, 0.2, 0.4]),
        ("tyre", [0.03; 3]),
    ];
    assembly.materials = colors.map(|(name, color)| paint(name, color)).into();
    let mut rig = Rig { clips: vec![Vec::new()], ..Rig::default() };
    let (mut meshes, mut radius) = (vec![0], FIRST);
    rig.nodes.push(node());
    rig.copies.push(RigCopy { node: 0, transform: DMat4::IDENTITY });
    while meshes.len() <= vehicles as usize {
        token.check()?;
        let (lane, mut random) = (rig.nodes.len(), Random::of(16, rig.nodes.len()));
        let direction = if lane.is_multiple_of(2) { -1.0 } else { 1.0 };
        add_turn(direction * (8.0 + 6.0 * random.unit()) / radius, &mut rig);
        let count = (TAU * radius / SPACING).floor();
        for place in 0..(count as usize).min(vehicles as usize + 1 - meshes.len()) {
            let around = DQuat::from_rotation_y((TAU * place as f32 / count).into());
            let forwards = DQuat::from_rotation_y(if direction > 0.0 { 0.0 } else { PI.into() });
            let transform = DMat4::from_rotation_translation(around * forwards, around * DVec3::X * f64::from(radius));
            rig.copies.push(RigCopy { node: lane, transform });
            meshes.push(1 + (3.0 * random.unit()) as u32);
        }
        radius += WIDTH;
    }
    let asphalt = |at: Vec3| Vec3::splat(if at.x.hypot(at.z) > FIRST - 0.5 * WIDTH { 1.0 } else { 1.6 });
    let ground = Ground::new(2.0 * radius + WIDTH, CELLS, |_, _| 0.0, token)?.finish(0.3, asphalt, assembly, token)?;
    let mut ranges = vec![ground];
    for kind in 0..3 {
        ranges.push(vehicle(kind).finish(assembly, token)?);
    }
    let places = rig.of_copies(Moment { clip: 0, seconds: 0.0 });
    let placed = meshes.into_iter().zip(places).map(|(mesh, transform)| Placed { mesh, transform }).collect();
    let clips = vec![Clip { name: "drive".to_owned(), start: 0.0, end: SECONDS }];
    Ok(PlacedMeshes { meshes: ranges, placed, motion: Some(CopyMotion { clips, rig: Arc::new(rig) }) })
}

/// A node at the middle.
fn node() -> RigNode {
    RigNode { parent: None, local: Local::default(), is_visible: true, weights: Vec::new() }
}

/// Adds a node that turns about the upright axis, by so many radians a second.
fn add_turn(speed: f32, rig: &mut Rig) {
    let times: Arc<[f32]> = (0..=KEYS).map(|key| SECONDS * f32::from(key) / f32::from(KEYS)).collect();
    let turn = |time: &f32| DQuat::from_rotation_y((time * speed).into()).as_quat().to_array();
    let values = times.iter().flat_map(turn).collect();
    rig.clips[0].push(Track { target: Target::Rotation(rig.nodes.len()), curve: rig.curves.len() });
    rig.curves.push(Curve::new(times, values, 4, Interpolation::Linear));
    rig.nodes.push(node());
}

/// A car, a van or a lorry on the ground, which looks along -z.
fn vehicle(kind: u32) -> Mesh {
    let mut mesh = Mesh::new();
    mesh.paint(1 + kind, Vec3::ONE);
    // Centre and size of its two parts.
    let parts = [
        [[[0.0, 0.6, 0.0], [1.8, 0.6, 4.2]], [[0.0, 1.15, 0.3], [1.5, 0.5, 2.2]]],
        [[[0.0, 0.7, 0.0], [1.9, 0.8, 4.8]], [[0.0, 1.5, 0.4], [1.8, 0.8, 4.0]]],
        [[[0.0, 1.3, -2.4], [2.2, 2.0, 1.4]], [[0.0, 1.7, 0.8], [2.4, 2.6, 4.6]]],
    ];
    for [center, size] in parts[kind as usize] {
        mesh.cuboid(center, size);
    }
    mesh.paint(4, Vec3::ONE);
    for (x, z) in [(-0.85, -1.4), (0.85, -1.4), (-0.85, 1.4), (0.85, 1.4)] {
        mesh.ball(Vec3::new(x, 0.35, z), Vec3::new(0.15, 0.35, 0.35), [10, 6]);
    }
    mesh
}
