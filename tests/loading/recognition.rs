//! Files that are no models, or models of other formats, are refused by name with what to do.

use std::path::Path;

use bvhscope::scene::{LoadOptions, load_bytes};
use bvhscope_engine::cancel::CancelToken;

/// A ZIP archive of empty files.
fn zip(names: &[&str]) -> Vec<u8> {
    let (mut bytes, mut directory) = (Vec::new(), Vec::new());
    for name in names {
        let at = bytes.len() as u32;
        bytes.extend(b"PK\x03\x04");
        bytes.extend([0; 22]);
        bytes.extend((name.len() as u32).to_le_bytes());
        bytes.extend(name.as_bytes());
        directory.extend(b"PK\x01\x02");
        directory.extend([0; 24]);
        directory.extend((name.len() as u32).to_le_bytes());
        directory.extend([0; 10]);
        directory.extend(at.to_le_bytes());
        directory.extend(name.as_bytes());
    }
    let (start, length) = (bytes.len() as u32, directory.len() as u32);
    bytes.extend(directory);
    bytes.extend(b"PK\x05\x06");
    bytes.extend([0; 8]);
    bytes.extend(length.to_le_bytes());
    bytes.extend(start.to_le_bytes());
    bytes.extend([0; 2]);
    bytes
}

fn at(offset: usize, word: &[u8]) -> Vec<u8> {
    let mut bytes = vec![b'x'; offset];
    bytes.extend(word);
    bytes.extend([0, 1, 2, 3]);
    bytes
}

