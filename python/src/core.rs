//! The class `Core`: triangles with their trees, and every query as a method.

use std::fs::OpenOptions;
use std::io::BufWriter;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use bvhscope_engine::tree::Node;
use bvhscope_engine::tree_file::serde_json;
use bvhscope_engine::{CancelToken, with_tree};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::{PyBytes, PyTuple};

use crate::error::{Failure, value_error};
use crate::mesh::{Gathered, Mesh};
use crate::model::Model;
use crate::queries;
use crate::rays::{Points, Rays, shaped};
use crate::run::{run, run_here, thread_count};
use crate::settings::{Keywords, traversal};

/// Most rays or points that the calling thread answers itself: for these, waking other threads takes longer.
const FEW: usize = 16;

/// Leaves of more triangles take too long for that.
const LARGE_LEAF: u32 = 1 << 12;

/// Child of a node that has fewer than others.
const NO_CHILD: i32 = -1;

/// Triangles with their trees.
#[pyclass(frozen, module = "bvhscope._engine")]
pub(crate) struct Core {
    /// Replaced by another when the triangles move. Locked only to be copied or replaced.
    model: Mutex<Arc<Model>>,
}

/// Builds the trees of vertices (n, 3) and faces (m, 3), or of triangles (m, 3, 3). `keywords` are the settings.
#[pyfunction]
pub(crate) fn build(
    py: Python<'_>,
    vertices: &Bound<'_, PyAny>,
    faces: Option<&Bound<'_, PyAny>>,
    keywords: Keywords,
    threads: i64,
) -> PyResult<Core> {
    let (settings, mesh) = (keywords.settings()?, Mesh::read(vertices, faces)?);
    let model = run(py, thread_count(threads)?, move |token| {
        let mesh = mesh.gather(None, token)?;
        Model::build(mesh, &settings, token)
    })?;
    Ok(Core::new(model))
}

/// Reads a tree file over the given mesh, or over its own triangles. Returns the faults of the tree as well.
#[pyfunction]
pub(crate) fn read(
    py: Python<'_>,
    bytes: PyBackedBytes,
    vertices: Option<&Bound<'_, PyAny>>,
    faces: Option<&Bound<'_, PyAny>>,
    threads: i64,
) -> PyResult<(Core, Vec<String>)> {
    let mesh = match vertices {
        Some(vertices) => Some(Mesh::read(vertices, faces)?),
        None if faces.is_some() => return Err(value_error("vertices", "missing: give them with faces")),
        None => None,
    };
    let (model, faults) = run(py, thread_count(threads)?, move |token| {
        let mesh = mesh.map(|mesh| mesh.gather(None, token)).transpose()?;
        Model::read(&bytes, mesh, token)
    })?;
    Ok((Core::new(model), faults))
}

impl Core {
    /// The class for a model.
    pub(crate) fn new(model: Model) -> Self {
        Self { model: Mutex::new(Arc::new(model)) }
    }

    fn model(&self) -> Arc<Model> {
        Arc::clone(&self.model.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// The answer of `work` for `count` rays or points.
    fn answer<T: Send + 'static>(
        &self,
        py: Python<'_>,
        (threads, count): (i64, usize),
        work: impl FnOnce(&Model, &CancelToken) -> Result<T, Failure> + Send + 'static,
    ) -> PyResult<T> {
        let (model, threads) = (self.model(), thread_count(threads)?);
        if count <= FEW && model.stats.max_leaf_size < LARGE_LEAF {
            return run_here(|token| work(&model, token));
        }
        run(py, threads, move |token| work(&model, token))
    }
}

#[pymethods]
impl Core {
    /// Triangle, t, u and v of each ray's nearest hit.
    fn closest_hit<'py>(&self, py: Python<'py>, rays: RayArguments<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let (rays, threads) = rays.read()?;
        let (shape, count) = (rays.shape.clone(), rays.count());
        let hits =
            self.answer(py, (threads, count), move |model, token| Ok(queries::closest_hits(model, &rays, token)?))?;
        let triangle = shaped(py, hits.triangle, &shape, 1)?;
        let [t, u, v] = [hits.t, hits.u, hits.v].map(|numbers| shaped(py, numbers, &shape, 1));
        PyTuple::new(py, [triangle, t?, u?, v?])
    }

