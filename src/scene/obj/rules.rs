//! Which statements of an OBJ file pass to the crate tobj as they are, which are repaired, and which are left out and counted.

use std::io::Write as _;
use std::path::Path;

use glam::Vec2;

use super::super::assemble::{Assembly, BYTES_PER_TRIANGLE};
use super::super::error::{FileLocation, LoadError};
use super::super::offset::MAX_COORDINATE;
use super::face::{Face, NORMAL_FLAWS, TEXCOORD_FLAWS};
use super::materials::Materials;
use super::statement::{Fault, Statement};
use crate::budget::Budget;
use crate::text::quoted;

/// Maximum number of faces of a mesh: tobj finds the vertices of a mesh in a table, which should fit into a processor's cache.
const MAX_FACES: usize = 1 << 14;
/// Bytes of a position, normal or colour in tobj's lists, and of a texture coordinate.
const BYTES_PER_ITEM: [u64; 3] = [48, 16, 24];
/// Bytes of a mesh of tobj without its lists, and about what the allocator adds to these.
const BYTES_PER_PART: u64 = 2 * size_of::<tobj::Model>() as u64 + 512;

/// Statements that do not change what is shown: of comments, smoothing (which `vn` states as well), levels of detail, and the
/// parts of free-form curves and surfaces, which are counted by their elements.
const WITHOUT_EFFECT: [&[u8]; 33] = [
    b"",
    b"s",
    b"mg",
    b"lod",
    b"bevel",
    b"c_interp",
    b"d_interp",
    b"shadow_obj",
    b"trace_obj",
    b"ctech",
    b"stech",
    b"cstype",
    b"deg",
    b"bmat",
    b"step",
    b"parm",
    b"trim",
    b"hole",
    b"scrv",
    b"sp",
    b"end",
    b"con",
    b"vp",
    b"usemap",
    b"maplib",
    b"bsp",
    b"bzp",
    b"cdc",
    b"cdp",
    b"res",
    b"vertexformat",
    b"version",
    b"units",
];

/// A run of faces with one material and the same attributes, which becomes a mesh.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct Part {
    /// Index of the material.
    pub(super) material: u32,
    /// Whether all corners have texture coordinates, and normals.
    has: [bool; 2],
}

/// The faces that passed.
#[derive(Default)]
pub(super) struct Parts {
    pub(super) list: Vec<Part>,
    /// Lines of the faces of more than three corners, in order.
    pub(super) polygon_lines: Vec<u32>,
    /// Number of triangles that the faces become at most.
    pub(super) triangles: usize,
}

/// The reason why the text ends early.
pub(super) enum Stop {
    /// A statement that cannot be read, with its line.
    Fault(u64, Fault),
    Load(LoadError),
    /// A position has a colour and earlier ones have none: the text is to be read again with a colour for each.
    Colors,
}

/// Where a statement goes.
pub(super) enum Verdict {
    /// To tobj as it stands.
    Pass,
    /// Nowhere, or repaired into [`Rules::made`].
    Replaced,
}

/// The state of the file between two statements.
pub(super) struct Rules<'a, 'b> {
    /// Numbers of positions, texture coordinates and normals so far.
    pub(super) counts: [usize; 3],
    /// Every position that passes has a colour.
    is_colored: bool,
    /// Positions that are not finite or too large, in order.
    unusable: Vec<u32>,
    face: Face,
    /// Whether the next face begins an object or group.
    object_open: bool,
    faces_of_part: usize,
    pub(super) parts: Parts,
    pub(super) materials: Materials<'b>,
    /// The warning about statements that are not understood, which names the first of them.
    not_understood: Option<String>,
    pub(super) assembly: &'a mut Assembly,
    /// Repaired text.
    pub(super) made: Vec<u8>,
}

/// Number of words, and whether each is made of digits, points and signs and is short enough to be a number within the range of
/// coordinates, if it is one.
fn shape(text: &[u8]) -> (usize, bool) {
    let (mut words, mut length, mut is_short) = (0_usize, 0_usize, true);
    for &byte in text {
        if byte.is_ascii_whitespace() {
            length = 0;
        } else {
            words = words.saturating_add(usize::from(length == 0));
            length = length.saturating_add(1);
            is_short &= length < 18 && (byte.is_ascii_digit() || matches!(byte, b'.' | b'-' | b'+'));
        }
    }
    (words, is_short)
}

impl<'a, 'b> Rules<'a, 'b> {
    pub(super) fn new(is_colored: bool, materials: Materials<'b>, assembly: &'a mut Assembly) -> Self {
        Self {
            counts: [0; 3],
            is_colored,
            unusable: Vec::new(),
            face: Face::default(),
            object_open: true,
            faces_of_part: 0,
            parts: Parts::default(),
            materials,
            not_understood: None,
            assembly,
            made: Vec::new(),
        }
    }

