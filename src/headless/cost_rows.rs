//! Rows of `layouts` and `copies`, made of what their measurements hand over.

use crate::accel::Accel;
use crate::camera::Camera;
use crate::catalog::settings::Stated;
use crate::lab::cost_row::{CostRow, OwnFields};
use crate::lab::{Conditions, ViewConditions};
use crate::scene::SceneSource;
use crate::view::CameraChoice;
use bvhscope_engine::kernel::SimdLevel;

/// The fields that all rows of one command on one model share.
pub(super) struct RowsOf<'a> {
    /// The command.
    pub(super) command: &'static str,
    /// The model.
    pub(super) source: &'a SceneSource,
    /// Its trees.
    pub(super) accel: &'a Accel,
    /// The camera as it was asked for, and as it is.
    pub(super) camera: (&'a CameraChoice, &'a Camera),
    /// Width and height of the view in pixels.
    pub(super) size: [u32; 2],
    /// Vector instructions.
    pub(super) simd: SimdLevel,
}

impl RowsOf<'_> {
    /// The row with `own` fields.
    pub(super) fn row<T: OwnFields>(&self, own: T) -> CostRow<T> {
        let Self { command, source, accel, camera: (choice, camera), size: [width_px, height_px], simd } = *self;
        let scene = &accel.scene;
        let has_camera = own.population().kind().is_some();
        let view = has_camera.then(|| ViewConditions::new(choice.place(scene), camera, scene.offset));
        CostRow {
            command,
            model: source.to_string(),
            triangles: scene.triangle_count() as usize,
            builder: accel.builder_name().into_owned(),
            tree: accel.file.as_ref().map(|file| file.path.display().to_string()),
            settings: if accel.file.is_some() { Stated::default() } else { Stated::of(&accel.settings) },
            threads: rayon::current_num_threads(),
            own,
            width_px,
            height_px,
            conditions: Conditions::of_process(view, simd),
            warnings: scene.warnings.entries.iter().map(ToString::to_string).collect(),
        }
    }
}