/// One file of each kind that is recognised: part of its name in the message, and its content.
pub fn foreign_files() -> Vec<(&'static str, Vec<u8>)> {
    let text = |text: &str| text.as_bytes().to_vec();
    let mut iges = vec![b' '; 72];
    iges.extend(b"S      1\n");
    let mut bmp = at(0, b"BM\x46\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0");
    bmp.resize(70, 0);
    let utf16: Vec<u8> = "v 0 0 0\nv 1 0 0".encode_utf16().flat_map(u16::to_le_bytes).collect();
    let utf32: Vec<u8> = "solid a\nfacet".chars().flat_map(|letter| (letter as u32).to_be_bytes()).collect();
    vec![
        ("a web page (HTML)", text("\n<!DOCTYPE html>\n<html><body>Not found</body></html>")),
        ("a web page (HTML)", text("<!-- saved --><HTML lang=en>")),
        ("a Git LFS pointer", text("version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n")),
        ("a git-annex pointer", text("/annex/objects/SHA256E-s12345--4d7a.obj\n")),
        ("a file packed twice by gzip", crate::packed::packed(&crate::packed::packed(b"v 0 0 0\n"))),
        ("a bzip2 archive", at(0, b"BZh91AY&SY")),
        ("an xz archive", at(0, b"\xFD7zXZ\0")),
        ("a 7-Zip archive", at(0, b"7z\xBC\xAF\x27\x1C")),
        ("a RAR archive", at(0, b"Rar!\x1A\x07\x01")),
        ("a tar archive", at(257, b"ustar\0")),
        ("a file compressed with zstd", at(0, b"\x28\xB5\x2F\xFD")),
        ("a ZIP archive; unpack it and open 'model/bunny.obj' from it", zip(&["readme.txt", "model/bunny.obj"])),
        ("a ZIP archive; unpack it and open the model from it", zip(&["readme.txt"])),
        ("a 3MF model", zip(&["[Content_Types].xml", "3D/3dmodel.model"])),
        ("a USDZ scene", zip(&["scene.usdc", "wood.png"])),
        ("a KMZ file for Google Earth", zip(&["doc.kml"])),
        ("a FreeCAD document", zip(&["Document.xml", "PartShape.brp"])),
        ("a PDF document", at(0, b"%PDF-1.7\n")),
        ("a PNG picture", at(0, b"\x89PNG\r\n\x1A\n")),
        ("a JPEG picture", at(0, b"\xFF\xD8\xFF\xE0")),
        ("a GIF picture", at(0, b"GIF89a")),
        ("a WebP picture", at(0, b"RIFF\x10\0\0\0WEBPVP8 ")),
        ("a KTX texture", at(0, b"\xABKTX 20\xBB\r\n\x1A\n")),
        ("a DDS texture", at(0, b"DDS \x7C\0\0\0")),
        ("an OpenEXR picture", at(0, b"\x76\x2F\x31\x01\x02")),
        ("a Radiance HDR picture", at(0, b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n")),
        ("a TIFF picture", at(0, b"II*\0")),
        ("a BMP picture", bmp),
        ("a Targa picture", [at(18, b""), b"TRUEVISION-XFILE.\0".to_vec()].concat()),
        ("a Photoshop document", at(0, b"8BPS\0\x01")),
        ("a picture or film in an ISO container", at(4, b"ftypavif")),
        ("an SVG drawing", text("<?xml version='1.0'?>\n<svg xmlns='http://www.w3.org/2000/svg'/>")),
        ("an FBX model", at(0, b"Kaydara FBX Binary  \0\x1A\0")),
        ("an FBX model", text("; FBX 7.3.0 project file\n")),
        ("a USD scene", at(0, b"PXR-USDC\0\x08")),
        ("a USD scene", text("#usda 1.0\n(\n)\n")),
        ("a Blender file", at(0, b"BLENDER-v300")),
        ("a STEP model", text("ISO-10303-21;\nHEADER;\n")),
        ("an IGES model", iges),
        ("a DWG drawing", at(0, b"AC1032\0\0")),
        ("a DXF drawing", text("  0\r\nSECTION\r\n  2\r\nHEADER\r\n")),
        ("a Rhino model", at(0, b"3D Geometry File Format        1")),
        ("a SketchUp model", at(0, b"\xFF\xFE\xFF\x0ES\0k\0e\0")),
        ("a document of a program such as SolidWorks or 3ds Max", at(0, b"\xD0\xCF\x11\xE0\xA1\xB1\x1A\xE1")),
        ("a Maya scene", text("//Maya ASCII 2022 scene\n")),
        ("a LightWave model", at(0, b"FORM\0\0\0\x10LWO2")),
        ("an Alembic scene", at(0, b"Ogawa\xFF\0\x01")),
        ("an HDF5 file, perhaps an Alembic scene", at(0, b"\x89HDF\r\n\x1A\n")),
        ("a COLLADA scene", text("<?xml version=\"1.0\"?>\n<COLLADA version=\"1.4.1\">")),
        ("an X3D scene", text("<?xml version=\"1.0\"?>\n<!DOCTYPE X3D>\n<X3D profile='Immersive'>")),
        ("a VRML scene", text("#VRML V2.0 utf8\nShape {}\n")),
        ("an AMF model", text("<?xml version=\"1.0\"?>\n<amf unit=\"millimeter\">")),
        ("a KML file for Google Earth", text("<kml xmlns='http://www.opengis.net/kml/2.2'>")),
        ("a Mitsuba scene", text("<scene version='3.0.0'>")),
        ("an OFF model", text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")),
        ("a 3DS model", at(0, b"\x4D\x4D\x10\0\0\0\x02\0\x0A\0\0\0\x03\0\0\0")),
        ("a DirectX model", at(0, b"xof 0303txt 0032")),
        ("an AC3D model", text("AC3Db\nMATERIAL\n")),
        ("a MagicaVoxel model", at(0, b"VOX \x96\0\0\0MAIN")),
        ("an OpenVDB volume", at(0, b" BDV\0\0\0\0")),
        ("a VTK data set", text("# vtk DataFile Version 3.0\n")),
        ("a mesh compressed with Draco", at(0, b"DRACO\x02\x02")),
        ("a 3D Tiles file", at(0, b"b3dm\x01\0\0\0")),
        ("a LAS point cloud", at(0, b"LASF\0\0")),
        ("a PCD point cloud", text("# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n")),
        ("an E57 point cloud", at(0, b"ASTM-E57\x01")),
        ("a material library (MTL)", text("# Blender\n\nnewmtl wood\nKd 1 0 0\n")),
        ("a program", at(0, b"\x7FELF\x02\x01")),
        ("an XML document", text("<?xml version=\"1.0\"?>\n<points/>")),
        ("a JSON list, not glTF", text("[{\"x\": 1}]")),
        ("UTF-16 text", utf16),
        ("UTF-32 text", utf32),
    ]
}

fn refusal(name: &str, bytes: &[u8]) -> String {
    let scene = load_bytes(Path::new(name), bytes, &LoadOptions::default(), &CancelToken::new());
    scene.err().map_or_else(|| panic!("{name} is loaded"), |error| error.to_string())
}

/// Whatever the file is called.
#[test]
fn other_files_are_named_with_what_to_do() {
    for (what, bytes) in foreign_files() {
        for name in ["a.obj", "a.stl", "a.ply", "a.gltf", "a.glb", "a"] {
            let message = refusal(name, &bytes);
            let (is, advice) = message.split_once("; ").unwrap_or((&message, ""));
            assert!(message.starts_with(&format!("{name}: is {what}")) && advice.len() > 9, "{what}: {message}");
            assert!(is.len() < 90, "{message}");
        }
    }
}

#[test]
fn what_is_not_known_is_described() {
    let noise: Vec<u8> = (0..2000_u32).map(|k| (k.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    for (name, bytes, part) in [
        ("a.obj", &noise[..], "is binary data that begins with the bytes"),
        ("a.ply", &noise, "is binary data that begins with the bytes"),
        ("a.gltf", &noise, "is binary data that begins with the bytes"),
        ("a", &noise, "is binary data that begins with the bytes"),
        ("a.obj", b"Dear user,\nthis is a letter", "is text that begins with 'Dear user,', not OBJ"),
        ("a.stl", b"hello\n", "is text that begins with 'hello', not STL"),
        ("a.ply", b"hello\n", "is text that begins with 'hello', not PLY"),
        ("a.glb", b"hello\n", "is text that begins with 'hello', not glTF"),
        ("a.obj", &[0; 3000], "holds nothing but zero bytes"),
        ("a.ply", &[0; 70], "holds nothing but zero bytes"),
        ("a.obj", b" \n\t\n", "holds nothing but white space"),
        ("a", &[b'x'; 100_000], "xxx…', neither OBJ, glTF, GLB, PLY, STL, PBRT nor BVH"),
    ] {
        let message = refusal(name, bytes);
        assert!(message.contains(part) && message.len() < 300, "{name}: {message}");
    }
}

/// Models under another model's name.
#[test]
fn content_decides_over_the_name() {
    let stl = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n";
    let obj = "# Blender\nmtllib a.mtl\no a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    for (name, text, format) in
        [("a.obj", stl, "STL"), ("a.ply", stl, "STL"), ("a.stl", obj, "OBJ"), ("a.ply", obj, "OBJ")]
    {
        let scene = load_bytes(Path::new(name), text.as_bytes(), &LoadOptions::default(), &CancelToken::new()).unwrap();
        assert!(scene.warnings.entries.iter().any(|warning| warning.what.contains(format)), "{:?}", scene.warnings);
        assert_eq!(scene.triangles.len(), 1);
    }
}
