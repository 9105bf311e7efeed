//! The conditions of a measurement: all that is needed to make a row again, or to know that two rows do not compare.

use std::fmt::Write as _;

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use super::population::Population;
use super::setup::{Contender, Subject, TraceView};
use crate::camera::{Camera, Projection};
use crate::catalog::settings::written;
use crate::provenance::{self, VERSION, commit, date, machine};
use crate::scene::{LoadOptions, to_file};
use crate::text::quote;
use crate::view::Place;
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Preset};
use bvhscope_engine::tree::ContainerKind;

/// Camera, program and machine of a row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Conditions {
    /// The camera, where rays of a view were traced.
    #[serde(flatten)]
    pub view: Option<ViewConditions>,
    /// Instructions of builds and rays.
    pub simd: String,
    /// Version of the program.
    pub version: String,
    /// Commit that the program was built from; absent where the build did not name it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub commit: Option<String>,
    /// Name of the processor, with the number of threads that it runs at once.
    pub machine: String,
    /// Day and minute in UTC.
    pub date: String,
    /// The command that makes the row again, with the same counts.
    pub command_line: String,
}

/// The camera of a row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ViewConditions {
    /// Where it stands, see [`Place`]. Earlier versions did not state it.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub camera: String,
    /// Position of the observer, as in the file.
    pub eye: [f64; 3],
    /// The point at the centre of the picture, as in the file.
    pub target: [f64; 3],
    /// The up direction of the picture.
    pub up: [f32; 3],
    /// Vertical field of view in degrees.
    pub fov: f32,
}

impl Conditions {
    /// The conditions of measuring a tree of `subject` with rays of `view` on `threads` threads.
    pub fn new(subject: &Subject, contender: &Contender, view: &TraceView, threads: usize) -> Self {
        let command_line = command_line(subject, contender, view, threads);
        Self { command_line, ..Self::of_process(Some(ViewConditions::of(view, subject)), view.simd) }
    }

    /// The conditions of a row that the command line of this process makes, with rays of a camera.
    pub fn of_process(view: Option<ViewConditions>, simd: SimdLevel) -> Self {
        Self {
            view,
            simd: simd.name().to_owned(),
            version: VERSION.to_owned(),
            commit: commit().map(str::to_owned),
            machine: machine().to_owned(),
            date: date().to_owned(),
            command_line: provenance::command_line(),
        }
    }
}

impl ViewConditions {
    /// Those of the camera of `view`.
    pub fn of(view: &TraceView, subject: &Subject) -> Self {
        Self::new(view.place, &view.camera, subject.scene.offset)
    }

    /// Those of a camera that stands at `place` in a scene of this offset.
    pub fn new(place: Place, camera: &Camera, offset: DVec3) -> Self {
        let [eye, target] = [camera.eye, camera.target].map(|point| to_file(point, offset).to_array());
        Self { camera: place.to_string(), eye, target, up: camera.up.to_array(), fov: degrees(camera) }
    }
}

/// Rounded, because the conversion between degrees and radians is not exact.
fn degrees(camera: &Camera) -> f32 {
    (camera.fov_y.to_degrees() * 1e3).round() / 1e3
}

/// The `bvhscope bench` command that measures one tree with the same rays; of an opened one, which that cannot build, `bvhscope compare`.
fn command_line(subject: &Subject, contender: &Contender, view: &TraceView, threads: usize) -> String {
    let is_opened = contender.opened().is_some();
    let mut line = format!("bvhscope {} {}", if is_opened { "compare" } else { "bench" }, quote(&subject.model));
    let mut flag = |name: &str, value: Option<&str>| {
        let value = value.map_or_else(String::new, |value| format!(" {}", quote(value)));
        // Writing into a string cannot fail.
        let _ = write!(line, " --{name}{value}");
    };
    if !is_opened {
        tree_flags(contender, &mut flag);
    }
    flag("threads", Some(&threads.to_string()));
    flag("simd", Some(view.simd.name()));
    flag("size", Some(&format!("{}x{}", view.size[0], view.size[1])));
    flag("traversal", Some(view.traversal.name()));
    flag("repeat", Some(&view.repeat.to_string()));
    let name = |population: Population| match &subject.rays {
        Some(file) if population == Population::File => file.path.display().to_string(),
        _ => population.name().to_owned(),
    };
    let rays: Vec<String> = view.populations.iter().map(name).collect();
    if !rays.is_empty() {
        flag("rays", Some(&rays.join(",")));
    }
    if let Some(samples) = view.epo_samples {
        flag("epo-samples", Some(&samples.to_string()));
    }
    let vector = |v: DVec3| format!("{},{},{}", v.x, v.y, v.z);
    let place = |point: Vec3| vector(to_file(point, subject.scene.offset));
    flag("eye", Some(&place(view.camera.eye)));
    flag("target", Some(&place(view.camera.target)));
    flag("up", Some(&vector(to_file(view.camera.up, DVec3::ZERO))));
    flag("fov", Some(&degrees(&view.camera).to_string()));
    if view.camera.projection == Projection::Orthographic {
        flag("orthographic", None);
    }
    if let Some(moment) = subject.scene.moment {
        flag("clip", Some(&moment.clip.to_string()));
        flag("time", Some(&moment.seconds.to_string()));
    }
    let instances = subject.form_of(contender).map_or(subject.load.instances, |form| form.instances());
    for (key, value) in (LoadOptions { instances, ..subject.load.clone() }).written() {
        flag(key, value.as_deref());
    }
    line
}

/// The flags of the tree: its file, its preset where the preset alone makes it, or all its settings.
fn tree_flags(contender: &Contender, flag: &mut dyn FnMut(&str, Option<&str>)) {
    let build = &contender.setup.build;
    let of_preset = |preset: &Preset| {
        let named = BuildSettings::preset(*preset, ContainerKind::Aabb);
        BuildSettings { builder: build.builder, ..named }.for_container(build.tree_container()) == *build
    };
    if let Some(file) = contender.read.as_ref().and_then(|accel| accel.file.as_ref()) {
        flag("tree", Some(&file.path.to_string_lossy()));
        flag("container", Some(build.container.name()));
    } else if build.builder == BuilderKind::None {
        // Measured beside a tree, of which the fewest rows are those of one container.
        flag("no-bvh", None);
        flag("container", Some(build.container.name()));
    } else if let Some(preset) = contender.setup.preset.filter(of_preset) {
        flag("builder", Some(build.builder.name()));
        flag("container", Some(build.tree_container().name()));
        flag("preset", Some(preset.name()));
    } else {
        written(build).for_each(|(row, text)| flag(row.key, Some(&text)));
    }
}
