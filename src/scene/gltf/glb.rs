//! The chunks of a GLB file. Lengths are checked before anything is taken from them.

/// The JSON chunk, the binary chunk, and what else there is.
pub(super) struct Chunks<'a> {
    pub(super) json: &'a [u8],
    pub(super) binary: Option<&'a [u8]>,
    /// Number of further chunks, and the offset of the first.
    pub(super) ignored: (u64, usize),
    /// Number of bytes after the declared end.
    pub(super) trailing: usize,
}

/// A fault in a header: its byte offset, the problem and what to do.
pub(super) type HeaderFault = (usize, String, &'static str);

const JSON: [u8; 4] = *b"JSON";
const BINARY: [u8; 4] = *b"BIN\0";
/// Bytes of the file's header, and of a chunk's.
const HEADER: usize = 12;
const CHUNK_HEADER: usize = 8;

const CUT: &str = "the file is cut off or damaged: copy or download it again";
const EXPORT: &str = "export the model again";

/// Splits a GLB file into its chunks.
pub(super) fn chunks(bytes: &[u8]) -> Result<Chunks<'_>, HeaderFault> {
    let array = |at: usize| {
        let part = bytes.get(at..).and_then(|rest| rest.first_chunk::<4>());
        part.copied().ok_or_else(|| (at, "the file ends too early, in a header".to_owned(), CUT))
    };
    let word = |at: usize| array(at).map(|bytes| u32::from_le_bytes(bytes) as usize);
    match word(4)? {
        2 => {}
        1 => return Err((4, "is GLB version 1, only version 2 is read".to_owned(), super::announced::UPGRADE)),
        version => return Err((4, format!("is GLB version {version}, only version 2 is read"), EXPORT)),
    }
    let length = word(8)?;
    let minimum = HEADER.saturating_add(CHUNK_HEADER);
    if length > bytes.len() || length < minimum {
        return Err((8, format!("the header declares {length} bytes, the file has {}", bytes.len()), CUT));
    }
    let mut chunks = Chunks { json: &[], binary: None, ignored: (0, 0), trailing: bytes.len().saturating_sub(length) };
    let mut at = HEADER;
    // Fewer bytes than a header at the end are padding.
    while at.saturating_add(CHUNK_HEADER) <= length {
        let (size, kind, start) = (word(at)?, array(at.saturating_add(4))?, at.saturating_add(CHUNK_HEADER));
        let data = start.checked_add(size).filter(|&end| end <= length).and_then(|end| bytes.get(start..end));
        let Some(data) = data else {
            let name = match kind {
                JSON => "JSON",
                BINARY => "binary",
                _ => "last",
            };
            let left = length.saturating_sub(start);
            return Err((at, format!("the {name} chunk declares {size} bytes, {left} follow"), CUT));
        };
        match kind {
            JSON if at == HEADER => chunks.json = data,
            JSON => return Err((at, "there is a second JSON chunk".to_owned(), EXPORT)),
            BINARY if at == HEADER => return Err((at, "the first chunk is not JSON".to_owned(), EXPORT)),
            BINARY if chunks.binary.is_none() => chunks.binary = Some(data),
            _ if at == HEADER => {
                let name = crate::text::quoted(kind);
                return Err((at, format!("the first chunk is {name} instead of JSON"), EXPORT));
            }
            _ => {
                let (count, first) = chunks.ignored;
                chunks.ignored = (count.saturating_add(1), if count == 0 { at } else { first });
            }
        }
        at = start.saturating_add(size);
    }
    Ok(chunks)
}
