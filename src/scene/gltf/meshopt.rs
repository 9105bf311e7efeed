//! Data compressed by meshopt (EXT_meshopt_compression and KHR_meshopt_compression): codecs of attributes, triangles and indices, and
//! filters of attributes, as the appendices of the extensions' specifications describe them.

#![allow(
    clippy::arithmetic_side_effects,
    reason = "sums and shifts below 2^16, floats, and arithmetic that wraps on purpose"
)]

use bvhscope_engine::cancel::{CancelToken, Cancelled, HEAVY_STEPS};

/// The reason why data were not decoded.
#[derive(Debug)]
pub(super) enum MeshoptError {
    /// Decoding was cancelled.
    Cancelled(Cancelled),
    /// The data are damaged or of an unknown kind.
    Damaged(&'static str),
}

impl From<Cancelled> for MeshoptError {
    fn from(cancelled: Cancelled) -> Self {
        Self::Cancelled(cancelled)
    }
}

const SHORT: MeshoptError = MeshoptError::Damaged("the compressed data end too early");
const UNKNOWN: MeshoptError = MeshoptError::Damaged("the compressed data are of an unknown kind");

/// Compressed bytes, read from the front.
struct Reader<'a> {
    rest: &'a [u8],
}

impl<'a> Reader<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], MeshoptError> {
        let (taken, rest) = self.rest.split_at_checked(count).ok_or(SHORT)?;
        self.rest = rest;
        Ok(taken)
    }

    fn byte(&mut self) -> Result<u8, MeshoptError> {
        Ok(self.take(1)?[0])
    }

    /// A number of up to 32 bits, seven in each byte, the lowest first.
    fn varint(&mut self) -> Result<u32, MeshoptError> {
        let mut number = 0;
        for shift in (0..35).step_by(7) {
            let byte = self.byte()?;
            number |= u32::from(byte & 127) << shift.min(31);
            if byte < 128 {
                return Ok(number);
            }
        }
        Err(SHORT)
    }

    /// An index that is stored as its difference from `last`.
    fn index(&mut self, last: u32) -> Result<u32, MeshoptError> {
        Ok(last.wrapping_add(unzigzag(self.varint()?)))
    }
}

fn unzigzag(number: u32) -> u32 {
    (number >> 1) ^ (number & 1).wrapping_neg()
}

/// Decodes `count` elements of `stride` bytes.
pub(super) fn decode(
    bytes: &[u8],
    [count, stride]: [usize; 2],
    mode: &str,
    filter: &str,
    token: &CancelToken,
) -> Result<Vec<u8>, MeshoptError> {
    let mut decoded = match mode {
        "ATTRIBUTES" if stride.is_multiple_of(4) && (4..=256).contains(&stride) => {
            attributes(bytes, count, stride, token)?
        }
        "TRIANGLES" | "INDICES" if stride == 2 || stride == 4 => {
            let list = if mode == "INDICES" { indices(bytes, count, token)? } else { triangles(bytes, count, token)? };
            list.iter().flat_map(|index| index.to_le_bytes().into_iter().take(stride)).collect()
        }
        _ => return Err(UNKNOWN),
    };
    for part in decoded.chunks_mut(stride * HEAVY_STEPS) {
        token.check()?;
        for element in part.chunks_exact_mut(stride) {
            match (filter, stride) {
                ("NONE" | "", _) => {}
                ("OCTAHEDRAL", 4 | 8) => octahedral(element),
                ("QUATERNION", 8) => quaternion(element),
                ("EXPONENTIAL", _) => exponential(element),
                ("COLOR", 4 | 8) => color(element),
                _ => return Err(UNKNOWN),
            }
        }
    }
    Ok(decoded)
}

