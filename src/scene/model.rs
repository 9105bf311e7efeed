//! A loaded model: triangles, their vertex attributes, materials and textures.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use glam::{DVec3, Vec3, Vec4};

use super::attributes::{Attributes, Surface};
use super::error::{FileLocation, LoadError, Warning, Warnings};
use super::file_camera::FileCamera;
use super::file_light::FileLight;
use super::interior::Interior;
use super::material::{Material, Texture};
use super::motion::{Moment, Motion, Pose};
use super::offset::to_file;
use super::options::Instancing;
use super::scene_copies::SceneCopies;
use super::smooth::{CornerNormals, NoNormals, SmoothNormals};
use super::source::SceneSource;
use super::unfolded::UnfoldedCopies;
use crate::budget::{Budget, OverBudget};
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::{Aabb, PreparedRay, Ray, Triangle};
use bvhscope_engine::query::closed::Edges;

/// Bytes for each triangle of the hash tables of corners and edges, which are half empty at worst.
const EDGE_BYTES: u64 = 96;
/// The kind of warning about triangles that a clip moves out of sight, for the moment that is shown.
const LOST: &str = "triangles left out at this moment: coordinates that are not numbers or beyond 1e18";

/// A loaded model: triangles in world space less `offset`, with attributes and materials for shading. Has at least one triangle; all
/// coordinates are finite.
#[derive(Debug)]
pub struct Scene {
    /// Where the scene was loaded from.
    pub source: SceneSource,
    /// The triangles, in file order. Of a scene of copies, of which the tree consists, one stands for each copy: that across its box; those of
    /// the copies that are unfolded follow.
    pub triangles: Vec<Triangle>,
    /// The copies of a scene of two levels, whose meshes exist once; `None` for a flat scene. Attributes and materials then are those of the
    /// meshes' triangles.
    pub copies: Option<Arc<SceneCopies>>,
    /// The copies below which the tree goes on in their meshes.
    pub unfolded: UnfoldedCopies,
    /// Bounding box of all triangles.
    pub bounds: Aabb,
    /// Subtracted from the coordinates of the file, so that models far from the origin keep their decimals; mostly zero.
    pub offset: DVec3,
    /// Bounding box that cameras frame: of all but the few triangles far from all others. Of a model that moves, also of its reach during
    /// the clip that is shown; without one, during the first, which a viewer plays.
    pub subject: Aabb,
    /// Up direction of the scene; a unit axis.
    pub up: Vec3,
    /// The cameras of the file.
    pub cameras: Vec<FileCamera>,
    /// The view that one starts with is that of the first camera, if there is one.
    pub starts_at_camera: bool,
    /// The lights of the file.
    pub lights: Arc<[FileLight]>,
    /// Names of the file's scenes, of which one is shown; empty where the format has one scene at most.
    pub scene_names: Vec<String>,
    /// Index of the scene that is shown.
    pub shown_scene: usize,
    /// Where to stand inside a model that encloses the centre of `bounds`, as a room does; `None` for every other model.
    pub interior: Option<Interior>,
    /// Vertex attributes; `None` if the file has neither normals, texture coordinates nor colours.
    pub attributes: Option<Attributes>,
    /// Index into `materials` for each triangle; empty if every triangle has material 0. Shared by all moments.
    pub material_indices: Arc<Vec<u32>>,
    /// The materials, at least one.
    pub materials: Vec<Material>,
    /// The textures that materials refer to by index.
    pub textures: Vec<Texture>,
    /// Normals by crease angle, made on request.
    pub smooth_normals: SmoothNormals,
    /// How the triangles meet in their edges, once it was asked for.
    pub(in crate::scene) edges: OnceLock<Edges>,
    /// Number of meshes, objects or solids in the file; 1 if the format has no such notion.
    pub mesh_count: usize,
    /// Whether meshes are there several times, as copies, be the scene flat or in two levels.
    pub repeats_meshes: bool,
    /// How the model moves; `None` for one that stands still.
    pub motion: Option<Arc<Motion>>,
    /// The moment that is shown; `None` for the pose of the file, without any clip.
    pub moment: Option<Moment>,
    /// Whether the file is a tree file, which holds a tree of these triangles.
    pub has_tree: bool,
    /// Every file that loading opened: the model, its buffers, material libraries and images. Empty for built-in scenes.
    pub files_read: Vec<PathBuf>,
    /// Parts of the file that were skipped or repaired while loading.
    pub warnings: Warnings,
}

