//! `ray`: every step of one ray through the tree, as a table or as JSON.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use serde::Serialize;

use super::context::{Context, Failure, Finished, camera_of, ignore_missing_reader, in_pool};
use super::moments::{MomentChoice, ShownMoment, check_follow};
use super::output::json_line;
use super::progress::Progress;
use super::ray_input::nth_ray;
use super::tree_numbers::TreeNumbers;
use super::tree_origin::{TreeOrigin, note_faults};
use crate::accel::followed::FollowSession;
use crate::accel::{Accel, Follow};
use crate::camera::Camera;
use crate::console::printable_lines;
use crate::lab::ray::{RayMethod, RayRecord, RayRequest, RayStep, Span, ray_table, record};
use crate::lab::{Conditions, ViewConditions};
use crate::render::{Crossing, RayKind, RayStart, RenderSettings};
use crate::scene::{SceneSource, from_file, to_file};
use crate::section::SectionChoice;
use crate::text::shown_path;
use crate::view::CameraChoice;
use bvhscope_engine::geometry::Ray;
use bvhscope_engine::settings::BuildSettings;

/// Where a ray comes from, before the model is loaded.
#[derive(Debug, Clone, PartialEq)]
pub enum ChosenStart {
    /// A pixel of the picture.
    Pixel([u32; 2]),
    /// A point in the coordinates of the file, and a direction of length 1.
    Given(DVec3, Vec3),
    /// The ray of a file with this number.
    OfFile(PathBuf, u64),
}

/// Settings of `ray`.
#[derive(Debug, Clone)]
pub struct RayCommand {
    /// The model.
    pub source: SceneSource,
    /// Build settings of the tree, where it is built.
    pub build: BuildSettings,
    /// Where the tree comes from.
    pub tree: TreeOrigin,
    /// The camera of the picture that the ray is of.
    pub camera: CameraChoice,
    /// Width and height of that picture in pixels.
    pub size: [u32; 2],
    /// Light and SIMD level; the others do not matter.
    pub settings: RenderSettings,
    /// The section plane; `None` for the whole model.
    pub section: Option<SectionChoice>,
    /// Where the ray comes from.
    pub start: ChosenStart,
    /// Its purpose.
    pub kind: RayKind,
    /// The traversal.
    pub method: RayMethod,
    /// The moment of a model that moves.
    pub moments: MomentChoice,
    /// How the tree of the moment is made.
    pub follow: Follow,
    /// Print one JSON object instead of the table.
    pub json: bool,
}

/// Loads the model, builds its tree, records the ray and prints it.
pub fn run(command: &RayCommand, context: &mut Context<'_>) -> Result<Finished, Failure> {
    if let Some(text) = command.build.refusal(0) {
        return Err(Failure::Usage(text));
    }
    check_follow(command.follow, &command.build, &command.moments)?;
    let scene = command.moments.first(context.load(&command.source)?, &context.token)?;
    let request = RayRequest {
        start: match &command.start {
            ChosenStart::Pixel(pixel) => RayStart::Pixel(*pixel),
            ChosenStart::Given(origin, direction) => {
                RayStart::Given(Ray::new(from_file(*origin, scene.offset), *direction))
            }
            ChosenStart::OfFile(path, number) => RayStart::Given(nth_ray(path, *number, &scene, &context.token)?),
        },
        kind: command.kind,
        method: command.method,
        camera: camera_of(&command.camera, &scene)?,
        size_px: command.size,
        settings: RenderSettings {
            section: command.section.map(|choice| choice.plane(&scene.bounds, scene.offset)),
            ..command.settings
        },
        hidden: None,
    };
    let progress = Progress::new("Building", &context.token);
    let token = &context.token;
    let (accel, record) = in_pool(|| {
        let follow = (command.follow, &mut FollowSession::default());
        let accel = Arc::new(command.tree.accel(&scene, &command.source, &command.build, follow, token)?);
        let record = record(&accel, &request, token)?;
        Ok::<_, Failure>((accel, record))
    })?;
    drop(progress);
    let has_faults = note_faults(&accel);
    let record = record.map_err(|reason| Failure::Failed(format!("{}: {reason}", ray_name(command))))?;
    if command.json {
        let summary = RaySummary::new(command, &accel, &request.camera, &record);
        ignore_missing_reader(context.out.write_all(json_line(&summary)?.as_bytes()))?;
    } else {
        let text = ray_table(title(command, &accel, &record), &record).to_string();
        ignore_missing_reader(context.out.write_all(printable_lines(&text).as_bytes()))?;
    }
    Ok(Finished { warned: has_faults || !scene.warnings.is_empty() })
}

/// "shadow ray of pixel 3,4".
fn ray_name(command: &RayCommand) -> String {
    let kind = command.kind.name();
    match &command.start {
        ChosenStart::Pixel([x, y]) => format!("{kind} ray of pixel {x},{y}"),
        ChosenStart::Given(..) => format!("{kind} ray"),
        ChosenStart::OfFile(path, number) => format!("ray {number} of {}", shown_path(path)),
    }
}

