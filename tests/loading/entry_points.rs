//! Entry points for arbitrary bytes, which must return without a panic. Shared by the seeded mutator of the tests and the
//! fuzz targets.

#![allow(dead_code, reason = "each fuzz target uses one of these")]

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;

use bvhscope::accel::Accel;
use bvhscope::ray_file::{RayFileError, RayHeader, RayReader, write_rays};
use bvhscope::scene::{LoadOptions, Scene, load_bytes};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::{Ray, Triangle};
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Curve, Pass, Passes};
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::traverse::{NoProbe, TestCounts, Traversal};
use bvhscope_engine::tree_file::{FileMesh, TreeFile, TwoLevelFile, TwoLevelTrees, write_tree, write_two_levels};
use glam::{DVec3, Vec3};

/// A folder that does not exist, so that no model refers to an existing file.
const NOWHERE: &str = "/nonexistent-folder-of-hostile-models";

fn load(name: &str, bytes: &[u8]) {
    let path = Path::new(NOWHERE).join(name);
    if let Ok(scene) = load_bytes(&path, bytes, &LoadOptions::default(), &CancelToken::new()) {
        check(&scene);
    }
}

/// Asserts the invariants of a scene.
pub fn check(scene: &Scene) {
    let count = scene.triangles.len();
    assert!(count > 0 && !scene.materials.is_empty());
    assert!(scene.triangles.iter().all(Triangle::is_finite));
    assert!(scene.bounds.min.is_finite() && scene.bounds.max.is_finite());
    assert!(scene.material_indices.is_empty() || scene.material_indices.len() == count);
    assert!(scene.material_indices.iter().all(|&index| (index as usize) < scene.materials.len()));
    if let Some(attributes) = &scene.attributes {
        assert_eq!(attributes.corners.len(), count);
        let vertices = attributes.corners.iter().flatten().map(|&corner| corner as usize + 1).max().unwrap_or(0);
        for length in [attributes.normals.len(), attributes.uvs.len(), attributes.colors.len()] {
            assert!(length == 0 || length >= vertices);
        }
    }
    for material in &scene.materials {
        assert!(material.base_color_texture.is_none_or(|texture| (texture as usize) < scene.textures.len()));
    }
    for texture in &scene.textures {
        assert_eq!(texture.texels.len(), texture.width as usize * texture.height as usize);
    }
}

/// An OBJ file.
pub fn obj(bytes: &[u8]) {
    load("a.obj", bytes);
}

/// A glTF or GLB file.
pub fn gltf(bytes: &[u8]) {
    load("a.gltf", bytes);
}

/// A PLY file.
pub fn ply(bytes: &[u8]) {
    load("a.ply", bytes);
}

/// An STL file.
pub fn stl(bytes: &[u8]) {
    load("a.stl", bytes);
}

/// A PBRT scene.
pub fn pbrt(bytes: &[u8]) {
    load("a.pbrt", bytes);
}

/// A tree file: as a model, and as trees of unknown triangles, which then are written and read again.
pub fn tree_file(bytes: &[u8]) {
    load("a.bvh", bytes);
    let token = CancelToken::new();
    if let Ok(file) = TwoLevelFile::read(bytes, None, 1 << 28, &token) {
        return two_levels(&file);
    }
    let Ok(file) = TreeFile::read(bytes, None, 1 << 28, &token) else { return };
    let mut written = Vec::new();
    write_tree(&file.tree, &file.header, file.corners.as_deref(), &mut written, &token)
        .expect("memory takes everything");
    let again = TreeFile::read(&written, None, 1 << 28, &token).expect("what was written is a tree");
    assert_eq!((again.tree, again.corners), (file.tree, file.corners));
    assert_eq!((again.numbers, again.empty_nodes), (None, 0), "it was in order");
}

