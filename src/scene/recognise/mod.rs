//! Recognises a file by its content, as a model format or as something else, which the refusal names.

mod foreign;
mod zip;

use std::path::Path;

use super::error::LoadError;
use super::format::{FileFormat, format_names};
use super::read::{TEXT_SAMPLE, beginning, is_control, is_plain_text};
use super::{pbrt, stl};
use crate::text::quoted;
use bvhscope_engine::tree_file::is_tree_file;

/// Bytes of the beginning in which keywords of a text format are looked for.
const SEARCHED: usize = 1 << 16;
/// Advice about text in an encoding whose characters have more than one byte.
const SAVE_AS_UTF8: &str = "save it as UTF-8";

/// Recognises the format by content first, then by extension; refuses by name what is no model that can be read.
pub(super) fn recognise(path: &Path, bytes: &[u8]) -> Result<FileFormat, LoadError> {
    if is_tree_file(bytes) {
        return Ok(FileFormat::Bvh);
    }
    if bytes.starts_with(b"glTF") {
        return Ok(FileFormat::Gltf);
    }
    if is_ply(bytes) {
        return Ok(FileFormat::Ply);
    }
    if stl::binary_size(bytes) == Some(bytes.len() as u64) {
        return Ok(FileFormat::Stl);
    }
    let start = bytes.get(..SEARCHED).unwrap_or(bytes);
    if !start.is_empty() && start.iter().all(|&byte| byte == 0) {
        let advice = "copying it was probably interrupted: copy or download it again";
        return Err(LoadError::of_file(path, "holds nothing but zero bytes", advice));
    }
    if !start.is_empty() && beginning(start).is_empty() {
        return Err(LoadError::of_file(path, "holds nothing but white space", "save the model again"));
    }
    if let Some((what, advice)) = foreign::find(bytes) {
        return Err(LoadError::of_file(path, format!("is {what}"), advice));
    }
    let text = beginning(bytes);
    if text.starts_with(b"{") {
        return Ok(FileFormat::Gltf);
    }
    if stl::is_text(bytes) {
        return Ok(FileFormat::Stl);
    }
    if pbrt::is_pbrt(bytes) {
        return Ok(FileFormat::Pbrt);
    }
    let named = FileFormat::from_extension(path);
    // A file with another name is OBJ only if its first statements are.
    match named {
        Some(FileFormat::Obj) => return Ok(FileFormat::Obj),
        _ if first_statements(text).all(is_statement) && first_statements(text).next().is_some() => {
            return Ok(FileFormat::Obj);
        }
        Some(FileFormat::Stl) if !is_plain_text(bytes) => return Ok(FileFormat::Stl),
        _ => {}
    }
    let seems = describe(bytes);
    Err(if let Some(format) = named {
        let advice = "it may be another file under a wrong name, or damaged: copy or export it again";
        LoadError::of_file(path, format!("is {seems}, not {}", format.name()), advice)
    } else {
        let problem = format!("is {seems}, neither {}", format_names("nor"));
        LoadError::of_file(path, problem, "export the model in one of these formats")
    })
}

/// Likely kind of a file that gave no triangles as OBJ: "text that begins with 'hello'"; `None` if it looks like OBJ. Where
/// its reader has `refused` a line of text, that is more informative.
pub(super) fn unlike_obj(bytes: &[u8], refused: bool) -> Option<String> {
    let searched = bytes.get(..SEARCHED).unwrap_or(bytes);
    // A stray control character in a short file, or zero bytes that a program left in a comment, make it no binary data.
    let start = searched.get(..TEXT_SAMPLE).unwrap_or(searched);
    let controls = start.iter().filter(|&&byte| byte != 0 && is_control(byte)).count();
    let is_text = controls.saturating_mul(16) <= start.len().max(16);
    let has_statement = lines_of(searched).any(is_statement);
    (!is_text || !has_statement && !refused).then(|| describe(bytes))
}

