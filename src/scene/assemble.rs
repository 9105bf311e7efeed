//! Accumulates triangles, attributes and materials into a [`Scene`]: the part common to all formats and built-in scenes.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use glam::{DVec3, Vec2, Vec3, Vec4};

use super::attributes::Attributes;
use super::error::{FileLocation, LoadError, Warnings};
use super::file_camera::Lens;
use super::file_light::{Lamp, placed};
use super::material::{Material, Texture};
use super::model::Scene;
use super::motion::Motion;
use super::offset::MAX_COORDINATE;
use super::placed_meshes::{PlacedMeshes, around};
use super::smooth::SmoothNormals;
use super::source::SceneSource;
use super::unfolded::UnfoldedCopies;
use crate::budget::{Budget, OverBudget};
use crate::text::counted;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::{Aabb, Triangle};

/// Items (triangles, vertices, numbers) between two cancellation checks.
pub(super) const BATCH_SIZE: usize = 1 << 16;

/// Maximum number of triangles: counts have 32 bits, of which nodes and leaves reserve a few values.
pub(super) const MAX_TRIANGLES: usize = (u32::MAX - 16) as usize;

/// Kinds of warnings that the refusal of a file without triangles names.
const SHOWN_REASONS: usize = 3;

/// Bytes of a triangle with its vertex indices and its material index.
pub(super) const BYTES_PER_TRIANGLE: u64 = (size_of::<Triangle>() + size_of::<[u32; 3]>() + size_of::<u32>()) as u64;

/// Bytes of a vertex: position, normal, colour, tangent and two sets of texture coordinates.
pub(super) const BYTES_PER_VERTEX: u64 = (3 * size_of::<Vec3>() + size_of::<Vec4>() + 2 * size_of::<Vec2>()) as u64;

