//! PLY and STL: exact coordinates, colours and winding for each type of number and each encoding.

use std::path::Path;

use bvhscope::scene::{LoadOptions, Scene, load_bytes};
use bvhscope_engine::cancel::CancelToken;
use glam::Vec3;

fn load(name: &str, bytes: &[u8]) -> Scene {
    let scene = load_bytes(Path::new(name), bytes, &LoadOptions::default(), &CancelToken::new()).unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    scene
}

/// A number as it is written in a type and encoding.
fn written(number: i32, name: &str, encoding: &str) -> Vec<u8> {
    macro_rules! put {
        ($type:ty) => {
            match encoding {
                "ascii" => format!("{number} ").into_bytes(),
                "binary_big_endian" => (number as $type).to_be_bytes().to_vec(),
                _ => (number as $type).to_le_bytes().to_vec(),
            }
        };
    }
    match name {
        "char" | "int8" => put!(i8),
        "uchar" | "uint8" => put!(u8),
        "short" | "int16" => put!(i16),
        "ushort" | "uint16" => put!(u16),
        "int" | "int32" => put!(i32),
        "uint" | "uint32" => put!(u32),
        "int64" => put!(i64),
        "uint64" => put!(u64),
        "float" | "float32" => put!(f32),
        _ => put!(f64),
    }
}

/// A number with which each byte order gives another value in every type.
const CORNERS: [[i32; 3]; 3] = [[1, 2, 3], [100, 2, 3], [1, 90, 3]];

#[test]
fn every_number_type_is_read_in_every_encoding() {
    let types = ["char", "uchar", "short", "ushort", "int", "uint", "float", "double", "int64", "uint64"];
    let sized = ["int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64", "int64", "uint64"];
    for (name, sized) in types.iter().zip(sized) {
        for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
            for name in [name, sized] {
                let mut bytes = format!(
                    "ply\nformat {encoding} 1.0\nelement vertex 3\nproperty {name} x\nproperty {name} y\nproperty {name} z\n\
                     element face 1\nproperty list {name} {name} vertex_indices\nend_header\n"
                )
                .into_bytes();
                let mut line = |numbers: &[i32]| {
                    bytes.extend(numbers.iter().flat_map(|&number| written(number, name, encoding)));
                    bytes.extend((encoding == "ascii").then_some(b'\n'));
                };
                CORNERS.iter().for_each(|corner| line(corner));
                line(&[3, 0, 1, 2]);
                let scene = load("a.ply", &bytes);
                let [a, b, c] = CORNERS.map(|corner| Vec3::from_array(corner.map(|number| number as f32)));
                let found = &scene.triangles[0];
                assert_eq!((found.a, found.b, found.c), (a, b, c), "{name}, {encoding}");
                assert_eq!(scene.triangles.len(), 1, "{name}, {encoding}");
            }
        }
    }
}

/// Values with a sign and a fraction, of which no byte is like another.
#[test]
fn negative_and_fractional_coordinates_are_exact() {
    let values = [-1.234_567_9_f64, 1e-7, 12_345.678];
    for (encoding, big) in [("binary_little_endian", false), ("binary_big_endian", true)] {
        let mut bytes = format!(
            "ply\nformat {encoding} 1.0\nelement vertex 3\nproperty double x\nproperty float y\nproperty short z\n\
             element face 1\nproperty list uchar uchar vertex_index\nend_header\n"
        )
        .into_bytes();
        for (x, z) in values.into_iter().zip([-300_i16, 258, 1]) {
            let (y, z) = (x as f32, z);
            if big {
                bytes.extend(x.to_be_bytes().into_iter().chain(y.to_be_bytes()).chain(z.to_be_bytes()));
            } else {
                bytes.extend(x.to_le_bytes().into_iter().chain(y.to_le_bytes()).chain(z.to_le_bytes()));
            }
        }
        bytes.extend([3, 2, 0, 1]);
        let scene = load("a.ply", &bytes);
        let at = |k: usize, z: f32| Vec3::new(values[k] as f32, values[k] as f32, z);
        let found = &scene.triangles[0];
        assert_eq!((found.a, found.b, found.c), (at(2, 1.0), at(0, -300.0), at(1, 258.0)), "{encoding}");
    }
}

