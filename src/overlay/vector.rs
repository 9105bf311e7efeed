//! The containers as lines on the plane of the picture, for vector graphics: projected, and cut where they pass behind the
//! traced surface. Needs no graphics driver.

use glam::Vec3;

use super::container_set::ContainerSet;
use super::highlight::highlighted;
use super::level::{HIDDEN_SILHOUETTE, level_color, level_width, strength};
use super::node::{OverlayNode, Role};
use super::node_table::{NodeTable, Shown};
use super::ramp::ramp;
use super::selection::Selection;
use super::settings::OverlaySettings;
use super::viewpoint::Viewpoint;
use crate::camera::{CameraFrame, Projection};
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::{Aabb, Dop14, OrientedBox};
use bvhscope_engine::tree::ContainerKind;

/// Segments of a circle.
const CIRCLE_SEGMENTS: usize = 96;
/// Places along a line at which it is compared with the surface: one a pixel, and at most this many.
const MAX_STEPS: f32 = 4096.0;
/// Size in pixels from which containers have full lines, and the opacity of the smallest; as in `line.wgsl`.
const FULL_SIZE_PX: f32 = 56.0;
const FAINTEST: f32 = 0.12;
/// Opacity of highlighted lines behind the surface at least; as in `line.wgsl`.
const LEAST_MARKED_ALPHA: f32 = 0.4;

/// The containers to draw, and the viewpoint.
pub struct VectorInput<'a> {
    /// The nodes of the tree.
    pub table: &'a NodeTable,
    /// The nodes that are drawn: [`NodeTable::shown`] of the same settings.
    pub shown: &'a Shown,
    /// How they are drawn.
    pub settings: &'a OverlaySettings,
    /// Selected, hovered and hidden nodes.
    pub selection: &'a Selection,
    /// Camera, size of the picture and section plane.
    pub viewpoint: Viewpoint,
    /// Linear view depth of each pixel, row by row; empty where no surface hides lines.
    pub depth: &'a [f32],
    /// Colours of the picture stand for values, so lines are white with a dark edge rather than coloured.
    pub neutral_lines: bool,
}

/// Lines of one container that look the same.
#[derive(Debug, Clone, PartialEq)]
pub struct VectorLines {
    /// The node.
    pub node: u32,
    /// sRGB colour.
    pub color: [u8; 3],
    /// Opacity, 0 to 1.
    pub opacity: f32,
    /// Width in pixels.
    pub width_px: f32,
    /// Polylines as pixels from the upper left corner.
    pub lines: Vec<Vec<[f32; 2]>>,
}

/// How the lines of a container look.
struct Stroke {
    color: [u8; 3],
    width_px: f32,
    /// Opacity in front of the surface, and behind it.
    opacity: [f32; 2],
}

/// The lines of all drawn containers, from below.
pub fn vector_lines(input: &VectorInput<'_>, token: &CancelToken) -> Result<Vec<VectorLines>, Cancelled> {
    let projector = Projector::new(input);
    let mut all = Vec::new();
    let shown = input.table.instances(input.shown, input.settings).into_iter().map(|node| (node, Role::Shown));
    let marked = highlighted(input.table, input.selection).into_iter().map(|(node, role)| {
        let depth = input.table.depth(node);
        (input.table.instance(node, depth, input.settings), role)
    });
    // Dots are left out.
    for (node, role) in shown.take(input.shown.outlined).chain(marked) {
        token.check()?;
        let own = input.table.container_kind();
        // Highlighted nodes are drawn as the containers of the tree.
        let kinds = if role == Role::Shown { input.settings.kinds(own) } else { ContainerSet::of(own) };
        for (kind, curves) in outlines(&node, kinds, &projector) {
            projector.add(node.node, &stroke(&node, role, kind, input, &projector), &curves, &mut all);
        }
    }
    Ok(all)
}

/// The outline of a node as each of the kinds that are drawn: polylines in world space.
fn outlines(
    node: &OverlayNode,
    kinds: ContainerSet,
    projector: &Projector<'_>,
) -> Vec<(ContainerKind, Vec<Vec<Vec3>>)> {
    let outline = |kind| match kind {
        ContainerKind::Aabb => edges(&bounds(node)).map(Vec::from).into(),
        ContainerKind::Sphere => {
            projector.silhouette(node.sphere_center.into(), node.sphere_radius).into_iter().collect()
        }
        ContainerKind::Dop14 => {
            let dop = Dop14 { bounds: bounds(node), low: node.low, high: node.high };
            dop.edges().into_iter().map(Vec::from).collect()
        }
        ContainerKind::Oriented => {
            let corner = |at: usize| {
                let along = node.edges.iter().enumerate().filter(|(edge, _)| at >> edge & 1 == 1);
                along.fold(Vec3::from(node.corner), |corner, (_, edge)| corner + Vec3::from(*edge))
            };
            OrientedBox::EDGES.map(|ends| ends.map(corner).to_vec()).into()
        }
    };
    kinds.iter().map(|kind| (kind, outline(kind))).collect()
}

