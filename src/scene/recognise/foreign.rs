//! Files that are no models, or models of other formats: how each is recognised, its name, and what to do with it.

use super::zip::{self, EXPORT};
use super::{SAVE_AS_UTF8, wide_encoding};
use crate::scene::read::beginning;

const CONVERT: &str = "convert it to glTF, OBJ, PLY or STL, for example with Blender";
const FROM_CAD: &str = "export STL, OBJ or glTF from a CAD program such as FreeCAD";
const MESH_POINTS: &str = "it holds points; make a mesh of them, for example with CloudCompare or MeshLab";
const NAME_THE_MODEL: &str = "name the model that it belongs to";
const UNPACK: &str = "unpack it and open the model from it";

/// How a kind of file is recognised.
enum Sign {
    /// Bytes at an offset.
    At(usize, &'static [u8]),
    /// The beginning of the text, in upper or lower case, after white space.
    Text(&'static str),
    /// The root element of an XML document.
    Root(&'static str),
    /// Anything else.
    Test(fn(&[u8]) -> bool),
}

use Sign::{At, Root, Test, Text};

/// Name, signs of which one is enough, and advice. The first that fits counts.
const KINDS: &[(&str, &[Sign], &str)] = &[
    (
        "a web page (HTML)",
        &[Text("<!doctype html"), Root("html"), Root("head"), Root("body")],
        "download the file itself (on a code host the raw file), not the page that shows it",
    ),
    ("a Git LFS pointer", &[Text("version https://git-lfs.")], "run 'git lfs pull' in its repository"),
    ("a git-annex pointer", &[Text("/annex/objects/")], "run 'git annex get' on it in its repository"),
    // The packed file itself has been unpacked.
    ("a file packed twice by gzip", &[At(0, b"\x1F\x8B\x08")], "unpack it with 'gunzip'"),
    ("a bzip2 archive", &[Test(is_bzip2)], UNPACK),
    ("an xz archive", &[At(0, b"\xFD7zXZ\0")], UNPACK),
    ("a 7-Zip archive", &[At(0, b"7z\xBC\xAF\x27\x1C")], UNPACK),
    ("a RAR archive", &[At(0, b"Rar!\x1A\x07")], UNPACK),
    ("a tar archive", &[At(257, b"ustar")], UNPACK),
    (
        "a file compressed with zstd",
        &[At(0, b"\x28\xB5\x2F\xFD")],
        "if it is a Blender file, export glTF from Blender; otherwise unpack it with 'unzstd'",
    ),
    ("a PDF document", &[At(0, b"%PDF-")], "name a model; a 3D PDF must be exported by the program that made it"),
    ("a PNG picture", &[At(0, b"\x89PNG\r\n\x1A\n")], NAME_THE_MODEL),
    ("a JPEG picture", &[At(0, b"\xFF\xD8\xFF")], NAME_THE_MODEL),
    ("a GIF picture", &[At(0, b"GIF87a"), At(0, b"GIF89a")], NAME_THE_MODEL),
    ("a WebP picture", &[Test(|bytes| bytes.starts_with(b"RIFF") && starts_at(bytes, 8, b"WEBP"))], NAME_THE_MODEL),
    ("a KTX texture", &[At(0, b"\xABKTX ")], NAME_THE_MODEL),
    ("a DDS texture", &[At(0, b"DDS \x7C\0\0\0")], NAME_THE_MODEL),
    ("an OpenEXR picture", &[At(0, b"\x76\x2F\x31\x01")], NAME_THE_MODEL),
    ("a Radiance HDR picture", &[At(0, b"#?RADIANCE"), At(0, b"#?RGBE")], NAME_THE_MODEL),
    ("a TIFF picture", &[At(0, b"II*\0"), At(0, b"MM\0*")], NAME_THE_MODEL),
    ("a BMP picture", &[Test(is_bmp)], NAME_THE_MODEL),
    ("a Targa picture", &[Test(|bytes| bytes.ends_with(b"TRUEVISION-XFILE.\0"))], NAME_THE_MODEL),
    ("a Photoshop document", &[At(0, b"8BPS\0")], NAME_THE_MODEL),
    ("a picture or film in an ISO container", &[At(4, b"ftyp")], NAME_THE_MODEL),
    ("an SVG drawing", &[Root("svg")], NAME_THE_MODEL),
    ("an FBX model", &[At(0, b"Kaydara FBX Binary"), Text("; FBX ")], CONVERT),
    ("a USD scene", &[At(0, b"PXR-USDC"), Text("#usda ")], CONVERT),
    ("a Blender file", &[At(0, b"BLENDER")], "open it in Blender and export glTF"),
    ("a STEP model", &[Text("ISO-10303-21")], FROM_CAD),
    ("an IGES model", &[Test(is_iges)], FROM_CAD),
    ("a DWG drawing", &[Test(is_dwg)], FROM_CAD),
    ("a DXF drawing", &[Test(is_dxf)], FROM_CAD),
    ("a Rhino model", &[At(0, b"3D Geometry File Format")], EXPORT),
    ("a SketchUp model", &[At(0, b"\xFF\xFE\xFF\x0E")], EXPORT),
    ("a document of a program such as SolidWorks or 3ds Max", &[At(0, b"\xD0\xCF\x11\xE0\xA1\xB1\x1A\xE1")], EXPORT),
    ("a Maya scene", &[Text("//Maya ASCII"), At(0, b"FOR4"), At(0, b"FOR8")], EXPORT),
    ("a LightWave model", &[Test(|bytes| bytes.starts_with(b"FORM") && starts_at(bytes, 8, b"LWO"))], CONVERT),
    ("an Alembic scene", &[At(0, b"Ogawa")], CONVERT),
    ("an HDF5 file, perhaps an Alembic scene", &[At(0, b"\x89HDF\r\n\x1A\n")], CONVERT),
    ("a COLLADA scene", &[Root("COLLADA")], CONVERT),
    ("an X3D scene", &[Root("X3D"), Text("#X3D ")], CONVERT),
    ("a VRML scene", &[Text("#VRML ")], CONVERT),
    ("an AMF model", &[Root("amf")], CONVERT),
    ("a KML file for Google Earth", &[Root("kml")], EXPORT),
    ("a Mitsuba scene", &[Root("scene")], EXPORT),
    ("an OFF model", &[Test(is_off)], CONVERT),
    ("a 3DS model", &[Test(is_3ds)], CONVERT),
    ("a DirectX model", &[At(0, b"xof 0")], CONVERT),
    ("an AC3D model", &[At(0, b"AC3D")], CONVERT),
    ("a MagicaVoxel model", &[At(0, b"VOX \x96\0\0\0"), At(0, b"VOX \xC8\0\0\0")], EXPORT),
    ("an OpenVDB volume", &[At(0, b" BDV")], EXPORT),
    ("a VTK data set", &[Text("# vtk DataFile"), Root("VTKFile")], "open it in ParaView and export PLY or STL"),
    ("a mesh compressed with Draco", &[At(0, b"DRACO")], "unpack it with 'draco_decoder' into OBJ or PLY"),
    ("a 3D Tiles file", &[At(0, b"b3dm"), At(0, b"i3dm"), At(0, b"pnts"), At(0, b"cmpt")], EXPORT),
    ("a LAS point cloud", &[At(0, b"LASF")], MESH_POINTS),
    ("a PCD point cloud", &[Text("# .PCD"), Text("VERSION .7\n"), Text("VERSION 0.7\n")], MESH_POINTS),
    ("an E57 point cloud", &[At(0, b"ASTM-E57")], MESH_POINTS),
    ("a material library (MTL)", &[Test(is_mtl)], "name the OBJ file that uses it"),
    ("a program", &[At(0, b"\x7FELF"), At(0, b"MZ\x90\0")], "name a model"),
    ("an XML document", &[Text("<?xml")], EXPORT),
    ("a JSON list, not glTF", &[Test(is_json_list)], EXPORT),
];

/// The name of what the bytes are and what to do, if it is known and no model that can be read.
pub(super) fn find(bytes: &[u8]) -> Option<(String, String)> {
    if bytes.starts_with(b"PK\x03\x04") || bytes.starts_with(b"PK\x05\x06") {
        let (what, advice) = zip::describe(bytes);
        return Some((what.to_owned(), advice));
    }
    let text = beginning(bytes);
    let root = root_element(text);
    let fits = |sign: &Sign| match sign {
        At(at, word) => starts_at(bytes, *at, word),
        Text(word) => text.get(..word.len()).is_some_and(|start| start.eq_ignore_ascii_case(word.as_bytes())),
        Root(name) => root.is_some_and(|root| root.eq_ignore_ascii_case(name.as_bytes())),
        Test(test) => test(bytes),
    };
    let known = KINDS.iter().find(|(_, signs, _)| signs.iter().any(fits));
    if let Some((name, _, advice)) = known {
        return Some(((*name).to_owned(), (*advice).to_owned()));
    }
    wide_encoding(bytes).map(|encoding| (format!("{encoding} text"), SAVE_AS_UTF8.to_owned()))
}

fn starts_at(bytes: &[u8], at: usize, word: &[u8]) -> bool {
    bytes.get(at..).is_some_and(|rest| rest.starts_with(word))
}

/// The name of the first element of an XML or HTML document, without its namespace.
fn root_element(text: &[u8]) -> Option<&[u8]> {
    let text = text.get(..4096).unwrap_or(text);
    if !text.starts_with(b"<") {
        return None;
    }
    let start = text.windows(2).position(|pair| pair[0] == b'<' && pair[1].is_ascii_alphabetic())?;
    let name = text.get(start.saturating_add(1)..)?;
    let end =
        name.iter().position(|byte| byte.is_ascii_whitespace() || matches!(byte, b'>' | b'/')).unwrap_or(name.len());
    name.get(..end)?.rsplit(|&byte| byte == b':').next()
}

fn is_bzip2(bytes: &[u8]) -> bool {
    bytes.starts_with(b"BZh") && starts_at(bytes, 4, b"1AY&SY")
}

fn is_bmp(bytes: &[u8]) -> bool {
    bytes.starts_with(b"BM") && starts_at(bytes, 6, &[0; 4]) && matches!(bytes.get(14), Some(12 | 40 | 108 | 124))
}

/// Lines of 80 columns, of which the 73rd names the section and the rest count its lines.
fn is_iges(bytes: &[u8]) -> bool {
    bytes.get(72) == Some(&b'S') && starts_at(bytes, 73, b"      1") && !bytes[..72].contains(&b'\n')
}

fn is_dwg(bytes: &[u8]) -> bool {
    bytes.starts_with(b"AC10") && bytes.get(4..6).is_some_and(|digits| digits.iter().all(u8::is_ascii_digit))
}

fn is_dxf(bytes: &[u8]) -> bool {
    let rest = beginning(bytes).strip_prefix(b"0");
    bytes.starts_with(b"AutoCAD Binary DXF") || rest.is_some_and(|rest| beginning(rest).starts_with(b"SECTION"))
}

fn is_off(bytes: &[u8]) -> bool {
    let text = beginning(bytes);
    let end = text.iter().take(8).position(u8::is_ascii_whitespace).unwrap_or_default();
    matches!(&text[..end], b"OFF" | b"COFF" | b"NOFF" | b"STOFF" | b"CNOFF" | b"4OFF" | b"nOFF")
}

/// A chunk of the whole file, whose first part is the version or the editor's data.
fn is_3ds(bytes: &[u8]) -> bool {
    let length = bytes.get(2..6).and_then(|part| <[u8; 4]>::try_from(part).ok()).map(u32::from_le_bytes);
    bytes.starts_with(b"\x4D\x4D")
        && length.is_some_and(|length| u64::from(length) <= bytes.len() as u64)
        && (starts_at(bytes, 6, b"\x02\0") || starts_at(bytes, 6, b"\x3D\x3D"))
}

fn is_mtl(bytes: &[u8]) -> bool {
    super::lines_of(beginning(bytes)).next().is_some_and(|line| line.starts_with(b"newmtl"))
}

fn is_json_list(bytes: &[u8]) -> bool {
    let rest = beginning(bytes).strip_prefix(b"[").map(<[u8]>::trim_ascii_start);
    rest.is_some_and(|rest| rest.first().is_some_and(|byte| b"[{\"]-0123456789".contains(byte)))
}