impl Scene {
    /// A scene of bare triangles with the default material and y up.
    pub fn from_triangles(source: SceneSource, triangles: Vec<Triangle>) -> Self {
        let bounds = triangles.iter().fold(Aabb::EMPTY, |all, one| all.union(&one.bounds()));
        Self {
            source,
            triangles,
            copies: None,
            unfolded: UnfoldedCopies::default(),
            bounds,
            offset: DVec3::ZERO,
            subject: bounds,
            up: Vec3::Y,
            cameras: Vec::new(),
            starts_at_camera: false,
            lights: Arc::new([]),
            scene_names: Vec::new(),
            shown_scene: 0,
            interior: None,
            attributes: None,
            material_indices: Arc::default(),
            materials: vec![Material::clay()],
            textures: Vec::new(),
            smooth_normals: SmoothNormals::default(),
            edges: OnceLock::new(),
            mesh_count: 1,
            repeats_meshes: false,
            motion: None,
            moment: None,
            has_tree: false,
            files_read: Vec::new(),
            warnings: Warnings::default(),
        }
    }

    /// True if both are one model, at whatever moments and with whatever copies unfolded: the same triangles in number and order, unless each frame of a sequence of files
    /// has its own, see [`Motion::keeps_triangles`].
    pub fn is_same_model(self: &Arc<Self>, other: &Arc<Self>) -> bool {
        let motions = self.motion.as_ref().zip(other.motion.as_ref());
        let copies = self.copies.as_ref().zip(other.copies.as_ref());
        let are_same_copies = copies.is_some_and(|(own, other)| Arc::ptr_eq(own, other));
        Arc::ptr_eq(self, other) || are_same_copies || motions.is_some_and(|(own, other)| Arc::ptr_eq(own, other))
    }

    /// Whether both are one model at the same moment, with equal triangles.
    pub fn is_same_pose(self: &Arc<Self>, other: &Arc<Self>) -> bool {
        self.is_same_model(other) && self.moment == other.moment && self.unfolded.ranges == other.unfolded.ranges
    }

    /// The triangles that trees are built of: of a scene of copies those that stand for the copies.
    pub fn built_triangles(&self) -> &[Triangle] {
        let count = self.copies.as_ref().map_or(self.triangles.len(), |copies| copies.copies().len());
        &self.triangles[..count]
    }

    /// The model at `moment`, a clip of which it has: its triangles and normals there, in the calling thread's rayon pool. Cameras frame
    /// its reach during the whole clip, so that they stand still.
    ///
    /// # Panics
    ///
    /// Where the model does not move, or has no such clip.
    pub fn at(&self, moment: Moment, token: &CancelToken) -> Result<Self, LoadError> {
        let Some(motion) = &self.motion else { unreachable!("a model that stands still has no moments") };
        if let Err(error) = self.check_moment() {
            return Err(LoadError::over_budget(Path::new(&self.source.to_string()), &error));
        }
        let subject = motion.reach(moment.clip, token)?;
        let mut pose = Pose::default();
        motion.pose(moment, &mut pose, token)?;
        let bounds = pose.bounds(token)?;
        let surface = match pose.surface.take() {
            Some(own) => Surface::clone(&own),
            None => Surface {
                attributes: self.attributes.clone().map(|still| match &pose.copies {
                    Some(_) => still,
                    None => Attributes { normals: pose.normals, tangents: pose.tangents, ..still },
                }),
                material_indices: Arc::clone(&self.material_indices),
                materials: self.materials.clone(),
                textures: self.textures.clone(),
            },
        };
        let mut warnings = self.warnings.clone();
        warnings.entries.retain(|warning| warning.what != LOST);
        warnings.add_many(pose.lost, LOST, || FileLocation::File);
        let scene = Self {
            source: self.source.clone(),
            triangles: pose.triangles,
            copies: pose.copies,
            unfolded: UnfoldedCopies::default(),
            bounds,
            subject,
            cameras: self.cameras.clone(),
            lights: Arc::clone(&self.lights),
            scene_names: self.scene_names.clone(),
            attributes: surface.attributes,
            material_indices: surface.material_indices,
            materials: surface.materials,
            textures: surface.textures,
            smooth_normals: SmoothNormals::default(),
            edges: OnceLock::new(),
            motion: Some(Arc::clone(motion)),
            moment: Some(moment),
            files_read: self.files_read.clone(),
            warnings,
            ..*self
        };
        Ok(scene)
    }

    /// The triangles that the clip moves out of sight at the moment that is shown: counted, as those that are so at rest.
    pub fn lost_at_moment(&self) -> Option<&Warning> {
        self.warnings.entries.iter().find(|warning| warning.what == LOST)
    }

