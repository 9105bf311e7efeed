//! The outermost points along the seven directions of a 14-DOP, which stand for all points in fitting.

use glam::{DVec3, Vec3};

use super::oriented::OrientedBox;

/// Number of directions.
const COUNT: usize = OrientedBox::DIRECTIONS.len();

/// For each of [`OrientedBox::DIRECTIONS`] the points with the smallest and the largest dot product, of some list of points; the first
/// ones where several are equally far out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Extremes<P> {
    pub(crate) least: [P; COUNT],
    pub(crate) most: [P; COUNT],
}

impl<P: Copy> Extremes<P> {
    /// A single point.
    pub(crate) fn of(point: P) -> Self {
        Self { least: [point; COUNT], most: [point; COUNT] }
    }

    /// Adds those of other points; `place` gives the place of a point.
    pub(crate) fn add(&mut self, other: &Self, place: impl Fn(P) -> Vec3) {
        for direction in 0..COUNT {
            let along = |point: P| along(place(point), direction);
            let (least, most) = (&mut self.least[direction], &mut self.most[direction]);
            if along(other.least[direction]) < along(*least) {
                *least = other.least[direction];
            }
            if along(other.most[direction]) > along(*most) {
                *most = other.most[direction];
            }
        }
    }

    /// The places of the points.
    pub(crate) fn places(&self, place: impl Fn(P) -> Vec3) -> Extremes<Vec3> {
        Extremes { least: self.least.map(&place), most: self.most.map(&place) }
    }
}

/// The dot product of `point` with a direction, exact but for coordinates of very different sizes.
fn along(point: Vec3, direction: usize) -> f64 {
    let [x, y, z] = point.as_dvec3().to_array();
    match direction {
        0 => x,
        1 => y,
        2 => z,
        3 => x + y + z,
        4 => x + y - z,
        5 => x - y + z,
        _ => x - y - z,
    }
}

impl Extremes<Vec3> {
    /// Those of some points; `None` of none.
    pub(crate) fn around(points: impl IntoIterator<Item = Vec3>) -> Option<Self> {
        let mut points = points.into_iter();
        let mut found = Self::of(points.next()?);
        points.for_each(|point| found.add(&Self::of(point), |point| point));
        Some(found)
    }

    /// The smallest and the largest dot product with each direction.
    pub(crate) fn intervals(&self) -> [[f64; 2]; COUNT] {
        std::array::from_fn(|at| [along(self.least[at], at), along(self.most[at], at)])
    }

    /// The points, each once, in the order of the directions.
    pub(crate) fn distinct(&self) -> arrayvec::ArrayVec<DVec3, { 2 * COUNT }> {
        let mut found = arrayvec::ArrayVec::new();
        for point in self.least.iter().chain(&self.most) {
            let point = point.as_dvec3();
            if !found.contains(&point) {
                found.push(point);
            }
        }
        found
    }
}