/// Appendix A, mode 0: attributes.
fn attributes(bytes: &[u8], count: usize, stride: usize, token: &CancelToken) -> Result<Vec<u8>, MeshoptError> {
    let version = match bytes.first() {
        Some(0xa0) => 0,
        Some(0xa1) => 1,
        _ => return Err(UNKNOWN),
    };
    let channel_count = if version == 0 { 0 } else { stride / 4 };
    let tail_size = stride + channel_count;
    let padded_tail = tail_size.max(if version == 0 { 32 } else { 24 });
    let end = bytes.len().checked_sub(padded_tail).filter(|&end| end >= 1).ok_or(SHORT)?;
    let (mut last, channels) = bytes[bytes.len() - tail_size..].split_at(stride);
    let mut reader = Reader { rest: &bytes[1..end] };
    let block_size = (8192 / stride / 16 * 16).min(256);
    let mut result = vec![0; count.checked_mul(stride).ok_or(SHORT)?];
    let mut previous: Vec<u8>;
    for block in result.chunks_mut(block_size * stride) {
        token.check()?;
        attribute_block(&mut reader, block, last, channels)?;
        previous = block[block.len() - stride..].to_vec();
        last = &previous;
    }
    if reader.rest.is_empty() { Ok(result) } else { Err(MeshoptError::Damaged("compressed data are left over")) }
}

/// Decodes a block of elements, of which each byte is stored beside those of the other elements. `channels` is empty in version 0.
fn attribute_block(reader: &mut Reader, block: &mut [u8], last: &[u8], channels: &[u8]) -> Result<(), MeshoptError> {
    let (stride, count) = (last.len(), block.len() / last.len());
    let controls = reader.take(channels.len())?;
    for first in (0..stride).step_by(4) {
        let mut planes = [[0_u8; 256]; 4];
        for (j, plane) in planes.iter_mut().enumerate() {
            match controls.get(first / 4).map(|control| control >> (2 * j) & 3) {
                None => plane_bytes(reader, plane, count, [0, 2, 4, 8])?,
                Some(0) => plane_bytes(reader, plane, count, [0, 1, 2, 4])?,
                Some(1) => plane_bytes(reader, plane, count, [1, 2, 4, 8])?,
                Some(2) => {}
                Some(_) => plane[..count].copy_from_slice(reader.take(count)?),
            }
        }
        let channel = channels.get(first / 4).copied().unwrap_or(0);
        let mut before: [u8; 4] = std::array::from_fn(|j| last[first + j]);
        for (k, element) in block.chunks_exact_mut(stride).enumerate() {
            let stored: [u8; 4] = std::array::from_fn(|j| planes[j][k]);
            before = match channel & 3 {
                0 => std::array::from_fn(|j| (stored[j] >> 1 ^ (stored[j] & 1).wrapping_neg()).wrapping_add(before[j])),
                1 => {
                    let half = |j: usize| {
                        let number = u16::from_le_bytes([stored[j], stored[j + 1]]);
                        let delta = number >> 1 ^ (number & 1).wrapping_neg();
                        delta.wrapping_add(u16::from_le_bytes([before[j], before[j + 1]])).to_le_bytes()
                    };
                    let ([a, b], [c, d]) = (half(0), half(2));
                    [a, b, c, d]
                }
                2 => {
                    let turned = u32::from_le_bytes(stored).rotate_right(u32::from(channel >> 4));
                    (turned ^ u32::from_le_bytes(before)).to_le_bytes()
                }
                _ => return Err(UNKNOWN),
            };
            element[first..first + 4].copy_from_slice(&before);
        }
    }
    Ok(())
}

/// Decodes `count` bytes in groups of 16, each with one of four numbers of bits for a byte.
fn plane_bytes(reader: &mut Reader, plane: &mut [u8; 256], count: usize, widths: [u8; 4]) -> Result<(), MeshoptError> {
    let groups = count.div_ceil(16);
    let header = reader.take(groups.div_ceil(4))?;
    for (group, bytes) in plane.chunks_exact_mut(16).take(groups).enumerate() {
        let bits = widths[usize::from(header[group / 4] >> (group % 4 * 2) & 3)];
        match bits {
            0 => bytes.fill(0),
            8 => bytes.copy_from_slice(reader.take(16)?),
            _ => {
                let packed = reader.take(usize::from(bits) * 2)?;
                // The largest number stands for a byte that follows.
                let escape = (1 << bits) - 1;
                for (k, byte) in bytes.iter_mut().enumerate() {
                    let place = k * usize::from(bits);
                    // Single bits are stored from the lowest, others from the highest.
                    let shift = if bits == 1 { place % 8 } else { 8 - usize::from(bits) - place % 8 };
                    let number = packed[place / 8] >> shift & escape;
                    *byte = if number == escape { reader.byte()? } else { number };
                }
            }
        }
    }
    Ok(())
}

