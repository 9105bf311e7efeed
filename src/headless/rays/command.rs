//! Settings of `rays`.

use std::path::PathBuf;

use crate::headless::tree_origin::TreeOrigin;
use crate::lab::population::Population;
use crate::render::RenderSettings;
use crate::scene::SceneSource;
use crate::view::CameraChoice;
use bvhscope_engine::settings::BuildSettings;

/// Tests of triangles by default: seconds on a few cores.
const TESTS: usize = 1 << 30;
/// Fewest and most rays by default.
const RAYS: [usize; 2] = [100, 10_000];

/// How many rays of a file are checked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sample {
    /// As many as take some seconds.
    Default,
    /// So many, at equal distances.
    Rays(usize),
    /// All.
    All,
}

impl Sample {
    /// Number of rays at most, in a model of so many triangles.
    pub(super) fn rays(self, triangles: usize) -> usize {
        match self {
            Self::Default => (TESTS / triangles.max(1)).clamp(RAYS[0], RAYS[1]),
            Self::Rays(rays) => rays,
            Self::All => usize::MAX,
        }
    }
}

/// Which rays `rays` is about.
#[derive(Debug, Clone, PartialEq)]
pub enum ChosenRays {
    /// Those of a population, about so many.
    Population(Population, Option<u32>),
    /// Those of a file; `-` is standard input.
    File(PathBuf),
    /// Those of a file, of which so many are checked.
    Checked(PathBuf, Sample),
}

/// Settings of `rays`.
#[derive(Debug, Clone)]
pub struct RaysCommand {
    /// The model.
    pub source: SceneSource,
    /// Build settings of the tree, where it is built.
    pub build: BuildSettings,
    /// Where the tree comes from.
    pub tree: TreeOrigin,
    /// The rays.
    pub rays: ChosenRays,
    /// The camera of the picture whose rays are written.
    pub camera: CameraChoice,
    /// Width and height of that picture in pixels.
    pub size: [u32; 2],
    /// Light and SIMD level; the others do not matter.
    pub settings: RenderSettings,
    /// The ray file to write.
    pub output: Option<PathBuf>,
    /// Print one JSON object instead of text.
    pub json: bool,
}
