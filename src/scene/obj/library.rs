//! Material libraries (MTL): colours, highlights, textures, bump maps and cut-outs. Never fails; problems become warnings.
//! Statements about refraction, reflection maps and clear coats are ignored silently.
//!
//! The crate tobj reads the materials. It ends at the first number that is none, loses lines and accepts keywords in one spelling
//! only, so that each statement is checked and written in its spelling before; it keeps those it does not know as text.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::fmt::Write as _;

use glam::Vec3;

use super::super::assemble::Assembly;
use super::super::error::FileLocation;
use super::super::images::Images;
use super::super::material::Material;
use super::super::read::{BYTE_ORDER_MARK, lines};
use super::definition::Definition;
use super::library_values::{color, first_number, number};
use crate::budget::Budget;
use crate::text::quoted;

/// Bytes per material: in lists that double as they grow, as tobj has it, and its name in a table.
const BYTES_PER_MATERIAL: u64 = 4 * size_of::<Material>() as u64 + 2 * size_of::<tobj::Material>() as u64;
/// Maximum number of materials of a model; more are taken for a mistake or an attack.
pub(super) const MAX_MATERIALS: usize = 1 << 16;
/// Bytes between two checks of the memory budget and of cancellation.
const POLL_INTERVAL_BYTES: usize = 1 << 16;

/// Statements, in lower case, that change nothing in this renderer.
const WITHOUT_EFFECT: [&[u8]; 16] = [
    b"",
    b"ka",
    b"tf",
    b"ni",
    b"illum",
    b"sharpness",
    b"map_ka",
    b"map_aat",
    b"refl",
    b"map_refl",
    b"ps",
    b"pc",
    b"pcr",
    b"aniso",
    b"anisor",
    b"map_ps",
];

/// Value behind a keyword.
#[derive(Clone, Copy)]
enum Value {
    Color,
    /// A number; the warning where it is none.
    Number(&'static str),
    /// The name of a texture, with options.
    Texture,
}

/// Keywords in lower case, as tobj or [`Definition`] spells them, and their values.
const KEYWORDS: [(&[u8], &str, Value); 18] = [
    (b"kd", "Kd", Value::Color),
    (b"ks", "Ks", Value::Color),
    (b"ke", "Ke", Value::Color),
    (b"ns", "Ns", Value::Number("exponents (Ns) not understood")),
    (b"pr", "Pr", Value::Number("fractions (Pr, Pm) not understood")),
    (b"pm", "Pm", Value::Number("fractions (Pr, Pm) not understood")),
    (b"map_kd", "map_Kd", Value::Texture),
    (b"map_ks", "map_Ks", Value::Texture),
    (b"map_ke", "map_Ke", Value::Texture),
    (b"map_ns", "map_Ns", Value::Texture),
    (b"map_pr", "map_Pr", Value::Texture),
    (b"map_pm", "map_Pm", Value::Texture),
    (b"map_d", "map_d", Value::Texture),
    (b"bump", "bump", Value::Texture),
    (b"map_bump", "bump", Value::Texture),
    (b"norm", "norm", Value::Texture),
    (b"map_norm", "norm", Value::Texture),
    (b"map_kn", "norm", Value::Texture),
];

/// A library while it is read.
struct Library<'a, 'b> {
    /// Its name in the model.
    name: &'a str,
    line: u64,
    /// Index of its first material.
    first: u32,
    /// Its statements as tobj reads them; materials are named by their index.
    text: String,
    /// Lines of the textures of a material, by its name and the keyword.
    texture_lines: HashMap<(usize, &'static str), u64>,
    images: &'a mut Images<'b>,
    assembly: &'a mut Assembly,
    /// Index of the material being defined, and whether it is translucent.
    current: Option<(usize, bool)>,
    /// The warning about statements that are not understood, which names the first of them.
    not_understood: Option<String>,
}

/// Appends the materials in the text of a library, in file order, and their names; stops once cancelled.
pub(super) fn read(
    text: &[u8],
    name: &str,
    images: &mut Images,
    by_name: &mut HashMap<Vec<u8>, u32>,
    assembly: &mut Assembly,
) {
    let first = assembly.materials.len() as u32;
    let (texture_lines, not_understood) = (HashMap::new(), None);
    let repaired = String::new();
    let mut library = Library {
        name,
        line: 0,
        first,
        text: repaired,
        texture_lines,
        images,
        assembly,
        current: None,
        not_understood,
    };
    if text.starts_with(b"\xFF\xFE") || text.starts_with(b"\xFE\xFF") {
        library.line = 1;
        library.warn("libraries in UTF-16 not used; save them as UTF-8");
        return;
    }
    let (mut at, mut next_poll) = (0_usize, 0);
    for line in lines(text) {
        library.line = library.line.saturating_add(1);
        if at >= next_poll {
            next_poll = at.saturating_add(POLL_INTERVAL_BYTES);
            if library.images.token.is_cancelled() {
                return;
            }
            let bytes = (library.assembly.materials.len() as u64).saturating_mul(BYTES_PER_MATERIAL);
            let bytes = bytes.saturating_add((library.text.len() as u64).saturating_mul(2));
            if let Err(error) = Budget::of_process().check("the materials", bytes) {
                library.warn(&format!("libraries cut off: {error}"));
                break;
            }
        }
        at = at.saturating_add(line.len()).saturating_add(1);
        let line = line.trim_ascii();
        let line = line.strip_prefix(BYTE_ORDER_MARK).unwrap_or(line);
        let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
        let (keyword, rest) = line.split_at(end);
        let rest = rest.trim_ascii();
        if keyword == b"newmtl" {
            library.begin(rest, by_name);
        } else if keyword.first() != Some(&b'#') {
            library.statement(keyword, rest);
        }
    }
    library.define();
}

impl Library<'_, '_> {
    fn warn(&mut self, what: &str) {
        let (name, line) = (self.name, self.line);
        self.assembly.warnings.add(what, || FileLocation::LineIn(name.to_owned(), line));
    }