/// The last 16 items that were pushed.
struct Fifo<T> {
    items: [T; 16],
    next: usize,
}

impl<T: Copy> Fifo<T> {
    fn push(&mut self, item: T) {
        self.items[self.next % 16] = item;
        self.next = self.next.wrapping_add(1);
    }

    /// The item that was pushed `back` items before the last.
    fn back(&self, back: u8) -> T {
        self.items[self.next.wrapping_sub(1).wrapping_sub(back.into()) % 16]
    }
}

/// Appendix A, mode 1: triangles.
#[expect(clippy::too_many_lines, reason = "the codec of the specification, case by case")]
fn triangles(bytes: &[u8], count: usize, token: &CancelToken) -> Result<Vec<u32>, MeshoptError> {
    let version = match bytes.first() {
        Some(0xe0) => 0,
        Some(0xe1) => 1,
        _ => return Err(UNKNOWN),
    };
    let codes_end = 1 + count / 3;
    let tail = bytes.len().checked_sub(16).filter(|&tail| tail >= codes_end && count.is_multiple_of(3)).ok_or(SHORT)?;
    let (codes, table) = (&bytes[1..codes_end], &bytes[tail..]);
    let mut reader = Reader { rest: &bytes[codes_end..tail] };
    let mut edges = Fifo { items: [[0_u32; 2]; 16], next: 0 };
    let mut vertices = Fifo { items: [0_u32; 16], next: 0 };
    let (mut next, mut last) = (0_u32, 0_u32);
    let fresh = |next: &mut u32| {
        let index = *next;
        *next = next.wrapping_add(1);
        index
    };
    let mut result = Vec::with_capacity(count);
    for (k, &code) in codes.iter().enumerate() {
        token.check_every(HEAVY_STEPS, k)?;
        let triangle = if code < 0xf0 {
            let [a, b] = edges.back(code >> 4);
            let kind = code & 15;
            let (c, is_pushed) = match kind {
                0 => (fresh(&mut next), true),
                13 | 14 if version == 1 => {
                    last = if kind == 13 { last.wrapping_sub(1) } else { last.wrapping_add(1) };
                    (last, true)
                }
                15 => {
                    last = reader.index(last)?;
                    (last, true)
                }
                back => (vertices.back(back), false),
            };
            if is_pushed {
                vertices.push(c);
            }
            [a, b, c]
        } else {
            let extra = if code < 0xfe { table[usize::from(code & 15)] } else { reader.byte()? };
            if code >= 0xfe && extra == 0 {
                next = 0;
            }
            let kinds = [if code == 0xff { 15 } else { 0 }, extra >> 4, extra & 15];
            let mut corners = [0; 3];
            // New vertices are numbered before explicit indices are read; the fifo is that before this triangle.
            for (corner, kind) in corners.iter_mut().zip(kinds) {
                *corner = match kind {
                    0 => fresh(&mut next),
                    15 if code >= 0xfe => 0,
                    back => vertices.back(back - 1),
                };
            }
            for (corner, kind) in corners.iter_mut().zip(kinds) {
                if kind == 15 && code >= 0xfe {
                    last = reader.index(last)?;
                    *corner = last;
                }
            }
            for (&corner, kind) in corners.iter().zip(kinds) {
                if kind == 0 || (kind == 15 && code >= 0xfe) {
                    vertices.push(corner);
                }
            }
            let [a, b, _] = corners;
            edges.push([b, a]);
            corners
        };
        let [a, b, c] = triangle;
        edges.push([c, b]);
        edges.push([a, c]);
        result.extend(triangle);
    }
    Ok(result)
}

