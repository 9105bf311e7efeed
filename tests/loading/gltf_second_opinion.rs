//! Triangles and bounds of the glTF reader beside those of others: generated files by the crate's own reading, and models by a third
//! program whose results are written down beside them.

use bvhscope::scene::{LoadOptions, SceneSource, load};
use bvhscope_engine::cancel::CancelToken;
use glam::Vec3;

use crate::gltf_oracle::compare_text;
use crate::random::Random;
use crate::sound_gltf::{Choices, generate};
use crate::support::models;

#[test]
fn generated_files_have_the_triangles_and_bounds_of_a_plain_reading() {
    let mut random = Random(0x617F);
    for round in 0..300 {
        let text = generate(&mut Choices::new(&mut || random.next()));
        compare_text(&format!("round {round}"), &text);
    }
}

/// Three numbers.
fn corner(text: &str) -> Vec3 {
    let numbers: Vec<f32> = text.split_whitespace().map(|number| number.parse().unwrap()).collect();
    Vec3::from_slice(&numbers)
}

#[test]
fn models_have_the_triangles_and_bounds_that_another_program_found() {
    let Some(folder) = models() else { return };
    let manifest = std::fs::read_to_string(folder.join("MANIFEST.md")).unwrap();
    let mut checked = 0;
    for row in manifest.lines().filter(|row| row.starts_with("| gltf/")) {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let [name, triangles, bytes, bounds] = [cells[1], cells[2], cells[3], cells[4]];
        // The other program shows skinned meshes where their nodes are, and bounds without copies and morph targets. Large files take long.
        if ["CesiumMan", "RecursiveSkeletons", "SimpleSkin", "SimpleInstancing", "MorphPrimitivesTest"]
            .iter()
            .any(|skinned| name.contains(skinned))
            || bytes.replace(',', "").parse::<u32>().unwrap() > 1_000_000
        {
            continue;
        }
        let source = SceneSource::File(folder.join(name));
        let scene = load(&source, &LoadOptions::default(), &CancelToken::new()).unwrap();
        assert_eq!(scene.triangles.len(), triangles.replace(',', "").parse::<usize>().unwrap(), "{name}");
        let (min, max) = bounds.split_once(" / ").unwrap();
        let (min, max) = (corner(min), corner(max));
        // Bounds are written down with five digits.
        let tolerance = 1e-4 * max.abs().max(min.abs()).max_element();
        // The other program took the boxes of turned meshes for what they hold, so that its bounds may be larger.
        let (below, above) = (min - scene.bounds.min, scene.bounds.max - max);
        assert!(below.max(above).max_element() <= tolerance, "{name}: {:?} instead of {min} to {max}", scene.bounds);
        checked += u32::from(below.min(above).min_element() >= -tolerance);
    }
    assert!(checked >= 16, "only {checked} models have the same bounds");
}
