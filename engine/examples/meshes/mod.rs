//! A mesh for the examples, made in code.

use bvhscope_engine::Triangle;
use bvhscope_engine::glam::Vec3;

/// A bumpy ball of radius 1 about the origin, of about `count` triangles in rows.
pub fn bumpy_ball(count: usize) -> Vec<Triangle> {
    let side = (count as f32 / 2.0).sqrt() as usize;
    let vertex = |row: usize, column: usize| {
        let v = row as f32 / side as f32 * std::f32::consts::PI;
        let u = column as f32 / side as f32 * std::f32::consts::TAU;
        let radius = 1.0 + 0.05 * (9.0 * u).sin() * (7.0 * v).sin();
        radius * Vec3::new(v.sin() * u.cos(), v.cos(), v.sin() * u.sin())
    };
    let mut triangles = Vec::with_capacity(2 * side * side);
    for row in 0..side {
        for column in 0..side {
            let [a, b] = [vertex(row, column), vertex(row + 1, column)];
            let [c, d] = [vertex(row + 1, column + 1), vertex(row, column + 1)];
            triangles.extend([Triangle { a, b, c }, Triangle { a, b: c, c: d }]);
        }
    }
    triangles
}