/// Appendix A, mode 2: indices of any kind, each as its difference from one of two earlier ones.
fn indices(bytes: &[u8], count: usize, token: &CancelToken) -> Result<Vec<u32>, MeshoptError> {
    if !matches!(bytes.first(), Some(0xd0 | 0xd1)) {
        return Err(UNKNOWN);
    }
    let mut reader = Reader { rest: bytes.get(1..bytes.len().saturating_sub(4)).ok_or(SHORT)? };
    let mut last = [0_u32; 2];
    let mut result = Vec::new();
    for k in 0..count {
        token.check_every(HEAVY_STEPS, k)?;
        let number = reader.varint()?;
        let baseline = &mut last[(number & 1) as usize];
        *baseline = baseline.wrapping_add(unzigzag(number >> 1));
        result.push(*baseline);
    }
    Ok(result)
}

/// The components of an element of four, of one byte or two each.
fn four(element: &[u8]) -> [i32; 4] {
    match element {
        [a, b, c, d] => [a, b, c, d].map(|byte| byte.cast_signed().into()),
        _ => std::array::from_fn(|j| i16::from_le_bytes([element[2 * j], element[2 * j + 1]]).into()),
    }
}

/// Writes the components of an element of four.
fn set_four(element: &mut [u8], numbers: [i32; 4]) {
    let size = element.len() / 4;
    for (part, number) in element.chunks_exact_mut(size).zip(numbers) {
        part.copy_from_slice(&number.to_le_bytes()[..size]);
    }
}

fn round(number: f32) -> i32 {
    number.round_ties_even() as i32
}

/// Appendix B, filter 1: unit vectors on an octahedron.
fn octahedral(element: &mut [u8]) {
    let most = if element.len() == 4 { 127.0 } else { 32_767.0 };
    let [x, y, one, w] = four(element);
    let [mut x, mut y, one] = [x as f32, y as f32, one as f32];
    let z = one - x.abs() - y.abs();
    let fold = z.min(0.0);
    x += if x >= 0.0 { fold } else { -fold };
    y += if y >= 0.0 { fold } else { -fold };
    let scale = most / (x * x + y * y + z * z).sqrt();
    set_four(element, [round(x * scale), round(y * scale), round(z * scale), w]);
}

/// Appendix B, filter 2: unit quaternions without their largest component.
fn quaternion(element: &mut [u8]) {
    let [x, y, z, w] = four(element);
    let scale = std::f32::consts::FRAC_1_SQRT_2 / (w | 3) as f32;
    let [x, y, z] = [x, y, z].map(|number| number as f32 * scale);
    let largest = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
    let mut result = [0; 4];
    for (k, number) in [largest, x, y, z].into_iter().enumerate() {
        result[(w as usize + k) % 4] = round(number * 32_767.0);
    }
    set_four(element, result);
}

/// Appendix B, filter 3: floats with a mantissa of 24 bits and an exponent of 8.
fn exponential(element: &mut [u8]) {
    for part in element.as_chunks_mut().0 {
        let number = i32::from_le_bytes(*part);
        let (mantissa, exponent) = (number << 8 >> 8, number >> 24);
        *part = ((f64::from(mantissa) * f64::from(exponent).exp2()) as f32).to_le_bytes();
    }
}

/// The filter of KHR_meshopt_compression for colours: luminance and two differences, with opacity.
fn color(element: &mut [u8]) {
    let most = if element.len() == 4 { 255 } else { 65_535 };
    let [y, orange, green, alpha] = four(element);
    let (y, alpha) = (y & most, alpha & most);
    // The highest bit of the opacity gives the number of bits.
    let scale = (1_i32 << (32 - alpha.leading_zeros())) - 1;
    let opacity = ((alpha << 1) & scale) | (alpha & 1);
    let factor = most as f32 / scale.max(1) as f32;
    let numbers = [y + orange - green, y + green, y - orange - green, opacity];
    set_four(element, numbers.map(|number| round(number as f32 * factor)));
}
