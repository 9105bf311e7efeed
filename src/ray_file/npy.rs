//! Reading arrays that NumPy saved: n × 6 or n × 8, of single or double precision.
//!
//! The header is one line of three fields, read here: the crate for it brings fourteen others, a parser generator among them.

use std::io::Read;

use super::error::RayFileError;
use super::ray::RawRay;

/// The first bytes.
pub(super) const MAGIC: &[u8] = b"\x93NUMPY";

/// Maximum length of the header in bytes; NumPy pads that of a plain array to 118.
const MAX_HEADER: usize = 1 << 16;

const SAVE_AGAIN: &str = "save it by numpy.save(FILE, numpy.ascontiguousarray(rays, dtype='<f4'))";

/// An array under way.
pub(super) struct Npy<'a> {
    source: Box<dyn Read + 'a>,
    rays: u64,
    columns: usize,
    is_double: bool,
    bytes: Vec<u8>,
}

impl<'a> Npy<'a> {
    /// Reads the header. Returns the number of rays, too.
    pub(super) fn open(mut source: Box<dyn Read + 'a>) -> Result<(Self, u64), RayFileError> {
        let header = header(&mut source)?;
        let fault = |problem: String| RayFileError::new(problem, SAVE_AGAIN);
        let descr = after(&header, "descr").and_then(quoted).unwrap_or_default();
        let is_double = match descr {
            "<f4" => false,
            "<f8" => true,
            other => {
                let other = other.escape_debug();
                return Err(fault(format!("is an array of type '{other}' where '<f4' or '<f8' is expected")));
            }
        };
        if !after(&header, "fortran_order").is_some_and(|rest| rest.starts_with("False")) {
            return Err(fault("is an array in Fortran order".to_owned()));
        }
        let shape = after(&header, "shape").and_then(|rest| rest.strip_prefix('(')?.split_once(')'));
        let shape = shape.map_or("", |(shape, _)| shape.trim());
        let sides: Vec<Option<u64>> = shape.split(',').map(|side| side.trim().parse().ok()).collect();
        let [Some(rays), Some(columns @ (6 | 8))] = sides[..] else {
            let shape = shape.escape_debug();
            return Err(fault(format!("has the shape ({shape}) where (n, 6) or (n, 8) is expected")));
        };
        Ok((Self { source, rays, columns: columns as usize, is_double, bytes: Vec::new() }, rays))
    }

    /// Appends at most `most` rays, of which `first` have been read.
    pub(super) fn read(&mut self, first: u64, most: usize, rays: &mut Vec<RawRay>) -> Result<(), RayFileError> {
        let count = self.rays.saturating_sub(first).min(most as u64) as usize;
        let row = self.columns.saturating_mul(if self.is_double { 8 } else { 4 });
        self.bytes.resize(count.saturating_mul(row), 0);
        self.source.read_exact(&mut self.bytes).map_err(|error| match error.kind() {
            std::io::ErrorKind::UnexpectedEof => {
                let problem = format!("ends before ray {} of {}", first.saturating_add(count as u64), self.rays);
                RayFileError::new(problem, "the file may be cut off: save it again")
            }
            _ => RayFileError::of_read(&error),
        })?;
        for row in self.bytes.chunks_exact(row) {
            let numbers: Vec<f64> = if self.is_double {
                row.as_chunks().0.iter().map(|&number| f64::from_le_bytes(number)).collect()
            } else {
                row.as_chunks().0.iter().map(|&number| f64::from(f32::from_le_bytes(number))).collect()
            };
            rays.extend(RawRay::of_numbers(&numbers));
        }
        Ok(())
    }
}

/// The header as text.
fn header(source: &mut dyn Read) -> Result<String, RayFileError> {
    let mut start = [0; 8];
    let cut_off = |_| RayFileError::new("the header of this array of NumPy is cut off", SAVE_AGAIN);
    source.read_exact(&mut start).map_err(cut_off)?;
    let length = if start[6] == 1 {
        let mut length = [0; 2];
        source.read_exact(&mut length).map_err(cut_off)?;
        usize::from(u16::from_le_bytes(length))
    } else {
        let mut length = [0; 4];
        source.read_exact(&mut length).map_err(cut_off)?;
        u32::from_le_bytes(length) as usize
    };
    if length > MAX_HEADER {
        let problem = format!("has a header of {length} bytes, more than {MAX_HEADER}: it is no plain array");
        return Err(RayFileError::new(problem, SAVE_AGAIN));
    }
    let mut header = vec![0; length];
    source.read_exact(&mut header).map_err(cut_off)?;
    Ok(String::from_utf8_lossy(&header).into_owned())
}

/// The text after a key and its colon.
fn after<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    let (_, rest) = header.split_once(&format!("'{key}'"))?;
    Some(rest.trim_start().strip_prefix(':')?.trim_start())
}

/// The text between the quotes that `rest` begins with.
fn quoted(rest: &str) -> Option<&str> {
    Some(rest.strip_prefix('\'')?.split_once('\'')?.0)
}
