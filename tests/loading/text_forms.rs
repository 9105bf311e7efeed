//! Forms of text that other programs write: numbers that are none, marks of encodings, commas, words without lines.

use std::path::Path;

use bvhscope::scene::{LoadOptions, Scene, load_bytes};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::Triangle;

fn try_load(name: &str, bytes: &[u8]) -> Result<Scene, String> {
    load_bytes(Path::new(name), bytes, &LoadOptions::default(), &CancelToken::new()).map_err(|error| error.to_string())
}

fn load(name: &str, bytes: impl AsRef<[u8]>) -> Scene {
    try_load(name, bytes.as_ref()).unwrap()
}

const STL: &str = "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid x\n";
const HEADER: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                      element face 1\nproperty list uchar int vertex_indices\nend_header\n";

#[test]
fn windows_spellings_of_no_number_are_skipped_and_counted() {
    let two_facets =
        |word: &str| STL.replace("endsolid x\n", "") + &STL[8..].replace("vertex 1 0 0", &format!("vertex {word} 0 0"));
    let header = HEADER.replace("vertex 3", "vertex 4").replace("face 1", "face 2");
    for word in
        ["-nan(ind)", "nan(ind)", "-1.#IND", "1.#QNAN", "1.#INF", "-1.#INF", "1.#SNAN", "-1.#IND000", "nan", "-inf"]
    {
        let files = [
            ("a.obj", format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nv {word} 0 0\nf 1 2 3\nf 1 2 4\n")),
            ("a.ply", format!("{header}0 0 0\n1 0 0\n0 1 0\n{word} 0 0\n3 0 1 2\n3 0 1 3\n")),
            ("a.stl", two_facets(word)),
        ];
        for (name, text) in files {
            let scene = load(name, &text);
            assert_eq!(
                (scene.triangles.len(), scene.warnings.entries.len()),
                (1, 1),
                "{word} in {name}: {:?}",
                scene.warnings
            );
            assert!(
                scene.warnings.entries[0].what.contains("coordinates that are not numbers"),
                "{:?}",
                scene.warnings
            );
        }
    }
    let normals = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn -nan(ind) -nan(ind) -nan(ind)\nvn 0 0 1\nf 1//2 2//2 3//2\n";
    let scene = load("vn.obj", normals);
    assert_eq!((scene.triangles.len(), scene.warnings.entries[0].count), (1, 1));
}

#[test]
fn a_byte_order_mark_may_stand_before_the_data() {
    let bom = "\u{feff}";
    let data = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (name, text) in [
        ("a.ply", format!("{HEADER}{bom}{data}")),
        ("b.ply", format!("{bom}{HEADER}{data}")),
        ("c.ply", format!("{bom}{}{bom}{data}", HEADER.replace('\n', "\r\n"))),
        ("a.obj", format!("{bom}{obj}{bom}f 1 2 3\n")),
        ("b.obj", format!("{obj}{bom}{bom}# parts\nf 1 2 3\n").replacen(&format!("{bom}{bom}"), bom, 1)),
        ("a.stl", format!("{bom}{STL}")),
    ] {
        let scene = load(name, &text);
        assert_eq!((scene.triangles.len(), scene.warnings.is_empty()), (1, true), "{name}: {:?}", scene.warnings);
    }
    let two = load("b.stl", format!("{bom}{STL}{bom}{STL}"));
    assert_eq!((two.triangles.len(), two.mesh_count, two.warnings.is_empty()), (2, 2, true), "{:?}", two.warnings);
    // Elsewhere it is shown as its code.
    let message = try_load("a.obj", format!("v 0 {bom}0 0\n").as_bytes()).unwrap_err();
    assert!(message.contains("'\\u{feff}0' is not a number"), "{message}");
}

#[test]
fn commas_between_numbers_are_named() {
    let stl = |word: &str| STL.replace("vertex 1 0 0", &format!("vertex {word} 0 0"));
    for (name, text, advice) in [
        ("a.obj", "v 0, 0, 0\nv 1, 0, 0\n".to_owned(), "take out the commas"),
        ("b.obj", "v 0,5 0 0\n".to_owned(), "decimals with a point"),
        ("a.stl", stl("0,5"), "decimals with a point"),
        ("b.stl", stl("1,"), "take out the commas"),
        ("a.ply", format!("{HEADER}0, 0, 0\n1 0 0\n0 1 0\n3 0 1 2\n"), "take out the commas"),
        ("b.ply", format!("{HEADER}0,5 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"), "decimals with a point"),
    ] {
        let message = try_load(name, text.as_bytes()).unwrap_err();
        assert!(message.contains(advice), "{message}");
    }
}

#[test]
fn stl_is_words_rather_than_lines() {
    let facet = "facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 endloop endfacet";
    for (text, triangles) in [
        (format!("solid x\n{facet}\n{facet}\nendsolid x\n"), 2),
        (STL.replace("\nvertex", " vertex"), 1),
        (format!("solid x y {facet} {facet} endsolid x y"), 2),
        (format!("solid {facet} endsolid"), 1),
        (STL.replace(' ', "\n").replacen("solid\nx", "solid x", 1).replace("endsolid\nx", "endsolid x"), 1),
        (STL.replace(' ', "\t ").replace('\n', "\r\n"), 1),
        (STL.replace('\n', "\r"), 1),
        (STL.to_uppercase().replace("0 0 1\n", "0 0 1 "), 1),
        (STL.replace("normal 0 0 1", "normal -nan(ind) x y"), 1),
        (STL.replace("solid x", "solid a facet of vertex 1 2 3"), 1),
        // Written in blocks, or by programs that end texts with Ctrl-Z.
        (STL.replacen("solid x", &format!("solid x{}", "\0".repeat(73)), 1), 1),
        (format!("{STL}{}", "\0".repeat(512)), 1),
        (format!("{STL}\u{1a}"), 1),
        (format!("{}{}", STL.replace('\n', "\n\0"), "\u{1a}".repeat(300)), 1),
    ] {
        let scene = load("a.stl", &text);
        assert_eq!(
            (scene.triangles.len(), scene.warnings.is_empty()),
            (triangles, true),
            "{text}: {:?}",
            scene.warnings
        );
        assert_eq!(scene.bounds.max, glam::Vec3::new(1.0, 1.0, 0.0), "{text}");
    }
    for comment in ["# made by a program\n", "#\r\n # solid\r\n", "\u{feff}#a\n#b\n"] {
        let scene = load("a.stl", format!("{comment}{STL}"));
        let what: Vec<&str> = scene.warnings.entries.iter().map(|entry| entry.what.as_str()).collect();
        assert_eq!(
            (scene.triangles.len(), &what[..]),
            (1, &["lines without an STL statement skipped"][..]),
            "{comment}"
        );
    }
    let message = try_load("a.stl", STL.replace("vertex 1 0 0", "vertex 1 0").as_bytes()).unwrap_err();
    assert!(message.contains("a.stl:5: a 'vertex' needs 3 numbers, but there are 2"), "{message}");
    // White space without end is passed over.
    let scene = load("a.stl", STL.replace("vertex 1", &format!("vertex{}1", " \n".repeat(10_000))));
    assert_eq!(scene.triangles.len(), 1);
}

/// A binary PLY file of a triangle whose lines of the header end in `line` and the last in `last`, with x of the first corner.
fn binary_ply(line: &str, last: &str, x: f32) -> Vec<u8> {
    let header = HEADER.replace("ascii", "binary_little_endian").replace('\n', line);
    let mut bytes = header.strip_suffix(line).unwrap().as_bytes().to_vec();
    bytes.extend(last.as_bytes());
    for value in [x, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
        bytes.extend(value.to_le_bytes());
    }
    bytes.push(3);
    bytes.extend([0_i32, 1, 2].iter().flat_map(|index| index.to_le_bytes()));
    bytes
}

#[test]
fn the_last_line_of_a_ply_header_ends_as_it_likes() {
    // Data that begin with a line feed, as those of the second number do, are no part of the header.
    for x in [2.0, f32::from_le_bytes([b'\n', 0, 0, 0x3f])] {
        for (line, last) in [("\n", "\n"), ("\n", "\r\n"), ("\r\n", "\r\n"), ("\r\n", "\n"), ("\r", "\r")] {
            let scene = load("a.ply", binary_ply(line, last, x));
            let expected = Triangle { a: glam::Vec3::new(x, 0.0, 0.0), b: glam::Vec3::X, c: glam::Vec3::Y };
            assert_eq!(scene.triangles, [expected], "{line:?} {last:?}");
            assert!(scene.warnings.is_empty(), "{line:?} {last:?}: {:?}", scene.warnings);
        }
    }
}

#[test]
fn decimals_far_from_the_origin_are_kept() {
    // A wall of 4 by 0.1 by 2.5 in UTM coordinates.
    let corners: Vec<[f64; 3]> = (0..8)
        .map(|k| {
            [408_201.58 + [0.0, 4.0, 4.0, 0.0][k % 4], 4_080_928.0 + 0.1 * (k / 4) as f64, [0.0, 0.0, 2.5, 2.5][k % 4]]
        })
        .collect();
    let quads = [[0, 1, 2, 3], [7, 6, 5, 4], [0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]];
    let point = |p: [f64; 3]| format!("{:.2} {:.2} {:.2}", p[0], p[1], p[2]);
    let obj: String = corners.iter().map(|&p| format!("v {}\n", point(p))).collect();
    let faces: String =
        quads.iter().map(|q| format!("f {} {} {} {}\n", q[0] + 1, q[1] + 1, q[2] + 1, q[3] + 1)).collect();
    let header = HEADER.replace("vertex 3", "vertex 8").replace("face 1", "face 6").replace("float", "double");
    let points: String = corners.iter().map(|&p| point(p) + "\n").collect();
    let lists: String = quads.iter().map(|q| format!("4 {} {} {} {}\n", q[0], q[1], q[2], q[3])).collect();
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    let stl: String = triangles
        .map(|t| {
            let [a, b, c] = t.map(|k: usize| point(corners[k]));
            format!("facet normal 0 0 0\nouter loop\nvertex {a}\nvertex {b}\nvertex {c}\nendloop\nendfacet\n")
        })
        .collect();
    let mut binary = header.replace("ascii", "binary_big_endian").into_bytes();
    corners.iter().flatten().for_each(|x| binary.extend(x.to_be_bytes()));
    for quad in quads {
        binary.push(4);
        quad.iter().for_each(|&k| binary.extend((k as i32).to_be_bytes()));
    }
    for (name, bytes) in [
        ("a.obj", (obj + &faces).into_bytes()),
        ("a.ply", format!("{header}{points}{lists}").into_bytes()),
        ("b.ply", binary),
        ("a.stl", format!("solid wall\n{stl}endsolid wall\n").into_bytes()),
    ] {
        let scene = load(name, &bytes);
        let area: f32 = scene.triangles.iter().map(|t| (t.b - t.a).cross(t.c - t.a).length() / 2.0).sum();
        assert!((area - 21.3).abs() < 1e-4, "{name}: {area}");
        assert_eq!((scene.triangles.len(), scene.offset.z, scene.warnings.is_empty()), (12, 0.0, true), "{name}");
        let min = scene.in_file(scene.bounds.min);
        assert!((min - glam::DVec3::new(408_201.58, 4_080_928.0, 0.0)).length() < 1e-6, "{name}: {min}");
    }
    // Near the origin nothing is moved.
    assert_eq!(load("a.obj", "v 10 0 0\nv 11 0 0\nv 10 1 0\nf 1 2 3\n").offset, glam::DVec3::ZERO);
}
