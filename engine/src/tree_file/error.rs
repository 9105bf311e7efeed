//! Why a tree file is refused.

use super::bounds_problem::BoundsProblem;
use super::layout::{ArrayName, MAX_HEADER, VERSION, VERSION_TWO_LEVELS};
use super::which_tree::{Items, WhichTree};
use crate::cancel::Cancelled;

/// Why a file gives no tree, in one line. Numbers of nodes and triangles are those of the file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TreeFileError {
    /// Reading was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// There are no bytes.
    #[error("the file is empty")]
    Empty,
    /// All bytes are zero.
    #[error("the file holds only zero bytes")]
    Zeros,
    /// The first line ends in a carriage return and a line feed.
    #[error("was written in text mode: the first line ends in CR LF")]
    TextMode,
    /// The first line is another.
    #[error("does not begin with the line 'bvhscope tree {VERSION}'")]
    NotATreeFile,
    /// The first line has another version, held here.
    #[error("is a tree file of version '{0}', neither {VERSION} nor {VERSION_TWO_LEVELS}")]
    Version(String),
    /// There are trees in two levels where one tree is wanted.
    #[error("holds trees in two levels, and the model is flat")]
    TwoLevels,
    /// There is one tree where trees in two levels are wanted.
    #[error("holds a tree of triangles, and the model is one of copies")]
    OneLevel,
    /// The second line has no end.
    #[error("the header, its second line, does not end within {MAX_HEADER} bytes, nor before the file does")]
    HeaderEnd,
    /// The header is not JSON; holds what is wrong with it.
    #[error("the header, its second line, is no JSON object: {0}")]
    HeaderJson(String),
    /// The header lacks a field.
    #[error("the header has no '{0}'")]
    NoField(&'static str),
    /// A field has a value that it cannot have.
    #[error("the header has {found} as '{field}' where {expected} is expected")]
    Field {
        /// Name of the field.
        field: &'static str,
        /// Its value as JSON, shortened.
        found: String,
        /// The allowed values.
        expected: &'static str,
    },
    /// The header does not say where an array begins.
    #[error("'arrays' in the header has no '{0}'")]
    NoArray(ArrayName),
    /// The header does not say where an array begins.
    #[error("'arrays' in the header has {found} as '{array}' where bytes from the start of the data are expected")]
    ArrayBegin {
        /// The array.
        array: ArrayName,
        /// The value as JSON, shortened.
        found: String,
    },
    /// An array ends behind the file.
    #[error("array '{array}' of {bytes} bytes begins at byte {begin} of the data, which has {length}")]
    ArrayEnd {
        /// The array.
        array: ArrayName,
        /// Where it begins, in bytes from the start of the data.
        begin: u64,
        /// Its size.
        bytes: u64,
        /// Bytes after the header.
        length: u64,
    },
    /// Two arrays share bytes.
    #[error("array '{first}' ends at byte {end} of the data, array '{second}' begins at {begin}: they overlap")]
    ArrayOverlap {
        /// The array that begins first.
        first: ArrayName,
        /// Where it ends.
        end: u64,
        /// The array that begins before that.
        second: ArrayName,
        /// Where it begins.
        begin: u64,
    },
    /// More memory would be needed than the caller allows.
    #[error("the tree would need about {needed} bytes of memory, {allowed} are allowed")]
    Memory {
        /// Estimated peak in bytes.
        needed: u64,
        /// The caller's limit.
        allowed: u64,
    },
    /// The mesh has another number of triangles.
    #[error("its number of triangles is {file}, that of the model {model}")]
    OtherMesh {
        /// Triangles in the header.
        file: u32,
        /// Triangles of the mesh.
        model: usize,
    },
    /// A child that does not exist.
    #[error("array 'children': node {node} has the child {child}, but there are {nodes} nodes, counted from 0")]
    Child {
        /// The parent.
        node: u32,
        /// Its child.
        child: u32,
        /// Number of nodes.
        nodes: u32,
    },
    /// A node has two parents, or one parent twice.
    #[error("array 'children': node {node} is a child of node {parents0} and again of node {parents1}",
            parents0 = parents[0], parents1 = parents[1])]
    TwoParents {
        /// The node.
        node: u32,
        /// Its parents in the order in which they are reached.
        parents: [u32; 2],
    },
    /// A node is below itself.
    #[error("array 'children': node {parent} has the child {node}, which it is below: a cycle")]
    Cycle {
        /// The node.
        node: u32,
        /// A node at or below it, of which it is a child.
        parent: u32,
    },
    /// A leaf ends behind the indices.
    #[error("array 'leaves': leaf {node} holds {count} indices from {first} on, but there are {indices}")]
    LeafEnd {
        /// The leaf.
        node: u32,
        /// Its first index.
        first: u32,
        /// Number of its indices.
        count: u32,
        /// Number of all indices.
        indices: u32,
    },
    /// A leaf has more primitives than a [`Node`](crate::tree::Node) can have.
    #[error("array 'leaves': leaf {node} holds {count} indices, more than 2147483647")]
    LeafSize {
        /// The leaf.
        node: u32,
        /// Number of its indices.
        count: u32,
    },
    /// Two leaves share an index.
    #[error("array 'leaves': leaf {node} holds the index {index}, which another leaf holds too")]
    LeafOverlap {
        /// The leaf that is reached later.
        node: u32,
        /// Position in `indices`.
        index: u32,
    },
    /// A triangle or instance that does not exist.
    #[error("array 'indices': {item} at {index}, in leaf {node}, but there are {items} {of}, counted from 0")]
    Index {
        /// The leaf.
        node: u32,
        /// Position in `indices`.
        index: u32,
        /// The index found there.
        item: u32,
        /// Number of items.
        items: u32,
        /// Their kind.
        of: Items,
    },
    /// Bounds that are none.
    #[error("array 'bounds': node {node} has {problem}")]
    Bounds {
        /// The node.
        node: u32,
        /// The fault.
        problem: BoundsProblem,
    },
    /// A corner that is not finite or too far away.
    #[error("array 'corners': triangle {triangle} has {number} where a number from -1e18 to 1e18 is expected")]
    Corner {
        /// The triangle.
        triangle: u32,
        /// The coordinate.
        number: f32,
    },
    /// There are triangles or instances and no nodes.
    #[error("has no nodes, and there are {items} {of}")]
    NoNodes {
        /// Number of items.
        items: u32,
        /// Their kind.
        of: Items,
    },
    /// The triangles are asked for and not there.
    #[error("is a tree without its triangles: it has no array 'corners'")]
    NoCorners,
    /// There are triangles or instances and no leaf.
    #[error("array 'leaves': none of the nodes that the root reaches is a leaf, and there are {items} {of}")]
    NoLeaves {
        /// Number of items.
        items: u32,
        /// Their kind.
        of: Items,
    },
    /// A tree in two levels is refused.
    #[error("{tree}: {error}")]
    InTree {
        /// The tree.
        tree: WhichTree,
        /// Why. Numbers of nodes and items are those within that tree.
        error: Box<Self>,
    },
    /// The numbers of the trees do not add up to those of the header.
    #[error("array 'trees': all rows together have {sum} {what}, the header has {header}")]
    TreeSum {
        /// Nodes, indices or triangles.
        what: &'static str,
        /// Their sum.
        sum: u64,
        /// Their number in the header.
        header: u32,
    },
    /// The tree over the instances is one of another number of instances.
    #[error(
        "array 'trees': the last row, of the tree over the instances, has {items} items, and there are {instances} instances"
    )]
    TopItems {
        /// Number of items in the row.
        items: u32,
        /// Number of instances.
        instances: u32,
    },
    /// A mesh has no triangles; holds its number.
    #[error("array 'trees': mesh {0} has no triangles")]
    EmptyMesh(u32),
    /// An instance of a mesh that does not exist.
    #[error(
        "array 'instances': instance {instance} is one of mesh {mesh}, but there are {meshes} meshes, counted from 0"
    )]
    InstanceMesh {
        /// The instance.
        instance: u32,
        /// Its mesh.
        mesh: u32,
        /// Number of meshes.
        meshes: u32,
    },
    /// An instance that cannot stand where it is placed.
    #[error("array 'matrices': instance {instance} cannot be placed: {problem}")]
    Matrix {
        /// The instance.
        instance: u32,
        /// Fault of its matrix.
        problem: &'static str,
    },
    /// An instance in several leaves; holds its number.
    #[error("array 'indices': instance {0} is in more than one leaf of the tree over the instances")]
    InstanceTwice(u32),
    /// The model has another number of meshes or instances.
    #[error("its number of {what} is {file}, that of the model {model}")]
    OtherScene {
        /// Meshes or instances.
        what: &'static str,
        /// Their number in the file.
        file: usize,
        /// Their number in the model.
        model: usize,
    },
    /// An instance is one of another mesh than in the model.
    #[error("array 'instances': instance {instance} is one of mesh {file}, in the model of mesh {model}")]
    OtherInstance {
        /// The instance.
        instance: u32,
        /// Its mesh in the file.
        file: u32,
        /// Its mesh in the model.
        model: u32,
    },
}

