//! `info`: what a file holds, its warnings, its tree's statistics, and what is sick about them.

use serde::Serialize;

use super::context::Progress;
use super::{Context, Failure, Finished};
use crate::accel::Accel;
use crate::bvh::stats::{INTERSECTION_COST, TRAVERSAL_COST};
use crate::bvh::{BuildSettings, BuilderKind, Passes};
use crate::lab::doctor::{Finding, examine_scene, examine_tree};
use crate::lab::millis;
use crate::lab::table::number;
use crate::scene::SceneSource;

/// What is looked at.
#[derive(Debug, Clone)]
pub struct InfoJob {
    /// The model.
    pub source: SceneSource,
    /// Its tree.
    pub build: BuildSettings,
    /// One JSON object instead of the text.
    pub json: bool,
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct Info {
    command: &'static str,
    model: String,
    triangles: usize,
    meshes: usize,
    materials: usize,
    textures: usize,
    has_normals: bool,
    has_uvs: bool,
    has_colors: bool,
    bounds_min: [f32; 3],
    bounds_max: [f32; 3],
    up: [f32; 3],
    scene_bytes: usize,
    builder: &'static str,
    container: &'static str,
    threshold: u32,
    epsilon: f32,
    optimize: Passes,
    threads: usize,
    build_ms: f64,
    build_stages_ms: std::collections::BTreeMap<&'static str, f64>,
    sah_cost: f32,
    epo: f32,
    nodes: usize,
    leaves: usize,
    max_depth: u32,
    mean_leaf_depth: f32,
    leaf_size: [f32; 3],
    tree_bytes: usize,
    triangle_bytes: usize,
    wide_node_bytes: usize,
    wide_triangle_bytes: usize,
    collapse_ms: f64,
    bytes_per_triangle: f64,
    warnings: Vec<String>,
    findings: Vec<Finding>,
}

/// Loads, builds, looks, prints.
pub fn run(job: &InfoJob, context: &mut Context<'_>) -> Result<Finished, Failure> {
    if let Some(text) = job.build.refusal(0) {
        return Err(Failure::Usage(text));
    }
    let scene = context.load(&job.source)?;
    let progress = Progress::new("Building", &context.token);
    let (accel, epo) = context.pool()?.install(|| {
        let accel = Accel::build(&scene, &job.build, &context.token)?;
        let epo = accel.epo();
        Ok::<_, Failure>((accel, epo))
    })?;
    drop(progress);
    let mut findings = examine_scene(&scene);
    findings.extend(examine_tree(&accel, epo));
    let report = &accel.report;
    let stats = &report.stats;
    let attributes = scene.attributes.as_ref();
    let triangles = scene.triangles.len();
    let info = Info {
        command: "info",
        model: job.source.to_string(),
        triangles,
        meshes: scene.mesh_count,
        materials: scene.materials.len(),
        textures: scene.textures.len(),
        has_normals: attributes.is_some_and(|attributes| !attributes.normals.is_empty()),
        has_uvs: attributes.is_some_and(|attributes| !attributes.uvs.is_empty()),
        has_colors: attributes.is_some_and(|attributes| !attributes.colors.is_empty()),
        bounds_min: scene.bounds.min.to_array(),
        bounds_max: scene.bounds.max.to_array(),
        up: scene.up.to_array(),
        scene_bytes: scene.bytes(),
        builder: job.build.builder.name(),
        container: job.build.container.name(),
        threshold: job.build.threshold,
        epsilon: job.build.epsilon,
        optimize: job.build.passes(),
        threads: report.threads,
        build_ms: millis(report.build_time),
        build_stages_ms: report.stages.stages.iter().map(|&(name, time)| (name, millis(time))).collect(),
        sah_cost: stats.sah_cost,
        epo,
        nodes: stats.nodes,
        leaves: stats.leaves,
        max_depth: stats.max_depth,
        mean_leaf_depth: stats.mean_leaf_depth,
        leaf_size: [stats.min_leaf_size as f32, stats.mean_leaf_size, stats.max_leaf_size as f32],
        tree_bytes: report.tree_bytes,
        triangle_bytes: report.triangle_bytes,
        wide_node_bytes: report.wide_node_bytes,
        wide_triangle_bytes: report.wide_triangle_bytes,
        collapse_ms: report.collapse_time.as_secs_f64() * 1e3,
        bytes_per_triangle: (report.tree_bytes + report.triangle_bytes) as f64 / triangles.max(1) as f64,
        warnings: scene.warnings.entries.iter().map(ToString::to_string).collect(),
        findings,
    };
    if job.json {
        let text = serde_json::to_string(&info).map_err(|error| Failure::Failed(error.to_string()))?;
        writeln!(context.out, "{text}")?;
    } else {
        print_text(&info, job.build.builder, context.out)?;
    }
    Ok(Finished { warned: !scene.warnings.is_empty() })
}

fn print_text(info: &Info, builder: BuilderKind, out: &mut dyn std::io::Write) -> std::io::Result<()> {
    let line = |out: &mut dyn std::io::Write, name: &str, value: String| writeln!(out, "  {name:<12} {value}");
    let vector = |[x, y, z]: [f32; 3]| format!("{x} {y} {z}");
    let megabytes = |bytes: usize| format!("{} MB", number(bytes as f64 / 1e6));
    writeln!(out, "{}", info.model)?;
    line(out, "triangles", info.triangles.to_string())?;
    line(out, "meshes", info.meshes.to_string())?;
    line(out, "materials", format!("{}, textures {}", info.materials, info.textures))?;
    let attributes: Vec<&str> =
        [("normals", info.has_normals), ("texture coordinates", info.has_uvs), ("colours", info.has_colors)]
            .into_iter()
            .filter_map(|(name, has)| has.then_some(name))
            .collect();
    line(out, "vertices", if attributes.is_empty() { "positions only".to_owned() } else { attributes.join(", ") })?;
    line(out, "bounds", format!("{} to {}", vector(info.bounds_min), vector(info.bounds_max)))?;
    line(out, "up", vector(info.up))?;
    line(out, "memory", megabytes(info.scene_bytes))?;
    writeln!(out, "tree: {}, {} containers", builder.label(), info.container)?;
    if builder == BuilderKind::Aac {
        line(out, "settings", format!("threshold {}, ε {}", info.threshold, info.epsilon))?;
    }
    if info.optimize != Passes::NONE {
        line(out, "optimize", info.optimize.to_string())?;
    }
    let stages: Vec<String> = info.build_stages_ms.iter().map(|(name, ms)| format!("{name} {}", number(*ms))).collect();
    line(out, "build", format!("{} ms with {} threads ({})", number(info.build_ms), info.threads, stages.join(", ")))?;
    line(out, "nodes", format!("{}, leaves {}", info.nodes, info.leaves))?;
    line(out, "depth", format!("{}, mean over leaves {:.1}", info.max_depth, info.mean_leaf_depth))?;
    let [least, mean, most] = info.leaf_size;
    line(out, "leaf size", format!("{least} to {most} triangles, mean {mean:.2}"))?;
    line(
        out,
        "SAH cost",
        format!(
            "{} (container test {TRAVERSAL_COST}, primitive test {INTERSECTION_COST})",
            number(info.sah_cost.into())
        ),
    )?;
    line(out, "EPO", number(info.epo.into()))?;
    line(
        out,
        "memory",
        format!(
            "{} tree, {} triangles, {:.0} bytes a triangle",
            megabytes(info.tree_bytes),
            megabytes(info.triangle_bytes),
            info.bytes_per_triangle
        ),
    )?;
    let wide_bytes = info.wide_node_bytes + info.wide_triangle_bytes;
    line(
        out,
        "wide tree",
        format!(
            "{} nodes, {} triangles, {:.0} bytes a triangle, made in {} ms",
            megabytes(info.wide_node_bytes),
            megabytes(info.wide_triangle_bytes),
            wide_bytes as f64 / info.triangles.max(1) as f64,
            number(info.collapse_ms)
        ),
    )?;
    if !info.warnings.is_empty() {
        writeln!(out, "warnings")?;
        info.warnings.iter().try_for_each(|warning| writeln!(out, "  {warning}"))?;
    }
    writeln!(out, "findings")?;
    if info.findings.is_empty() {
        writeln!(out, "  nothing is sick")?;
    }
    info.findings.iter().try_for_each(|finding| writeln!(out, "  {}", finding.text))
}
