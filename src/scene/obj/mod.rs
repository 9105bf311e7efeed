//! Wavefront OBJ loader: positions, texture coordinates and normals into lists, faces into fans of triangles.
//!
//! Not based on tobj 4.0, which refuses or panics on some valid files and gives up on others without naming the line; each
//! statement had to be checked and rewritten before tobj read it again. It is the oracle of the tests.

mod face;
mod library;
mod library_values;
mod materials;
mod statement;

use std::path::Path;

use glam::{Vec2, Vec3};

use super::assemble::{Assembly, BYTES_PER_TRIANGLE, BYTES_PER_VERTEX};
use super::error::{FileLocation, LoadError};
use super::images::Images;
use super::material::linear_from_srgb;
use super::options::LoadOptions;
use super::read::READ_PROGRESS;
use crate::budget::Budget;
use crate::text::quoted;
use bvhscope_engine::cancel::CancelToken;
use face::Faces;
use materials::Materials;
use statement::{Fault, Statement, Statements};

/// Bytes of the file between two cancellation checks.
const POLL_INTERVAL_BYTES: usize = 1 << 16;
/// Bytes of the file between two checks of the memory budget.
const MEMORY_INTERVAL_BYTES: usize = 1 << 20;

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

/// Loads an OBJ file from memory.
pub(super) fn load(
    path: &Path,
    bytes: &[u8],
    options: &LoadOptions,
    assembly: &mut Assembly,
    token: &CancelToken,
) -> Result<(), LoadError> {
    let mut model = Model {
        positions: Vec::new(),
        colors: Vec::new(),
        texcoords: Vec::new(),
        normals: Vec::new(),
        faces: Faces::default(),
        materials: Materials::new(Images::new(path, options, token)),
        not_understood: None,
        assembly,
    };
    let mut statements = Statements::new(bytes);
    let (mut next_poll, mut next_memory_check) = (0, MEMORY_INTERVAL_BYTES);
    loop {
        if statements.at >= next_poll {
            token.check()?;
            let fraction = statements.at as f32 / bytes.len().max(1) as f32;
            token.set_progress(READ_PROGRESS + (0.95 - READ_PROGRESS) * fraction);
            next_poll = statements.at.saturating_add(POLL_INTERVAL_BYTES);
        }
        if statements.at >= next_memory_check {
            model.check_memory(path)?;
            next_memory_check = statements.at.saturating_add(MEMORY_INTERVAL_BYTES);
        }
        let line = statements.line.saturating_add(1);
        let in_line = |fault: Fault| {
            let column = fault.column.map(|at| (at as u64).saturating_add(1));
            let location = column.map_or(FileLocation::Line(line), |column| FileLocation::Column(line, column));
            LoadError::at(path, location, fault.problem, fault.advice)
        };
        let Some(statement) = statements.next().map_err(in_line)? else { break };
        if matches!(statement.keyword, b"f" | b"fo") {
            let material = model.materials.current(model.assembly);
            let lists = face::Lists {
                positions: &model.positions,
                colors: &model.colors,
                texcoords: &model.texcoords,
                normals: &model.normals,
            };
            let read = model.faces.read(&statement, &lists, material, model.assembly);
            read.map_err(|error| error.in_file(path))?;
        } else {
            model.read(&statement).map_err(in_line)?;
        }
    }
    token.check()?;
    let Model { positions, materials, assembly, .. } = model;
    assembly.point_count = positions.len() as u64;
    materials.finish(assembly);
    Ok(())
}

/// What was read so far.
struct Model<'a> {
    positions: Vec<Vec3>,
    /// Linear colours of the positions; shorter where the last have none, empty where none has.
    colors: Vec<Vec3>,
    texcoords: Vec<Vec2>,
    normals: Vec<Vec3>,
    faces: Faces,
    materials: Materials<'a>,
    /// The warning about statements that are not understood, which names the first of them.
    not_understood: Option<String>,
    assembly: &'a mut Assembly,
}