/// The linear values of sRGB 0, 188 of 255 and 255, calculated apart: ((188/255 + 0.055) / 1.055)^2.4 = 0.50289.
#[test]
fn colours_of_every_type_are_srgb() {
    for (name, half, most) in [
        ("uchar", "188", "255"),
        ("ushort", "48316", "65535"),
        ("float", "0.7372549", "1"),
        ("double", "0.7372549", "1"),
        ("int", "188", "255"),
        ("uint", "188", "255"),
    ] {
        for [red, green, blue] in
            [["red", "green", "blue"], ["r", "g", "b"], ["diffuse_red", "diffuse_green", "diffuse_blue"]]
        {
            let text = format!(
                "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                 property {name} {red}\nproperty {name} {green}\nproperty {name} {blue}\nelement face 1\n\
                 property list uchar int vertex_indices\nend_header\n\
                 0 0 0 0 {half} {most}\n1 0 0 {most} 0 0\n0 1 0 0 0 0\n3 0 1 2\n"
            );
            let scene = load("a.ply", text.as_bytes());
            let attributes = scene.attributes.as_ref().unwrap();
            let color = |corner: usize| attributes.colors[attributes.corners[0][corner] as usize];
            assert!((color(0) - Vec3::new(0.0, 0.50289, 1.0)).length() < 1e-4, "{name}: {}", color(0));
            assert_eq!((color(1), color(2)), (Vec3::X, Vec3::ZERO), "{name}");
        }
    }
}

#[test]
fn faces_and_strips_keep_their_winding() {
    let vertices = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n";
    let header = |rest: &str| {
        format!("ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n{rest}")
    };
    let list = "property list uchar int vertex_indices\nend_header\n";
    for (rest, turns) in [
        (format!("element face 2\n{list}{vertices}3 0 1 2\n4 0 2 3 1\n"), &[1.0, -1.0, -1.0][..]),
        (format!("element tristrips 1\n{list}{vertices}8 0 1 2 3 -1 1 0 2\n"), &[1.0, 1.0, -1.0]),
    ] {
        let scene = load("a.ply", header(&rest).as_bytes());
        let found: Vec<f32> = scene.triangles.iter().map(|t| (t.b - t.a).cross(t.c - t.a).z).collect();
        assert_eq!(found, turns, "{rest}");
    }
}

/// With old line ends, the first byte of the data may be a line feed.
#[test]
fn a_header_with_carriage_returns_ends_before_the_data() {
    let header = "ply\rformat binary_little_endian 1.0\relement vertex 3\rproperty uchar x\rproperty uchar y\rproperty uchar z\r\
                  element face 1\rproperty list uchar uchar vertex_indices\rend_header\r";
    let bytes = [header.as_bytes(), &[10, 0, 0, 0, 10, 0, 0, 0, 10, 3, 0, 1, 2]].concat();
    let found = &load("a.ply", &bytes).triangles[0];
    assert_eq!((found.a, found.b, found.c), (Vec3::X * 10.0, Vec3::Y * 10.0, Vec3::Z * 10.0));
}

#[test]
fn stl_coordinates_are_exact() {
    let corners = [[0.5_f32, -1.25, 3e-7], [1e10, 2.0, 3.0], [-4.0, 5.5, 1.0 / 3.0]];
    let mut binary = vec![b' '; 80];
    binary.extend(1_u32.to_le_bytes());
    binary.extend([[9.0_f32; 3]].iter().chain(&corners).flatten().flat_map(|value| value.to_le_bytes()));
    binary.extend([0, 0]);
    let vertices: String = corners.iter().map(|[x, y, z]| format!("  Vertex {x} {y:e} {z}\r\n")).collect();
    let text = format!("solid\r\nfacet normal 0 0 1\r\nouter loop\r\n{vertices}endloop\r\nendfacet\r\nendsolid\r\n");
    for bytes in [&binary, text.as_bytes()] {
        let scene = load("a.stl", bytes);
        let found = &scene.triangles[0];
        let [a, b, c] = corners.map(Vec3::from_array);
        assert_eq!((found.a, found.b, found.c, scene.up), (a, b, c, Vec3::Z));
    }
}
