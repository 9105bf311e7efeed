// The edges of a polytope: three at each cut corner, and what is left of the twelve edges of the box, or the edge between two cuts
// in its place.

@vertex
fn vs_dop(@builtin(vertex_index) index: u32, node: Node) -> LineVertex {
    let edge = index >> 2u;
    var a: vec3f;
    var b: vec3f;
    if edge < 24u {
        let corner = vec3f((vec3u(edge / 3u) >> vec3u(0u, 1u, 2u)) & vec3u(1u));
        a = cut_end(node, corner, edge % 3u, 0u);
        b = cut_end(node, corner, edge % 3u, 1u);
    } else {
        let axis = (edge - 24u) >> 2u;
        let u = axis_vector((axis + 1u) % 3u);
        let v = axis_vector((axis + 2u) % 3u);
        let along = axis_vector(axis);
        let corner = u * f32(edge & 1u) + v * f32((edge >> 1u) & 1u);
        let depth = cut_depth(node, corner);
        let overlap = overlap_along(node, corner, axis);
        if overlap > 0.0 {
            a = point_from(node, corner, along * (depth - overlap) + u * overlap);
            b = point_from(node, corner, along * (depth - overlap) + v * overlap);
        } else {
            a = point_from(node, corner, along * depth);
            b = point_from(node, corner + along, along * cut_depth(node, corner + along));
        }
    }
    // No dots where a corner is whole.
    if distance(a, b) <= 1e-5 * length(node.box_max - node.box_min) {
        return nowhere();
    }
    a = to_view(a);
    b = to_view(b);
    return line_vertex(a, a, b, b, index & 3u, false, dop_size_px(node), node);
}
