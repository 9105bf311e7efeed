//! The division of a picture into tiles.

use glam::Vec2;

use super::request::RenderRequest;

/// Edge of a tile in traced pixels: a few thousand tiles per window, each traced in well under a millisecond.
const TILE: u32 = 16;
/// Pixels in a full tile; tiles at the right and lower edge of the picture have fewer.
pub(super) const TILE_AREA: usize = (TILE * TILE) as usize;

/// The traced pixels of a request, divided into tiles.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grid {
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) coarseness: f32,
    tiles_x: u32,
    pub(super) tile_count: u32,
}

impl Grid {
    pub(super) fn new(request: &RenderRequest) -> Self {
        Self::of_size(request.width_px, request.height_px, request.coarseness)
    }

    /// The grid of a picture of this size in requested pixels; zeros count as ones.
    fn of_size(width_px: u32, height_px: u32, coarseness: f32) -> Self {
        let coarseness = if coarseness > 1.0 { coarseness } else { 1.0 };
        let [width, height] =
            [width_px, height_px].map(|size| (f64::from(size.max(1)) / f64::from(coarseness)).ceil() as u32);
        let tiles_x = width.div_ceil(TILE);
        Self { width, height, coarseness, tiles_x, tile_count: tiles_x * height.div_ceil(TILE) }
    }

    /// Number of traced pixels.
    pub(super) fn ray_count(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    /// Calls `visit(x, y, index)` for each pixel of a tile in Z order (Morton order), which keeps neighbours together; `index`
    /// is the position within the full tile.
    #[inline(always)]
    pub(super) fn for_each_pixel(&self, tile: u32, mut visit: impl FnMut(u32, u32, usize)) {
        let (left, top) = (tile % self.tiles_x * TILE, tile / self.tiles_x * TILE);
        for place in 0..TILE * TILE {
            // In Z order the even bits are x, the odd bits y.
            let bit = |from: u32, to: u32| (place >> from & 1) << to;
            let across = bit(0, 0) | bit(2, 1) | bit(4, 2) | bit(6, 3);
            let down = bit(1, 0) | bit(3, 1) | bit(5, 2) | bit(7, 3);
            let (x, y) = (left + across, top + down);
            if x < self.width && y < self.height {
                visit(x, y, (down * TILE + across) as usize);
            }
        }
    }

    /// The tile that contains pixel (x, y), and the pixel's position within the tile.
    pub(super) fn index(&self, x: u32, y: u32) -> (usize, usize) {
        ((y / TILE * self.tiles_x + x / TILE) as usize, (y % TILE * TILE + x % TILE) as usize)
    }

    /// Image position in requested pixels of the point `within` (0 to 1 on both axes) of traced pixel (x, y).
    #[inline(always)]
    pub(super) fn point(&self, x: u32, y: u32, within: Vec2) -> Vec2 {
        (Vec2::new(x as f32, y as f32) + within) * self.coarseness
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_is_visited_once_at_its_own_place() {
        for (width, height, coarseness) in
            [(1, 1, 1.0), (16, 16, 1.0), (100, 33, 1.0), (100, 33, 7.0), (5, 400, 3.0), (101, 33, 1.25)]
        {
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
            let size = |pixels: u32| (pixels as f32 / coarseness).ceil() as u32;
            assert_eq!(pixels, size(width) * size(height));
        }
    }
}
