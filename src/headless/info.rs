//! `info`: contents and warnings of a file, statistics of its tree, and findings of the diagnosis.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Serialize;

use super::context::{Context, Failure, Finished, camera_of, ignore_missing_reader, in_pool, needs_triangles};
use super::moments::{MomentChoice, ShownMoment, check_follow};
use super::output::json_line;
use super::picture::{check_written, note_written};
use super::progress::Progress;
use super::ray_input::MeasuringRays;
use super::tree_numbers::TreeNumbers;
use super::tree_origin::{TreeOrigin, note_faults};
use crate::accel::followed::FollowSession;
use crate::accel::{Accel, Follow};
use crate::camera::Camera;
use crate::catalog::numbers::NUMBERS;
use crate::catalog::reading::TreeReading;
use crate::catalog::settings::{OPTIMIZE, Setting, Value};
use crate::console::{note, printable_lines};
use crate::export::{Protected, cannot_be_written, check_target, write_file};
use crate::lab::by_depth::{Depth, by_depth};
use crate::lab::diagnose::{Finding, diagnose_scene, diagnose_tree};
use crate::lab::population::{MeasuredRays, MeasuredVisits, Population, ViewRays, few_entering};
use crate::lab::report_table::{depth_table, number};
use crate::lab::{Conditions, ViewConditions};
use crate::render::RenderSettings;
use crate::scene::{Clip, Scene, SceneSource};
use crate::text::{count, counted, quoted};
use crate::view::CameraChoice;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::query::closed::Edges;
use bvhscope_engine::settings::{BuildSettings, BuilderKind};
use bvhscope_engine::tree_file::write_corners;

/// Settings of `info`.
#[derive(Debug, Clone)]
pub struct InfoCommand {
    /// The model.
    pub source: SceneSource,
    /// Build settings of the tree, where it is built.
    pub build: BuildSettings,
    /// Where the tree comes from.
    pub tree: TreeOrigin,
    /// File to write the triangles into: rows of nine f32, little-endian, in the order in which trees count them.
    pub triangles: Option<PathBuf>,
    /// Rays by which the visits of the nodes are counted.
    pub rays: MeasuringRays,
    /// Number of samples of which the end-point overlap is estimated; exact without.
    pub epo_samples: Option<usize>,
    /// The view that the rays belong to.
    pub camera: CameraChoice,
    /// The moment of a model that moves.
    pub moments: MomentChoice,
    /// How the tree of the moment is made.
    pub follow: Follow,
    /// Print one JSON object instead of the text.
    pub json: bool,
}

/// Width and height in pixels of the view whose rays count visits: a ray for each.
const VIEW_PX: [u32; 2] = [256; 2];

/// Clips that are listed in the text.
const MAX_CLIPS: usize = 20;

/// How the triangles meet in their edges.
#[derive(Debug, Serialize)]
struct EdgeNumbers {
    edges: usize,
    open_edges: usize,
    shared_edges: usize,
    turned_edges: usize,
}

/// Visits by rays of one population.
#[derive(Debug, Serialize)]
struct VisitNumbers {
    #[serde(flatten)]
    sums: MeasuredRays,
    /// Visits of each node, in the order of the tree.
    node_visits: Vec<u32>,
}

impl EdgeNumbers {
    /// All edges, and whether the model is closed, manifold and consistently oriented: "6, not closed (3 open), manifold, consistently oriented".
    fn in_words(&self) -> String {
        let property = |number: usize, what: &str, property: &str| match number {
            0 => property.to_owned(),
            _ => format!("not {property} ({} {what})", count(number as u64)),
        };
        [
            count(self.edges as u64),
            property(self.open_edges, "open", "closed"),
            property(self.shared_edges, "of more than two triangles", "manifold"),
            property(self.turned_edges, "between fronts and backs", "consistently oriented"),
        ]
        .join(", ")
    }
}