fn bounds(node: &OverlayNode) -> Aabb {
    Aabb { min: node.box_min.into(), max: node.box_max.into() }
}

/// The twelve edges of a box.
fn edges(bounds: &Aabb) -> [[Vec3; 2]; 12] {
    std::array::from_fn(|edge| {
        // Four edges along each axis; the lower two bits select the corner on the other two axes.
        let axis = edge / 4;
        let corner = |along: bool| {
            let mut upper = [false; 3];
            upper[axis] = along;
            upper[(axis + 1) % 3] = edge & 1 != 0;
            upper[(axis + 2) % 3] = edge & 2 != 0;
            Vec3::from_array(std::array::from_fn(|axis| if upper[axis] { bounds.max[axis] } else { bounds.min[axis] }))
        };
        [corner(false), corner(true)]
    })
}

/// Colour, width and opacities as in `line.wgsl`.
fn stroke(
    node: &OverlayNode,
    role: Role,
    kind: ContainerKind,
    input: &VectorInput<'_>,
    projector: &Projector<'_>,
) -> Stroke {
    let settings = input.settings;
    let (center, radius) = match kind {
        ContainerKind::Aabb | ContainerKind::Dop14 => (bounds(node).center(), bounds(node).extent().length() * 0.5),
        ContainerKind::Sphere => (node.sphere_center.into(), node.sphere_radius),
        ContainerKind::Oriented => {
            let diagonal: Vec3 = node.edges.iter().map(|edge| Vec3::from(*edge)).sum();
            (Vec3::from(node.corner) + diagonal * 0.5, diagonal.length() * 0.5)
        }
    };
    let size = projector.size_px(center, radius) / FULL_SIZE_PX;
    let thin = 0.6 + 0.4 * size.min(1.0);
    let hidden = settings.hidden_alpha.clamp(0.0, 1.0);
    if let Some(color) = role.color() {
        let behind = if role == Role::Waiting { hidden } else { hidden.max(LEAST_MARKED_ALPHA) };
        return Stroke { color, width_px: settings.line_width * role.width() * thin, opacity: [1.0, behind] };
    }
    let front = size.clamp(FAINTEST, 1.0) * strength(input.selection.selected.is_some(), input.neutral_lines);
    let silhouette = if kind == ContainerKind::Sphere { HIDDEN_SILHOUETTE } else { 1.0 };
    let color = ramp(node.place);
    let levels = input.shown.levels;
    Stroke {
        color: if input.neutral_lines {
            [255; 3]
        } else if input.shown.colors.is_by_depth() {
            level_color(color, node.depth, levels)
        } else {
            color
        },
        width_px: settings.line_width * level_width(node.depth, levels) * thin,
        // Lines behind the surface fade twice with the size.
        opacity: [front, front * front * hidden * silhouette],
    }
}

/// The camera prepared for points.
struct Projector<'a> {
    frame: CameraFrame,
    size_px: [f32; 2],
    is_perspective: bool,
    near: f32,
    viewpoint: Viewpoint,
    depth: &'a [f32],
}

impl<'a> Projector<'a> {
    fn new(input: &VectorInput<'a>) -> Self {
        let Viewpoint { camera, size_px: [width, height], .. } = input.viewpoint;
        Self {
            frame: camera.for_size(width, height),
            size_px: [width as f32, height as f32],
            is_perspective: camera.projection == Projection::Perspective,
            near: if camera.projection == Projection::Perspective {
                camera.distance() * 1e-4
            } else {
                f32::NEG_INFINITY
            },
            viewpoint: input.viewpoint,
            depth: input.depth,
        }
    }

    /// View depth, and the place in pixels.
    fn project(&self, point: Vec3) -> (f32, [f32; 2]) {
        let (right, up, forward) = self.frame.axes();
        let from_eye = point - self.viewpoint.camera.eye;
        let (depth, half) = (from_eye.dot(forward), self.frame.half_extent());
        let scale = if self.is_perspective { depth } else { 1.0 };
        let [x, y] = [from_eye.dot(right) / (half.x * scale), -from_eye.dot(up) / (half.y * scale)];
        (depth, [(x * 0.5 + 0.5) * self.size_px[0], (y * 0.5 + 0.5) * self.size_px[1]])
    }

    /// Diameter in pixels of a ball.
    fn size_px(&self, center: Vec3, radius: f32) -> f32 {
        let (depth, _) = self.project(center);
        let unit = if self.is_perspective { depth.max(radius) } else { 1.0 };
        radius / (self.frame.half_extent().y * unit) * self.size_px[1]
    }

