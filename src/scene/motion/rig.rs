//! Nodes, skins and morph targets, moved by clips: where the vertices of a glTF model are at a time.

use std::ops::Range;
use std::sync::Arc;

use glam::{Affine3A, DMat4, DQuat, DVec3, Mat4, Vec3, Vec4};

use super::clip::Clip;
use super::curve::Curve;
use super::pose::{Moment, Mover, Pose, mark_unusable};
use super::shape::{Shape, Vertices};
use crate::scene::error::LoadError;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::kernel::parallel::par_tasks;

/// Vertices that a task moves.
const VERTICES_PER_TASK: usize = 1 << 12;
/// Triangles that a task makes of vertices.
const TRIANGLES_PER_TASK: usize = 1 << 13;
/// A triangle before it is written.
const NO_TRIANGLE: Triangle = Triangle { a: Vec3::ZERO, b: Vec3::ZERO, c: Vec3::ZERO };

/// The transform of a node into the space of its parent.
#[derive(Debug, Clone, Copy)]
pub(in crate::scene) struct Local {
    pub(in crate::scene) scale: DVec3,
    /// Of unit length.
    pub(in crate::scene) rotation: DQuat,
    pub(in crate::scene) translation: DVec3,
    /// Instead of the three, unless a clip moves the node.
    pub(in crate::scene) matrix: Option<DMat4>,
}

impl Default for Local {
    fn default() -> Self {
        Self { scale: DVec3::ONE, rotation: DQuat::IDENTITY, translation: DVec3::ZERO, matrix: None }
    }
}

impl Local {
    /// The transform as a matrix.
    pub(in crate::scene) fn transform(&self) -> DMat4 {
        let Self { scale, rotation, translation, matrix } = *self;
        matrix.unwrap_or_else(|| DMat4::from_scale_rotation_translation(scale, rotation, translation))
    }

    /// The same by scale, rotation and translation. A shear is lost.
    fn apart(self) -> Self {
        let Some(matrix) = self.matrix else { return self };
        let (scale, rotation, translation) = matrix.to_scale_rotation_translation();
        // Without a direction where an axis has no length.
        let rotation = if rotation.is_finite() { rotation.normalize() } else { DQuat::IDENTITY };
        Self { scale, rotation, translation, matrix: None }
    }
}

/// A node of the hierarchy.
#[derive(Debug)]
pub(in crate::scene) struct RigNode {
    /// Place of the parent in the list of nodes, before this one; `None` for a root.
    pub(in crate::scene) parent: Option<usize>,
    /// Into the space of the parent, unless a clip moves the node.
    pub(in crate::scene) local: Local,
    /// Whether it is shown, as far as the node itself decides.
    pub(in crate::scene) is_visible: bool,
    /// Weights of the morph targets of its mesh.
    pub(in crate::scene) weights: Vec<f32>,
}

/// A skin.
#[derive(Debug)]
pub(in crate::scene) struct RigSkin {
    /// Places of the joints in the list of nodes.
    pub(in crate::scene) joints: Vec<usize>,
    /// From mesh space to that of each joint.
    pub(in crate::scene) inverse_bind: Vec<DMat4>,
}

/// One copy of a mesh, or a part of it.
#[derive(Debug)]
pub(in crate::scene) struct Part {
    pub(in crate::scene) shape: Arc<Shape>,
    /// Place of its node in the list.
    pub(in crate::scene) node: usize,
    /// Index of its skin, for which the transform of the node counts nothing.
    pub(in crate::scene) skin: Option<usize>,
    /// Of the copy, before the transform of the node.
    pub(in crate::scene) transform: DMat4,
    /// Index of the first of its vertices among those of the scene's normals and tangents; `None` where it has no normals.
    pub(in crate::scene) first_normal: Option<usize>,
    /// Its triangles in the scene.
    pub(in crate::scene) triangles: Range<usize>,
}

/// A copy of a mesh that stays as it is.
#[derive(Debug, Clone, Copy)]
pub(in crate::scene) struct RigCopy {
    /// Place of its node in the list.
    pub(in crate::scene) node: usize,
    /// Before the transform of the node.
    pub(in crate::scene) transform: DMat4,
}

/// A property of a node, by the place of the node in the list.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(in crate::scene) enum Target {
    Translation(usize),
    Rotation(usize),
    Scale(usize),
    /// Weights of morph targets.
    Weights(usize),
    /// Shown where the curve is at least one half.
    Visibility(usize),
}

/// The course of one property in a clip.
#[derive(Debug, Clone, Copy)]
pub(in crate::scene) struct Track {
    pub(in crate::scene) target: Target,
    /// Index of the curve.
    pub(in crate::scene) curve: usize,
}

