//! Wavefront OBJ loader: the crate tobj reads vertices, faces and material libraries, behind guards that repair, leave out and count
//! what it does not bear.

mod definition;
mod face;
mod guard;
mod library;
mod library_values;
mod materials;
mod mesh;
mod rules;
mod statement;

use super::assemble::Assembly;
use super::error::LoadError;
use super::images::Images;
use super::read::ModelFile;
use materials::Materials;
use rules::Rules;

/// Polygons stay whole, since tobj would make fans of concave ones; a vertex for each triple of indices.
const SETTINGS: tobj::LoadOptions =
    tobj::LoadOptions { single_index: true, triangulate: false, ignore_points: true, ignore_lines: true };

/// Loads an OBJ file from memory.
pub(super) fn load(file: &ModelFile<'_>, assembly: &mut Assembly) -> Result<(), LoadError> {
    let warnings = assembly.warnings.clone();
    let mut is_colored = false;
    loop {
        let materials = Materials::new(Images::new(file));
        let mut rules = Rules::new(is_colored, materials, assembly);
        if let Some(models) = guard::read(file, &mut rules)? {
            let Rules { counts, parts, materials, assembly, .. } = rules;
            assembly.point_count = counts[0] as u64;
            materials.finish(assembly);
            return mesh::add(file, models, &parts, assembly);
        }
        drop(rules);
        // tobj counts colours rather than the positions that have them, so once one has, all must.
        is_colored = true;
        *assembly = Assembly::new();
        assembly.warnings.clone_from(&warnings);
    }
}
