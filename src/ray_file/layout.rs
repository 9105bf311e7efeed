//! The parts of the format of ray files.

use serde::{Deserialize, Serialize};

/// The first line without its version.
pub(super) const MAGIC: &[u8] = b"bvhscope rays ";

/// The version that is written.
pub(super) const VERSION: u32 = 1;

/// Maximum length of the header in bytes.
pub(super) const MAX_HEADER: u64 = 1 << 20;

/// The index that stands for no triangle.
pub const MISS: u32 = u32::MAX;

/// The arrays: name, and bytes a ray.
pub(super) const ARRAYS: [(&str, u64); 6] =
    [("rays", 32), ("any", 1), ("expected_triangle", 4), ("expected_t", 4), ("weight", 4), ("pixel", 8)];

/// Everything in the header but the arrays. Field names are the JSON names.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct RayHeader {
    /// Number of rays; `None` where only the end of the file tells it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rays: Option<u64>,
    /// Name of the set, for titles.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The model that the rays belong to.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<String>,
    /// Their kind.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<String>,
    /// The program that wrote them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// Added to all origins, for models so far from 0 that single precision would round them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub offset: Option<[f64; 3]>,
}
