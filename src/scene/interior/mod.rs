//! Models that are looked at from within: those that enclose their centre as a room does, and where to stand in them.
//!
//! Decided without a tree, by small cube maps of what is seen from a few points. A room shows the fronts of its surfaces, a
//! solid object their backs; it has walls at right angles, and is free for much of its length, as a car is not.

mod cube_map;

use std::f32::consts::{FRAC_PI_2, TAU};

use glam::Vec3;

use self::cube_map::{Cell, around, cells};
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::{Aabb, Triangle};

/// Fraction of the directions in which an enclosing model is seen; the rest is windows, doors and open sky.
const ENCLOSED: f32 = 0.8;
/// Fraction of the directions around the horizon, within [`HORIZON`], in which it is.
const ENCLOSED_AROUND: f32 = 0.9;
/// Fraction of what is seen that shows its front. Not all: some files have faces turned the wrong way.
const FRONTS: f32 = 0.7;
/// Fraction of what is seen around the horizon that stands upright in the two main directions of the walls. What is round has a
/// fifth.
const WALLS: f32 = 0.4;
/// Length of the free way over the longer horizontal side of the model: less in a car, more in a building.
const FREE: f32 = 0.355;
/// Height of the band around the horizon in radians, above and below.
const HORIZON: f32 = 0.35;
/// Largest cosine between the normal of a wall and the up direction.
const UPRIGHT: f32 = 0.3;
/// Classes of a quarter turn, by which the directions of walls are counted.
const WALL_CLASSES: usize = 18;
/// Number of directions around the horizon among which the one to look along is chosen.
const AZIMUTHS: usize = 48;
/// Distance to the nearest surface over the same side: the room around an observer.
const SPACIOUS: f32 = 0.05;
/// Half the opening of the cone, in radians, of which most is free along a way.
const WAY: f32 = 0.25;
/// Parts of the free way behind that are gone backwards, to look for a place without something hanging in the view.
const STEPS_BACK: [f32; 3] = [0.75, 0.4, 0.0];
/// Number of the most spacious points around which places are looked for, looking either way.
const WIDEST: usize = 3;
/// Half the opening in radians of the middle third of the picture.
const MIDDLE: f32 = 0.2;
/// Nearest surface in the middle of the picture over the diagonal of the model.
const NEAR: f32 = 0.05;
/// Part of the way to the nearest surface at which one orbits.
const FREE_AROUND: f32 = 0.75;
/// Points above, below and along the model's length beside the centre that are tried, as fractions of the bounding box: the centre
/// itself may lie in a lamp.
const OFFSETS: [f32; 3] = [0.0, -0.12, 0.12];
/// Larger models are looked at from their centre alone.
const MAX_TRIANGLES_BESIDE: usize = 4_000_000;

/// A place to stand inside a model, in world units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interior {
    /// Position of the observer.
    pub eye: Vec3,
    /// A point ahead on the longest free way, near enough to orbit around it without passing through walls.
    pub target: Vec3,
}

/// A free way through the model.
struct Way {
    /// Unit direction to look along.
    forward: Vec3,
    /// Distance to the nearest surface behind the point, in world units.
    behind: f32,
    /// Distance to the nearest surface ahead of the point, in world units.
    ahead: f32,
    /// Half of what is seen behind and ahead is farther apart than this, in world units.
    length: f32,
}

