//! A tree file written by hand, as those write it who have only read its description, and broken at will.

use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::tree::{Container, Tree};
use bvhscope_engine::tree_file::TreeFile;
use bvhscope_engine::tree_file::serde_json::{Map, Value, json};
use bvhscope_engine::{AnyTree, CancelToken, Cancelled};
use glam::Vec3;

/// A child that is none.
pub const NONE: u32 = u32::MAX;

/// The parts of a file, one row a node, index or triangle.
#[derive(Debug, Clone)]
pub struct Draft {
    pub magic: String,
    /// The header. Counts and `arrays` are filled in where they are missing.
    pub header: Map<String, Value>,
    pub bounds: Vec<Vec<f32>>,
    pub children: Vec<Vec<u32>>,
    pub leaves: Vec<[u32; 2]>,
    pub indices: Vec<u32>,
    pub corners: Option<Vec<[f32; 9]>>,
    pub triangles: usize,
}

impl Draft {
    /// The file.
    pub fn bytes(&self) -> Vec<u8> {
        let floats = |rows: &[Vec<f32>]| rows.concat().into_iter().flat_map(f32::to_le_bytes).collect::<Vec<u8>>();
        let whole = |numbers: &[u32]| numbers.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>();
        let corners = self.corners.as_ref().map(|rows| rows.concat().into_iter().flat_map(f32::to_le_bytes).collect());
        let arrays = [
            ("bounds", Some(floats(&self.bounds))),
            ("children", Some(whole(&self.children.concat()))),
            ("leaves", Some(whole(&self.leaves.concat()))),
            ("indices", Some(whole(&self.indices))),
            ("corners", corners),
        ];
        let (mut begins, mut data) = (Map::new(), Vec::new());
        for (name, bytes) in arrays.into_iter().filter_map(|(name, bytes)| Some((name, bytes?))) {
            begins.insert(name.to_owned(), data.len().into());
            data.extend(bytes);
        }
        let mut header = self.header.clone();
        for (name, value) in [
            ("nodes", self.bounds.len().into()),
            ("indices", self.indices.len().into()),
            ("triangles", self.triangles.into()),
            ("arrays", Value::Object(begins)),
        ] {
            header.entry(name).or_insert(value);
        }
        let mut bytes = format!("{}\n{}\n", self.magic, Value::Object(header)).into_bytes();
        bytes.extend(data);
        bytes
    }

    /// `tree` with rows of `arity` children.
    pub fn of<C: Container + bytemuck::Pod>(tree: &Tree<C>, triangles: &[Triangle], arity: usize) -> Self {
        let children = |first: u32, count: u32| {
            let mut row: Vec<u32> = (first..first + count).collect();
            row.resize(arity, NONE);
            row
        };
        Self {
            magic: "bvhscope tree 1".to_owned(),
            header: header(json!({"container": C::KIND.name(), "arity": arity})),
            bounds: tree.nodes.iter().map(|node| bytemuck::cast_slice(&[node.container]).to_vec()).collect(),
            children: tree.nodes.iter().map(|node| children(node.first, node.arity())).collect(),
            leaves: tree
                .nodes
                .iter()
                .map(|node| if node.is_leaf() { [node.first, node.count] } else { [0, 0] })
                .collect(),
            indices: tree.primitive_indices.clone(),
            corners: None,
            triangles: triangles.len(),
        }
    }

    /// Reads the file, without memory limit.
    pub fn read(&self, mesh: Option<&[Triangle]>) -> Result<TreeFile, String> {
        read(&self.bytes(), mesh)
    }
}

/// Reads a file, without memory limit.
pub fn read(bytes: &[u8], mesh: Option<&[Triangle]>) -> Result<TreeFile, String> {
    TreeFile::read(bytes, mesh, u64::MAX, &CancelToken::new()).map_err(|error| error.to_string())
}

/// The fields of a JSON object.
pub fn header(value: Value) -> Map<String, Value> {
    let Value::Object(fields) = value else { panic!("no object: {value}") };
    fields
}

/// The triangle 0, 1, 2 or 3 of the sample, in the plane x = `x`.
pub fn upright(x: f32) -> Triangle {
    let a = Vec3::new(x, 0.0, 0.0);
    Triangle { a, b: a + Vec3::Y, c: a + Vec3::Z }
}

/// Four triangles side by side.
pub fn sample_mesh() -> [Triangle; 4] {
    [0.0, 1.0, 2.0, 3.0].map(upright)
}

/// A tree over these: ((0 1) 2 3), in our order.
pub fn sample() -> Draft {
    let around = |from: f32, to: f32| vec![from, 0.0, 0.0, to, 1.0, 1.0];
    Draft {
        magic: "bvhscope tree 1".to_owned(),
        header: header(json!({"container": "box", "arity": 2})),
        bounds: vec![around(0.0, 3.0), around(0.0, 1.0), around(2.0, 3.0), around(0.0, 0.0), around(1.0, 1.0)],
        children: vec![vec![1, 2], vec![3, 4], vec![0, 0], vec![0, 0], vec![0, 0]],
        leaves: vec![[0, 0], [0, 0], [2, 2], [0, 1], [1, 1]],
        indices: vec![0, 1, 2, 3],
        corners: Some(sample_mesh().map(bytemuck::cast).to_vec()),
        triangles: 4,
    }
}

/// The bytes that `write` writes.
pub fn written(tree: &AnyTree, header: &bvhscope_engine::tree_file::Header, corners: Option<&[Triangle]>) -> Vec<u8> {
    let mut bytes = Vec::new();
    bvhscope_engine::tree_file::write_tree(tree, header, corners, &mut bytes, &CancelToken::new()).unwrap();
    bytes
}

/// Whether a writer failed because the token was cancelled.
pub fn is_cancelled(error: &std::io::Error) -> bool {
    error.get_ref().is_some_and(|inner| inner.is::<Cancelled>())
}
