//! How the traced pixels of a picture lie in tiles.

use glam::Vec2;

use super::request::RenderRequest;

/// Edge of a tile in traced pixels: some thousand tiles for a window, each well below a millisecond.
const TILE: u32 = 16;
/// Pixels that a tile has room for; those at the right and lower edge of the picture use fewer.
pub(super) const TILE_AREA: usize = (TILE * TILE) as usize;

/// The traced pixels of a request and how they lie in tiles.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grid {
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) coarseness: u32,
    tiles_x: u32,
    pub(super) tile_count: u32,
}

impl Grid {
    pub(super) fn new(request: &RenderRequest) -> Self {
        Self::of_size(request.width_px, request.height_px, request.coarseness)
    }

    /// For a picture of this size in wanted pixels; zeros count as ones.
    fn of_size(width_px: u32, height_px: u32, coarseness: u32) -> Self {
        let coarseness = coarseness.max(1);
        let (width, height) = (width_px.max(1).div_ceil(coarseness), height_px.max(1).div_ceil(coarseness));
        let tiles_x = width.div_ceil(TILE);
        Self { width, height, coarseness, tiles_x, tile_count: tiles_x * height.div_ceil(TILE) }
    }

    /// Calls `visit(x, y, index)` for each pixel of a tile, `index` counting from 0 within the tile's square. In Z order, so
    /// that neighbours follow each other.
    #[inline(always)]
    pub(super) fn for_each_pixel(&self, tile: u32, mut visit: impl FnMut(u32, u32, usize)) {
        let (left, top) = (tile % self.tiles_x * TILE, tile / self.tiles_x * TILE);
        for place in 0..TILE * TILE {
            // Even bits of the place in Z order are x, odd ones y.
            let bit = |from: u32, to: u32| (place >> from & 1) << to;
            let across = bit(0, 0) | bit(2, 1) | bit(4, 2) | bit(6, 3);
            let down = bit(1, 0) | bit(3, 1) | bit(5, 2) | bit(7, 3);
            let (x, y) = (left + across, top + down);
            if x < self.width && y < self.height {
                visit(x, y, (down * TILE + across) as usize);
            }
        }
    }

    /// The tile in which pixel (x, y) lies, and its place there.
    pub(super) fn index(&self, x: u32, y: u32) -> (usize, usize) {
        ((y / TILE * self.tiles_x + x / TILE) as usize, (y % TILE * TILE + x % TILE) as usize)
    }

    /// A point of traced pixel (x, y), given from 0 to 1 on both axes, in wanted pixels.
    #[inline(always)]
    pub(super) fn point(&self, x: u32, y: u32, within: Vec2) -> Vec2 {
        (Vec2::new(x as f32, y as f32) + within) * self.coarseness as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_is_visited_once_at_its_own_place() {
        for (width, height, coarseness) in [(1, 1, 1), (16, 16, 1), (100, 33, 1), (100, 33, 7), (5, 400, 3)] {
            let grid = Grid::of_size(width, height, coarseness);
            let mut seen = vec![false; grid.tile_count as usize * TILE_AREA];
            let mut pixels = 0;
            for tile in 0..grid.tile_count {
                grid.for_each_pixel(tile, |x, y, index| {
                    assert!(x < grid.width && y < grid.height);
                    assert_eq!((tile as usize, index), grid.index(x, y));
                    let index = tile as usize * TILE_AREA + index;
                    assert!(!seen[index]);
                    seen[index] = true;
                    pixels += 1;
                });
            }
            assert_eq!(pixels, width.div_ceil(coarseness) * height.div_ceil(coarseness));
        }
    }
}
