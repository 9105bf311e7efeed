//! Legends below saved pictures whose colours stand for numbers: quantity, unit and range.

use image::imageops::thumbnail;
use image::{Rgb, RgbImage};
use plotters::coord::Shift;
use plotters::prelude::*;

use crate::lab::diff::diverging;
use crate::lab::plot::{Axis, Scale, font, text_width, tick_text};
#[cfg(feature = "gui")]
use crate::overlay::Role;
use crate::overlay::{self, ColorScale, NodeTable, Shown};
use crate::render::{Background, Frame, HeatKind, Shading};

/// Narrowest picture that has a legend unless one is asked for, in pixels.
const NARROWEST: u32 = 240;
/// Number of colours of a bar.
const COLORS: usize = 256;
/// Most levels that have a colour each in the legend of depths.
const MAX_LEVELS: u32 = 12;
/// Margin in units of the legend.
const MARGIN: i32 = 12;
/// Height of a key in units of the legend.
const HEIGHT: u32 = 58;
/// Size of the font in units of the legend.
const FONT_SIZE: u32 = 14;
/// Largest number of pixels in a unit.
const MAX_UNIT: u32 = 4;

/// A row of a legend.
#[derive(Debug, Clone, PartialEq)]
pub struct Key {
    /// The quantity with its unit and range.
    title: String,
    colors: Colors,
}

#[derive(Debug, Clone, PartialEq)]
enum Colors {
    /// A bar of colours, and labels at places from 0 to 1 along it.
    Bar(Vec<[u8; 3]>, Vec<(f32, String)>),
    /// Single colours with names.
    Named(Vec<([u8; 3], String)>),
}

/// The legends of what the colours of a picture stand for: those of its values, else those of the containers over it. Without
/// `geometry` the traced picture is left out.
pub fn of_picture(frame: &Frame, geometry: bool, containers: Option<(&NodeTable, &Shown)>) -> Vec<Key> {
    let of_values = of_values(frame).filter(|_| geometry);
    let is_neutral = geometry && frame.settings.shading.is_coded();
    let containers = containers.filter(|(_, shown)| !is_neutral && !shown.nodes.is_empty());
    let of_containers = containers.map(|(table, shown)| of_containers(table, shown));
    of_values.into_iter().chain(of_containers).collect()
}

/// The legend of a picture in a mode whose colours stand for numbers.
fn of_values(frame: &Frame) -> Option<Key> {
    let [low, high] = frame.value_range;
    let quantity = match frame.settings.shading {
        Shading::Heat(HeatKind::ClosestPoint) => {
            format!("{} of each pixel", capitalized(HeatKind::ClosestPoint.counted()))
        }
        Shading::Heat(kind) => format!("{} of each ray{}", capitalized(kind.counted()), frame.in_layout()),
        Shading::Depth => "Distance from the observer, in units of the model".to_owned(),
        Shading::Thickness => "Thickness along the ray, in units of the model".to_owned(),
        Shading::Distance => {
            format!("Distance to the surface, in units of the model; a line every {}", frame.line_spacing)
        }
        _ => return None,
    };
    let color = |at: f32| frame.settings.value_color(at);
    Some(numbers(&quantity, [low, high], color))
}

/// The legend of the difference of two heat maps, whose colours span `limit` in both directions.
pub fn of_difference(limit: f32) -> Key {
    numbers("Tests of each ray: B minus A", [-limit, limit], |at| diverging(at * 2.0 - 1.0))
}

/// The legend of the containers `shown` of `table`.
pub fn of_containers(table: &NodeTable, shown: &Shown) -> Key {
    let legend = overlay::legend(shown);
    let [first, last] = shown.levels;
    if let ColorScale::Metric(scale) = &shown.colors
        && shown.colors.is_by_depth()
        && last - first < MAX_LEVELS
    {
        let color = |depth: u32| {
            let color = overlay::ramp(scale.position(depth as f32));
            (overlay::level_color(color, depth, shown.levels), depth.to_string())
        };
        let title = format!("Depth of the containers; the tree reaches {}", table.max_depth());
        return Key { title, colors: Colors::Named((first..=last).map(color).collect()) };
    }
    if shown.colors == ColorScale::Planes {
        let kinds = legend.stops.into_iter().map(|(at, kind)| (overlay::ramp(at), kind));
        return Key { title: legend.title.to_owned(), colors: Colors::Named(kinds.collect()) };
    }
    let colors = (0..COLORS).map(|step| overlay::ramp(step as f32 / (COLORS - 1) as f32)).collect();
    Key { title: legend.title.to_owned(), colors: Colors::Bar(colors, legend.stops) }
}

