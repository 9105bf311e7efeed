//! The trees as files, so that `bvhscope MODEL --tree FILE` shows them: `--dump FOLDER`.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::Context as _;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::tree::AnyTree;
use bvhscope_engine::tree_file::{Header, write_tree};

use crate::embree_library::libraries;
use crate::embree_tree::{self, Shape};
use crate::measure::Plan;
use crate::peer::OWN;
use crate::scenes::Subject;
use crate::{embree, engine, obvhs_peer, obvhs_tree, tinybvh_library, tinybvh_peer};

/// Writes every tree that the plan names into `folder`, binary and wide, and returns the files. Embree's come from the builders
/// of its scenes, whose own trees cannot be read.
pub fn dump(subject: &Subject, plan: &Plan, folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    std::fs::create_dir_all(folder).with_context(|| format!("--dump {}", folder.display()))?;
    let mut files = Vec::new();
    let mut write = |engine: &str, name: &str, kind: &str, build: &dyn Fn() -> AnyTree| {
        if plan.names(engine, name) {
            let start = Instant::now();
            let tree = build();
            files.push(write_file(subject, folder, [engine, name, kind], tree, start.elapsed())?);
        }
        anyhow::Ok(())
    };

    let triangles = &subject.triangles[..];
    for (name, settings) in engine::settings(plan.slow) {
        write(OWN, &name, "binary", &|| engine::tree(triangles, &settings))?;
        write(OWN, &name, "wide", &|| {
            let binary = engine::tree(triangles, &settings);
            let wide = engine::wide(&binary, triangles).to_tree(&binary, &CancelToken::new());
            wide.expect("the token is never cancelled").expect("made from this tree")
        })?;
    }
    for library in libraries() {
        let device = embree::Device::new(library, 0);
        for &quality in embree::qualities(plan.slow) {
            for (kind, shape) in [("binary", Shape::Binary), ("wide", Shape::Wide)] {
                let build = || embree_tree::build(&device, triangles, quality, shape).into();
                write(library.name, quality.name(), kind, &build)?;
            }
        }
    }
    let converted = obvhs_peer::converted(triangles);
    for (name, parameters) in obvhs_peer::settings(plan.slow) {
        let binary = || obvhs_tree::binary(&obvhs_peer::binary(&converted, parameters)).into();
        write(obvhs_peer::NAME, name, "binary", &binary)?;
        let wide = || obvhs_tree::wide(&obvhs_peer::wide(&converted, parameters)).into();
        write(obvhs_peer::NAME, name, "wide", &wide)?;
    }
    let vertices = tinybvh_library::vertices(triangles);
    for &(name, quality) in tinybvh_peer::settings() {
        write(tinybvh_peer::NAME, name, "binary", &|| tinybvh_peer::binary(&vertices, quality).into())?;
    }
    Ok(files)
}

/// Writes one tree: its name is that of the model, the engine, its setting and its kind.
fn write_file(
    subject: &Subject,
    folder: &Path,
    [engine, name, kind]: [&str; 3],
    mut tree: AnyTree,
    build_time: Duration,
) -> anyhow::Result<PathBuf> {
    // The model has triangles without area, too, which were left out.
    bvhscope_engine::with_tree!(&mut tree, tree => {
        tree.primitive_indices.iter_mut().for_each(|index| *index = subject.source_indices[*index as usize]);
    });
    let header = Header {
        builder: Some(engine.to_owned()),
        settings: Some(format!("{name}, {kind}").into()),
        build_ms: Some(build_time.as_secs_f64() * 1e3),
        ..Header::new(subject.source_triangles)
    };
    let words = [subject.name.as_str(), engine, name, kind].join("-");
    let plain: String = words.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
    let path = folder.join(plain + ".bvh");
    let mut bytes = Vec::new();
    write_tree(&tree, &header, None, &mut bytes, &CancelToken::new())?;
    std::fs::write(&path, bytes).with_context(|| path.display().to_string())?;
    Ok(path)
}
