//! A file for each kind of warning and refusal of the OBJ reader: what it says, how often and where first.

use std::path::Path;

use bvhscope::scene::{FileLocation, LoadError, LoadOptions, Scene, load_bytes};
use bvhscope_engine::cancel::CancelToken;

fn load(folder: &Path, text: &str) -> Result<Scene, LoadError> {
    load_bytes(&folder.join("a.obj"), text.as_bytes(), &LoadOptions::default(), &CancelToken::new())
}

/// Lines 1 to 3.
const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

#[test]
fn every_kind_is_counted_with_its_first_place() {
    let folder = tempfile::tempdir().unwrap();
    for (text, what, count, line) in [
        (
            "f 1 2 4\nf 0 1 2\nf 1 2 -4\nf 4294967297 2 3\nf 9223372036854775808 2 3\nf -9223372036854775808 2 3\n",
            "faces with a vertex that does not exist (yet) skipped",
            6,
            4,
        ),
        ("f 1.0 2 3\nf 1 1e0 3\nf /1 2 3\n", "faces with a corner that is not a whole number skipped", 3, 4),
        (
            "v nan 0 0\nv 1e19 0 0\nf 1 2 4\nf 1 2 5\n",
            "faces with coordinates that are not numbers or beyond 1e18 skipped",
            2,
            6,
        ),
        ("f 1 2\nf\n", "faces with fewer than 3 corners skipped", 2, 4),
        (
            "vt 0 0\nf 1/1 2/1 3/2\nf 1/4294967297 2/1 3/1\nf 1/1.0 2/1 3/1\n",
            "faces with a texture coordinate that does not exist (yet) drawn without any",
            3,
            5,
        ),
        (
            "vn 0 0 1\nf 1//1 2//1 3//-2\nf 1//4294967297 2//1 3//1\n",
            "faces with a normal that does not exist (yet) drawn flat",
            2,
            5,
        ),
        ("vt 0 0\nf 1/1 2 3\n", "faces with texture coordinates at some of their corners drawn without any", 1, 5),
        ("vn 0 0 1\nf 1//1 2 3\n", "faces with normals at some of their corners drawn flat", 1, 5),
        ("f 1/// 2 3\n", "faces with more than 3 indices at a corner, of which the rest is not used", 1, 4),
        ("l 1 2 3\nl 1 2\n", "lines not shown", 2, 4),
        ("p 1 2 3\n", "points not shown", 3, 4),
        ("cstype bezier\ndeg 3\ncurv 0 1 1 2 3 1\nend\n", "curves not shown", 1, 6),
        ("surf 0 1 0 1 1 2 3 1\n", "surfaces in free form not shown", 1, 4),
        ("call b.obj\n", "files named by 'call' not read", 1, 4),
        ("v 1 2 3 0.5\n", "vertices with a weight, which is not used", 1, 4),
        ("v 1 2 3 4 5\n", "vertices with 5 numbers, of which 2 are not used", 1, 4),
        ("v 1 2 3 255 0 0\nv 1 2 3 nan 0 0\n", "vertices with a colour outside 0 to 1, which is clamped", 2, 4),
        ("v 1 2 3 1 0 0 0.5\n", "vertices with more than 6 numbers, of which the rest is not used", 1, 4),
        ("vt inf 0\n", "statements 'vt' with a number that is not finite", 1, 4),
        ("vn nan 0 0\n", "statements 'vn' with a number that is not finite", 1, 4),
        ("vt 0 0 0 0\n", "statements 'vt' with more than 3 numbers, of which the rest is not used", 1, 4),
        ("vn 0 0 1 0\n", "statements 'vn' with more than 3 numbers, of which the rest is not used", 1, 4),
        ("wobble 1\nfoo\x1b 2\n", "statements not understood and skipped, 'wobble' being the first", 2, 4),
        (
            "usemtl red\nusemtl blue\nusemtl red\n",
            "materials that no library defines, 'red' being the first, shown as clay",
            2,
            4,
        ),
        ("usemtl\n", "statements 'usemtl' without a name", 1, 4),
        ("mtllib\n", "statements 'mtllib' without a name", 1, 4),
        ("mtllib b.mtl\nmtllib b.mtl\n", "libraries 'b.mtl' not used: there is no such file", 1, 4),
    ] {
        let scene = load(folder.path(), &format!("{TRIANGLE}{text}f 1 2 3\n")).unwrap();
        let [warning] = &scene.warnings.entries[..] else { panic!("{text}: {:?}", scene.warnings) };
        assert_eq!((warning.what.as_str(), warning.count), (what, count), "{text}");
        assert_eq!(warning.first, FileLocation::Line(line), "{text}");
    }
}

