//! PLY loader: text, and binary of both byte orders.
//!
//! Not based on ply-rs-bw 4.0, whose text grammar rejects whole files for one `nan`, `.5` or `1.`, for a list continued in the
//! next line and for a Latin-1 comment, and which aborts on elements without properties. Working around that would mean
//! tokenising the file first, which is most of this reader.

use std::path::Path;

use glam::Vec3;

use super::assemble::{Assembly, BYTES_PER_TRIANGLE, BYTES_PER_VERTEX, VertexLists, offset_corners};
use super::error::{FileLocation, LoadError};
use super::material::linear_from_srgb;
use super::read::READ_PROGRESS;
use crate::budget::Budget;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::Triangle;

/// Maximum number of header lines; scans have a few dozen.
const MAX_HEADER_LINES: u64 = 1 << 16;
/// Maximum number of bytes of a number in text.
const MAX_WORD: usize = 1 << 12;
/// Maximum number of bytes of white space between two cancellation checks.
const POLL_INTERVAL_BYTES: usize = 1 << 20;

#[derive(Clone, Copy, PartialEq, Eq)]
enum Encoding {
    Text,
    Little,
    Big,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

struct Property {
    name: String,
    /// Type of the element count of a list property; `None` for a scalar.
    list: Option<Number>,
    number: Number,
}

struct Element {
    name: String,
    count: u64,
    properties: Vec<Property>,
}

impl Element {
    /// Minimum number of bytes of one element in the file.
    fn min_bytes(&self, encoding: Encoding) -> u64 {
        let min = |property: &Property| match encoding {
            Encoding::Text => 2,
            _ => property.list.unwrap_or(property.number).bytes(),
        };
        self.properties.iter().map(min).sum()
    }
}

impl Number {
    fn bytes(self) -> u64 {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

/// Loads a PLY file from memory.
pub(super) fn load(path: &Path, bytes: &[u8], assembly: &mut Assembly, token: &CancelToken) -> Result<(), LoadError> {
    let mut source = Source { path, bytes, at: 0, line: 1, encoding: Encoding::Text, token };
    let elements = source.header()?;
    let mut vertices = Vec::new();
    let mut lists = VertexLists::default();
    let mut faces = Faces::default();
    for element in &elements {
        let left = source.rest().len() as u64;
        // The last word of a text needs no separator behind it.
        let least = element.count.saturating_mul(element.min_bytes(source.encoding)).saturating_sub(1);
        if least > left || element.properties.is_empty() && element.count > 0 {
            return Err(source.fault(format!(
                "{} elements '{}' are declared, but only {left} bytes follow",
                element.count, element.name
            )));
        }
        match element.name.as_str() {
            "vertex" => source.vertices(element, &mut vertices, &mut lists, token)?,
            "face" | "tristrips" => source.faces(element, &mut faces, token)?,
            _ => source.skip(element, token)?,
        }
    }
    assembly.point_count = vertices.len() as u64;
    assembly.mesh_count = 1;
    let first = assembly.add_vertices(vertices.len(), &lists, token)?;
    assembly.reserve(faces.corners.len()).map_err(|error| error.in_file(path))?;
    for (index, &corners) in faces.corners.iter().enumerate() {
        if index % 65_536 == 0 {
            token.check()?;
        }
        let corner = |k: usize| vertices.get(corners[k] as usize).copied();
        if let (Some(a), Some(b), Some(c)) = (corner(0), corner(1), corner(2)) {
            let attributes = offset_corners(corners, first);
            assembly.push(Triangle { a, b, c }, attributes, 0, || FileLocation::Json(format!("face {index}")));
        } else {
            assembly.warnings.add("triangles with a vertex that does not exist skipped", || {
                FileLocation::Json(format!("face {index}"))
            });
        }
    }
    assembly.warnings.add_many(faces.too_few, "faces with fewer than 3 corners skipped", || FileLocation::File);
    Ok(())
}

#[derive(Default)]
struct Faces {
    corners: Vec<[u32; 3]>,
    too_few: u64,
}

struct Source<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    at: usize,
    line: u64,
    encoding: Encoding,
    token: &'a CancelToken,
}

impl Source<'_> {
    /// The unread bytes.
    fn rest(&self) -> &[u8] {
        self.bytes.get(self.at..).unwrap_or_default()
    }

    /// Skips `count` bytes.
    fn advance(&mut self, count: usize) {
        self.at = self.at.saturating_add(count).min(self.bytes.len());
    }

    fn fault(&self, message: impl Into<String>) -> LoadError {
        let location = match self.encoding {
            Encoding::Text => {
                let line = self.bytes[..self.at].rsplit(|&byte| byte == b'\n').next().unwrap_or_default();
                FileLocation::Column(self.line, (line.len() as u64).saturating_add(1))
            }
            _ => FileLocation::Byte(self.at as u64),
        };
        LoadError::at(self.path, location, message, "it may be cut off or damaged: export or copy it again")
    }