impl TreeFileError {
    /// This error in one of several trees.
    pub(super) fn in_tree(self, tree: WhichTree) -> Self {
        match self {
            Self::Cancelled(_) => self,
            error => Self::InTree { tree, error: Box::new(error) },
        }
    }

    /// A remedy for the author of the file, in a few words.
    pub fn advice(&self) -> &'static str {
        match self {
            Self::Cancelled(_) => "read it again",
            Self::Empty | Self::Zeros => "write the file again",
            Self::TextMode => "open it in binary mode (\"wb\")",
            Self::NotATreeFile => "write the two lines of docs/tree-file.md before the arrays, in binary mode",
            Self::Version(_) => "take a newer bvhscope, or write version 1 or 2",
            Self::TwoLevels => "load the model with --instances two-level",
            Self::OneLevel => "load the model with --instances flat",
            Self::InTree { error, .. } => error.advice(),
            Self::HeaderEnd => "end the header with a line feed, and write it in one line",
            Self::HeaderJson(_)
            | Self::NoField(_)
            | Self::Field { .. }
            | Self::NoArray(_)
            | Self::ArrayBegin { .. } => "correct the header; docs/tree-file.md lists its fields",
            Self::ArrayEnd { .. } | Self::ArrayOverlap { .. } => {
                "the file may be cut off, or written in text mode; otherwise correct 'arrays' or the counts in the header"
            }
            Self::Memory { .. } => "take something smaller, or allow more",
            Self::OtherMesh { .. } => {
                "take the mesh that the tree was built from; info --triangles FILE writes its triangles"
            }
            Self::Child { .. } => "write 4294967295 for an empty slot, and leaves with a number of indices",
            Self::TwoParents { .. } | Self::Cycle { .. } => "give every node one parent",
            Self::LeafEnd { .. } | Self::LeafSize { .. } | Self::LeafOverlap { .. } => {
                "write the first index and the number of indices of each leaf, and 0 as the number for interior nodes"
            }
            Self::TreeSum { .. } | Self::TopItems { .. } | Self::EmptyMesh(_) => {
                "write nodes, indices and triangles of each mesh, and in the last row nodes, indices and instances of the tree over these"
            }
            Self::InstanceMesh { .. } => "count meshes from 0, in the order of their trees",
            Self::Matrix { .. } => "write three rows of four numbers for each instance, or leave it out",
            Self::InstanceTwice(_) => "write each instance into one leaf, as a whole",
            Self::OtherScene { .. } | Self::OtherInstance { .. } => {
                "take the model that the trees were built from, with its meshes and copies in the order that bvhscope tree writes"
            }
            Self::Index { of: Items::Instances, .. } => "count instances from 0, in the order of 'instances'",
            Self::Index { .. } => "count triangles from 0, in the order that info --triangles FILE writes",
            Self::Bounds { .. } => {
                "write bounds for every node: of a box min x, y, z, max x, y, z, of a sphere center x, y, z, radius, of a dop a box, four low and four high, of an oriented box a box, three normals, three low and three high"
            }
            Self::Corner { .. } => "write three corners of finite numbers for each triangle",
            Self::NoCorners => "name the mesh, and this file with --tree",
            Self::NoNodes { .. } => "write the root as node 0, and the number of nodes in the header",
            Self::NoLeaves { .. } => "write the number of its indices for each leaf",
        }
    }
}
