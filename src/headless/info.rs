//! `info`: contents and warnings of a file, statistics of its tree, and findings of the diagnosis.

use serde::Serialize;

use super::context::{Context, Failure, Finished, ignore_missing_reader, in_pool};
use super::progress::Progress;
use super::tree_numbers::TreeNumbers;
use crate::accel::Accel;
use crate::console::{printable_json, printable_lines};
use crate::lab::diagnose::{Finding, diagnose_scene, diagnose_tree};
use crate::lab::report_table::number;
use crate::scene::SceneSource;
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Curve, Pass, Passes};
use bvhscope_engine::tree::overlap::EndPointOverlap;
use bvhscope_engine::tree::statistics::{INTERSECTION_COST, TRAVERSAL_COST};

/// Settings of `info`.
#[derive(Debug, Clone)]
pub struct InfoCommand {
    /// The model.
    pub source: SceneSource,
    /// Build settings of the tree.
    pub build: BuildSettings,
    /// Print one JSON object instead of the text.
    pub json: bool,
}

/// The JSON object that `--json` prints.
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
    #[serde(flatten)]
    tree: TreeNumbers,
    warnings: Vec<String>,
    findings: Vec<Finding>,
}

/// Loads the model, builds its tree, diagnoses both and prints the results.
pub fn run(command: &InfoCommand, context: &mut Context<'_>) -> Result<Finished, Failure> {
    if let Some(text) = command.build.refusal(0) {
        return Err(Failure::Usage(text));
    }
    let scene = context.load(&command.source)?;
    let progress = Progress::new("Building", &context.token);
    let token = &context.token;
    let (accel, epo, findings) = in_pool(|| {
        let accel =
            Accel::build(&scene, &command.build, token).map_err(|error| Failure::of_build(error, &command.source))?;
        let epo = accel.epo(token)?;
        let mut findings = diagnose_scene(&scene, token)?;
        findings.extend(diagnose_tree(&accel, epo));
        Ok::<_, Failure>((accel, epo, findings))
    })?;
    drop(progress);
    let attributes = scene.attributes.as_ref();
    let triangles = scene.triangles.len();
    let info = Info {
        command: "info",
        model: command.source.to_string(),
        triangles,
        meshes: scene.mesh_count,
        materials: scene.materials.len(),
        textures: scene.image_count(),
        has_normals: attributes.is_some_and(|attributes| !attributes.normals.is_empty()),
        has_uvs: attributes.is_some_and(|attributes| !attributes.uvs.is_empty()),
        has_colors: attributes.is_some_and(|attributes| !attributes.colors.is_empty()),
        bounds_min: scene.bounds.min.to_array(),
        bounds_max: scene.bounds.max.to_array(),
        up: scene.up.to_array(),
        scene_bytes: scene.bytes(),
        tree: TreeNumbers::new(&accel, epo),
        warnings: scene.warnings.entries.iter().map(ToString::to_string).collect(),
        findings,
    };
    if command.json {
        let text = serde_json::to_string(&info).map_err(|error| Failure::Failed(error.to_string()))?;
        ignore_missing_reader(writeln!(context.out, "{}", printable_json(&text)))?;
    } else {
        let mut text = Vec::new();
        print_text(&info, command.build.builder, epo, &mut text)?;
        let text = printable_lines(&String::from_utf8_lossy(&text));
        ignore_missing_reader(context.out.write_all(text.as_bytes()))?;
    }
    Ok(Finished { warned: !scene.warnings.is_empty() })
}

fn print_text(
    info: &Info,
    builder: BuilderKind,
    epo: EndPointOverlap,
    out: &mut dyn std::io::Write,
) -> std::io::Result<()> {
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
    let tree = &info.tree;
    writeln!(out, "tree: {}, {} containers", builder.label(), tree.container)?;
    if builder == BuilderKind::Aac {
        line(out, "settings", format!("threshold {}, ε {}", tree.threshold, tree.epsilon))?;
    }
    if tree.curve != Curve::Morton {
        line(out, "curve", tree.curve.name().to_owned())?;
    }
    if tree.optimize != Passes::NONE {
        let cost = |name: &str| tree.optimize_sah_costs.get(name).map(|&cost| number(cost));
        // Passes that run before the builder have no cost of their own.
        let (after, before): (Vec<Pass>, Vec<Pass>) =
            tree.optimize.iter().partition(|pass| cost(pass.name()).is_some());
        let mut parts: Vec<String> = before.iter().map(|pass| pass.name().to_owned()).collect();
        parts.extend(cost("tree").map(|cost| format!("SAH cost from {cost}")));
        parts.extend(after.iter().filter_map(|pass| Some(format!("{} to {}", pass.name(), cost(pass.name())?))));
        line(out, "optimize", parts.join(", "))?;
    }
    let stages: Vec<String> = tree.build_stages_ms.iter().map(|(name, ms)| format!("{name} {}", number(*ms))).collect();
    line(out, "build", format!("{} ms with {} threads ({})", number(tree.build_ms), tree.threads, stages.join(", ")))?;
    line(out, "nodes", format!("{}, leaves {}", tree.nodes, tree.leaves))?;
    line(out, "depth", format!("{}, mean over leaves {:.1}", tree.max_depth, tree.mean_leaf_depth))?;
    let [min, mean, max] = tree.leaf_size;
    line(out, "leaf size", format!("{min} to {max} triangles, mean {mean:.2}"))?;
    line(
        out,
        "SAH cost",
        format!(
            "{} (container test {TRAVERSAL_COST}, primitive test {INTERSECTION_COST})",
            number(tree.sah_cost.into())
        ),
    )?;
    let note = epo.estimate_note().map_or_else(String::new, |note| format!(" ({note})"));
    line(out, "EPO", format!("{}{note}", number(epo.value.into())))?;
    line(
        out,
        "memory",
        format!(
            "{} tree, {} triangles, {:.0} bytes a triangle",
            megabytes(tree.tree_bytes),
            megabytes(tree.triangle_bytes),
            tree.bytes_per_triangle
        ),
    )?;
    line(
        out,
        "wide tree",
        format!(
            "{} nodes, {} triangles, {:.0} bytes a triangle, made in {} ms",
            megabytes(tree.wide_node_bytes),
            megabytes(tree.wide_triangle_bytes),
            tree.wide_bytes_per_triangle,
            number(tree.collapse_ms)
        ),
    )?;
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
