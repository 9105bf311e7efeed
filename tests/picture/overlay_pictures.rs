//! The overlay's lines, drawn without a window.

use std::sync::Arc;

use crate::overlays::{cube_triangle, row, settings, table};
use bvhscope::camera::{Camera, Projection};
use bvhscope::overlay::{
    DrawInput, NodeTable, OffscreenError, OverlaySettings, PictureInput, Selection, draw_offscreen, legend,
};
use bvhscope_engine::geometry::{Aabb, Sphere};
use glam::Vec3;

const FAR: f32 = 1e30;

/// The colour that the legend gives to the first depth.
fn brightest_channel(settings: &OverlaySettings, table: &NodeTable) -> u8 {
    let legend = legend(settings, table);
    legend.color(legend.stops[0].0).into_iter().max().unwrap()
}

/// A picture with the same colour and depth in every pixel.
struct Flat {
    size: [u32; 2],
    rgba: Vec<[u8; 4]>,
    depth: Vec<f32>,
}

impl Flat {
    fn new(size: [u32; 2], color: [u8; 4], depth: f32) -> Self {
        let count = (size[0] * size[1]) as usize;
        Self { size, rgba: vec![color; count], depth: vec![depth; count] }
    }

    fn input(&self) -> PictureInput<'_> {
        PictureInput { id: 1, width_px: self.size[0], height_px: self.size[1], rgba: &self.rgba, depth: &self.depth }
    }
}

/// Looks along -z at the origin.
fn camera(distance: f32, projection: Projection) -> Camera {
    Camera { eye: Vec3::Z * distance, target: Vec3::ZERO, up: Vec3::Y, fov_y: 0.8, projection }
}

/// Draws the overlay. Needs a graphics driver; a software one will do.
fn draw(
    picture: &Flat,
    camera: Camera,
    table: Option<&Arc<NodeTable>>,
    settings: OverlaySettings,
    selection: &Selection,
) -> Vec<[u8; 4]> {
    let input = DrawInput {
        picture: picture.input(),
        camera,
        table,
        settings,
        selection,
        show_picture: true,
        viewport_px: [0, 0, picture.size[0], picture.size[1]],
        pixels_per_point: 1.0,
    };
    let drawn = draw_offscreen(&input).unwrap();
    if let Ok(folder) = std::env::var("BVHSCOPE_KEEP_PICTURES") {
        let name = std::thread::current().name().unwrap_or("drawn").to_owned();
        let bytes: Vec<u8> = drawn.iter().flatten().copied().collect();
        let image = image::RgbaImage::from_raw(picture.size[0], picture.size[1], bytes).unwrap();
        image.save(format!("{folder}/{name}.png")).unwrap();
    }
    drawn
}

/// Brightness along column `x`: the profile of the lines that cross it.
fn column(pixels: &[[u8; 4]], size: [u32; 2], x: u32) -> Vec<u8> {
    (0..size[1]).map(|y| pixels[(y * size[0] + x) as usize]).map(|[r, g, b, _]| r.max(g).max(b)).collect()
}

#[test]
fn a_picture_alone_comes_out_unchanged() {
    // A row of 93 pixels is not a multiple of 256 bytes.
    let size = [93, 41];
    let mut picture = Flat::new(size, [0; 4], FAR);
    for (index, pixel) in picture.rgba.iter_mut().enumerate() {
        *pixel = [index as u8, (index / 7) as u8, (index / 93 * 5) as u8, 255];
    }
    let nothing = Selection::default();
    let drawn = draw(&picture, camera(5.0, Projection::Perspective), None, settings(0, 9), &nothing);
    assert!(drawn == picture.rgba);
}

#[test]
fn hidden_lines_are_faint() {
    let size = [200, 200];
    let table = table::<Aabb>(cube_triangle());
    let nothing = Selection::default();
    for projection in [Projection::Perspective, Projection::Orthographic] {
        let brightest = |depth: f32, hidden_alpha: f32| {
            let picture = Flat::new(size, [0, 0, 0, 255], depth);
            let settings = OverlaySettings { hidden_alpha, line_width: 2.0, ..settings(0, 0) };
            let drawn = draw(&picture, camera(5.0, projection), Some(&table), settings, &nothing);
            column(&drawn, size, 100).into_iter().max().unwrap()
        };
        let visible = brightest(FAR, 0.15);
        let expected = brightest_channel(&settings(0, 0), &table);
        assert!(visible.abs_diff(expected) <= 1, "{visible} in place of {expected}");
        // The cube reaches from depth 4 to 6.
        assert_eq!(brightest(3.0, 0.0), 0);
        let faint = brightest(3.0, 0.2);
        let expected = f32::from(expected) * 0.2;
        // In an orthographic view the back edge is behind the front edge: 1 - 0.8² = 0.36.
        let layers = if projection == Projection::Perspective { 1.0 } else { 1.8 };
        assert!((f32::from(faint) - expected * layers).abs() < 2.0, "{faint} in place of {}", expected * layers);
        let half = brightest(5.0, 0.0);
        assert!(half.abs_diff(visible) <= 1, "the front of the cube stands before the surface");
        assert!(brightest(4.0, 0.0).abs_diff(visible) <= 1, "touching is not hidden");
    }
}

