//! Enlarging coarse pictures through a cubic B-spline, which shows no pixel as a square. On the CPU, and only so far that the
//! driver can interpolate between two texels: as a shader it took more than half of what a software driver draws in a frame.

use glam::Vec4;

/// Pixels of the viewport for one of the picture, along one side, from which on interpolation between two is not smooth enough.
const COARSE: f32 = 1.75;
/// Pixels of the viewport for one of an enlarged picture, along one side: the slopes between two of them look curved.
const SPACING: f32 = 2.0;

/// How many times larger a picture is uploaded, along each side, of which a pixel covers `coarseness` pixels of the viewport.
pub fn factor(coarseness: f32) -> usize {
    if coarseness >= COARSE { ((coarseness / SPACING).ceil() as usize).max(2) } else { 1 }
}

/// The four weights of the uniform cubic B-spline at `f`, 0 to 1, between the second and the third.
fn weights(f: f32) -> [f32; 4] {
    let g = 1.0 - f;
    let [first, last] = [g * g * g / 6.0, f * f * f / 6.0];
    let second = (4.0 - 3.0 * f * f * (2.0 - f)) / 6.0;
    [first, second, 1.0 - first - second - last, last]
}

/// Where each of the `factor` new pixels in place of one takes its colour: the offset of the first of four old pixels from the one
/// before the last, and their weights.
fn phases(factor: usize) -> Vec<(usize, [f32; 4])> {
    let phase = |index: usize| {
        let offset = (index as f32 + 0.5) / factor as f32 - 0.5;
        if offset < 0.0 { (0, weights(offset + 1.0)) } else { (1, weights(offset)) }
    };
    (0..factor).map(phase).collect()
}

/// A picture of `size`, row by row, `factor` times larger along each side. Alpha becomes 255.
pub fn enlarged(rgba: &[[u8; 4]], size: [usize; 2], factor: usize) -> Vec<[u8; 4]> {
    let [width, height] = size;
    let phases = phases(factor);
    let mut large = Vec::with_capacity(rgba.len() * factor * factor);
    // The last pixel of each side is repeated twice beyond it.
    let mut column = vec![Vec4::ZERO; width + 4];
    for y in 0..height {
        for &(first, weights) in &phases {
            let row = |tap: usize| {
                let y = (y + first + tap).saturating_sub(2).min(height - 1);
                &rgba[y * width..(y + 1) * width]
            };
            let rows = [row(0), row(1), row(2), row(3)];
            for (x, sum) in column[2..width + 2].iter_mut().enumerate() {
                *sum = Vec4::ZERO;
                for (row, weight) in rows.iter().zip(weights) {
                    *sum += Vec4::from_array(row[x].map(f32::from)) * weight;
                }
            }
            let [left, right] = [column[2], column[width + 1]];
            column[..2].fill(left);
            column[width + 2..].fill(right);
            for taps in column.windows(5).take(width) {
                for &(first, weights) in &phases {
                    let sum = taps[first] * weights[0]
                        + taps[first + 1] * weights[1]
                        + taps[first + 2] * weights[2]
                        + taps[first + 3] * weights[3];
                    large.push(rounded(sum));
                }
            }
        }
    }
    large
}

/// Rounds colours from 0 to 255, faster than by a conversion that saturates: the sum has no bits behind the point.
fn rounded(color: Vec4) -> [u8; 4] {
    const WHOLE: f32 = (1_u32 << 23) as f32;
    let [red, green, blue, _] = (color + WHOLE).to_array().map(|value| value.to_bits() as u8);
    [red, green, blue, 255]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_drawn_in_between_is_close_together() {
        for (coarseness, expected) in
            [(1.0, 1), (1.5, 1), (1.75, 2), (2.0, 2), (3.0, 2), (4.0, 2), (5.0, 3), (6.0, 3), (8.0, 4), (f32::NAN, 1)]
        {
            assert_eq!(factor(coarseness), expected, "{coarseness}");
        }
    }

    /// By the definition: each new pixel is the sum over all old ones of their colours, by the spline at their distance.
    #[test]
    fn enlarged_pictures_follow_the_spline() {
        let spline = |distance: f32| match distance.abs() {
            d if d < 1.0 => 2.0 / 3.0 - d * d + d * d * d / 2.0,
            d if d < 2.0 => (2.0 - d).powi(3) / 6.0,
            _ => 0.0,
        };
        let size = [5, 3];
        let level = |x: usize, y: usize| ((x * 89 + y * 53) % 251) as u8;
        let picture: Vec<[u8; 4]> = (0..size[0] * size[1])
            .map(|at| level(at % size[0], at / size[0]))
            .map(|l| [l, 255 - l, l / 2, 9])
            .collect();
        for factor in [2, 3, 4] {
            let large = enlarged(&picture, size, factor);
            assert_eq!(large.len(), picture.len() * factor * factor);
            for (index, found) in large.into_iter().enumerate() {
                let [x, y] = [index % (size[0] * factor), index / (size[0] * factor)];
                let place = |at: usize| (at as f32 + 0.5) / factor as f32 - 0.5;
                let mut sum = Vec4::ZERO;
                for tap in -3..8_i32 {
                    for across in -3..10_i32 {
                        let inside = |at: i32, size: usize| at.clamp(0, size as i32 - 1) as usize;
                        let old = picture[inside(tap, size[1]) * size[0] + inside(across, size[0])].map(f32::from);
                        let weight = spline(place(y) - tap as f32) * spline(place(x) - across as f32);
                        sum += Vec4::from_array(old) * weight;
                    }
                }
                for (channel, (found, expected)) in found.into_iter().zip(sum.to_array()).take(3).enumerate() {
                    let error = (f32::from(found) - expected).abs();
                    assert!(error < 0.52, "{factor}: ({x}, {y}) {channel}: {found} instead of {expected}");
                }
                assert_eq!(found[3], 255);
            }
        }
    }
}
