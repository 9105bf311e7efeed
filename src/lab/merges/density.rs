//! How many merges there are at each time and area, for a plot of more merges than pixels.

use std::ops::Range;

/// Numbers of merges in a grid of equal cells over steps and log2 of the relative area.
#[derive(Debug, Clone, PartialEq)]
pub struct Density {
    /// Number of columns and of rows.
    pub size: [usize; 2],
    /// Number of merges in each cell, row by row from the largest area, each from the first step.
    pub counts: Vec<u32>,
    /// First step, from 1, and number of steps.
    pub steps: [u32; 2],
    /// Smallest and largest log2 of the area on the axis; the second is always larger.
    pub range: [f32; 2],
}

impl Density {
    /// The density of some of the steps, of which `log_areas` has those of all. Not more columns than steps.
    pub fn new(log_areas: &[f32], steps: Range<usize>, [columns, rows]: [usize; 2]) -> Self {
        let first = steps.start;
        let window = log_areas.get(steps).unwrap_or_default();
        let columns = columns.min(window.len()).max(1);
        let range = area_axis(window);
        let mut counts = vec![0; columns * rows];
        for (at, &area) in window.iter().enumerate() {
            let column = at * columns / window.len();
            let height = (area - range[0]) / (range[1] - range[0]);
            let row = (((1.0 - height) * rows as f32) as usize).min(rows - 1);
            counts[row * columns + column] += 1;
        }
        Self { size: [columns, rows], counts, steps: [first as u32 + 1, window.len() as u32], range }
    }

    /// The largest number in a cell.
    pub fn largest(&self) -> u32 {
        self.counts.iter().copied().max().unwrap_or(0)
    }
}

/// The axis for these log2 areas: both ends of their range, and at least one doubling.
pub fn area_axis(log_areas: &[f32]) -> [f32; 2] {
    let low = log_areas.iter().copied().fold(f32::INFINITY, f32::min);
    let high = log_areas.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    if low > high { [-1.0, 0.0] } else { [low.min(high - 1.0), high] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_merge_is_in_one_cell() {
        let areas: Vec<f32> = (0..1000).map(|step| -10.0 + step as f32 / 100.0).collect();
        let density = Density::new(&areas, 0..1000, [16, 8]);
        assert_eq!(density.size, [16, 8]);
        assert_eq!(density.counts.iter().sum::<u32>(), 1000);
        assert_eq!(density.counts[15], 62, "the last steps make the largest, which are in the first row");
        assert_eq!(density.counts[7 * 16], 63, "the first make the smallest");
        assert_eq!(density.largest(), 63);
    }

    #[test]
    fn a_window_has_its_own_axis() {
        let areas = [-20.0, -20.0, -3.0, -1.0, 0.0];
        let density = Density::new(&areas, 2..5, [16, 4]);
        assert_eq!((density.size, density.steps, density.range), ([3, 4], [3, 3], [-3.0, 0.0]));
        assert_eq!(density.counts.iter().sum::<u32>(), 3);
    }

    #[test]
    fn nothing_and_equal_areas_have_an_axis() {
        assert_eq!(area_axis(&[]), [-1.0, 0.0]);
        assert_eq!(area_axis(&[-4.0, -4.0]), [-5.0, -4.0]);
        assert_eq!(Density::new(&[], 0..0, [8, 4]).counts, [0; 4]);
    }
}
