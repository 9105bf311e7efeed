// A polytope of fourteen planes: its box, whose corners planes along the diagonals cut off. Every plane touches the polytope, so
// that cuts overlap only along the edges of the box, see `half_area_between` in dop.rs.

// Depth of the cut at a corner of the box (0 or 1 on each axis), measured along the edges.
fn cut_depth(node: Node, corner: vec3f) -> f32 {
    let is_upper = corner > vec3f(0.5);
    let out = corner * 2.0 - 1.0;
    let reach = dot(out, select(node.box_min, node.box_max, is_upper));
    // The planes are numbered by the signs of y and z where that of x is positive.
    if is_upper.x {
        return max(reach - node.high[select(2u, 0u, is_upper.y) + select(1u, 0u, is_upper.z)], 0.0);
    }
    return max(reach + node.low[select(0u, 2u, is_upper.y) + select(0u, 1u, is_upper.z)], 0.0);
}

fn axis_vector(axis: u32) -> vec3f {
    return vec3f(f32(axis == 0u), f32(axis == 1u), f32(axis == 2u));
}

// Half of the length by which the cuts at both ends of an edge of the box overlap; negative where a part of the edge is left.
fn overlap_along(node: Node, corner: vec3f, axis: u32) -> f32 {
    let step = axis_vector(axis);
    let other = corner + step * (1.0 - 2.0 * corner[axis]);
    let edge = node.box_max[axis] - node.box_min[axis];
    return (cut_depth(node, corner) + cut_depth(node, other) - edge) * 0.5;
}

// The point at these distances from a corner of the box, inwards along each axis.
fn point_from(node: Node, corner: vec3f, inwards: vec3f) -> vec3f {
    return select(node.box_min, node.box_max, corner > vec3f(0.5)) - (corner * 2.0 - 1.0) * inwards;
}

// An end of the line in which the cut at a corner meets the side of the box across an axis: near the edge along the second next
// axis (0), or along the next (1).
fn cut_end(node: Node, corner: vec3f, axis: u32, end: u32) -> vec3f {
    let u = (axis + 1u) % 3u;
    let v = (axis + 2u) % 3u;
    let depth = cut_depth(node, corner);
    let rest = max(overlap_along(node, corner, select(v, u, end == 1u)), 0.0);
    let along_u = select(rest, depth - rest, end == 1u);
    return point_from(node, corner, axis_vector(u) * along_u + axis_vector(v) * (depth - along_u));
}

fn dop_size_px(node: Node) -> f32 {
    return size_px(to_view((node.box_min + node.box_max) * 0.5), length(node.box_max - node.box_min) * 0.5);
}
