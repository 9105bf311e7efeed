//! The samples, a section for each reader.

use super::{Sample, command, file};
use crate::recognition::foreign_files;
use crate::scan_warnings::binary_stl;

/// Titles and samples in the order of the page.
pub fn sections() -> Vec<(&'static str, Vec<Sample>)> {
    vec![
        ("Any file", any_file()),
        ("Files that are no models that can be read", foreign()),
        ("STL", stl()),
        ("PLY", ply()),
        ("OBJ", obj()),
        ("glTF", gltf()),
        ("PBRT", pbrt()),
        ("Rows of numbered files", rows()),
        ("Tree files", tree_files()),
        ("Memory", memory()),
        ("Command line", command_line()),
    ]
}

const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

fn any_file() -> Vec<Sample> {
    vec![
        file("the file does not exist", "buny.obj", "").beside("bunny.obj", OBJ),
        file("the file does not exist, nor one with such a name", "model.obj", ""),
        file("a folder", "models/", "").beside("models/bunny.obj", OBJ),
        file("a folder without models", "empty/", ""),
        file("an empty file", "a.obj", "").beside("b.obj", OBJ),
        file("only white space", "a.obj", " \n \n"),
        file("only zero bytes", "a.ply", [0; 100]),
        file("text", "notes.txt", "Dear user\n"),
        file("text called OBJ", "a.obj", "Dear user\n"),
        file("text called STL", "a.stl", "Dear user\n"),
        file("binary data", "a.bin", b"\xFB\x01\x02\x03\x04"),
        file("binary data called PLY", "a.ply", b"\xFB\x01\x02\x03\x04"),
        file("another model format than the name says", "a.ply", OBJ),
    ]
}

fn rows() -> Vec<Sample> {
    // The pattern is the name of no file.
    let row = |what: &str| file(&format!("{what} (the pattern does not exist as a file)"), "w_##.obj", "");
    let moved = OBJ.replace("v 0 0 0", "v 0 0 1");
    vec![
        row("no file of the row"),
        row("a missing frame").beside("w_01.obj", OBJ).beside("w_02.obj", &moved).beside("w_04.obj", OBJ),
        row("a frame of other triangles").beside("w_01.obj", OBJ).beside("w_02.obj", format!("{OBJ}f 1 2 3\n")),
        row("a broken frame").beside("w_01.obj", OBJ).beside("w_02.obj", "f 1 2 9\n").beside("w_03.obj", &moved),
        row("a broken first frame").beside("w_01.obj", "f 1 2 9\n").beside("w_02.obj", OBJ),
        file("a row in a folder that does not exist", "gone/w_##.obj", ""),
    ]
}

fn foreign() -> Vec<Sample> {
    foreign_files().into_iter().map(|(what, bytes)| file(what.split(';').next().unwrap(), "a.obj", bytes)).collect()
}

fn stl() -> Vec<Sample> {
    let facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
    let solid = |facets: &str| format!("solid a\n{facets}endsolid a\n");
    vec![
        file("a binary file cut off in its header", "a.stl", [1; 40]),
        file("no triangles", "a.stl", binary_stl("a", 0, 0, 0)),
        file("a solid without facets", "a.stl", solid("")),
        file("a corner without numbers", "a.stl", solid("facet normal 0 0 1\nvertex 1 2\n")),
        file("a word instead of a number", "a.stl", solid("facet normal 0 0 1\nvertex 1 2 1,5\n")),
        file("fewer triangles than declared", "a.stl", binary_stl("a", 3, 2, 0)),
        file("more triangles than declared", "a.stl", binary_stl("a", 1, 2, 0)),
        file("bytes left over", "a.stl", [binary_stl("a", 1, 1, 0), b"abc".to_vec()].concat()),
        file("colours", "a.stl", binary_stl("COLOR=", 1, 1, 9)),
        file("no solid", "a.stl", facet),
        file("no end of a facet", "a.stl", solid(&facet.replace("endfacet\n", ""))),
        file("no end of a solid", "a.stl", format!("solid a\n{facet}")),
        file(
            "a facet of four corners",
            "a.stl",
            solid(&format!("{facet}{}", facet.replace("vertex 0 0 0", "vertex 0 0 0\nvertex 1 1 0"))),
        ),
        file("a corner of four numbers", "a.stl", solid(&facet.replace("0 1 0", "0 1 0 7"))),
        file("unknown statements", "a.stl", solid(&format!("{facet}color 1 0 0\n"))),
        file(
            "a coordinate that is not a number",
            "a.stl",
            solid(&format!("{facet}{}", facet.replace("1 0 0", "nan 0 0"))),
        ),
        file("a coordinate too large", "a.stl", solid(&format!("{facet}{}", facet.replace("1 0 0", "1e19 0 0")))),
    ]
}