    /// Begins the definition of a material.
    fn begin(&mut self, name: &[u8], by_name: &mut HashMap<Vec<u8>, u32>) {
        self.current = None;
        let index = self.assembly.materials.len();
        if index >= MAX_MATERIALS {
            self.warn(&format!("materials beyond {MAX_MATERIALS} left out"));
            return;
        }
        // Within a library the last definition counts, of several libraries the first.
        match by_name.entry(name.to_vec()) {
            Entry::Vacant(entry) => {
                entry.insert(index as u32);
            }
            Entry::Occupied(mut entry) if *entry.get() >= self.first => {
                entry.insert(index as u32);
                self.warn("materials defined again, of which the last definition is used");
            }
            Entry::Occupied(_) => self.warn("materials of an earlier library defined again, which is not used"),
        }
        let name = String::from_utf8_lossy(name).into_owned();
        self.assembly.materials.push(Material { name, base_color: Vec3::splat(0.6), ..Material::clay() });
        self.current = Some((index, false));
        self.write(format_args!("newmtl {index}"));
    }

    /// Writes a line for tobj.
    fn write(&mut self, line: std::fmt::Arguments<'_>) {
        // Writing to memory does not fail.
        let _ = writeln!(self.text, "{line}");
    }

    /// A statement within the definition of a material.
    fn statement(&mut self, keyword: &[u8], rest: &[u8]) {
        // Longer words are no keywords.
        let mut lower = keyword.get(..16.min(keyword.len())).unwrap_or_default().to_vec();
        lower.make_ascii_lowercase();
        if WITHOUT_EFFECT.contains(&&lower[..]) {
            return;
        }
        let Some((index, is_translucent)) = self.current else {
            if self.assembly.materials.len() < MAX_MATERIALS {
                self.warn("statements before the first 'newmtl' skipped");
            }
            return;
        };
        if let Some((_, name, value)) = KEYWORDS.iter().find(|(known, ..)| *known == lower) {
            return self.value(index, name, *value, rest);
        }
        match &lower[..] {
            b"d" | b"tr" => {
                let value = rest.split(u8::is_ascii_whitespace).rev().find_map(number);
                // Programs disagree on whether Tr 1 is clear or opaque.
                if value.is_some_and(|value| value < 1.0 && (value > 0.0 || lower == b"d")) {
                    if !is_translucent {
                        self.warn("materials with transparency shown opaque");
                    }
                    self.current = Some((index, true));
                } else if value.is_none() {
                    self.warn("opacities (d, Tr) not understood");
                }
            }
            b"disp" | b"map_disp" => self.warn("displacements (disp) not shown"),
            b"decal" => self.warn("decals not shown"),
            _ => {
                let first = || format!("statements not understood and skipped, {} being the first", quoted(keyword));
                let what = self.not_understood.get_or_insert_with(first).clone();
                self.warn(&what);
            }
        }
    }

    /// Checks and writes a statement that tobj or [`Definition`] reads.
    fn value(&mut self, index: usize, name: &'static str, value: Value, rest: &[u8]) {
        match value {
            Value::Color => match color(rest) {
                Some(Vec3 { x, y, z }) => self.write(format_args!("{name} {x} {y} {z}")),
                None => self.warn(&format!("colours ({name}) not understood")),
            },
            Value::Number(otherwise) => match first_number(rest) {
                Some(value) => self.write(format_args!("{name} {value}")),
                None => self.warn(otherwise),
            },
            Value::Texture if rest.is_empty() => self.warn(&format!("textures ({name}) without a name")),
            Value::Texture => {
                self.texture_lines.insert((index, name), self.line);
                self.write(format_args!("{name} {}", String::from_utf8_lossy(rest)));
            }
        }
    }

    /// Reads the text with tobj and gives the materials what it found.
    fn define(&mut self) {
        let definitions = match tobj::load_mtl_buf(&mut self.text.as_bytes()) {
            Ok((definitions, _)) => definitions,
            Err(error) => return self.warn(&format!("libraries not used: {error}")),
        };
        self.text = String::new();
        for read in definitions {
            if self.images.token.is_cancelled() {
                return;
            }
            let Ok(index) = read.name.parse::<usize>() else { continue };
            let Some(mut material) = self.assembly.materials.get(index).cloned() else { continue };
            let line = |keyword| self.texture_lines.get(&(index, keyword)).copied().unwrap_or_default();
            let warnings = &mut self.assembly.warnings;
            Definition { read: &read, name: self.name, line: &line, images: self.images, warnings }
                .apply(&mut material);
            self.assembly.materials[index] = material;
        }
    }
}
