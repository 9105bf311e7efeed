//! Announcements of an STL or PLY file that the scene does not hold are counted: a file for each kind, with its number and place.

use std::path::Path;

use bvhscope::scene::{LoadOptions, load_bytes};
use bvhscope_engine::cancel::CancelToken;

/// The number of triangles and the warnings of a file.
fn load(name: &str, bytes: &[u8]) -> (usize, Vec<String>) {
    let scene = load_bytes(Path::new(name), bytes, &LoadOptions::default(), &CancelToken::new());
    let scene = scene.unwrap_or_else(|error| panic!("{error}"));
    (scene.triangles.len(), scene.warnings.entries.iter().map(ToString::to_string).collect())
}

/// A binary STL file with records, of which each has `attribute` at its end.
pub fn binary_stl(header: &str, declared: u32, records: usize, attribute: u16) -> Vec<u8> {
    let mut bytes = header.as_bytes().to_vec();
    bytes.resize(80, 0);
    bytes.extend(declared.to_le_bytes());
    for _ in 0..records {
        let values = [0.0_f32, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        bytes.extend(attribute.to_le_bytes());
    }
    bytes
}

const FACET: &str = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";

#[test]
fn stl_leaves_nothing_out_silently() {
    let solid = |facets: &str| format!("solid a\n{facets}endsolid a\n").into_bytes();
    let with = |mut bytes: Vec<u8>, extra: &[u8]| {
        bytes.extend(extra);
        bytes
    };
    let open = FACET.replace("endfacet\n", "");
    for (bytes, triangles, warning) in [
        (
            binary_stl("a", 1, 3, 0),
            3,
            "2 triangles beyond the 1 that the header declares, shown too (first at byte 134)",
        ),
        (
            binary_stl("a", 0, 2, 0),
            2,
            "2 triangles beyond the 0 that the header declares, shown too (first at byte 84)",
        ),
        (
            binary_stl("solid a", 0, 1, 0),
            1,
            "1 triangle beyond the 0 that the header declares, shown too (first at byte 84)",
        ),
        (binary_stl("a", 3, 2, 0), 2, "1 triangle of 3 declared missing at the end (first at byte 184)"),
        (with(binary_stl("a", 1, 1, 0), b"abc"), 1, "3 bytes after the last triangle not read (first at byte 134)"),
        (with(binary_stl("a", 1, 2, 0), b"abc"), 1, "53 bytes after the last triangle not read (first at byte 134)"),
        (binary_stl("COLOR=abcd", 2, 2, 0x1F), 2, "2 triangles with a colour, which is not shown (first at byte 84)"),
        (binary_stl("a", 2, 2, 0x801F), 2, "2 triangles with a colour, which is not shown (first at byte 84)"),
        (FACET.repeat(2).into_bytes(), 2, "2 facets outside 'solid' and 'endsolid', shown too (first at line 1)"),
        (solid(&format!("{open}{FACET}")), 2, "1 facet without 'endfacet' (first at line 8)"),
        (solid(&open), 1, "1 facet without 'endfacet' (first at line 8)"),
        (
            solid(&format!("{FACET}facet normal 0 0 1\nouter loop\nendloop\nendfacet\n")),
            1,
            "1 facet without exactly 3 corners skipped (first at line 12)",
        ),
        (
            solid(&FACET.replace("vertex 0 1 0\n", "vertex 0 1 0\nvertex 1 1 0\n").repeat(2).replacen(
                "vertex 1 1 0\n",
                "",
                1,
            )),
            1,
            "1 facet without exactly 3 corners skipped (first at line 15)",
        ),
        (
            solid(&FACET.replace("0 1 0", "0 1 0 7")),
            1,
            "1 vertex with more than 3 numbers, of which the first 3 count (first at line 6)",
        ),
        (
            solid(&format!("{FACET}color 1 0 0\n\n  colour\n")),
            1,
            "2 lines without an STL statement skipped (first at line 9)",
        ),
        (
            solid(FACET)[..FACET.len() + 8].to_vec(),
            1,
            "1 solid without 'endsolid': the file may be cut off (first at byte 94)",
        ),
        (
            solid(&format!("{FACET}{}", FACET.replace("1 0 0", "nan 0 0"))),
            1,
            "1 triangle with coordinates that are not numbers skipped (first at line 14)",
        ),
    ] {
        assert_eq!(load("a.stl", &bytes), (triangles, vec![warning.to_owned()]), "{}", String::from_utf8_lossy(&bytes));
    }
    // Habits of many programs give no warning.
    let two = format!("solid a\n{FACET}endsolid a\n\nsolid b\n{FACET}endsolid b\n").into_bytes();
    for (bytes, triangles) in [(two, 2), (binary_stl("COLOR=abcd", 1, 1, 0xFFFF), 1), (binary_stl("a", 1, 1, 7), 1)] {
        assert_eq!(load("a.stl", &bytes), (triangles, Vec::new()));
    }
}

/// A text PLY file of a triangle: lines of the header before the vertices, after them and after the faces; data.
fn ply(before: &str, vertex: &str, face: &str, data: &str) -> Vec<u8> {
    format!(
        "ply\nformat ascii 1.0\n{before}element vertex 3\nproperty float x\nproperty float y\nproperty float z\n{vertex}\
         element face 1\n{face}end_header\n{data}"
    )
    .into_bytes()
}

#[test]
fn ply_leaves_nothing_out_silently() {
    const LIST: &str = "property list uchar int vertex_indices\n";
    const VERTICES: &str = "0 0 0\n1 0 0\n0 1 0\n";
    let plain = |data: &str| ply("", "", LIST, &format!("{VERTICES}{data}"));
    let edge = "element edge 2\nproperty int vertex1\n";
    let swap = |bytes: Vec<u8>, from: &str, to: &str| String::from_utf8(bytes).unwrap().replace(from, to).into_bytes();
    let sound = plain("3 0 1 2\n");
    let mut big = swap(sound.clone(), "ascii", "binary_little_endian");
    big.truncate(big.len() - VERTICES.len() - 8);
    big.extend([0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|value| value.to_le_bytes()));
    big.push(3);
    big.extend([0, 1, 2, 99].iter().flat_map(|value: &i32| value.to_le_bytes()));
    let place = big.len() - 4;
    let bytes_left = format!("4 bytes after the last element not read (first at byte {place})");
    let fan = |corner: &str| plain(&format!("4 0 1 2 {corner}\n"));
    let strip = |count: usize, corners: &str| {
        swap(ply("", "", &LIST.replace("uchar", "int"), &format!("{VERTICES}{count} {corners}\n")), "face", "tristrips")
    };
    for (bytes, triangles, warning) in [
        (plain("3 0 1 2\n3 2 1 0\n\n3 0 1 2\n"), 1, "2 lines after the last element not read (first at line 14)"),
        (big, 1, &*bytes_left),
        (fan("1.5"), 1, "1 index with a fraction: triangles left out (first at line 13)"),
        (fan("nan"), 1, "1 index with a fraction: triangles left out (first at line 13)"),
        (fan("-1"), 1, "1 index out of range: triangles left out (first at line 13)"),
        (fan("3"), 1, "1 index out of range: triangles left out (first at line 13)"),
        (fan("4294967296"), 1, "1 index out of range: triangles left out (first at line 13)"),
        (fan("18446744073709551616"), 1, "1 index out of range: triangles left out (first at line 13)"),
        (fan("1e300"), 1, "1 index out of range: triangles left out (first at line 13)"),
        (
            swap(plain("3 0 1 2\n2 0 1\n"), "face 1", "face 2"),
            1,
            "1 face with fewer than 3 corners skipped (first at line 14)",
        ),
        (strip(5, "0 1 2 -1 0"), 1, "1 strip with fewer than 3 corners skipped (first at line 13)"),
        (strip(7, "0 1 2 -2 0 1 2"), 2, "1 index out of range: triangles left out (first at line 13)"),
        (
            swap(sound.clone(), "ascii 1.0", "ascii 2.0"),
            1,
            "1 version of the format other than 1.0, read as 1.0 (first at line 2)",
        ),
        (
            swap(sound.clone(), "ascii 1.0", "ascii"),
            1,
            "1 version of the format other than 1.0, read as 1.0 (first at line 2)",
        ),
        (
            ply("comment TextureFile a.png\n", "", LIST, &format!("{VERTICES}3 0 1 2\n")),
            1,
            "1 texture named by a comment left out (first at line 3)",
        ),
        (
            ply("propery float w\n", "", LIST, &format!("{VERTICES}3 0 1 2\n")),
            1,
            "1 line of the header not understood (first at line 3)",
        ),
        (ply(edge, "", LIST, &format!("1\n2\n{VERTICES}3 0 1 2\n")), 1, "2 elements 'edge' left out (first at line 3)"),
        (
            ply("", "property float s\nproperty float t\n", LIST, "0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 1\n3 0 1 2\n"),
            1,
            "2 properties of 'vertex' elements left out: 's', 't' (first at line 3)",
        ),
        (
            ply("", "property float nx\n", LIST, "0 0 0 0\n1 0 0 1\n0 1 0 0\n3 0 1 2\n"),
            1,
            "1 property of 'vertex' elements left out: 'nx' (first at line 3)",
        ),
        (
            ply("", "", &format!("{LIST}property uchar red\n"), &format!("{VERTICES}3 0 1 2 255\n")),
            1,
            "1 property of 'face' elements left out: 'red' (first at line 7)",
        ),
        (
            ply(
                "",
                "property uchar red\nproperty uchar green\nproperty uchar blue\n",
                LIST,
                "0 0 0 256 0 0\n1 0 0 0 0 0\n0 1 0 0 0 -1\n3 0 1 2\n",
            ),
            1,
            "2 vertices with a colour out of range, which is limited (first at line 13)",
        ),
        (
            ply("", "property uchar alpha\n", LIST, "0 0 0 255\n1 0 0 254\n0 1 0 255\n3 0 1 2\n"),
            1,
            "1 vertex with transparency, shown opaque (first at line 12)",
        ),
    ] {
        assert_eq!(load("a.ply", &bytes), (triangles, vec![warning.to_owned()]), "{}", String::from_utf8_lossy(&bytes));
    }
    // A column too many shifts everything behind it.
    let shifted = ply("", "", LIST, "0 0 0 1\n1 0 0 1\n0 1 0 1\n3 0 1 2\n3 0 1 2\n3 0 1 2\n");
    let error = load_bytes(Path::new("a.ply"), &shifted, &LoadOptions::default(), &CancelToken::new()).unwrap_err();
    let part = "3 lines with more numbers than the header gives to 'vertex' (first at line 10)";
    assert!(error.to_string().contains(part), "{error}");
    // A second table of vertices is another table.
    let second = "element vertex 1\nproperty float x\n";
    let (triangles, warnings) =
        load("a.ply", &ply("", "", &format!("{LIST}{second}"), &format!("{VERTICES}3 0 1 2\n5\n")));
    assert_eq!((triangles, &*warnings[0]), (1, "1 element 'vertex' left out (first at line 9)"));
    // Scans carry measures, and many files end in blank lines.
    let measures = "property float confidence\nproperty float intensity\nproperty uchar alpha\n";
    let data = "0 0 0 1 1 255\n1 0 0 1 1 255\n0 1 0 1 1 255\n3 0 1 2 \n\n \n";
    assert_eq!(load("a.ply", &ply("obj_info a\n\n", measures, LIST, data)), (1, Vec::new()));
}

/// Without triangles, the refusal says what is there and why it is not enough.
#[test]
fn files_without_triangles_name_what_they_hold() {
    let edges = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n\
                 element edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n0 0 0\n1 0 0\n0 1\n";
    let no_list = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
                   element face 1\nproperty list uchar int corners\nend_header\n0 0 0\n3 0 0 0\n";
    for (name, bytes, part) in [
        (
            "a.ply",
            edges.as_bytes().to_vec(),
            "contains 2 points and 1 element 'edge' but no triangles (1 element 'edge' left out",
        ),
        (
            "a.ply",
            no_list.as_bytes().to_vec(),
            "contains 1 point but no triangles (1 face without a list 'vertex_indices' skipped (first at line 7))",
        ),
        ("a.stl", b"solid a\nendsolid a\n".to_vec(), "contains 1 solid but no triangles"),
        ("a.stl", binary_stl("a", 0, 0, 0), "contains a header but no triangles"),
    ] {
        let error =
            load_bytes(Path::new(name), &bytes, &LoadOptions::default(), &CancelToken::new()).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
}
