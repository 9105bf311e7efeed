//! Collects triangles and their looks into a scene: what every format and every built-in scene has in common.

use std::path::Path;

use glam::{Vec2, Vec3};

use super::read::unusable;
use super::{Attributes, FileLocation, LoadError, Material, Scene, SceneSource, Texture, Warnings};
use crate::budget::{Budget, OverBudget};
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::{Aabb, Triangle};

/// Coordinates farther out than this make distances overflow, so such triangles are skipped.
const MAX_COORDINATE: f32 = 1e18;

/// Triangles, vertices or numbers between two looks at the token.
pub(super) const BATCH_SIZE: usize = 1 << 16;

/// Triangle counts are kept in 32 bits; leaves and nodes need a few values beyond.
const MAX_TRIANGLES: usize = (u32::MAX - 16) as usize;

/// A triangle with the indices of its corners and its material.
pub(super) const BYTES_PER_TRIANGLE: u64 = (size_of::<Triangle>() + size_of::<[u32; 3]>() + size_of::<u32>()) as u64;

/// Position, normal, texture coordinates and colour of a vertex.
pub(super) const BYTES_PER_VERTEX: u64 = (3 * size_of::<Vec3>() + size_of::<Vec2>()) as u64;

/// There is no memory for the triangles.
#[derive(Debug, thiserror::Error)]
pub(super) enum AllocationError {
    /// They would go beyond the budget.
    #[error(transparent)]
    OverBudget(#[from] OverBudget),
    /// The system gives no more.
    #[error("the system gives no more memory for triangles; take a smaller model")]
    Refused,
}

impl AllocationError {
    /// The same about a file.
    pub(super) fn in_file(&self, path: &Path) -> LoadError {
        unusable(path, self.to_string())
    }
}

/// Whether there is room for `count` more vertices beside the lists that they come from.
pub(super) fn check_vertices(count: usize) -> Result<(), AllocationError> {
    Ok(Budget::of_process().check("the vertices", (count as u64).saturating_mul(2 * BYTES_PER_VERTEX))?)
}

/// A scene in the making.
pub(super) struct Assembly {
    triangles: Vec<Triangle>,
    /// Empty until the first triangle with attributes; vertex 0 is one without any.
    corners: Vec<[u32; 3]>,
    vertex_count: usize,
    normals: Vec<Vec3>,
    uvs: Vec<Vec2>,
    colors: Vec<Vec3>,
    material_indices: Vec<u32>,
    /// May stay empty: clay then.
    pub(super) materials: Vec<Material>,
    /// What materials refer to.
    pub(super) textures: Vec<Texture>,
    /// Meshes, objects or solids met so far.
    pub(super) mesh_count: usize,
    /// What was skipped so far.
    pub(super) warnings: Warnings,
    /// Points in the file, for the message about a file without triangles.
    pub(super) point_count: u64,
}

/// Attributes of a run of vertices; each list is empty or has one entry a vertex.
#[derive(Default)]
pub(super) struct VertexLists {
    pub(super) normals: Vec<Vec3>,
    pub(super) uvs: Vec<Vec2>,
    pub(super) colors: Vec<Vec3>,
}

impl Assembly {
    pub(super) fn new() -> Self {
        Self {
            triangles: Vec::new(),
            corners: Vec::new(),
            vertex_count: 1,
            normals: Vec::new(),
            uvs: Vec::new(),
            colors: Vec::new(),
            material_indices: Vec::new(),
            materials: Vec::new(),
            textures: Vec::new(),
            mesh_count: 0,
            warnings: Warnings::default(),
            point_count: 0,
        }
    }

    /// Triangles so far.
    pub(super) fn len(&self) -> usize {
        self.triangles.len()
    }

    /// Makes room for as many triangles as a file announces, where there is as much: it may be mistaken.
    pub(super) fn expect(&mut self, announced: u64) {
        let fits = Budget::of_process().check("the triangles", announced.saturating_mul(BYTES_PER_TRIANGLE)).is_ok();
        if let Some(count) = usize::try_from(announced).ok().filter(|_| fits) {
            // Without it the list grows.
            let _ = self.triangles.try_reserve_exact(count);
        }
    }

    /// Makes room for so many more triangles, or says why there is none. The error names no file yet.
    pub(super) fn reserve(&mut self, count: usize) -> Result<(), AllocationError> {
        if self.triangles.capacity().saturating_sub(self.triangles.len()) >= count {
            return Ok(());
        }
        // Growing copies, so that old and new stand side by side.
        let total = self.triangles.len().saturating_add(count) as u64;
        Budget::of_process().check("the triangles", total.saturating_mul(BYTES_PER_TRIANGLE))?;
        self.triangles.try_reserve(count).map_err(|_| AllocationError::Refused)?;
        Ok(())
    }

