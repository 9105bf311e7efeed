//! Trees in two levels: what is written is read again, and rays find through it what they find in the flat scene.

use std::sync::Arc;

use bvhscope_engine::geometry::{Aabb, Placement, Triangle};
use bvhscope_engine::tree::Tree;
use bvhscope_engine::tree_file::serde_json::json;
use bvhscope_engine::tree_file::{
    Header, Instance, KnownScene, TreeFile, TreeFileError, TwoLevelFile, TwoLevelModel, TwoLevelTrees, is_two_levels,
    write_two_levels,
};
use bvhscope_engine::{
    AnyTree, BuildSettings, Bvh, CancelToken, Copies, Hit, Instances, MeshCopies, Placed, Sphere, WideBvh, build,
};
use glam::{Affine3A, Vec3};

use super::draft::{Draft, header, is_cancelled, sample, sample_mesh};
use super::level_draft::{level_sample, moved_by};
use super::n_ary::{random_tree, scrambled};
use crate::instances::{matrix, rays};
use crate::random::Random;
use crate::trees;

/// Meshes with trees of any arity, and copies of them, turned, scaled, mirrored and sheared.
struct Sample {
    meshes: Vec<Vec<Triangle>>,
    trees: Vec<AnyTree>,
    instances: Vec<Instance>,
    places: Vec<Placement>,
    /// Triangles across the boxes of the copies.
    boxes: Vec<Triangle>,
    top: AnyTree,
}

fn around(triangles: &[Triangle]) -> Aabb {
    triangles.iter().fold(Aabb::EMPTY, |all, triangle| all.union(&triangle.bounds()))
}

/// The matrix of a transform, as files have it.
fn rows(transform: &Affine3A) -> [[f32; 4]; 3] {
    let (matrix, translation) = (transform.matrix3, transform.translation);
    [0, 1, 2].map(|axis| [matrix.x_axis[axis], matrix.y_axis[axis], matrix.z_axis[axis], translation[axis]])
}

impl Sample {
    fn new(copies: usize, seed: u64) -> Self {
        let mut random = Random(seed);
        let meshes = vec![trees::soup(300, 0.2, 5), trees::ball(Vec3::ONE, 0.7, 9), trees::soup(1, 0.5, 8)];
        let trees = meshes.iter().zip([4, 8, 2]);
        let trees = trees.map(|(mesh, arity)| random_tree::<Aabb>(mesh, arity, &mut random).into()).collect();
        let mut instance = |at: usize| {
            let mesh = (at % meshes.len()) as u32;
            let transform =
                Affine3A { matrix3: matrix(&mut random, at, 0.5), translation: (random.vector() * 4.0).into() };
            Instance { mesh, matrix: rows(&transform) }
        };
        let instances: Vec<Instance> = (0..copies).map(&mut instance).collect();
        let bounds: Vec<Aabb> = meshes.iter().map(|mesh| around(mesh)).collect();
        let place = |one: &Instance| Placement::new(&one.transform(), &bounds[one.mesh as usize]).unwrap();
        let places: Vec<Placement> = instances.iter().map(place).collect();
        // As close as boxes can be.
        let across = |(one, place): (&Instance, &Placement)| {
            let placed: Vec<Triangle> =
                meshes[one.mesh as usize].iter().map(|triangle| place.triangle(triangle)).collect();
            Triangle::across(&around(&placed))
        };
        let boxes: Vec<Triangle> = instances.iter().zip(&places).map(across).collect();
        let top = random_tree::<Aabb>(&boxes, 5, &mut random).into();
        Self { meshes, trees, instances, places, boxes, top }
    }

    fn trees<'a>(&'a self, ids: Option<&'a [u32]>) -> TwoLevelTrees<'a> {
        let meshes = self.trees.iter().zip(self.meshes.iter().map(Vec::as_slice)).collect();
        TwoLevelTrees { meshes, top: &self.top, instances: self.instances.clone(), ids }
    }

    fn written(&self, ids: Option<&[u32]>, with_corners: bool) -> Vec<u8> {
        let (mut bytes, token) = (Vec::new(), CancelToken::new());
        let header = Header { builder: Some("random".to_owned()), ..Header::new(0) };
        write_two_levels(&self.trees(ids), &header, with_corners, &mut bytes, &token).unwrap();
        bytes
    }

    fn known(&self) -> KnownScene<'_> {
        KnownScene {
            meshes: self.meshes.iter().map(Vec::as_slice).collect(),
            instances: self.instances.iter().map(|one| one.mesh).zip(&self.places).collect(),
        }
    }
}