    fn header(&mut self) -> Result<Vec<Element>, LoadError> {
        let mut elements: Vec<Element> = Vec::new();
        let mut encoding = None;
        loop {
            let rest = self.rest();
            let Some(end) = rest.iter().take(1 << 16).position(|&byte| byte == b'\n' || byte == b'\r') else {
                return Err(self.fault("the header has no 'end_header'"));
            };
            let line = String::from_utf8_lossy(&rest[..end]).into_owned();
            let ending = if rest[end..].starts_with(b"\r\n") { 2 } else { 1 };
            self.advance(end.saturating_add(ending));
            if self.line > MAX_HEADER_LINES {
                return Err(self.fault(format!("the header is longer than {MAX_HEADER_LINES} lines")));
            }
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            match words[..] {
                ["format", name, ..] => {
                    encoding = Some(match name {
                        "ascii" => Encoding::Text,
                        "binary_little_endian" => Encoding::Little,
                        "binary_big_endian" => Encoding::Big,
                        _ => return Err(self.fault(format!("the format '{name}' is unknown"))),
                    });
                }
                ["element", name, count] => {
                    let count = count.parse().map_err(|_| self.fault(format!("'{count}' is not a count")))?;
                    elements.push(Element { name: name.to_owned(), count, properties: Vec::new() });
                }
                ["property", ref rest @ ..] => {
                    let property = match *rest {
                        ["list", count, number, name] => number_type(count)
                            .zip(number_type(number))
                            .map(|(count, number)| Property { name: name.to_owned(), list: Some(count), number }),
                        [number, name] => {
                            number_type(number).map(|number| Property { name: name.to_owned(), list: None, number })
                        }
                        _ => None,
                    };
                    let Some((property, element)) = property.zip(elements.last_mut()) else {
                        return Err(self.fault(format!("'{}' is not understood", line.trim())));
                    };
                    element.properties.push(property);
                }
                ["end_header"] => break,
                _ => {}
            }
            self.line = self.line.saturating_add(1);
        }
        self.line = self.line.saturating_add(1);
        self.encoding = encoding.ok_or_else(|| self.fault("the header names no format"))?;
        Ok(elements)
    }

    /// Reads a number; integers up to 32 bits and floats convert to `f64` without loss.
    fn number(&mut self, number: Number) -> Result<f64, LoadError> {
        if self.encoding == Encoding::Text {
            return self.text_number();
        }
        let big = self.encoding == Encoding::Big;
        macro_rules! read {
            ($type:ty) => {{
                let part = self.rest().first_chunk::<{ size_of::<$type>() }>();
                let Some(&part) = part else { return Err(self.fault("the file ends too early")) };
                self.advance(part.len());
                f64::from(if big { <$type>::from_be_bytes(part) } else { <$type>::from_le_bytes(part) })
            }};
        }
        Ok(match number {
            Number::I8 => read!(i8),
            Number::U8 => read!(u8),
            Number::I16 => read!(i16),
            Number::U16 => read!(u16),
            Number::I32 => read!(i32),
            Number::U32 => read!(u32),
            Number::F32 => read!(f32),
            Number::F64 => read!(f64),
        })
    }

    fn text_number(&mut self) -> Result<f64, LoadError> {
        while let Some(byte) = self.rest().first().filter(|byte| byte.is_ascii_whitespace()) {
            self.line = self.line.saturating_add(u64::from(*byte == b'\n'));
            self.advance(1);
            if self.at.is_multiple_of(POLL_INTERVAL_BYTES) {
                self.token.check()?;
            }
        }
        let rest = self.rest();
        // The search for the end of a word is bounded.
        let start = rest.get(..MAX_WORD).unwrap_or(rest);
        let end = start.iter().position(u8::is_ascii_whitespace).unwrap_or(start.len());
        if end == MAX_WORD {
            return Err(self.fault(format!("a word is longer than {MAX_WORD} bytes")));
        }
        if end == 0 {
            return Err(self.fault("the file ends too early"));
        }
        let word = &rest[..end];
        let parsed = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
        let Some(value) = parsed else {
            let word: String = String::from_utf8_lossy(word).chars().take(40).collect();
            return Err(self.fault(format!("'{}' is not a number", word.escape_debug())));
        };
        self.advance(end);
        Ok(value)
    }

    fn list_length(&mut self, number: Number) -> Result<u64, LoadError> {
        let length = self.number(number)?;
        let left = self.rest().len() as f64;
        if length >= 0.0 && length <= left && length.fract() == 0.0 {
            Ok(length as u64)
        } else {
            Err(self.fault(format!("a list of {length} entries does not fit into the {left} bytes that follow")))
        }
    }

    fn check_memory(&self, what: &str, bytes: u64) -> Result<(), LoadError> {
        Budget::of_process().check(what, bytes).map_err(|error| LoadError::over_budget(self.path, &error))
    }

    /// Checks for cancellation and reports progress every 16,384 items.
    fn poll(&self, index: u64, token: &CancelToken) -> Result<(), LoadError> {
        if index.is_multiple_of(16_384) {
            token.check()?;
            token.set_progress(READ_PROGRESS + (0.95 - READ_PROGRESS) * self.at as f32 / self.bytes.len() as f32);
        }
        Ok(())
    }