/// The model, the ray and how it is traced, in two lines.
fn title(command: &RayCommand, accel: &Accel, record: &RayRecord) -> String {
    let containers = accel.tree.container_kind().plural();
    let tree = match command.method {
        RayMethod::Binary(traversal) => {
            format!("{} traversal of the binary tree of {containers}", traversal.name())
        }
        RayMethod::Wide => {
            format!("the wide tree of {containers}, each node named by that of the binary tree that it replaces")
        }
    };
    let origin = accel.scene.in_file(record.ray.origin);
    let [origin, direction] = [origin, to_file(record.ray.direction, DVec3::ZERO)]
        .map(|vector| format!("{},{},{}", vector.x, vector.y, vector.z));
    let ray = ray_name(command);
    format!("{}: {ray}, {tree}\nfrom {origin} towards {direction}", command.source)
}

/// The JSON object that `--json` prints.
#[derive(Debug, Serialize)]
struct RaySummary {
    command: &'static str,
    model: String,
    triangles: usize,
    #[serde(flatten)]
    moment: Option<ShownMoment>,
    #[serde(flatten)]
    tree: TreeNumbers,
    kind: &'static str,
    traversal: &'static str,
    pixel: Option<[u32; 2]>,
    /// Size of the picture that the pixel is of.
    #[serde(skip_serializing_if = "Option::is_none")]
    width_px: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    height_px: Option<u32>,
    #[serde(flatten)]
    conditions: Conditions,
    /// In the coordinates of the file.
    origin: [f64; 3],
    direction: [f32; 3],
    /// Infinite distances are null.
    t_min: f32,
    t_max: f32,
    hit: Option<HitLine>,
    /// All hits, as if none ended the ray, the nearest first.
    all_hits: Vec<CrossingLine>,
    /// There are more than these.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    has_more_hits: bool,
    container_tests: u64,
    primitive_tests: u64,
    /// Cache lines of the wide tree.
    #[serde(skip_serializing_if = "Option::is_none")]
    node_lines: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    triangle_lines: Option<u64>,
    visited: usize,
    wasted: usize,
    skipped: usize,
    omitted_events: u64,
    events: Vec<EventLine>,
    containers: Vec<SpanLine>,
}

#[derive(Debug, Serialize)]
struct HitLine {
    t: f32,
    triangle: u32,
}

/// One of all hits.
#[derive(Debug, Serialize)]
struct CrossingLine {
    t: f32,
    triangle: u32,
    is_front: bool,
    /// Number of surfaces that the ray has passed through after it; both triangles of an edge are one.
    surfaces: u32,
    /// Of every second surface the distance from the one before.
    #[serde(skip_serializing_if = "Option::is_none")]
    thickness: Option<f32>,
}

impl CrossingLine {
    const fn new(&Crossing { t, triangle, is_front, surfaces, thickness }: &Crossing) -> Self {
        Self { t, triangle, is_front, surfaces, thickness }
    }
}

/// A step. Numbers of tests and of nodes on the stack are those after it.
#[derive(Debug, Serialize)]
struct EventLine {
    event: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    node: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    depth: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    triangle: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    t: Option<f32>,
    container_tests: u64,
    primitive_tests: u64,
    stack: u32,
}

/// A container that the ray enters.
#[derive(Debug, Serialize)]
struct SpanLine {
    node: u32,
    depth: u32,
    leaf: bool,
    enter: f32,
    exit: f32,
    visit: &'static str,
}

impl RaySummary {
    fn new(command: &RayCommand, accel: &Accel, camera: &Camera, record: &RayRecord) -> Self {
        let pixel = if let ChosenStart::Pixel(pixel) = command.start { Some(pixel) } else { None };
        let [visited, wasted, skipped] = record.visits();
        Self {
            command: "ray",
            model: command.source.to_string(),
            triangles: accel.scene.triangle_count() as usize,
            moment: ShownMoment::of(accel),
            tree: TreeNumbers::new(accel, &accel.reading()),
            kind: command.kind.name(),
            traversal: command.method.name(),
            pixel,
            width_px: pixel.map(|_| command.size[0]),
            height_px: pixel.map(|_| command.size[1]),
            conditions: Conditions::of_process(
                pixel.map(|_| ViewConditions::new(command.camera.place(&accel.scene), camera, accel.scene.offset)),
                command.settings.simd,
            ),
            origin: accel.scene.in_file(record.ray.origin).to_array(),
            direction: record.ray.direction.to_array(),
            t_min: record.ray.t_min,
            t_max: record.ray.t_max,
            hit: record.hit.map(|(t, triangle)| HitLine { t, triangle }),
            all_hits: record.crossings.hits.iter().map(CrossingLine::new).collect(),
            has_more_hits: record.crossings.has_more,
            container_tests: record.counts.containers,
            primitive_tests: record.counts.primitives,
            node_lines: record.lines.map(|lines| lines.nodes),
            triangle_lines: record.lines.map(|lines| lines.triangles),
            visited,
            wasted,
            skipped,
            omitted_events: record.omitted,
            events: record.steps.iter().map(EventLine::new).collect(),
            containers: record.spans.iter().map(SpanLine::new).collect(),
        }
    }
}

impl EventLine {
    fn new(step: &RayStep) -> Self {
        let of_node = step.what.is_about_node();
        Self {
            event: step.what.name(),
            node: of_node.then_some(step.tree_node),
            depth: of_node.then_some(step.depth),
            triangle: step.what.triangle(),
            t: step.what.t(),
            container_tests: step.counts.containers,
            primitive_tests: step.counts.primitives,
            stack: step.waiting,
        }
    }
}

impl SpanLine {
    fn new(span: &Span) -> Self {
        let [enter, exit] = span.t;
        Self { node: span.tree_node, depth: span.depth, leaf: span.is_leaf, enter, exit, visit: span.visit.name() }
    }
}