impl Model<'_> {
    /// Reads a statement other than a face.
    fn read(&mut self, statement: &Statement<'_>) -> Result<(), Fault> {
        match statement.keyword {
            b"v" => return self.position(statement),
            b"vt" => {
                let ([u, v], count) = statement.numbers::<2>("a texture coordinate", 1)?;
                if !(u.is_finite() && v.is_finite()) {
                    self.warn("statements 'vt' with a number that is not finite", statement);
                }
                if count > 3 {
                    self.warn("statements 'vt' with more than 3 numbers, of which the rest is not used", statement);
                }
                check_count(self.texcoords.len(), "texture coordinates")?;
                self.texcoords.push(Vec2::new(u, 1.0 - v));
            }
            b"vn" => {
                let (normal, count) = statement.numbers::<3>("a normal", 3)?;
                let normal = Vec3::from_array(normal);
                if !normal.is_finite() {
                    self.warn("statements 'vn' with a number that is not finite", statement);
                }
                if count > 3 {
                    self.warn("statements 'vn' with more than 3 numbers, of which the rest is not used", statement);
                }
                check_count(self.normals.len(), "normals")?;
                self.normals.push(normal.normalize_or_zero());
            }
            b"o" | b"g" => self.faces.begin_object(),
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
        Ok(())
    }

    /// Reads a position: three coordinates, then nothing, a weight, or a colour with or without an alpha.
    fn position(&mut self, statement: &Statement<'_>) -> Result<(), Fault> {
        let ([x, y, z, r, g, b, alpha], count) = statement.numbers::<7>("a vertex", 3)?;
        let index = self.positions.len();
        check_count(index, "vertices")?;
        self.positions.push(Vec3::new(x, y, z));
        match count {
            4 if r == 1.0 => {}
            4 => self.warn("vertices with a weight, which is not used", statement),
            5 => self.warn("vertices with 5 numbers, of which 2 are not used", statement),
            6.. => {
                let color = Vec3::new(r, g, b);
                if color.clamp(Vec3::ZERO, Vec3::ONE) != color {
                    self.warn("vertices with a colour outside 0 to 1, which is clamped", statement);
                }
                if count > 7 || count == 7 && alpha != 1.0 {
                    self.warn("vertices with more than 6 numbers, of which the rest is not used", statement);
                }
                self.colors.resize(index, Vec3::ONE);
                self.colors.push(linear_from_srgb(color));
            }
            _ => {}
        }
        Ok(())
    }

    fn warn(&mut self, what: &str, statement: &Statement<'_>) {
        self.assembly.warnings.add(what, || FileLocation::Line(statement.line));
    }

    /// Checks the budget for all lists to double, as they do when they grow.
    fn check_memory(&self, path: &Path) -> Result<(), LoadError> {
        let lists = [
            (self.positions.len(), size_of::<Vec3>() as u64),
            (self.colors.len(), size_of::<Vec3>() as u64),
            (self.texcoords.len(), size_of::<Vec2>() as u64),
            (self.normals.len(), size_of::<Vec3>() as u64),
            (self.faces.vertex_count(), BYTES_PER_VERTEX.saturating_add(face::BYTES_PER_KEY)),
            (self.assembly.len(), BYTES_PER_TRIANGLE),
        ];
        let bytes =
            lists.into_iter().map(|(count, each)| (count as u64).saturating_mul(each)).fold(0, u64::saturating_add);
        let checked = Budget::of_process().check("the vertices and faces", bytes);
        checked.map_err(|error| LoadError::over_budget(path, &error))
    }
}

/// Indices have 32 bits.
fn check_count(count: usize, what: &str) -> Result<(), Fault> {
    if count < u32::MAX as usize {
        return Ok(());
    }
    Err(Fault {
        problem: format!("more than {} {what}, the most there may be", u32::MAX),
        advice: "take a part of the model",
        column: None,
    })
}