    /// The silhouette of a sphere, along which rays from the eye touch it; `None` from inside.
    fn silhouette(&self, center: Vec3, radius: f32) -> Option<Vec<Vec3>> {
        let to_center = center - self.viewpoint.camera.eye;
        let distance = to_center.length();
        if radius <= 0.0 || self.is_perspective && distance <= radius * 1.0001 {
            return None;
        }
        let (_, _, forward) = self.frame.axes();
        let (axis, ratio) =
            if self.is_perspective { (to_center / distance, radius / distance) } else { (forward, 0.0) };
        let (u, v) = axis.any_orthonormal_pair();
        let (middle, radius) = (center - axis * (radius * ratio), radius * (1.0 - ratio * ratio).max(0.0).sqrt());
        let point = |step: usize| {
            let (sin, cos) = (step as f32 / CIRCLE_SEGMENTS as f32 * std::f32::consts::TAU).sin_cos();
            middle + (u * cos + v * sin) * radius
        };
        Some((0..=CIRCLE_SEGMENTS).map(point).collect())
    }

    /// A place in front of the surface at its pixel.
    fn is_in_front(&self, depth: f32, [x, y]: [f32; 2]) -> bool {
        let [width, height] = self.viewpoint.size_px.map(|size| size.max(1) as usize);
        let [x, y] = [(x.max(0.0) as usize).min(width - 1), (y.max(0.0) as usize).min(height - 1)];
        let Some(&surface) = self.depth.get(y * width + x) else { return true };
        let least = if self.is_perspective { 0.0 } else { self.viewpoint.camera.distance() * 1e-3 };
        depth <= surface + (surface.abs() * 1e-3).max(least)
    }

    /// Draws polylines with a stroke, and appends those in front of the surface and those behind it.
    fn add(&self, node: u32, stroke: &Stroke, curves: &[Vec<Vec3>], all: &mut Vec<VectorLines>) {
        let mut parts = [Vec::new(), Vec::new()];
        for curve in curves {
            for pair in curve.windows(2) {
                self.add_segment([pair[0], pair[1]], &mut parts);
            }
        }
        // Hidden lines lie below.
        for (lines, opacity) in parts.into_iter().zip(stroke.opacity).rev() {
            if !lines.is_empty() && opacity > 0.0 {
                all.push(VectorLines { node, color: stroke.color, opacity, width_px: stroke.width_px, lines });
            }
        }
    }

    /// Cuts a segment at the near plane and at the section, then where it passes the surface.
    fn add_segment(&self, [a, b]: [Vec3; 2], parts: &mut [Vec<Vec<[f32; 2]>>; 2]) {
        let mut range = [0.0_f32, 1.0];
        let mut cut = |at_a: f32, at_b: f32| match (at_a < 0.0, at_b < 0.0) {
            (true, true) => range = [1.0, 0.0],
            (true, false) => range[0] = range[0].max(at_a / (at_a - at_b)),
            (false, true) => range[1] = range[1].min(at_a / (at_a - at_b)),
            (false, false) => {}
        };
        if self.is_perspective {
            cut(self.project(a).0 - self.near, self.project(b).0 - self.near);
        }
        if let Some(plane) = self.viewpoint.section {
            let (normal, offset) = plane.outward();
            cut(offset - normal.dot(a), offset - normal.dot(b));
        }
        if range[0] >= range[1] {
            return;
        }
        let at = |part: f32| self.project(a.lerp(b, range[0] + (range[1] - range[0]) * part));
        let [from, to] = [at(0.0).1, at(1.0).1];
        let length = (to[0] - from[0]).hypot(to[1] - from[1]);
        let steps = length.ceil().clamp(1.0, MAX_STEPS) as usize;
        let mut run: Option<(bool, [f32; 2])> = None;
        let mut last = from;
        for step in 0..=steps {
            let (depth, place) = at(step as f32 / steps as f32);
            let in_front = self.is_in_front(depth, place);
            match run {
                Some((front, _)) if front == in_front => {}
                Some((front, start)) => {
                    join(&mut parts[usize::from(!front)], start, place);
                    run = Some((in_front, place));
                }
                None => run = Some((in_front, place)),
            }
            last = place;
        }
        if let Some((front, start)) = run {
            join(&mut parts[usize::from(!front)], start, last);
        }
    }
}

/// Appends a line, to the last polyline where it goes on from there.
fn join(lines: &mut Vec<Vec<[f32; 2]>>, from: [f32; 2], to: [f32; 2]) {
    if from == to {
        return;
    }
    match lines.last_mut() {
        Some(line) if line.last() == Some(&from) => line.push(to),
        _ => lines.push(vec![from, to]),
    }
}
