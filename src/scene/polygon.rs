//! Polygons cut into triangles: fans where they are valid, ears where a polygon is concave.

use std::collections::HashMap;

use earcut::Earcut;
use glam::DVec3;

use super::images::run_on_thread;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// Corners up to which a polygon is cut at once; the worst of them take some milliseconds.
const MAX_AT_ONCE: usize = 256;
/// Maximum number of corners of a polygon that is cut by its ears: their search takes seconds here, and may take cubic time.
const MAX_CORNERS: usize = 1 << 15;
/// Sine of the angle at a corner below which the polygon runs back on itself.
const BACK: f64 = 1e-6;
/// Tolerance of areas, relative to that of the polygon.
const TOLERANCE: f64 = 1e-7;
/// Excess of the area of all ears, relative to that of the polygon, from which on they overlap.
const MAX_EXCESS: f64 = 10.0 * TOLERANCE;

/// The warning about polygons whose triangles overlap.
const OVERLAP: &str = "faces that cross themselves, whose triangles overlap";
/// The warning about polygons that are not cut, as a fan would be another shape.
const TOO_MANY: &str = "faces with a dent left out: more than 32768 corners";

/// The triangles of a polygon.
pub(super) struct Cut<'a> {
    /// Corners of each triangle, wound as the polygon; fewer than of a fan where the polygon touches itself. `None` for a fan: the
    /// first corner with each edge, in order.
    pub(super) ears: Option<&'a [[u32; 3]]>,
    /// The warning about the polygon: it crosses itself, or has too many corners to be cut.
    pub(super) flaw: Option<&'static str>,
}

/// Cuts polygons one after another in the same memory.
#[derive(Default)]
pub(super) struct PolygonCutter {
    earcut: Earcut<f64>,
    plane: Vec<[f64; 2]>,
    ears: Vec<u32>,
}