/// The reason why no memory is available for triangles or vertices.
#[derive(Debug, thiserror::Error)]
pub(super) enum AllocationError {
    /// The allocation exceeds the memory budget.
    #[error(transparent)]
    OverBudget(#[from] OverBudget),
    /// The allocator failed.
    #[error("the system gives no more memory for triangles")]
    Refused,
}

impl AllocationError {
    /// Converts the error into one about `path`.
    pub(super) fn in_file(&self, path: &Path) -> LoadError {
        match self {
            Self::OverBudget(error) => LoadError::over_budget(path, error),
            Self::Refused => LoadError::of_file(path, self.to_string(), "close other programs or take a smaller model"),
        }
    }
}

/// Checks the budget for `count` more vertices; twice their size, since the source lists stay alive meanwhile.
pub(super) fn check_vertices(count: usize) -> Result<(), AllocationError> {
    Ok(Budget::of_process().check("the vertices", (count as u64).saturating_mul(2 * BYTES_PER_VERTEX))?)
}

/// A scene under construction.
pub(super) struct Assembly {
    triangles: Vec<Triangle>,
    /// Vertex indices of each triangle; empty until the first triangle with attributes. Vertex 0 has default attributes.
    corners: Vec<[u32; 3]>,
    vertex_count: usize,
    normals: Vec<Vec3>,
    tangents: Vec<Vec4>,
    uvs: Vec<Vec2>,
    uvs2: Vec<Vec2>,
    colors: Vec<Vec3>,
    alphas: Vec<f32>,
    material_indices: Vec<u32>,
    /// The materials; [`Material::clay`] is added where there are none.
    pub(super) materials: Vec<Material>,
    /// The textures that materials refer to by index.
    pub(super) textures: Vec<Texture>,
    /// Subtracted from the coordinates of the file, see [`Extent::offset`](super::offset::Extent::offset).
    pub(super) offset: DVec3,
    /// Number of meshes, objects or solids so far.
    pub(super) mesh_count: usize,
    /// Whether there are copies of meshes, which may have been made flat.
    pub(super) repeats_meshes: bool,
    /// The cameras of the file.
    pub(super) lenses: Vec<Lens>,
    /// The view that one starts with is that of the first camera.
    pub(super) starts_at_camera: bool,
    /// The lights of the file.
    pub(super) lamps: Vec<Lamp>,
    /// Names of the file's scenes, and the index of the one that is shown.
    pub(super) scenes: (Vec<String>, usize),
    /// How the model moves.
    pub(super) motion: Option<Motion>,
    /// The copies of meshes whose triangles are there once.
    pub(super) copies: Option<PlacedMeshes>,
    /// A box around those copies.
    pub(super) reach: Option<Aabb>,
    /// Whether the file holds a tree of its triangles.
    pub(super) has_tree: bool,
    /// Every file that was opened so far, the model first.
    pub(super) files_read: Vec<PathBuf>,
    /// Warnings about skipped and repaired data so far.
    pub(super) warnings: Warnings,
    /// Number of points in the file, for the error message about a file without triangles.
    pub(super) point_count: u64,
    /// Other contents of the file, as in "3 lines", for the same message.
    pub(super) other_contents: Vec<String>,
}

/// Attributes of a range of vertices; each list is empty or has one entry per vertex.
#[derive(Default)]
pub(super) struct VertexLists {
    pub(super) normals: Vec<Vec3>,
    pub(super) tangents: Vec<Vec4>,
    pub(super) uvs: Vec<Vec2>,
    pub(super) uvs2: Vec<Vec2>,
    pub(super) colors: Vec<Vec3>,
    pub(super) alphas: Vec<f32>,
}

impl Assembly {
    pub(super) fn new() -> Self {
        Self {
            triangles: Vec::new(),
            corners: Vec::new(),
            vertex_count: 1,
            normals: Vec::new(),
            tangents: Vec::new(),
            uvs: Vec::new(),
            uvs2: Vec::new(),
            colors: Vec::new(),
            alphas: Vec::new(),
            material_indices: Vec::new(),
            materials: Vec::new(),
            textures: Vec::new(),
            offset: DVec3::ZERO,
            mesh_count: 0,
            repeats_meshes: false,
            lenses: Vec::new(),
            starts_at_camera: false,
            lamps: Vec::new(),
            scenes: (Vec::new(), 0),
            motion: None,
            copies: None,
            reach: None,
            has_tree: false,
            files_read: Vec::new(),
            warnings: Warnings::default(),
            point_count: 0,
            other_contents: Vec::new(),
        }
    }

    /// The triangles so far.
    pub(super) fn triangles(&self) -> &[Triangle] {
        &self.triangles
    }

    /// Number of triangles so far.
    pub(super) fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// Whether there is no triangle so far.
    pub(super) fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Number of entries that the list of normals will have.
    pub(super) fn normal_count(&self) -> usize {
        if self.normals.is_empty() { 0 } else { self.vertex_count }
    }

    /// The same of the list of tangents.
    pub(super) fn tangent_count(&self) -> usize {
        if self.tangents.is_empty() { 0 } else { self.vertex_count }
    }

    /// Reserves capacity for `count` more triangles within the budget.
    pub(super) fn reserve(&mut self, count: usize) -> Result<(), AllocationError> {
        if self.triangles.capacity().saturating_sub(self.triangles.len()) >= count {
            return Ok(());
        }
        // Growing copies: the old and the new list exist at the same time.
        let total = self.triangles.len().saturating_add(count) as u64;
        Budget::of_process().check("the triangles", total.saturating_mul(BYTES_PER_TRIANGLE))?;
        self.triangles.try_reserve(count).map_err(|_| AllocationError::Refused)?;
        Ok(())
    }

