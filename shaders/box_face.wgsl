// The faces of a box that face the viewer: six of four vertices each.

@vertex
fn vs_box_face(@builtin(vertex_index) index: u32, node: Node) -> FaceVertex {
    let face = index >> 2u;
    let axis = face >> 1u;
    let is_upper = (face & 1u) != 0u;
    let corner = vec2f(f32(index & 1u), f32((index >> 1u) & 1u));
    var place = vec3f(f32(face & 1u), corner);
    var normal = vec3f(1.0, 0.0, 0.0);
    if axis == 1u {
        place = vec3f(corner.y, f32(face & 1u), corner.x);
        normal = vec3f(0.0, 1.0, 0.0);
    } else if axis == 2u {
        place = vec3f(corner, f32(face & 1u));
        normal = vec3f(0.0, 0.0, 1.0);
    }
    normal = select(-normal, normal, is_upper);
    let point = select(node.box_min, node.box_max, place > vec3f(0.5));
    let towards_viewer = mix(-view.forward, view.eye - point, view.perspective);
    if dot(normal, towards_viewer) <= 0.0 {
        return no_face();
    }
    let size = size_px(to_view((node.box_min + node.box_max) * 0.5), length(node.box_max - node.box_min) * 0.5);
    return face_vertex(to_view(point), size, node);
}