fn read(bytes: &[u8], scene: Option<&KnownScene<'_>>) -> TwoLevelFile {
    TwoLevelFile::read(bytes, scene, u64::MAX, &CancelToken::new()).unwrap()
}

#[test]
fn both_levels_come_back_node_for_node() {
    let sample = Sample::new(40, 3);
    let ids: Vec<u32> = (100..140).collect();
    for (ids, with_corners) in [(None, true), (Some(&ids[..]), true), (None, false)] {
        let bytes = sample.written(ids, with_corners);
        assert!(is_two_levels(&bytes));
        for scene in [None, Some(sample.known())] {
            let file = read(&bytes, scene.as_ref());
            assert_eq!(file.faults, []);
            assert!(file.top.tree == sample.top && file.top.numbers.is_none() && file.top.empty_nodes == 0);
            let trees: Vec<&AnyTree> = file.meshes.iter().map(|mesh| &mesh.tree.tree).collect();
            assert!(trees == sample.trees.iter().collect::<Vec<_>>());
            assert_eq!((&file.instances, file.ids.as_deref()), (&sample.instances, ids));
            let corners: Option<Vec<Vec<Triangle>>> = file.meshes.iter().map(|mesh| mesh.corners.clone()).collect();
            assert_eq!(corners.as_ref(), Some(&sample.meshes).filter(|_| with_corners && scene.is_none()));
            assert_eq!((file.header.builder.as_deref(), file.header.arity), (Some("random"), 8));
            let all: usize = sample.meshes.iter().map(Vec::len).sum();
            assert_eq!(file.header.triangles as usize, all);
        }
        let model = TwoLevelModel::read(&bytes, u64::MAX, &CancelToken::new());
        if with_corners {
            let model = model.unwrap();
            let meshes: Vec<&[Triangle]> =
                model.meshes.iter().map(|range| &model.triangles[range.start as usize..range.end as usize]).collect();
            assert!(meshes == sample.meshes && model.instances == sample.instances);
        } else {
            assert_eq!(model, Err(TreeFileError::NoCorners));
        }
    }
}

#[test]
fn rays_find_through_a_file_the_very_hits_of_the_flat_scene() {
    let sample = Sample::new(30, 11);
    let (file, token) = (read(&sample.written(None, true), None), CancelToken::new());
    let placed: Vec<Placed> =
        file.instances.iter().map(|one| Placed { mesh: one.mesh, transform: one.transform() }).collect();
    let bounds: Vec<Aabb> = sample.meshes.iter().map(|mesh| around(mesh)).collect();
    let bvh = |(mesh, triangles): (_, &Vec<Triangle>)| Arc::new(Bvh::of_tree(mesh, triangles, &token).unwrap());
    let meshes = file.meshes.into_iter().map(|mesh| mesh.tree.tree).zip(&sample.meshes).map(bvh).collect();
    let copies = Arc::new(Copies::new(&bounds, &placed, &token).unwrap());
    let copies = Arc::new(MeshCopies::new(meshes, copies).unwrap());
    let top = Arc::new(WideBvh::new(&file.top.tree, &sample.boxes, &token).unwrap());
    let instances = Instances::over(copies, top);
    let (mut flat, mut first) = (Vec::new(), Vec::new());
    for (one, place) in sample.instances.iter().zip(&sample.places) {
        first.push(flat.len() as u32);
        flat.extend(sample.meshes[one.mesh as usize].iter().map(|triangle| place.triangle(triangle)));
    }
    let of_flat = build(&flat, &BuildSettings::default(), &token).unwrap();
    let mut hits = 0;
    for ray in rays(&flat, 6_000, &mut Random(5)) {
        let found = instances.closest_hit(&ray).map(|hit| {
            let primitive_index = first[hit.instance as usize] + hit.primitive_index;
            Hit { t: hit.t, primitive_index, u: hit.u, v: hit.v }
        });
        assert_eq!(found, of_flat.closest_hit(&ray), "{ray:?}");
        hits += usize::from(found.is_some());
    }
    assert!(hits > 3_000, "{hits} hits");
}