    /// Reads a statement.
    pub(super) fn read(&mut self, statement: &Statement<'_>) -> Result<Verdict, Stop> {
        let in_line = |fault| Stop::Fault(statement.line, fault);
        match statement.keyword {
            b"f" | b"fo" => return Ok(self.face(statement)),
            b"v" => return self.position(statement),
            b"vt" => return self.texcoord(statement).map_err(in_line),
            b"vn" => return self.normal(statement).map_err(in_line),
            b"o" | b"g" => self.object_open = true,
            b"usemtl" => self.materials.choose(statement, self.assembly),
            b"mtllib" => self.materials.add_libraries(statement, self.assembly),
            b"l" => self.warn("lines not shown", statement),
            b"p" => {
                let count = statement.words().count() as u64;
                let line = statement.line;
                self.assembly.warnings.add_many(count, "points not shown", || FileLocation::Line(line));
            }
            b"curv" | b"curv2" => self.warn("curves not shown", statement),
            b"surf" => self.warn("surfaces in free form not shown", statement),
            b"call" => self.warn("files named by 'call' not read", statement),
            keyword if keyword.first() == Some(&b'#') || WITHOUT_EFFECT.contains(&keyword) => {}
            keyword => {
                let first = || format!("statements not understood and skipped, {} being the first", quoted(keyword));
                let what = self.not_understood.get_or_insert_with(first);
                self.assembly.warnings.add(what, || FileLocation::Line(statement.line));
            }
        }
        Ok(Verdict::Replaced)
    }

    /// A position: three coordinates, then nothing, a weight, or a colour with or without an alpha.
    fn position(&mut self, statement: &Statement<'_>) -> Result<Verdict, Stop> {
        let in_line = |fault| Stop::Fault(statement.line, fault);
        let index = self.count(0, "vertices").map_err(in_line)?;
        let (count, is_short) = shape(statement.rest);
        if is_short && count == 3 && statement.is_plain && !self.is_colored {
            return Ok(Verdict::Pass);
        }
        let (values, count) = statement.numbers::<7>("a vertex", 3).map_err(in_line)?;
        let [x, y, z, mut r, mut g, mut b, alpha] = values;
        match count {
            4 if r == 1.0 => {}
            4 => self.warn("vertices with a weight, which is not used", statement),
            5 => self.warn("vertices with 5 numbers, of which 2 are not used", statement),
            6.. => {
                if ![r, g, b].iter().all(|part| (0.0..=1.0).contains(part)) {
                    self.warn("vertices with a colour outside 0 to 1, which is clamped", statement);
                }
                if count > 7 || count == 7 && alpha != 1.0 {
                    self.warn("vertices with more than 6 numbers, of which the rest is not used", statement);
                }
                if !self.is_colored && index > 0 {
                    return Err(Stop::Colors);
                }
                self.is_colored = true;
            }
            _ => {}
        }
        if count < 6 {
            (r, g, b) = (1.0, 1.0, 1.0);
        }
        let is_usable = [x, y, z].iter().all(|part| part.abs() <= f64::from(MAX_COORDINATE));
        let passes = is_usable && count == if self.is_colored { 6 } else { 3 };
        if passes && statement.is_plain && !statement.rest.contains(&b'(') {
            return Ok(Verdict::Pass);
        }
        if !is_usable {
            self.unusable.push(index as u32);
        }
        let [x, y, z] = [x, y, z].map(|part| if is_usable { part } else { 0.0 });
        if self.is_colored {
            self.make(format_args!("v {x} {y} {z} {r} {g} {b}"));
        } else {
            self.make(format_args!("v {x} {y} {z}"));
        }
        Ok(Verdict::Replaced)
    }

    fn texcoord(&mut self, statement: &Statement<'_>) -> Result<Verdict, Fault> {
        self.count(1, "texture coordinates")?;
        let (count, is_short) = shape(statement.rest);
        if is_short && matches!(count, 2 | 3) && statement.is_plain {
            return Ok(Verdict::Pass);
        }
        let ([u, v], count) = statement.numbers::<2>("a texture coordinate", 1)?;
        if !Vec2::new(u as f32, v as f32).is_finite() {
            self.warn("statements 'vt' with a number that is not finite", statement);
        }
        if count > 3 {
            self.warn("statements 'vt' with more than 3 numbers, of which the rest is not used", statement);
        }
        self.make(format_args!("vt {u} {v}"));
        Ok(Verdict::Replaced)
    }

