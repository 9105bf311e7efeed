//! A raster image to draw on, with letters at fractions of a pixel: whole pixels would set them too close or too far apart.

use std::error::Error;

use ab_glyph::{Font as _, FontRef, ScaleFont as _, point};
use plotters::prelude::{BitMapBackend, DrawingBackend};
use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingErrorKind};

/// A raster image over a buffer of RGB pixels.
pub struct Bitmap<'a> {
    shapes: BitMapBackend<'a>,
    font: FontRef<'static>,
}

type BitmapError = <BitMapBackend<'static> as DrawingBackend>::ErrorType;
type Drawn = Result<(), DrawingErrorKind<BitmapError>>;

impl<'a> Bitmap<'a> {
    /// An image of `size` in `pixels`, which are three times as many bytes.
    pub fn new(pixels: &'a mut [u8], size: (u32, u32)) -> Result<Self, String> {
        let font = FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT).map_err(|error| error.to_string())?;
        Ok(Self { shapes: BitMapBackend::with_buffer(pixels, size), font })
    }

    /// The pixels that the letters of `text` cover, of which the first begins at 0 across and whose lines are around 0 up, and by how
    /// much of 1 each.
    fn covered(&self, text: &str, size: f32) -> Vec<(BackendCoord, f32)> {
        let font = self.font.as_scaled(size);
        let (mut covered, mut across, mut previous) = (Vec::new(), 0.0, None);
        for letter in text.chars().map(|character| font.glyph_id(character)) {
            across += previous.map_or(0.0, |previous| font.kern(previous, letter));
            previous = Some(letter);
            let placed = letter.with_scale_and_position(size, point(across, size / 2.0));
            if let Some(outline) = font.outline_glyph(placed) {
                let corner = outline.px_bounds().min;
                outline.draw(|x, y, coverage| {
                    covered.push(((corner.x as i32 + x as i32, corner.y as i32 + y as i32), coverage));
                });
            }
            across += font.h_advance(letter);
        }
        covered
    }
}

impl DrawingBackend for Bitmap<'_> {
    type ErrorType = BitmapError;

    fn get_size(&self) -> (u32, u32) {
        self.shapes.get_size()
    }

    fn ensure_prepared(&mut self) -> Drawn {
        self.shapes.ensure_prepared()
    }

    fn present(&mut self) -> Drawn {
        self.shapes.present()
    }

    fn draw_pixel(&mut self, point: BackendCoord, color: BackendColor) -> Drawn {
        self.shapes.draw_pixel(point, color)
    }

    fn draw_line<S: BackendStyle>(&mut self, from: BackendCoord, to: BackendCoord, style: &S) -> Drawn {
        self.shapes.draw_line(from, to, style)
    }

    fn draw_rect<S: BackendStyle>(&mut self, from: BackendCoord, to: BackendCoord, style: &S, fill: bool) -> Drawn {
        self.shapes.draw_rect(from, to, style, fill)
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(&mut self, path: I, style: &S) -> Drawn {
        self.shapes.draw_path(path, style)
    }

    fn draw_circle<S: BackendStyle>(&mut self, center: BackendCoord, radius: u32, style: &S, fill: bool) -> Drawn {
        self.shapes.draw_circle(center, radius, style, fill)
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(&mut self, corners: I, style: &S) -> Drawn {
        self.shapes.fill_polygon(corners, style)
    }

    fn draw_text<T: BackendTextStyle>(&mut self, text: &str, style: &T, at: BackendCoord) -> Drawn {
        let unknown =
            |error: T::FontError| DrawingErrorKind::FontError(Box::new(error) as Box<dyn Error + Send + Sync>);
        let ((left, top), (right, bottom)) = style.layout_box(text).map_err(unknown)?;
        let before = match style.anchor().h_pos {
            HPos::Left => 0,
            HPos::Right => left - right,
            HPos::Center => (left - right) / 2,
        };
        let above = match style.anchor().v_pos {
            VPos::Top => 0,
            VPos::Center => (top - bottom) / 2,
            VPos::Bottom => top - bottom,
        };
        let (transform, color) = (style.transform(), style.color());
        let [width, height] = [self.get_size().0, self.get_size().1].map(|side| side as i32);
        for ((x, y), coverage) in self.covered(text, style.size() as f32) {
            let (x, y) = transform.transform(x + before - left, y + above - top);
            let place = (at.0 + x, at.1 + y);
            if (0..width).contains(&place.0) && (0..height).contains(&place.1) {
                self.draw_pixel(place, color.mix(f64::from(coverage)))?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    /// First and last column of each stroke of a row of letters without curves.
    fn strokes(text: &str, size: f32) -> Vec<f32> {
        let mut pixels = [0; 3];
        let bitmap = Bitmap::new(&mut pixels, (1, 1)).unwrap();
        let covered = bitmap.covered(text, size);
        let columns = 1 + covered.iter().map(|((x, _), _)| *x).max().unwrap() as usize;
        let mut sums = vec![0.0; columns];
        for ((x, _), coverage) in &covered {
            sums[*x as usize] += coverage;
        }
        // The centre of gravity of each group of columns with ink.
        sums.split(|sum| *sum == 0.0)
            .scan(0, |start, group| {
                let first = *start;
                *start += group.len() + 1;
                let ink: f32 = group.iter().sum();
                let moment: f32 = group.iter().enumerate().map(|(at, sum)| (first + at) as f32 * sum).sum();
                Some((!group.is_empty()).then(|| moment / ink))
            })
            .flatten()
            .collect()
    }

    #[test]
    fn equal_letters_have_equal_distances() {
        let centers = strokes("llllllllll", 19.0);
        assert_eq!(centers.len(), 10, "{centers:?}");
        let distances: Vec<f32> = centers.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let [least, most] = [f32::min, f32::max].map(|pick| distances.iter().copied().reduce(pick).unwrap());
        assert!(most - least < 0.2, "{distances:?}");
    }
}
