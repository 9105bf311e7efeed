//! The header of a PLY file: its encoding, and the elements with their properties.

use super::element::{Element, Encoding, Number, Property};
use super::values::Source;
use crate::scene::error::{FileLocation, LoadError};
use crate::text::quoted;

/// Maximum number of header lines; scans have a few dozen.
const MAX_LINES: u64 = 1 << 16;
/// Maximum number of bytes of a header line.
const MAX_LINE: usize = 1 << 16;

/// Advice about a header that breaks the rules of the format.
const CORRECT: &str = "correct the header or export the model again";
/// Advice about a header that is too long.
const SHORTEN: &str = "take comments out of it or export the model again";

/// Reads the header; the source stands at the first element afterwards.
pub(super) fn read(source: &mut Source) -> Result<Vec<Element>, LoadError> {
    let mut elements: Vec<Element> = Vec::new();
    let mut encoding = None;
    // The line ends of the first line are those of the header; after the last one, a line feed may be data.
    let crlf = source.rest().iter().position(|&byte| byte == b'\n' || byte == b'\r');
    let crlf = crlf.is_some_and(|end| source.rest()[end..].starts_with(b"\r\n"));
    loop {
        let rest = source.rest();
        let Some(end) = rest.iter().take(MAX_LINE).position(|&byte| byte == b'\n' || byte == b'\r') else {
            let line = format!("a line of the header is longer than {MAX_LINE} bytes");
            let is_cut = rest.len() < MAX_LINE;
            let cut_off = source.fault("the header has no 'end_header'");
            return Err(if is_cut { cut_off } else { source.fault_with(line, SHORTEN) });
        };
        let line = String::from_utf8_lossy(&rest[..end]).into_owned();
        let ending = if crlf && rest[end..].starts_with(b"\r\n") { 2 } else { 1 };
        if source.line > MAX_LINES {
            return Err(source.fault_with(format!("the header is longer than {MAX_LINES} lines"), SHORTEN));
        }
        let words: Vec<&str> = line.split_ascii_whitespace().take(6).collect();
        let number = source.line;
        let mut warn = |what: &str| source.warnings.add(what, || FileLocation::Line(number));
        match words[..] {
            ["format", name, ref version @ ..] => {
                if version != ["1.0"] {
                    warn("versions of the format other than 1.0, read as 1.0");
                }
                if encoding.is_some() {
                    return Err(source.fault_with("the header names a second format", CORRECT));
                }
                encoding = Some(match name {
                    "ascii" => Encoding::Text,
                    "binary_little_endian" => Encoding::Little,
                    "binary_big_endian" => Encoding::Big,
                    _ => {
                        let known = "ascii, binary_little_endian or binary_big_endian";
                        return Err(
                            source.fault_with(format!("the format {} is none of {known}", quoted(name)), CORRECT)
                        );
                    }
                });
            }
            ["element", name, count] => {
                let Ok(count) = count.parse() else {
                    let problem = format!("{} is not a number of elements", quoted(count));
                    return Err(source.fault_with(problem, CORRECT));
                };
                elements.push(Element { name: name.to_owned(), count, properties: Vec::new(), line: number });
            }
            ["property", ref rest @ ..] => {
                let Some((property, element)) = property(rest).zip(elements.last_mut()) else {
                    let problem = if elements.is_empty() { "stands before any element" } else { "is not a property" };
                    return Err(source.fault_with(format!("{} {problem}", quoted(line.trim())), CORRECT));
                };
                element.properties.push(property);
            }
            ["comment", "TextureFile", ..] => warn("textures named by a comment left out"),
            [] | ["ply" | "comment" | "obj_info", ..] => {}
            ["end_header"] => {
                source.advance(end.saturating_add(ending));
                break;
            }
            _ => warn("lines of the header not understood"),
        }
        source.advance(end.saturating_add(ending));
        source.line = source.line.saturating_add(1);
    }
    source.line = source.line.saturating_add(1);
    source.encoding = encoding.ok_or_else(|| source.fault_with("the header has no line 'format'", CORRECT))?;
    Ok(elements)
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
        "float" | "float32" => Number::F32,
        "double" | "float64" => Number::F64,
        _ => return None,
    })
}
