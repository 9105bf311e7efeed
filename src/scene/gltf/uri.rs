//! The bytes that a URI names: those in a `data:` URI, or those of a file beside the model.

use base64::Engine as _;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

use crate::budget::Budget;
use crate::scene::images::Images;
use bvhscope_engine::cancel::CancelToken;

/// Bytes between two cancellation checks.
pub(super) const POLL_INTERVAL_BYTES: usize = 1 << 18;

/// Whether a URI holds the data itself.
pub(super) fn is_data(uri: &str) -> bool {
    uri.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:"))
}

/// The bytes of a `data:` URI, or of a file relative to the model.
pub(super) fn read_uri(uri: &str, images: &Images) -> Result<Vec<u8>, String> {
    let Some(data) = uri.get(5..).filter(|_| is_data(uri)) else {
        return images.read_relative(&file_name(uri, images)?);
    };
    let (kind, text) = data.split_once(',').ok_or("the data URI has no comma")?;
    match kind.rsplit_once(';') {
        Some((_, encoding)) if encoding.trim().eq_ignore_ascii_case("base64") => base64(text, images.token),
        _ => percent_decoded(text, images.token),
    }
}

/// The file name in a URI: the decoded one, or where that is no file the name as it stands, since exporters forget to encode it.
pub(super) fn file_name(uri: &str, images: &Images) -> Result<String, String> {
    let decoded = percent_decoded(uri, images.token)
        .and_then(|bytes| String::from_utf8(bytes).map_err(|_| "the URI is not UTF-8".to_owned()));
    let is_file = |name: &str| images.resolve(name).is_ok();
    if uri.contains('%') && !decoded.as_ref().is_ok_and(|name| is_file(name)) && is_file(uri) {
        return Ok(uri.to_owned());
    }
    decoded
}

fn percent_decoded(text: &str, token: &CancelToken) -> Result<Vec<u8>, String> {
    let wrong = || "the URI has a wrong % sequence".to_owned();
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        rest = after;
        token.check_every(POLL_INTERVAL_BYTES, bytes.len()).map_err(|cancelled| cancelled.to_string())?;
        if byte == b'%' {
            let digits = rest.get(..2).and_then(|digits| std::str::from_utf8(digits).ok()).ok_or_else(wrong)?;
            bytes.push(u8::from_str_radix(digits, 16).map_err(|_| wrong())?);
            rest = &rest[2..];
        } else {
            bytes.push(byte);
        }
    }
    Ok(bytes)
}

/// Decodes base64 with or without padding and line breaks, in the standard and the URL alphabet, since exporters differ.
fn base64(text: &str, token: &CancelToken) -> Result<Vec<u8>, String> {
    const ANY: GeneralPurpose = GeneralPurpose::new(
        &base64::alphabet::STANDARD,
        GeneralPurposeConfig::new()
            .with_decode_padding_mode(DecodePaddingMode::Indifferent)
            .with_decode_allow_trailing_bits(true),
    );
    // The text without line breaks and the decoded bytes exist at the same time.
    let size = (text.len() as u64 / 4).saturating_mul(7);
    Budget::of_process().check("the bytes of a data URI", size).map_err(|error| error.to_string())?;
    let standard = |byte| match byte {
        b'-' => b'+',
        b'_' => b'/',
        byte => byte,
    };
    let mut digits = Vec::with_capacity(text.len());
    for part in text.as_bytes().chunks(POLL_INTERVAL_BYTES) {
        token.check().map_err(|cancelled| cancelled.to_string())?;
        digits.extend(part.iter().filter(|byte| !byte.is_ascii_whitespace()).map(|&byte| standard(byte)));
    }
    // Four digits are three bytes, so chunks of a multiple of four digits decode independently.
    let mut bytes = Vec::with_capacity(digits.len().div_ceil(4).saturating_mul(3));
    for part in digits.chunks(POLL_INTERVAL_BYTES) {
        token.check().map_err(|cancelled| cancelled.to_string())?;
        ANY.decode_vec(part, &mut bytes).map_err(|error| format!("the base64 data is damaged: {error}"))?;
    }
    Ok(bytes)
}
