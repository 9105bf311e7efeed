//! Material libraries (MTL): colours, diffuse textures and cut-outs. Never fails; problems become warnings. What describes
//! reflections, bumps and refraction is skipped without a word, because surfaces are shown as diffuse.

use std::collections::HashMap;

use glam::Vec3;

use super::super::assemble::Assembly;
use super::super::error::FileLocation;
use super::super::images::Images;
use super::super::material::{Material, WrapMode};
use super::super::read::lines;
use super::statement::number;
use crate::budget::Budget;
use crate::text::quoted;

/// Bytes per material: in a list that doubles as it grows, and its name in a table.
const BYTES_PER_MATERIAL: u64 = 4 * size_of::<Material>() as u64;
/// Maximum number of materials of a model; more are taken for a mistake or an attack.
const MAX_MATERIALS: usize = 1 << 16;
/// Bytes between two checks of the memory budget and of cancellation.
const POLL_INTERVAL_BYTES: usize = 1 << 16;

/// Statements, in lower case, about what a diffuse surface does not have or what is the same without them.
const WITHOUT_EFFECT: [&[u8]; 29] = [
    b"",
    b"ka",
    b"ks",
    b"tf",
    b"ns",
    b"ni",
    b"illum",
    b"sharpness",
    b"map_ka",
    b"map_ks",
    b"map_ns",
    b"map_bump",
    b"bump",
    b"map_aat",
    b"refl",
    b"map_refl",
    b"norm",
    b"map_norm",
    b"map_kn",
    b"pr",
    b"pm",
    b"ps",
    b"pc",
    b"pcr",
    b"aniso",
    b"anisor",
    b"map_pr",
    b"map_pm",
    b"map_ps",
];

/// A library while it is read.
struct Library<'a, 'b> {
    /// Its name in the model.
    name: &'a str,
    line: u64,
    images: &'a mut Images<'b>,
    assembly: &'a mut Assembly,
    /// The material being defined.
    current: Option<Definition>,
    /// The warning about statements that are not understood, which names the first of them.
    not_understood: Option<String>,
}

/// A material being defined.
struct Definition {
    index: usize,
    /// Name of its diffuse texture.
    texture: Vec<u8>,
    /// Name of its mask and the line that names it.
    mask: Option<(Vec<u8>, u64)>,
    is_translucent: bool,
}

/// Appends the materials in the text of a library, in file order, and their names; stops once cancelled.
pub(super) fn read(
    text: &[u8],
    name: &str,
    images: &mut Images,
    by_name: &mut HashMap<Vec<u8>, u32>,
    assembly: &mut Assembly,
) {
    let mut library = Library { name, line: 0, images, assembly, current: None, not_understood: None };
    if text.starts_with(b"\xFF\xFE") || text.starts_with(b"\xFE\xFF") {
        library.line = 1;
        library.warn("libraries in UTF-16 not used; save them as UTF-8");
        return;
    }
    let text = text.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(text);
    let (mut at, mut next_poll) = (0_usize, 0);
    for line in lines(text) {
        library.line = library.line.saturating_add(1);
        if at >= next_poll {
            next_poll = at.saturating_add(POLL_INTERVAL_BYTES);
            if library.images.token.is_cancelled() {
                return;
            }
            let bytes = (library.assembly.materials.len() as u64).saturating_mul(BYTES_PER_MATERIAL);
            if let Err(error) = Budget::of_process().check("the materials", bytes) {
                library.warn(&format!("libraries cut off: {error}"));
                break;
            }
        }
        at = at.saturating_add(line.len()).saturating_add(1);
        let line = line.trim_ascii();
        let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
        let (keyword, rest) = line.split_at(end);
        let rest = rest.trim_ascii();
        if keyword == b"newmtl" {
            library.begin(rest, by_name);
        } else if keyword.first() != Some(&b'#') {
            library.statement(keyword, rest);
        }
    }
    library.end();
}

impl Library<'_, '_> {
    fn warn(&mut self, what: &str) {
        let (name, line) = (self.name, self.line);
        self.assembly.warnings.add(what, || FileLocation::LineIn(name.to_owned(), line));
    }

    /// Begins the definition of a material.
    fn begin(&mut self, name: &[u8], by_name: &mut HashMap<Vec<u8>, u32>) {
        self.end();
        let index = self.assembly.materials.len();
        if index >= MAX_MATERIALS {
            self.warn(&format!("materials beyond {MAX_MATERIALS} left out"));
            return;
        }
        if by_name.insert(name.to_vec(), index as u32).is_some() {
            self.warn("materials defined again, of which the last definition is used");
        }
        let name = String::from_utf8_lossy(name).into_owned();
        self.assembly.materials.push(Material { name, base_color: Vec3::splat(0.6), ..Material::clay() });
        self.current = Some(Definition { index, texture: Vec::new(), mask: None, is_translucent: false });
    }

