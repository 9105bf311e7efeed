// A sphere: its silhouette as seen by the camera, then three great circles.

const TURN: f32 = 6.283185307179586;

struct Circle {
    center: vec3f,
    axis_u: vec3f,
    axis_v: vec3f,
    exists: bool,
}

fn circle_point(circle: Circle, turns: f32) -> vec3f {
    let angle = turns * TURN;
    return to_view(circle.center + circle.axis_u * cos(angle) + circle.axis_v * sin(angle));
}

// The silhouette circle, along which rays from the eye touch the sphere: in perspective nearer and smaller than a great circle.
fn outline(center: vec3f, radius: f32) -> Circle {
    let to_center = center - view.eye;
    let distance = length(to_center);
    let inside = view.perspective > 0.5 && distance <= radius * 1.0001;
    let ratio = radius / max(distance, 1e-30);
    let shrink = select(0.0, clamp(ratio * ratio, 0.0, 1.0), view.perspective > 0.5);
    let axis = select(view.forward, to_center / max(distance, 1e-30), view.perspective > 0.5);
    let u = normalize(cross(axis, select(view.right, view.up, abs(dot(axis, view.right)) > 0.9)));
    let r = radius * sqrt(max(1.0 - shrink, 0.0));
    // r²/d back along the axis, as an offset from the centre, which keeps precision.
    let middle = center - axis * (select(0.0, radius * ratio, view.perspective > 0.5));
    return Circle(middle, u * r, cross(axis, u) * r, !inside);
}

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
    if !circle.exists || r < 0.0 {
        return nowhere();
    }
    let part = 1.0 / f32(view.circle_segments);
    return line_vertex(
        circle_point(circle, (step - 1.0) * part),
        circle_point(circle, step * part),
        circle_point(circle, (step + 1.0) * part),
        circle_point(circle, (step + 2.0) * part),
        index & 3u,
        true,
        size_px(to_view(center), r),
        node,
    );
}