#[test]
fn nodes_in_any_order_and_gaps_keep_their_numbers_in_messages() {
    let sample = Sample::new(12, 4);
    let mut random = Random(9);
    let mut draft = level_sample();
    draft.trees = sample
        .trees
        .iter()
        .zip(&sample.meshes)
        .chain([(&sample.top, &sample.boxes)])
        .map(|(tree, triangles)| {
            let AnyTree::Aabb(tree) = tree else { panic!("boxes") };
            let (scrambled, _) = scrambled(tree, triangles, 8, 3, &mut random);
            let corners = Some(triangles.iter().map(|triangle| bytemuck::cast(*triangle)).collect());
            Draft { corners, ..scrambled }
        })
        .collect();
    draft.header = header(json!({"container": "box", "arity": 8}));
    draft.instances = sample.instances.iter().map(|one| one.mesh).collect();
    draft.matrices = sample.instances.iter().map(|one| one.matrix.concat().try_into().unwrap()).collect();
    draft.ids = None;
    let file = draft.read().unwrap();
    assert!(file.top.numbers.is_some());
    let trees = file.meshes.iter().map(|mesh| &mesh.tree.tree).chain([&file.top.tree]);
    for (tree, plain) in trees.zip(sample.trees.iter().chain([&sample.top])) {
        assert_eq!(tree.primitive_indices(), plain.primitive_indices());
        assert_eq!(tree.node_count(), plain.node_count());
    }
    // Nodes that the root does not reach, and leaves of boxes that are none.
    assert!(file.faults.iter().all(|fault| fault.kind.name() == "node-unreached"), "{:?}", file.faults);
    let top = draft.trees.last_mut().unwrap();
    let leaf = top.leaves.iter().position(|&[_, count]| count > 0).unwrap();
    top.bounds[leaf] = vec![f32::NAN; 6];
    let error = draft.read().unwrap_err();
    let expected = format!(
        "the tree over the instances: array 'bounds': node {leaf} has NaN where a number from -1e18 to 1e18 is expected"
    );
    assert_eq!(error, expected);
}

#[test]
fn a_file_of_one_level_is_not_taken_for_one_of_two() {
    let (one, two, token) = (sample().bytes(), level_sample().bytes(), CancelToken::new());
    assert!(!is_two_levels(&one));
    let of_two = TwoLevelFile::read(&one, None, u64::MAX, &token).unwrap_err();
    assert_eq!(of_two, TreeFileError::OneLevel);
    let of_one = TreeFile::read(&two, Some(&sample_mesh()), u64::MAX, &token).unwrap_err();
    assert_eq!(of_one, TreeFileError::TwoLevels);
    assert!(of_one.advice().contains("--instances two-level") && of_two.advice().contains("--instances flat"));
}

#[test]
fn a_file_written_by_hand_is_read() {
    let file = level_sample().read().unwrap();
    assert_eq!(file.faults, []);
    assert_eq!((file.meshes.len(), file.ids), (2, Some(vec![7, 9, 11])));
    assert_eq!(file.instances[1].transform(), Affine3A::from_translation(Vec3::X * 10.0));
    assert_eq!(file.instances[2].matrix.concat(), moved_by(20.0, 0.0, 0.0));
}

#[test]
fn trees_of_other_containers_are_not_written() {
    let sample = Sample::new(3, 2);
    let spheres: AnyTree = random_tree::<Sphere>(&sample.meshes[0], 2, &mut Random(1)).into();
    let mut trees = sample.trees(None);
    trees.meshes[0].0 = &spheres;
    let error = write_two_levels(&trees, &Header::new(0), false, &mut Vec::new(), &CancelToken::new()).unwrap_err();
    assert_eq!(error.to_string(), "trees in two levels have boxes, not spheres");
}

#[test]
fn a_cancelled_token_ends_reading_and_writing() {
    let (sample, token) = (Sample::new(3, 2), CancelToken::new());
    let bytes = sample.written(None, true);
    token.cancel();
    let error = write_two_levels(&sample.trees(None), &Header::new(0), true, &mut Vec::new(), &token).unwrap_err();
    assert!(is_cancelled(&error));
    assert!(matches!(TwoLevelFile::read(&bytes, None, u64::MAX, &token), Err(TreeFileError::Cancelled(_))));
    assert!(matches!(TwoLevelModel::read(&bytes, u64::MAX, &token), Err(TreeFileError::Cancelled(_))));
}

#[test]
fn an_empty_top_tree_is_refused() {
    let mut draft = level_sample();
    let empty: AnyTree = Tree::<Aabb>::EMPTY.into();
    let AnyTree::Aabb(empty) = &empty else { panic!("boxes") };
    *draft.trees.last_mut().unwrap() = Draft { triangles: 3, ..Draft::of(empty, &[], 2) };
    assert_eq!(draft.read().unwrap_err(), "the tree over the instances: has no nodes, and there are 3 instances");
}
