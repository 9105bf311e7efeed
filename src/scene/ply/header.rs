//! The header of a PLY file: its encoding, and the elements with their properties.

use super::element::{Element, Encoding, Number, Property};
use super::values::Source;
use crate::scene::error::{FileLocation, LoadError};
use crate::scene::read::BYTE_ORDER_MARK;
use crate::text::quoted;

/// Maximum number of header lines; scans have a few dozen.
const MAX_LINES: u64 = 1 << 16;
/// Maximum number of bytes of a header line.
const MAX_LINE: usize = 1 << 16;

/// Advice about a header that breaks the rules of the format.
const CORRECT: &str = "correct the header or export the model again";
/// Advice about a header that is too long.
const SHORTEN: &str = "take comments out of it or export the model again";

/// The declarations read so far.
#[derive(Default)]
struct Declared {
    encoding: Option<Encoding>,
    elements: Vec<Element>,
}

/// Reads the header; the source is at the first element afterwards.
pub(super) fn read(source: &mut Source) -> Result<Vec<Element>, LoadError> {
    let mut declared = Declared::default();
    // Where lines end in a carriage return alone, a line feed after the last one is data.
    let rest = source.rest();
    let first_end = rest.iter().position(|&byte| byte == b'\n' || byte == b'\r').unwrap_or(rest.len());
    let is_old_mac = rest[first_end..].starts_with(b"\r") && !rest[first_end..].starts_with(b"\r\n");
    loop {
        let rest = source.rest();
        let Some(end) = rest.iter().take(MAX_LINE).position(|&byte| byte == b'\n' || byte == b'\r') else {
            let line = format!("a line of the header is longer than {MAX_LINE} bytes");
            let is_cut = rest.len() < MAX_LINE;
            let cut_off = source.fault("the header has no 'end_header'");
            return Err(if is_cut { cut_off } else { source.fault_with(line, SHORTEN) });
        };
        if source.line > MAX_LINES {
            return Err(source.fault_with(format!("the header is longer than {MAX_LINES} lines"), SHORTEN));
        }
        let line = String::from_utf8_lossy(&rest[..end]).into_owned();
        let is_end = declared.line(&line, source)?;
        let ending = if !is_old_mac && rest[end..].starts_with(b"\r\n") { 2 } else { 1 };
        source.advance(end.saturating_add(ending));
        source.line = source.line.saturating_add(1);
        if is_end {
            break;
        }
    }
    source.encoding = declared.encoding.ok_or_else(|| source.fault_with("the header has no line 'format'", CORRECT))?;
    if source.encoding == Encoding::Text && source.rest().starts_with(BYTE_ORDER_MARK) {
        source.advance(BYTE_ORDER_MARK.len());
    }
    Ok(declared.elements)
}

impl Declared {
    /// Reads a line; returns whether it is the last.
    fn line(&mut self, line: &str, source: &mut Source) -> Result<bool, LoadError> {
        let words: Vec<&str> = line.split_ascii_whitespace().take(6).collect();
        let number = source.line;
        let mut warn = |what: &str| source.warnings.add(what, || FileLocation::Line(number));
        match words[..] {
            ["format", name, ref version @ ..] => {
                if version != ["1.0"] {
                    warn("versions of the format other than 1.0, read as 1.0");
                }
                if self.encoding.is_some() {
                    return Err(source.fault_with("the header names a second format", CORRECT));
                }
                self.encoding = Some(encoding(name, source)?);
            }
            ["element", name, count] => {
                let Ok(count) = count.parse() else {
                    let problem = format!("{} is not a number of elements", quoted(count));
                    return Err(source.fault_with(problem, CORRECT));
                };
                self.elements.push(Element { name: name.to_owned(), count, properties: Vec::new(), line: number });
            }
            ["property", ref rest @ ..] => {
                let Some((property, element)) = property(rest).zip(self.elements.last_mut()) else {
                    let is_first = self.elements.is_empty();
                    let problem = if is_first { "stands before any element" } else { "is not a property" };
                    return Err(source.fault_with(format!("{} {problem}", quoted(line.trim())), CORRECT));
                };
                element.properties.push(property);
            }
            ["comment", "TextureFile", ..] => warn("textures named by a comment left out"),
            [] | ["ply" | "comment" | "obj_info", ..] => {}
            ["end_header"] => return Ok(true),
            _ => warn("lines of the header not understood"),
        }
        Ok(false)
    }
}

/// The encoding that a line "format" names.
fn encoding(name: &str, source: &Source) -> Result<Encoding, LoadError> {
    match name {
        "ascii" => Ok(Encoding::Text),
        "binary_little_endian" => Ok(Encoding::Little),
        "binary_big_endian" => Ok(Encoding::Big),
        _ => {
            let known = "ascii, binary_little_endian or binary_big_endian";
            Err(source.fault_with(format!("the format {} is none of {known}", quoted(name)), CORRECT))
        }
    }
}

/// The property that the words after "property" declare.
fn property(words: &[&str]) -> Option<Property> {
    match *words {
        ["list", count, number, name] => {
            let (count, number) = number_type(count).zip(number_type(number))?;
            Some(Property { name: name.to_owned(), list: Some(count), number })
        }
        [number, name] => number_type(number).map(|number| Property { name: name.to_owned(), list: None, number }),
        _ => None,
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
        "int64" => Number::I64,
        "uint64" => Number::U64,
        "float" | "float32" => Number::F32,
        "double" | "float64" => Number::F64,
        _ => return None,
    })
}
