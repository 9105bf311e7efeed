//! Flags of `ray`.

use std::path::PathBuf;

use clap::{ArgGroup, Args};
use glam::{DVec3, Vec3};

use super::picture::CameraArgs;
use super::shared::{BuildArgs, FollowedMomentArgs, StrictLoadArgs, TreeFileArgs};
use crate::cli::named::{help, named, simd};
use crate::cli::values::{self, ModelParser};
use crate::render::{Light, RayKind};
use crate::scene::SceneSource;
use crate::section::SectionChoice;
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::tree::traverse::Traversal;

#[derive(Debug, Args)]
#[command(group = ArgGroup::new("which").required(true).args(["pixel", "origin", "rays"]), after_help = "Examples:
  bvhscope ray bunny.obj --pixel 640,360
  bvhscope ray bunny.obj --pixel 640,360 --kind shadow --container sphere
  bvhscope ray bunny.obj --pixel 640,360 --wide --json
  bvhscope ray bunny.obj --rays worst.rays --number 3 --tree mine.bvh
  bvhscope ray bunny.obj --origin 0,0.1,1 --direction 0,0,-1 --traversal paper

Events: enter and miss are the tests of a container; cull skips one that begins behind the nearest hit; push and pop put a node on
the stack and take it back; visit goes into a node; test is that of a triangle; nearer, a hit that becomes the nearest.")]
pub struct RayArgs {
    /// The model: a file, or builtin:NAME[:SIZE] [default: builtin:teapot]
    #[arg(value_name = "MODEL", value_parser = ModelParser)]
    pub model: Option<SceneSource>,
    /// The ray through this pixel of the picture, 0,0 at its upper left
    #[arg(long, value_name = "X,Y", value_parser = values::pixel, conflicts_with_all = ["origin", "direction"])]
    pub pixel: Option<[u32; 2]>,
    /// Size of the picture in pixels
    #[arg(long, value_name = "WxH", value_parser = values::size, allow_hyphen_values = true, default_value = "1280x720")]
    pub size: [u32; 2],
    /// The ray from this point, in the coordinates of the file
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true, requires = "direction")]
    pub origin: Option<DVec3>,
    /// Where the ray from --origin goes; scaled to length 1, so that distances are in the model's unit
    #[arg(long, value_name = "X,Y,Z", value_parser = values::direction, allow_hyphen_values = true, requires = "origin")]
    pub direction: Option<Vec3>,
    /// A ray of this file, looking for the nearest hit; docs/ray-file.md describes the format
    #[arg(long, value_name = "FILE", conflicts_with_all = ["kind", "size"])]
    pub rays: Option<PathBuf>,
    /// Its number, from 0
    #[arg(long, value_name = "N", value_parser = |text: &str| values::whole::<u64>(text, 0, u64::MAX), requires = "rays", default_value = "0")]
    pub number: u64,
    #[arg(long, value_name = "NAME", value_parser = named::<RayKind>, default_value = "primary",
          help = help::<RayKind>("That ray, or one that leaves the surface it hits, as pictures trace them: ", ""))]
    pub kind: RayKind,
    /// Light of shadow rays: sun, file (its own lights), or headlight, which has none [default: sun]
    #[arg(long, value_name = "NAME", value_parser = named::<Light>)]
    pub light: Option<Light>,
    /// How it visits the nodes of the binary tree: ordered (near child first, culled by distance), or paper (neither)
    #[arg(long, value_name = "NAME", value_parser = named::<Traversal>, default_value = "ordered")]
    pub traversal: Traversal,
    /// Vector instructions of the build: sse2, avx2, avx512 or neon, where this machine has them [default: the best]
    #[arg(long, value_name = "LEVEL", value_parser = simd)]
    pub simd: Option<SimdLevel>,
    /// The wide tree instead, which pictures are traced through; its nodes have up to eight children
    #[arg(long, conflicts_with = "traversal")]
    pub wide: bool,
    /// Cut the model open as render does
    #[arg(long, value_name = "AXIS=POSITION", value_parser = SectionChoice::parse, allow_hyphen_values = true)]
    pub section: Option<SectionChoice>,
    /// Print one JSON object instead of the table
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub build: BuildArgs,
    #[command(flatten)]
    pub tree: TreeFileArgs,
    #[command(flatten)]
    pub load: StrictLoadArgs,
    #[command(flatten)]
    pub camera: CameraArgs,
    #[command(flatten)]
    pub motion: FollowedMomentArgs,
}