#[test]
fn lines_keep_their_width_under_zoom() {
    let size = [300, 300];
    let picture = Flat::new(size, [0, 0, 0, 255], FAR);
    let table = table::<Aabb>(cube_triangle());
    let nothing = Selection::default();
    for line_width in [1.0, 3.0] {
        for distance in [3.5, 6.0, 12.0] {
            let settings = OverlaySettings { line_width, ..settings(0, 0) };
            let camera = camera(distance, Projection::Perspective);
            let drawn = draw(&picture, camera, Some(&table), settings, &nothing);
            let profile = column(&drawn, size, 150);
            let full = f32::from(brightest_channel(&settings, &table));
            // Front and back, top and bottom: four lines cross the centre.
            let width = profile.iter().map(|value| f32::from(*value) / full).sum::<f32>() / 4.0;
            assert!((width - line_width).abs() < 0.1, "{width} px in place of {line_width} at distance {distance}");
        }
    }
}

#[test]
fn the_outline_of_a_sphere_encloses_it() {
    let size = [400, 400];
    let picture = Flat::new(size, [0, 0, 0, 255], FAR);
    let table = table::<Sphere>(cube_triangle());
    let radius = table.node_sphere(0).radius;
    let center = table.node_sphere(0).center;
    let nothing = Selection::default();
    let settings = OverlaySettings { show_boxes: false, show_spheres: true, line_width: 1.0, ..settings(0, 0) };
    for projection in [Projection::Perspective, Projection::Orthographic] {
        let mut camera = camera(6.0, projection);
        camera.eye += center;
        camera.target += center;
        let drawn = draw(&picture, camera, Some(&table), settings, &nothing);
        let reach = match projection {
            // The angle of the tangent, not of the great circle.
            Projection::Perspective => (radius / 6.0).asin().tan() / 0.4_f32.tan() * 200.0,
            Projection::Orthographic => radius / (6.0 * 0.4_f32.tan()) * 200.0,
        };
        let lit = drawn.iter().enumerate().filter(|(_, pixel)| pixel[0].max(pixel[1]).max(pixel[2]) > 40);
        let distance = |index: usize| {
            let (x, y) = ((index % 400) as f32 + 0.5 - 200.0, (index / 400) as f32 + 0.5 - 200.0);
            x.hypot(y)
        };
        let farthest = lit.map(|(index, _)| distance(index)).fold(0.0, f32::max);
        assert!((farthest - reach).abs() < 1.5, "{farthest} px in place of {reach}");
        // In every direction around the centre.
        for step in 0..360 {
            let (sin, cos) = (step as f32).to_radians().sin_cos();
            let on = [-1.0, 0.0, 1.0].into_iter().any(|off| {
                let (x, y) = (200.0 + cos * (reach + off), 200.0 + sin * (reach + off));
                let [r, g, b, _] = drawn[y as usize * 400 + x as usize];
                r.max(g).max(b) > 40
            });
            assert!(on, "a gap at {step}°");
        }
    }
}

#[test]
fn a_selected_node_is_drawn_though_nothing_else_is() {
    let size = [200, 200];
    let picture = Flat::new(size, [0, 0, 0, 255], FAR);
    let table = table::<Aabb>(cube_triangle());
    let selection = Selection { selected: Some(0), hidden: [0].into(), ..Selection::default() };
    let none = OverlaySettings { show_boxes: false, show_spheres: false, ..settings(0, 0) };
    let camera = camera(5.0, Projection::Perspective);
    let drawn = draw(&picture, camera, Some(&table), none, &selection);
    let warm = drawn.iter().filter(|[r, g, b, _]| *r == 255 && g.abs_diff(180) < 3 && b.abs_diff(84) < 3).count();
    assert!(warm > 500, "{warm} warm pixels");
    let drawn = draw(&picture, camera, Some(&table), none, &Selection::default());
    assert!(drawn == picture.rgba);
}

#[test]
fn an_observer_inside_sees_lines_without_streaks() {
    let size = [320, 200];
    let picture = Flat::new(size, [0, 0, 0, 255], FAR);
    let table = table::<Sphere>(row(40));
    let settings = OverlaySettings { show_boxes: true, show_spheres: true, ..settings(0, 9) };
    let inside = Camera {
        eye: Vec3::new(20.0, 0.5, 0.3),
        target: Vec3::new(60.0, 0.4, 0.2),
        ..camera(1.0, Projection::Perspective)
    };
    let drawn = draw(&picture, inside, Some(&table), settings, &Selection::default());
    let lit = drawn.iter().filter(|pixel| pixel[1] > 40).count();
    assert!(lit > 1_000 && lit < drawn.len() / 2, "{lit} of {} pixels", drawn.len());
}

#[test]
fn a_picture_beyond_the_driver_is_an_error() {
    let picture = Flat { size: [4_000_000, 1], rgba: Vec::new(), depth: Vec::new() };
    let nothing = Selection::default();
    let input = DrawInput {
        picture: picture.input(),
        camera: camera(5.0, Projection::Perspective),
        table: None,
        settings: settings(0, 0),
        selection: &nothing,
        show_picture: true,
        viewport_px: [0, 0, 1, 1],
        pixels_per_point: 1.0,
    };
    match draw_offscreen(&input) {
        Err(OffscreenError::NoAdapter(what)) => assert!(what.contains("mesa-vulkan-drivers")),
        Err(OffscreenError::Device(what)) => assert!(what.contains("4000000×1"), "{what}"),
        Ok(_) => panic!("no driver has textures of four million pixels"),
    }
}