/// The name of an encoding of text other than one byte a character: by its byte order mark, else by zero bytes between the
/// characters of its beginning.
pub(super) fn wide_encoding(bytes: &[u8]) -> Option<&'static str> {
    let [utf16, utf32] = ["UTF-16", "UTF-32"];
    if bytes.starts_with(b"\xFF\xFE\0\0") || bytes.starts_with(b"\0\0\xFE\xFF") {
        return Some(utf32);
    }
    if bytes.starts_with(b"\xFF\xFE") || bytes.starts_with(b"\xFE\xFF") {
        return Some(utf16);
    }
    let start = bytes.get(..64).unwrap_or(bytes);
    let is_text = |byte: u8| byte.is_ascii_graphic() || byte.is_ascii_whitespace();
    let fits = |unit: usize, at: usize| {
        let units = start.chunks_exact(unit);
        units.len() >= 4
            && units
                .into_iter()
                .all(|unit| unit.iter().enumerate().all(|(k, &b)| if k == at { is_text(b) } else { b == 0 }))
    };
    if fits(4, 0) || fits(4, 3) {
        return Some(utf32);
    }
    (fits(2, 0) || fits(2, 1)).then_some(utf16)
}

/// True if the first line is "ply".
fn is_ply(bytes: &[u8]) -> bool {
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    bytes.strip_prefix(b"ply").is_some_and(|rest| {
        let end = rest.iter().take(TEXT_SAMPLE).position(|&byte| byte == b'\n' || byte == b'\r');
        end.is_some_and(|end| rest[..end].trim_ascii().is_empty())
    })
}

/// The lines of a text that are neither blank nor comments.
fn lines_of(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    let lines = text.split(|&byte| byte == b'\n' || byte == b'\r').map(<[u8]>::trim_ascii);
    lines.filter(|line| !line.is_empty() && !line.starts_with(b"#"))
}

/// The first lines of a text that are neither blank nor comments.
fn first_statements(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    lines_of(text.get(..4096).unwrap_or(text)).take(3)
}

/// True if a line is a statement of OBJ.
fn is_statement(line: &[u8]) -> bool {
    const KEYWORDS: [&[u8]; 14] =
        [b"v", b"vt", b"vn", b"vp", b"f", b"fo", b"l", b"p", b"o", b"g", b"s", b"usemtl", b"mtllib", b"cstype"];
    let word = line.split(u8::is_ascii_whitespace).next().unwrap_or_default();
    KEYWORDS.contains(&word)
}

/// Description of bytes of no known format: "text that begins with 'hello'".
fn describe(bytes: &[u8]) -> String {
    let text = beginning(bytes);
    if bytes.is_empty() {
        return "empty".to_owned();
    }
    if is_plain_text(bytes) {
        let line = lines_of(text).next().or_else(|| text.split(|&byte| byte == b'\n').next()).unwrap_or_default();
        return format!("text that begins with {}", quoted(line));
    }
    let shown: Vec<_> = bytes.iter().take(4).map(|byte| format!("{byte:02x}")).collect();
    format!("binary data that begins with the bytes {}", shown.join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_text_is_recognised_with_and_without_a_mark() {
        let text = "solid a\nfacet normal 0 0 1\n";
        let wide = |unit: usize, big: bool| -> Vec<u8> {
            let put = |byte: u8| {
                let mut bytes = vec![0; unit];
                bytes[if big { unit - 1 } else { 0 }] = byte;
                bytes
            };
            text.bytes().flat_map(put).collect()
        };
        for big in [false, true] {
            assert_eq!(wide_encoding(&wide(2, big)), Some("UTF-16"));
            assert_eq!(wide_encoding(&wide(4, big)), Some("UTF-32"));
        }
        assert_eq!(wide_encoding(b"\xFF\xFEv\0"), Some("UTF-16"));
        assert_eq!(wide_encoding(b"\0\0\xFE\xFF\0\0\0v"), Some("UTF-32"));
        assert_eq!(wide_encoding(text.as_bytes()), None);
        assert_eq!(wide_encoding(&[0; 100]), None);
        assert_eq!(wide_encoding(b""), None);
    }
}
