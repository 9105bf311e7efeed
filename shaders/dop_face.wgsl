// The faces of a polytope that face the viewer: the six sides of the box in three pieces each, with up to eight corners, then the
// eight cuts in two pieces each, with up to six.

@vertex
fn vs_dop_face(@builtin(vertex_index) index: u32, node: Node) -> FaceVertex {
    let piece = index >> 2u;
    let is_side = piece < 18u;
    let part = select((piece - 18u) & 1u, piece % 3u, is_side);
    // A fan of quadrilaterals around the first corner of the ring; the last two corners of each are in the order of a strip.
    var strip = array<u32, 4>(0u, 2u * part + 1u, 2u * part + 3u, 2u * part + 2u);
    let ring = strip[index & 3u];
    var point: vec3f;
    var normal: vec3f;
    if is_side {
        let axis = piece / 6u;
        let is_upper = f32((piece / 3u) & 1u);
        let turn = ring >> 1u;
        let along = axis_vector(axis);
        let u = axis_vector((axis + 1u) % 3u) * f32(turn == 1u || turn == 2u);
        let v = axis_vector((axis + 2u) % 3u) * f32(turn >= 2u);
        point = cut_end(node, along * is_upper + u + v, axis, (ring ^ turn) & 1u);
        normal = along * (is_upper * 2.0 - 1.0);
    } else {
        let corner = vec3f((vec3u((piece - 18u) >> 1u) >> vec3u(0u, 1u, 2u)) & vec3u(1u));
        point = cut_end(node, corner, (3u - (ring >> 1u)) % 3u, ring & 1u);
        normal = corner * 2.0 - 1.0;
    }
    let towards_viewer = mix(-view.forward, view.eye - point, view.perspective);
    if dot(normal, towards_viewer) <= 0.0 {
        return no_face();
    }
    return face_vertex(to_view(point), dop_size_px(node), node);
}