/// Trees in two levels, which are written and read again; those of meshes hold indices of the triangles that they are of, known or not.
fn two_levels(file: &TwoLevelFile) {
    let (token, mut written) = (CancelToken::new(), Vec::new());
    let unknown = Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::Y };
    let known = |mesh: &FileMesh| {
        let most = mesh.tree.tree.primitive_indices().iter().max().map_or(1, |&most| most as usize + 1);
        mesh.corners.clone().unwrap_or_else(|| vec![unknown; most])
    };
    // As many as a number in the file says, which nothing bears out.
    if file.header.triangles > 1 << 20 {
        return;
    }
    let triangles: Vec<Vec<Triangle>> = file.meshes.iter().map(known).collect();
    let has_corners = file.meshes.iter().all(|mesh| mesh.corners.is_some());
    let trees = TwoLevelTrees {
        meshes: file.meshes.iter().map(|mesh| &mesh.tree.tree).zip(triangles.iter().map(Vec::as_slice)).collect(),
        top: &file.top.tree,
        instances: file.instances.clone(),
        ids: file.ids.as_deref(),
    };
    write_two_levels(&trees, &file.header, has_corners, &mut written, &token).expect("memory takes everything");
    let again = TwoLevelFile::read(&written, None, 1 << 28, &token).expect("what was written are trees");
    assert_eq!((&again.instances, &again.ids, &again.top.tree), (&file.instances, &file.ids, &file.top.tree));
    for (again, mesh) in again.meshes.iter().zip(&file.meshes) {
        assert_eq!((&again.tree.tree, &again.corners), (&mesh.tree.tree, &mesh.corners));
        assert_eq!((&again.tree.numbers, again.tree.empty_nodes), (&None, 0), "it was in order");
    }
}

/// A ray file, an array of NumPy or lines of numbers, as a file and as a pipe. What is read is written and read again.
pub fn ray_file(bytes: &[u8]) {
    let (token, offset) = (CancelToken::new(), DVec3::new(1.0, -2.0, 0.5));
    let read = |reader: Result<RayReader<'_>, RayFileError>| {
        let (mut reader, mut all, mut chunk) = (reader.ok()?, Vec::new(), Vec::new());
        while reader.read(&mut chunk, &token).ok()? {
            all.append(&mut chunk);
        }
        Some((reader.header().clone(), all))
    };
    let of_file = read(RayReader::of_file(Box::new(Cursor::new(bytes)), offset));
    if let Some(of_stream) = read(RayReader::of_stream(Box::new(bytes), offset)) {
        assert_eq!(Some(&of_stream), of_file.as_ref(), "text and arrays are the same in a pipe");
    }
    let Some((header, rays)) = of_file else { return };
    let mut written = Vec::new();
    let header = RayHeader { offset: Some(offset.to_array()), ..header };
    write_rays(&header, &rays, &mut written, &token).expect("memory takes everything");
    let again = read(RayReader::of_file(Box::new(Cursor::new(&written[..])), offset)).expect("it was written whole");
    assert_eq!(again.0, RayHeader { rays: Some(rays.len() as u64), ..header });
    assert_eq!(again.1.len(), rays.len());
    for (place, (again, ray)) in again.1.iter().zip(&rays).enumerate() {
        assert_eq!((again.ray, again.any, again.weight), (ray.ray, ray.any, ray.weight), "ray {place}");
    }
}

/// A material library beside a sound OBJ file in `folder`.
pub fn mtl(folder: &Path, bytes: &[u8]) {
    let text = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\nusemtl b\nf 1 2 3\n";
    std::fs::write(folder.join("a.mtl"), bytes).expect("the folder takes files");
    let scene = load_bytes(&folder.join("a.obj"), text, &LoadOptions::default(), &CancelToken::new());
    check(&scene.expect("materials never keep a model from loading"));
}

/// Reads floats of any bit pattern from bytes.
struct Floats<'a>(&'a [u8]);

impl Floats<'_> {
    fn next(&mut self) -> Option<f32> {
        let (word, rest) = self.0.split_first_chunk::<4>()?;
        self.0 = rest;
        Some(f32::from_le_bytes(*word))
    }

    fn vector(&mut self) -> Option<Vec3> {
        Some(Vec3::new(self.next()?, self.next()?, self.next()?))
    }
}

