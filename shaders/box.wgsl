// A box: twelve edges of four vertices each.

@vertex
fn vs_box(@builtin(vertex_index) index: u32, node: Node) -> LineVertex {
    let edge = index >> 2u;
    // Four edges along each axis; the lower two bits select the corner on the other two axes.
    let axis = edge >> 2u;
    let low = f32(edge & 1u);
    let high = f32((edge >> 1u) & 1u);
    var from_corner = vec3f(0.0, low, high);
    var to_corner = vec3f(1.0, low, high);
    if axis == 1u {
        from_corner = vec3f(low, 0.0, high);
        to_corner = vec3f(low, 1.0, high);
    } else if axis == 2u {
        from_corner = vec3f(low, high, 0.0);
        to_corner = vec3f(low, high, 1.0);
    }
    let a = to_view(select(node.box_min, node.box_max, from_corner > vec3f(0.5)));
    let b = to_view(select(node.box_min, node.box_max, to_corner > vec3f(0.5)));
    let size = size_px(to_view((node.box_min + node.box_max) * 0.5), length(node.box_max - node.box_min) * 0.5);
    return line_vertex(a, a, b, b, index & 3u, false, size, node);
}
