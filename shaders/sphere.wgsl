// A sphere: its silhouette as seen by the camera, then three great circles, which only highlighted spheres have: those of many
// spheres cover each other.

@vertex
fn vs_sphere(@builtin(vertex_index) index: u32, node: Node) -> LineVertex {
    let segment = index >> 2u;
    let which = segment / view.circle_segments;
    let step = f32(segment % view.circle_segments);
    let center = node.sphere.xyz;
    let r = node.sphere.w;
    var circle = Circle(center, vec3f(r, 0.0, 0.0), vec3f(0.0, r, 0.0), true);
    if which == 0u {
        circle = outline(center, r);
    } else if which == 2u {
        circle = Circle(center, vec3f(0.0, r, 0.0), vec3f(0.0, 0.0, r), true);
    } else if which == 3u {
        circle = Circle(center, vec3f(r, 0.0, 0.0), vec3f(0.0, 0.0, r), true);
    }
    let role = (node.flags >> ROLE_SHIFT) & ROLE_MASK;
    if !circle.exists || r < 0.0 || (which > 0u && role == ROLE_SHOWN) {
        return nowhere();
    }
    let part = 1.0 / f32(view.circle_segments);
    var out = line_vertex(
        circle_point(circle, (step - 1.0) * part),
        circle_point(circle, step * part),
        circle_point(circle, (step + 1.0) * part),
        circle_point(circle, (step + 2.0) * part),
        index & 3u,
        true,
        size_px(to_view(center), r),
        node,
    );
    // Silhouettes behind the surface say little about where a sphere is.
    out.color.a *= select(1.0, HIDDEN_SILHOUETTE, role == ROLE_SHOWN);
    return out;
}
