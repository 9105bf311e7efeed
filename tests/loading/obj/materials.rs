//! Materials of OBJ files: where they change, how libraries, materials and textures are named, and what their maps become.

use bvhscope::scene::{LoadOptions, Scene, load_bytes};
use bvhscope_engine::cancel::CancelToken;
use glam::Vec3;

use crate::formats::load_path;

/// A triangle with texture coordinates.
const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n";

/// Loads an OBJ file beside a red texture `t.png` and `a.mtl`.
fn load_beside(library: &str, text: &str) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    image::RgbaImage::from_pixel(1, 1, image::Rgba([255, 0, 0, 255])).save(folder.path().join("t.png")).unwrap();
    std::fs::write(folder.path().join("a.mtl"), library).unwrap();
    let path = folder.path().join("m.obj");
    load_bytes(&path, text.as_bytes(), &LoadOptions::default(), &CancelToken::new()).unwrap()
}

#[test]
fn libraries_may_be_named_after_their_materials() {
    let library = "newmtl red\nKd 1 0 0\nnewmtl a b\nKd 0 0 1\n";
    for (text, color) in [
        ("usemtl red\nmtllib a.mtl\nf 1 2 3\n", Vec3::X),
        ("usemtl red\nf 1 2 3\nmtllib a.mtl\n", Vec3::X),
        ("usemtl red # its colour\nf 1 2 3\nmtllib a.mtl\n", Vec3::X),
        ("usemtl none\nusemtl a b\nf 1 2 3\nusemtl red\nmtllib a.mtl\n", Vec3::Z),
    ] {
        let scene = load_beside(library, &format!("{TRIANGLE}{text}"));
        assert_eq!(scene.material(0).base_color, color, "{text}");
        let undefined = usize::from(text.contains("none"));
        assert_eq!(scene.warnings.entries.len(), undefined, "{text}: {:?}", scene.warnings);
    }
}

#[test]
fn names_of_textures_may_have_options_quotes_comments_and_folders_of_other_machines() {
    for name in [
        "t.png -s 1 1 1",
        "\"t.png\"",
        "C:\\models\\t.png",
        "C:/models/T.PNG",
        "/home/somebody/models/t.png",
        "..\\textures\\t.png",
        "-blendu on \"t.png\" # wood",
        "t.png # wood",
        "'t.png'",
    ] {
        for keyword in ["map_Kd", "map_Ke", "bump", "map_Bump", "norm", "map_Pr"] {
            let text = format!("mtllib a.mtl\n{TRIANGLE}usemtl a\nf 1/1 2/2 3/3\n");
            let scene = load_beside(&format!("newmtl a\n{keyword} {name}\n"), &text);
            assert!(scene.warnings.is_empty(), "{keyword} {name}: {:?}", scene.warnings);
            assert!(!scene.textures.is_empty(), "{keyword} {name}");
        }
    }
    let scene =
        load_beside("newmtl a\nbump t.png -bm 0.25\n", &format!("mtllib a.mtl\n{TRIANGLE}usemtl a\nf 1/1 2/2 3/3\n"));
    assert_eq!(scene.material(0).normal_scale, 0.25);
}

#[test]
fn names_of_libraries_and_materials_may_have_quotes_and_comments() {
    for (library, material) in
        [("\"a.mtl\"", "red"), ("a.mtl # ours", "\"red\""), ("none.mtl a.mtl", "red # as a rose")]
    {
        let scene =
            load_beside("newmtl red\nKd 1 0 0\n", &format!("mtllib {library}\n{TRIANGLE}usemtl {material}\nf 1 2 3\n"));
        assert_eq!(scene.material(0).base_color, Vec3::X, "{library}, {material}: {:?}", scene.warnings);
    }
    // A name that has a hash or quotes is itself.
    let library = "newmtl \"a\"\nKd 1 0 0\nnewmtl a\nKd 0 1 0\nnewmtl a # 2\nKd 0 0 1\n";
    for (material, color) in [("\"a\"", Vec3::X), ("a", Vec3::Y), ("a # 2", Vec3::Z), ("a # 3", Vec3::Y)] {
        let scene = load_beside(library, &format!("mtllib a.mtl\n{TRIANGLE}usemtl {material}\nf 1 2 3\n"));
        assert_eq!(scene.material(0).base_color, color, "{material}");
    }
}

#[test]
fn of_a_material_in_two_libraries_the_first_is_used() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.mtl"), "newmtl m\nKd 0 0 1\nnewmtl m\nKd 1 0 0\n").unwrap();
    std::fs::write(folder.path().join("b.mtl"), "newmtl m\nKd 0 1 0\n").unwrap();
    let model = folder.path().join("m.obj");
    std::fs::write(&model, format!("mtllib a.mtl\nmtllib b.mtl\n{TRIANGLE}usemtl m\nf 1 2 3\n")).unwrap();
    let scene = load_path(&model).unwrap();
    assert_eq!(scene.material(0).base_color, Vec3::X, "of two in a library the last");
    let warnings: Vec<String> = scene.warnings.entries.iter().map(ToString::to_string).collect();
    let expected = [
        "1 material defined again, of which the last definition is used (first at a.mtl:3)",
        "1 material of an earlier library defined again, which is not used (first at b.mtl:1)",
    ];
    assert_eq!(warnings, expected);
}

#[test]
fn missing_textures_of_many_materials_are_one_warning() {
    let library: String = (0..1000).map(|k| format!("newmtl m{k}\nmap_Kd t{k}.jpg\n")).collect();
    let scene = load_beside(&library, &format!("mtllib a.mtl\n{TRIANGLE}usemtl m7\nf 1/1 2/2 3/3\n"));
    let warnings: Vec<String> = scene.warnings.entries.iter().map(ToString::to_string).collect();
    assert_eq!(warnings, ["1000 images left out: 't0.jpg' …: there is no such file (first at a.mtl:2)"]);
}

