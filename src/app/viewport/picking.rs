//! Picking: from a pixel to the surface point, the triangle and the nodes under it. Conversions between the window's
//! points, the picture's pixels and points of the scene.

use std::sync::Arc;

use egui::{PaintCallbackInfo, Pos2, Rect};
use glam::Vec3;

use crate::app::state::{AppState, PickedTriangle, Presented, SecondNodes, TreeSide};
use crate::camera::Camera;
use crate::overlay::{NodeTable, OverlaySettings};
use crate::render::Frame;
use crate::visibility::NodeIdentity;

/// The surface point at pixel (x, y), at full resolution, of `frame`; `None` on the background.
pub fn surface_point(frame: &Frame, x_px: u32, y_px: u32) -> Option<Vec3> {
    let index = frame.index_of(x_px, y_px);
    let distance = *frame.distance.get(index)?;
    if !distance.is_finite() {
        return None;
    }
    let (x, y) = (index as u32 % frame.width_px, index as u32 / frame.width_px);
    let ray = frame.camera.for_size(frame.width_px, frame.height_px).ray(x as f32 + 0.5, y as f32 + 0.5);
    Some(ray.at(distance))
}

/// Index of the triangle at pixel (x, y), at full resolution, of `frame`; `None` on the background.
pub fn primitive_at(frame: &Frame, x_px: u32, y_px: u32) -> Option<u32> {
    frame.primitive.get(frame.index_of(x_px, y_px)).copied().filter(|&primitive| primitive != u32::MAX)
}

/// Selects a triangle and the leaf that holds it; `None` clears the selection.
pub fn pick(state: &mut AppState, primitive: Option<u32>) {
    state.selection.clear();
    let (Some(primitive), Some(presented)) = (primitive, &state.model.presented) else { return };
    let path = presented.accel.path_to(primitive);
    state.selection.nodes.selected = path.last().copied();
    state.selection.picked = (!path.is_empty()).then_some(PickedTriangle { primitive, path });
}

/// Selects a copy with the node that holds it.
pub fn pick_copy(state: &mut AppState, copy: u32) {
    let Some(accel) = state.model.presented.as_ref().map(|shown| Arc::clone(&shown.accel)) else { return };
    if accel.scene.unfolded.ranges.contains(copy) {
        state.selection.clear();
        state.selection.nodes.selected = accel.node_of_copy(copy);
    } else {
        pick(state, Some(copy));
    }
}

/// The copy that is selected, or in whose mesh the selected node is.
pub fn picked_copy(state: &AppState) -> Option<u32> {
    let accel = &state.model.presented.as_ref()?.accel;
    let of_node = state.selection.nodes.selected.and_then(|node| accel.node_of_mesh(node)).map(|(copy, _)| copy);
    let picked = state.selection.picked.as_ref().map(|picked| picked.primitive);
    of_node.or_else(|| Some(accel.scene.copy_of(picked?)?.0))
}

/// Selects a triangle and the leaf of the second tree that holds it; `None` clears the selection.
pub fn pick_in_second(state: &mut AppState, primitive: Option<u32>) {
    pick(state, primitive);
    let leaf = primitive.zip(state.model.second.as_ref()).and_then(|(primitive, second)| leaf_of(second, primitive));
    let with = state.selection.nodes.selected;
    state.selection.second = SecondNodes { selected: leaf, with, ..state.selection.second };
    state.selection.side = if leaf.is_some() { TreeSide::B } else { TreeSide::A };
}

/// The leaf that holds a triangle.
pub(super) fn leaf_of(shown: &Presented, primitive: u32) -> Option<u32> {
    shown.accel.path_to(primitive).last().copied()
}

/// Selects what a menu at a triangle acts on: the selected node if it holds the triangle, else the container drawn around it.
pub fn pick_for_menu(state: &mut AppState, primitive: Option<u32>) {
    let (Some(primitive), Some(presented)) = (primitive, &state.model.presented) else { return };
    let path = presented.accel.path_to(primitive);
    if state.selection.nodes.selected.is_some_and(|node| path.contains(&node)) {
        return;
    }
    let drawn = drawn_node_of(state, primitive);
    pick(state, Some(primitive));
    state.selection.nodes.selected = drawn.or(state.selection.nodes.selected);
}

/// The selection in terms that do not depend on node indices, to be restored in another tree of the same scene.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PortableSelection {
    /// The picked triangle, as hits name it, unless it is a copy whose triangles the tree does not have.
    picked: Option<u32>,
    /// The picked copy.
    copy: Option<u32>,
    /// The selected node in a scene of copies, in which others may be unfolded.
    identity: Option<NodeIdentity>,
    /// The selected node: a triangle below it, and its depth; `None` for the triangle's leaf.
    node: Option<(u32, Option<usize>)>,
}

