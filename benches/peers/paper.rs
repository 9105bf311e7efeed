//! Tables 1 and 2 of the paper, as `bvhscope bench` measures them.

use std::path::Path;
use std::sync::Arc;

use anyhow::anyhow;
use bvhscope::lab::population::Populations;
use bvhscope::lab::{Measurement, Setup, Subject, TraceView, bench};
use bvhscope::scene::{LoadOptions, SceneSource, load};
use bvhscope::view::NamedView;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::settings::{BuildSettings, Preset};
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::traverse::Traversal;
use serde_json::{Value, json};

/// Name of the scene in the paper, and the file that stands for it.
const SCENES: [(&str, &str); 6] = [
    ("teapot", "teapot/teapot.obj"),
    ("sponza", "sponza-dabrovic/sponza.obj"),
    ("car", "car/pontiac-gto67.glb"),
    ("conference", "conference/conference.obj"),
    ("buddha", "buddha/buddha.obj"),
    ("dragon", "dragon/dragon.ply"),
];

/// Width and height of the picture in pixels.
const SIZE: [u32; 2] = [1024, 1024];

/// Boxes and spheres of each scene of `folder` in either order of traversal, on all threads. The paper's order is counted, and
/// traced only once.
pub fn rows(folder: &Path, repeat: usize) -> anyhow::Result<Vec<Value>> {
    let token = CancelToken::new();
    let mut rows = Vec::new();
    for (name, file) in SCENES {
        let scene = Arc::new(load(&SceneSource::File(folder.join(file)), &LoadOptions::default(), &token)?);
        let (camera, place) = (NamedView::Outside.camera(&scene, scene.up), NamedView::Outside.place(&scene));
        let subject = Subject {
            model: name.to_owned(),
            load: LoadOptions::default(),
            scene,
            trees: Vec::new(),
            forms: Vec::new(),
            rays: None,
        };
        let setups = ContainerKind::ALL.map(|container| Setup {
            build: BuildSettings::preset(Preset::Fast, container),
            preset: Some(Preset::Fast),
            threads: 0,
        });
        for (traversal, repeat) in [(Traversal::Ordered, repeat), (Traversal::Paper, 1)] {
            let view = TraceView {
                camera,
                place,
                size: SIZE,
                traversal,
                simd: SimdLevel::of_builds(),
                repeat,
                populations: Populations::NONE,
                epo_samples: None,
            };
            let mut measured = Vec::new();
            bench(&subject, &setups, &view, false, &token, &mut |row: Measurement| measured.push(row))
                .map_err(|error| anyhow!("{error}"))?;
            for row in measured {
                let mut row = serde_json::to_value(row)?;
                row["part"] = json!("paper");
                row["file"] = json!(file);
                rows.push(row);
            }
        }
    }
    Ok(rows)
}
