//! The model with its clips, as a rig that moves.

use std::collections::{HashMap, HashSet};
use std::rc::Rc;
use std::sync::Arc;

use super::animation::Animations;
use super::document::Document;
use super::expand::{Copies, Moved};
use super::nodes::{Ordered, Placement};
use super::table::extension;
use crate::scene::assemble::Assembly;
use crate::scene::error::{FileLocation, Warnings};
use crate::scene::motion::{CopyMotion, Motion, Part, Rig, RigCopy, RigNode, RigSkin, Target, Track};
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// Adds the motion of what was `moved` by the clips of `animations`.
pub(super) fn add_motion(
    document: &Document,
    animations: Animations,
    order: &[Ordered],
    copies: &[Copies],
    moved: Moved,
    assembly: &mut Assembly,
) {
    let places: HashMap<usize, usize> = order.iter().enumerate().map(|(place, one)| (one.node, place)).collect();
    // Nodes of skins and meshes are in the scene.
    let place = |node: usize| places.get(&node).copied().unwrap_or_default();
    let node = |ordered: &Ordered| RigNode {
        parent: ordered.parent,
        local: document.locals.get(ordered.node).copied().unwrap_or_default(),
        is_visible: ordered.is_visible,
        weights: Vec::new(),
    };
    let mut rig = Rig {
        nodes: order.iter().map(node).collect(),
        curves: animations.curves,
        clips: animations.tracks,
        normal_count: assembly.normal_count(),
        tangent_count: assembly.tangent_count(),
        offset: assembly.offset,
        ..Rig::default()
    };
    let mut skins = HashMap::new();
    for one in copies {
        rig.nodes[place(one.placement.node)].weights.clone_from(&one.weights);
        if let Some(skin) = &one.skin {
            skins.entry(Rc::as_ptr(skin)).or_insert_with(|| {
                let joints = skin.joints.iter().map(|&joint| place(joint)).collect();
                rig.skins.push(RigSkin { joints, inverse_bind: skin.inverse_bind.clone() });
                rig.skins.len().saturating_sub(1)
            });
        }
    }
    let placed = match moved {
        Moved::Parts(placed) => placed,
        Moved::Copies(moved) => {
            let copy = |[copy, instance]: [usize; 2]| {
                let Copies { placement, instances, .. } = &copies[copy];
                RigCopy { node: place(placement.node), transform: instances.transform(instance).as_dmat4() }
            };
            rig.copies = moved.into_iter().map(copy).collect();
            if let Some(kept) = &mut assembly.copies {
                kept.motion = Some(CopyMotion { clips: animations.clips, rig: Arc::new(rig) });
            }
            return;
        }
    };
    for one in placed {
        let [copy, instance] = one.copy;
        let copies = &copies[copy];
        let end = one.first_triangle.saturating_add(one.corners.len());
        let has_normals = !one.shape.normals.is_empty();
        rig.corners.extend(one.corners);
        rig.parts.push(Part {
            node: place(copies.placement.node),
            skin: copies.skin.as_ref().and_then(|skin| skins.get(&Rc::as_ptr(skin)).copied()),
            transform: copies.instances.transform(instance).as_dmat4(),
            first_normal: one.first_vertex.filter(|_| has_normals).map(|first| first as usize),
            triangles: one.first_triangle..end,
            shape: one.shape,
        });
    }
    assembly.motion = Some(Motion::new(animations.clips, Box::new(rig)));
}

/// True if clips move nodes and nothing in them, so that the meshes of a scene of `placements` keep their form.
pub(super) fn keeps_meshes(document: &Document, animations: &Animations, placements: &[Placement]) -> bool {
    let deforms = |track: &Track| matches!(track.target, Target::Weights(_) | Target::Visibility(_));
    let has_skin =
        |placement: &Placement| document.gltf.nodes().nth(placement.node).is_some_and(|node| node.skin().is_some());
    !animations.tracks.iter().flatten().any(deforms) && !placements.iter().any(has_skin)
}

/// Counts cameras and lights on nodes that clips move, or below these: all moments show them where the file has them.
pub(super) fn count_carried(
    document: &Document,
    order: &[Ordered],
    moved: &HashSet<usize>,
    warnings: &mut Warnings,
    token: &CancelToken,
) -> Result<(), Cancelled> {
    let carriers: HashSet<usize> = document.cameras.iter().flat_map(|camera| camera.nodes.iter().copied()).collect();
    let mut is_moved = vec![false; order.len()];
    for (place, ordered) in order.iter().enumerate() {
        token.check()?;
        is_moved[place] = moved.contains(&place) || ordered.parent.is_some_and(|parent| is_moved[parent]);
        if !is_moved[place] {
            continue;
        }
        let location = || FileLocation::Json(format!("nodes[{}]", ordered.node));
        if carriers.contains(&ordered.node) {
            warnings.add("cameras that clips move shown where the file has them", location);
        }
        let node = document.gltf.nodes().nth(ordered.node);
        if node.is_some_and(|node| node.extension_value(extension::LIGHTS).is_some()) {
            warnings.add("lights that clips move shown where the file has them", location);
        }
    }
    Ok(())
}
