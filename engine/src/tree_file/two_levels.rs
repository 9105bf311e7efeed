//! Reading trees in two levels: one of each mesh, and one over the instances.

use std::ops::Range;

use super::arrays::{Arrays, LevelArrays};
use super::assemble::{Assembled, assemble};
use super::error::TreeFileError;
use super::faults::{Fault, FaultKind};
use super::header::{Header, LevelCounts, parse};
use super::instance::{Instance, KnownScene};
use super::links::{Links, Steps};
use super::read::{OneTree, allow, check_count, peak_bytes, read_of, triangles};
use super::top_faults;
use super::which_tree::{Items, WhichTree};
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::{Aabb, Placement, Triangle};
use crate::tree::{AnyTree, Tree};

/// Memory for each tree beside its nodes, indices and triangles.
const BYTES_PER_TREE: u64 = 512;

/// Memory for each instance: itself, its placement and a reference to that, its number and its place in a set.
const BYTES_PER_INSTANCE: u64 = 256;

/// Part of the size of an instance by which it may stand elsewhere in a file than in the model: sixteen units in the last place, for
/// matrices that others multiply in another order.
const PLACE_SLACK: f32 = 1.0 / (1 << 20) as f32;

/// A tree of a file in two levels.
#[derive(Debug, Clone, PartialEq)]
pub struct LevelTree {
    /// The tree, of boxes. Primitives of that over the instances are their numbers, each in one leaf at most.
    pub tree: AnyTree,
    /// Number of nodes that were left out because they are empty.
    pub empty_nodes: u32,
    /// The number that each node has in the file, counted within its tree; `None` where all have the same.
    pub numbers: Option<Vec<u32>>,
}

/// A mesh of a file in two levels.
#[derive(Debug, Clone, PartialEq)]
pub struct FileMesh {
    /// Its tree.
    pub tree: LevelTree,
    /// The triangles of the file, where it has them and no others were given.
    pub corners: Option<Vec<Triangle>>,
}

/// Contents of a tree file in two levels.
#[derive(Debug, Clone, PartialEq)]
pub struct TwoLevelFile {
    /// The file's header.
    pub header: Header,
    /// The tree over the instances.
    pub top: LevelTree,
    /// The meshes.
    pub meshes: Vec<FileMesh>,
    /// The instances, as the file has them.
    pub instances: Vec<Instance>,
    /// The numbers that the author gave to the instances; `None` where the file has none.
    pub ids: Option<Vec<u32>>,
    /// Faults of the tree over the instances, one entry per kind, then those of all meshes together.
    pub faults: Vec<Fault>,
}

/// Meshes and instances of a file, without its trees.
#[derive(Debug, Clone, PartialEq)]
pub struct TwoLevelModel {
    /// The triangles of all meshes, one mesh after the other.
    pub triangles: Vec<Triangle>,
    /// The triangles of each mesh; none is without.
    pub meshes: Vec<Range<u32>>,
    /// The instances, at least one, each of a mesh that exists. Their matrices may be any.
    pub instances: Vec<Instance>,
}

impl TwoLevelModel {
    /// Reads meshes and instances of a file. `max_bytes` is the memory that may be allocated.
    ///
    /// # Errors
    ///
    /// [`TreeFileError::NoCorners`] where the file has no triangles; otherwise where header, arrays or their contents are wrong.
    pub fn read(bytes: &[u8], max_bytes: u64, token: &CancelToken) -> Result<Self, TreeFileError> {
        let parsed = parse(bytes)?;
        let (arrays, counts) = LevelArrays::find(&parsed)?;
        let corners = arrays.all.corners.ok_or(TreeFileError::NoCorners)?;
        let of_triangles = u64::from(arrays.all.items).saturating_mul(size_of::<Triangle>() as u64);
        allow(of_triangles.saturating_add(bytes_beside(counts)), max_bytes)?;
        let mut end = 0_u32;
        let range = |part: Arrays<'_>| {
            let start = end;
            end = end.saturating_add(part.items);
            start..end
        };
        let parts = parts(&arrays, counts, None, token)?;
        let meshes = parts.meshes.into_iter().map(range).collect();
        let instances = instances(&arrays, counts, token)?;
        Ok(Self { triangles: triangles(corners, arrays.all.items, token)?, meshes, instances })
    }
}