/// The JSON object that `--json` prints.
#[derive(Debug, Serialize)]
struct Info {
    command: &'static str,
    model: String,
    triangles: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    copies: Option<usize>,
    /// Bytes that the flat scene of the copies would have.
    #[serde(skip_serializing_if = "Option::is_none")]
    flat_bytes: Option<u64>,
    meshes: usize,
    materials: usize,
    textures: usize,
    has_normals: bool,
    has_uvs: bool,
    has_colors: bool,
    /// In the coordinates of the file.
    bounds_min: [f64; 3],
    bounds_max: [f64; 3],
    /// Numbers of edges: all, those of an odd number of triangles, of more than two, and between triangles that face opposite ways. Absent
    /// where memory for them is missing.
    #[serde(flatten)]
    edges: Option<EdgeNumbers>,
    /// Subtracted from the coordinates of the file: those of trees, cameras and rays are less by it.
    offset: [f64; 3],
    scene_up: [f32; 3],
    /// Names of the cameras of the file, which may be empty; `--camera` takes their numbers.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    cameras: Vec<String>,
    /// Those of its lights, which `--light file` shows.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    lights: Vec<String>,
    /// Those of its scenes; `--scene` takes their numbers.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    scenes: Vec<String>,
    /// The clips of a model that moves.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    clips: Vec<Clip>,
    scene_bytes: usize,
    /// The moment of a model that moves.
    #[serde(flatten)]
    moment: Option<ShownMoment>,
    #[serde(flatten)]
    tree: TreeNumbers,
    /// Size of the view of the populations.
    #[serde(skip_serializing_if = "Option::is_none")]
    width_px: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    height_px: Option<u32>,
    repeat: usize,
    #[serde(flatten)]
    conditions: Conditions,
    /// The nodes at each depth.
    by_depth: Vec<Depth>,
    /// Visits by rays of each population that was asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    populations: Vec<VisitNumbers>,
    warnings: Vec<String>,
    findings: Vec<Finding>,
}

/// Loads the model, builds its tree, diagnoses both and prints the results.
pub fn run(command: &InfoCommand, context: &mut Context<'_>) -> Result<Finished, Failure> {
    if let Some(text) = command.build.refusal(0) {
        return Err(Failure::Usage(text));
    }
    check_follow(command.follow, &command.build, &command.moments)?;
    let mut read = Protected::default();
    read.add_read(command.source.path().into_iter().chain(command.tree.path()).chain(command.rays.file.as_deref()));
    read.add_standard_streams();
    if let Some(path) = &command.triangles {
        check_target(path, &read)?;
    }
    let scene = command.moments.first(context.load(&command.source)?, &context.token)?;
    if let Some(path) = &command.triangles {
        // Again, as only now it is known what else was read: buffers, textures, material libraries.
        read.add_read(&scene.files_read);
        needs_triangles(&scene, "--triangles")?;
        write_triangles(path, &read, &scene, &context.token)?;
    }
    let progress = Progress::new("Building", &context.token);
    let camera = camera_of(&command.camera, &scene)?;
    let found = in_pool(|| Found::of(command, &scene, &camera, &context.token))?;
    drop(progress);
    let has_faults = note_faults(&found.accel) || found.has_bad_rays;
    for VisitNumbers { sums, .. } in &found.populations {
        let entering = sums.entering_rays.unwrap_or(sums.rays).into();
        if let Some(few) = few_entering(sums.population, entering, sums.rays.into()) {
            note(format_args!("bvhscope: {few}"));
        }
    }
    let accel = Arc::clone(&found.accel);
    let info = found.info(command, &scene, &camera);
    if command.json {
        ignore_missing_reader(context.out.write_all(json_line(&info)?.as_bytes()))?;
    } else {
        let mut text = Vec::new();
        print_text(&info, command.build.builder, &accel.reading(), &mut text)?;
        let text = printable_lines(&String::from_utf8_lossy(&text));
        ignore_missing_reader(context.out.write_all(text.as_bytes()))?;
    }
    Ok(Finished { warned: has_faults || !scene.warnings.is_empty() })
}

/// Writes the triangles of a model into the file `path`.
fn write_triangles(path: &Path, read: &Protected, scene: &Scene, token: &CancelToken) -> Result<(), Failure> {
    let written = write_file(path, read, |writer| {
        write_corners(&scene.triangles, writer, token).map_err(|error| cannot_be_written(&error))
    });
    check_written(written, token)?;
    note_written(path, &format!("{}, nine f32 each", counted(scene.triangles.len() as u64, "triangles")));
    Ok(())
}

