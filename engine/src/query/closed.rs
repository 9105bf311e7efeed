//! Whether a list of triangles encloses a volume: each edge belongs to an even number of triangles.

use std::collections::HashMap;

use glam::Vec3;

use crate::cancel::{CancelToken, Cancelled, MEDIUM_STEPS};
use crate::geometry::Triangle;

/// How the triangles of a mesh meet in its edges. Corners at equal coordinates are one, whatever the file's indices; triangles of which
/// two corners are one have no area and are left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Edges {
    /// Number of edges.
    pub count: usize,
    /// Edges of an odd number of triangles, of one in most cases. The mesh is closed where there are none.
    pub open: usize,
    /// Edges of more than two triangles.
    pub shared_by_many: usize,
    /// Edges of two triangles that both run along them in the same direction, so that one of the two is turned inside out.
    pub turned: usize,
}

impl Edges {
    /// The edges of `triangles`, whose coordinates are finite.
    ///
    /// ```
    /// use bvhscope_engine::glam::Vec3;
    /// use bvhscope_engine::query::closed::Edges;
    /// use bvhscope_engine::{CancelToken, Triangle};
    ///
    /// let [o, x, y, z] = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
    /// let corners = [[o, y, x], [o, z, y], [o, x, z], [x, y, z]];
    /// let mut tetrahedron = corners.map(|[a, b, c]| Triangle { a, b, c });
    /// let edges = |triangles: &[Triangle]| Edges::of(triangles, &CancelToken::new());
    /// assert_eq!(edges(&tetrahedron)?, Edges { count: 6, ..Edges::default() });
    /// assert_eq!(edges(&tetrahedron[..3])?.open, 3);
    /// tetrahedron[3] = Triangle { a: x, b: z, c: y };
    /// assert_eq!(edges(&tetrahedron)?.turned, 3);
    /// # Ok::<(), bvhscope_engine::Cancelled>(())
    /// ```
    pub fn of(triangles: &[Triangle], token: &CancelToken) -> Result<Self, Cancelled> {
        // With the hash of the standard library, which no file can be made to slow down.
        let mut corners = HashMap::<[u32; 3], u32>::new();
        // For each edge, from the lower to the higher corner, the number of triangles along it and against it.
        let mut uses = HashMap::<[u32; 2], [u32; 2]>::new();
        for (index, triangle) in triangles.iter().enumerate() {
            token.check_every(MEDIUM_STEPS, index)?;
            let [a, b, c] = [triangle.a, triangle.b, triangle.c].map(|corner| {
                let next = corners.len() as u32;
                *corners.entry(bits(corner)).or_insert(next)
            });
            if a == b || b == c || c == a {
                continue;
            }
            for (from, to) in [(a, b), (b, c), (c, a)] {
                uses.entry([from.min(to), from.max(to)]).or_default()[usize::from(from > to)] += 1;
            }
        }
        let number = |is: fn(&[u32; 2]) -> bool| uses.values().filter(|uses| is(uses)).count();
        token.check()?;
        Ok(Self {
            count: uses.len(),
            open: number(|[along, against]| (along + against) % 2 == 1),
            shared_by_many: number(|[along, against]| along + against > 2),
            turned: number(|uses| matches!(uses, [2, 0] | [0, 2])),
        })
    }

    /// True if the mesh is closed, so that every point off its surface lies either inside or outside.
    pub const fn is_closed(&self) -> bool {
        self.open == 0
    }

    /// True if no edge has more than two triangles.
    pub const fn is_manifold(&self) -> bool {
        self.shared_by_many == 0
    }

    /// True if all triangles that meet have their fronts on the same side.
    pub const fn is_oriented(&self) -> bool {
        self.turned == 0
    }
}

/// The bits of a point's coordinates, the same for both zeros.
fn bits(point: Vec3) -> [u32; 3] {
    (point + Vec3::ZERO).to_array().map(f32::to_bits)
}
