//! Models packed by gzip, sound, damaged, and such as become much larger than they are.

use std::io::Write as _;
use std::path::Path;

use bvhscope::scene::{LoadError, LoadOptions, Scene, load_bytes};
use bvhscope_engine::cancel::CancelToken;
use flate2::Compression;
use flate2::write::GzEncoder;

use crate::formats::load_path;

pub fn packed(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

fn load(name: &str, bytes: &[u8]) -> Result<Scene, LoadError> {
    load_bytes(Path::new(name), bytes, &LoadOptions::default(), &CancelToken::new())
}

const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                   element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
const STL: &str =
    "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n";

#[test]
fn packed_models_of_every_format_load() {
    let mut binary = vec![b' '; 80];
    binary.extend(1_u32.to_le_bytes());
    binary
        .extend([0.0_f32, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|x| x.to_le_bytes()));
    binary.extend([0; 2]);
    for (name, bytes) in [
        ("a.obj.gz", OBJ.as_bytes()),
        ("a.ply.gz", PLY.as_bytes()),
        ("a.stl.gz", STL.as_bytes()),
        ("b.STL.GZ", &binary),
        ("a.ply", PLY.as_bytes()),
        ("a", OBJ.as_bytes()),
    ] {
        let scene = load(name, &packed(bytes)).unwrap();
        assert_eq!((scene.triangles.len(), scene.warnings.is_empty()), (1, true), "{name}: {:?}", scene.warnings);
    }
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.mtl"), "newmtl a\nKd 1 0 0\n").unwrap();
    let model = folder.path().join("a.obj.gz");
    // Two packed files in a row are one, as gzip has it.
    let parts = [packed(b"mtllib a.mtl\nusemtl a\n"), packed(OBJ.as_bytes())].concat();
    std::fs::write(&model, parts).unwrap();
    let scene = load_path(&model).unwrap();
    assert_eq!(scene.material(0).base_color, glam::Vec3::X);
    assert_eq!(scene.files_read.len(), 2);
}

#[test]
fn damaged_packed_models_are_refused() {
    let sound = packed(PLY.as_bytes());
    for length in 3..sound.len() {
        let message = load("a.ply.gz", &sound[..length]).unwrap_err().to_string();
        assert!(message.contains("cannot be unpacked beyond byte"), "{length}: {message}");
    }
    for at in 3..sound.len() {
        let mut bytes = sound.clone();
        bytes[at] ^= 0x55;
        // Time and system in the header mean nothing; elsewhere there is a checksum.
        let result = load("a.ply.gz", &bytes);
        assert!(at < 10 || result.is_err(), "byte {at}");
    }
    let twice = load("a.ply.gz", &packed(&sound)).unwrap_err().to_string();
    assert!(twice.contains("packed twice"), "{twice}");
    let empty = load("a.ply.gz", &packed(b"")).unwrap_err().to_string();
    assert!(empty.contains("is empty"), "{empty}");
}

#[test]
fn unpacking_is_cancelled() {
    let zeros = packed(&vec![b' '; 64 << 20]);
    assert!(zeros.len() < 1 << 20);
    let token = CancelToken::watched(|poll| poll == 3);
    let result = load_bytes(Path::new("a.obj.gz"), &zeros, &LoadOptions::default(), &token);
    assert!(matches!(result, Err(LoadError::Cancelled(_))));
}
