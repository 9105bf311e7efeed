//! Procedurally generated scenes. Those that are made of copies begin as meshes and places, which [`flatten`] makes triangles of.

mod classics;
mod forest;
mod ground;
mod houses;
mod mesh;
mod moving;
mod plants;
mod shapes;
mod stack;
mod teapot;
mod terrain;
mod thin;
mod traffic;
mod village;
mod walker;

use std::path::PathBuf;

use glam::Vec3;

use super::assemble::Assembly;
use super::error::LoadError;
use super::model::Scene;
use super::options::Instancing;
use super::placed_meshes::PlacedMeshes;
use super::source::BUILTIN_SCENES;
use super::source::SceneSource;
use super::two_levels::of_copies;
use crate::budget::Budget;
use bvhscope_engine::Placed;
use bvhscope_engine::cancel::CancelToken;

/// Generates a built-in scene, whose `size` must be within its range.
pub(super) fn build(
    name: &str,
    size: Option<u32>,
    source: &SceneSource,
    instances: Instancing,
    token: &CancelToken,
) -> Result<Scene, LoadError> {
    let (scene, copies) = build_meshes(name, size, source, token)?;
    match copies {
        None => Ok(scene),
        Some(copies) => of_copies(scene, copies, instances, token),
    }
}

/// [`build`] with copies of meshes apart: the scene then has every mesh once, in its own coordinates.
fn build_meshes(
    name: &str,
    size: Option<u32>,
    source: &SceneSource,
    token: &CancelToken,
) -> Result<(Scene, Option<PlacedMeshes>), LoadError> {
    let path: PathBuf = source.to_string().into();
    let Some(scene) = BUILTIN_SCENES.iter().find(|scene| scene.name == name) else {
        let names: Vec<_> = BUILTIN_SCENES.iter().map(|scene| scene.name).collect();
        return Err(LoadError::of_file(
            &path,
            "there is no such built-in scene",
            format!("there are: {}", names.join(", ")),
        ));
    };
    if let Some(size) = size.filter(|&size| !scene.takes(size)) {
        return Err(LoadError::of_file(&path, format!("{size} is not a size of this scene"), scene.sizes()));
    }
    let size = size.or(scene.size.map(|(_, _, default, _)| default)).unwrap_or(0);
    if is_of_copies(name) {
        let bytes = u64::from(size) * size_of::<Placed>() as u64;
        Budget::of_process().check("the copies", bytes).map_err(|error| LoadError::over_budget(&path, &error))?;
    }
    let mut assembly = Assembly::new();
    assembly.reserve(max_triangles(name, size)).map_err(|error| error.in_file(&path))?;
    let mut copies = None;
    match name {
        "teapot" => teapot::build(size, &mut assembly, token)?,
        "cornell" => classics::cornell(&mut assembly),
        "sphereflake" => classics::flake(size, &mut assembly, token)?,
        "terrain" => terrain::build(size, &mut assembly, token)?,
        "walker" => walker::build(size, &mut assembly, token)?,
        "cloth" => moving::cloth(size, &mut assembly, token)?,
        "explosion" => moving::explosion(size, &mut assembly, token)?,
        "slivers" => classics::slivers(size, &mut assembly, token)?,
        "hair" => thin::hair(size, &mut assembly, token)?,
        "foliage" => thin::foliage(size, &mut assembly, token)?,
        "tilted" => thin::tilted(size, &mut assembly, token)?,
        "forest" => copies = Some(forest::build(size, &mut assembly, token)?),
        "village" => copies = Some(village::build(size, &mut assembly, token)?),
        "stack" => copies = Some(stack::build(size, &mut assembly, token)?),
        "traffic" => copies = Some(traffic::build(size, &mut assembly, token)?),
        _ => classics::clusters(size, &mut assembly, token)?,
    }
    token.check()?;
    token.set_progress(if copies.is_some() { 0.1 } else { 1.0 });
    Ok((assembly.finish(source, Vec3::Y, token)?, copies))
}

/// True if the size of a scene is a number of copies.
fn is_of_copies(name: &str) -> bool {
    ["forest", "village", "stack", "traffic"].contains(&name)
}