fn ply() -> Vec<Sample> {
    const VERTEX: &str = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
    const FACE: &str = "element face 1\nproperty list uchar int vertex_indices\n";
    const DATA: &str = "0 0 0\n1 0 0\n0 1 0\n";
    let header = |lines: &str| format!("ply\nformat ascii 1.0\n{lines}end_header\n");
    let with = |what: &str, lines: &str, data: &str| file(what, "a.ply", header(lines) + data);
    let sound = |extra: &str| format!("{}{DATA}3 0 1 2\n{extra}", header(&format!("{VERTEX}{FACE}")));
    let face =
        |what: &str, line: &str| file(what, "a.ply", format!("{}{DATA}{line}\n", header(&format!("{VERTEX}{FACE}"))));
    let vertex = |what: &str, property: &str, value: &str| {
        let data: String = DATA.lines().map(|line| format!("{line} {value}\n")).collect();
        with(what, &format!("{VERTEX}property {property}\n{FACE}"), &format!("{data}3 0 1 2\n"))
    };
    vec![
        file("no end of the header", "a.ply", "ply\nformat ascii 1.0\n"),
        file("a header of too many lines", "a.ply", header(&"comment\n".repeat(66_000))),
        file("too long a line in the header", "a.ply", header(&"x".repeat(70_000))),
        file("no format", "a.ply", "ply\nend_header\n"),
        file("two formats", "a.ply", header("format ascii 1.0\n")),
        file("an unknown format", "a.ply", "ply\nformat binary_middle_endian 1.0\nend_header\n"),
        with("a count that is none", "element vertex -3\n", ""),
        with("a property that is none", "element vertex 3\nproperty quad x\n", ""),
        with("a property before its element", "property float x\n", ""),
        with("more elements than bytes", "element vertex 4000000000\nproperty float x\n", "1 2 3\n"),
        with("an element without properties", "element vertex 3\n", "1 2 3\n"),
        with("no z", "element vertex 1\nproperty float x\nproperty float y\n", "1 2\n"),
        face("too long a list", "300 0 1 2"),
        face("a word instead of a number", "3 0 x 2"),
        face("too long a number", &format!("3 0 {} 2", "1".repeat(5000))),
        face("the end is missing", "3 0 1 "),
        with("points", VERTEX, DATA),
        with("points and lines", &format!("{VERTEX}element edge 1\nproperty int a\nproperty int b\n"), &format!("{DATA}0 1\n")),
        with("faces without corners", &format!("{VERTEX}element face 1\nproperty int corners\n"), &format!("{DATA}3\n")),
        file("data left over", "a.ply", sound("3 0 1 2\n")),
        face("an index with a fraction", "4 0 1 2 1.5"),
        face("an index out of range", "4 0 1 2 4294967296"),
        file("a face of two corners", "a.ply", sound("2 0 1\n").replace("face 1", "face 2")),
        file("a strip of two corners", "a.ply", sound("").replace("face", "tristrips").replace("3 0 1 2", "6 0 1 2 -1 0 1").replace("uchar", "int")),
        file("more numbers than properties", "a.ply", sound("").replace("3 0 1 2", "3 0 1 2 7")),
        file("an unknown version", "a.ply", sound("").replace("1.0", "2.0")),
        file("a texture", "a.ply", sound("").replace("element face", "comment TextureFile wood.png\nelement face")),
        file("an unknown line in the header", "a.ply", sound("").replace("element face", "elements\nelement face")),
        with("unknown elements", &format!("{VERTEX}{FACE}element edge 1\nproperty int a\n"), &format!("{DATA}3 0 1 2\n1\n")),
        vertex("unknown properties", "float s", "0"),
        vertex("transparency", "uchar alpha", "9"),
        with(
            "colours out of range",
            &format!("{VERTEX}property float red\nproperty float green\nproperty float blue\n{FACE}"),
            "0 0 0 2 0 0\n1 0 0 0 0 0\n0 1 0 0 0 0\n3 0 1 2\n",
        ),
        file("binary data left over", "a.ply", [
            header("element vertex 3\nproperty uchar x\nproperty uchar y\nproperty uchar z\nelement face 1\nproperty list uchar uchar vertex_indices\n")
                .replace("ascii", "binary_little_endian").as_bytes(),
            &[0, 0, 0, 1, 0, 0, 0, 1, 0, 3, 0, 1, 2, 3, 0, 1, 2],
        ].concat()),
    ]
}