/// The present selection.
pub(crate) fn portable_selection(state: &AppState) -> PortableSelection {
    let node = state.model.presented.as_ref().zip(state.selection.nodes.selected).and_then(|(shown, node)| {
        let on_path = state.selection.picked.as_ref().and_then(|PickedTriangle { primitive, path }| {
            let depth = path.iter().position(|&step| step == node)?;
            Some((*primitive, (depth + 1 < path.len()).then_some(depth)))
        });
        on_path.or_else(|| {
            let primitive = shown.accel.tree.first_primitive_below(node)?;
            let leaf = shown.table.is_leaf(node);
            Some((primitive, (!leaf).then(|| shown.table.depth(node) as usize)))
        })
    });
    // Primitives have other numbers where other copies are unfolded.
    let hit = |primitive| state.model.presented.as_ref().map_or(primitive, |shown| shown.accel.scene.hit_of(primitive));
    let node = node.map(|(primitive, depth)| (hit(primitive), depth));
    let picked = state.selection.picked.as_ref().map(|picked| picked.primitive);
    let shown = state.model.presented.as_ref().filter(|shown| shown.accel.scene.copies.is_some());
    let copy_of = |primitive| shown.and_then(|shown| shown.accel.scene.copy_of(primitive));
    let copy = picked.and_then(copy_of).and_then(|(copy, triangle)| triangle.is_none().then_some(copy));
    let identity =
        shown.zip(state.selection.nodes.selected).and_then(|(shown, node)| NodeIdentity::of(&shown.accel, node));
    PortableSelection { picked: picked.filter(|_| copy.is_none()).map(hit), copy, identity, node }
}

/// Restores a selection in the presented tree: the same triangle, and in place of the selected node the ancestor of its triangle
/// at the same depth, or the triangle's leaf where that depth is not reached.
pub(crate) fn restore_selection(state: &mut AppState, selection: PortableSelection) {
    // The selection in the second tree stays.
    let of_second = (state.selection.second, state.selection.side);
    let Some(scene) = state.model.presented.as_ref().map(|shown| Arc::clone(&shown.accel.scene)) else { return };
    // A copy that is unfolded now has many triangles, none of which was picked.
    let copy = selection.copy.filter(|copy| !scene.unfolded.ranges.contains(*copy));
    pick(state, copy.or(selection.picked.map(|hit| scene.primitive_of(hit))));
    (state.selection.second, state.selection.side) = of_second;
    let Some((hit, depth)) = selection.node else {
        state.selection.nodes.selected = None;
        return;
    };
    let accel = state.model.presented.as_ref().map(|shown| Arc::clone(&shown.accel));
    if let Some(node) = selection.identity.zip(accel).and_then(|(identity, accel)| identity.find(&accel)) {
        state.selection.nodes.selected = Some(node);
        return;
    }
    let primitive = scene.primitive_of(hit);
    let path = state.model.presented.as_ref().map_or_else(Vec::new, |shown| shown.accel.path_to(primitive));
    let leaf = path.last().copied();
    state.selection.nodes.selected = depth.and_then(|depth| path.get(depth).copied()).or(leaf);
}

/// The deepest node within the drawn range of depths that holds the triangle, or the cluster on show that does; none while the
/// clusters are those of another tree.
pub fn drawn_node_of(state: &AppState, primitive: u32) -> Option<u32> {
    let presented = state.model.presented.as_ref()?;
    let path = presented.accel.path_to(primitive);
    if let Some(standing) = &state.layout.graphics.standing {
        return path.into_iter().find(|&node| standing.table().is_none() && standing.stands(node));
    }
    let table = state.model.layout_of(&presented.accel).unwrap_or(&presented.table);
    drawn_on(path, table, &state.overlay_of(table))
}

/// The deepest node of the second tree within its drawn range of depths that holds the triangle.
pub(super) fn drawn_node_of_second(state: &AppState, primitive: u32) -> Option<u32> {
    let second = state.model.second.as_ref()?;
    drawn_on(second.accel.path_to(primitive), &second.table, &state.overlay_of(&second.table))
}

/// The deepest node on a path from the root that is within the drawn range of depths.
fn drawn_on(mut path: Vec<u32>, table: &NodeTable, overlay: &OverlaySettings) -> Option<u32> {
    path.retain(|&node| table.has(node));
    let [first, last] = table.drawn_depths(overlay);
    path.get(first as usize..path.len().min(last as usize + 1))?.last().copied()
}

/// A rectangle in points as x, y, width and height in pixels of a screen of `screen_size_px`.
pub(crate) fn rect_px(rect: Rect, pixels_per_point: f32, screen_size_px: [u32; 2]) -> [u32; 4] {
    let info = PaintCallbackInfo { viewport: rect, clip_rect: rect, pixels_per_point, screen_size_px };
    let px = info.viewport_in_pixels();
    [px.left_px.max(0) as u32, px.top_px.max(0) as u32, px.width_px.max(0) as u32, px.height_px.max(0) as u32]
}

/// The pixel of the picture under a point of the window; `scale` is in pixels per point, `rect` the viewport's rectangle.
pub(crate) fn pixel_at(at: Pos2, rect: Rect, scale: f32, size_px: [u32; 2]) -> [u32; 2] {
    let inside = (at - rect.min) * scale;
    [(inside.x.max(0.0) as u32).min(size_px[0].max(1) - 1), (inside.y.max(0.0) as u32).min(size_px[1].max(1) - 1)]
}

/// Camera of the presented picture; the wanted one before the first picture.
pub(crate) fn shown_camera(state: &AppState) -> Camera {
    state.model.presented.as_ref().map_or(state.wanted.camera, |presented| presented.frame.camera)
}

/// The surface point that a pixel shows; on the background, the point of its ray at the depth of the camera's target.
pub(crate) fn point_at([x, y]: [u32; 2], state: &AppState) -> Vec3 {
    if let Some(point) = state.model.presented.as_ref().and_then(|shown| surface_point(&shown.frame, x, y)) {
        return point;
    }
    let camera = shown_camera(state);
    let view = camera.for_size(state.layout.viewport_px[0], state.layout.viewport_px[1]);
    let ray = view.ray(x as f32 + 0.5, y as f32 + 0.5);
    let ahead = ray.direction.dot(camera.forward()).max(1e-3);
    ray.at((camera.target - ray.origin).dot(camera.forward()) / ahead)
}