impl PolygonCutter {
    /// Cuts a polygon of finite corners.
    pub(super) fn cut(&mut self, corners: &[DVec3], token: &CancelToken) -> Result<Cut<'_>, Cancelled> {
        if corners.len() <= 3 {
            return Ok(Cut { ears: None, flaw: None });
        }
        // Twice the area of the polygon, along its normal: the sum of the triangles of its fan (Newell).
        let normal: DVec3 = fan_areas(corners).sum();
        let area = normal.length();
        let direction = normal / area;
        if !direction.is_finite() || fan_areas(corners).all(|part| part.dot(direction) >= -TOLERANCE * area) {
            return Ok(Cut { ears: None, flaw: None });
        }
        if corners.len() > MAX_CORNERS {
            return Ok(Cut { ears: Some(&[]), flaw: Some(TOO_MANY) });
        }
        let (u, v) = direction.any_orthonormal_pair();
        self.plane.clear();
        self.plane.extend(corners.iter().map(|&corner| [(corner - corners[0]).dot(u), (corner - corners[0]).dot(v)]));
        let excess = |doubled: f64| (doubled - area).abs() / area;
        self.find_ears(token)?;
        let mut excess_of_ears = excess(self.area_of_ears());
        if excess_of_ears > MAX_EXCESS && self.find_ears_without_spikes(token)? {
            excess_of_ears = excess(self.area_of_ears());
        }
        let excess_of_fan = excess(fan_areas(corners).map(|part| part.dot(direction).abs()).sum());
        let overlaps = excess_of_ears > MAX_EXCESS;
        let ears = self.ears.as_chunks::<3>().0;
        let ears = Some(ears).filter(|_| !overlaps || excess_of_ears < excess_of_fan);
        Ok(Cut { ears, flaw: overlaps.then_some(OVERLAP) })
    }

    /// Twice the area of all ears.
    fn area_of_ears(&self) -> f64 {
        self.ears.as_chunks::<3>().0.iter().map(|ear| doubled_area(&self.plane, *ear).abs()).sum()
    }

    /// Finds the ears without corners at which the polygon runs back on itself, whose sides enclose nothing but confuse the search;
    /// returns whether there are any.
    fn find_ears_without_spikes(&mut self, token: &CancelToken) -> Result<bool, Cancelled> {
        let mut kept: Vec<u32> = Vec::with_capacity(self.plane.len());
        for corner in 0..self.plane.len() as u32 {
            kept.push(corner);
            while let [.., a, b, c] = kept[..]
                && self.runs_back([a, b, c])
            {
                kept.truncate(kept.len() - 2);
                kept.push(c);
            }
        }
        // Across the beginning.
        let mut from = 0;
        while let [a, b, .., y, z] = kept[from..] {
            if self.runs_back([y, z, a]) {
                kept.pop();
            } else if self.runs_back([z, a, b]) {
                from += 1;
            } else {
                break;
            }
        }
        let kept = &kept[from..];
        if kept.len() == self.plane.len() {
            return Ok(false);
        }
        let all = std::mem::take(&mut self.plane);
        self.plane.extend(kept.iter().map(|&corner| all[corner as usize]));
        let found = self.find_ears(token);
        self.ears.iter_mut().for_each(|corner| *corner = kept[*corner as usize]);
        self.plane = all;
        found.map(|()| true)
    }

    /// Whether the way from the first corner to the second leads back towards the first.
    fn runs_back(&self, corners: [u32; 3]) -> bool {
        let [a, b, c] = corners.map(|corner| glam::DVec2::from_array(self.plane[corner as usize]));
        let (to, on) = (b - a, c - b);
        to.dot(on) < 0.0 && to.perp_dot(on).abs() <= BACK * to.length() * on.length()
    }

    /// Finds the ears of the polygon in `plane`; of a long one on another thread, so that cancelling need not wait.
    fn find_ears(&mut self, token: &CancelToken) -> Result<(), Cancelled> {
        if self.plane.len() <= MAX_AT_ONCE {
            token.check()?;
            self.earcut.earcut_slice(&self.plane, &[], &mut self.ears);
        } else {
            let plane = self.plane.clone();
            let work = move || {
                let mut ears = Vec::new();
                Earcut::new().earcut_slice(&plane, &[], &mut ears);
                ears
            };
            self.ears = run_on_thread(work, token)?.unwrap_or_default();
        }
        // Turned as the polygon, whatever the crate's convention.
        let is_turned = |ear: &[u32; 3]| doubled_area(&self.plane, *ear) < 0.0;
        self.ears.as_chunks_mut::<3>().0.iter_mut().filter(|ear| is_turned(ear)).for_each(|ear| ear.swap(1, 2));
        self.insert_left_out();
        Ok(())
    }

    /// Splits ears at corners that the crate left out, as it does on straight lines: neighbouring faces may have them too.
    fn insert_left_out(&mut self) {
        let count = self.plane.len();
        let mut is_used = vec![false; count];
        self.ears.iter().for_each(|&corner| is_used[corner as usize] = true);
        let Some(start) = is_used.iter().position(|&used| used).filter(|_| is_used.contains(&false)) else { return };
        // Ears by the corners of each edge, in the polygon's direction.
        let mut edges = HashMap::new();
        for (ear, &[a, b, c]) in self.ears.as_chunks::<3>().0.iter().enumerate() {
            edges.extend([((a, b), ear), ((b, c), ear), ((c, a), ear)]);
        }
        let (mut last, mut next) = (start, start);
        for step in 1..count {
            let corner = (start + step) % count;
            if is_used[corner] {
                last = corner;
                continue;
            }
            if next == last {
                next = (1..=count).map(|ahead| (corner + ahead) % count).find(|&ahead| is_used[ahead]).unwrap_or(start);
            }
            let [a, b, new] = [last, next, corner].map(|corner| corner as u32);
            let Some(ear) = edges.remove(&(a, b)) else { continue };
            let corners = &mut self.ears[3 * ear..3 * ear + 3];
            let Some(&tip) = corners.iter().find(|&&corner| corner != a && corner != b) else { continue };
            corners.copy_from_slice(&[a, new, tip]);
            let added = self.ears.len() / 3;
            self.ears.extend([new, b, tip]);
            edges.extend([((a, new), ear), ((new, tip), ear)]);
            edges.extend([((new, b), added), ((b, tip), added), ((tip, new), added)]);
            last = corner;
        }
    }
}

/// Twice the areas of the triangles of a fan, along their normals.
fn fan_areas(corners: &[DVec3]) -> impl Iterator<Item = DVec3> {
    corners[1..].windows(2).map(|edge| (edge[0] - corners[0]).cross(edge[1] - corners[0]))
}

/// Twice the area of a triangle; negative where it turns to the right.
fn doubled_area(plane: &[[f64; 2]], corners: [u32; 3]) -> f64 {
    let [a, b, c] = corners.map(|corner| glam::DVec2::from_array(plane[corner as usize]));
    (b - a).perp_dot(c - a)
}
