//! Rays and trees that are compared, and the results.

use serde::Serialize;

use super::exact::{ExactHit, Reference};
use super::judge::Agreement;
use crate::ray_file::FileRay;

/// A ray with what is known of it.
pub(super) struct CheckedRay {
    pub(super) ray: FileRay,
    pub(super) reference: Reference,
}

/// Results of one tree, or of the program that wrote the file, by their agreement in the order of [`Agreement::ALL`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Compared {
    /// Name of the tree.
    pub name: String,
    /// Number of rays of each agreement; of several ways to trace a tree the worst counts.
    pub rays: [u64; Agreement::ALL.len()],
    /// Rays along which the tree finds something else than the engine's own test of every triangle: none in a sound tree.
    pub unlike_scan: u64,
}

impl Compared {
    pub(super) fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), rays: [0; Agreement::ALL.len()], unlike_scan: 0 }
    }

    /// Number of rays whose result rounding does not explain.
    pub fn faults(&self) -> u64 {
        Agreement::ALL.iter().zip(self.rays).filter(|(kind, _)| kind.is_fault()).map(|(_, rays)| rays).sum()
    }
}

/// A node whose container is not entered by a ray that hits a triangle below it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Blamed {
    /// The node.
    pub node: u32,
    /// Its depth.
    pub depth: u32,
}

/// A result that is not that of the scan.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// The ray.
    pub ray: FileRay,
    /// The tree, or the file.
    pub name: String,
    /// How it was traced.
    pub method: String,
    /// The fault.
    pub agreement: Agreement,
    /// The nearest hit in double precision.
    pub exact: Option<ExactHit>,
    /// Triangle and distance that were found, as far as they are known; `None` for a miss.
    pub found: Option<(Option<u32>, Option<f32>)>,
    /// The node that loses the hit.
    pub blamed: Option<Blamed>,
}

impl Finding {
    /// Difference of the distances, relative to the greater one: 1 where one is a miss.
    pub(super) fn difference(&self) -> f64 {
        let found = self.found.and_then(|(_, t)| t).map(f64::from);
        let Some((found, exact)) = found.zip(self.exact) else { return 1.0 };
        (found - exact.t).abs() / found.abs().max(exact.t.abs()).max(f64::MIN_POSITIVE)
    }
}

/// Rays that were checked.
#[derive(Debug, Clone, PartialEq)]
pub struct RayCheck {
    /// Number of rays.
    pub rays: usize,
    /// Those along which there is a hit.
    pub hits: usize,
    /// The hits that the file expects, where it does, and those of each tree.
    pub compared: Vec<Compared>,
    /// The worst rays, at most [`WORST`](super::WORST), each once.
    pub worst: Vec<Finding>,
}