impl TwoLevelFile {
    /// Reads a file in memory. `scene` is the one that the trees are of, where it is known; otherwise the triangles of the file are taken,
    /// if it has them. `max_bytes` is the memory that may be allocated; nothing is before the sizes in the header are found to fit the
    /// file. Runs in the calling thread's rayon pool, and reports progress through `token`.
    ///
    /// Instances stand where `scene` has them: others of the file are a fault.
    ///
    /// # Errors
    ///
    /// A [`TreeFileError`] for files that cannot be shown. Faults of trees that can be shown are in [`TwoLevelFile::faults`].
    pub fn read(
        bytes: &[u8],
        scene: Option<&KnownScene<'_>>,
        max_bytes: u64,
        token: &CancelToken,
    ) -> Result<Self, TreeFileError> {
        token.check()?;
        let parsed = parse(bytes)?;
        let (arrays, counts) = LevelArrays::find(&parsed)?;
        if let Some(scene) = scene {
            check_counts(counts, scene)?;
        }
        let needed = peak_bytes(&parsed, &arrays.all, scene.is_some()).saturating_add(bytes_beside(counts));
        allow(needed, max_bytes)?;
        let parts = parts(&arrays, counts, scene, token)?;
        let instances = instances(&arrays, counts, token)?;
        let (mut meshes, mut faults) = (Vec::with_capacity(parts.meshes.len()), Vec::new());
        for (number, part) in (0_u32..).zip(&parts.meshes) {
            let which = WhichTree::Mesh(number);
            let known = scene.and_then(|scene| scene.meshes.get(number as usize).copied());
            let part_of_all = token.part(number as usize, counts.trees as usize);
            let mesh = read_of::<Aabb>(part, known, &part_of_all).map_err(|error| error.in_tree(which))?;
            let OneTree { tree, corners, empty_nodes, numbers, faults: of_mesh } = mesh;
            for fault in of_mesh {
                add(&mut faults, Fault { tree: which, nodes: Vec::new(), ..fault });
            }
            meshes.push(FileMesh { tree: LevelTree { tree: tree.into(), empty_nodes, numbers }, corners });
        }
        let own_places = if scene.is_some() { Vec::new() } else { places(&instances, &meshes, token)? };
        let own_scene = scene.is_none().then(|| KnownScene {
            meshes: meshes.iter().filter_map(|mesh| mesh.corners.as_deref()).collect(),
            instances: instances.iter().map(|instance| instance.mesh).zip(&own_places).collect(),
        });
        let whole = scene.or(own_scene.as_ref());
        let trees: Vec<&Tree<Aabb>> = meshes.iter().filter_map(FileMesh::boxes).collect();
        let (top, of_top) = read_top(&parts.top, whole, &trees, token)?;
        let mut all = of_top;
        if let Some(fault) = scene.map(|scene| moved(&instances, scene, token)).transpose()?.flatten() {
            let behind = all.partition_point(|other| rank(other) <= rank(&fault));
            all.insert(behind, fault);
        }
        faults.sort_by_key(rank);
        all.append(&mut faults);
        let ids = arrays.ids.map(|ids| column(counts.instances, token, |row| ids.whole(row).next().unwrap_or(0)));
        token.set_progress(1.0);
        Ok(Self { header: parsed.header, top, meshes, instances, ids: ids.transpose()?, faults: all })
    }
}

impl FileMesh {
    /// The tree as one of boxes, which all trees in two levels have.
    fn boxes(&self) -> Option<&Tree<Aabb>> {
        if let AnyTree::Aabb(tree) = &self.tree.tree { Some(tree) } else { None }
    }
}

/// The place of a kind of fault in lists.
fn rank(fault: &Fault) -> usize {
    FaultKind::ALL.iter().position(|kind| *kind == fault.kind).unwrap_or(0)
}

/// Adds a fault of a mesh to those of the meshes before it.
fn add(faults: &mut Vec<Fault>, fault: Fault) {
    match faults.iter_mut().find(|known| known.kind == fault.kind) {
        None => faults.push(fault),
        Some(known) => {
            known.count = known.count.saturating_add(fault.count);
            known.excess = known.excess.max(fault.excess);
        }
    }
}

/// Memory beside that of trees and triangles.
fn bytes_beside(LevelCounts { trees, instances }: LevelCounts) -> u64 {
    let bytes = |count: u32, each: u64| u64::from(count).saturating_mul(each);
    bytes(trees, BYTES_PER_TREE).saturating_add(bytes(instances, BYTES_PER_INSTANCE))
}