    /// Ends the definition: a mask is the alpha of the diffuse texture.
    fn end(&mut self) {
        let Some(definition) = self.current.take() else { return };
        let Some((mask, line)) = definition.mask else { return };
        let Some(material) = self.assembly.materials.get_mut(definition.index) else { return };
        let is_own = !mask.eq_ignore_ascii_case(&definition.texture);
        if material.base_color_texture.is_some() {
            material.alpha_cutoff = 0.5;
        }
        if is_own {
            let name = self.name;
            let what = "masks (map_d) in a file of their own not used";
            self.assembly.warnings.add(what, || FileLocation::LineIn(name.to_owned(), line));
        }
    }

    /// A statement within the definition of a material.
    fn statement(&mut self, keyword: &[u8], rest: &[u8]) {
        // Longer words are no keywords.
        let mut lower = keyword.get(..16.min(keyword.len())).unwrap_or_default().to_vec();
        lower.make_ascii_lowercase();
        if WITHOUT_EFFECT.contains(&&lower[..]) {
            return;
        }
        let Some(definition) = &mut self.current else {
            if self.assembly.materials.len() < MAX_MATERIALS {
                self.warn("statements before the first 'newmtl' skipped");
            }
            return;
        };
        let index = definition.index;
        let Some(material) = self.assembly.materials.get_mut(index) else { return };
        match &lower[..] {
            b"kd" => match color(rest) {
                Some(color) => material.base_color = color,
                None => self.warn("colours (Kd) not understood"),
            },
            b"ke" => match color(rest) {
                Some(color) => material.emissive = color,
                None => self.warn("colours (Ke) not understood"),
            },
            b"map_kd" => {
                let (name, ignored) = texture_name(rest);
                definition.texture = name.to_vec();
                let location = || FileLocation::LineIn(self.name.to_owned(), self.line);
                let name = String::from_utf8_lossy(name);
                let texture = self.images.texture_named(&name, [WrapMode::Repeat; 2], location);
                material.base_color_texture = texture;
                if texture.is_some() && material.base_color == Vec3::ZERO {
                    material.base_color = Vec3::ONE;
                }
                if ignored {
                    self.warn("textures (map_Kd) shown without their options");
                }
            }
            b"map_d" => definition.mask = Some((texture_name(rest).0.to_vec(), self.line)),
            b"d" | b"tr" => {
                let value = rest.split(u8::is_ascii_whitespace).rev().find_map(number);
                // Programs disagree on whether Tr 1 is clear or opaque.
                let is_translucent = value.is_some_and(|value| value < 1.0 && (value > 0.0 || lower == b"d"));
                if is_translucent && !std::mem::replace(&mut definition.is_translucent, true) {
                    self.warn("materials with transparency shown opaque");
                } else if value.is_none() {
                    self.warn("opacities (d, Tr) not understood");
                }
            }
            b"map_ke" => self.warn("textures of emission (map_Ke) not shown"),
            b"disp" | b"map_disp" => self.warn("displacements (disp) not shown"),
            b"decal" => self.warn("decals not shown"),
            _ => {
                let first = || format!("statements not understood and skipped, {} being the first", quoted(keyword));
                let what = self.not_understood.get_or_insert_with(first).clone();
                self.warn(&what);
            }
        }
    }
}

/// A colour of one number (grey) or three.
fn color(text: &[u8]) -> Option<Vec3> {
    let words = text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    let words = words.take_while(|word| word.first() != Some(&b'#')).take(3);
    let numbers: Vec<f32> = words.map(number).collect::<Option<_>>()?;
    let color = match numbers[..] {
        [grey] => Vec3::splat(grey),
        [r, g, b] => Vec3::new(r, g, b),
        _ => return None,
    };
    color.is_finite().then(|| color.max(Vec3::ZERO))
}

/// The file name of a texture statement, after its options, and whether one of these would change the picture.
fn texture_name(mut rest: &[u8]) -> (&[u8], bool) {
    let mut ignored = false;
    while rest.starts_with(b"-") {
        let (option, mut after) = split_word(rest);
        let (least, most, default) = match option {
            b"-mm" => (2, 2, &[0.0, 1.0][..]),
            b"-s" => (1, 3, &[1.0; 3][..]),
            b"-o" | b"-t" => (1, 3, &[0.0; 3][..]),
            _ => (1, 1, &[][..]),
        };
        for k in 0..most {
            let (word, next) = split_word(after);
            let value = number(word);
            if k >= least && value.is_none() {
                break;
            }
            ignored |= match option {
                b"-clamp" | b"-cc" => word == b"on",
                _ => default.get(k).is_some_and(|default| value != Some(*default)),
            };
            after = next;
        }
        rest = after;
    }
    (rest.trim_ascii(), ignored)
}

/// The first word and what follows it.
fn split_word(text: &[u8]) -> (&[u8], &[u8]) {
    let text = text.trim_ascii_start();
    let end = text.iter().position(u8::is_ascii_whitespace).unwrap_or(text.len());
    let (word, rest) = text.split_at(end);
    (word, rest.trim_ascii_start())
}
