// Faint faces of containers towards the viewer. Prepended to the drawables made of them.

// Opacity of one face in front of the surface.
const FACE_ALPHA: f32 = 0.07;
// Opacity of a face of an overlap, which is seen through the surface.
const OVERLAP_ALPHA: f32 = 0.4;
// The same behind the surface, relative to in front of it.
const BEHIND: f32 = 0.6;

struct FaceVertex {
    @builtin(position) position: vec4f,
    // View space.
    @location(0) point: vec3f,
    @location(1) @interpolate(flat) color: vec4f,
    // Opacity behind the surface, relative to in front of it.
    @location(2) @interpolate(flat) behind: f32,
}

fn face_vertex(point: vec3f, size: f32, node: Node) -> FaceVertex {
    let role = (node.flags >> ROLE_SHIFT) & ROLE_MASK;
    let color = color_of(node, role);
    let clip = to_clip(point);
    let is_overlap = role == ROLE_OVERLAP;
    let alpha = select(FACE_ALPHA, OVERLAP_ALPHA, is_overlap) * strength_of(size, role);
    let behind = select(0.0, BEHIND, is_overlap);
    return FaceVertex(vec4f(clip.xy, 0.5 * clip.z, clip.z), point, vec4f(color.rgb, alpha), behind);
}

fn no_face() -> FaceVertex {
    var out: FaceVertex;
    out.position = vec4f(0.0, 0.0, -2.0, 1.0);
    return out;
}

@fragment
fn fs_face(in: FaceVertex) -> @location(0) vec4f {
    let visible = select(in.behind, 1.0, is_in_front(in.position.xy, in.point.z));
    if dot(view.section, vec4f(in.point, 1.0)) > 0.0 || visible <= 0.0 {
        discard;
    }
    return vec4f(to_target(in.color.rgb), 1.0) * in.color.a * visible;
}
