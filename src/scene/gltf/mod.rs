//! glTF 2.0 and GLB loader, through the crate `gltf`.
//!
//! Files are taken as they come, not as the specification wants them: what can be shown is shown, and what a file announces and
//! the scene does not hold is counted as a warning with its place in the JSON. The crate gets repaired JSON and reads no files;
//! every count and length is checked before it is used.

mod accessor;
mod animation;
mod announced;
mod attributes;
mod cameras;
mod deform;
mod document;
mod draco;
mod expand;
mod glb;
mod instances;
mod material;
mod meshopt;
mod nodes;
mod primitive;
mod repair;
mod rig;
mod skin;
mod table;
mod transform;
mod uri;

use self::accessor::{AccessorError, Accessors};
use self::animation::Animations;
use self::document::Document;
use self::expand::{Copies, MAX_TRIANGLES, counts, expand};
use self::nodes::{Hierarchy, Ordered};
use self::primitive::{Decoded, MaterialUse, Primitive, declared_triangles};
use self::skin::Skins;
use super::assemble::Assembly;
use super::error::{FileLocation, LoadError};
use super::flatten::check_count;
use super::images::Images;
use super::options::Instancing;
use super::read::ModelFile;
use super::two_levels::check_copies;
use crate::text::counted;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// Loads a glTF or GLB file from memory.
pub(super) fn load(file: &ModelFile<'_>, assembly: &mut Assembly) -> Result<(), LoadError> {
    let ModelFile { options, token, .. } = *file;
    let mut images = Images::new(file);
    let mut document = Document::parse(file, &images, &mut assembly.warnings)?;
    document.decoded = draco::decode_all(&document, token)?;
    let hierarchy = nodes::hierarchy(file, &document, &mut assembly.warnings)?;
    let accessors = Accessors::new(&document);
    cameras::place(&document.cameras, &hierarchy.worlds, assembly);
    cameras::place_lights(&document.gltf, &hierarchy.worlds, assembly, token)?;
    let name = |scene: gltf::Scene<'_>| scene.name().unwrap_or_default().to_owned();
    assembly.scenes = (document.gltf.scenes().map(name).collect(), hierarchy.scene);
    let animations = animation::read(&document, &accessors, &hierarchy.order, &mut assembly.warnings, token)?;
    rig::count_carried(&document, &hierarchy.order, &animations.moved_nodes(), &mut assembly.warnings, token)?;
    let keeps_meshes = animations.clips.is_empty() || rig::keeps_meshes(&document, &animations, &hierarchy.placements);
    if options.instances == Instancing::TwoLevel && !keeps_meshes {
        let what = "copies of a model whose meshes move in themselves flattened";
        assembly.warnings.add(what, || FileLocation::Json("animations".to_owned()));
    }
    let instances = if keeps_meshes { options.instances } else { Instancing::Flat };
    let (copies, order) = plan(file, &document, &accessors, hierarchy, (&animations, instances), assembly)?;
    announced::warn(&document.gltf, &mut assembly.warnings, token)?;
    let (materials, uses) = material::read_all(&document, &mut images);
    token.check()?;
    assembly.materials = materials;
    images.finish(assembly);
    assembly.mesh_count = document.gltf.meshes().len();
    for (count, what) in [(assembly.mesh_count, "meshes"), (document.gltf.nodes().len(), "nodes")] {
        if count > 0 {
            assembly.other_contents.push(counted(count as u64, what));
        }
    }
    let mut meshes: Vec<Option<Vec<Primitive>>> = document.gltf.meshes().map(|_| None).collect();
    for Copies { placement, .. } in &copies {
        if let (Some(mesh @ None), Some(json)) =
            (meshes.get_mut(placement.mesh), document.gltf.meshes().nth(placement.mesh))
        {
            *mesh = Some(read_mesh(&json, &accessors, &uses, assembly, token)?);
        }
    }
    // The last is the default one.
    let default = assembly.materials.len().saturating_sub(1);
    if !meshes.iter().flatten().flatten().any(|primitive| primitive.material == default) {
        assembly.materials.pop();
    }
    let moved = expand(file, &copies, &meshes, instances, assembly)?;
    assembly.repeats_meshes &= keeps_meshes;
    if !animations.clips.is_empty() {
        rig::add_motion(&document, animations, &order, &copies, moved, assembly);
    }
    Ok(())
}

