//! The Utah teapot (Newell 1975): bicubic Bézier patches, each tessellated into a grid of triangles.

use glam::{DVec3, Vec3};

use crate::scene::assemble::{Assembly, VertexLists};
use crate::scene::error::FileLocation;
use crate::scene::material::Material;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::Triangle;

const DATA: &str = include_str!("../../../assets/teapot.txt");

/// The 4×4 control points of a patch, row by row.
type Patch = [DVec3; 16];

/// Tessellates every patch into `segments` by `segments` cells.
pub(super) fn build(segments: u32, assembly: &mut Assembly, token: &CancelToken) -> Result<(), Cancelled> {
    assembly.materials.push(Material { name: "clay".to_owned(), ..Material::clay() });
    for patch in patches() {
        add_patch(&patch, segments, assembly, token)?;
    }
    Ok(())
}

/// The 32 patches, y up.
fn patches() -> Vec<Patch> {
    let mut points = Vec::with_capacity(306);
    let mut rows = Vec::with_capacity(32);
    for line in DATA.lines() {
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("p") => rows.push(words.filter_map(|word| word.parse().ok()).collect::<Vec<usize>>()),
            Some("v") => {
                let mut number = || words.next().and_then(|word| word.parse().ok()).unwrap_or(0.0);
                let (x, y, z) = (number(), number(), number());
                points.push(DVec3::new(x, z, -y));
            }
            _ => {}
        }
    }
    rows.iter().map(|row| std::array::from_fn(|k| points[row[k]])).collect()
}

fn add_patch(patch: &Patch, segments: u32, assembly: &mut Assembly, token: &CancelToken) -> Result<(), Cancelled> {
    let side = segments as usize + 1;
    let mut positions = Vec::with_capacity(side * side);
    let mut normals = Vec::with_capacity(side * side);
    for row in 0..=segments {
        token.check()?;
        for column in 0..=segments {
            let u = parameter(column, segments);
            let v = parameter(row, segments);
            positions.push(point(patch, u, v).as_vec3());
            normals.push(normal(patch, u, v));
        }
    }
    let lists = VertexLists { normals, ..VertexLists::default() };
    let Some(first) = assembly.add_vertices(positions.len(), &lists, token)? else { return Ok(()) };
    let mut add = |corners: [usize; 3]| {
        let [a, b, c] = corners.map(|k| positions[k]);
        // Rows degenerate to a point at the poles.
        if a != b && b != c && c != a {
            assembly.push(Triangle { a, b, c }, Some(corners.map(|k| first + k as u32)), 0, || FileLocation::File);
        }
    };
    for row in 0..side - 1 {
        token.check()?;
        for column in 0..side - 1 {
            let k = row * side + column;
            add([k, k + side + 1, k + side]);
            add([k, k + 1, k + side + 1]);
        }
    }
    Ok(())
}

/// The parameter t = `index` / `segments` and 1 − t, each from its own division, so that a reversed edge has identical points.
fn parameter(index: u32, segments: u32) -> [f64; 2] {
    let n = f64::from(segments);
    [f64::from(index) / n, f64::from(segments - index) / n]
}

/// A point on a cubic Bézier curve; bitwise the same if the curve is reversed.
fn curve(p: [DVec3; 4], [t, s]: [f64; 2]) -> DVec3 {
    (p[0] * (s * s * s) + p[3] * (t * t * t)) + (p[1] * (3.0 * s * s * t) + p[2] * (3.0 * t * t * s))
}

/// The derivative of [`curve`], divided by 3.
fn tangent(p: [DVec3; 4], [t, s]: [f64; 2]) -> DVec3 {
    (p[1] - p[0]) * (s * s) + (p[2] - p[1]) * (2.0 * s * t) + (p[3] - p[2]) * (t * t)
}

/// A point on the patch; on an edge it depends on the control points of that edge only.
fn point(patch: &Patch, u: [f64; 2], v: [f64; 2]) -> DVec3 {
    let rows = std::array::from_fn(|row| curve(std::array::from_fn(|column| patch[4 * row + column]), u));
    // Adding zero turns -0 into 0, so that equal points have equal bits.
    curve(rows, v) + DVec3::ZERO
}

/// The outward unit normal; at a pole that of a point close by.
fn normal(patch: &Patch, u: [f64; 2], v: [f64; 2]) -> Vec3 {
    for inset in [0.0, 1e-3, 1e-2] {
        let inside = |[t, _]: [f64; 2]| {
            let t = t.clamp(inset, 1.0 - inset);
            [t, 1.0 - t]
        };
        let (u, v) = (inside(u), inside(v));
        let rows = std::array::from_fn(|row| curve(std::array::from_fn(|column| patch[4 * row + column]), u));
        let columns = std::array::from_fn(|column| curve(std::array::from_fn(|row| patch[4 * row + column]), v));
        let normal = tangent(columns, u).cross(tangent(rows, v));
        if normal.length_squared() > 1e-12 {
            return normal.normalize().as_vec3();
        }
    }
    Vec3::ZERO
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The control points of the four edges of a patch and the points along them.
    fn edges(patch: &Patch, segments: u32) -> Vec<([DVec3; 4], Vec<DVec3>)> {
        let ends = [parameter(0, segments), parameter(segments, segments)];
        let mut edges = Vec::new();
        for (k, end) in ends.into_iter().enumerate() {
            let walk = |along_u: bool| {
                (0..=segments)
                    .map(|i| parameter(i, segments))
                    .map(|t| if along_u { point(patch, t, end) } else { point(patch, end, t) })
                    .collect()
            };
            edges.push((std::array::from_fn(|i| patch[12 * k + i]), walk(true)));
            edges.push((std::array::from_fn(|i| patch[4 * i + 3 * k]), walk(false)));
        }
        edges
    }

    #[test]
    fn patches_join_without_cracks() {
        for segments in [1, 2, 3, 7, 10] {
            let edges: Vec<_> = patches().iter().flat_map(|patch| edges(patch, segments)).collect();
            let mut joins = 0;
            for (i, (control, points)) in edges.iter().enumerate() {
                for (other, other_points) in &edges[..i] {
                    let mut reversed = *other;
                    reversed.reverse();
                    if control == other {
                        assert_eq!(points, other_points);
                        joins += 1;
                    } else if *control == reversed {
                        assert!(points.iter().eq(other_points.iter().rev()));
                        joins += 1;
                    }
                }
            }
            assert!(joins > 40, "{joins} joins");
        }
    }

    #[test]
    fn normals_point_the_way_the_triangles_wind() {
        let mut assembly = Assembly::new();
        build(8, &mut assembly, &CancelToken::new()).expect("not cancelled");
        let scene = assembly
            .finish(&crate::scene::SceneSource::default_builtin(), Vec3::Y, &CancelToken::new())
            .expect("a teapot");
        let attributes = scene.attributes.expect("normals");
        let agree = scene
            .triangles
            .iter()
            .zip(attributes.corners.iter())
            .filter(|(triangle, corners)| {
                let normal: Vec3 = corners.iter().map(|&k| attributes.normals[k as usize]).sum();
                normal.dot(triangle.scaled_normal()) > 0.0
            })
            .count();
        assert!(agree * 100 >= scene.triangles.len() * 99, "{agree} of {}", scene.triangles.len());
        let volume: f32 = scene.triangles.iter().map(|t| t.a.dot(t.b.cross(t.c))).sum();
        assert!(volume > 0.0, "wound inwards: {volume}");
    }
}