    /// Appends the attributes of `count` vertices and returns the index of the first; `None` where there are no attributes
    /// or where vertex indices would exceed 32 bits.
    pub(super) fn add_vertices(
        &mut self,
        count: usize,
        lists: &VertexLists,
        token: &CancelToken,
    ) -> Result<Option<u32>, Cancelled> {
        let uvs = [&lists.uvs, &lists.uvs2];
        if lists.normals.is_empty() && uvs.iter().all(|uvs| uvs.is_empty()) && lists.colors.is_empty() {
            return Ok(None);
        }
        let first = self.vertex_count;
        let Some(end) = first.checked_add(count).filter(|&end| u32::try_from(end).is_ok()) else { return Ok(None) };
        append(&mut self.normals, first, end, &lists.normals, Vec3::ZERO, token)?;
        append(&mut self.tangents, first, end, &lists.tangents, Vec4::ZERO, token)?;
        append(&mut self.uvs, first, end, &lists.uvs, Vec2::ZERO, token)?;
        append(&mut self.uvs2, first, end, &lists.uvs2, Vec2::ZERO, token)?;
        append(&mut self.colors, first, end, &lists.colors, Vec3::ONE, token)?;
        append(&mut self.alphas, first, end, &lists.alphas, 1.0, token)?;
        self.vertex_count = end;
        Ok(u32::try_from(first).ok())
    }

    /// Appends a triangle unless its coordinates are unusable; returns whether it was appended. `corners` are indices of
    /// vertices from [`Assembly::add_vertices`], `None` for a triangle without attributes.
    pub(super) fn push(
        &mut self,
        triangle: Triangle,
        corners: Option<[u32; 3]>,
        material: u32,
        location: impl FnOnce() -> FileLocation,
    ) -> bool {
        if !triangle.is_finite() {
            self.warnings.add("triangles with coordinates that are not numbers skipped", location);
            return false;
        }
        let bounds = triangle.bounds();
        if bounds.max.max(-bounds.min).max_element() > MAX_COORDINATE {
            self.warnings.add("triangles with coordinates beyond 1e18 skipped", location);
            return false;
        }
        let index = self.triangles.len();
        if let Some(corners) = corners {
            reserve_initial(&mut self.corners, self.triangles.capacity());
            self.corners.resize(index, [0; 3]);
            self.corners.push(corners);
        }
        if material != 0 && self.material_indices.len() < index {
            reserve_initial(&mut self.material_indices, self.triangles.capacity());
            self.material_indices.resize(index, 0);
        }
        if material != 0 || !self.material_indices.is_empty() {
            self.material_indices.push(material);
        }
        self.triangles.push(triangle);
        true
    }

    /// Contents of the file in place of triangles, and why it has none.
    fn no_triangles(&self) -> String {
        let points = (self.point_count > 0).then(|| counted(self.point_count, "points"));
        let held: Vec<String> = points.into_iter().chain(self.other_contents.iter().cloned()).collect();
        let mut problem = match held.split_last() {
            None => "contains no triangles".to_owned(),
            Some((last, [])) => format!("contains {last} but no triangles"),
            Some((last, rest)) => format!("contains {} and {last} but no triangles", rest.join(", ")),
        };
        let reasons: Vec<_> = self.warnings.entries.iter().take(SHOWN_REASONS).map(ToString::to_string).collect();
        let others = self.warnings.entries.len().saturating_sub(SHOWN_REASONS);
        if !reasons.is_empty() {
            let others = if others > 0 { format!("; {others} more") } else { String::new() };
            problem = format!("{problem} ({}{others})", reasons.join("; "));
        }
        problem
    }

