//! Meshes whose copies stand together: each copy of one has a copy of the other at the same relative place, as walls and roofs of houses do.

use bvhscope_engine::Copies;
use bvhscope_engine::cancel::{CancelToken, Cancelled, MEDIUM_STEPS};
use bvhscope_engine::geometry::{Aabb, Placement, Triangle};
use glam::{DMat4, DVec3, Mat4};

use crate::scene::SceneCopies;

/// Part of the largest terms of a coordinate by which two places may differ to be the same: 64 units in the last place, as transforms of files
/// are products of several.
const SLACK: f64 = 1.0 / (1 << 18) as f64;
/// The direction along which copies are listed. Rows and walls of copies stand askew to it, so that few copies are at one place along it.
const ASKEW: DVec3 = DVec3::new(0.324_869, 0.531_287, 0.782_413);
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
    /// Where its copies stand, by their translations along [`ASKEW`].
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
        group.copies.sort_by(|a, b| along(a).total_cmp(&along(b)));
    }
    Ok(groups)
}

fn matrix(place: &Placement) -> DMat4 {
    Mat4::from(place.transform()).as_dmat4()
}

/// The translation of a place along [`ASKEW`].
fn along(place: &DMat4) -> f64 {
    place.w_axis.truncate().dot(ASKEW)
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
        // Of a difference of at most that on each axis, with room for rounding.
        let slack_along = 2.0 * slack;
        let mut compared = 0;
        for place in &self.copies {
            let expected = *place * *relative;
            let start = along(&expected);
            let mut at = other.copies.partition_point(|found| along(found) < start - slack_along);
            loop {
                compared += 1;
                token.check_every(MEDIUM_STEPS, compared)?;
                let Some(found) = other.copies.get(at).filter(|found| along(found) <= start + slack_along) else {
                    return Ok(false);
                };
                if !is_taken[at] && largest_coordinate(&(*found - expected), farthest) <= slack {
                    break;
                }
                at += 1;
            }
            is_taken[at] = true;
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

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use std::fmt::Write as _;
    use std::path::Path;

    use glam::{DMat3, DQuat};

    use super::*;
    use crate::scene::{Instancing, LoadOptions, Scene, load_bytes};

    /// A scene of PBRT with a mesh for each list of places, within the cube from 0 to 1.
    fn scene(meshes: &[&[DMat4]]) -> Scene {
        let mut text = "WorldBegin\n".to_owned();
        for (mesh, places) in meshes.iter().enumerate() {
            let corners = "[0 0 0 1 0 0 0 1 0 1 1 1]";
            let shape = format!("Shape \"trianglemesh\" \"integer indices\" [0 1 2 1 2 3] \"point3 P\" {corners}");
            let _ = writeln!(text, "ObjectBegin \"{mesh}\" {shape} ObjectEnd");
            for place in *places {
                let numbers = place.to_cols_array().map(|number| number.to_string()).join(" ");
                let _ = writeln!(text, "AttributeBegin Transform [{numbers}] ObjectInstance \"{mesh}\" AttributeEnd");
            }
        }
        let options = LoadOptions { instances: Instancing::TwoLevel, ..LoadOptions::default() };
        load_bytes(Path::new("a.pbrt"), text.as_bytes(), &options, &CancelToken::new()).unwrap()
    }

    fn pairs(meshes: &[&[DMat4]]) -> Vec<MeshPair> {
        let scene = scene(meshes);
        let copies = scene.copies.as_deref().unwrap();
        assert_eq!(copies.mesh_count(), meshes.len());
        let all: Vec<u32> = (0..meshes.len() as u32).collect();
        mesh_pairs(copies, &all, &CancelToken::new()).unwrap()
    }

    /// Turned, stretched and sheared, within some tens of the origin.
    fn places() -> Vec<DMat4> {
        let place = |at: u32| {
            let at = f64::from(at);
            let turn = DMat3::from_quat(DQuat::from_axis_angle(DVec3::new(1.0, at, 2.0).normalize(), 0.7 * at));
            let shear = DMat3::from_cols(DVec3::X * (1.0 + 0.1 * at), DVec3::new(0.2, 1.0, 0.0), DVec3::Z);
            let middle = DVec3::new((7.0 * at) % 23.0, (5.0 * at) % 17.0, (3.0 * at) % 11.0);
            DMat4::from_translation(middle) * DMat4::from_mat3(turn * shear)
        };
        (1..=12).map(place).collect()
    }

    /// The place of the second mesh in the coordinates of the first, `away` from it.
    fn relative(away: f64) -> DMat4 {
        let turn = DMat3::from_rotation_z(0.5) * DMat3::from_diagonal(DVec3::new(0.5, 2.0, 1.0));
        DMat4::from_translation(DVec3::new(away, 0.25, -0.5)) * DMat4::from_mat3(turn)
    }

    #[test]
    fn meshes_that_stand_together_are_found_in_any_order() {
        let first = places();
        let mut second: Vec<DMat4> = first.iter().map(|place| *place * relative(0.5)).collect();
        second.reverse();
        second.swap(2, 7);
        let found = pairs(&[&first, &second]);
        assert_eq!(found.iter().map(|pair| pair.meshes).collect::<Vec<_>>(), [[0, 1]]);
        assert!(found[0].relative.abs_diff_eq(relative(0.5), 1e-4), "{}", found[0].relative);
        // Of three each two do.
        let third: Vec<DMat4> = first.iter().map(|place| *place * relative(0.2)).collect();
        let found = pairs(&[&first, &second, &third]);
        assert_eq!(found.iter().map(|pair| pair.meshes).collect::<Vec<_>>(), [[0, 1], [0, 2], [1, 2]]);
        let corner = DVec3::new(0.3, 0.4, 0.5);
        let moved = found[2].relative.transform_point3(corner);
        let expected = (relative(0.5).inverse() * relative(0.2)).transform_point3(corner);
        assert!(moved.distance(expected) < 1e-3, "{moved} and {expected}");
    }

    #[test]
    fn meshes_do_not_stand_together_where_a_copy_stands_elsewhere_or_is_alone() {
        let first = places();
        let second: Vec<DMat4> = first.iter().map(|place| *place * relative(0.5)).collect();
        assert_eq!(pairs(&[&first, &second]).len(), 1);
        let with = |at: usize, place: DMat4| {
            let mut second = second.clone();
            second[at] = place;
            pairs(&[&first, &second]).len()
        };
        let mut moved = second[5];
        moved.w_axis.y += 0.01;
        assert_eq!(with(5, moved), 0);
        let mut wider = second[5];
        wider.y_axis *= 1.01;
        assert_eq!(with(5, wider), 0, "at the same point, with another height");
        assert_eq!(pairs(&[&first, &second[1..]]).len(), 0);
        assert_eq!(pairs(&[&first[1..], &second]).len(), 0);
        let apart: Vec<DMat4> = first.iter().map(|place| *place * relative(5.0)).collect();
        assert_eq!(pairs(&[&first, &apart]).len(), 0, "their boxes do not touch");
        // Two copies at one place need two partners there.
        let mut doubled = first.clone();
        doubled[3] = doubled[4];
        assert_eq!(pairs(&[&doubled, &second]).len(), 0);
        let twice: Vec<DMat4> = doubled.iter().map(|place| *place * relative(0.5)).collect();
        assert_eq!(pairs(&[&doubled, &twice]).len(), 1);
    }
}