/// The legend of what lights up at a step of a construction.
#[cfg(feature = "gui")]
pub fn of_merge(title: String, is_split: bool) -> Key {
    let [whole, first] =
        if is_split { ["split", "into these: first"] } else { ["made by this merge", "merged, first"] };
    let named = [(Role::Selected, whole), (Role::FirstChild, first), (Role::SecondChild, "second")];
    let named = named.into_iter().filter_map(|(role, name)| Some((role.color()?, name.to_owned())));
    Key { title, colors: Colors::Named(named.collect()) }
}

/// A bar for numbers from `low` to `high`.
fn numbers(quantity: &str, [low, high]: [f32; 2], color: impl Fn(f32) -> [u8; 3]) -> Key {
    let axis = Axis { low: f64::from(low), high: f64::from(high.max(low + f32::MIN_POSITIVE)), scale: Scale::Linear };
    let labels = axis.ticks(9).into_iter().map(|value| (axis.at(value) as f32, tick_text(&axis, value))).collect();
    let [from, to] = [axis.low, axis.high].map(|end| tick_text(&axis, end));
    let colors = (0..COLORS).map(|step| color(step as f32 / (COLORS - 1) as f32)).collect();
    Key { title: format!("{quantity}, colours from {from} to {to}"), colors: Colors::Bar(colors, labels) }
}

fn capitalized(text: &str) -> String {
    let mut characters = text.chars();
    characters.next().map_or_else(String::new, |first| first.to_uppercase().chain(characters).collect())
}

impl Key {
    /// The quantity with its unit and range.
    pub fn title(&self) -> &str {
        &self.title
    }
}

/// Whether a picture has a legend: as `asked` for, by default where it is wide enough.
pub fn is_wanted(asked: Option<bool>, width_px: u32) -> bool {
    asked.unwrap_or(width_px >= NARROWEST)
}

/// Pixels in a unit of the legend: larger pictures have larger letters.
pub fn unit(width_px: u32) -> u32 {
    (width_px / 800).clamp(1, MAX_UNIT)
}

/// Height in pixels of a legend of `count` keys below a picture.
pub fn height_px(width_px: u32, count: usize) -> u32 {
    HEIGHT * unit(width_px) * count as u32
}

/// Appends a legend below the pixels of a picture, and returns the new height.
pub fn append(rgba: &mut Vec<[u8; 4]>, [width, height]: [u32; 2], keys: &[Key], background: Background) -> u32 {
    let (added, unit) = (height_px(width, keys.len()), unit(width));
    // Letters are placed at whole pixels, so that small ones are drawn larger and reduced.
    let finer = MAX_UNIT / unit;
    let [fine_width, fine_height] = [width, added].map(|side| side * finer);
    let mut pixels = vec![0_u8; (fine_width * fine_height * 3) as usize];
    let area = BitMapBackend::with_buffer(&mut pixels, (fine_width, fine_height)).into_drawing_area();
    // Drawing into memory does not fail. Bitmaps have letters a quarter of their size higher than SVG has.
    let _ = draw(&area, keys, background, unit * finer, FONT_SIZE * unit * finer / 4);
    drop(area);
    let Some(fine) = RgbImage::from_raw(fine_width, fine_height, pixels) else { return height };
    let legend = if finer == 1 { fine } else { thumbnail(&fine, width, added) };
    rgba.extend(legend.pixels().map(|&Rgb([r, g, b])| [r, g, b, 255]));
    height + added
}

