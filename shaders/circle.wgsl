// Circles of a sphere in world space. Prepended to the drawables made of them.


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

