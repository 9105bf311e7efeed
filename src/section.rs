//! The section plane: cuts a model and its containers open, in the picture and in the overlay alike.

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use bvhscope_engine::geometry::{Aabb, Ray, Sphere};

/// Names of the axes.
const AXES: [(&str, Vec3); 3] = [("x", Vec3::X), ("y", Vec3::Y), ("z", Vec3::Z)];

/// A plane that keeps one half of the scene: the points with `normal · point` up to `offset`, or the others where it is flipped.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SectionPlane {
    /// Unit normal.
    pub normal: Vec3,
    /// Distance of the plane from the origin along the normal, in world units.
    pub offset: f32,
    /// Keeps the half that the normal points into.
    pub flipped: bool,
}

impl SectionPlane {
    /// The plane across the middle of `bounds`; `normal` of any length but zero.
    pub fn through(bounds: &Aabb, normal: Vec3) -> Self {
        let normal = normal.normalize_or(Vec3::X);
        Self { normal, offset: normal.dot(bounds.center()), flipped: false }
    }

    /// True if normal and offset are finite and the normal is a direction: a file may hold anything.
    pub fn is_usable(&self) -> bool {
        self.offset.is_finite() && self.normal.is_normalized()
    }

    /// Normal and offset of the plane with the kept half behind it.
    pub fn outward(&self) -> (Vec3, f32) {
        if self.flipped { (-self.normal, -self.offset) } else { (self.normal, self.offset) }
    }

    /// True if a point is in the kept half.
    pub fn keeps(&self, point: Vec3) -> bool {
        let (normal, offset) = self.outward();
        normal.dot(point) <= offset
    }

    /// The part of a ray in the kept half: the same ray with a shorter interval, which is empty where nothing remains.
    #[inline]
    pub fn clip(&self, ray: &Ray) -> Ray {
        let (normal, offset) = self.outward();
        let (outside, approach) = (normal.dot(ray.origin) - offset, normal.dot(ray.direction));
        let mut clipped = *ray;
        let crossing = -outside / approach;
        if approach > 0.0 {
            clipped.t_max = clipped.t_max.min(crossing);
        } else if approach < 0.0 {
            clipped.t_min = clipped.t_min.max(crossing);
        } else if outside > 0.0 {
            clipped.t_max = -1.0;
        }
        if clipped.t_min > clipped.t_max {
            // Beyond every ray, whatever a traversal makes of an interval the wrong way round.
            (clipped.t_min, clipped.t_max) = (0.0, -1.0);
        }
        clipped
    }

    /// Distance along a ray at which it enters the kept half from outside; `None` where it starts within or never does.
    pub fn entry(&self, ray: &Ray) -> Option<f32> {
        let (normal, offset) = self.outward();
        let (outside, approach) = (normal.dot(ray.origin) - offset, normal.dot(ray.direction));
        (outside > 0.0 && approach < 0.0).then(|| -outside / approach)
    }

    /// True if no point of `bounds` is in the kept half.
    pub fn cuts_away(&self, bounds: &Aabb) -> bool {
        let [low, high] = self.reach(bounds);
        if self.flipped { high < self.offset } else { low > self.offset }
    }

    /// True if no point of `sphere` is in the kept half.
    pub fn cuts_away_sphere(&self, sphere: &Sphere) -> bool {
        let (normal, offset) = self.outward();
        normal.dot(sphere.center) - sphere.radius > offset
    }

    /// Smallest and largest offset at which the plane meets `bounds`.
    pub fn reach(&self, bounds: &Aabb) -> [f32; 2] {
        let (center, half) = (bounds.center(), bounds.extent() * 0.5);
        let (middle, reach) = (self.normal.dot(center), self.normal.abs().dot(half));
        [middle - reach, middle + reach]
    }

