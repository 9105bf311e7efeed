//! The model with its clips, as a rig that moves.

use std::collections::HashMap;
use std::rc::Rc;

use super::animation::Animations;
use super::document::Document;
use super::expand::{Copies, Placed};
use super::nodes::Ordered;
use crate::scene::assemble::Assembly;
use crate::scene::motion::{Motion, Part, Rig, RigNode, RigSkin};

/// The motion of what was `placed` by the clips of `animations`.
pub(super) fn motion(
    document: &Document,
    animations: Animations,
    order: &[Ordered],
    copies: &[Copies],
    placed: Vec<Placed>,
    assembly: &Assembly,
) -> Motion {
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
    Motion::new(animations.clips, Box::new(rig))
}