    /// Appends the attributes of `count` vertices and returns the index of the first; `None` where there are no
    /// attributes, or more vertices than 32 bits count.
    pub(super) fn add_vertices(
        &mut self,
        count: usize,
        lists: &VertexLists,
        token: &CancelToken,
    ) -> Result<Option<u32>, Cancelled> {
        if lists.normals.is_empty() && lists.uvs.is_empty() && lists.colors.is_empty() {
            return Ok(None);
        }
        let first = self.vertex_count;
        let Some(end) = first.checked_add(count).filter(|&end| u32::try_from(end).is_ok()) else { return Ok(None) };
        append(&mut self.normals, first, end, &lists.normals, Vec3::ZERO, token)?;
        append(&mut self.uvs, first, end, &lists.uvs, Vec2::ZERO, token)?;
        append(&mut self.colors, first, end, &lists.colors, Vec3::ONE, token)?;
        self.vertex_count = end;
        Ok(u32::try_from(first).ok())
    }

    /// Appends a triangle unless it cannot be traced; says whether it was kept. `corners` are vertices from
    /// [`Assembly::add_vertices`], `None` for a triangle without attributes.
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
            reserve_once(&mut self.corners, self.triangles.capacity());
            self.corners.resize(index, [0; 3]);
            self.corners.push(corners);
        }
        if material != 0 && self.material_indices.len() < index {
            reserve_once(&mut self.material_indices, self.triangles.capacity());
            self.material_indices.resize(index, 0);
        }
        if material != 0 || !self.material_indices.is_empty() {
            self.material_indices.push(material);
        }
        self.triangles.push(triangle);
        true
    }

    /// The scene, or why there is none.
    pub(super) fn finish(mut self, source: &SceneSource, up: Vec3, token: &CancelToken) -> Result<Scene, LoadError> {
        let path = source.path().map_or_else(|| source.to_string().into(), Path::to_path_buf);
        let unusable = |message: String| unusable(&path, message);
        if self.triangles.is_empty() {
            let skipped: Vec<_> = self.warnings.entries.iter().map(ToString::to_string).collect();
            let skipped = if skipped.is_empty() { String::new() } else { format!(" ({})", skipped.join("; ")) };
            return Err(unusable(match self.point_count {
                0 => format!("contains no triangles{skipped}"),
                points => format!("contains {points} points and no triangles{skipped}"),
            }));
        }
        if self.triangles.len() > MAX_TRIANGLES {
            return Err(unusable(format!("contains more than {MAX_TRIANGLES} triangles, the most there may be")));
        }
        let mut bounds = Aabb::EMPTY;
        for batch in self.triangles.chunks(BATCH_SIZE) {
            token.check()?;
            bounds = batch.iter().fold(bounds, |bounds, triangle| bounds.union(&triangle.bounds()));
        }
        let attributes = (!self.corners.is_empty()).then(|| {
            self.corners.resize(self.triangles.len(), [0; 3]);
            let end = self.vertex_count;
            pad(&mut self.normals, end, Vec3::ZERO);
            pad(&mut self.uvs, end, Vec2::ZERO);
            pad(&mut self.colors, end, Vec3::ONE);
            Attributes { corners: self.corners, normals: self.normals, uvs: self.uvs, colors: self.colors }
        });
        if self.materials.is_empty() {
            self.materials.push(Material::clay());
        }
        Ok(Scene {
            source: source.clone(),
            triangles: self.triangles,
            bounds,
            up,
            attributes,
            material_indices: self.material_indices,
            materials: self.materials,
            textures: self.textures,
            mesh_count: self.mesh_count.max(1),
            warnings: self.warnings,
        })
    }
}

/// Room for one item a triangle, when the first of them comes. Where there is none, the list grows.
fn reserve_once<T>(list: &mut Vec<T>, count: usize) {
    if list.capacity() == 0 {
        let _ = list.try_reserve_exact(count);
    }
}

/// Appends a list that may be empty to one that may lag behind.
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

/// Corners counted from the vertex `first`, `None` where there are no attributes. [`Assembly::add_vertices`] has found that
/// 32 bits count those that exist.
pub(super) fn offset_corners(corners: [u32; 3], first: Option<u32>) -> Option<[u32; 3]> {
    first.map(|first| corners.map(|corner| first.saturating_add(corner)))
}

/// A list of `items`, about `count` of them.
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

/// Fills up a list unless it is empty, which stays as it is.
fn pad<T: Copy>(all: &mut Vec<T>, end: usize, default: T) {
    if !all.is_empty() {
        all.resize(end, default);
    }
}
