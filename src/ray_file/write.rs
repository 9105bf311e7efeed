//! Writing ray files.

use std::io::{Result, Write};

use bvhscope_engine::cancel::CancelToken;
use serde_json::{Map, Value};

use super::layout::{ARRAYS, MAGIC, MISS, RayHeader, VERSION};
use super::ray::{CHUNK_RAYS, FileRay};

/// Writes `rays`, in the coordinates of the scene, whose offset belongs in the header. Arrays that would say nothing are left out. Ends
/// early where `token` is cancelled.
pub fn write_rays(header: &RayHeader, rays: &[FileRay], writer: &mut dyn Write, token: &CancelToken) -> Result<()> {
    let is_written = [
        true,
        rays.iter().any(|ray| ray.any),
        rays.iter().any(|ray| ray.expected_triangle.is_some()),
        rays.iter().any(|ray| ray.expected_t.is_some()),
        rays.iter().any(|ray| ray.weight != 1.0),
        rays.iter().any(|ray| ray.pixel.is_some()),
    ];
    let mut arrays = Map::new();
    let mut begin = 0_u64;
    for ((name, row), _) in ARRAYS.iter().zip(is_written).filter(|(_, is_written)| *is_written) {
        arrays.insert((*name).to_owned(), begin.into());
        begin = begin.saturating_add(row.saturating_mul(rays.len() as u64));
    }
    let header = RayHeader { rays: Some(rays.len() as u64), ..header.clone() };
    let mut fields = serde_json::to_value(&header)?;
    fields["arrays"] = Value::Object(arrays);
    writer.write_all(MAGIC)?;
    writeln!(writer, "{VERSION}\n{fields}")?;
    for (array, _) in is_written.into_iter().enumerate().filter(|(_, is_written)| *is_written) {
        for chunk in rays.chunks(CHUNK_RAYS) {
            token.check().map_err(std::io::Error::other)?;
            chunk.iter().try_for_each(|ray| write_row(ray, array, writer))?;
        }
    }
    Ok(())
}

/// The row of `ray` in an array of [`ARRAYS`].
fn write_row(
    FileRay { ray, any, weight, expected_triangle, expected_t, pixel, .. }: &FileRay,
    array: usize,
    writer: &mut dyn Write,
) -> Result<()> {
    let mut put = |words: &[u32]| words.iter().try_for_each(|word| writer.write_all(&word.to_le_bytes()));
    match array {
        0 => {
            let ([x, y, z], [dx, dy, dz]) = (ray.origin.to_array(), ray.direction.to_array());
            put(&[x, y, z, ray.t_min, dx, dy, dz, ray.t_max].map(f32::to_bits))
        }
        1 => writer.write_all(&[u8::from(*any)]),
        2 => put(&[expected_triangle.unwrap_or(MISS)]),
        3 => put(&[expected_t.unwrap_or(f32::INFINITY).to_bits()]),
        4 => put(&[weight.to_bits()]),
        _ => put(&pixel.unwrap_or_default()),
    }
}