    /// For each ray, whether it hits a triangle.
    fn any_hit<'py>(&self, py: Python<'py>, rays: RayArguments<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (rays, threads) = rays.read()?;
        let (shape, count) = (rays.shape.clone(), rays.count());
        let blocked =
            self.answer(py, (threads, count), move |model, token| Ok(queries::any_hits(model, &rays, token)?))?;
        shaped(py, blocked, &shape, 1)
    }

    /// All hits: ray, triangle, t, u, v, the place of each ray's first hit, and whether it has more than `max_hits`.
    fn all_hits<'py>(
        &self,
        py: Python<'py>,
        rays: RayArguments<'py>,
        max_hits: Option<i64>,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let max = match max_hits {
            None => usize::MAX,
            Some(max) => usize::try_from(max)
                .ok()
                .filter(|&max| max > 0)
                .ok_or_else(|| value_error("max_hits", format!("{max}: give at least 1, or None for all")))?,
        };
        let (rays, threads) = rays.read()?;
        let (shape, count) = (rays.shape.clone(), rays.count());
        let all =
            self.answer(py, (threads, count), move |model, token| Ok(queries::all_hits(model, &rays, max, token)?))?;
        let hits = all.hits;
        let [t, u, v] = [hits.t, hits.u, hits.v].map(|numbers| PyArray1::from_vec(py, numbers).into_any());
        let [ray, starts] = [all.ray, all.starts].map(|numbers| PyArray1::from_vec(py, numbers).into_any());
        let triangle = PyArray1::from_vec(py, hits.triangle).into_any();
        PyTuple::new(py, [ray, triangle, t, u, v, starts, shaped(py, all.has_more, &shape, 1)?])
    }

    /// Point, distance, triangle, u, v and feature of the nearest point of the mesh within `radius`.
    fn closest_point<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
        radius: f64,
        threads: i64,
    ) -> PyResult<Bound<'py, PyTuple>> {
        if radius.is_nan() || radius < 0.0 {
            return Err(value_error("max_distance", format!("{radius}: give 0 or more, or infinity")));
        }
        let points = Points::read("points", points)?;
        let (shape, count) = (points.shape.clone(), points.count());
        let found = self.answer(py, (threads, count), move |model, token| {
            Ok(queries::closest_points(model, &points, radius as f32, token)?)
        })?;
        let [distance, u, v] = [found.distance, found.u, found.v].map(|numbers| shaped(py, numbers, &shape, 1));
        let (point, triangle) = (shaped(py, found.point, &shape, 3)?, shaped(py, found.triangle, &shape, 1)?);
        PyTuple::new(py, [point, distance?, triangle, u?, v?, shaped(py, found.feature, &shape, 1)?])
    }

    /// For each point, whether it lies inside.
    fn contains<'py>(&self, py: Python<'py>, points: &Bound<'py, PyAny>, threads: i64) -> PyResult<Bound<'py, PyAny>> {
        let points = Points::read("points", points)?;
        let (shape, count) = (points.shape.clone(), points.count());
        let inside =
            self.answer(py, (threads, count), move |model, token| Ok(queries::contains(model, &points, token)?))?;
        shaped(py, inside, &shape, 1)
    }

    /// The distance of each point, negative inside.
    fn signed_distance<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
        threads: i64,
    ) -> PyResult<Bound<'py, PyAny>> {
        let points = Points::read("points", points)?;
        let (shape, count) = (points.shape.clone(), points.count());
        let distances = self
            .answer(py, (threads, count), move |model, token| Ok(queries::signed_distances(model, &points, token)?))?;
        shaped(py, distances, &shape, 1)
    }

    /// Tests of containers and of triangles that each ray takes.
    fn tests<'py>(
        &self,
        py: Python<'py>,
        rays: RayArguments<'py>,
        stops_at_any: bool,
        order: &str,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let query = queries::query(stops_at_any, traversal(order)?);
        let (rays, threads) = rays.read()?;
        let (shape, count) = (rays.shape.clone(), rays.count());
        let [containers, triangles] = self
            .answer(py, (threads, count), move |model, token| Ok(queries::tests(model, &rays, query, token)?))?
            .map(|numbers| shaped(py, numbers, &shape, 1));
        PyTuple::new(py, [containers?, triangles?])
    }

    /// Visits of each node by all rays.
    fn visits<'py>(
        &self,
        py: Python<'py>,
        rays: RayArguments<'py>,
        stops_at_any: bool,
        order: &str,
    ) -> PyResult<Bound<'py, PyArray1<u32>>> {
        let query = queries::query(stops_at_any, traversal(order)?);
        let (rays, threads) = rays.read()?;
        if u32::try_from(rays.count()).is_err() {
            return Err(value_error("directions", "more than 4294967295 rays: count them in parts"));
        }
        let model = self.model();
        let visits = run(py, thread_count(threads)?, move |token| Ok(queries::visits(&model, &rays, query, token)?))?;
        Ok(PyArray1::from_vec(py, visits))
    }

    /// Fits the trees to vertices that have moved.
    fn refit(
        &self,
        py: Python<'_>,
        vertices: &Bound<'_, PyAny>,
        faces: Option<&Bound<'_, PyAny>>,
        threads: i64,
    ) -> PyResult<()> {
        let (model, mesh) = (self.model(), Mesh::read(vertices, faces)?);
        let refitted = run(py, thread_count(threads)?, move |token| {
            let Gathered { triangles, .. } = mesh.gather(Some(model.offset), token)?;
            let (count, needed) = (triangles.len(), model.triangles.len());
            if count != needed {
                let message = format!("vertices: {count} triangles: give all {needed} of the tree, in their order");
                return Err(Failure::Value(message));
            }
            model.refitted(triangles, token)
        })?;
        *self.model.lock().unwrap_or_else(PoisonError::into_inner) = Arc::new(refitted);
        Ok(())
    }

    /// Writes a tree file to an existing file.
    fn write(&self, py: Python<'_>, path: PathBuf, has_corners: bool) -> PyResult<()> {
        let model = self.model();
        run(py, 1, move |token| {
            let mut file = BufWriter::new(OpenOptions::new().write(true).truncate(true).open(path)?);
            model.write(has_corners, &mut file, token)
        })
    }

    /// A tree file with its triangles, in memory.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let model = self.model();
        let bytes = run(py, 1, move |token| {
            let mut bytes = Vec::new();
            model.write(true, &mut bytes, token)?;
            Ok(bytes)
        })?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Open edges, edges, edges of more than two triangles, and edges along which both triangles run in the same direction.
    fn edges(&self, py: Python<'_>) -> PyResult<[usize; 4]> {
        let model = self.model();
        let edges = run(py, 1, move |token| Ok(model.edges(token)?))?;
        Ok([edges.open, edges.count, edges.shared_by_many, edges.turned])
    }

    /// End-point overlap.
    fn epo(&self, py: Python<'_>, threads: i64) -> PyResult<f32> {
        let model = self.model();
        run(py, thread_count(threads)?, move |token| Ok(model.overlap(token)?))
    }

    /// Statistics of the tree, as JSON.
    fn stats(&self) -> String {
        serde_json::to_string(&self.model().stats).unwrap_or_default()
    }

    /// Builder, settings and time of the build, as JSON.
    fn header(&self) -> String {
        let model = self.model();
        let header = &model.header;
        let (builder, settings, time) = (&header.builder, &header.settings, header.build_ms);
        serde_json::json!({ "builder": builder, "settings": settings, "build_ms": time }).to_string()
    }

    /// Bytes of the tree and of the one that is traced, with its triangles.
    fn sizes(&self) -> [usize; 2] {
        let model = self.model();
        [model.tree.bytes(), model.wide.tree.node_bytes() + model.wide.tree.leaf_bytes()]
    }

    /// Kind of the containers.
    fn container(&self) -> &'static str {
        self.model().tree.container_kind().name()
    }

    /// Number of triangles.
    fn triangle_count(&self) -> usize {
        self.model().triangles.len()
    }

    /// Subtracted from all coordinates.
    fn offset(&self) -> [f64; 3] {
        self.model().offset.to_array()
    }

    /// The corners of the triangles.
    fn triangles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let model = self.model();
        let count = model.triangles.len();
        shaped::<f32>(py, bytemuck::cast_slice(&model.triangles).to_vec(), &[count, 3], 3)
    }

    /// The numbers of each node's container.
    fn bounds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let model = self.model();
        let (numbers, width) = with_tree!(&model.tree, tree => {
            let width = tree.nodes.first().map_or(6, |node| size_of_val(&node.container) / size_of::<f32>());
            let numbers = tree.nodes.iter().flat_map(|node| bytemuck::cast_slice::<_, f32>(std::slice::from_ref(&node.container)));
            (numbers.copied().collect::<Vec<_>>(), width)
        });
        shaped(py, numbers, &[model.tree.node_count()], width)
    }

    /// The children of each node.
    fn children<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let model = self.model();
        let arity = model.stats.max_arity.max(2) as usize;
        let children = with_tree!(&model.tree, tree => {
            let rows = tree.nodes.iter().map(Node::children);
            let of_row = |row: std::ops::Range<u32>| row.map(|child| child as i32).chain(std::iter::repeat(NO_CHILD)).take(arity);
            rows.flat_map(of_row).collect::<Vec<_>>()
        });
        shaped(py, children, &[model.tree.node_count()], arity)
    }

    /// First place in the order and number of triangles of each leaf; 0 and 0 for other nodes.
    fn leaves<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let model = self.model();
        let leaves = with_tree!(&model.tree, tree => {
            let rows = tree.nodes.iter().map(|node| if node.is_leaf() { [node.first as i32, node.count as i32] } else { [0, 0] });
            rows.flatten().collect::<Vec<_>>()
        });
        shaped(py, leaves, &[model.tree.node_count()], 2)
    }

    /// Numbers of the triangles in the order of the leaves.
    fn order<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i32>> {
        let model = self.model();
        PyArray1::from_vec(py, model.tree.primitive_indices().iter().map(|&index| index as i32).collect())
    }
}

/// Rays and threads: origins, directions, t_min, t_max and threads, in this order.
#[derive(FromPyObject)]
struct RayArguments<'py>(Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>, i64);

impl RayArguments<'_> {
    fn read(&self) -> PyResult<(Rays, i64)> {
        let Self(origins, directions, t_min, t_max, threads) = self;
        Ok((Rays::read(origins, directions, t_min, t_max)?, *threads))
    }
}