/// A model of nodes, skins and morph targets with its clips.
#[derive(Debug, Default)]
pub(in crate::scene) struct Rig {
    /// Parents before their children.
    pub(in crate::scene) nodes: Vec<RigNode>,
    pub(in crate::scene) skins: Vec<RigSkin>,
    pub(in crate::scene) parts: Vec<Part>,
    /// The copies of meshes that have no triangles here.
    pub(in crate::scene) copies: Vec<RigCopy>,
    /// Corners of each triangle of the scene, by vertices of its part.
    pub(in crate::scene) corners: Vec<[u32; 3]>,
    pub(in crate::scene) curves: Vec<Curve>,
    /// The tracks of each clip.
    pub(in crate::scene) clips: Vec<Vec<Track>>,
    /// Length of the list of the scene's normals; 0 where it has none.
    pub(in crate::scene) normal_count: usize,
    /// The same of the list of tangents.
    pub(in crate::scene) tangent_count: usize,
    /// Subtracted from all coordinates.
    pub(in crate::scene) offset: DVec3,
}

/// How copies of meshes move.
#[derive(Debug, Clone)]
pub struct CopyMotion {
    /// The clips, at least one.
    pub(in crate::scene) clips: Vec<Clip>,
    /// The nodes that carry the copies, with all of these in order.
    pub(in crate::scene) rig: Arc<Rig>,
}

/// The hierarchy at a moment.
struct Bones<'a> {
    /// To the world from each node.
    worlds: Vec<DMat4>,
    is_visible: Vec<bool>,
    /// Weights of the morph targets of each node.
    weights: Vec<std::borrow::Cow<'a, [f32]>>,
}

impl Rig {
    /// Where the nodes are at a moment of one of the clips.
    fn bones(&self, moment: Moment) -> Bones<'_> {
        let mut worlds: Vec<DMat4> = self.nodes.iter().map(|node| node.local.transform()).collect();
        let mut is_visible: Vec<bool> = self.nodes.iter().map(|node| node.is_visible).collect();
        let mut weights: Vec<_> = self.nodes.iter().map(|node| node.weights[..].into()).collect();
        let time = moment.seconds;
        // The tracks of a node are adjacent, so that its transform is taken apart once.
        for tracks in self.clips[moment.clip].chunk_by(|a, b| a.target.node() == b.target.node()) {
            let node = tracks[0].target.node();
            let (mut local, mut moves) = (self.nodes[node].local.apart(), false);
            for track in tracks {
                let curve = &self.curves[track.curve];
                let vector = || DVec3::from_array(curve.vector(time).map(f64::from));
                match track.target {
                    Target::Translation(_) => local.translation = vector(),
                    Target::Rotation(_) => local.rotation = curve.rotation(time),
                    Target::Scale(_) => local.scale = vector(),
                    Target::Weights(_) => {
                        weights[node] = (0..curve.width()).map(|target| curve.component(time, target)).collect();
                    }
                    Target::Visibility(_) => is_visible[node] = curve.component(time, 0) >= 0.5,
                }
                moves |= matches!(track.target, Target::Translation(_) | Target::Rotation(_) | Target::Scale(_));
            }
            if moves {
                worlds[node] = local.transform();
            }
        }
        for (index, node) in self.nodes.iter().enumerate() {
            if let Some(parent) = node.parent {
                worlds[index] = worlds[parent] * worlds[index];
                is_visible[index] &= is_visible[parent];
            }
        }
        Bones { worlds, is_visible, weights }
    }

    /// From the space of each copy to the scene, at a moment of one of the clips; rounded as that of a part is.
    pub(in crate::scene) fn of_copies(&self, moment: Moment) -> Vec<Affine3A> {
        let (Bones { worlds, .. }, to_scene) = (self.bones(moment), self.to_scene());
        let of_copy = |copy: &RigCopy| Affine3A::from_mat4((to_scene * worlds[copy.node] * copy.transform).as_mat4());
        self.copies.iter().map(of_copy).collect()
    }

    fn to_scene(&self) -> DMat4 {
        DMat4::from_translation(-self.offset)
    }

    /// From the space of each part to the scene, one transform or one of each joint.
    fn transforms(&self, worlds: &[DMat4]) -> Vec<Arc<[Mat4]>> {
        let to_scene = self.to_scene();
        let of_skin = |skin: &RigSkin| -> Arc<[Mat4]> {
            let joints = skin.joints.iter().zip(&skin.inverse_bind);
            joints.map(|(&joint, inverse)| (to_scene * worlds[joint] * *inverse).as_mat4()).collect()
        };
        let skins: Vec<Arc<[Mat4]>> = self.skins.iter().map(of_skin).collect();
        let of_part = |part: &Part| match part.skin {
            Some(skin) => Arc::clone(&skins[skin]),
            None => [(to_scene * worlds[part.node] * part.transform).as_mat4()].into(),
        };
        self.parts.iter().map(of_part).collect()
    }
}

impl Target {
    /// Place of the node in the list.
    pub(in crate::scene) fn node(self) -> usize {
        match self {
            Self::Translation(node)
            | Self::Rotation(node)
            | Self::Scale(node)
            | Self::Weights(node)
            | Self::Visibility(node) => node,
        }
    }
}

/// Vertices of a part to be moved by one task.
struct Task<'a> {
    part: usize,
    /// Index of the first vertex in the part.
    first: usize,
    vertices: Vertices<'a>,
}

