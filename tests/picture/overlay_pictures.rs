//! The overlay's lines, drawn without a window.

use std::sync::Arc;

use crate::overlays::{cube_triangle, even_row, row, settings, table};
use bvhscope::camera::{Camera, Projection};
use bvhscope::overlay::{
    ContainerSet, DrawInput, NodeTable, OffscreenError, OverlaySettings, PictureInput, Selection, Shown, Viewpoint,
    draw_offscreen, legend, ramp,
};
use bvhscope::section::SectionPlane;
use bvhscope_engine::geometry::{Aabb, Dop14, OrientedBox, OrientedKind, Sphere, Triangle};
use bvhscope_engine::tree::ContainerKind;
use glam::Vec3;

const FAR: f32 = 1e30;

/// The colour that the legend gives to the first depth.
fn brightest_channel(settings: &OverlaySettings, table: &NodeTable) -> u8 {
    let shown = table.shown(settings, &Selection::default(), None);
    ramp(legend(&shown).stops[0].0).into_iter().max().unwrap()
}

/// A picture with the same colour and depth in every pixel.
struct Flat {
    size: [u32; 2],
    rgba: Vec<[u8; 4]>,
    depth: Vec<f32>,
    /// Its colours stand for values.
    is_coded: bool,
    section: Option<SectionPlane>,
}

impl Flat {
    fn new(size: [u32; 2], color: [u8; 4], depth: f32) -> Self {
        let count = (size[0] * size[1]) as usize;
        Self { size, rgba: vec![color; count], depth: vec![depth; count], is_coded: false, section: None }
    }