/// Checks that the file can be one of `scene`, by its numbers of meshes and instances.
fn check_counts(counts: LevelCounts, scene: &KnownScene<'_>) -> Result<(), TreeFileError> {
    let meshes = counts.trees.saturating_sub(1) as usize;
    let numbers =
        [("meshes", meshes, scene.meshes.len()), ("instances", counts.instances as usize, scene.instances.len())];
    match numbers.into_iter().find(|(_, file, model)| file != model) {
        Some((what, file, model)) => Err(TreeFileError::OtherScene { what, file, model }),
        None => Ok(()),
    }
}

/// The arrays of each tree.
struct Parts<'a> {
    meshes: Vec<Arrays<'a>>,
    top: Arrays<'a>,
}

/// Divides the arrays of all trees into those of each, of as many triangles as the meshes of `scene` have.
fn parts<'a>(
    arrays: &LevelArrays<'a>,
    counts: LevelCounts,
    scene: Option<&KnownScene<'_>>,
    token: &CancelToken,
) -> Result<Parts<'a>, TreeFileError> {
    let mut steps = Steps::silent(token);
    let (mut ends, last) = ([0_u64; 3], counts.trees.saturating_sub(1));
    let mut meshes = Vec::with_capacity(last as usize);
    let row = |tree: u32| {
        let mut numbers = arrays.trees.whole(tree);
        [(); 3].map(|()| numbers.next().unwrap_or(0))
    };
    for mesh in 0..last {
        steps.step()?;
        let numbers = row(mesh);
        if numbers[2] == 0 {
            return Err(TreeFileError::EmptyMesh(mesh));
        }
        let known = scene.and_then(|scene| scene.meshes.get(mesh as usize).copied());
        check_count(numbers[2], known).map_err(|error| error.in_tree(WhichTree::Mesh(mesh)))?;
        meshes.push(arrays.all.part(ends, numbers, Items::Triangles));
        ends = [0, 1, 2].map(|at| ends[at].saturating_add(u64::from(numbers[at])));
    }
    let of_top = row(last);
    let [nodes, indices, items] = of_top;
    if items != counts.instances {
        return Err(TreeFileError::TopItems { items, instances: counts.instances });
    }
    let all = [
        ("nodes", ends[0].saturating_add(u64::from(nodes)), arrays.all.nodes),
        ("indices", ends[1].saturating_add(u64::from(indices)), arrays.all.indices),
        ("triangles", ends[2], arrays.all.items),
    ];
    if let Some((what, sum, header)) = all.into_iter().find(|&(_, sum, header)| sum != u64::from(header)) {
        return Err(TreeFileError::TreeSum { what, sum, header });
    }
    Ok(Parts { meshes, top: arrays.all.part(ends, of_top, Items::Instances) })
}

/// The rows of a list, `of` each.
fn column<T>(rows: u32, token: &CancelToken, of: impl Fn(u32) -> T) -> Result<Vec<T>, Cancelled> {
    let mut list = Vec::with_capacity(rows as usize);
    let mut steps = Steps::silent(token);
    for row in 0..rows {
        steps.step()?;
        list.push(of(row));
    }
    Ok(list)
}

/// The instances of the file, each of a mesh that exists.
fn instances(
    arrays: &LevelArrays<'_>,
    counts: LevelCounts,
    token: &CancelToken,
) -> Result<Vec<Instance>, TreeFileError> {
    let list = column(counts.instances, token, |row| {
        let numbers: [f32; 12] = arrays.matrices.floats(row);
        let matrix = [0, 4, 8].map(|at| [0, 1, 2, 3].map(|column| numbers.get(at | column).copied().unwrap_or(0.0)));
        Instance { mesh: arrays.instances.whole(row).next().unwrap_or(0), matrix }
    })?;
    let meshes = counts.trees.saturating_sub(1);
    match list.iter().position(|instance| instance.mesh >= meshes) {
        Some(at) => Err(TreeFileError::InstanceMesh { instance: at as u32, mesh: list[at].mesh, meshes }),
        None => Ok(list),
    }
}