    /// The corners, in order, of the polygon in which the plane cuts `bounds`; empty where it misses.
    pub fn outline(&self, bounds: &Aabb) -> Vec<Vec3> {
        let corner = |index: usize| {
            let pick =
                |bit: usize, axis: usize| if index >> bit & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] };
            Vec3::new(pick(0, 0), pick(1, 1), pick(2, 2))
        };
        let height = |point: Vec3| self.normal.dot(point) - self.offset;
        let mut points = Vec::new();
        for from in 0..8 {
            for to in [1, 2, 4].map(|bit| from | bit).into_iter().filter(|&to| to != from) {
                let (a, b) = (corner(from), corner(to));
                let (above, below) = (height(a), height(b));
                if (above < 0.0) != (below < 0.0) {
                    points.push(a + (b - a) * (above / (above - below)));
                }
            }
        }
        let middle = points.iter().sum::<Vec3>() / points.len().max(1) as f32;
        let (u, v) = self.normal.any_orthonormal_pair();
        let turn = |point: &Vec3| (*point - middle).dot(v).atan2((*point - middle).dot(u));
        points.sort_by(|a, b| turn(a).total_cmp(&turn(b)));
        points
    }

    /// The axis that the normal is parallel to: 0 for x, 1 for y, 2 for z.
    pub fn axis(&self) -> Option<usize> {
        AXES.iter().position(|&(_, axis)| axis == self.normal)
    }

    /// The plane through the same middle of `bounds` across the nearest axis; it keeps the half on the same side.
    #[must_use]
    pub fn snapped(&self, bounds: &Aabb) -> Self {
        let axis = AXES[self.normal.abs().max_position()].1;
        let share = (self.offset - self.reach(bounds)[0]) / (self.reach(bounds)[1] - self.reach(bounds)[0]).max(1e-30);
        let turned = self.normal.dot(axis) < 0.0;
        let mut snapped = Self { normal: axis, offset: 0.0, flipped: self.flipped != turned };
        let [low, high] = snapped.reach(bounds);
        snapped.offset = low + (high - low) * if turned { 1.0 - share } else { share };
        snapped
    }
}

impl SectionPlane {
    /// As the command line takes it, `x=0.5`, `-y=2` or `0.6,0.8,0=1`: in the coordinates of the file, of which those of the scene are
    /// less by `origin`.
    pub fn in_file(&self, origin: DVec3) -> String {
        let along = |normal: Vec3, offset: f32| {
            // With no more decimals than single precision has.
            offset.to_string().parse().unwrap_or(f64::from(offset)) + normal.as_dvec3().dot(origin)
        };
        if let Some(axis) = self.axis() {
            let sign = if self.flipped { "-" } else { "" };
            return format!("{sign}{}={}", AXES[axis].0, along(self.normal, self.offset));
        }
        // A minus before the numbers is the first one's own, so the flipped plane is written with the opposite normal.
        let (normal, offset) = self.outward();
        format!("{},{},{}={}", normal.x, normal.y, normal.z, along(normal, offset))
    }

    /// Moves it with coordinates that become larger by `shift`.
    pub fn shift(&mut self, shift: Vec3) {
        self.offset += self.normal.dot(shift);
    }
}

/// A requested section plane, before the model is loaded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SectionChoice {
    /// Unit normal.
    normal: Vec3,
    /// Offset in the coordinates of the file, or in percent of the model's size along the normal.
    position: f64,
    is_percent: bool,
    flipped: bool,
}

impl SectionChoice {
    /// Parses `AXIS=POSITION`: x, y, z or a normal as `X,Y,Z`, and a position in the model's unit or with `%` in percent of its
    /// size; before an axis, `-` keeps the other half.
    ///
    /// # Errors
    ///
    /// Fails with what is expected.
    pub fn parse(text: &str) -> Result<Self, String> {
        let expected = || "AXIS=POSITION is expected, as in x=0.5, y=50% or, for the other half, -z=50%".to_owned();
        let (plane, position) = text.split_once('=').ok_or_else(expected)?;
        let named = |name: &str| AXES.iter().find(|(axis, _)| *axis == name).map(|(_, axis)| *axis);
        let (flipped, normal) = match (named(plane), plane.strip_prefix('-').and_then(named)) {
            (Some(axis), _) => (false, axis),
            (None, Some(axis)) => (true, axis),
            (None, None) => {
                let numbers = plane.split(',').map(str::parse).collect::<Result<Vec<f32>, _>>();
                let normal = numbers.ok().and_then(|parts| <[f32; 3]>::try_from(parts).ok()).map(Vec3::from);
                (false, normal.and_then(Vec3::try_normalize).ok_or_else(expected)?)
            }
        };
        let (number, is_percent) = position.strip_suffix('%').map_or((position, false), |number| (number, true));
        let position =
            number.trim().parse().ok().filter(|position: &f64| (*position as f32).is_finite()).ok_or_else(expected)?;
        Ok(Self { normal, position, is_percent, flipped })
    }