/// At most `most` triangles that a scene would accept: finite, within the largest coordinate.
fn triangles(floats: &mut Floats<'_>, most: usize) -> Vec<Triangle> {
    let mut triangles = Vec::new();
    while triangles.len() < most
        && let (Some(a), Some(b), Some(c)) = (floats.vector(), floats.vector(), floats.vector())
    {
        if [a, b, c].iter().all(|corner| corner.is_finite() && corner.abs().max_element() <= 1e18) {
            triangles.push(Triangle { a, b, c });
        }
    }
    triangles
}

/// Settings by a byte and by the number of bytes after the last float, which turns boxes into polytopes or into oriented ones.
fn settings(choice: u8, rest: usize) -> BuildSettings {
    let builder = BuilderKind::ALL[choice as usize % BuilderKind::ALL.len()];
    let container = match (choice & 64 == 0, rest) {
        (false, _) => ContainerKind::Sphere,
        (true, 1) => ContainerKind::Dop14,
        (true, _) => ContainerKind::Aabb,
    };
    let threshold = [2, 6, 12, 64][usize::from(choice >> 3) % 4];
    let moving = Passes::NONE.with(Pass::Restructure).with(Pass::Reinsert);
    let optimize = [Passes::NONE, Passes::NONE.with(Pass::Collapse), moving, Passes::ALL]
        [usize::from(choice >> 7) * 2 + usize::from(choice >> 5) % 2];
    let is_turned = container == ContainerKind::Aabb && rest == 2;
    let optimize = if is_turned { optimize.with(Pass::Orient) } else { optimize };
    let curve = Curve::ALL[usize::from(choice) / 5 % Curve::ALL.len()];
    BuildSettings { builder, container, threshold, curve, optimize, rounds: 6, ..BuildSettings::default() }
}

fn scene(triangles: Vec<Triangle>) -> Arc<Scene> {
    Arc::new(Scene::from_triangles(bvhscope::scene::SceneSource::default_builtin(), triangles))
}

/// Builds a tree over arbitrary triangles and validates it and its statistics. The first byte chooses the settings.
pub fn builder(bytes: &[u8]) {
    let Some((&choice, rest)) = bytes.split_first() else { return };
    let triangles = triangles(&mut Floats(rest), 2000);
    let settings = settings(choice, rest.len() % 4);
    if triangles.is_empty() || settings.refusal(triangles.len()).is_some() {
        return;
    }
    let scene = scene(triangles);
    // With debug assertions this runs the validator too.
    let accel = Accel::build(&scene, &settings, &CancelToken::new()).expect("nothing to refuse");
    bvhscope_engine::tree::validate::validate(&accel.tree, &scene.triangles).expect("a valid tree");
    let stats = &accel.report.stats;
    assert!(stats.sah_cost.is_finite() && stats.mean_leaf_depth.is_finite(), "{stats:?}");
    assert!(accel.epo(None, &CancelToken::new()).is_ok_and(|epo| epo.is_some_and(|epo| epo.value.is_finite())));
}

/// All hits of `rays`, and the points nearest to their origins, are those that the one leaf of `scan` has.
fn compare_queries(accel: &Accel, scan: &Accel, rays: &[Ray]) {
    let (mut hits, mut expected) = (Vec::new(), Vec::new());
    for level in SimdLevel::ALL.into_iter().filter(|level| level.is_available()).map(SimdLevel::level) {
        for (ray, max) in rays.iter().zip([usize::MAX, 1, 2].into_iter().cycle()) {
            let has_more = accel.wide().tree.all_hits(level, ray, max, &mut hits);
            assert_eq!(has_more, scan.wide().tree.all_hits(level, ray, max, &mut expected), "{ray:?}");
            assert_eq!(hits, expected, "{ray:?}");
            let radius = ray.direction.length();
            let nearest = accel.wide().tree.closest_point(level, ray.origin, radius);
            assert_eq!(nearest, scan.wide().tree.closest_point(level, ray.origin, radius), "{ray:?}");
        }
    }
}

