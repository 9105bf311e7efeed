// The half of a sphere towards the viewer, as a cone from its silhouette to its nearest point.

@vertex
fn vs_sphere_face(@builtin(vertex_index) index: u32, node: Node) -> FaceVertex {
    let center = node.sphere.xyz;
    let r = node.sphere.w;
    let circle = outline(center, r);
    if !circle.exists || r <= 0.0 {
        return no_face();
    }
    let size = size_px(to_view(center), r);
    let corner = index & 3u;
    if corner == 0u {
        let towards_viewer = mix(-view.forward, normalize(view.eye - center), view.perspective);
        return face_vertex(to_view(center + towards_viewer * r), size, node);
    }
    // The second triangle of the piece is degenerate.
    let step = f32(index >> 2u) + select(1.0, 0.0, corner == 1u);
    return face_vertex(circle_point(circle, step / f32(view.circle_segments)), size, node);
}
