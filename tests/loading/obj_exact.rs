//! What a small OBJ file holds is what the scene has, to the number: coordinates, order, colours, texture coordinates, normals.

use std::path::Path;

use bvhscope::scene::{LoadOptions, Scene, load_bytes};
use bvhscope_engine::cancel::CancelToken;
use glam::{Vec2, Vec3};

use crate::obj_generator::valid_obj;
use crate::obj_oracle::{compare, corners};
use crate::random::Random;

fn load(text: &str) -> Scene {
    load_bytes(Path::new("a.obj"), text.as_bytes(), &LoadOptions::default(), &CancelToken::new()).unwrap()
}

/// A square turning to the left, with different coordinates along each axis.
const SQUARE: &str = "v 1 2 3\nv 4 2 3\nv 4 6 3\nv 1 6 3\nvt 0.25 0.75\nvt 0.5 0.125\nvn 0 0 2\nvn 3 0 0\n";

#[test]
fn each_form_of_a_face_gives_its_corners_in_order() {
    let [a, b, c, d] = [[1.0, 2.0, 3.0], [4.0, 2.0, 3.0], [4.0, 6.0, 3.0], [1.0, 6.0, 3.0]].map(Vec3::from_array);
    let [uv, uw] = [Vec2::new(0.25, 0.25), Vec2::new(0.5, 0.875)];
    let (none, flat) = (Vec2::ZERO, Vec3::ZERO);
    for (face, uvs, normals) in [
        ("1 2 3 4", [none; 4], [flat; 4]),
        ("-4 -3 -2 -1", [none; 4], [flat; 4]),
        ("+1 2/ 3// 4", [none; 4], [flat; 4]),
        ("1/1 2/2 3/1 4/2", [uv, uw, uv, uw], [flat; 4]),
        ("1/-2 2/-1 3/-2/ 4/-1", [uv, uw, uv, uw], [flat; 4]),
        ("1//1 2//1 3//2 4//2", [none; 4], [Vec3::Z, Vec3::Z, Vec3::X, Vec3::X]),
        ("1/2/-1 2/2/-1 3/1/-2 \\\n 4/1/1 # all", [uw, uw, uv, uv], [Vec3::X, Vec3::X, Vec3::Z, Vec3::Z]),
    ] {
        let scene = load(&format!("{SQUARE}f {face}\n"));
        assert!(scene.warnings.is_empty(), "{face}: {:?}", scene.warnings);
        let corner = |k: usize| ([a, b, c, d][k], Vec3::ONE, uvs[k], normals[k]);
        assert_eq!(scene.triangles.len(), 2, "{face}");
        assert_eq!(corners(&scene, 0), [0, 1, 2].map(corner), "{face}");
        assert_eq!(corners(&scene, 1), [0, 2, 3].map(corner), "{face}");
    }
}

#[test]
fn colours_are_decoded_from_srgb() {
    let scene = load("v 0 0 0 1 0 0.5\nv 1 0 0\nv 0 1 0 0.04 0.2 1 1\nf 1 2 3\n");
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let [a, b, c] = corners(&scene, 0).map(|corner| corner.1);
    // IEC 61966-2-1 at 0.5, 0.04 and 0.2.
    assert!((a - Vec3::new(1.0, 0.0, 0.214_041)).length() < 1e-5, "{a}");
    assert_eq!(b, Vec3::ONE, "a vertex without a colour is white");
    assert!((c - Vec3::new(0.003_095_975, 0.033_104_77, 1.0)).length() < 1e-5, "{c}");
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
fn valid_files_are_read_as_tobj_reads_them() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.mtl"), crate::obj_generator::LIBRARY).unwrap();
    let mut random = Random(0x0B7);
    for _ in 0..300 {
        compare(folder.path(), &valid_obj(&mut |count| random.below(count)));
    }
}

/// Every statement is looked at once, and the token at least once in each 64 KB and once before the end.
#[test]
fn polls_grow_with_the_size_of_the_file_alone() {
    let polls = |text: &str| {
        let count = std::sync::Arc::new(std::sync::atomic::AtomicU64::new(0));
        let counted = std::sync::Arc::clone(&count);
        let token = CancelToken::watched(move |_| {
            counted.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            false
        });
        let triangle = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{text}f 1 2 3\n");
        load_bytes(Path::new("/nonexistent/a.obj"), triangle.as_bytes(), &LoadOptions::default(), &token).unwrap();
        count.load(std::sync::atomic::Ordering::Relaxed)
    };
    for unit in [
        "g a\nf 1 2 3\n",
        "o a\n",
        "usemtl a\n",
        "f 1 2 3\n",
        "v 1 2 3 1 0 0\n",
        "f 1 2\\\n 3\n",
        "mtllib none\n",
        "x y\n",
    ] {
        let [few, many] = [1 << 18, 1 << 20].map(|bytes| polls(&unit.repeat(bytes / unit.len())));
        assert!((4..16).contains(&few) && many >= 2 * few && many <= 5 * few, "{unit:?}: {few}, {many}");
    }
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
    assert!((both.specular - glam::Vec3::splat(0.08)).abs().max_element() < 1e-6, "{both:?}");
    assert!((grey.specular - glam::Vec3::splat(0.04)).abs().max_element() < 1e-6, "{grey:?}");
    // Colours: 51 is 0.0331 in linear light.
    assert!((texel(both.specular_texture).x - 0.033_105).abs() < 1e-4);
    // Numbers: a fifth of Ns 1000, (2 / 202)^¼ = 0.3154.
    assert_eq!(both.roughness, 1.0);
    assert!((texel(both.roughness_texture).y - 0.315_4).abs() < 0.003);
    assert_eq!((physical.specular_texture, physical.roughness_texture, physical.roughness), (None, None, 0.25));
}