fn pbrt() -> Vec<Sample> {
    const TRIANGLE: &str = "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0]\n";
    let broken = |what: &str, text: &str| file(what, "a.pbrt", text);
    let counted = |what: &str, text: &str| file(what, "a.pbrt", format!("WorldBegin\n{text}\n{TRIANGLE}"));
    vec![
        broken("no shapes", "WorldBegin\n"),
        broken("a statement that ends too early", "Shape"),
        broken("a word where a text belongs", "Shape sphere"),
        broken("a text without an end", "Shape \"sphere"),
        broken("a list without an end", "Shape \"sphere\" \"float radius\" [1"),
        broken("a word instead of a number", "Translate 1 2 x"),
        broken("too many numbers", "Translate [1 2 3 4]"),
        broken("blocks without end", &"AttributeBegin\n".repeat(5000)),
        broken("too long a word", &format!("Shape {}", "x".repeat(1_100_000))),
        counted("lights", "LightSource \"distant\""),
        counted("an unknown statement", "Colour \"red\""),
        counted("an unknown shape", "Shape \"curve\""),
        counted("a shape without positions", "Shape \"trianglemesh\""),
        counted("a shape without indices", "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 1 1]"),
        counted(
            "an index out of range",
            "Shape \"loopsubdiv\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 9 0]",
        ),
        counted(
            "too few normals",
            "Shape \"bilinearmesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 0] \"normal N\" [0 0 1] \"point2 uv\" [0 0]",
        ),
        counted("a mesh in a file that is missing", "Shape \"plymesh\" \"string filename\" \"a.ply\""),
        counted("a mesh without the name of a file", "Shape \"plymesh\""),
        counted("a file that includes itself", "Include \"a.pbrt\""),
        counted(
            "shapes that are not seen",
            "Shape \"disk\" \"float alpha\" 0\nMaterial \"interface\"\nShape \"disk\"\nMaterial \"diffuse\"",
        ),
        counted("holes", "Shape \"disk\" \"texture alpha\" \"holes\""),
        counted(
            "materials of other kinds",
            "Material \"hair\"\nMaterial \"dielectric\"\nMaterial \"mix\" \"string materials\" [\"a\" \"b\"]",
        ),
        counted(
            "spectra",
            "Material \"diffuse\" \"spectrum reflectance\" [400 0.5 700 0.5]\nAreaLightSource \"diffuse\" \"blackbody L\" 3000",
        ),
        counted(
            "textures of other kinds",
            "Texture \"a\" \"spectrum\" \"marble\"\nTexture \"a\" \"spectrum\" \"imagemap\"\nTexture \"a\" \"spectrum\" \"imagemap\" \"string wrap\" \"black\"",
        ),
        counted("a texture without a definition", "Material \"diffuse\" \"texture reflectance\" \"a\""),
        counted("numbers left over", "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 7]"),
        counted("an axis and an angle that are none", "Rotate 30 0 0 0\nCamera \"perspective\" \"float fov\" 180"),
        counted("copies of nothing", "ObjectInstance \"a\"\nCoordSysTransform \"a\""),
        counted(
            "objects within objects",
            "ObjectBegin \"a\"\nObjectBegin \"b\"\nObjectEnd\nObjectInstance \"a\"\nObjectEnd",
        ),
        counted("blocks that do not match", "AttributeEnd\nAttributeBegin"),
        counted("motion", "ActiveTransform EndTime\nTranslate 1 0 0\nActiveTransform All"),
        counted(
            "cameras",
            "LookAt 1 1 1 1 1 1 0 1 0\nCamera \"spherical\"\nScale 0 0 0\nCamera \"perspective\"\nIdentity",
        ),
        counted(
            "defaults of shapes, colours of another space",
            "Attribute \"shape\" \"float radius\" 2\nColorSpace \"rec2020\"",
        ),
    ]
}

