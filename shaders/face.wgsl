// Faint faces of containers towards the viewer. Prepended to the drawables made of them.

// Opacity of one face in front of the surface.
const FACE_ALPHA: f32 = 0.07;

struct FaceVertex {
    @builtin(position) position: vec4f,
    // View space.
    @location(0) point: vec3f,
    @location(1) @interpolate(flat) color: vec4f,
}

fn face_vertex(point: vec3f, size: f32, node: Node) -> FaceVertex {
    let role = (node.flags >> ROLE_SHIFT) & ROLE_MASK;
    let color = color_of(node, role);
    let clip = to_clip(point);
    return FaceVertex(vec4f(clip.xy, 0.5 * clip.z, clip.z), point, vec4f(color.rgb, FACE_ALPHA * strength_of(size, role)));
}

fn no_face() -> FaceVertex {
    var out: FaceVertex;
    out.position = vec4f(0.0, 0.0, -2.0, 1.0);
    return out;
}

@fragment
fn fs_face(in: FaceVertex) -> @location(0) vec4f {
    if dot(view.section, vec4f(in.point, 1.0)) > 0.0 || !is_in_front(in.position.xy, in.point.z) {
        discard;
    }
    return vec4f(to_target(in.color.rgb), 1.0) * in.color.a;
}
