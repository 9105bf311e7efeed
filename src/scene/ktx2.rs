//! Textures in KTX2 files, as `KHR_texture_basisu` names them: ETC1S and UASTC of Basis Universal, and ASTC.

use basisu::{DecodeFlags, SourceFormat, TargetFormat, Transcoder};

use crate::budget::format_bytes;

/// Bytes of a block of the format with the largest blocks.
const BYTES_PER_BLOCK: u64 = 16;

/// Width, height and RGBA texels of the largest picture in the file, its first layer and face, within `limit` bytes.
pub(super) fn decode(bytes: &[u8], max_side: u32, limit: u64) -> Result<(u32, u32, Vec<[u8; 4]>), String> {
    let damaged = |error: basisu::Error| format!("its data are damaged: {error:?}");
    let unknown = || "it is a KTX2 file that is damaged, or neither of Basis Universal nor ASTC".to_owned();
    let file = Transcoder::new(bytes).map_err(|_| unknown())?;
    // The other formats unpack as many bytes as their data say.
    if !matches!(file.source_format(), SourceFormat::Etc1s | SourceFormat::UastcLdr | SourceFormat::AstcLdr(_)) {
        return Err("it is a KTX2 file of another kind than ETC1S, UASTC or ASTC in eight bits".to_owned());
    }
    let (width, height) = file.base_dimensions();
    let texels = u64::from(width).saturating_mul(height.into());
    if width.max(height) > max_side || texels.saturating_mul(4) > limit {
        return Err(format!("it exceeds the limit of {max_side} pixels a side or of memory"));
    }
    let level = file.image_level_info(0).map_err(damaged)?;
    let pictures = u64::from(file.layer_count().max(1)).saturating_mul(file.face_count().max(1).into());
    let blocks = u64::from(level.num_blocks_x).saturating_mul(level.num_blocks_y.into()).saturating_mul(pictures);
    // Of the first entry in the index of levels, which begins at byte 80 (Khronos, KTX File Format Specification 2.0, section 3.9).
    let unpacked = bytes
        .get(96..104)
        .map_or(u64::MAX, |bytes| bytes.iter().rev().fold(0, |sum, &byte| sum << 8 | u64::from(byte)));
    if unpacked > blocks.saturating_mul(BYTES_PER_BLOCK).min(limit) {
        return Err(format!("its largest level says that it unpacks to {}", format_bytes(unpacked)));
    }
    let texels = file.transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE).map_err(damaged)?;
    Ok((width, height, texels.as_chunks().0.to_vec()))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::scene::{LoadOptions, SceneSource, load};
    use bvhscope_engine::cancel::CancelToken;

    /// A file of one level in UASTC whose blocks, row by row, have one colour each.
    fn file([width, height]: [u32; 2], colors: &[[u8; 4]]) -> Vec<u8> {
        let mut bytes = b"\xabKTX 20\xbb\r\n\x1a\n".to_vec();
        let data_at = 80 + 24 + 44;
        let length = (colors.len() as u64).saturating_mul(16);
        // No Vulkan format, bytes, size, no depth, no layers, one face, one level, not packed.
        for word in [0, 1, width, height, 0, 0, 1, 1, 0, 80 + 24, 44, 0, 0] {
            bytes.extend(u32::to_le_bytes(word));
        }
        for long in [0, 0, data_at, length, length] {
            bytes.extend(u64::to_le_bytes(long));
        }
        // A basic descriptor of the colour model UASTC, in sRGB, with blocks of four by four and one sample of 128 bits.
        let descriptor = [44, 0, 0x0028_0002, 0x0002_01a6, 0x0303, 16, 0, 0x037f_0000, 0, 0, u32::MAX];
        for word in descriptor {
            bytes.extend(u32::to_le_bytes(word));
        }
        for &color in colors {
            // Mode 8: one colour after the five bits of the mode.
            bytes.extend(u128::to_le_bytes(u128::from(u32::from_le_bytes(color)) << 5 | 0b1_0111));
        }
        bytes
    }

    #[test]
    fn blocks_become_texels() {
        let colors = [[255, 0, 0, 255], [0, 128, 7, 255], [1, 2, 3, 4], [200, 100, 50, 0]];
        let (width, height, texels) = decode(&file([8, 6], &colors), 64, 1 << 20).unwrap();
        assert_eq!((width, height, texels.len()), (8, 6, 48));
        for (index, texel) in texels.iter().enumerate() {
            let (x, y) = (index % 8, index / 8);
            assert_eq!(*texel, colors[y / 4 * 2 + x / 4], "{x} {y}");
        }
    }

    #[test]
    fn files_beyond_the_limits_are_refused() {
        let whole = file([8, 8], &[[9; 4]; 4]);
        assert!(decode(&whole, 8, 256).is_ok());
        for (max_side, limit) in [(7, 1 << 20), (8, 255)] {
            assert!(decode(&whole, max_side, limit).unwrap_err().contains("limit"));
        }
        // Packed by Zstandard, and said to unpack to a terabyte.
        let mut packed = whole.clone();
        packed[44] = 2;
        packed[96..104].copy_from_slice(&u64::to_le_bytes(1 << 40));
        assert!(decode(&packed, 8, 1 << 20).unwrap_err().contains("unpacks to"));
    }

    #[test]
    fn models_show_the_textures_that_their_extension_names() {
        use base64::prelude::{BASE64_STANDARD, Engine as _};
        let data = |bytes: &[u8]| format!("data:application/octet-stream;base64,{}", BASE64_STANDARD.encode(bytes));
        let numbers = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0];
        let model = serde_json::json!({
            "asset": {"version": "2.0"}, "extensionsRequired": ["KHR_texture_basisu"],
            "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}],
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
                {"bufferView": 0, "byteOffset": 36, "componentType": 5126, "count": 3, "type": "VEC2"},
            ],
            "bufferViews": [{"buffer": 0, "byteLength": 60}],
            "buffers": [{"byteLength": 60, "uri": data(bytemuck::cast_slice(&numbers))}],
            "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
            "textures": [{"extensions": {"KHR_texture_basisu": {"source": 0}}}],
            "images": [{"mimeType": "image/ktx2", "uri": data(&file([4, 4], &[[10, 20, 30, 255]]))}],
        });
        let path = tempfile::Builder::new().suffix(".gltf").tempfile().unwrap().into_temp_path();
        std::fs::write(&path, model.to_string()).unwrap();
        let source = SceneSource::File(path.to_path_buf());
        let scene = load(&source, &LoadOptions::default(), &CancelToken::new()).unwrap();
        assert!(scene.warnings.entries.is_empty(), "{:?}", scene.warnings);
        assert_eq!(scene.textures[0].texels[..], [[10, 20, 30, 255]; 16]);
    }

    #[test]
    fn damaged_files_are_errors() {
        let whole = file([8, 8], &[[9; 4]; 4]);
        for length in 0..whole.len() {
            assert!(decode(&whole[..length], 64, 1 << 20).is_err(), "{length}");
        }
        for byte in 0..whole.len() {
            for value in [0, 1, 0x7f, 0xff] {
                let mut changed = whole.clone();
                changed[byte] = value;
                // Its size is that of its header in any case.
                if let Ok((width, height, texels)) = decode(&changed, 64, 1 << 20) {
                    assert_eq!(texels.len() as u32, width * height, "{byte} {value}");
                }
            }
        }
    }
}
