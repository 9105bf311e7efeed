//! Triangles with their trees: built, read, refitted and written.

use std::io::Write;
use std::sync::{Arc, OnceLock};

use bvhscope_engine::glam::DVec3;
use bvhscope_engine::query::closed::Edges;
use bvhscope_engine::refit::{WideRefit, refit};
use bvhscope_engine::tree::overlap::end_point_overlap;
use bvhscope_engine::tree::statistics::tree_stats;
use bvhscope_engine::tree_file::serde_json::{Value, json};
use bvhscope_engine::tree_file::{Header, TreeFile, write_tree};
use bvhscope_engine::{AnyTree, BinaryBvh, BuildSettings, CancelToken, Cancelled, TreeStats, Triangle, WideBvh};

use crate::error::Failure;
use crate::mesh::Gathered;
use crate::settings::for_header;

/// Field of a tree file with the offset of its coordinates.
const OFFSET_FIELD: &str = "x_offset";

/// Triangles and their trees. Never changes: triangles that move make another.
pub(crate) struct Model {
    /// The triangles, less the offset.
    pub(crate) triangles: Vec<Triangle>,
    /// Subtracted from all coordinates.
    pub(crate) offset: DVec3,
    /// The tree as it was built or read.
    pub(crate) tree: AnyTree,
    /// The tree that rays are traced through.
    pub(crate) wide: WideBvh,
    /// Statistics of the tree.
    pub(crate) stats: TreeStats,
    /// Builder, settings and time of the build.
    pub(crate) header: Header,
    /// For refitting the wide tree, once that was needed.
    lanes: Option<Arc<WideRefit>>,
    edges: OnceLock<Edges>,
    overlap: OnceLock<f32>,
}

impl Model {
    /// Builds the trees of a mesh in the pool of the calling thread.
    pub(crate) fn build(mesh: Gathered, settings: &BuildSettings, token: &CancelToken) -> Result<Self, Failure> {
        let BinaryBvh { tree, report } = BinaryBvh::build(&mesh.triangles, settings, token)?;
        let header = Header {
            builder: Some(settings.builder.name().to_owned()),
            settings: Some(for_header(settings)),
            build_ms: Some(report.build_time.as_secs_f64() * 1e3),
            ..Header::new(mesh.triangles.len())
        };
        Self::of_tree(mesh, tree, report.stats, header, token)
    }

    /// Reads a tree file over `mesh`, or over the triangles of the file. Returns the faults of the tree as well.
    pub(crate) fn read(
        bytes: &[u8],
        mesh: Option<Gathered>,
        token: &CancelToken,
    ) -> Result<(Self, Vec<String>), Failure> {
        let triangles = mesh.as_ref().map(|mesh| &mesh.triangles[..]);
        let TreeFile { header, tree, corners, faults, .. } = TreeFile::read(bytes, triangles, u64::MAX, token)?;
        let of_file = || corners.map(|triangles| Gathered { triangles, offset: offset_of(&header) });
        let mesh = mesh.or_else(of_file).ok_or_else(|| {
            Failure::Value("vertices: the tree file is without its triangles: give vertices and faces".to_owned())
        })?;
        let stats = tree_stats(&tree, token)?;
        let model = Self::of_tree(mesh, tree, stats, header, token)?;
        Ok((model, faults.iter().map(ToString::to_string).collect()))
    }

    fn of_tree(
        mesh: Gathered,
        tree: AnyTree,
        stats: TreeStats,
        header: Header,
        token: &CancelToken,
    ) -> Result<Self, Failure> {
        let Gathered { triangles, offset } = mesh;
        let wide = WideBvh::new(&tree, &triangles, token)?;
        let (edges, overlap) = (OnceLock::new(), OnceLock::new());
        Ok(Self { triangles, offset, tree, wide, stats, header, lanes: None, edges, overlap })
    }

    /// The same trees fitted to where the triangles are now.
    pub(crate) fn refitted(&self, triangles: Vec<Triangle>, token: &CancelToken) -> Result<Self, Failure> {
        let mut tree = self.tree.clone();
        refit(&mut tree, &triangles, token)?;
        let mut lanes = self.lanes.clone();
        let wide = if self.stats.is_binary() {
            let known =
                lanes.take().map_or_else(|| WideRefit::new(&self.wide.tree, &self.tree, token).map(Arc::new), Ok)?;
            let mut wide = self.wide.clone();
            known.apply(&mut wide.tree, &tree, &triangles, token)?;
            lanes = Some(known);
            wide
        } else {
            WideBvh::new(&tree, &triangles, token)?
        };
        let stats = tree_stats(&tree, token)?;
        let (header, offset) = (self.header.clone(), self.offset);
        let (edges, overlap) = (OnceLock::new(), OnceLock::new());
        Ok(Self { triangles, offset, tree, wide, stats, header, lanes, edges, overlap })
    }

    /// Writes a tree file, with the triangles where `has_corners`.
    pub(crate) fn write(&self, has_corners: bool, writer: &mut impl Write, token: &CancelToken) -> Result<(), Failure> {
        let mut header = self.header.clone();
        if self.offset != DVec3::ZERO {
            // As text: numbers of JSON are read with an error in the last place.
            let texts = self.offset.to_array().map(|number| number.to_string());
            header.other.insert(OFFSET_FIELD.to_owned(), json!(texts));
        }
        let corners = has_corners.then_some(&self.triangles[..]);
        write_tree(&self.tree, &header, corners, writer, token)?;
        Ok(writer.flush()?)
    }

    /// How the triangles meet in their edges.
    pub(crate) fn edges(&self, token: &CancelToken) -> Result<Edges, Cancelled> {
        match self.edges.get() {
            Some(edges) => Ok(*edges),
            None => Edges::of(&self.triangles, token).map(|edges| *self.edges.get_or_init(|| edges)),
        }
    }

    /// End-point overlap of the tree, of all triangles.
    pub(crate) fn overlap(&self, token: &CancelToken) -> Result<f32, Cancelled> {
        if let Some(overlap) = self.overlap.get() {
            return Ok(*overlap);
        }
        let overlap = end_point_overlap(&self.tree, &self.triangles, usize::MAX, token)?;
        Ok(*self.overlap.get_or_init(|| overlap.value))
    }
}

/// The offset that the header of a tree file states; zero where it states none.
fn offset_of(header: &Header) -> DVec3 {
    let texts =
        header.other.get(OFFSET_FIELD).and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_str);
    let numbers: Vec<f64> = texts.filter_map(|text| text.parse().ok()).collect();
    <[f64; 3]>::try_from(numbers).map_or(DVec3::ZERO, DVec3::from_array)
}
