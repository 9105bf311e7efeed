//! Polygons of OBJ and PLY: their area against the shoelace formula, their order, their attributes.

use std::f64::consts::TAU;
use std::path::Path;

use bvhscope::scene::{LoadError, LoadOptions, Scene, load_bytes};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::Triangle;
use glam::{DVec2, DVec3, Vec2};

use crate::random::Random;

type Outline = Vec<[f64; 2]>;

/// Outlines with their names, turning to the left.
fn outlines() -> Vec<(&'static str, Outline)> {
    let round = |count: usize, radius: &dyn Fn(usize) -> f64| -> Outline {
        let corner = |k: usize| (DVec2::from_angle(k as f64 / count as f64 * TAU) * radius(k)).to_array();
        (0..count).map(corner).collect()
    };
    let mut random = Random(0x9017);
    let rough: Vec<f64> = (0..60).map(|_| 0.2 + random.below(1000) as f64 / 500.0).collect();
    let comb =
        (0..9).flat_map(|k| [[k as f64, 0.0], [k as f64 + 0.5, 3.0]]).chain([[9.0, 0.0], [9.0, -1.0], [0.0, -1.0]]);
    let arm = |k: usize, r: f64| (DVec2::from_angle(k as f64 * 0.3) * (r + 0.1 * k as f64)).to_array();
    let spiral = (0..60).map(|k| arm(k, 1.4)).chain((0..60).map(|k| arm(k, 1.0)).rev());
    let window = |x: f64| [[x, 1.0], [x, 2.0], [x + 1.0, 2.0], [x + 1.0, 1.0], [x, 1.0]];
    let one = [[0.0, 0.0]].into_iter().chain(window(1.0)).chain([[0.0, 0.0], [6.0, 0.0], [6.0, 3.0], [0.0, 3.0]]);
    let two = [[0.0, 0.0]].into_iter().chain(window(1.0)).chain([[0.0, 0.0]]).chain(window(3.0));
    let two = two.chain([[0.0, 0.0], [6.0, 0.0], [6.0, 3.0], [0.0, 3.0]]);
    let chained =
        [[0.0, 0.0], [1.0, 1.0], [1.0, 2.0], [2.0, 2.0], [3.0, 1.0], [3.0, 2.0], [4.0, 2.0], [4.0, 1.0], [3.0, 1.0]];
    let chained =
        chained.into_iter().chain([[2.0, 2.0], [2.0, 1.0], [1.0, 1.0], [0.0, 0.0], [6.0, 0.0], [6.0, 3.0], [0.0, 3.0]]);
    let inner = round(16, &|_| 0.5).into_iter().rev().cycle().skip(15).take(17);
    let ring = round(16, &|_| 1.0).into_iter().chain([[1.0, 0.0]]).chain(inner);
    vec![
        ("u", vec![[0., 0.], [3., 0.], [3., 3.], [2., 3.], [2., 1.], [1., 1.], [1., 3.], [0., 3.]]),
        ("dart", vec![[0., 0.], [2., 1.], [0., 2.], [0.5, 1.]]),
        ("l", vec![[0., 0.], [3., 0.], [3., 1.], [1., 1.], [1., 4.], [0., 4.]]),
        ("t", vec![[0., 0.], [1., 0.], [1., 2.], [2., 2.], [2., 3.], [-1., 3.], [-1., 2.], [0., 2.]]),
        (
            "plus",
            vec![
                [1., 0.],
                [2., 0.],
                [2., 1.],
                [3., 1.],
                [3., 2.],
                [2., 2.],
                [2., 3.],
                [1., 3.],
                [1., 2.],
                [0., 2.],
                [0., 1.],
                [1., 1.],
            ],
        ),
        (
            "e",
            vec![
                [0., 0.],
                [3., 0.],
                [3., 1.],
                [1., 1.],
                [1., 2.],
                [2., 2.],
                [2., 3.],
                [1., 3.],
                [1., 4.],
                [3., 4.],
                [3., 5.],
                [0., 5.],
            ],
        ),
        ("square", vec![[0., 0.], [1., 0.], [1., 1.], [0., 1.]]),
        ("hexagon", round(6, &|_| 2.0)),
        ("circle", round(100, &|_| 3.0)),
        ("corners on edges", vec![[0., 0.], [1., 0.], [2., 0.], [2., 2.], [1., 2.], [0., 2.], [0., 1.]]),
        ("corners twice", vec![[0., 0.], [3., 0.], [3., 0.], [3., 3.], [1., 1.], [1., 1.], [0., 3.]]),
        ("star", round(10, &|k| if k % 2 == 0 { 2.0 } else { 0.5 })),
        ("rough", round(60, &|k| rough[k])),
        ("pie", [[0.0, 0.0]].into_iter().chain(round(40, &|_| 1.0).into_iter().take(34)).collect()),
        ("crack", vec![[0., 0.], [10., 0.], [10., 10.], [5.001, 10.], [5., 0.5], [4.999, 10.], [0., 10.]]),
        ("comb", comb.rev().collect()),
        ("spiral", spiral.collect()),
        ("window", one.collect()),
        ("two windows", two.collect()),
        ("window beyond a window", chained.collect()),
        ("ring", ring.collect()),
    ]
}

