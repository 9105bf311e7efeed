//! Models packed by gzip: unpacked into memory, within the budget, whatever the format.

use std::borrow::Cow;
use std::io::Read as _;
use std::path::Path;

use flate2::bufread::MultiGzDecoder;

use super::error::LoadError;
use crate::budget::Budget;
use bvhscope_engine::cancel::CancelToken;

/// First bytes of a packed file.
const MAGIC: &[u8] = b"\x1F\x8B\x08";
/// Bytes that are unpacked between two checks of cancellation and of the memory budget.
const CHUNK: u64 = 1 << 22;

/// The bytes of a model; those of a packed one as they were before, without the packed ones. A few kilobytes may become gigabytes:
/// before each growth, which doubles the memory, the budget is asked.
pub(super) fn unpacked<'a>(path: &Path, bytes: Cow<'a, [u8]>, token: &CancelToken) -> Result<Cow<'a, [u8]>, LoadError> {
    if !bytes.starts_with(MAGIC) {
        return Ok(bytes);
    }
    let mut decoder = MultiGzDecoder::new(&bytes[..]);
    let mut all = Vec::new();
    loop {
        token.check()?;
        if (all.capacity().saturating_sub(all.len()) as u64) < CHUNK {
            let more = (all.len() as u64).max(CHUNK);
            let needed = more.saturating_add(all.len() as u64);
            Budget::of_process()
                .check("the unpacked file", needed)
                .map_err(|error| LoadError::over_budget(path, &error))?;
            all.try_reserve_exact(usize::try_from(more).unwrap_or(usize::MAX)).map_err(|_| {
                let problem = format!("needs {needed} bytes of memory unpacked, more than there is");
                LoadError::of_file(path, problem, "close other programs or take a smaller model")
            })?;
        }
        match decoder.by_ref().take(CHUNK).read_to_end(&mut all) {
            Ok(0) => return Ok(Cow::Owned(all)),
            Ok(_) => {}
            Err(error) => {
                let problem = format!("cannot be unpacked beyond byte {}: {error}", all.len());
                let advice = "it may be cut off or damaged: download or pack it again";
                return Err(LoadError::of_file(path, problem, advice));
            }
        }
    }
}