/// Arbitrary rays through a tree of arbitrary triangles have the hits of a linear scan, all queries of their points alike.
pub fn traversal(bytes: &[u8]) {
    let Some((&choice, rest)) = bytes.split_first() else { return };
    let mut floats = Floats(rest);
    let triangles = triangles(&mut floats, 24);
    let settings = settings(choice, rest.len() % 4);
    if triangles.is_empty() || settings.refusal(triangles.len()).is_some() {
        return;
    }
    let scene = scene(triangles);
    let accel = Accel::build(&scene, &settings, &CancelToken::new()).expect("nothing to refuse");
    let one_leaf = BuildSettings { builder: BuilderKind::None, optimize: Passes::NONE, ..settings };
    let scan = Accel::build(&scene, &one_leaf, &CancelToken::new()).expect("nothing to refuse");
    let mut rays = Vec::new();
    let target = &scene.triangles[0];
    for corner in [target.a, target.b, (target.a + target.b + target.c) / 3.0] {
        let eye = scene.bounds.max + scene.bounds.extent();
        rays.push(Ray::new(eye, corner - eye));
        rays.push(Ray::new(corner - Vec3::X * scene.bounds.extent().x, Vec3::X));
    }
    while let (Some(origin), Some(direction)) = (floats.vector(), floats.vector()) {
        rays.push(Ray::new(origin, direction));
    }
    // Rays with a common origin, as a camera's.
    let eye = rays[0].origin;
    rays.extend(scene.triangles.iter().flat_map(|t| [t.a, t.b]).map(|corner| Ray::new(eye, corner - eye)));
    let expected: Vec<_> = rays.iter().map(|ray| scan.closest_hit_with(ray, Traversal::Paper, &mut NoProbe)).collect();
    let blocked: Vec<bool> = expected.iter().map(Option::is_some).collect();
    // Packets hold rays with the same signs and the same longest axis.
    let mut bundles: BTreeMap<_, Vec<usize>> = BTreeMap::new();
    for (at, ray) in rays.iter().enumerate().filter(|(_, ray)| ray.origin == eye) {
        let signs = ray.direction.to_array().map(|part| part < 0.0);
        bundles.entry((signs, ray.direction.abs().max_position())).or_default().push(at);
    }
    for level in SimdLevel::ALL.into_iter().filter(|level| level.is_available()) {
        for bundle in bundles.values() {
            let packet: Vec<Ray> = bundle.iter().map(|&at| rays[at]).collect();
            let mut hits = vec![None; packet.len()];
            accel.wide().tree.closest_hits(level.level(), &packet, &mut hits);
            for (hit, &at) in hits.into_iter().zip(bundle) {
                assert_eq!(hit, expected[at], "{}, {:?} in a packet, {settings:?}", level.name(), rays[at]);
            }
        }
        let mut hits = vec![None; rays.len()];
        accel.wide().tree.closest_hits(level.level(), &rays, &mut hits);
        assert_eq!(hits, expected, "{}, {settings:?}", level.name());
        let mut any = vec![false; rays.len()];
        accel.wide().tree.any_hits(level.level(), &rays, &mut any);
        assert_eq!(any, blocked, "{}, {settings:?}", level.name());
    }
    compare_queries(&accel, &scan, &rays);
    for (ray, expected) in rays.iter().zip(expected) {
        assert_eq!(accel.closest_hit(ray), expected, "{ray:?}, the wide tree, {settings:?}");
        for traversal in [Traversal::Ordered, Traversal::Paper] {
            let mut counts = TestCounts::default();
            let hit = accel.closest_hit_with(ray, traversal, &mut counts);
            let nodes = accel.tree.node_count() as u64;
            assert!(counts.containers <= nodes && counts.primitives <= accel.tree.primitive_indices().len() as u64);
            assert!(hit.is_none_or(|hit| hit.t.is_finite() && !hit.t.is_nan()), "{ray:?}: {hit:?}");
            assert_eq!(hit, expected, "{ray:?}, {traversal:?}, {settings:?}");
        }
        assert_eq!(accel.any_hit(ray), expected.is_some(), "{ray:?}");
    }
}