/// Finds where to stand inside a model that encloses the centre of `bounds`; `None` for every other model. `up` is the unit up
/// direction.
pub(super) fn find(
    triangles: &[Triangle],
    bounds: &Aabb,
    up: Vec3,
    token: &CancelToken,
) -> Result<Option<Interior>, Cancelled> {
    let center = bounds.center();
    if !center.is_finite() || !is_room(&around(&[center], triangles, token)?[0], up) {
        return Ok(None);
    }
    let horizontal = bounds.extent() * (Vec3::ONE - up.abs());
    let longest = horizontal.max_element();
    let along = Vec3::AXES[horizontal.max_position()];
    let beside = OFFSETS.iter().flat_map(|&up_by| OFFSETS.map(|along_by| up.abs() * up_by + along * along_by));
    let mut points: Vec<Vec3> = beside.map(|offset| center + offset * bounds.extent()).collect();
    if triangles.len() > MAX_TRIANGLES_BESIDE {
        points.truncate(1);
    }
    let maps = around(&points, triangles, token)?;
    let mut ways = Vec::new();
    for (&point, map) in points.iter().zip(&maps) {
        let (clearance, way) = (clearance(map), longest_way(map, up));
        if clearance > SPACIOUS * longest && is_room(map, up) && way.length >= FREE * longest {
            ways.push((point, clearance, way));
        }
    }
    ways.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut places = Vec::new();
    for (point, clearance, way) in ways.iter().take(WIDEST) {
        let radius = clearance * FREE_AROUND;
        for (forward, behind) in [(way.forward, way.behind), (-way.forward, way.ahead)] {
            places.extend(STEPS_BACK.map(|step| {
                let eye = *point - forward * (behind * step);
                let target = eye + forward * if step > 0.0 { radius.min(behind * step) } else { radius };
                Interior { eye, target }
            }));
        }
    }
    clearest(&places, bounds.extent().length() * NEAR, triangles, token)
}

/// The place from which half of the middle of the picture is farther away than from the others. Those from which nothing in it is
/// nearer than `near` go before others.
fn clearest(
    places: &[Interior],
    near: f32,
    triangles: &[Triangle],
    token: &CancelToken,
) -> Result<Option<Interior>, Cancelled> {
    let eyes: Vec<Vec3> = places.iter().map(|place| place.eye).collect();
    let mut best = (false, 0.0, None);
    for (place, map) in places.iter().zip(around(&eyes, triangles, token)?) {
        let forward = (place.target - place.eye).normalize_or_zero();
        let [nearest, median] = distances(&map, forward, MIDDLE);
        let is_free = nearest >= near;
        // By a little more, so that rounding does not choose.
        if best.2.is_none() || (is_free, median) > (best.0, best.1 * 1.001) {
            best = (is_free, median, Some(*place));
        }
    }
    Ok(best.2)
}

/// Nearest and median distance in the cone around `along`; nothing is gone towards an opening, where the way ends nowhere.
fn distances(map: &[Cell], along: Vec3, half_angle: f32) -> [f32; 2] {
    let cone = cells(map).filter(|(direction, _, _)| direction.dot(along) > half_angle.cos());
    let mut distances: Vec<f32> = cone.map(|(_, _, cell)| cell.distance).collect();
    distances.sort_by(f32::total_cmp);
    [0, distances.len() / 2]
        .map(|index| distances.get(index).copied().filter(|distance| distance.is_finite()).unwrap_or(0.0))
}

/// Distance to the nearest surface.
fn clearance(map: &[Cell]) -> f32 {
    map.iter().map(|cell| cell.distance).fold(f32::INFINITY, f32::min)
}

/// The surfaces in view surround the point as a room does.
fn is_room(map: &[Cell], up: Vec3) -> bool {
    let [mut all, mut seen, mut fronts, mut around, mut seen_around] = [0.0; 5];
    let mut walls = [0.0; WALL_CLASSES];
    let right = up.any_orthonormal_vector();
    let front = right.cross(up);
    for (direction, weight, cell) in cells(map) {
        let sees = if cell.distance.is_finite() { weight } else { 0.0 };
        all += weight;
        seen += sees;
        fronts += if cell.is_front(direction) { sees } else { 0.0 };
        if direction.dot(up).abs() < HORIZON.sin() {
            around += weight;
            seen_around += sees;
            if cell.normal.dot(up).abs() < UPRIGHT {
                // Walls at right angles to each other, on either side, are of one class.
                let turn = cell.normal.dot(front).atan2(cell.normal.dot(right)).rem_euclid(FRAC_PI_2) / FRAC_PI_2;
                walls[(turn * WALL_CLASSES as f32) as usize % WALL_CLASSES] += sees;
            }
        }
    }
    let most = (0..WALL_CLASSES).map(|class| [0, 1, 2].map(|next| walls[(class + next) % WALL_CLASSES]).iter().sum());
    let most: f32 = most.fold(0.0, f32::max);
    seen >= ENCLOSED * all
        && seen_around >= ENCLOSED_AROUND * around
        && fronts >= FRONTS * seen
        && most >= WALLS * seen_around
}