impl Mover for Rig {
    fn triangle_count(&self) -> usize {
        self.corners.len()
    }

    fn pose(&self, moment: Moment, pose: &mut Pose, token: &CancelToken) -> Result<(), LoadError> {
        token.check()?;
        let Bones { worlds, is_visible, weights } = self.bones(moment);
        let transforms = self.transforms(&worlds);
        let vertex_count = self.parts.iter().map(|part| part.shape.positions.len()).sum();
        pose.positions.resize(vertex_count, Vec3::ZERO);
        pose.normals.resize(self.normal_count, Vec3::ZERO);
        pose.tangents.resize(self.tangent_count, Vec4::ZERO);
        pose.triangles.resize(self.corners.len(), NO_TRIANGLE);
        let tasks = self.tasks(&mut pose.positions, &mut pose.normals, &mut pose.tangents);
        par_tasks(tasks, token, |Task { part, first, vertices }, _| {
            let Part { shape, node, .. } = &self.parts[part];
            let Vertices { positions, normals, tangents } = vertices;
            let vertices = Vertices { positions: &mut *positions, normals, tangents };
            shape.place(first, &transforms[part], &weights[*node], vertices);
            mark_unusable(positions);
            Ok(())
        })?;
        let mut first_vertex = 0;
        pose.lost = 0;
        for part in &self.parts {
            let end = first_vertex + part.shape.positions.len();
            let positions = &pose.positions[first_vertex..end];
            first_vertex = end;
            let corners = self.corners[part.triangles.clone()].chunks(TRIANGLES_PER_TASK);
            let triangles = pose.triangles[part.triangles.clone()].chunks_mut(TRIANGLES_PER_TASK);
            let is_visible = is_visible[part.node];
            let lost = par_tasks(triangles.zip(corners), token, |(triangles, corners), _| {
                let mut lost = 0;
                for (triangle, corners) in triangles.iter_mut().zip(corners) {
                    let [a, b, c] = corners.map(|corner| positions[corner as usize]);
                    *triangle = Triangle { a, b, c };
                    let is_usable = !(a + b + c).is_nan();
                    if !(is_usable && is_visible) {
                        // Triangles that are hidden or nowhere stay in the list as points, which no ray hits.
                        let point = [a, b, c].into_iter().find(|corner| !corner.is_nan()).unwrap_or_default();
                        *triangle = Triangle { a: point, b: point, c: point };
                        lost += u64::from(!is_usable && is_visible);
                    }
                }
                Ok(lost)
            })?;
            pose.lost += lost.into_iter().sum::<u64>();
        }
        Ok(())
    }

    fn bytes(&self) -> usize {
        let mut shapes: Vec<&Arc<Shape>> = self.parts.iter().map(|part| &part.shape).collect();
        shapes.sort_unstable_by_key(|shape| Arc::as_ptr(shape));
        shapes.dedup_by_key(|shape| Arc::as_ptr(shape));
        let shapes: usize = shapes.iter().map(|shape| shape.bytes()).sum();
        let curves: usize = self.curves.iter().map(Curve::bytes).sum();
        let tracks: usize = self.clips.iter().map(|tracks| size_of_val(&tracks[..])).sum();
        shapes + curves + tracks + size_of_val(&self.corners[..]) + size_of_val(&self.nodes[..])
    }
}

impl Rig {
    /// The lists of vertices, cut into tasks.
    fn tasks<'a>(
        &self,
        mut positions: &'a mut [Vec3],
        mut normals: &'a mut [Vec3],
        mut tangents: &'a mut [Vec4],
    ) -> Vec<Task<'a>> {
        let (mut tasks, mut next) = (Vec::new(), 0);
        for (part, Part { shape, first_normal, .. }) in self.parts.iter().enumerate() {
            let count = shape.positions.len();
            let (mut own_normals, mut own_tangents): (&mut [Vec3], &mut [Vec4]) = (&mut [], &mut []);
            if let Some(first) = *first_normal {
                take(&mut normals, first - next);
                take(&mut tangents, first - next);
                own_normals = take(&mut normals, count);
                own_tangents = take(&mut tangents, count);
                next = first + count;
            }
            if shape.tangents.is_empty() {
                own_tangents = &mut [];
            }
            for (task, positions) in take(&mut positions, count).chunks_mut(VERTICES_PER_TASK).enumerate() {
                let count = positions.len();
                let (normals, tangents) = (take(&mut own_normals, count), take(&mut own_tangents, count));
                let vertices = Vertices { positions, normals, tangents };
                tasks.push(Task { part, first: task * VERTICES_PER_TASK, vertices });
            }
        }
        tasks
    }
}

/// Splits the first `count` elements off a list; none off an empty one.
#[allow(clippy::mut_mut, reason = "the list that is left is another slice")]
fn take<'a, T>(list: &mut &'a mut [T], count: usize) -> &'a mut [T] {
    list.split_off_mut(..count.min(list.len())).unwrap_or_default()
}