/// The tree of a model, and the results about both.
struct Found {
    accel: Arc<Accel>,
    edges: Option<Edges>,
    findings: Vec<Finding>,
    populations: Vec<VisitNumbers>,
    by_depth: Vec<Depth>,
    /// Whether rays of a file were skipped.
    has_bad_rays: bool,
}

impl Found {
    /// Builds or reads the tree, diagnoses model and tree, and measures the visits of its nodes.
    fn of(command: &InfoCommand, scene: &Arc<Scene>, camera: &Camera, token: &CancelToken) -> Result<Self, Failure> {
        let follow = (command.follow, &mut FollowSession::default());
        let accel = Arc::new(command.tree.accel(scene, &command.source, &command.build, follow, token)?);
        accel.widen(token)?;
        let epo = accel.epo(command.epo_samples, token)?;
        let mut findings = diagnose_scene(scene, token)?;
        findings.extend(diagnose_tree(&accel, epo));
        let file = command.rays.read_file(scene, token)?;
        let visits_of = |population| {
            let rays = ViewRays::new(population, *camera, VIEW_PX, &RenderSettings::default()).with_file(file.clone());
            let MeasuredVisits { visits, sums } = rays.measure(&accel, token)?;
            Ok(VisitNumbers { sums, node_visits: Arc::unwrap_or_clone(visits).counts })
        };
        let populations = command.rays.populations.iter().map(visits_of).collect::<Result<Vec<_>, Failure>>()?;
        let has_bad_rays = file.is_some_and(|file| !file.faults.is_empty());
        let visits = populations.iter().map(|of| (of.sums.population, &of.node_visits[..]));
        let by_depth = by_depth(&accel, visits, token)?;
        Ok(Self { accel, edges: scene.compute_edges(token)?, findings, populations, by_depth, has_bad_rays })
    }

    /// The same as the object that is printed.
    fn info(self, command: &InfoCommand, scene: &Scene, camera: &Camera) -> Info {
        let Self { accel, edges, findings, populations, by_depth, .. } = self;
        // Those of a file are no view's.
        let has_rays = Population::ALL.into_iter().any(|population| command.rays.populations.has(population));
        let attributes = scene.attributes.as_ref();
        let triangles = scene.triangle_count() as usize;
        Info {
            command: "info",
            model: command.source.to_string(),
            triangles,
            copies: scene.copies.as_ref().map(|copies| copies.copies().len()),
            flat_bytes: scene.copies.as_ref().map(|copies| copies.flat_bytes()),
            meshes: scene.mesh_count,
            materials: scene.materials.len(),
            textures: scene.image_count(),
            has_normals: attributes.is_some_and(|attributes| !attributes.normals.is_empty()),
            has_uvs: attributes.is_some_and(|attributes| !attributes.uvs.is_empty()),
            has_colors: attributes.is_some_and(|attributes| !attributes.colors.is_empty()),
            bounds_min: scene.in_file(scene.bounds.min).to_array(),
            bounds_max: scene.in_file(scene.bounds.max).to_array(),
            edges: edges.map(|edges| EdgeNumbers {
                edges: edges.count,
                open_edges: edges.open,
                shared_edges: edges.shared_by_many,
                turned_edges: edges.turned,
            }),
            offset: scene.offset.to_array(),
            scene_up: scene.up.to_array(),
            cameras: scene.cameras.iter().map(|camera| camera.name.clone()).collect(),
            lights: scene.lights.iter().map(|light| light.name.clone()).collect(),
            scenes: scene.scene_names.clone(),
            clips: scene.motion.as_ref().map(|motion| motion.clips.clone()).unwrap_or_default(),
            scene_bytes: scene.bytes(),
            moment: ShownMoment::of(&accel),
            tree: TreeNumbers::new(&accel, &accel.reading()),
            width_px: has_rays.then_some(VIEW_PX[0]),
            height_px: has_rays.then_some(VIEW_PX[1]),
            repeat: 1,
            conditions: Conditions::of_process(
                has_rays.then(|| ViewConditions::new(command.camera.place(scene), camera, scene.offset)),
                RenderSettings::default().simd,
            ),
            by_depth,
            populations,
            warnings: scene.warnings.entries.iter().map(ToString::to_string).collect(),
            findings,
        }
    }
}