/// Area by the shoelace formula.
fn shoelace(outline: &[[f64; 2]]) -> f64 {
    let next = outline.iter().cycle().skip(1);
    outline.iter().zip(next).map(|(a, b)| (a[0] * b[1] - a[1] * b[0]) / 2.0).sum()
}

/// Outline in space, in a plane with a normal other than any axis, and the normal.
fn in_space(outline: &[[f64; 2]]) -> (Vec<DVec3>, DVec3) {
    let normal = DVec3::new(1.0, -2.0, 4.0).normalize();
    let (u, v) = normal.any_orthonormal_pair();
    (outline.iter().map(|p| DVec3::new(5.0, 6.0, 7.0) + p[0] * u + p[1] * v).collect(), u.cross(v))
}

fn load(name: &str, text: &str) -> Scene {
    load_bytes(Path::new(name), text.as_bytes(), &LoadOptions::default(), &CancelToken::new()).unwrap()
}

/// The polygon as OBJ and as PLY, whose faces come first or last.
fn files(corners: &[DVec3]) -> [(&'static str, String); 3] {
    let points: Vec<String> = corners.iter().map(|p| format!("{} {} {}\n", p.x, p.y, p.z)).collect();
    let indices: String = (0..corners.len()).map(|k| format!(" {k}")).collect();
    let from_one: String = (1..=corners.len()).map(|k| format!(" {k}")).collect();
    let vertex = format!("element vertex {}\nproperty double x\nproperty double y\nproperty double z\n", corners.len());
    let face = "element face 1\nproperty list int int vertex_indices\n";
    let list = format!("{}{indices}\n", corners.len());
    let ply = |header: &[&str], data: &[&str]| {
        format!("ply\nformat ascii 1.0\n{}end_header\n{}", header.concat(), data.concat())
    };
    [
        ("a.obj", format!("v {}f{from_one}\n", points.join("v "))),
        ("a.ply", ply(&[&vertex, face], &[&points.concat(), &list])),
        ("b.ply", ply(&[face, &vertex], &[&list, &points.concat()])),
    ]
}

/// Area of the triangles along `normal`: each must turn as the polygon does.
fn area_along(triangles: &[Triangle], normal: DVec3, what: &str) -> f64 {
    let areas = triangles.iter().map(|t| {
        let [a, b, c] = [t.a, t.b, t.c].map(|corner| corner.as_dvec3());
        (b - a).cross(c - a).dot(normal) / 2.0
    });
    areas.inspect(|area| assert!(*area > -1e-5, "{what}: turned by {area}")).sum()
}

#[test]
fn twenty_polygons_have_their_area_from_every_corner() {
    let outlines = outlines();
    assert!(outlines.len() >= 20);
    for (name, outline) in outlines {
        let area = shoelace(&outline);
        assert!(area > 0.0, "{name} turns to the right");
        for start in 0..outline.len() {
            let mut turned = outline.clone();
            turned.rotate_left(start);
            let (mut corners, mut normal) = in_space(&turned);
            if start % 2 == 1 {
                corners.reverse();
                normal = -normal;
            }
            for (file, text) in files(&corners) {
                let scene = load(file, &text);
                let what = format!("{name} from corner {start} in {file}");
                assert!(scene.warnings.is_empty(), "{what}: {:?}", scene.warnings);
                let found = area_along(&scene.triangles, normal, &what);
                assert!((found - area).abs() < 2e-5 * area.max(1.0), "{what}: {found} instead of {area}");
                // Two corners in one place may make none.
                let missing = corners.len() - 2 - scene.triangles.len();
                assert!(missing == 0 || name == "corners twice" && missing < 3, "{what}: {missing}");
                if file == "b.ply" && start > 4 {
                    break;
                }
            }
        }
    }
}

#[test]
fn areas_are_those_of_the_cases() {
    let wall: Outline = outlines().into_iter().find(|(name, _)| *name == "window").unwrap().1;
    for (outline, area) in [(outlines()[0].1.clone(), 7.0), (outlines()[1].1.clone(), 1.5), (wall, 17.0)] {
        let (corners, normal) = in_space(&outline);
        for (file, text) in files(&corners) {
            let found = area_along(&load(file, &text).triangles, normal, file);
            assert!((found - area).abs() < 1e-4, "{file}: {found} instead of {area}");
        }
    }
}

#[test]
fn fans_are_kept_where_they_are_valid() {
    // A dart whose dent is the first corner is a fan, too.
    for outline in [&outlines()[7].1, &vec![[0.5, 1.0], [0.0, 0.0], [2.0, 1.0], [0.0, 2.0]]] {
        let corners: Vec<DVec3> = outline.iter().map(|p| DVec3::new(p[0], p[1], 0.0)).collect();
        for (file, text) in files(&corners) {
            let scene = load(file, &text);
            let fan = (2..corners.len()).map(|k| [0, k - 1, k].map(|corner: usize| corners[corner].as_vec3()));
            let found: Vec<_> = scene.triangles.iter().map(|t| [t.a, t.b, t.c]).collect();
            assert_eq!(found, fan.collect::<Vec<_>>(), "{file}");
        }
    }
}

#[test]
fn corners_of_ears_keep_their_attributes() {
    let outline = &outlines()[0].1;
    let mut text = String::new();
    for [x, y] in outline {
        text += &format!("v {x} {y} 0 {} 0 {}\nvt {x} {y}\nvn {x} {y} 1\n", x / 8.0, y / 8.0);
    }
    let scene = load("a.obj", &(text + "f 1/1/1 2/2/2 3/3/3 4/4/4 5/5/5 6/6/6 7/7/7 8/8/8\n"));
    let attributes = scene.attributes.as_ref().unwrap();
    assert_eq!(scene.triangles.len(), 6);
    for (triangle, corners) in scene.triangles.iter().zip(attributes.corners.iter()) {
        for (point, &vertex) in [triangle.a, triangle.b, triangle.c].into_iter().zip(corners) {
            assert_eq!(attributes.uvs[vertex as usize], Vec2::new(point.x, 1.0 - point.y));
            let normal = attributes.normals[vertex as usize];
            assert!((normal / normal.z - point.with_z(1.0)).length() < 1e-5);
            assert_eq!(attributes.colors[vertex as usize].y, 0.0);
        }
    }
}

/// Sum of the areas of all triangles.
fn area(scene: &Scene) -> f32 {
    scene.triangles.iter().map(|triangle| (triangle.b - triangle.a).cross(triangle.c - triangle.a).length() * 0.5).sum()
}

#[test]
fn edges_that_run_back_over_a_corner_enclose_nothing() {
    // The last edge of the first runs over its second corner; the others have a spike outside, inside and across their first corner.
    let back: Outline = vec![[4., 4.], [4., 3.], [0., 1.], [2., 1.], [4., 2.]];
    let outside: Outline = vec![[0., 0.], [2., 0.], [2., 1.], [5., 1.], [2., 1.], [2., 2.], [1., 1.], [0., 2.]];
    let inside: Outline = vec![[0., 0.], [4., 0.], [4., 4.], [2., 4.], [2., 2.], [2., 4.], [0., 4.], [1., 2.]];
    let twice: Outline = vec![[9., 0.], [4., 0.], [4., 3.], [2., 1.], [0., 3.], [0., 0.], [4., 0.], [7., 0.]];
    for (outline, expected) in [(back, 3.0), (outside, 3.0), (inside, 14.0), (twice, 8.0)] {
        for start in 0..outline.len() {
            let mut turned = outline.clone();
            turned.rotate_left(start);
            for (file, text) in files(&in_space(&turned).0) {
                let scene = load(file, &text);
                assert!(scene.warnings.is_empty(), "{file}: {turned:?}: {:?}", scene.warnings);
                assert!((area(&scene) - expected).abs() < 1e-3, "{file}: {turned:?}: {} for {expected}", area(&scene));
            }
        }
    }
}

#[test]
fn polygons_of_too_many_corners_are_left_out_and_not_shown_as_another_shape() {
    // A comb, and a circle, which needs no search.
    let comb = |corners: usize| -> Outline {
        let half = corners / 2;
        let teeth = (0..half).rev().map(|k| [k as f64, if k % 2 == 0 { 10.0 } else { 1.0 }]);
        (0..half).map(|k| [k as f64, 0.0]).chain(teeth).collect()
    };
    let flat = |outline: &Outline| {
        let mut text: String = outline.iter().map(|[x, y]| format!("v {x} {y} 0\n")).collect();
        text += "f";
        (1..=outline.len()).for_each(|corner| text += &format!(" {corner}"));
        text + "\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\n"
    };
    let scene = load("a.obj", &flat(&comb(32_770)));
    assert_eq!(scene.triangles.len(), 1);
    let warning = scene.warnings.entries[0].to_string();
    assert_eq!(warning, "1 face with a dent left out: more than 32768 corners (first at line 32771)");
    let circle: Outline = (0..40_000).map(|k| DVec2::from_angle(k as f64 / 40_000.0 * TAU).to_array()).collect();
    let scene = load("a.obj", &flat(&circle));
    assert!(scene.warnings.is_empty() && scene.triangles.len() == 39_999, "{:?}", scene.warnings);
    let scene = load("a.obj", &flat(&comb(2_000)));
    assert!(
        scene.warnings.is_empty() && (f64::from(area(&scene)) - 0.5 - shoelace(&comb(2_000)).abs()).abs() < 1.0,
        "{}",
        area(&scene)
    );
}

#[test]
fn polygons_that_cross_themselves_are_counted() {
    let pentagram: Outline = (0..5).map(|k| DVec2::from_angle(k as f64 * 2.0 / 5.0 * TAU).to_array()).collect();
    for outline in [vec![[0., 0.], [2., 2.], [2., 0.], [0., 1.]], pentagram] {
        for (file, text) in files(&in_space(&outline).0) {
            let scene = load(file, &text);
            assert!(!scene.triangles.is_empty());
            let what: Vec<_> = scene.warnings.entries.iter().map(|entry| (entry.what.as_str(), entry.count)).collect();
            assert_eq!(what, [("faces that cross themselves, whose triangles overlap", 1)], "{file}: {outline:?}");
        }
    }
    // All corners on a line, or in one place: nothing to cut.
    for outline in [vec![[0., 0.], [1., 1.], [3., 3.], [2., 2.]], vec![[1., 1.]; 6]] {
        for (file, text) in files(&in_space(&outline).0) {
            assert_eq!(load(file, &text).triangles.len(), outline.len() - 2, "{file}");
        }
    }
}

#[test]
fn long_polygons_are_cut_on_a_thread_that_cancelling_leaves() {
    // Few places, visited again and again: the search for ears takes minutes.
    let places = [[0.0, 0.0], [1.0, 0.0], [0.3, 0.3], [0.0, 1.0]];
    let outline: Outline = (0..16_000).map(|k| places[(k + 1) % 4]).collect();
    for (file, text) in files(&in_space(&outline).0).into_iter().take(2) {
        let token = CancelToken::watched(|poll| poll == 60);
        let result = load_bytes(Path::new(file), text.as_bytes(), &LoadOptions::default(), &token);
        assert!(matches!(result, Err(LoadError::Cancelled(_))), "{file}");
    }
    let comb = (0..4_000).flat_map(|k| [[k as f64, 0.0], [k as f64 + 0.5, 3.0]]).chain([
        [4000.0, 0.0],
        [4000.0, -1.0],
        [0.0, -1.0],
    ]);
    let comb: Outline = comb.rev().collect();
    let (corners, normal) = in_space(&comb);
    let scene = load("a.obj", &files(&corners)[0].1);
    let found = area_along(&scene.triangles, normal, "comb");
    assert!((found / shoelace(&comb) - 1.0).abs() < 1e-3, "{found}");
    // Beyond what is cut: left out, counted.
    let zigzag: Outline = (0..33_000).map(|k| [k as f64, (k % 2 * 5) as f64]).chain([[0.0, -9.0]]).rev().collect();
    let text = &files(&in_space(&zigzag).0)[0].1;
    let refused = load_bytes(Path::new("a.obj"), text.as_bytes(), &LoadOptions::default(), &CancelToken::new());
    let message = refused.unwrap_err().to_string();
    assert!(message.contains("1 face with a dent left out: more than 32768 corners"), "{message}");
}