    /// Checks that the triangles of a moment, and the vertices that they are made of, fit into the memory budget.
    fn check_moment(&self) -> Result<(), OverBudget> {
        let bytes = 2_u64.saturating_mul(size_of_val(&self.triangles[..]) as u64);
        Budget::of_process().check("the triangles of a moment", bytes)
    }

    /// Makes cameras frame the first clip too, so that nothing leaves the picture once it plays. Takes what the first moment that is shown
    /// would take anyway: [`Motion::reach`] is kept. Without memory for a moment only the pose of the file is framed.
    pub(super) fn frame_first_clip(&mut self, token: &CancelToken) -> Result<(), LoadError> {
        if let Some(motion) = &self.motion
            && self.check_moment().is_ok()
        {
            self.subject = self.subject.union(&motion.reach(0, token)?);
        }
        Ok(())
    }

    /// How the triangles meet in their edges: whether the surface is closed, manifold and consistently oriented. `None` where that takes
    /// more memory than there is, and of a scene of copies. The first call takes about a second for a million triangles.
    pub fn compute_edges(&self, token: &CancelToken) -> Result<Option<Edges>, Cancelled> {
        if self.copies.is_some() {
            return Ok(None);
        }
        if let Some(edges) = self.known_edges() {
            return Ok(Some(*edges));
        }
        let bytes = EDGE_BYTES.saturating_mul(self.triangles.len() as u64);
        if Budget::of_process().check("the edges of the model", bytes).is_err() {
            return Ok(None);
        }
        let edges = Edges::of(&self.triangles, token)?;
        Ok(Some(*self.edges.get_or_init(|| edges)))
    }

    /// The result of [`Scene::compute_edges`], if it was called.
    pub fn known_edges(&self) -> Option<&Edges> {
        self.edges.get()
    }

    /// True if `ray` enters the scene's box, the axis-aligned one around all triangles, as traversals test the root of a tree of boxes.
    /// Means over these rays compare between trees of all containers, whose own roots are entered by different rays.
    pub fn is_entered_by(&self, ray: &Ray) -> bool {
        let ray = PreparedRay::new(*ray);
        ray.can_hit() && self.bounds.entry(&ray, ray.ray.t_min, ray.ray.t_max).is_some()
    }

    /// A point of the scene in the coordinates of its file, with no more decimals than single precision has.
    pub fn in_file(&self, point: Vec3) -> DVec3 {
        to_file(point, self.offset)
    }

    /// Number of triangles that rays can hit: of a scene of copies, of all copies.
    pub fn triangle_count(&self) -> u64 {
        self.copies.as_ref().map_or(self.triangles.len() as u64, |copies| copies.triangle_count())
    }

    /// The form of its copies; [`Instancing::Auto`] where it has none, or is flat in any case, as models with meshes that move in themselves
    /// are.
    pub fn form(&self) -> Instancing {
        match self.copies {
            Some(_) => Instancing::TwoLevel,
            None if self.repeats_meshes => Instancing::Flat,
            None => Instancing::Auto,
        }
    }

    /// True if its copies have the form that is asked for, or can have no other.
    pub fn has_form(&self, wanted: Instancing) -> bool {
        let form = self.form();
        [form, wanted].contains(&Instancing::Auto) || form == wanted
    }

    /// The name of what trees are built of, of one and of several.
    pub const fn primitive_names(&self) -> [&'static str; 2] {
        match self.copies {
            Some(_) => ["copy", "copies"],
            None => ["triangle", "triangles"],
        }
    }

    /// The triangle that a hit names, in the world.
    #[inline]
    pub fn triangle(&self, hit: u32) -> Triangle {
        self.copies.as_ref().map_or_else(|| self.triangles[hit as usize], |copies| copies.triangle(hit))
    }

    /// Index of what the tree consists of where a hit names a triangle: of the copy that has it, unless that is unfolded, in a flat scene
    /// the triangle itself.
    #[inline]
    pub fn primitive_of(&self, hit: u32) -> u32 {
        let Some(copies) = &self.copies else { return hit };
        let copy = copies.copy_of(hit);
        self.unfolded
            .first_of(copy)
            .map_or(copy, |first| first.saturating_add(hit.saturating_sub(copies.number(copy, 0))))
    }

    /// Index of a triangle that a hit names in the lists of attributes and materials.
    #[inline]
    pub fn surface_of(&self, hit: u32) -> u32 {
        self.copies.as_ref().map_or(hit, |copies| copies.in_meshes(hit))
    }

