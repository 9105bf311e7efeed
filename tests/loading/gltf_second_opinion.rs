//! The reader beside the crate `gltf` used plainly: generated files and real models.

use crate::gltf_oracle::{compare, compare_text};
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

#[test]
fn small_models_have_the_triangles_and_bounds_of_a_plain_reading() {
    let Some(folder) = models() else { return };
    let mut checked = 0;
    for entry in std::fs::read_dir(folder.join("gltf")).unwrap().flatten() {
        for file in std::fs::read_dir(entry.path()).into_iter().flatten().flatten() {
            let path = file.path();
            let bytes = std::fs::read(&path).unwrap_or_default();
            if !path.extension().is_some_and(|e| e == "glb" || e == "gltf") || bytes.len() > 4_000_000 {
                continue;
            }
            // Files that need an extension are refused by the crate, and it knows no copies.
            let Ok(gltf::Gltf { document, mut blob }) = gltf::Gltf::from_slice(&bytes) else { continue };
            let used = document.extensions_used().any(|name| name.contains("instancing"));
            let data: Option<Vec<Vec<u8>>> = document
                .buffers()
                .map(|buffer| match buffer.source() {
                    gltf::buffer::Source::Bin => blob.take(),
                    gltf::buffer::Source::Uri(uri) => std::fs::read(path.with_file_name(uri)).ok(),
                })
                .collect();
            let Some(data) = data.filter(|_| !used) else { continue };
            compare(&path.display().to_string(), &path, &bytes, &document, &data);
            checked += 1;
        }
    }
    assert!(checked >= 10, "only {checked} models were compared");
}