    fn skip_property(&mut self, property: &Property) -> Result<(), LoadError> {
        let length = property.list.map_or(Ok(1), |count| self.list_length(count))?;
        for k in 1..=length {
            if k.is_multiple_of(16_384) {
                self.token.check()?;
            }
            self.number(property.number)?;
        }
        Ok(())
    }

    fn skip(&mut self, element: &Element, token: &CancelToken) -> Result<(), LoadError> {
        for index in 0..element.count {
            self.poll(index, token)?;
            element.properties.iter().try_for_each(|property| self.skip_property(property))?;
        }
        Ok(())
    }

    fn vertices(
        &mut self,
        element: &Element,
        vertices: &mut Vec<Vec3>,
        lists: &mut VertexLists,
        token: &CancelToken,
    ) -> Result<(), LoadError> {
        const NAMES: [[&str; 3]; 3] = [["x", "y", "z"], ["nx", "ny", "nz"], ["red", "green", "blue"]];
        let scalar = |name: &str| element.properties.iter().find(|p| p.name == name && p.list.is_none());
        for name in NAMES[0] {
            if scalar(name).is_none() {
                return Err(self.fault(format!("element vertex has no property {name}")));
            }
        }
        let [_, has_normals, has_colors] = NAMES.map(|names| names.iter().all(|name| scalar(name).is_some()));
        let slots: Vec<Option<usize>> = element
            .properties
            .iter()
            .map(|p| NAMES.iter().flatten().position(|name| *name == p.name && p.list.is_none()))
            .collect();
        let color_scale = match scalar("red").map(|property| property.number) {
            Some(Number::U8) => 1.0 / 255.0,
            Some(Number::U16) => 1.0 / 65_535.0,
            _ => 1.0,
        };
        self.check_memory("the vertices", element.count.saturating_mul(BYTES_PER_VERTEX))?;
        for index in 0..element.count {
            self.poll(index, token)?;
            let mut values = [0.0; 9];
            for (property, slot) in element.properties.iter().zip(&slots) {
                match slot {
                    Some(slot) => values[*slot] = self.number(property.number)? as f32,
                    None => self.skip_property(property)?,
                }
            }
            let [x, y, z, nx, ny, nz, r, g, b] = values;
            vertices.push(Vec3::new(x, y, z));
            if has_normals {
                lists.normals.push(Vec3::new(nx, ny, nz).normalize_or_zero());
            }
            if has_colors {
                lists.colors.push(linear_from_srgb(Vec3::new(r, g, b) * color_scale));
            }
        }
        Ok(())
    }

    fn faces(&mut self, element: &Element, faces: &mut Faces, token: &CancelToken) -> Result<(), LoadError> {
        // The faces here and those of the scene; the list doubles as it grows.
        const BYTES_PER_FACE: u64 = 2 * size_of::<[u32; 3]>() as u64 + BYTES_PER_TRIANGLE;
        let strips = element.name == "tristrips";
        let mut polygon: Vec<u32> = Vec::new();
        let bytes = |triangles: u64| triangles.saturating_mul(BYTES_PER_FACE);
        let mut checked = element.count.saturating_add(faces.corners.len() as u64);
        self.check_memory("the faces", bytes(checked))?;
        for index in 0..element.count {
            self.poll(index, token)?;
            for property in &element.properties {
                let is_corners = matches!(property.name.as_str(), "vertex_indices" | "vertex_index");
                let Some(count) = property.list.filter(|_| is_corners) else {
                    self.skip_property(property)?;
                    continue;
                };
                let length = self.list_length(count)?;
                polygon.clear();
                let wanted = length.saturating_add(faces.corners.len() as u64);
                if wanted > checked {
                    checked = wanted.saturating_mul(2);
                    self.check_memory("the faces", bytes(checked))?;
                }
                for k in 1..=length {
                    self.poll(k, token)?;
                    // A negative index ends a strip; in faces it is out of range like any other index too large.
                    let corner = self.number(property.number)?;
                    polygon.push(if (0.0..4_294_967_295.0).contains(&corner) { corner as u32 } else { u32::MAX });
                }
                if strips {
                    for strip in polygon.split(|&corner| corner == u32::MAX) {
                        for (k, window) in strip.windows(3).enumerate() {
                            let [a, b, c] = [window[0], window[1], window[2]];
                            if a != b && b != c && c != a {
                                faces.corners.push(if k % 2 == 0 { [a, b, c] } else { [b, a, c] });
                            }
                        }
                    }
                } else if polygon.len() < 3 {
                    faces.too_few = faces.too_few.saturating_add(1);
                } else {
                    faces.corners.extend(polygon[1..].windows(2).map(|pair| [polygon[0], pair[0], pair[1]]));
                }
            }
        }
        Ok(())
    }
}

fn number_type(name: &str) -> Option<Number> {
    Some(match name {
        "char" | "int8" => Number::I8,
        "uchar" | "uint8" => Number::U8,
        "short" | "int16" => Number::I16,
        "ushort" | "uint16" => Number::U16,
        "int" | "int32" => Number::I32,
        "uint" | "uint32" => Number::U32,
        "float" | "float32" => Number::F32,
        "double" | "float64" => Number::F64,
        _ => return None,
    })
}