fn obj() -> Vec<Sample> {
    vec![
        file("a word instead of a number", "a.obj", "v 0 0 0\nv 0 x1 0\n"),
        file("a vertex of two numbers", "a.obj", "v 0 0\n"),
        file("a decimal comma", "a.obj", "v 0 0,5 0\n"),
        file("a hexadecimal number", "a.obj", "v 0 0x10 0\n"),
        file("too long a line", "a.obj", format!("v 0 0 0 {}\n", "0 ".repeat(600_000))),
        file("points without faces", "a.obj", "v 0 0 0\nv 1 0 0\n"),
        file("faces that cannot be shown, lines and points", "a.obj", format!("{OBJ}f 1 2 9\nf 1 2\nl 1 2\np 1\n")),
        file("a library that does not exist; no such material", "a.obj", format!("mtllib a.mtl\nusemtl wood\n{OBJ}")),
        file("a picture that is missing", "a.obj", format!("mtllib a.mtl\nusemtl wood\n{OBJ}"))
            .beside("a.mtl", "newmtl wood\nmap_Kd wood.png\n"),
        file("a library outside the folder", "a.obj", format!("mtllib ../a.mtl\n{OBJ}")),
    ]
}

fn gltf() -> Vec<Sample> {
    let asset = |rest: &str| format!("{{\"asset\":{{\"version\":\"2.0\"}}{rest}}}");
    vec![
        file("JSON that is not glTF", "a.gltf", "{\"name\": \"a\", \"version\": \"1.0\"}"),
        file("JSON cut off", "a.gltf", "{\"asset\":{\"version\":\"2.0\"},"),
        file("no meshes", "a.gltf", asset("")),
        file("a header that lies", "a.glb", b"glTF\x02\0\0\0\xff\xff\xff\xff\xff\xff\xff\x7fJSON{}"),
        file(
            "a required extension",
            "a.gltf",
            asset(",\"extensionsRequired\":[\"KHR_texture_basisu\"],\"extensionsUsed\":[\"KHR_texture_basisu\"]"),
        ),
        file("glTF 1.0", "a.gltf", "{\"asset\":{\"version\":\"1.0\"}}"),
        file("a later version", "a.gltf", "{\"asset\":{\"version\":\"3.0\"}}"),
        file("a later version that is needed", "a.gltf", "{\"asset\":{\"version\":\"2.1\",\"minVersion\":\"2.1\"}}"),
        file("a version that is none", "a.gltf", "{\"asset\":{\"version\":\"two\"}}"),
        file("a required extension that is unknown", "a.gltf", asset(",\"extensionsRequired\":[\"EXT_hair\"]")),
        file(
            "pictures of an unknown format",
            "a.gltf",
            asset(",\"extensionsRequired\":[\"EXT_texture_avif\"],\"extensionsUsed\":[\"EXT_texture_avif\"]"),
        ),
        file("GLB of version 1", "a.glb", b"glTF\x01\0\0\0\x14\0\0\0\x00\0\0\0\x00\0\0\0"),
        file("GLB cut off in its header", "a.glb", b"glTF\x02\0\0\0"),
        file("GLB that begins with its binary chunk", "a.glb", b"glTF\x02\0\0\0\x18\0\0\0\x04\0\0\0BIN\0abcd"),
        file(
            "a negative count",
            "a.gltf",
            asset(",\"accessors\":[{\"componentType\":5126,\"count\":-1,\"type\":\"VEC3\"}]"),
        ),
        file("a number instead of a list", "a.gltf", asset(",\"nodes\":5")),
        file("lists in lists", "a.gltf", asset(&format!(",\"nodes\":{}{}", "[".repeat(200), "]".repeat(200)))),
        file(
            "a loop of nodes",
            "a.gltf",
            asset(",\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"children\":[1]},{\"children\":[0]}]"),
        ),
        file(
            "a node with two parents",
            "a.gltf",
            asset(",\"scenes\":[{\"nodes\":[0,1]}],\"nodes\":[{\"children\":[2]},{\"children\":[2]},{}]"),
        ),
        file(
            "a clip without keys",
            "a.gltf",
            asset(",\"animations\":[{\"channels\":[{\"target\":{\"path\":\"scale\"}}]}]"),
        ),
        file("a scene that does not exist", "a.gltf", asset(",\"scene\":7,\"nodes\":[{\"mesh\":99}]")),
        file("a buffer that is missing", "a.gltf", asset(",\"buffers\":[{\"byteLength\":9,\"uri\":\"a.bin\"}]")),
        file(
            "a web address",
            "a.gltf",
            asset(",\"buffers\":[{\"byteLength\":9,\"uri\":\"https://example.org/a.bin\"}]"),
        ),
    ]
}

