//! Faces of an OBJ file: corners resolved and checked.

use std::io::Write as _;

use super::statement::Statement;

/// An index as it stands in a face.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Index {
    /// There is none, as between the slashes of `1//2`.
    Absent,
    /// Counted from 0.
    At(u32),
    /// A whole number out of range.
    OutOfRange,
    NotANumber,
}

/// Indices of a corner from 0; texture coordinate and normal may be absent or wrong.
type Corner = (u32, Index, Index);

/// Which attributes the corners of a face have.
#[derive(Clone, Copy)]
pub(super) struct Coverage {
    pub(super) some: bool,
    pub(super) all: bool,
    pub(super) out_of_range: bool,
}

impl Coverage {
    const START: Self = Self { some: false, all: true, out_of_range: false };

    fn add(&mut self, index: Index) {
        let is_there = matches!(index, Index::At(_));
        self.some |= index != Index::Absent;
        self.all &= is_there;
        self.out_of_range |= matches!(index, Index::OutOfRange | Index::NotANumber);
    }
}

/// The corners of the face being read.
#[derive(Default)]
pub(super) struct Face {
    pub(super) corners: Vec<Corner>,
    /// Whether one of them has more than three indices.
    pub(super) has_more: bool,
}

impl Face {
    /// Reads the corners of a face and which of them have texture coordinates and normals; `Err` is the reason to skip it. There are
    /// `counts` positions, texture coordinates and normals so far; those positions in `unusable`, in order, are no numbers.
    pub(super) fn read(
        &mut self,
        statement: &Statement<'_>,
        counts: [usize; 3],
        unusable: &[u32],
    ) -> Result<[Coverage; 2], &'static str> {
        self.corners.clear();
        self.has_more = false;
        let [mut texcoords, mut normals] = [Coverage::START; 2];
        let mut is_unusable = false;
        for word in statement.words() {
            let mut parts = word.split(|&byte| byte == b'/');
            let mut index = |count: usize| parts.next().map_or(Index::Absent, |part| resolve(part, count));
            let position = match index(counts[0]) {
                Index::At(position) => position,
                Index::OutOfRange => return Err("faces with a vertex that does not exist (yet) skipped"),
                Index::Absent | Index::NotANumber => {
                    return Err("faces with a corner that is not a whole number skipped");
                }
            };
            is_unusable |= !unusable.is_empty() && unusable.binary_search(&position).is_ok();
            let (texcoord, normal) = (index(counts[1]), index(counts[2]));
            texcoords.add(texcoord);
            normals.add(normal);
            self.has_more |= parts.next().is_some();
            self.corners.push((position, texcoord, normal));
        }
        if is_unusable {
            return Err("faces with coordinates that are not numbers or beyond 1e18 skipped");
        }
        if self.corners.len() < 3 {
            return Err("faces with fewer than 3 corners skipped");
        }
        Ok([texcoords, normals])
    }

    /// Writes the face with the attributes that all its corners have.
    pub(super) fn write(&self, [has_texcoords, has_normals]: [bool; 2], text: &mut Vec<u8>) {
        let at = |index: Index, is_there: bool| {
            if let Index::At(index) = index { Some(index).filter(|_| is_there) } else { None }
        };
        text.push(b'f');
        for &(position, texcoord, normal) in &self.corners {
            // Writing to memory does not fail.
            let _ = write!(text, " {}", u64::from(position).saturating_add(1));
            for index in [at(texcoord, has_texcoords), at(normal, has_normals)] {
                text.push(b'/');
                if let Some(index) = index {
                    let _ = write!(text, "{}", u64::from(index).saturating_add(1));
                }
            }
        }
        text.push(b'\n');
    }
}

/// Warnings about texture coordinates that are out of range, and that only some corners have.
pub(super) const TEXCOORD_FLAWS: [&str; 2] = [
    "faces with a texture coordinate that does not exist (yet) drawn without any",
    "faces with texture coordinates at some of their corners drawn without any",
];

/// Warnings about normals that are out of range, and that only some corners have.
pub(super) const NORMAL_FLAWS: [&str; 2] = [
    "faces with a normal that does not exist (yet) drawn flat",
    "faces with normals at some of their corners drawn flat",
];

/// Resolves an index counted from 1, or from the end if negative, into a list of `count`.
fn resolve(part: &[u8], count: usize) -> Index {
    if part.is_empty() {
        return Index::Absent;
    }
    if let Some(index) = short_number(part).and_then(|number| number.checked_sub(1))
        && (index as usize) < count
    {
        return Index::At(index);
    }
    let Some(index) = std::str::from_utf8(part).ok().and_then(|text| text.parse::<i64>().ok()) else {
        let digits = part.strip_prefix(b"-").or_else(|| part.strip_prefix(b"+")).unwrap_or(part);
        let is_whole = !digits.is_empty() && digits.iter().all(u8::is_ascii_digit);
        return if is_whole { Index::OutOfRange } else { Index::NotANumber };
    };
    let from_start = match index {
        1.. => index.checked_sub(1),
        _ => i64::try_from(count).ok().and_then(|count| count.checked_add(index)).filter(|_| index < 0),
    };
    let found = from_start.and_then(|index| u32::try_from(index).ok()).filter(|&index| (index as usize) < count);
    found.map_or(Index::OutOfRange, Index::At)
}

/// A number of up to nine digits and nothing else, as nearly all indices are.
fn short_number(digits: &[u8]) -> Option<u32> {
    let add = |number: u32, &byte: &u8| {
        let digit = byte.wrapping_sub(b'0');
        (digit < 10).then(|| number.wrapping_mul(10).wrapping_add(u32::from(digit)))
    };
    if digits.len() < 10 { digits.iter().try_fold(0, add) } else { None }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_index_wraps() {
        for (text, expected) in [
            ("1", Index::At(0)),
            ("+5", Index::At(4)),
            ("-1", Index::At(4)),
            ("-5", Index::At(0)),
            ("", Index::Absent),
            ("0", Index::OutOfRange),
            ("-0", Index::OutOfRange),
            ("6", Index::OutOfRange),
            ("-6", Index::OutOfRange),
            ("4294967296", Index::OutOfRange),
            ("4294967297", Index::OutOfRange),
            ("-4294967297", Index::OutOfRange),
            ("9223372036854775807", Index::OutOfRange),
            ("9223372036854775808", Index::OutOfRange),
            ("-9223372036854775808", Index::OutOfRange),
            ("18446744073709551617", Index::OutOfRange),
            ("1.0", Index::NotANumber),
            ("1e3", Index::NotANumber),
            ("x", Index::NotANumber),
            ("-", Index::NotANumber),
            ("--1", Index::NotANumber),
        ] {
            assert!(resolve(text.as_bytes(), 5) == expected, "{text}");
        }
    }
}
