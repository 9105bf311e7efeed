//! Meshes whose copies stand together: each copy of one has a copy of the other at the same relative place, as walls and roofs of houses do.

use bvhscope_engine::Copies;
use bvhscope_engine::cancel::{CancelToken, Cancelled, MEDIUM_STEPS};
use bvhscope_engine::geometry::{Aabb, Placement, Triangle};
use glam::{DMat4, DVec3, DVec4};

use crate::scene::SceneCopies;

/// Part of the largest terms of a coordinate by which two places may differ to be the same: 64 units in the last place, as transforms of files
/// are products of several.
const SLACK: f64 = 1.0 / (1 << 18) as f64;
/// Copies of the other mesh, the nearest to the first copy, that are tried as its partner.
const MOST_TRIED: usize = 16;

/// Two meshes whose copies stand together.
#[derive(Debug)]
pub struct MeshPair {
    /// Indices of both.
    pub meshes: [u32; 2],
    /// From the coordinates of the second to those of the first.
    pub relative: DMat4,
}

/// A mesh and its copies.
struct Group {
    mesh: u32,
    bounds: Aabb,
    /// The largest sum of the absolute terms of a coordinate of its copies.
    reach: f64,
    /// Where its copies stand, by the translation along x.
    copies: Vec<DMat4>,
}

/// The pairs among `meshes` whose copies stand together with boxes that touch, in the order of `meshes`.
///
/// # Errors
///
/// Once `token` is cancelled.
pub fn mesh_pairs(copies: &SceneCopies, meshes: &[u32], token: &CancelToken) -> Result<Vec<MeshPair>, Cancelled> {
    let groups = groups(copies, meshes, token)?;
    let mut pairs = Vec::new();
    for (at, first) in groups.iter().enumerate() {
        for second in groups.iter().skip(at + 1) {
            pairs.extend(first.pair(second, token)?);
        }
    }
    Ok(pairs)
}

fn groups(scene: &SceneCopies, meshes: &[u32], token: &CancelToken) -> Result<Vec<Group>, Cancelled> {
    let copies: &Copies = scene.copies();
    let group = |&mesh: &u32| {
        let bounds = scene.mesh(mesh).iter().fold(Aabb::EMPTY, |all, triangle| all.union(&triangle.bounds()));
        Group { mesh, bounds, reach: 0.0, copies: Vec::new() }
    };
    let mut groups: Vec<Group> = meshes.iter().map(group).collect();
    for copy in 0..copies.len() as u32 {
        token.check_every(MEDIUM_STEPS, copy as usize)?;
        if let Some(group) = groups.iter_mut().find(|group| group.mesh == copies.mesh(copy)) {
            let place = matrix(copies.place(copy));
            group.reach = group.reach.max(largest_coordinate(&place, farthest(&group.bounds)));
            group.copies.push(place);
        }
    }
    for group in &mut groups {
        group.copies.sort_by(|a, b| a.w_axis.x.total_cmp(&b.w_axis.x));
    }
    Ok(groups)
}

fn matrix(place: &Placement) -> DMat4 {
    let [x, y, z] = place.rows().map(|row| DVec4::from_array(row.map(f64::from)));
    DMat4::from_cols(x, y, z, DVec4::W).transpose()
}

/// A triangle moved by `matrix`, its corners rounded once.
pub fn moved(matrix: &DMat4, triangle: &Triangle) -> Triangle {
    let [a, b, c] =
        [triangle.a, triangle.b, triangle.c].map(|corner| matrix.transform_point3(corner.as_dvec3()).as_vec3());
    Triangle { a, b, c }
}

impl Group {
    /// The pair with `other`; `None` where their copies do not stand together.
    fn pair(&self, other: &Self, token: &CancelToken) -> Result<Option<MeshPair>, Cancelled> {
        if self.copies.len() != other.copies.len() {
            return Ok(None);
        }
        let Some(first) = self.copies.first() else { return Ok(None) };
        let inverse = first.inverse();
        let middle = self.bounds.center().as_dvec3();
        let middle_of_other = other.bounds.center().as_dvec3();
        let mut tried: Vec<(f64, DMat4)> = Vec::with_capacity(other.copies.len());
        for (at, place) in other.copies.iter().enumerate() {
            token.check_every(MEDIUM_STEPS, at)?;
            let relative = inverse * *place;
            if self.touches(&relative, &other.bounds) {
                tried.push((relative.transform_point3(middle_of_other).distance_squared(middle), relative));
            }
        }
        tried.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        for (_, relative) in tried.into_iter().take(MOST_TRIED) {
            if self.is_joined(other, &relative, token)? {
                return Ok(Some(MeshPair { meshes: [self.mesh, other.mesh], relative }));
            }
        }
        Ok(None)
    }

    /// Tells if the box of the mesh touches `bounds` moved by `relative`, up to rounding.
    fn touches(&self, relative: &DMat4, bounds: &Aabb) -> bool {
        let corner = |at: u32| {
            let side = |axis: usize| if at >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] };
            relative.transform_point3(DVec3::from_array([0, 1, 2].map(|axis| f64::from(side(axis)))))
        };
        let (min, max) = (0..8)
            .map(corner)
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), corner| (min.min(corner), max.max(corner)));
        let (own_min, own_max) = (self.bounds.min.as_dvec3(), self.bounds.max.as_dvec3());
        let slack = (own_max - own_min).max_element().max((max - min).max_element()) * SLACK;
        min.cmple(own_max + slack).all() && max.cmpge(own_min - slack).all()
    }

    /// Tells if each copy has one of `other`, of its own, at the `relative` place.
    fn is_joined(&self, other: &Self, relative: &DMat4, token: &CancelToken) -> Result<bool, Cancelled> {
        let mut is_taken = vec![false; other.copies.len()];
        // A relative place is off by the rounding of the places that it comes from, wherever those stand.
        let slack = self.reach.max(other.reach) * SLACK;
        let farthest = farthest(&other.bounds);
        for (at, place) in self.copies.iter().enumerate() {
            token.check_every(MEDIUM_STEPS, at)?;
            let expected = *place * *relative;
            let first = other.copies.partition_point(|found| found.w_axis.x < expected.w_axis.x - slack);
            let near = other.copies.iter().enumerate().skip(first);
            let mut near = near.take_while(|(_, found)| found.w_axis.x <= expected.w_axis.x + slack);
            let is_partner = |(at, found): &(usize, &DMat4)| {
                !is_taken[*at] && largest_coordinate(&(**found - expected), farthest) <= slack
            };
            let Some((partner, _)) = near.find(is_partner) else { return Ok(false) };
            is_taken[partner] = true;
        }
        Ok(true)
    }
}

/// The largest absolute coordinates of a box.
fn farthest(bounds: &Aabb) -> DVec3 {
    bounds.min.abs().max(bounds.max.abs()).as_dvec3()
}

/// The largest sum of the absolute terms of a coordinate of the points up to `farthest`.
fn largest_coordinate(matrix: &DMat4, farthest: DVec3) -> f64 {
    let [x, y, z, translation] = matrix.to_cols_array_2d().map(|[x, y, z, _]| DVec3::new(x, y, z).abs());
    (x * farthest.x + y * farthest.y + z * farthest.z + translation).max_element()
}
