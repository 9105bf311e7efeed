// A container of a few pixels: a square of its size.

// Half the largest and smallest side in pixels.
const DOT_RANGE_PX = vec2f(0.6, 2.0);
const DOT_ALPHA: f32 = 0.6;

@vertex
fn vs_dot(@builtin(vertex_index) index: u32, node: Node) -> LineVertex {
    let extent = node.box_max - node.box_min;
    let is_box = dot(extent, extent) > 0.0;
    let radius = select(node.sphere.w, length(extent) * 0.5, is_box);
    let center = to_view(select(node.sphere.xyz, (node.box_min + node.box_max) * 0.5, is_box));
    let clip = to_clip(center);
    if dot(view.section, vec4f(center, 1.0)) > 0.0 || clip.z <= view.near || any(abs(clip.xy) > vec2f(GUARD * clip.z)) {
        return nowhere();
    }
    let half_side = clamp(size_px(center, radius) * 0.35, DOT_RANGE_PX.x, DOT_RANGE_PX.y);
    let corner = vec2f(f32(index & 1u), f32((index >> 1u) & 1u)) * 2.0 - 1.0;
    let screen = to_screen(clip) + corner * half_side;
    var out: LineVertex;
    out.position = vec4f(screen * 2.0 / view.viewport.zw * clip.z, 0.5 * clip.z, clip.z);
    // Its nearest point, so that a leaf is in front of its triangles.
    out.depth = center.z - radius;
    out.offset_w = 0.0;
    out.w = clip.z;
    out.half_width = half_side;
    out.color = color_of(node, ROLE_SHOWN);
    out.strength = DOT_ALPHA * view.strength;
    return out;
}