/// A tree file over one triangle with `from` in its header replaced by `to`, the numbers of its leaf, and the upper end of its box.
fn tree_file(from: &str, to: &str, leaf: [u32; 2], max_y: f32) -> Vec<u8> {
    let header = r#"{"container":"box","arity":2,"nodes":1,"indices":1,"triangles":1,
        "arrays":{"bounds":0,"children":24,"leaves":32,"indices":40,"corners":44}}"#;
    let header: String = header.lines().map(str::trim).collect();
    assert!(header.contains(from), "{from}");
    let mut bytes = format!("bvhscope tree 1\n{}\n", header.replacen(from, to, 1)).into_bytes();
    bytes.extend([0.0, 0.0, 0.0, 1.0, max_y, 0.0].into_iter().flat_map(f32::to_le_bytes));
    bytes.extend([u32::MAX, u32::MAX, leaf[0], leaf[1], 0].into_iter().flat_map(u32::to_le_bytes));
    bytes.extend([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0_f32].into_iter().flat_map(f32::to_le_bytes));
    bytes
}

/// A tree file in two levels: a triangle, and one instance of a mesh.
fn two_levels(mesh: u32) -> Vec<u8> {
    let header = r#"{"container":"box","arity":2,"nodes":2,"indices":2,"triangles":1,"trees":2,"instances":1,"arrays":{"bounds":0,
        "children":48,"leaves":64,"indices":80,"corners":88,"trees":124,"instances":148,"matrices":152}}"#;
    let header: String = header.lines().map(str::trim).collect();
    let bounds = [0.0, 0.0, 0.0, 1.0, 1.0, 0.0];
    let floats = |numbers: &[f32]| numbers.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>();
    let whole = |numbers: &[u32]| numbers.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>();
    [
        format!("bvhscope tree 2\n{header}\n").into_bytes(),
        floats(&[bounds, bounds].concat()),
        whole(&[u32::MAX, u32::MAX, u32::MAX, u32::MAX, 0, 1, 0, 1, 0, 0]),
        floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]),
        whole(&[1, 1, 1, 1, 1, 1, mesh]),
        floats(&[1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]),
    ]
    .concat()
}