/// Upper bound of the triangle count of a scene, in which each mesh is counted once, for reserving memory.
fn max_triangles(name: &str, size: u32) -> usize {
    match name {
        "forest" => return forest::mesh_triangles(size),
        "village" => return village::mesh_triangles(size),
        "stack" => return stack::MESH_TRIANGLES,
        "traffic" => return traffic::MESH_TRIANGLES,
        _ => {}
    }
    let size = size as usize;
    match name {
        "teapot" => 64 * size * size,
        "terrain" | "slivers" | "walker" | "cloth" | "explosion" | "hair" | "foliage" => size,
        // The room has 12 triangles, and each board six sides.
        "tilted" => 12 + 12 * size,
        "clusters" => 256 * size,
        // The central sphere has 2,208 triangles, and each level has at most five times as many as the one before.
        "sphereflake" => 4096 * 5_usize.pow(size as u32),
        _ => 0,
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::scene::flatten::flatten;
    use bvhscope_engine::geometry::Ray;
    use bvhscope_engine::settings::BuildSettings;
    use bvhscope_engine::{Instances, build as build_tree};

    /// Number of rays for each scene.
    const RAYS: usize = 2_000;

    fn source(name: &str, size: u32) -> SceneSource {
        SceneSource::Builtin { name: name.to_owned(), size: Some(size) }
    }

    /// The scene of all meshes, the copies, and the flat scene.
    fn made(name: &str, size: u32) -> (Scene, PlacedMeshes, Scene) {
        let (source, token) = (source(name, size), CancelToken::new());
        let (scene, copies) = build_meshes(name, Some(size), &source, &token).unwrap();
        let copies = copies.unwrap();
        let flat = flatten(&scene, &copies, &source, &token).unwrap();
        (scene, copies, flat)
    }

    /// Rays at corners of triangles, and at points within the box.
    fn rays(scene: &Scene) -> Vec<Ray> {
        let mut random = shapes::Random(1);
        let (center, half) = (scene.bounds.center(), scene.bounds.extent() * 0.5);
        let ray = |index: usize| {
            let triangle = &scene.triangles[(random.unit() * scene.triangles.len() as f32) as usize];
            let target = match index % 3 {
                0 => triangle.b,
                1 => triangle.a.lerp(triangle.c, random.unit()),
                _ => center + random.cube() * half,
            };
            let direction = random.direction();
            Ray::new(target - direction * (half.length() * random.unit()), direction * (0.1 + random.unit()))
        };
        (0..RAYS).map(ray).collect()
    }

    #[test]
    fn copies_and_their_flat_scene_are_hit_alike() {
        let (settings, token) = (BuildSettings::default(), CancelToken::new());
        for (name, size) in [("forest", 25), ("village", 30), ("stack", 60), ("traffic", 50)] {
            let (scene, copies, flat) = made(name, size);
            assert_eq!(flat.triangles.len() as u64, copies.triangle_count());
            let tree = |mesh: &std::ops::Range<u32>| {
                let triangles = &scene.triangles[mesh.start as usize..mesh.end as usize];
                Arc::new(build_tree(triangles, &settings, &token).unwrap())
            };
            let meshes = copies.meshes.iter().map(tree).collect();
            let instances = Instances::build(meshes, &copies.placed, &settings, 2.0, &token).unwrap();
            let tree = build_tree(&flat.triangles, &settings, &token).unwrap();
            let counts = copies.placed.iter().map(|copy| copies.meshes[copy.mesh as usize].len() as u32);
            let ends = counts.scan(0, |end, count| {
                *end += count;
                Some(*end)
            });
            let starts: Vec<u32> = [0].into_iter().chain(ends).collect();
            let mut hits = 0;
            for ray in rays(&flat) {
                let expected = tree.closest_hit(&ray).map(|hit| (hit.primitive_index, hit.t.to_bits()));
                let found = instances.closest_hit(&ray);
                let found = found.map(|hit| (starts[hit.instance as usize] + hit.primitive_index, hit.t.to_bits()));
                assert_eq!(found, expected, "{name}: {ray:?}");
                hits += usize::from(found.is_some());
            }
            assert!(hits > RAYS / 3, "{name}: {hits}");
        }
    }

    #[test]
    fn scenes_of_copies_are_the_same_by_any_number_of_threads() {
        for (name, size) in [("forest", 40), ("village", 70), ("stack", 90), ("traffic", 80)] {
            let [one, two] = [1, 2].map(|threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| made(name, size).2)
            });
            assert!(one.triangles == two.triangles && one.material_indices == two.material_indices, "{name}");
            assert!(one.attributes == two.attributes && one.bounds == two.bounds, "{name}");
            assert_eq!(one.mesh_count, two.mesh_count);
        }
    }

    #[test]
    fn the_plants_have_about_2000_triangles() {
        let (scene, copies, _) = made("forest", 1);
        let plants: Vec<usize> = copies.meshes[1..].iter().map(ExactSizeIterator::len).collect();
        let mean = plants.iter().sum::<usize>() / plants.len();
        assert!(plants.len() == 5 && (1_800..2_200).contains(&mean), "{plants:?}");
        for (name, size) in [("forest", 1), ("village", 1), ("stack", 1), ("traffic", 1)] {
            let count = made(name, size).0.triangles.len();
            assert!(count <= max_triangles(name, size), "{name}: {count}");
        }
        assert!(scene.warnings.is_empty());
    }

    #[test]
    fn a_forest_beyond_the_memory_is_refused_with_its_bytes() {
        let size = 4_000_000;
        let error = build("forest", Some(size), &source("forest", size), Instancing::Flat, &CancelToken::new())
            .unwrap_err()
            .to_string();
        // Where the memory suffices, indices do not.
        assert!(
            error.contains("builtin:forest:4000000: the ") && error.contains(" GB of memory")
                || error.contains("are the most there may be"),
            "{error}"
        );
        assert!(!error.contains('\n'), "{error}");
    }
}
