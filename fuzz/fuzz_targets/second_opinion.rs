#![no_main]
//! Sound OBJ and glTF files, made from the bytes, beside the crates tobj and gltf used plainly.

#[path = "../../tests/loading/gltf_oracle.rs"]
mod gltf_oracle;
#[path = "../../tests/loading/obj/generator.rs"]
mod generator;
#[path = "../../tests/loading/obj/obj_oracle.rs"]
mod oracle;
#[path = "../../tests/support/sound_gltf.rs"]
mod sound_gltf;

use std::sync::LazyLock;

/// The folder of the material library that each OBJ file names.
static FOLDER: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("a.mtl"), generator::LIBRARY).expect("a library");
    folder
});

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    // Two bytes decide at a time; zeros once they are used up.
    let mut pairs = bytes.chunks(2).map(|pair| u64::from(pair[0]) << 8 | u64::from(*pair.get(1).unwrap_or(&0)));
    let mut next = || pairs.next().unwrap_or(0);
    if next() % 2 == 0 {
        let text = generator::valid_obj(&mut |count| (next() % count as u64) as usize);
        oracle::compare(FOLDER.path(), &text);
    } else {
        let text = sound_gltf::generate(&mut sound_gltf::Choices::new(&mut next));
        gltf_oracle::compare_text("fuzzed", &text);
    }
});
