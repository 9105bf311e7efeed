//! Every shader is valid WGSL and agrees with its mirror in Rust. Needs no GPU.

use std::mem::{offset_of, size_of};

use bvhscope::overlay::{OverlayNode, ViewUniforms, shader_sources};
use naga::ShaderStage;
use naga::front::wgsl::parse_str;
use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{Binding, Module, ScalarKind, TypeInner};

fn members<'a>(module: &'a Module, name: &str) -> (&'a [naga::StructMember], u32) {
    let found = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name)).unwrap();
    let TypeInner::Struct { members, span } = &found.1.inner else { panic!("{name} is no struct") };
    (members, *span)
}

#[test]
fn every_shader_is_valid() {
    for source in &shader_sources() {
        let module = parse_str(source).unwrap_or_else(|error| panic!("{}", error.emit_to_string(source)));
        // No capabilities: what every driver has, the GL fallback too.
        Validator::new(ValidationFlags::all(), Capabilities::empty())
            .validate(&module)
            .unwrap_or_else(|error| panic!("{}", error.emit_to_string(source)));
        let stages = [ShaderStage::Vertex, ShaderStage::Fragment]
            .map(|stage| module.entry_points.iter().filter(|entry| entry.stage == stage).count());
        assert!(stages[0] == 1 && stages[1] >= 1, "a vertex stage and a fragment stage for it");
    }
}

#[test]
fn every_shader_file_is_used() {
    for entry in std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/shaders")).unwrap() {
        let path = entry.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(shader_sources().iter().any(|shader| shader.contains(&text)), "{} is used nowhere", path.display());
    }
}

#[test]
fn view_uniforms_have_the_layout_of_rust() {
    let module = parse_str(&shader_sources()[1]).unwrap();
    let (members, span) = members(&module, "View");
    assert_eq!(span as usize, size_of::<ViewUniforms>());
    let offset = |name: &str| members.iter().find(|m| m.name.as_deref() == Some(name)).unwrap().offset as usize;
    assert_eq!(offset("eye"), offset_of!(ViewUniforms, eye));
    assert_eq!(offset("perspective"), offset_of!(ViewUniforms, perspective));
    assert_eq!(offset("near"), offset_of!(ViewUniforms, near));
    assert_eq!(offset("depth_slack"), offset_of!(ViewUniforms, depth_slack));
    assert_eq!(offset("half_width_px"), offset_of!(ViewUniforms, half_width_px));
    assert_eq!(offset("tangent"), offset_of!(ViewUniforms, tangent));
    assert_eq!(offset("covered"), offset_of!(ViewUniforms, covered));
    assert_eq!(offset("viewport"), offset_of!(ViewUniforms, viewport));
    assert_eq!(offset("hidden_alpha"), offset_of!(ViewUniforms, hidden_alpha));
    assert_eq!(offset("by_depth"), offset_of!(ViewUniforms, by_depth));
    assert_eq!(offset("circle_segments"), offset_of!(ViewUniforms, circle_segments));
    assert_eq!(offset("show_picture"), offset_of!(ViewUniforms, show_picture));
    assert_eq!(offset("background"), offset_of!(ViewUniforms, background));
    assert_eq!(offset("ramp"), offset_of!(ViewUniforms, ramp));
}

#[test]
fn nodes_have_the_layout_of_rust() {
    assert_eq!(size_of::<OverlayNode>(), 136);
    let module = parse_str(&shader_sources()[1]).unwrap();
    let (members, _) = members(&module, "Node");
    // Vertex attributes lie one after the other without gaps, in the order of their locations.
    let mut offset = 0;
    let offsets: Vec<usize> = members
        .iter()
        .enumerate()
        .map(|(index, member)| {
            assert!(matches!(member.binding, Some(Binding::Location { location, .. }) if location == index as u32));
            let start = offset;
            offset += module.types[member.ty].inner.size(module.to_ctx()) as usize;
            start
        })
        .collect();
    assert_eq!(offset, size_of::<OverlayNode>());
    assert_eq!(
        offsets,
        [
            offset_of!(OverlayNode, box_min),
            offset_of!(OverlayNode, depth),
            offset_of!(OverlayNode, box_max),
            offset_of!(OverlayNode, place),
            offset_of!(OverlayNode, sphere_center),
            offset_of!(OverlayNode, node),
            offset_of!(OverlayNode, flags),
            offset_of!(OverlayNode, low),
            offset_of!(OverlayNode, high),
            offset_of!(OverlayNode, corner),
            offset_of!(OverlayNode, edges),
            offset_of!(OverlayNode, edges) + 12,
            offset_of!(OverlayNode, edges) + 24,
        ]
    );
    let kinds = members.iter().map(|member| module.types[member.ty].inner.scalar_kind().unwrap());
    let uints = kinds.filter(|kind| *kind == ScalarKind::Uint).count();
    assert_eq!(uints, 3, "depth, node, flags");
}