    /// Normals at the corners of a triangle that a hit names, in the world.
    #[inline]
    pub fn normals_of(&self, hit: u32, normals: [Vec3; 3]) -> [Vec3; 3] {
        self.copies.as_ref().map_or(normals, |copies| copies.normals(hit, normals))
    }

    /// A tangent on a triangle that a hit names, in the world.
    #[inline]
    pub fn tangent_of(&self, hit: u32, tangent: Vec4) -> Vec4 {
        self.copies.as_ref().map_or(tangent, |copies| copies.tangent(hit, tangent))
    }

    /// The material of a triangle that a hit names.
    pub fn material(&self, hit: u32) -> &Material {
        let index = self.material_indices.get(self.surface_of(hit) as usize).copied().unwrap_or(0);
        &self.materials[index as usize]
    }

    /// Number of images that textures show; several textures may show one.
    pub fn image_count(&self) -> usize {
        self.textures.iter().map(|texture| Arc::as_ptr(&texture.texels)).collect::<HashSet<_>>().len()
    }

    /// Whether the file has normals.
    pub fn has_normals(&self) -> bool {
        self.attributes.as_ref().is_some_and(|attributes| !attributes.normals.is_empty())
    }

    /// Smooth normals by a crease angle in degrees, made on the first request in the calling thread's rayon pool and kept until
    /// another angle is asked for. `None` if they do not fit into the memory budget.
    pub fn normals_by_crease(
        &self,
        degrees: f32,
        token: &CancelToken,
    ) -> Result<Option<Arc<CornerNormals>>, Cancelled> {
        match self.smooth_normals.get(self.mesh_triangles(), degrees, token) {
            Ok(normals) => Ok(Some(normals)),
            Err(NoNormals::OverBudget(_)) => Ok(None),
            Err(NoNormals::Cancelled(cancelled)) => Err(cancelled),
        }
    }

    /// [`Scene::normals_by_crease`], if they were made before.
    pub fn known_normals_by_crease(&self, degrees: f32) -> Option<Arc<CornerNormals>> {
        self.smooth_normals.known(degrees)
    }

    /// Adds a warning where a file has no normals and smooth ones do not fit into the memory budget. They are made for the first
    /// picture that is not coarse: for large models that takes as long as reading the file.
    pub(super) fn check_normals(&mut self) {
        if self.has_normals() {
            return;
        }
        if let Err(error) = SmoothNormals::check(self.mesh_triangles().len()) {
            self.warnings.add(&format!("models shown with flat triangles: {error}"), || FileLocation::File);
        }
    }

    /// The triangles that attributes and materials are of: those of the meshes of a scene of copies.
    fn mesh_triangles(&self) -> &[Triangle] {
        self.copies.as_ref().map_or(&self.triangles, |copies| copies.triangles())
    }

    /// Bytes of triangles, copies, attributes, smooth normals and textures.
    pub fn bytes(&self) -> usize {
        let attributes = self.attributes.iter().flat_map(|a| {
            [
                size_of_val(&a.corners[..]),
                size_of_val(&a.normals[..]),
                size_of_val(&a.tangents[..]),
                size_of_val(&a.uvs[..]),
                size_of_val(&a.uvs2[..]),
                size_of_val(&a.colors[..]),
                size_of_val(&a.alphas[..]),
            ]
        });
        // Textures of one image share its texels.
        let mut images = HashSet::new();
        let own_texels = self.textures.iter().filter(move |texture| images.insert(Arc::as_ptr(&texture.texels)));
        let textures = own_texels.map(|texture| texture.bytes() as usize);
        let own =
            [size_of_val(&self.triangles[..]), size_of_val(&self.material_indices[..]), self.smooth_normals.bytes()];
        let motion = self.motion.as_ref().map(|motion| motion.bytes());
        let copies = self.copies.as_ref().map(|copies| copies.bytes());
        own.into_iter().chain(attributes).chain(textures).chain(motion).chain(copies).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_in_the_file_have_no_more_decimals_than_there_were() {
        let mut scene = Scene::from_triangles(SceneSource::File("a.obj".into()), Vec::new());
        assert_eq!(scene.in_file(Vec3::splat(0.1)), DVec3::splat(0.1));
        scene.offset = DVec3::new(408_204.0, 4_080_928.0, 0.0);
        assert_eq!(scene.in_file(Vec3::new(-2.42, 0.1, 2.5)), DVec3::new(408_201.58, 4_080_928.1, 2.5));
    }
}