/// The longest free way through the point of the map, along the horizon.
fn longest_way(map: &[Cell], up: Vec3) -> Way {
    let right = up.any_orthonormal_vector();
    let front = right.cross(up);
    let mut best = Way { forward: front, behind: 0.0, ahead: 0.0, length: 0.0 };
    let mut longest = 0.0;
    for step in 0..AZIMUTHS {
        let angle = step as f32 * TAU / AZIMUTHS as f32;
        let forward = front * angle.cos() + right * angle.sin();
        let [[behind, median_behind], [ahead, median_ahead]] =
            [-forward, forward].map(|along| distances(map, along, WAY));
        // Along the way that is free as far as possible; by a little more, so that rounding does not choose.
        if behind + ahead > longest * 1.001 {
            longest = behind + ahead;
            best = Way { forward, behind, ahead, length: median_behind + median_ahead };
        }
    }
    best
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    /// The sides of a box, their fronts inward or outward, without the side `left_out`.
    pub fn room(bounds: &Aabb, inward: bool, left_out: Option<usize>) -> Vec<Triangle> {
        let mut triangles = Vec::new();
        for side in (0..6).filter(|side| Some(*side) != left_out) {
            let (axis, high) = (side % 3, side >= 3);
            let corner = |u: bool, v: bool| {
                let mut corner = bounds.min;
                for (place, up) in [(axis, high), ((axis + 1) % 3, u), ((axis + 2) % 3, v)] {
                    corner[place] = if up { bounds.max[place] } else { bounds.min[place] };
                }
                corner
            };
            let mut ring = [corner(false, false), corner(true, false), corner(true, true), corner(false, true)];
            if high == inward {
                ring.reverse();
            }
            triangles.push(Triangle { a: ring[0], b: ring[1], c: ring[2] });
            triangles.push(Triangle { a: ring[0], b: ring[2], c: ring[3] });
        }
        triangles
    }

    fn find_in(triangles: &[Triangle], bounds: &Aabb) -> Option<Interior> {
        find(triangles, bounds, Vec3::Y, &CancelToken::new()).unwrap()
    }

    #[test]
    fn a_hall_is_looked_at_along_its_length_from_inside() {
        let bounds = Aabb { min: Vec3::new(10.0, -1.0, 3.0), max: Vec3::new(22.0, 2.0, 7.0) };
        let interior = find_in(&room(&bounds, true, None), &bounds).unwrap();
        let (eye, center) = (interior.eye, bounds.center());
        // Floor and ceiling are one and a half units away.
        assert!(((interior.target - eye).length() - 1.5 * FREE_AROUND).abs() < 0.2, "{interior:?}");
        assert!((interior.target - eye).dot(center - eye) > 0.0);
        assert!((eye.y - center.y).abs() < 1e-4 && (eye.z - center.z).abs() < 0.5, "{eye}");
        // From the point beside the centre that lies farther back; six units are free on either side of the centre.
        let beside = OFFSETS[2] * 12.0;
        assert!(((eye.x - center.x).abs() - (beside + (6.0 - beside) * STEPS_BACK[0])).abs() < 0.2, "{eye}");
    }

    #[test]
    fn objects_and_open_stages_are_seen_from_outside() {
        let bounds = Aabb { min: Vec3::NEG_ONE, max: Vec3::splat(2.0) };
        assert_eq!(find_in(&room(&bounds, false, None), &bounds), None, "a solid box");
        for side in [2, 5, 0, 3] {
            assert_eq!(find_in(&room(&bounds, true, Some(side)), &bounds), None, "a stage open on side {side}");
        }
        assert!(find_in(&room(&bounds, true, Some(4)), &bounds).is_some(), "a courtyard under the sky");
        assert_eq!(find_in(&[], &Aabb::EMPTY), None);
    }
}
