//! Small pictures of built-in scenes in every shading mode, compared with those in `tests/picture/golden`.
//!
//! `UPDATE_GOLDEN=1 cargo test --test picture golden_images` overwrites them: inspect them before committing.

use std::path::PathBuf;
use std::sync::Arc;

use bvhscope::accel::Accel;
use bvhscope::camera::{Camera, Projection};
use bvhscope::colors::ColorMap;
use bvhscope::render::{Frame, HeatKind, Light, RenderRequest, RenderSettings, Shading, render};
use bvhscope::scene::{LoadOptions, SceneSource, load};
use bvhscope::section::SectionPlane;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::{BuildSettings, Preset};
use bvhscope_engine::tree::ContainerKind;

pub const WIDTH: u32 = 96;
pub const HEIGHT: u32 = 72;

/// Permitted differences between a picture and its golden image.
pub struct Tolerance {
    /// Largest difference of a channel that counts as equal.
    channel: u8,
    /// Number of the 6,912 pixels that may differ by more.
    pixels: usize,
    /// How far such a pixel may lie outside the range of its neighbours in the golden image, in each channel.
    beyond: u8,
}

/// One sample a pixel: all arithmetic is plain f32 and repeats on every CPU, but SIMD levels with fused multiply-add may round a
/// ray to the other side of an edge, where it shows what its neighbour shows. Colours move by a rounding of the sRGB table only.
pub const ONE_SAMPLE: Tolerance = Tolerance { channel: 2, pixels: 7, beyond: 2 };

/// Several samples with random directions: `sin`, `cos` and `exp` differ by an ulp between C libraries, and one of the rays of a
/// pixel may then meet another triangle: at most a sixteenth of the light of its sky.
pub const SAMPLED: Tolerance = Tolerance { channel: 3, pixels: 35, beyond: 12 };

/// Colours of clusters and counts of tests show the tree itself: rounding may only affect pixels at edges of containers, which
/// then count one pair of tests more or less.
const TREE: Tolerance = Tolerance { channel: 2, pixels: 14, beyond: 12 };

fn picture(scene: &str, container: ContainerKind, settings: RenderSettings, projection: Projection) -> Frame {
    let token = CancelToken::new();
    let source = SceneSource::parse(scene.as_ref()).unwrap();
    let scene = Arc::new(load(&source, &LoadOptions::default(), &token).unwrap());
    let accel = Arc::new(Accel::build(&scene, &BuildSettings::preset(Preset::Fast, container), &token).unwrap());
    let camera = Camera { projection, ..Camera::framing(&scene.bounds, scene.up) };
    let request = RenderRequest::new(&accel, camera, settings, [WIDTH, HEIGHT]);
    render(&request, &token, &|_| {}).unwrap()
}

pub fn check(name: &str, frame: &Frame, tolerance: &Tolerance) {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/picture/golden").join(format!("{name}.png"));
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        let bytes = bytemuck::cast_slice(&frame.rgba);
        image::save_buffer(&path, bytes, WIDTH, HEIGHT, image::ColorType::Rgba8).unwrap();
    }
    let golden = image::open(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display())).to_rgba8();
    assert_eq!(golden.dimensions(), (frame.width_px, frame.height_px));
    let (ours, golden) = (&frame.rgba, golden.as_flat_samples().samples.as_chunks::<4>().0.to_vec());
    let mut different = Vec::new();
    let mut strays = Vec::new();
    for (index, (color, expected)) in ours.iter().zip(&golden).enumerate() {
        let [x, y] = [index % WIDTH as usize, index / WIDTH as usize];
        if color.iter().zip(expected).all(|(a, b)| a.abs_diff(*b) <= tolerance.channel) {
            continue;
        }
        let text = format!("({x}, {y}) {color:?} instead of {expected:?}");
        if outside(color, &golden, [x, y]) > tolerance.beyond {
            strays.push(text.clone());
        }
        different.push(text);
    }
    if strays.is_empty() && different.len() <= tolerance.pixels {
        return;
    }
    let actual = std::env::temp_dir().join(format!("bvhscope-golden-{name}.png"));
    let bytes = bytemuck::cast_slice(&frame.rgba);
    image::save_buffer(&actual, bytes, WIDTH, HEIGHT, image::ColorType::Rgba8).unwrap();
    let shown = |list: &[String]| list.iter().take(5).cloned().collect::<Vec<_>>().join(", ");
    panic!(
        "{name}: {} pixels differ, {} of them from all their neighbours: {}; this run's picture: {}",
        different.len(),
        strays.len(),
        shown(if strays.is_empty() { &different } else { &strays }),
        actual.display()
    );
}

/// How far a colour lies outside the range of the nine pixels around a place, in the channel where it is farthest.
fn outside(color: &[u8; 4], golden: &[[u8; 4]], [x, y]: [usize; 2]) -> u8 {
    let around = |at: usize, size: u32| at.saturating_sub(1)..=(at + 1).min(size as usize - 1);
    let mut range = [[u8::MAX, u8::MIN]; 4];
    for y in around(y, HEIGHT) {
        for x in around(x, WIDTH) {
            for (range, &channel) in range.iter_mut().zip(&golden[y * WIDTH as usize + x]) {
                *range = [range[0].min(channel), range[1].max(channel)];
            }
        }
    }
    let outside = color
        .iter()
        .zip(range)
        .map(|(&channel, [low, high])| low.saturating_sub(channel).max(channel.saturating_sub(high)));
    outside.max().unwrap_or(0)
}

fn settings(shading: Shading) -> RenderSettings {
    RenderSettings { shading, samples: 1, ..RenderSettings::default() }
}