#[test]
fn every_kind_in_a_library_is_counted_with_its_place_there() {
    let folder = tempfile::tempdir().unwrap();
    image::RgbaImage::new(1, 1).save(folder.path().join("a.png")).unwrap();
    for (text, what, count, line) in [
        ("Kd red\nKd 1 2\n", "colours (Kd) not understood", 2, 2),
        ("Ke x\n", "colours (Ke) not understood", 1, 2),
        ("d 0.5\nTr 0.5\n", "materials with transparency shown opaque", 1, 2),
        ("d much\n", "opacities (d, Tr) not understood", 1, 2),
        ("map_Kd a.png\nmap_d b.png\n", "masks (map_d) in a file of their own not used", 1, 3),
        ("map_Kd -s 2 2 1 a.png\n", "textures (map_Kd) shown without their options", 1, 2),
        ("map_Kd -clamp on a.png\n", "textures (map_Kd) shown without their options", 1, 2),
        ("map_Kd none.png\n", "images left out: 'none.png': there is no such file", 1, 2),
        ("map_Ke none.png\n", "images left out: 'none.png': there is no such file", 1, 2),
        ("map_Bump none.png\n", "images left out: 'none.png': there is no such file", 1, 2),
        ("norm none.png\n", "images left out: 'none.png': there is no such file", 1, 2),
        ("map_Pr -s 2 2 1 a.png\n", "textures (map_Pr) shown without their options", 1, 2),
        ("Ks\n", "colours (Ks) not understood", 1, 2),
        ("Ns x\n", "exponents (Ns) not understood", 1, 2),
        ("Pm nan\n", "fractions (Pr, Pm) not understood", 1, 2),
        ("disp a.png\n", "displacements (disp) not shown", 1, 2),
        ("decal a.png\n", "decals not shown", 1, 2),
        ("wobble 1\nfoo 2\n", "statements not understood and skipped, 'wobble' being the first", 2, 2),
        ("newmtl a\n", "materials defined again, of which the last definition is used", 1, 2),
    ] {
        std::fs::write(folder.path().join("m.mtl"), format!("newmtl a\n{text}")).unwrap();
        let scene = load(folder.path(), &format!("mtllib m.mtl\n{TRIANGLE}usemtl a\nf 1 2 3\n")).unwrap();
        let [warning] = &scene.warnings.entries[..] else { panic!("{text}: {:?}", scene.warnings) };
        assert_eq!((warning.what.as_str(), warning.count), (what, count), "{text}");
        assert_eq!(warning.first, FileLocation::LineIn("m.mtl".to_owned(), line), "{text}");
    }
    for (text, what, line) in [
        (&b"Kd 1 0 0\nnewmtl a\n"[..], "statements before the first 'newmtl' skipped", 1),
        (b"\xFF\xFEn\0", "libraries in UTF-16 not used; save them as UTF-8", 1),
    ] {
        std::fs::write(folder.path().join("m.mtl"), text).unwrap();
        let scene = load(folder.path(), &format!("mtllib m.mtl\n{TRIANGLE}f 1 2 3\n")).unwrap();
        let [warning] = &scene.warnings.entries[..] else { panic!("{what}: {:?}", scene.warnings) };
        assert_eq!(warning.what, what);
        assert_eq!(warning.first, FileLocation::LineIn("m.mtl".to_owned(), line), "{what}");
    }
}

#[test]
fn what_no_picture_here_shows_is_no_warning() {
    let folder = tempfile::tempdir().unwrap();
    image::RgbaImage::new(1, 1).save(folder.path().join("a.png")).unwrap();
    let library = "# by hand\nnewmtl a\n\tNs 50\n\tNi 1.5\n\td 1.0\n\tTr 0\n\tTf 1 1 1\n\tillum 2\n\tKa 0 0 0\n\tKs 0 0 0 # none\n\
        \tmap_Ka b.png\n\tmap_Kd -s 1 1 1 -o 0 0 -blendu on a.png\n\tmap_d A.PNG\n\tbump -bm 0.5 a.png\n";
    std::fs::write(folder.path().join("m.mtl"), library).unwrap();
    let text = format!(
        "# x\n\nmtllib m.mtl m.mtl\ng a b\ns off\no c\n{TRIANGLE}v 1 1 1 1.0\nvt 0 0 1\nusemtl a\nf 1/1 2/1 3/1\nf 1 2 3\n"
    );
    let scene = load(folder.path(), &text).unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let material = scene.material(0);
    assert!(material.alpha_cutoff > 0.0);
    // Ns 50: (2 / 52)^¼; Ks 0: nothing is mirrored.
    assert!((material.roughness - 0.442_857).abs() < 1e-4 && material.specular == glam::Vec3::ZERO, "{material:?}");
    assert!(material.normal_texture.is_some() && material.normal_scale == 0.5);
}

#[test]
fn refusals_name_place_problem_and_remedy() {
    let many = "9".repeat(300);
    let long = "x".repeat((1 << 20) + 1);
    for (text, end) in [
        ("v 1 2\n", ":4: a vertex needs 3 numbers, but there are 2; add what is missing or export the model again".to_owned()),
        ("vn 1\n", ":4: a normal needs 3 numbers, but there are 1; add what is missing or export the model again".to_owned()),
        ("vt\n", ":4: a texture coordinate needs 1 number, but there are 0; add what is missing or export the model again".to_owned()),
        ("v 1,5 2 3\n", ":4:3: '1,5' is not a number; write decimals with a point, or export the model with an English number format".to_owned()),
        ("v 1 \x1b[2J 3\n", ":4:5: '\\u{1b}[2J' is not a number; correct the line or export the model again".to_owned()),
        (&format!("v 1 x{many} 3\n"), format!(":4:5: 'x{}…' is not a number; correct the line or export the model again", &many[..59])),
        (&long, ":4: the line is longer than 1048576 bytes; export the model again with shorter statements".to_owned()),
    ] {
        let message = load(Path::new("."), &format!("{TRIANGLE}{text}f 1 2 3\n")).unwrap_err().to_string();
        assert!(message.ends_with(&end), "{message}\nshould end in\n{end}");
    }
}
