// The faces of an oriented box that face the viewer: six of four vertices each.

@vertex
fn vs_oriented_face(@builtin(vertex_index) index: u32, node: Node) -> FaceVertex {
    let face = index >> 2u;
    let axis = face >> 1u;
    let is_upper = f32(face & 1u);
    let edges = mat3x3f(node.edge_0, node.edge_1, node.edge_2);
    let u = edges[(axis + 1u) % 3u];
    let v = edges[(axis + 2u) % 3u];
    let point = node.corner + edges[axis] * is_upper + u * f32(index & 1u) + v * f32((index >> 1u) & 1u);
    // Outwards, whichever way the edges turn.
    let across = cross(u, v);
    let normal = across * sign(dot(across, edges[axis])) * (is_upper * 2.0 - 1.0);
    let towards_viewer = mix(-view.forward, view.eye - point, view.perspective);
    if dot(normal, towards_viewer) <= 0.0 {
        return no_face();
    }
    let diagonal = node.edge_0 + node.edge_1 + node.edge_2;
    let size = size_px(to_view(node.corner + diagonal * 0.5), length(diagonal) * 0.5);
    return face_vertex(to_view(point), size, node);
}