/// Where the instances of the file stand.
fn places(instances: &[Instance], meshes: &[FileMesh], token: &CancelToken) -> Result<Vec<Placement>, TreeFileError> {
    let bounds = |mesh: &FileMesh| match &mesh.corners {
        Some(corners) => around(corners, token),
        None => Ok(mesh.boxes().and_then(|tree| tree.nodes.first()).map_or(Aabb::EMPTY, |root| root.container)),
    };
    let bounds = meshes.iter().map(bounds).collect::<Result<Vec<Aabb>, Cancelled>>()?;
    let mut places = Vec::with_capacity(instances.len());
    let mut steps = Steps::silent(token);
    for (number, instance) in (0_u32..).zip(instances) {
        steps.step()?;
        let place = Placement::new(&instance.transform(), &bounds[instance.mesh as usize]);
        places.push(place.map_err(|problem| TreeFileError::Matrix { instance: number, problem })?);
    }
    Ok(places)
}

/// The box around `triangles`.
fn around(triangles: &[Triangle], token: &CancelToken) -> Result<Aabb, Cancelled> {
    let mut steps = Steps::silent(token);
    triangles.iter().try_fold(Aabb::EMPTY, |all, triangle| {
        steps.step()?;
        Ok(all.union(&triangle.bounds()))
    })
}

/// Reads the tree over the instances. `trees` are those of the meshes.
fn read_top(
    arrays: &Arrays<'_>,
    scene: Option<&KnownScene<'_>>,
    trees: &[&Tree<Aabb>],
    token: &CancelToken,
) -> Result<(LevelTree, Vec<Fault>), TreeFileError> {
    let token = token.part(trees.len(), trees.len().saturating_add(1));
    let in_top = |error: TreeFileError| error.in_tree(WhichTree::Instances);
    let links = Links::follow(arrays, &token.part(0, 3)).map_err(in_top)?;
    let Assembled { tree, numbers } = assemble::<Aabb>(arrays, &links, &token.part(1, 3)).map_err(in_top)?;
    let known = scene.filter(|scene| scene.meshes.len() == trees.len());
    let known = known.map(|scene| top_faults::Copies { scene, trees });
    let faults = top_faults::find(&tree, numbers.as_deref(), arrays.items, &links, known.as_ref(), &token.part(2, 3))?;
    Ok((LevelTree { tree: tree.into(), empty_nodes: links.empty, numbers }, faults))
}

/// The instances that stand elsewhere in the file than in `scene`.
///
/// # Errors
///
/// For an instance of another mesh.
fn moved(instances: &[Instance], scene: &KnownScene<'_>, token: &CancelToken) -> Result<Option<Fault>, TreeFileError> {
    let mut steps = Steps::silent(token);
    let bounds = scene.meshes.iter().map(|mesh| around(mesh, token)).collect::<Result<Vec<Aabb>, Cancelled>>()?;
    let (mut first, mut count, mut largest) = (None, 0_u64, 0.0_f32);
    for (number, (instance, (mesh, place))) in (0_u32..).zip(instances.iter().zip(&scene.instances)) {
        steps.step()?;
        if instance.mesh != *mesh {
            return Err(TreeFileError::OtherInstance { instance: number, file: instance.mesh, model: *mesh });
        }
        let (distance, reach) = differences(&instance.matrix, place.rows(), &bounds[*mesh as usize]);
        if distance > reach * PLACE_SLACK {
            first = first.or(Some(number));
            count = count.saturating_add(1);
            largest = largest.max(distance);
        }
    }
    let fault =
        |first| Fault { tree: WhichTree::Instances, ..Fault::new(FaultKind::InstanceMoved, count, first, largest) };
    Ok(first.map(fault))
}

/// By how much a coordinate of a point in `bounds` differs at most between the places `a` and `b`, infinity where that is not known, and how
/// large one is at most.
fn differences(a: &[[f32; 4]; 3], b: &[[f32; 4]; 3], bounds: &Aabb) -> (f32, f32) {
    let [x, y, z] = bounds.min.abs().max(bounds.max.abs()).to_array();
    let terms = |row: [f32; 4]| row[0].abs() * x + row[1].abs() * y + row[2].abs() * z + row[3].abs();
    let of_axis = |axis: usize| {
        let (a, b) = (a[axis], b[axis]);
        [terms([0, 1, 2, 3].map(|at| a[at] - b[at])), terms(b)]
    };
    let [of_x, of_y, of_z] = [0, 1, 2].map(of_axis);
    let [distance, reach] = [0, 1].map(|at| of_x[at].max(of_y[at]).max(of_z[at]));
    let is_known = [of_x, of_y, of_z].iter().all(|pair| pair[0].is_finite());
    (if is_known { distance } else { f32::INFINITY }, reach)
}
