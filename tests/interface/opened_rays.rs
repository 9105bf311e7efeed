//! Files of rays in the whole app: opened beside the model, measured by, drawn and replayed.

use std::path::{Path, PathBuf};

use bvhscope::app::state::{AppState, Request};
use bvhscope::lab::population::Population;
use bvhscope::ray_file::{FileRay, RayHeader, write_rays};
use bvhscope::render::RayStart;
use bvhscope::scene::SceneSource;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::Ray;
use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable as _;
use glam::Vec3;

use crate::harness::{Window, app, presented, press, settle};

fn state(harness: &mut Window) -> &mut AppState {
    &mut harness.state_mut().state
}

fn open(harness: &mut Window, path: &Path) {
    state(harness).activity.requests.push(Request::Open(SceneSource::File(path.to_owned())));
    settle(harness);
}

/// Three rays down the middle of the model, the second of which stands for five.
fn rays(harness: &Window) -> Vec<FileRay> {
    let bounds = presented(harness).accel.scene.bounds;
    let above = (bounds.min + bounds.max) * 0.5 + Vec3::Y * 10.0;
    let ray = |index: u64| {
        let origin = above + Vec3::X * index as f32 * 0.01;
        let ray = Ray { t_max: 100.0, ..Ray::new(origin, Vec3::NEG_Y) };
        FileRay { weight: if index == 1 { 5.0 } else { 1.0 }, ..FileRay::new(index, ray) }
    };
    (0..3).map(ray).collect()
}

fn write(folder: &Path, name: &str, rays: &[FileRay]) -> PathBuf {
    let path = folder.join(name);
    let mut bytes = Vec::new();
    write_rays(&RayHeader::default(), rays, &mut bytes, &CancelToken::new()).unwrap();
    std::fs::write(&path, bytes).unwrap();
    path
}

/// Number of rays by which the visits that nodes show were measured.
fn measured(harness: &Window) -> Option<(Population, u32)> {
    let derived = &harness.state().state.model.derived;
    let (rays, measured) = derived.measured(&presented(harness).accel)?;
    assert_eq!(rays.population(), measured.sums.population);
    Some((measured.sums.population, measured.sums.rays))
}

#[test]
fn rays_of_a_file_are_measured_by_drawn_and_replayed() {
    let folder = tempfile::tempdir().unwrap();
    let mut harness = app();
    let rays = rays(&harness);
    press(&mut harness, Modifiers::NONE, Key::F9);
    settle(&mut harness);
    let of_view = measured(&harness).expect("the view needs visits");
    assert_eq!(of_view.0, Population::Primary);
    open(&mut harness, &write(folder.path(), "three.rays", &rays));
    settle(&mut harness);
    assert_eq!(measured(&harness), Some((Population::File, 7)), "each counts by its weight");
    let drawn = state(&mut harness).model.derived.ray_file.rays().unwrap().drawn.clone();
    assert_eq!(drawn.len(), 3);
    let accel = presented(&harness).accel;
    let hit = accel.tree.closest_hit_indexed(&accel.scene.triangles, &rays[0].ray).expect("the middle is hit");
    assert_eq!(drawn[0].ends, [rays[0].ray.origin, rays[0].ray.at(hit.t)], "up to the surface");
    assert!(drawn[0].is_hit);

    press(&mut harness, Modifiers::NONE, Key::F8);
    for place in [0, 1, 2] {
        let button = if place == 0 { "Replay" } else { "Next ray" };
        harness.get_by_label(button).click();
        settle(&mut harness);
        let source = state(&mut harness).model.ray.source.expect("a ray was taken");
        assert_eq!(source.start, RayStart::Given(rays[place].ray));
    }

    // A file that was written again is read again, and one of no rays leaves those of the view.
    write(folder.path(), "three.rays", &rays[..1]);
    open(&mut harness, &folder.path().join("three.rays"));
    press(&mut harness, Modifiers::NONE, Key::F9);
    settle(&mut harness);
    assert_eq!(measured(&harness), Some((Population::File, 1)));
    open(&mut harness, &write(folder.path(), "none.rays", &[]));
    settle(&mut harness);
    assert!(harness.query_by_label_contains("no ray that can be traced").is_some());
    assert_eq!(measured(&harness), Some(of_view));
}

#[test]
fn another_model_forgets_the_rays() {
    let folder = tempfile::tempdir().unwrap();
    let mut harness = app();
    let path = write(folder.path(), "three.rays", &rays(&harness));
    open(&mut harness, &path);
    assert_eq!(state(&mut harness).model.derived.population, Population::File);
    let model = folder.path().join("corner.obj");
    std::fs::write(&model, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\n").unwrap();
    open(&mut harness, &model);
    assert_eq!(state(&mut harness).model.derived.population, Population::Primary);
    assert!(state(&mut harness).model.derived.ray_file.rays().is_none());
}