#[test]
fn materials_change_where_the_file_says() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.mtl"), "newmtl a\nKd 0.25 0.5 1\nKe 0 2 0\nnewmtl b c\r\nKd 0.5 # grey\n")
        .unwrap();
    let text =
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nmtllib a.mtl\nusemtl a\nf 1 2 3\nusemtl b c\nf 1 2 3\nusemtl a\nf 1 2 3\n";
    let model = folder.path().join("a.obj");
    let scene = load_bytes(&model, text.as_bytes(), &LoadOptions::default(), &CancelToken::new()).unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let names: Vec<&str> = (0..4).map(|k| scene.material(k).name.as_str()).collect();
    assert_eq!(names, ["", "a", "b c", "a"]);
    assert_eq!(scene.material(1).base_color, Vec3::new(0.25, 0.5, 1.0));
    assert_eq!(scene.material(1).emissive, Vec3::new(0.0, 2.0, 0.0));
    assert_eq!(scene.material(2).base_color, Vec3::splat(0.5));
    assert_eq!(scene.files_read, [folder.path().join("a.mtl").canonicalize().unwrap()]);
}

#[test]
fn maps_of_highlights_become_reflectance_and_roughness() {
    let folder = tempfile::tempdir().unwrap();
    image::RgbaImage::from_pixel(1, 1, image::Rgba([51, 255, 0, 255])).save(folder.path().join("a.png")).unwrap();
    let library = "newmtl both\nKd 0.5 0.5 0.5\nKs 0 0 0\nmap_Ks a.png\nmap_Ns a.png\nNs 1000\n\
                   newmtl grey\nKd 0.5 0.5 0.5\nKs 0.5\nmap_Ks a.png\n\
                   newmtl physical\nmap_Ks a.png\nmap_Ns a.png\nPr 0.25\n";
    std::fs::write(folder.path().join("a.mtl"), library).unwrap();
    let text = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl both\nf 1 2 3\nusemtl grey\nf 1 2 3\nusemtl physical\nf 1 2 3\n";
    let path = folder.path().join("a.obj");
    let scene = load_bytes(&path, text.as_bytes(), &LoadOptions::default(), &CancelToken::new()).unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let [both, grey, physical] = [0, 1, 2].map(|triangle| scene.material(triangle));
    let texel = |texture: Option<u32>| scene.textures[texture.unwrap() as usize].sample(glam::Vec2::splat(0.5));
    // A black Ks is that of exporters that write the map only; 8 % is the reflectance of white.
    assert!((both.specular - Vec3::splat(0.08)).abs().max_element() < 1e-6, "{both:?}");
    assert!((grey.specular - Vec3::splat(0.04)).abs().max_element() < 1e-6, "{grey:?}");
    // Colours: 51 is 0.0331 in linear light.
    assert!((texel(both.specular_texture).x - 0.033_105).abs() < 1e-4);
    // Numbers: a fifth of Ns 1000, (2 / 202)^¼ = 0.3154.
    assert_eq!(both.roughness, 1.0);
    assert!((texel(both.roughness_texture).y - 0.315_4).abs() < 0.003);
    assert_eq!((physical.specular_texture, physical.roughness_texture, physical.roughness), (None, None, 0.25));
}

#[test]
fn materials_and_textures_are_found_beside_the_model() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::create_dir(at("tex")).unwrap();
    image::RgbaImage::from_pixel(2, 2, image::Rgba([255, 0, 0, 255])).save(at("tex/Red.PNG")).unwrap();
    std::fs::write(at("m.mtl"), "newmtl a\nKd 0.5\nnewmtl b\nKd 1 1 1\nmap_Kd -s 1 1 1 TEX\\red.png\n").unwrap();
    let text = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1 2 3\nusemtl b\nf 1/1 2/1 3/1\nusemtl c\nf 1 2 3";
    std::fs::write(at("m.obj"), text).unwrap();
    let scene = load_path(&at("m.obj")).unwrap();
    assert_eq!(scene.material(0).base_color, Vec3::splat(0.5));
    assert_eq!(scene.material(2).name, "", "{:?}", scene.materials);
    let texture = &scene.textures[scene.material(1).base_color_texture.unwrap() as usize];
    assert_eq!(texture.sample(glam::Vec2::splat(0.3)), glam::Vec4::new(1.0, 0.0, 0.0, 1.0));
}

#[test]
fn an_endless_material_library_is_limited() {
    let folder = tempfile::tempdir().unwrap();
    let library: String = (0..70_000).map(|k| format!("newmtl m{k}\nKd 1 0 0\n")).collect();
    std::fs::write(folder.path().join("m.mtl"), library).unwrap();
    let model = folder.path().join("m.obj");
    let square = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    std::fs::write(&model, format!("mtllib m.mtl\n{square}usemtl m65535\nf 1 2 3\nusemtl m65536\nf 3 2 1\n")).unwrap();
    let scene = load_path(&model).unwrap();
    let material = |triangle: usize| &scene.materials[scene.material_indices[triangle] as usize];
    assert_eq!((material(0).name.as_str(), material(0).base_color.to_array()), ("m65535", [1.0, 0.0, 0.0]));
    assert_ne!(material(1).name, "m65536", "one too many");
    assert!(scene.materials.len() <= 65_537, "{}", scene.materials.len());
    let warnings: Vec<String> = scene.warnings.entries.iter().map(ToString::to_string).collect();
    assert!(warnings.iter().any(|warning| warning.contains("beyond 65536 left out")), "{warnings:?}");
}
