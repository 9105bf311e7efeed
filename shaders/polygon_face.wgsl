// A piece of a face towards the viewer: a quadrilateral of a corner and the ways from there to the other three, counter-clockwise as
// seen from outside.

@vertex
fn vs_polygon_face(@builtin(vertex_index) index: u32, node: Node) -> FaceVertex {
    // The last two corners are in the order of a strip.
    var ways = array<vec3f, 4>(vec3f(0.0), node.edge_0, node.edge_2, node.edge_1);
    // Both triangles, as the corners of one may lie on a line.
    let normal = cross(node.edge_0, node.edge_1) + cross(node.edge_1, node.edge_2);
    let towards_viewer = mix(-view.forward, view.eye - node.corner, view.perspective);
    if dot(normal, towards_viewer) <= 0.0 {
        return no_face();
    }
    let size = size_px(to_view(node.corner), length(node.edge_1));
    return face_vertex(to_view(node.corner + ways[index & 3u]), size, node);
}