    /// The plane in a model of these bounds, whose coordinates are less than those of its file by `origin`.
    pub fn plane(&self, bounds: &Aabb, origin: DVec3) -> SectionPlane {
        let along = self.position - self.normal.as_dvec3().dot(origin);
        let plane = SectionPlane { normal: self.normal, offset: along as f32, flipped: self.flipped };
        if !self.is_percent {
            return plane;
        }
        let [low, high] = plane.reach(bounds);
        SectionPlane { offset: low + (high - low) * self.position as f32 / 100.0, ..plane }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    const CUBE: Aabb = Aabb { min: Vec3::splat(-1.0), max: Vec3::splat(3.0) };

    #[test]
    fn a_clipped_ray_holds_the_points_of_the_kept_half() {
        let normal = Vec3::new(0.6, 0.8, 0.0);
        for flipped in [false, true] {
            let plane = SectionPlane { normal, offset: 0.5, flipped };
            for (origin, direction) in [
                (Vec3::ZERO, Vec3::X),
                (Vec3::ZERO, -Vec3::Y),
                (Vec3::splat(4.0), -Vec3::ONE),
                (Vec3::splat(4.0), Vec3::Z),
                (Vec3::ZERO, Vec3::Z),
                (Vec3::splat(4.0), Vec3::ONE),
            ] {
                let ray = Ray { t_max: 20.0, ..Ray::new(origin, direction) };
                let clipped = plane.clip(&ray);
                for step in 0..200 {
                    let t = step as f32 * 0.1 + 0.013;
                    let within = (clipped.t_min..=clipped.t_max).contains(&t);
                    assert_eq!(within, plane.keeps(ray.at(t)), "{origin} {direction} {flipped} at {t}");
                }
            }
        }
    }

    #[test]
    fn a_choice_is_parsed_and_printed() {
        let plane = |text: &str| SectionChoice::parse(text).unwrap().plane(&CUBE, DVec3::ZERO);
        assert_eq!(plane("x=0.5"), SectionPlane { normal: Vec3::X, offset: 0.5, flipped: false });
        assert_eq!(plane("-y=25%"), SectionPlane { normal: Vec3::Y, offset: 0.0, flipped: true });
        assert_eq!(plane("z=-2"), SectionPlane { normal: Vec3::Z, offset: -2.0, flipped: false });
        for text in ["x=0.5", "-z=-1.25", "0.6,0.8,0=1", "-0.6,0.8,0=1"] {
            assert_eq!(plane(&plane(text).in_file(DVec3::ZERO)), plane(text), "{text}");
        }
        // The same planes in a file whose coordinates are larger.
        let origin = DVec3::new(408_204.0, 4_080_928.0, -0.5);
        for (text, in_file) in [("x=0.5", "x=408204.5"), ("-z=-1.25", "-z=-1.75"), ("-y=0.1", "-y=4080928.1")] {
            assert_eq!(plane(text).in_file(origin), in_file);
            assert_eq!(SectionChoice::parse(in_file).unwrap().plane(&CUBE, origin), plane(text));
        }
        let percent = SectionChoice::parse("0,-1,0=25%").unwrap();
        assert_eq!(percent.plane(&CUBE, origin), percent.plane(&CUBE, DVec3::ZERO));
        for bad in ["", "x", "x=", "w=1", "x=nan", "1,2=3", "0,0,0=1", "x=1%%"] {
            assert!(SectionChoice::parse(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn the_outline_is_the_cut_through_the_box() {
        let square = SectionPlane { normal: Vec3::Y, offset: 2.0, flipped: false }.outline(&CUBE);
        assert_eq!(square.len(), 4);
        assert!(
            square.iter().all(|point| point.y == 2.0 && (point.x - 1.0).abs() == 2.0 && (point.z - 1.0).abs() == 2.0)
        );
        assert!((0..4).all(|at| (square[at].distance(square[(at + 1) % 4]) - 4.0).abs() < 1e-5), "in order");
        let hexagon = SectionPlane::through(&CUBE, Vec3::ONE).outline(&CUBE);
        assert_eq!(hexagon.len(), 6);
        assert!(SectionPlane { normal: Vec3::X, offset: 9.0, flipped: false }.outline(&CUBE).is_empty());
    }

    #[test]
    fn a_box_is_cut_away_once_all_its_corners_are() {
        let plane = |offset, flipped| SectionPlane { normal: Vec3::new(0.6, 0.8, 0.0), offset, flipped };
        // The corners of the cube are at -1.4 to 4.2 along the normal.
        assert!(plane(-1.5, false).cuts_away(&CUBE) && !plane(-1.3, false).cuts_away(&CUBE));
        assert!(plane(4.3, true).cuts_away(&CUBE) && !plane(4.1, true).cuts_away(&CUBE));
        assert!(!plane(4.3, false).cuts_away(&CUBE) && !plane(-1.5, true).cuts_away(&CUBE));
    }

    #[test]
    fn snapping_keeps_the_side() {
        let tilted = SectionPlane { offset: 1.2, ..SectionPlane::through(&CUBE, Vec3::new(-0.9, 0.1, 0.2)) };
        let snapped = tilted.snapped(&CUBE);
        assert_eq!((snapped.axis(), snapped.flipped), (Some(0), true));
        for point in [Vec3::new(-1.0, 1.0, 1.0), Vec3::new(2.9, 1.0, 1.0)] {
            assert_eq!(tilted.keeps(point), snapped.keeps(point));
        }
    }
}
