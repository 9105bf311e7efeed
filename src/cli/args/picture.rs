//! Flags of the camera, and of single nodes.

use clap::Args;
use glam::{DVec3, Vec3};

use crate::cli::named::help;
use crate::cli::values::{self, ViewArg};
use crate::view::NamedView;

/// The end of the help of `--camera`.
const DEFAULT_CAMERA: &str = ", or the number of a camera of the file, from 0 (default: that of a PBRT scene; from inside where the model \
                              encloses its centre; otherwise outside)";

#[derive(Debug, Args)]
#[command(next_help_heading = "Camera")]
pub struct CameraArgs {
    #[arg(long, value_name = "NAME", value_parser = values::view,
          help = help::<NamedView>("A view of the model: ", DEFAULT_CAMERA))]
    pub camera: Option<ViewArg>,
    #[command(flatten)]
    pub parts: CameraParts,
}

/// Cameras of the measuring commands.
#[derive(Debug, Args)]
#[command(next_help_heading = "Camera")]
pub struct CamerasArgs {
    #[arg(long = "camera", value_name = "LIST", value_delimiter = ',', value_parser = values::view,
          help = help::<NamedView>("Views of the model, separated by commas, each with rows of its own: ", DEFAULT_CAMERA))]
    pub cameras: Vec<ViewArg>,
    #[command(flatten)]
    pub parts: CameraParts,
}

/// Parts of a camera in the place of those of its view.
#[derive(Debug, Args)]
#[command(next_help_heading = "Camera")]
pub struct CameraParts {
    /// Position of the observer, in the coordinates of the file
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub eye: Option<DVec3>,
    /// The point at the centre of the picture, in the coordinates of the file
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub target: Option<DVec3>,
    /// The up direction of the picture
    #[arg(long, value_name = "X,Y,Z", value_parser = values::direction, allow_hyphen_values = true)]
    pub up: Option<Vec3>,
    /// Vertical field of view in degrees, 1 to 170 [default: 45]
    #[arg(long, value_name = "DEG", value_parser = values::fov)]
    pub fov: Option<f32>,
    /// Parallel rays instead of perspective
    #[arg(long)]
    pub orthographic: bool,
}

/// Flags for single nodes of the overlay, by the index that the window shows for a selected node.
#[derive(Debug, Args)]
#[command(next_help_heading = "Overlay")]
pub struct NodeArgs {
    /// Draw this node thick, and its children in its tints
    #[arg(long, value_name = "NODE", requires = "overlay", value_parser = values::node)]
    pub select: Option<u32>,
    /// Leave out these nodes, separated by commas, with everything below them and their triangles
    #[arg(long, value_name = "NODE,…", value_delimiter = ',', value_parser = values::node)]
    pub hide: Vec<u32>,
    /// Leave out everything but this node, what is below it and their triangles
    #[arg(long, value_name = "NODE", value_parser = values::node)]
    pub isolate: Option<u32>,
    /// Keep the triangles of left out nodes in the picture
    #[arg(long)]
    pub keep_triangles: bool,
    /// A neutral background in place of the traced picture
    #[arg(long, requires = "overlay")]
    pub no_geometry: bool,
}