fn tree_files() -> Vec<Sample> {
    let sound = || tree_file("", "", [0, 1], 1.0);
    let header = |from: &str, to: &str| tree_file(from, to, [0, 1], 1.0);
    let of_model = |what: &str, bytes: Vec<u8>| {
        command(what, "info a.obj --tree a.bvh").beside("a.obj", OBJ).beside("a.bvh", bytes)
    };
    let of_copies = |what: &str, bytes: Vec<u8>| {
        command(what, "info builtin:stack:2 --instances two-level --tree a.bvh").beside("a.bvh", bytes)
    };
    vec![
        of_model("not a tree file", b"Dear user\n".to_vec()),
        of_model("a later version", b"bvhscope tree 3\n".to_vec()),
        of_model("trees in two levels for a flat model", two_levels(0)),
        of_copies("one tree for a model in two levels", sound()),
        of_copies("trees of another scene", two_levels(0)),
        file("an instance of no mesh", "a.bvh", two_levels(9)),
        of_model("a header that is not JSON", b"bvhscope tree 1\n{container: box}\n".to_vec()),
        of_model("a field missing", header("\"arity\":2,", "")),
        of_model("a field with a wrong value", header("\"arity\":2", "\"arity\":64")),
        of_model("cut off", sound()[..200].to_vec()),
        of_model("arrays that overlap", header("\"leaves\":32", "\"leaves\":30")),
        of_model("a root that holds nothing", tree_file("", "", [0, 0], 1.0)),
        of_model("a leaf beyond the indices", tree_file("", "", [0, 2], 1.0)),
        of_model("a box inside out", tree_file("", "", [0, 1], -1.0)),
        of_model("a tree of another model", header("\"triangles\":1,", "\"triangles\":0,")),
        file("a tree without its triangles, as a model", "a.bvh", header(",\"corners\":44", "")),
        command("a tree file and settings", "info a.obj --tree a.bvh --builder lbvh").beside("a.obj", OBJ),
        command("a file of a kind that is not written", "tree builtin:cornell -o tree.xml"),
    ]
}

fn memory() -> Vec<Sample> {
    vec![
        command("too large a scene", "info builtin:terrain:10000000 --memory-limit 100MB"),
        command("a tree too large", "info builtin:terrain:1000000 --memory-limit 300MB"),
    ]
}

fn command_line() -> Vec<Sample> {
    vec![
        command("an unknown option", "info --frobnicate"),
        command("no such scene", "info builtin:rabbit"),
        command("no such size", "info builtin:terrain:many"),
        command("a time of a model that stands still", "render builtin:cornell -o a.png --time 1"),
        command("a time beyond the clip", "render builtin:walker:500 -o a.png --time 9"),
        command("no such clip", "render builtin:walker:500 -o a.png --clip swim"),
        command("times that are none", "render builtin:walker:500 -o a.gif --frames 2..1"),
        command("a film of another format", "render builtin:walker:500 -o a.jpg --frames 0..1:0.5"),
        command("a memory limit that is none", "info --memory-limit=lots"),
        command("a picture of another format", "render builtin:cornell -o a.bmp"),
        command("a folder that does not exist", "render builtin:cornell -o missing/a.png"),
        command("standard input as a model", "info -"),
        command("no such command", "rendr builtin:cornell"),
        command("an output that is the model", "bench a.obj --csv a.obj").beside("a.obj", OBJ),
        command("two outputs of one name", "bench builtin:cornell --csv a.svg --plot a.svg"),
        command("a picture without pixels", "render builtin:cornell -o a.png --size 0x64"),
        command("a builder that is none", "info builtin:cornell --builder fastest"),
    ]
}