    fn normal(&mut self, statement: &Statement<'_>) -> Result<Verdict, Fault> {
        self.count(2, "normals")?;
        let (count, is_short) = shape(statement.rest);
        if is_short && count == 3 && statement.is_plain {
            return Ok(Verdict::Pass);
        }
        let ([x, y, z], count) = statement.numbers::<3>("a normal", 3)?;
        if ![x, y, z].iter().all(|part| (*part as f32).is_finite()) {
            self.warn("statements 'vn' with a number that is not finite", statement);
        }
        if count > 3 {
            self.warn("statements 'vn' with more than 3 numbers, of which the rest is not used", statement);
        }
        self.make(format_args!("vn {x} {y} {z}"));
        Ok(Verdict::Replaced)
    }

    /// A face: counted where it is skipped or loses attributes. tobj needs the same attributes at all corners of a mesh.
    fn face(&mut self, statement: &Statement<'_>) -> Verdict {
        let coverages = match self.face.read(statement, self.counts, &self.unusable) {
            Ok(coverages) => coverages,
            Err(skipped) => {
                self.warn(skipped, statement);
                return Verdict::Replaced;
            }
        };
        let mut is_whole = statement.is_plain && statement.keyword == b"f" && !self.face.has_more;
        for (coverage, kinds) in coverages.into_iter().zip([&TEXCOORD_FLAWS, &NORMAL_FLAWS]) {
            if coverage.out_of_range {
                self.warn(kinds[0], statement);
            } else if coverage.some && !coverage.all {
                self.warn(kinds[1], statement);
            }
            is_whole &= coverage.some == coverage.all;
        }
        if self.face.has_more {
            self.warn("faces with more than 3 indices at a corner, of which the rest is not used", statement);
        }
        let begins = std::mem::take(&mut self.object_open);
        self.assembly.mesh_count = self.assembly.mesh_count.saturating_add(usize::from(begins));
        let corners = self.face.corners.len();
        if corners > 3 {
            self.parts.polygon_lines.push(u32::try_from(statement.line).unwrap_or(u32::MAX));
        }
        self.parts.triangles = self.parts.triangles.saturating_add(corners.saturating_sub(2));
        let has = coverages.map(|coverage| coverage.all);
        self.begin_part(has);
        if is_whole {
            return Verdict::Pass;
        }
        self.face.write(has, &mut self.made);
        Verdict::Replaced
    }

    /// Begins a mesh of tobj, named by the index of its part, if the face differs from the last or there are enough.
    fn begin_part(&mut self, has: [bool; 2]) {
        let part = Part { material: self.materials.current(self.assembly), has };
        if self.parts.list.last() != Some(&part) || self.faces_of_part >= MAX_FACES {
            self.faces_of_part = 0;
            // Writing to memory does not fail.
            let _ = writeln!(self.made, "g {}", self.parts.list.len());
            self.parts.list.push(part);
        }
        self.faces_of_part = self.faces_of_part.saturating_add(1);
    }

    /// Writes a repaired line.
    fn make(&mut self, line: std::fmt::Arguments<'_>) {
        // Writing to memory does not fail.
        let _ = writeln!(self.made, "{line}");
    }

    /// Index of a new item of a list, which has 32 bits.
    fn count(&mut self, list: usize, what: &str) -> Result<usize, Fault> {
        let index = self.counts[list];
        if index >= u32::MAX as usize {
            return Err(Fault {
                problem: format!("more than {} {what}, the most there may be", u32::MAX),
                advice: "take a part of the model",
                column: None,
            });
        }
        self.counts[list] = index.saturating_add(1);
        Ok(index)
    }

    fn warn(&mut self, what: &str, statement: &Statement<'_>) {
        self.assembly.warnings.add(what, || FileLocation::Line(statement.line));
    }

    /// Checks the budget for the lists to double, as they do when they grow, and for the triangles of the faces.
    pub(super) fn check_memory(&self, path: &Path) -> Result<(), Stop> {
        let items = self.counts.iter().zip(BYTES_PER_ITEM).map(|(&count, each)| (count as u64).saturating_mul(each));
        let parts = (self.parts.list.len() as u64).saturating_mul(BYTES_PER_PART);
        let triangles = (self.parts.triangles as u64).saturating_mul(BYTES_PER_TRIANGLE);
        let bytes = items.chain([parts, triangles]).fold(0, u64::saturating_add);
        let checked = Budget::of_process().check("the vertices and faces", bytes);
        checked.map_err(|error| Stop::Load(LoadError::over_budget(path, &error)))
    }
}