/// How the tree was built, as far as its file records it.
fn print_settings(tree: &TreeNumbers, reading: &TreeReading<'_>, out: &mut dyn std::io::Write) -> std::io::Result<()> {
    let build_ms = reading.build.map(|build| build.ms);
    if let Some(file) = &tree.file {
        line(out, "file", file.tree.clone())?;
        if let Some(settings) = &file.builder_settings {
            line(out, "settings", settings.clone())?;
        }
        line(out, "build", build_ms.map_or_else(|| "–".to_owned(), |ms| format!("{} ms, says the file", number(ms))))?;
        let empty = match file.empty_nodes {
            0 => String::new(),
            count => format!(", {} left out", counted(count.into(), "empty nodes")),
        };
        return line(out, "children", format!("up to {} of a node{empty}", file.max_arity));
    }
    let numbers = tree.settings.by_symbol();
    if !numbers.is_empty() {
        line(out, "settings", numbers.join(", "))?;
    }
    let defaults = BuildSettings::default();
    let is_default =
        |row: &Setting, text: &String| !matches!(row.value, Value::Number(_)) && *text == row.text(&defaults);
    for (row, text) in tree.settings.all().filter(|(row, text)| row.symbol().is_none() && !is_default(row, text)) {
        line(out, row.key, if row == &OPTIMIZE { passes(&text, &reading.report.stages.costs) } else { text })?;
    }
    let stages: Vec<String> = reading.stages_ms.iter().map(|(name, ms)| format!("{name} {}", number(*ms))).collect();
    let ms = number(build_ms.unwrap_or_default());
    line(out, "build", format!("{ms} ms with {} ({})", counted(tree.threads as u64, "threads"), stages.join(", ")))
}

/// The passes `names`, in order, with the SAH cost after each. Passes that run before the builder have no cost of their own.
fn passes(names: &str, costs: &[(&str, f64)]) -> String {
    let cost = |name: &str| costs.iter().find(|(pass, _)| *pass == name).map(|&(_, cost)| number(cost));
    let (after, before): (Vec<&str>, Vec<&str>) = names.split(',').partition(|name| cost(name).is_some());
    let mut parts: Vec<String> = before.into_iter().map(str::to_owned).collect();
    parts.extend(cost("tree").map(|cost| format!("SAH cost from {cost}")));
    parts.extend(after.iter().filter_map(|pass| Some(format!("{pass} to {}", cost(pass)?))));
    parts.join(", ")
}

/// A line of the text: a name and its value.
fn line(out: &mut dyn std::io::Write, name: &str, value: String) -> std::io::Result<()> {
    writeln!(out, "  {name:<12} {value}")
}

/// Prints the object as text for people.
fn print_text(
    info: &Info,
    builder: BuilderKind,
    reading: &TreeReading<'_>,
    out: &mut dyn std::io::Write,
) -> std::io::Result<()> {
    print_model(info, out)?;
    print_tree(info, builder, reading, out)?;
    print_rays(info, out)?;
    let sums: Vec<&MeasuredRays> = info.populations.iter().map(|of| &of.sums).collect();
    write!(out, "{}", depth_table(&[("", &info.by_depth, &sums)]))?;
    if !info.warnings.is_empty() {
        writeln!(out, "warnings")?;
        info.warnings.iter().try_for_each(|warning| writeln!(out, "  {warning}"))?;
    }
    writeln!(out, "findings")?;
    if info.findings.is_empty() {
        writeln!(out, "  none")?;
    }
    info.findings.iter().try_for_each(|finding| writeln!(out, "  {}", finding.text))
}