/// The copies of each placement. Refuses files with too many triangles before any of them is made.
fn plan<'a>(
    file: &ModelFile<'_>,
    document: &'a Document,
    accessors: &Accessors<'a>,
    hierarchy: Hierarchy,
    (animations, instances): (&Animations, Instancing),
    assembly: &mut Assembly,
) -> Result<(Vec<Copies<'a>>, Vec<Ordered>), LoadError> {
    let ModelFile { path, token, .. } = *file;
    let mut declared: Vec<Option<u64>> = vec![None; document.gltf.meshes().len()];
    let mut copies = Vec::with_capacity(hierarchy.placements.len());
    let (mut skins, is_kept) = (Skins::default(), !animations.clips.is_empty());
    for placement in hierarchy.placements {
        token.check()?;
        let (Some(node), Some(declared)) =
            (document.gltf.nodes().nth(placement.node), declared.get_mut(placement.mesh))
        else {
            continue;
        };
        if placement.is_hidden && !animations.change_visibility() {
            let location = || FileLocation::Json(format!("nodes[{}]", placement.node));
            assembly.warnings.add("nodes with a mesh that the file hides left out", location);
            continue;
        }
        if declared.is_none() {
            let mut once = 0_u64;
            for primitive in node.mesh().iter().flat_map(gltf::Mesh::primitives) {
                token.check()?;
                once = once.saturating_add(declared_triangles(&primitive, accessors, token)?);
            }
            *declared = Some(once);
        }
        let warnings = &mut assembly.warnings;
        let instances = instances::read(&node, &document.gltf, accessors, warnings, token)?;
        let skin = match node.skin() {
            Some(skin) => skins.get(&skin, &hierarchy.worlds, accessors, warnings, token)?,
            None => None,
        };
        let joints = skin.as_ref().map(|skin| skin.transforms(&hierarchy.worlds));
        let weights = node.weights().or_else(|| node.mesh()?.weights()).unwrap_or_default().to_vec();
        let targets = animation::morph_targets(&node);
        if !weights.is_empty() && weights.len() != targets {
            let there_are = format!("{} for {}", weights.len(), counted(targets as u64, "targets"));
            let location = || FileLocation::in_json(format!("nodes[{}]", placement.node), there_are);
            warnings.add("nodes with another number of weights than the mesh has morph targets", location);
        }
        copies.push(Copies { placement, instances, skin, joints, weights, is_kept });
    }
    let triangles = |of: &Copies| declared.get(of.placement.mesh).copied().flatten().unwrap_or(0);
    let [all, once] = counts(&copies, triangles, token)?;
    let made = if instances == Instancing::Flat { all } else { once };
    if made > MAX_TRIANGLES {
        let problem = format!("contains {all} triangles with all copies, more than {MAX_TRIANGLES}");
        return Err(LoadError::of_file(path, problem, "take a part of the model"));
    }
    if instances != Instancing::Flat {
        let count = copies.iter().fold(0_u64, |sum, one| sum.saturating_add(one.instances.count() as u64));
        check_copies(count, path)?;
        check_count(all, "triangles", path)?;
    }
    Ok((copies, hierarchy.order))
}

fn read_mesh<'a>(
    json: &gltf::Mesh<'a>,
    accessors: &Accessors<'a>,
    uses: &[MaterialUse],
    assembly: &mut Assembly,
    token: &CancelToken,
) -> Result<Vec<Primitive>, Cancelled> {
    let mut primitives = Vec::new();
    let warnings = &mut assembly.warnings;
    let index = json.index();
    if json.primitives().len() == 0 {
        warnings.add("meshes without primitives", || FileLocation::Json(format!("meshes[{index}]")));
    }
    for (k, json) in json.primitives().enumerate() {
        token.check()?;
        let path = || format!("meshes[{index}].primitives[{k}]");
        match primitive::read(&json, accessors, uses, token) {
            Ok(Decoded::Surface(mut primitive)) => {
                for (count, what, detail) in std::mem::take(&mut primitive.faults) {
                    warnings.add_many(count, &what, || FileLocation::Json(format!("{}.{detail}", path())));
                }
                assembly.point_count = assembly.point_count.saturating_add(primitive.shape.positions.len() as u64);
                primitives.push(*primitive);
            }
            Ok(Decoded::Points(count)) => {
                assembly.point_count = assembly.point_count.saturating_add(count);
                warnings.add("primitives of points or lines not shown", || FileLocation::Json(path()));
            }
            Ok(Decoded::Lost) => {}
            Err(AccessorError::Unreadable(fault)) => {
                let what = format!("primitives left out: {}", fault.kind);
                warnings.add(&what, || FileLocation::in_json(path(), &fault.detail));
            }
            Err(AccessorError::Cancelled(cancelled)) => return Err(cancelled),
        }
    }
    Ok(primitives)
}