    fn input(&self) -> PictureInput<'_> {
        PictureInput {
            id: 1,
            width_px: self.size[0],
            height_px: self.size[1],
            coarseness: 1.0,
            rgba: &self.rgba,
            depth: &self.depth,
        }
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
    let viewpoint = Viewpoint { camera, size_px: picture.size, section: None };
    let shown = table.map_or(Shown::NOTHING, |table| table.shown(&settings, selection, Some(&viewpoint)));
    let input = DrawInput {
        picture: picture.input(),
        camera,
        table,
        shown: &Arc::new(shown),
        settings,
        selection,
        show_picture: true,
        section: picture.section,
        neutral_lines: picture.is_coded,
        backdrop: [0.105, 0.11, 0.12, 1.0],
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

/// A coarse picture, shown larger, has no squares: a hard edge becomes a slope without steps, a slope stays one, and what has a
/// single colour keeps it.
#[test]
fn a_coarse_picture_is_enlarged_smoothly() {
    const COARSENESS: u32 = 8;
    let (size, traced) = ([160, 80], [20, 10]);
    let nothing = Selection::default();
    let depth = vec![FAR; (traced[0] * traced[1]) as usize];
    let enlarged = |level: &dyn Fn(u32) -> u8| {
        let row = (0..traced[0]).map(|x| [level(x), level(x), level(x), 255]);
        let rgba: Vec<[u8; 4]> = (0..traced[1]).flat_map(|_| row.clone()).collect();
        let input = DrawInput {
            picture: PictureInput {
                id: 1,
                width_px: traced[0],
                height_px: traced[1],
                coarseness: COARSENESS as f32,
                rgba: &rgba,
                depth: &depth,
            },
            camera: camera(5.0, Projection::Perspective),
            table: None,
            shown: &Arc::new(Shown::NOTHING),
            settings: settings(0, 9),
            selection: &nothing,
            show_picture: true,
            section: None,
            neutral_lines: false,
            backdrop: [0.105, 0.11, 0.12, 1.0],
            viewport_px: [0, 0, size[0], size[1]],
            pixels_per_point: 1.0,
        };
        let drawn = draw_offscreen(&input).unwrap();
        drawn[(size[0] * 40) as usize..(size[0] * 41) as usize].iter().map(|pixel| i32::from(pixel[0])).collect()
    };
    let step = |levels: &[i32]| levels.windows(2).map(|pair| pair[1] - pair[0]).collect::<Vec<_>>();

    let edge: Vec<i32> = enlarged(&|x| if x < 10 { 20 } else { 220 });
    assert_eq!((edge[40], edge[120]), (20, 220));
    // Between two texels lie 8 pixels: interpolation along a line would rise by 25 each.
    let steps = step(&edge);
    assert!(steps.iter().all(|&step| (0..=21).contains(&step)), "{steps:?}");
    let bends = step(&steps).into_iter().map(i32::abs).max().unwrap();
    assert!(bends <= 5, "the slope bends by {bends} at once: {steps:?}");

    let slope: Vec<i32> = enlarged(&|x| (x * 8) as u8);
    assert!(step(&slope[16..144]).iter().all(|&step| (0..=2).contains(&step)), "{slope:?}");
    assert!(enlarged(&|_| 77).iter().all(|&level| level == 77));
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
    let settings = OverlaySettings { line_width: 1.0, ..settings(0, 0) };
    let settings = settings.with_kinds(ContainerSet::of(ContainerKind::Sphere));
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

/// Every edge is where the polytope's faces meet, and there are no others.
#[test]
fn the_edges_of_a_polytope_are_drawn_where_they_are() {
    let rod = Triangle { a: Vec3::new(-1.0, -0.9, -0.4), b: Vec3::new(1.0, 0.7, 0.5), c: Vec3::new(0.9, 0.9, 0.3) };
    let flake = Triangle { a: Vec3::new(-1.0, 0.2, 0.1), b: Vec3::new(0.1, 0.9, -0.8), c: Vec3::new(0.6, -1.0, 0.7) };
    let size = [400, 400];
    let picture = Flat::new(size, [0, 0, 0, 255], FAR);
    let camera = camera(6.0, Projection::Orthographic);
    // Pixels for each unit of length.
    let scale = 200.0 / (6.0 * 0.4_f32.tan());
    for triangles in [vec![rod], vec![flake], vec![rod, flake]] {
        let table = table::<Dop14>(triangles);
        let settings = OverlaySettings { line_width: 1.5, ..settings(0, 0) };
        let drawn = draw(&picture, camera, Some(&table), settings, &Selection::default());
        let lit = |x: f32, y: f32| drawn[y as usize * 400 + x as usize][..3].iter().any(|channel| *channel > 40);
        let edges: Vec<[glam::Vec2; 2]> =
            table.node_dop(0).edges().into_iter().map(|edge| edge.map(|p| p.truncate())).collect();
        let at = |point: glam::Vec2| [200.0 + point.x * scale, 200.0 - point.y * scale];
        for [a, b] in &edges {
            for step in 0..=20 {
                let [x, y] = at(a.lerp(*b, step as f32 / 20.0));
                let is_lit = (-1..=1).any(|dx| (-1..=1).any(|dy| lit(x + dx as f32, y + dy as f32)));
                assert!(is_lit, "a gap at {x}, {y} of {a} to {b}");
            }
        }
        let distance = |point: glam::Vec2| {
            let to_edge = |[a, b]: &[glam::Vec2; 2]| {
                let along = (point - *a).dot(*b - *a) / (*b - *a).length_squared().max(1e-12);
                point.distance(a.lerp(*b, along.clamp(0.0, 1.0)))
            };
            edges.iter().map(to_edge).fold(f32::INFINITY, f32::min) * scale
        };
        for index in (0..160_000).filter(|index| lit((index % 400) as f32, (index / 400) as f32)) {
            let [x, y] = [(index % 400) as f32 + 0.5 - 200.0, 200.0 - (index / 400) as f32 - 0.5];
            let point = glam::Vec2::new(x, y) / scale;
            assert!(distance(point) < 2.5, "a line at {point} where no edge is");
        }
    }
}

/// Every edge is that of the box, and the faces lie between them.
#[test]
fn an_oriented_box_is_drawn_where_it_is() {
    let rod = Triangle { a: Vec3::new(-1.0, -0.9, -0.4), b: Vec3::new(1.0, 0.7, 0.5), c: Vec3::new(0.9, 0.9, 0.3) };
    let flake = Triangle { a: Vec3::new(-1.0, 0.2, 0.1), b: Vec3::new(0.1, 0.9, -0.8), c: Vec3::new(0.6, -1.0, 0.7) };
    let picture = Flat::new([400, 400], [0, 0, 0, 255], FAR);
    let camera = camera(6.0, Projection::Orthographic);
    // Pixels for each unit of length.
    let scale = 200.0 / (6.0 * 0.4_f32.tan());
    for triangle in [rod, flake] {
        let table = table::<OrientedBox>(vec![triangle]);
        assert_eq!(table.node_kind(0), Some(OrientedKind::Fitted));
        let at = table.node_oriented(0).corners().map(|corner| corner.as_vec3().truncate() * scale);
        let draw = |faces: bool| {
            let settings = OverlaySettings { line_width: 1.5, faces, ..settings(0, 0) };
            let drawn = draw(&picture, camera, Some(&table), settings, &Selection::default());
            move |x: f32, y: f32| {
                drawn[y as usize * 400 + x as usize][..3].iter().map(|&channel| u32::from(channel)).sum::<u32>()
            }
        };
        let (lines, filled) = (draw(false), draw(true));
        let pixel = |point: glam::Vec2| [200.0 + point.x, 200.0 - point.y];
        for [a, b] in OrientedBox::EDGES.map(|edge| edge.map(|corner| at[corner])) {
            for step in 0..=20 {
                let [x, y] = pixel(a.lerp(b, step as f32 / 20.0));
                let is_lit = (-1..=1).any(|dx| (-1..=1).any(|dy| lines(x + dx as f32, y + dy as f32) > 60));
                assert!(is_lit, "a gap at {x}, {y} of {a} to {b}");
            }
        }
        let distance = |point: glam::Vec2| {
            let to_edge = |[a, b]: [glam::Vec2; 2]| {
                let along = (point - a).dot(b - a) / (b - a).length_squared().max(1e-12);
                point.distance(a.lerp(b, along.clamp(0.0, 1.0)))
            };
            OrientedBox::EDGES
                .map(|edge| to_edge(edge.map(|corner| at[corner])))
                .into_iter()
                .fold(f32::INFINITY, f32::min)
        };
        let mut inside = 0;
        for index in 0..160_000 {
            let (x, y) = ((index % 400) as f32, (index / 400) as f32);
            let point = glam::Vec2::new(x + 0.5 - 200.0, 200.0 - y - 0.5);
            assert!(distance(point) < 2.5 || lines(x, y) < 60, "a line at {point} where no edge is");
            inside += u32::from(distance(point) > 2.5 && filled(x, y) > 0);
        }
        assert!(inside > 1_000, "the faces are filled: {inside} pixels");
    }
}

#[test]
fn a_selected_node_is_drawn_though_nothing_else_is() {
    let size = [200, 200];
    let picture = Flat::new(size, [0, 0, 0, 255], FAR);
    let table = table::<Aabb>(cube_triangle());
    let selection = Selection { selected: Some(0), hidden: [0].into(), ..Selection::default() };
    let none = settings(0, 0).with_kinds(ContainerSet::NONE);
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
    let settings = settings(0, 9).with_kinds(ContainerKind::OF_PAPER.into_iter().collect());
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
    let picture = Flat { size: [4_000_000, 1], rgba: Vec::new(), depth: Vec::new(), is_coded: false, section: None };
    let nothing = Selection::default();
    let input = DrawInput {
        picture: picture.input(),
        camera: camera(5.0, Projection::Perspective),
        table: None,
        shown: &Arc::new(Shown::NOTHING),
        settings: settings(0, 0),
        selection: &nothing,
        show_picture: true,
        section: None,
        neutral_lines: false,
        backdrop: [0.105, 0.11, 0.12, 1.0],
        viewport_px: [0, 0, 4_000_000, 1],
        pixels_per_point: 1.0,
    };
    match draw_offscreen(&input) {
        Err(OffscreenError::NoAdapter(what)) => assert!(what.contains("mesa-vulkan-drivers")),
        Err(OffscreenError::Device(what)) => assert!(what.contains("4000000×1"), "{what}"),
        Ok(_) => panic!("no driver has textures of four million pixels"),
    }
}

/// Brightest pixel of the lines of a cube of two units at a distance, whose front is `px` pixels wide.
fn brightest_of_cube(px: f32, depth: f32, selection: &Selection) -> u8 {
    let size = [200, 200];
    let picture = Flat::new(size, [0, 0, 0, 255], depth);
    let table = table::<Aabb>(cube_triangle());
    let distance = 200.0 / px / 0.4_f32.tan();
    let settings = OverlaySettings { line_width: 2.0, ..settings(0, 0) };
    let drawn = draw(&picture, camera(distance, Projection::Perspective), Some(&table), settings, selection);
    drawn.iter().map(|[r, g, b, _]| *r.max(g).max(b)).max().unwrap()
}

#[test]
fn small_containers_fade_and_more_so_behind_the_surface() {
    let nothing = Selection::default();
    let [large, medium, small] = [60.0, 18.0, 8.0].map(|px| brightest_of_cube(px, FAR, &nothing));
    assert!(large > medium && medium > small && small > 8, "{large} {medium} {small}");
    let [large_behind, medium_behind] = [60.0, 18.0].map(|px| f32::from(brightest_of_cube(px, 1.0, &nothing)));
    let ratio = f32::from(medium) / f32::from(large);
    assert!(medium_behind < large_behind * ratio, "{medium_behind} of {large_behind} at {ratio}");
    let selected = Selection { selected: Some(0), ..Selection::default() };
    assert!(brightest_of_cube(8.0, FAR, &selected) > 200, "what is selected keeps its strength");
}

#[test]
fn other_containers_are_dimmed_while_one_is_selected() {
    let size = [200, 200];
    let picture = Flat::new(size, [0, 0, 0, 255], FAR);
    let table = table::<Aabb>(row(8));
    let settings = settings(3, 3);
    let camera = Camera {
        eye: Vec3::new(3.0, 0.0, 9.0),
        target: Vec3::new(3.0, 0.0, 0.0),
        ..camera(9.0, Projection::Perspective)
    };
    let leaf = *table.shown(&settings, &Selection::default(), None).nodes.last().unwrap();
    let green = |selected| {
        let drawn = draw(&picture, camera, Some(&table), settings, &Selection { selected, ..Selection::default() });
        drawn.iter().filter(|[r, g, _, _]| g > r).map(|[_, g, ..]| *g).max().unwrap()
    };
    let (free, dimmed) = (f32::from(green(None)), f32::from(green(Some(leaf))));
    assert!((0.4..0.6).contains(&(dimmed / free)), "{dimmed} of {free}");
}

#[test]
fn lines_over_coded_colors_are_white_with_a_dark_edge() {
    let size = [200, 200];
    let table = table::<Aabb>(cube_triangle());
    for grey in [0, 128, 255] {
        let mut picture = Flat::new(size, [grey, grey, grey, 255], FAR);
        picture.is_coded = true;
        let drawn =
            draw(&picture, camera(5.0, Projection::Perspective), Some(&table), settings(0, 0), &Selection::default());
        assert!(drawn.iter().all(|[r, g, b, _]| r == g && g == b), "no colours");
        let profile = column(&drawn, size, 100);
        let (darkest, brightest) = (profile.iter().min().unwrap(), profile.iter().max().unwrap());
        assert!(brightest - darkest > 100, "{darkest} to {brightest} on {grey}");
    }
}

#[test]
fn dots_stand_for_many_small_containers() {
    let size = [300, 200];
    let picture = Flat::new(size, [0, 0, 0, 255], FAR);
    let table = table::<Aabb>(even_row(2_048));
    let target = Vec3::new(2_048.0, 0.0, 0.0);
    let camera = Camera { eye: target + Vec3::Z * 3_000.0, target, ..camera(1.0, Projection::Perspective) };
    let leaves = OverlaySettings { leaves_only: true, ..settings(0, 99) };
    let viewpoint = Viewpoint { camera, size_px: size, section: None };
    let inner = OverlaySettings { leaves_only: false, ..leaves };
    let shown = table.shown(&inner, &Selection::default(), Some(&viewpoint));
    assert!(shown.outlined < 200 && shown.nodes.len() == 4_095);
    let drawn = draw(&picture, camera, Some(&table), inner, &Selection::default());
    let lit = (0..size[0]).filter(|&x| column(&drawn, size, x).into_iter().any(|value| value > 40)).count();
    assert!(lit > 200, "the row crosses the picture: {lit} columns");
}

#[test]
fn a_section_plane_cuts_boxes_and_spheres() {
    let size = [200, 200];
    let mut picture = Flat::new(size, [0, 0, 0, 255], FAR);
    let camera = camera(6.0, Projection::Perspective);
    let lit = |pixels: &[[u8; 4]], columns: std::ops::Range<usize>| {
        let of_columns = pixels.iter().enumerate().filter(|(index, _)| columns.contains(&(index % 200)));
        of_columns.filter(|(_, [r, g, b, _])| *r.max(g).max(b) > 20).count()
    };
    let settings = OverlaySettings { faces: true, ..settings(0, 0) };
    for (kind, table) in [("box", table::<Aabb>(cube_triangle())), ("sphere", table::<Sphere>(cube_triangle()))] {
        for (flipped, kept, cut) in [(false, 0..98, 103..200), (true, 103..200, 0..98)] {
            picture.section = Some(SectionPlane { normal: Vec3::X, offset: 0.0, flipped });
            let drawn = draw(&picture, camera, Some(&table), settings, &Selection::default());
            assert!(lit(&drawn, kept) > 100, "{kind}: the kept half is drawn");
            assert_eq!(lit(&drawn, cut), 0, "{kind}: nothing is drawn beyond the plane");
        }
    }
}

#[test]
fn faces_fill_the_sides_towards_the_viewer() {
    let size = [200, 200];
    let picture = Flat::new(size, [0, 0, 0, 255], FAR);
    for (kind, table) in [("box", table::<Aabb>(cube_triangle())), ("sphere", table::<Sphere>(cube_triangle()))] {
        let center = table.node_sphere(0).center;
        let mut camera = camera(6.0, Projection::Perspective);
        camera.eye += center;
        camera.target += center;
        let middle = |faces, depth| {
            let picture = Flat { depth: vec![depth; picture.depth.len()], ..Flat::new(size, [0, 0, 0, 255], FAR) };
            let settings = OverlaySettings { faces, ..settings(0, 0) };
            let drawn = draw(&picture, camera, Some(&table), settings, &Selection::default());
            // Beside the great circles, which cross in the middle.
            drawn[112 * 200 + 112][1]
        };
        assert_eq!(middle(false, FAR), 0, "{kind}");
        assert!((4..40).contains(&middle(true, FAR)), "{kind}: {}", middle(true, FAR));
        assert_eq!(middle(true, 1.0), 0, "{kind}: behind the surface");
    }
}

/// Two crossed bars: their containers have a middle in common, which is filled through the surface while the root is selected.
#[test]
fn the_overlap_of_the_children_is_filled_through_the_surface() {
    let size = [200, 200];
    let bar = |along: Vec3, across: Vec3| Triangle {
        a: -along - across * 0.3,
        b: along - across * 0.3,
        c: along + across * 0.3,
    };
    let bars = || vec![bar(Vec3::X, Vec3::Y), bar(Vec3::Y, Vec3::X)];
    let camera = camera(5.0, Projection::Perspective);
    for (kind, table) in [("box", table::<Aabb>(bars())), ("sphere", table::<Sphere>(bars()))] {
        assert!(!table.children(0).is_empty(), "{kind}: one bar a leaf");
        let filled = |overlap, selected, depth| {
            let picture = Flat::new(size, [0, 0, 0, 255], depth);
            let settings = OverlaySettings { overlap, hidden_alpha: 0.0, ..settings(9, 9) };
            let selection = Selection { selected, ..Selection::default() };
            let drawn = draw(&picture, camera, Some(&table), settings, &selection);
            // Left of and below the middle, beside the lines, and in the corner of a box that only one bar has.
            [drawn[108 * 200 + 96], drawn[100 * 200 + 140]].map(|[r, g, _, _]| r > 40 && r > g + 20)
        };
        let [middle, arm] = filled(true, Some(0), FAR);
        assert!(middle, "{kind}: the middle is filled");
        assert_eq!(arm, kind == "sphere", "{kind}: spheres around crossed bars have nearly all in common");
        assert!(filled(true, Some(0), 1.0)[0], "{kind}: seen through the surface");
        assert!(!filled(false, Some(0), FAR)[0], "{kind}: only where it is wanted");
        assert!(!filled(true, Some(1), FAR)[0] && !filled(true, None, FAR)[0], "{kind}: a leaf has no children");
    }
}

/// Two bars askew, whose boxes cross in a square that stands on a corner.
#[test]
fn the_overlap_of_oriented_children_is_what_both_hold() {
    let bar = |along: Vec3, across: Vec3| Triangle { a: -along, b: along, c: across * 0.3 };
    let (u, v) = (Vec3::new(1.0, 1.0, 0.0).normalize(), Vec3::new(-1.0, 1.0, 0.0).normalize());
    let table = table::<OrientedBox>(vec![bar(u, v), bar(v, u)]);
    assert!(table.children(0).all(|child| table.node_kind(child) != Some(OrientedKind::Plain)));
    let filled = |x: usize, y: usize| {
        let picture = Flat::new([200, 200], [0, 0, 0, 255], FAR);
        let settings = OverlaySettings { overlap: true, hidden_alpha: 0.0, ..settings(9, 9) };
        let selection = Selection { selected: Some(0), ..Selection::default() };
        let drawn = draw(&picture, camera(2.0, Projection::Perspective), Some(&table), settings, &selection);
        let [r, g, _, _] = drawn[y * 200 + x];
        r > 40 && r > g + 20
    };
    // The square has its corners at (100, 100), (125, 75), (100, 50) and (75, 75).
    for (x, y) in [(100, 92), (108, 75), (92, 75), (100, 58)] {
        assert!(filled(x, y), "({x}, {y}) lies in both");
    }
    for (x, y) in [(120, 94), (80, 94), (120, 56), (80, 56)] {
        assert!(!filled(x, y), "({x}, {y}) lies in the box around it alone");
    }
}