/// Draws the keys below each other, by a unit in pixels, and all letters `lower` pixels lower than the backend puts them.
pub fn draw<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    keys: &[Key],
    background: Background,
    unit: u32,
    lower: u32,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let (paper, ink) = if background.is_dark() { (RGBColor(24, 26, 29), WHITE) } else { (WHITE, BLACK) };
    area.fill(&paper)?;
    let (width_px, unit, lower) = (area.dim_in_pixel().0, unit as i32, lower as i32);
    let style = (font(), FONT_SIZE * unit as u32).into_font().color(&ink);
    let text_height = FONT_SIZE as i32 * unit;
    let (left, right) = (MARGIN * unit, width_px as i32 - MARGIN * unit);
    for (index, key) in keys.iter().enumerate() {
        let top = (HEIGHT as i32 * index as i32 + 5) * unit;
        let title_scale = scale_within(right - left, text_width(&key.title, text_height as u32));
        let title_style = (font(), (text_height as f32 * title_scale) as i32).into_font().color(&ink);
        area.draw(&Text::new(key.title.clone(), (left, top + lower), title_style))?;
        let [bar_top, bar_bottom] = [top + 19 * unit, top + 31 * unit];
        match &key.colors {
            Colors::Bar(colors, labels) => {
                let x_of = |part: f32| left + ((right - left) as f32 * part) as i32;
                for (step, &[r, g, b]) in colors.iter().enumerate() {
                    let [from, to] = [step, step + 1].map(|step| x_of(step as f32 / colors.len() as f32));
                    area.draw(&Rectangle::new([(from, bar_top), (to, bar_bottom)], RGBColor(r, g, b).filled()))?;
                }
                let mut free_from = 0;
                for (part, text) in labels {
                    let width = text_width(text, text_height as u32);
                    let x = (x_of(*part) - width / 2).clamp(left / 2, (right + left / 2 - width).max(left / 2));
                    if x >= free_from {
                        area.draw(&Text::new(text.clone(), (x, bar_bottom + 3 * unit + lower), style.clone()))?;
                        free_from = x + width + 6 * unit;
                    }
                }
            }
            Colors::Named(named) => {
                let widths = named.iter().map(|(_, name)| text_width(name, text_height as u32)).sum::<i32>();
                let room = right - left - (31 * named.len() as i32 + 16 * (named.len() as i32 - 1).max(0)) * unit;
                let text_height = (text_height as f32 * scale_within(room, widths)) as i32;
                let style = (font(), text_height).into_font().color(&ink);
                let mut x = left;
                for ([r, g, b], name) in named {
                    let swatch = [(x, bar_top), (x + 26 * unit, bar_bottom)];
                    area.draw(&Rectangle::new(swatch, RGBColor(*r, *g, *b).filled()))?;
                    area.draw(&Text::new(name.clone(), (x + 31 * unit, bar_top - unit + lower), style.clone()))?;
                    x += 31 * unit + text_width(name, text_height as u32) + 16 * unit;
                }
            }
        }
    }
    area.present()
}

/// Size of letters, as a part of the usual one, by which text of this width fits into the room; at least half.
fn scale_within(room: i32, width: i32) -> f32 {
    (room as f32 / width.max(1) as f32).clamp(0.5, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bar_has_its_colors_in_order_and_says_its_range() {
        let key = of_difference(62.0);
        assert_eq!(key.title(), "Tests of each ray: B minus A, colours from -62 to 62");
        let mut pixels = vec![[1, 2, 3, 4]; 800 * 2];
        let height = append(&mut pixels, [800, 2], std::slice::from_ref(&key), Background::White);
        assert_eq!((pixels.len(), height), (800 * (2 + HEIGHT as usize), 2 + HEIGHT));
        assert_eq!(pixels[..1600], [[1, 2, 3, 4]; 1600], "the picture stays");
        // In the middle of the bar.
        let row = &pixels[800 * (2 + 5 + 25)..][..800];
        let at = |x: usize| [row[x][0], row[x][1], row[x][2]];
        for (x, value) in [(14, -1.0), (400, 0.0), (785, 1.0)] {
            let expected = diverging(value);
            assert!(at(x).iter().zip(expected).all(|(a, b)| a.abs_diff(b) < 6), "{x}: {:?} {expected:?}", at(x));
        }
    }

    #[test]
    fn letters_stay_within_a_narrow_picture() {
        let colors = Colors::Bar(vec![[0; 3]; 2], vec![(0.0, "1,000,000".to_owned()), (1.0, "2,000,000".to_owned())]);
        let title = "Distance from the observer, in units of the model".to_owned();
        let mut pixels = Vec::new();
        let height = append(&mut pixels, [260, 0], &[Key { title, colors }], Background::White);
        for row in pixels.as_chunks::<260>().0.iter().take(height as usize) {
            let [first, last] = [&row[..4], &row[256..]];
            assert!(first.iter().chain(last).all(|pixel| *pixel == [255; 4]), "ink at the edge");
        }
    }

    #[test]
    fn narrow_pictures_have_a_legend_only_on_request() {
        assert_eq!(
            [(None, 100), (None, 800), (Some(true), 100), (Some(false), 800)]
                .map(|(asked, width)| { is_wanted(asked, width) }),
            [false, true, true, false]
        );
    }
}