/// Prints the contents of the model.
fn print_model(info: &Info, out: &mut dyn std::io::Write) -> std::io::Result<()> {
    let vector = |[x, y, z]: [f64; 3]| format!("{x} {y} {z}");
    let megabytes = |bytes: usize| format!("{} MB", number(bytes as f64 / 1e6));
    writeln!(out, "{}", info.model)?;
    line(out, "triangles", count(info.triangles as u64))?;
    if let Some(copies) = info.copies {
        line(out, "copies", count(copies as u64))?;
    }
    line(out, "meshes", count(info.meshes as u64))?;
    line(out, "materials", format!("{}, textures {}", info.materials, info.textures))?;
    let attributes: Vec<&str> =
        [("normals", info.has_normals), ("texture coordinates", info.has_uvs), ("colours", info.has_colors)]
            .into_iter()
            .filter_map(|(name, has)| has.then_some(name))
            .collect();
    line(out, "vertices", if attributes.is_empty() { "positions only".to_owned() } else { attributes.join(", ") })?;
    line(out, "bounds", format!("{} to {}", vector(info.bounds_min), vector(info.bounds_max)))?;
    if let Some(edges) = &info.edges {
        line(out, "edges", edges.in_words())?;
    }
    let named = |(index, name): (usize, &String)| format!("{index} {name}").trim_end().to_owned();
    for (label, names, least) in
        [("scenes", &info.scenes, 2), ("cameras", &info.cameras, 1), ("lights", &info.lights, 1)]
    {
        if names.len() >= least {
            line(out, label, names.iter().enumerate().map(named).collect::<Vec<_>>().join(", "))?;
        }
    }
    if !info.clips.is_empty() {
        line(out, "clips", clip_names(&info.clips))?;
    }
    if let Some(moment) = &info.moment {
        line(out, "moment", moment.text())?;
    }
    if info.offset != [0.0; 3] {
        line(out, "offset", format!("{}, subtracted from all coordinates", vector(info.offset)))?;
    }
    line(out, "up", vector(info.scene_up.map(f64::from)))?;
    let flat = info.flat_bytes.map_or_else(String::new, |bytes| format!(", flat {}", megabytes(bytes as usize)));
    line(out, "memory", megabytes(info.scene_bytes) + &flat)
}

/// Names and times of the first [`MAX_CLIPS`] clips.
fn clip_names(clips: &[Clip]) -> String {
    let named = |(index, clip): (usize, &Clip)| {
        let name = if clip.name.is_empty() { String::new() } else { format!(" {}", quoted(&clip.name)) };
        format!("{index}{name} ({} to {} s)", number(clip.start.into()), number(clip.end.into()))
    };
    let mut names: Vec<String> = clips.iter().enumerate().map(named).take(MAX_CLIPS).collect();
    if clips.len() > MAX_CLIPS {
        names.push(counted((clips.len() - MAX_CLIPS) as u64, "others"));
    }
    names.join(", ")
}

/// Prints the numbers of the tree, and the faults of one from a file.
fn print_tree(
    info: &Info,
    builder: BuilderKind,
    reading: &TreeReading<'_>,
    out: &mut dyn std::io::Write,
) -> std::io::Result<()> {
    let tree = &info.tree;
    let label = if tree.file.is_some() { &tree.builder } else { builder.label() };
    writeln!(out, "tree: {label}, {} containers", tree.container)?;
    print_settings(tree, reading, out)?;
    for (name, text) in NUMBERS.iter().filter_map(|number| number.info) {
        if let Some(text) = text(reading) {
            line(out, name, text)?;
        }
    }
    if let Some(file) = &tree.file {
        writeln!(out, "faults")?;
        if file.faults.is_empty() {
            writeln!(out, "  none")?;
        }
        file.faults.iter().try_for_each(|fault| writeln!(out, "  {}", fault.text))?;
    }
    Ok(())
}

/// Prints the visits by rays of each population.
fn print_rays(info: &Info, out: &mut dyn std::io::Write) -> std::io::Result<()> {
    if !info.populations.is_empty() {
        writeln!(out, "rays")?;
    }
    for VisitNumbers { sums, .. } in &info.populations {
        let [rays, hits, entering] =
            [sums.rays, sums.root_hits, sums.entering_rays.unwrap_or(0)].map(|rays| count(u64::from(rays)));
        let ray = |visits: f64| number(if sums.root_hits > 0 { visits / f64::from(sums.root_hits) } else { 0.0 });
        let [visits, predicted] = [ray(sums.visits as f64), ray(sums.predicted_visits)];
        let text = format!(
            "{hits} of {rays} enter the root: {visits} visits each, {predicted} predicted, cost {}; {entering} the scene's box{}",
            number(sums.cost),
            sums.tests_per_entering_ray.map_or_else(String::new, |tests| format!(": {} tests each", number(tests)))
        );
        line(out, sums.population.name(), text)?;
    }
    Ok(())
}