    /// The finished scene, or an error if it has no or too many triangles.
    #[expect(clippy::too_many_lines, reason = "the parts of a scene, one after another")]
    pub(super) fn finish(mut self, source: &SceneSource, up: Vec3, token: &CancelToken) -> Result<Scene, LoadError> {
        let path = source.path().map_or_else(|| source.to_string().into(), Path::to_path_buf);
        if self.triangles.is_empty() {
            let problem = self.no_triangles();
            return Err(LoadError::of_file(&path, problem, "export the model as a triangle mesh"));
        }
        if self.triangles.len() > MAX_TRIANGLES {
            let problem = format!("contains more than {MAX_TRIANGLES} triangles, the most there may be");
            return Err(LoadError::of_file(&path, problem, "take a part of the model"));
        }
        let bounds = match self.reach {
            Some(reach) => reach,
            None => around(&self.triangles, token)?,
        };
        let attributes = (!self.corners.is_empty()).then(|| {
            self.corners.resize(self.triangles.len(), [0; 3]);
            let end = self.vertex_count;
            pad(&mut self.normals, end, Vec3::ZERO);
            pad(&mut self.tangents, end, Vec4::ZERO);
            pad(&mut self.uvs, end, Vec2::ZERO);
            pad(&mut self.uvs2, end, Vec2::ZERO);
            pad(&mut self.colors, end, Vec3::ONE);
            pad(&mut self.alphas, end, 1.0);
            Attributes {
                corners: self.corners.into(),
                normals: self.normals,
                tangents: self.tangents,
                uvs: self.uvs.into(),
                uvs2: self.uvs2.into(),
                colors: self.colors.into(),
                alphas: self.alphas.into(),
            }
        });
        if self.materials.is_empty() {
            self.materials.push(Material::clay());
        }
        let offset = self.offset;
        let lamps = self.lamps.len();
        let lights = placed(self.lamps, &bounds, offset);
        let what = "lights without strength or direction left out";
        self.warnings.add_many(lamps.saturating_sub(lights.len()) as u64, what, || FileLocation::File);
        let cameras = self.lenses.into_iter().filter_map(|lens| lens.placed(&bounds, offset)).collect();
        Ok(Scene {
            source: source.clone(),
            triangles: self.triangles,
            copies: None,
            unfolded: UnfoldedCopies::default(),
            bounds,
            offset: self.offset,
            subject: bounds,
            up,
            cameras,
            starts_at_camera: self.starts_at_camera,
            lights: lights.into(),
            scene_names: self.scenes.0,
            shown_scene: self.scenes.1,
            interior: None,
            attributes,
            material_indices: self.material_indices.into(),
            materials: self.materials,
            textures: self.textures,
            smooth_normals: SmoothNormals::default(),
            edges: OnceLock::new(),
            mesh_count: self.mesh_count.max(1),
            repeats_meshes: self.repeats_meshes,
            motion: self.motion.map(Arc::new),
            moment: None,
            has_tree: self.has_tree,
            files_read: self.files_read,
            warnings: self.warnings,
        })
    }
}

/// Reserves capacity for `count` items in a list that has none yet. On failure the list grows on demand.
fn reserve_initial<T>(list: &mut Vec<T>, count: usize) {
    if list.capacity() == 0 {
        let _ = list.try_reserve_exact(count);
    }
}

/// Writes `list` to `all[first..end]`, filling gaps before and after with `default`; does nothing if `list` is empty.
fn append<T: Copy>(
    all: &mut Vec<T>,
    first: usize,
    end: usize,
    list: &[T],
    default: T,
    token: &CancelToken,
) -> Result<(), Cancelled> {
    if !list.is_empty() {
        all.resize(first, default);
        all.reserve(list.len());
        for part in list.chunks(BATCH_SIZE) {
            token.check()?;
            all.extend_from_slice(part);
        }
        all.resize(end, default);
    }
    Ok(())
}

/// Vertex indices relative to `first` as absolute ones; `None` without attributes. [`Assembly::add_vertices`] has checked that
/// existing indices fit into 32 bits.
pub(super) fn offset_corners(corners: [u32; 3], first: Option<u32>) -> Option<[u32; 3]> {
    first.map(|first| corners.map(|corner| first.saturating_add(corner)))
}

/// Collects `items`, about `count` of them, with a cancellation check after every batch.
pub(super) fn collect_cancellable<T>(
    count: usize,
    items: impl IntoIterator<Item = T>,
    token: &CancelToken,
) -> Result<Vec<T>, Cancelled> {
    let mut list = Vec::with_capacity(count);
    let mut items = items.into_iter();
    loop {
        token.check()?;
        let before = list.len();
        list.extend(items.by_ref().take(BATCH_SIZE));
        if list.len() == before {
            return Ok(list);
        }
    }
}

/// Extends a list to `end` items unless it is empty.
fn pad<T: Copy>(all: &mut Vec<T>, end: usize, default: T) {
    if !all.is_empty() {
        all.resize(end, default);
    }
}
