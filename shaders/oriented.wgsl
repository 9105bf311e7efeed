// An oriented box: twelve edges of four vertices each.

@vertex
fn vs_oriented(@builtin(vertex_index) index: u32, node: Node) -> LineVertex {
    let edge = index >> 2u;
    // Four edges along each direction; the lower two bits select the corner along the other two.
    let axis = edge >> 2u;
    let u = f32(edge & 1u);
    let v = f32((edge >> 1u) & 1u);
    let edges = mat3x3f(node.edge_0, node.edge_1, node.edge_2);
    let from_point = node.corner + edges[(axis + 1u) % 3u] * u + edges[(axis + 2u) % 3u] * v;
    let a = to_view(from_point);
    let b = to_view(from_point + edges[axis]);
    let diagonal = node.edge_0 + node.edge_1 + node.edge_2;
    let size = size_px(to_view(node.corner + diagonal * 0.5), length(diagonal) * 0.5);
    return line_vertex(a, a, b, b, index & 3u, false, size, node);
}
