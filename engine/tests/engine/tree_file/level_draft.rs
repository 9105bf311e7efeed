//! A file of trees in two levels written by hand.

use bvhscope_engine::CancelToken;
use bvhscope_engine::geometry::{Aabb, Placement, Triangle};
use bvhscope_engine::tree_file::serde_json::{Map, Value, json};
use bvhscope_engine::tree_file::{Instance, TwoLevelFile};

use super::draft::{Draft, header, sample, sample_mesh, upright};

/// The parts of a file. Rows of all trees have the same number of children.
#[derive(Debug, Clone)]
pub struct LevelDraft {
    /// The header. Counts and `arrays` are filled in where they are missing.
    pub header: Map<String, Value>,
    /// The trees of the meshes, and last that over the instances, whose triangles are these.
    pub trees: Vec<Draft>,
    pub instances: Vec<u32>,
    pub matrices: Vec<[f32; 12]>,
    pub ids: Option<Vec<u32>>,
}

impl LevelDraft {
    /// The file.
    pub fn bytes(&self) -> Vec<u8> {
        let whole = |numbers: Vec<u32>| numbers.into_iter().flat_map(u32::to_le_bytes).collect::<Vec<u8>>();
        let floats = |numbers: Vec<f32>| numbers.into_iter().flat_map(f32::to_le_bytes).collect::<Vec<u8>>();
        let all = || self.trees.iter();
        let (_, meshes) = self.trees.split_last().unwrap();
        let rows = |tree: &Draft| [tree.bounds.len(), tree.indices.len(), tree.triangles].map(|count| count as u32);
        let corners: Option<Vec<_>> = meshes.iter().map(|mesh| mesh.corners.clone()).collect();
        let arrays = [
            ("bounds", Some(floats(all().flat_map(|tree| tree.bounds.concat()).collect()))),
            ("children", Some(whole(all().flat_map(|tree| tree.children.concat()).collect()))),
            ("leaves", Some(whole(all().flat_map(|tree| tree.leaves.concat()).collect()))),
            ("indices", Some(whole(all().flat_map(|tree| tree.indices.clone()).collect()))),
            ("corners", corners.map(|corners| floats(corners.concat().concat()))),
            ("trees", Some(whole(all().flat_map(rows).collect()))),
            ("instances", Some(whole(self.instances.clone()))),
            ("matrices", Some(floats(self.matrices.concat()))),
            ("ids", self.ids.clone().map(whole)),
        ];
        let (mut begins, mut data) = (Map::new(), Vec::new());
        for (name, bytes) in arrays.into_iter().filter_map(|(name, bytes)| Some((name, bytes?))) {
            begins.insert(name.to_owned(), data.len().into());
            data.extend(bytes);
        }
        let mut header = self.header.clone();
        for (name, value) in [
            ("nodes", all().map(|tree| tree.bounds.len()).sum::<usize>().into()),
            ("indices", all().map(|tree| tree.indices.len()).sum::<usize>().into()),
            ("triangles", meshes.iter().map(|mesh| mesh.triangles).sum::<usize>().into()),
            ("trees", self.trees.len().into()),
            ("instances", self.instances.len().into()),
            ("arrays", Value::Object(begins)),
        ] {
            header.entry(name).or_insert(value);
        }
        let mut bytes = format!("bvhscope tree 2\n{}\n", Value::Object(header)).into_bytes();
        bytes.extend(data);
        bytes
    }

    /// Reads the file, without memory limit.
    pub fn read(&self) -> Result<TwoLevelFile, String> {
        read_levels(&self.bytes())
    }
}

/// Reads a file, without memory limit.
pub fn read_levels(bytes: &[u8]) -> Result<TwoLevelFile, String> {
    TwoLevelFile::read(bytes, None, u64::MAX, &CancelToken::new()).map_err(|error| error.to_string())
}

/// A matrix that moves.
pub fn moved_by(x: f32, y: f32, z: f32) -> [f32; 12] {
    [1.0, 0.0, 0.0, x, 0.0, 1.0, 0.0, y, 0.0, 0.0, 1.0, z]
}

/// Where an instance with this matrix of a mesh stands.
pub fn placement(matrix: &[f32; 12], mesh: &[Triangle]) -> Placement {
    let [a, b, c] = [0, 4, 8].map(|at| [0, 1, 2, 3].map(|column| matrix[at + column]));
    let bounds = mesh.iter().fold(Aabb::EMPTY, |all, triangle| all.union(&triangle.bounds()));
    Placement::new(&Instance { mesh: 0, matrix: [a, b, c] }.transform(), &bounds).unwrap()
}

/// The box around the triangles of such an instance.
pub fn around(matrix: &[f32; 12], mesh: &[Triangle]) -> Aabb {
    let place = placement(matrix, mesh);
    mesh.iter().fold(Aabb::EMPTY, |all, triangle| all.union(&place.triangle(triangle).bounds()))
}

/// The sample of four triangles, a mesh of one, and ((0 1) 2) over two copies of the first and one of the second, 10 apart.
pub fn level_sample() -> LevelDraft {
    let four = Draft { triangles: 4, ..sample() };
    let alone = [upright(0.0)];
    let one = Draft {
        bounds: vec![vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0]],
        children: vec![vec![0, 0]],
        leaves: vec![[0, 1]],
        indices: vec![0],
        corners: Some(alone.map(bytemuck::cast).to_vec()),
        triangles: 1,
        ..sample()
    };
    let matrices = vec![moved_by(0.0, 0.0, 0.0), moved_by(10.0, 0.0, 0.0), moved_by(20.0, 0.0, 0.0)];
    let mesh = sample_mesh();
    let boxes = [around(&matrices[0], &mesh), around(&matrices[1], &mesh), around(&matrices[2], &alone)];
    let numbers = |bounds: Aabb| [bounds.min, bounds.max].map(<[f32; 3]>::from).concat();
    let pair = boxes[0].union(&boxes[1]);
    let top = Draft {
        bounds: [pair.union(&boxes[2]), pair, boxes[2], boxes[0], boxes[1]].map(numbers).to_vec(),
        children: vec![vec![1, 2], vec![3, 4], vec![0, 0], vec![0, 0], vec![0, 0]],
        leaves: vec![[0, 0], [0, 0], [2, 1], [0, 1], [1, 1]],
        indices: vec![0, 1, 2],
        corners: None,
        triangles: 3,
        ..sample()
    };
    LevelDraft {
        header: header(json!({"container": "box", "arity": 2})),
        trees: vec![four, one, top],
        instances: vec![0, 0, 1],
        matrices,
        ids: Some(vec![7, 9, 11]),
    }
}
