//! The one list of model file formats: what the loader recognises, the file dialog offers and `--help` names.

use std::path::Path;

/// A model file format that can be loaded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileFormat {
    /// Wavefront OBJ with MTL material libraries.
    Obj,
    /// glTF 2.0, as JSON or as binary GLB.
    Gltf,
    /// Polygon File Format (Stanford), text or binary.
    Ply,
    /// Stereolithography, text or binary.
    Stl,
    /// PBRT scene, of version 4 or 3.
    Pbrt,
    /// A tree file with its triangles.
    Bvh,
}

/// One row of [`FILE_FORMATS`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FormatInfo {
    /// The format.
    pub format: FileFormat,
    /// Names for messages and help: the first is the format's, one for each extension.
    pub names: &'static [&'static str],
    /// File name extensions in lower case, without the dot.
    pub extensions: &'static [&'static str],
    /// MIME types, listed in the desktop entry; none where desktops have none.
    pub mime_types: &'static [&'static str],
}

/// Every model file format, in the order in which help texts name them.
pub const FILE_FORMATS: [FormatInfo; 6] = [
    FormatInfo { format: FileFormat::Obj, names: &["OBJ"], extensions: &["obj"], mime_types: &["model/obj"] },
    FormatInfo {
        format: FileFormat::Gltf,
        names: &["glTF", "GLB"],
        extensions: &["gltf", "glb"],
        mime_types: &["model/gltf+json", "model/gltf-binary"],
    },
    FormatInfo { format: FileFormat::Ply, names: &["PLY"], extensions: &["ply"], mime_types: &["model/x-ply"] },
    FormatInfo { format: FileFormat::Stl, names: &["STL"], extensions: &["stl"], mime_types: &["model/stl"] },
    FormatInfo { format: FileFormat::Pbrt, names: &["PBRT"], extensions: &["pbrt"], mime_types: &["model/x-pbrt"] },
    FormatInfo { format: FileFormat::Bvh, names: &["BVH"], extensions: &["bvh"], mime_types: &[] },
];

impl FileFormat {
    /// The format that the extension of `path` names, in upper or lower case; before "gz", that of a packed file.
    pub fn from_extension(path: &Path) -> Option<Self> {
        let lower = |path: &Path| Some(path.extension()?.to_string_lossy().to_ascii_lowercase());
        let mut extension = lower(path)?;
        if extension == PACKED {
            extension = lower(Path::new(path.file_stem()?))?;
        }
        FILE_FORMATS.iter().find(|row| row.extensions.contains(&extension.as_str())).map(|row| row.format)
    }

    /// The name of the format, as in "glTF".
    pub fn name(self) -> &'static str {
        FILE_FORMATS.iter().find(|row| row.format == self).map_or("", |row| row.names[0])
    }
}

/// Extension of a model that gzip has packed, after its own: "a.ply.gz".
const PACKED: &str = "gz";

/// The extensions of all model files, in lower case without the dot, and that of packed ones.
pub fn model_extensions() -> Vec<&'static str> {
    FILE_FORMATS.iter().flat_map(|row| row.extensions).copied().chain([PACKED]).collect()
}

/// The names of all formats as a phrase: "OBJ, glTF, GLB, PLY, STL, PBRT or BVH" where `last` is "or".
pub fn format_names(last: &str) -> String {
    let names: Vec<&str> = FILE_FORMATS.iter().flat_map(|row| row.names).copied().collect();
    match names.split_last() {
        Some((end, rest)) if !rest.is_empty() => format!("{} {last} {end}", rest.join(", ")),
        _ => names.concat(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extensions_name_their_format_in_any_case() {
        for row in &FILE_FORMATS {
            assert_eq!(row.names.len(), row.extensions.len());
            for extension in row.extensions {
                for name in [format!("a.{extension}"), format!("a.b.{}", extension.to_uppercase())] {
                    assert_eq!(FileFormat::from_extension(Path::new(&name)), Some(row.format), "{name}");
                }
            }
        }
        for (name, format) in [
            ("obj", None),
            ("a.gz", None),
            ("a.tar.gz", None),
            ("a.gz.gz", None),
            (".obj.gz", None),
            ("a.ply.GZ", Some(FileFormat::Ply)),
        ] {
            assert_eq!(FileFormat::from_extension(Path::new(name)), format, "{name}");
        }
        assert_eq!(format_names("or"), "OBJ, glTF, GLB, PLY, STL, PBRT or BVH");
    }

    #[test]
    fn the_desktop_entry_names_the_types_of_all_formats() {
        let entry = include_str!("../../assets/bvhscope.desktop");
        let types = entry.lines().find_map(|line| line.strip_prefix("MimeType=")).unwrap_or_default();
        let of_table: Vec<&str> = FILE_FORMATS.iter().flat_map(|row| row.mime_types).copied().collect();
        assert_eq!(types.split_terminator(';').collect::<Vec<_>>(), of_table);
    }

    #[test]
    fn every_format_has_one_row() {
        use FileFormat::{Bvh, Gltf, Obj, Pbrt, Ply, Stl};
        for format in [Obj, Gltf, Ply, Stl, Pbrt, Bvh] {
            assert_eq!(FILE_FORMATS.iter().filter(|row| row.format == format).count(), 1, "{format:?}");
        }
    }
}