fn teapot(shading: Shading) -> Frame {
    picture("builtin:teapot:4", ContainerKind::Aabb, settings(shading), Projection::Perspective)
}

#[test]
fn lit_by_the_sun() {
    check("lit-sun", &teapot(Shading::Lit), &ONE_SAMPLE);
}

#[test]
fn lit_by_the_sun_at_rest() {
    let settings = RenderSettings { samples: 16, ..settings(Shading::Lit) };
    let frame = picture("builtin:teapot:4", ContainerKind::Aabb, settings, Projection::Perspective);
    assert_eq!(frame.samples, 16);
    check("lit-sun-16-samples", &frame, &SAMPLED);
}

#[test]
fn lit_by_the_headlight() {
    let settings = RenderSettings { light: Light::Headlight, ..settings(Shading::Lit) };
    check(
        "lit-headlight",
        &picture("builtin:teapot:4", ContainerKind::Aabb, settings, Projection::Perspective),
        &ONE_SAMPLE,
    );
}

/// A room with coloured walls, a light panel and the shadows of two boxes.
#[test]
fn the_cornell_box() {
    for (name, light) in [("cornell-sun", Light::Sun), ("cornell-headlight", Light::Headlight)] {
        let settings = RenderSettings { light, ..settings(Shading::Lit) };
        let frame = picture("builtin:cornell", ContainerKind::Aabb, settings, Projection::Perspective);
        check(name, &frame, &ONE_SAMPLE);
    }
}

#[test]
fn a_ground_darkens_the_background_and_changes_nothing_else() {
    let pictured = |ground| {
        let settings = RenderSettings { ground, ..settings(Shading::Lit) };
        picture("builtin:teapot:4", ContainerKind::Aabb, settings, Projection::Perspective)
    };
    let [with, without] = [true, false].map(pictured);
    assert_eq!(
        (&with.primitive, &with.distance, with.stats.hits),
        (&without.primitive, &without.distance, without.stats.hits)
    );
    let mut darker = 0;
    for (index, (on, off)) in with.rgba.iter().zip(&without.rgba).enumerate() {
        let is_background = with.primitive[index] == u32::MAX;
        assert!(on == off || is_background && on.iter().zip(off).all(|(on, off)| on <= off), "pixel {index}");
        darker += usize::from(on != off);
    }
    assert!(darker > 50, "{darker} pixels are in the shadow");
    check("lit-ground", &with, &ONE_SAMPLE);
}

#[test]
fn lit_in_parallel_projection() {
    let frame = picture("builtin:teapot:4", ContainerKind::Aabb, settings(Shading::Lit), Projection::Orthographic);
    check("lit-orthographic", &frame, &ONE_SAMPLE);
}

#[test]
fn normals() {
    check("normals", &teapot(Shading::Normals), &ONE_SAMPLE);
}

#[test]
fn edges_of_the_mesh() {
    for (name, shading) in [("lit-edges", Shading::Lit), ("heat-edges", Shading::Heat(HeatKind::Both))] {
        let settings = RenderSettings { mesh_edges: true, ..settings(shading) };
        check(name, &picture("builtin:teapot:1", ContainerKind::Aabb, settings, Projection::Perspective), &TREE);
    }
}

#[test]
fn depth() {
    check("depth", &teapot(Shading::Depth), &ONE_SAMPLE);
}

#[test]
fn ambient_occlusion() {
    let settings = RenderSettings { samples: 16, ..settings(Shading::AmbientOcclusion) };
    let frame = picture("builtin:teapot:4", ContainerKind::Aabb, settings, Projection::Perspective);
    check("ambient-occlusion", &frame, &SAMPLED);
}

#[test]
fn cluster_colors() {
    check("clusters", &teapot(Shading::Clusters), &TREE);
}

#[test]
fn heat_of_boxes() {
    check("heat-both-box", &teapot(Shading::Heat(HeatKind::Both)), &TREE);
    check("heat-containers-box", &teapot(Shading::Heat(HeatKind::Containers)), &TREE);
    check("heat-primitives-box", &teapot(Shading::Heat(HeatKind::Primitives)), &TREE);
    check("heat-whole-ray-box", &teapot(Shading::Heat(HeatKind::WholeRay)), &TREE);
    check("heat-lines-box", &teapot(Shading::Heat(HeatKind::Lines)), &TREE);
}

#[test]
fn heat_of_spheres() {
    let settings = RenderSettings { color_map: ColorMap::Turbo, ..settings(Shading::Heat(HeatKind::Both)) };
    let frame = picture("builtin:teapot:4", ContainerKind::Sphere, settings, Projection::Perspective);
    check("heat-both-sphere", &frame, &TREE);
}

#[test]
fn heat_of_polytopes() {
    let settings = RenderSettings { color_map: ColorMap::Turbo, ..settings(Shading::Heat(HeatKind::Both)) };
    let frame = picture("builtin:teapot:4", ContainerKind::Dop14, settings, Projection::Perspective);
    check("heat-both-dop", &frame, &TREE);
}

/// The model cut open across z, hatched where the plane cuts through it; the heat map counts the tests of the clipped rays.
#[test]
fn cut_open() {
    for (name, shading) in [("section-lit", Shading::Lit), ("section-heat", Shading::Heat(HeatKind::Both))] {
        let plane = SectionPlane { normal: glam::Vec3::Z, offset: 0.0, flipped: false };
        let settings = RenderSettings { section: Some(plane), ..settings(shading) };
        check(name, &picture("builtin:teapot:4", ContainerKind::Aabb, settings, Projection::Perspective), &TREE);
    }
}
