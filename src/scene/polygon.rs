//! Polygons cut into triangles: fans where they are valid, ears where a polygon is concave.

use std::collections::HashMap;

use earcut::Earcut;
use glam::DVec3;

use super::images::run_on_thread;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// Corners up to which a polygon is cut at once; the worst of them take some milliseconds.
const MAX_AT_ONCE: usize = 256;
/// Maximum number of corners of a polygon that is cut by its ears: their search may take cubic time.
const MAX_CORNERS: usize = 1 << 14;
/// Tolerance of areas, relative to that of the polygon.
const TOLERANCE: f64 = 1e-7;

/// The warning about polygons whose triangles overlap.
pub(super) const OVERLAP: &str = "faces that cross themselves, whose triangles overlap";

/// The triangles of a polygon.
pub(super) struct Cut<'a> {
    /// Corners of each triangle, wound as the polygon; fewer than of a fan where the polygon touches itself. `None` for a fan: the
    /// first corner with each edge, in order.
    pub(super) ears: Option<&'a [[u32; 3]]>,
    /// The triangles overlap: the polygon crosses itself, or has too many corners to be cut otherwise than as a fan.
    pub(super) overlap: bool,
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
            return Ok(Cut { ears: None, overlap: false });
        }
        // Twice the area of the polygon, along its normal: the sum of the triangles of its fan (Newell).
        let normal: DVec3 = fan_areas(corners).sum();
        let area = normal.length();
        let direction = normal / area;
        if !direction.is_finite() || fan_areas(corners).all(|part| part.dot(direction) >= -TOLERANCE * area) {
            return Ok(Cut { ears: None, overlap: false });
        }
        if corners.len() > MAX_CORNERS {
            return Ok(Cut { ears: None, overlap: true });
        }
        let (u, v) = direction.any_orthonormal_pair();
        self.plane.clear();
        self.plane.extend(corners.iter().map(|&corner| [(corner - corners[0]).dot(u), (corner - corners[0]).dot(v)]));
        self.find_ears(token)?;
        let ears = self.ears.as_chunks::<3>().0;
        let excess = |doubled: f64| (doubled - area).abs() / area;
        let excess_of_ears = excess(ears.iter().map(|ear| doubled_area(&self.plane, *ear).abs()).sum());
        let excess_of_fan = excess(fan_areas(corners).map(|part| part.dot(direction).abs()).sum());
        let overlap = excess_of_ears > 10.0 * TOLERANCE;
        Ok(Cut { ears: Some(ears).filter(|_| !overlap || excess_of_ears < excess_of_fan), overlap })
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
