// Antialiased lines of constant width in pixels, faint behind the traced surface. Prepended to the drawables made of lines.

@group(0) @binding(1) var traced_depth: texture_2d<f32>;

// Lines are clipped at this multiple of the half picture from its centre, so that pixel coordinates stay small.
const GUARD: f32 = 2.5;

// Containers of this size in pixels and larger have full lines; smaller ones fade down to the faintest.
const FULL_SIZE_PX: f32 = 56.0;
const FAINTEST: f32 = 0.12;
// Width in pixels and opacity of the dark edge of neutral lines.
const EDGE_PX: f32 = 1.0;
const EDGE_ALPHA: f32 = 0.6;

// A node; same layout as `OverlayNode`.
struct Node {
    @location(0) box_min: vec3f,
    @location(1) depth: u32,
    @location(2) box_max: vec3f,
    @location(3) place: f32,
    @location(4) sphere: vec4f,
    @location(5) node: u32,
    @location(6) flags: u32,
    @location(7) low: vec4f,
    @location(8) high: vec4f,
    @location(9) corner: vec3f,
    @location(10) edge_0: vec3f,
    @location(11) edge_1: vec3f,
    @location(12) edge_2: vec3f,
}

struct LineVertex {
    @builtin(position) position: vec4f,
    // Linear view depth; clip.w differs from it in orthographic views.
    @location(0) depth: f32,
    // Distance from the centre line in pixels times clip.w; dividing it in the fragment shader makes it linear on screen.
    @location(1) offset_w: f32,
    @location(2) w: f32,
    // RGB, and in alpha the opacity behind the surface.
    @location(3) @interpolate(flat) color: vec4f,
    @location(4) @interpolate(flat) half_width: f32,
    // Opacity in front of the surface.
    @location(5) @interpolate(flat) strength: f32,
}

// World space to view space (right, up, depth). Subtracting the eye first keeps precision far from the origin.
fn to_view(point: vec3f) -> vec3f {
    let d = point - view.eye;
    return vec3f(dot(d, view.right), dot(d, view.up), dot(d, view.forward));
}

// View space to clip space x, y, w.
fn to_clip(point: vec3f) -> vec3f {
    return vec3f(point.xy / view.tangent, mix(1.0, point.z, view.perspective));
}

fn to_screen(clip: vec3f) -> vec2f {
    return clip.xy / clip.z * 0.5 * view.viewport.zw;
}

fn direction_between(a: vec2f, b: vec2f, otherwise: vec2f) -> vec2f {
    let d = b - a;
    let length = length(d);
    if length < 1e-4 {
        return otherwise;
    }
    return d / length;
}

// Clips `range` (0 to 1 along a line) to where a value that runs linearly from `a` to `b` is positive.
fn cut(range: vec2f, a: f32, b: f32) -> vec2f {
    if a < 0.0 && b < 0.0 {
        return vec2f(1.0, 0.0);
    }
    if a < 0.0 {
        return vec2f(max(range.x, a / (a - b)), range.y);
    }
    if b < 0.0 {
        return vec2f(range.x, min(range.y, a / (a - b)));
    }
    return range;
}

fn nowhere() -> LineVertex {
    var out: LineVertex;
    out.position = vec4f(0.0, 0.0, -2.0, 1.0);
    return out;
}

// Diameter in pixels of a ball in view space; the same as in `viewpoint.rs`.
fn size_px(center: vec3f, radius: f32) -> f32 {
    let unit = mix(1.0, max(center.z, radius), view.perspective);
    return radius / (view.tangent.y * unit) * view.viewport.w;
}

// Opacity of a container by its size on screen: many small ones make a texture, not a fog.
fn strength_of(size: f32, role: u32) -> f32 {
    if role != ROLE_SHOWN {
        return 1.0;
    }
    return clamp(size / FULL_SIZE_PX, FAINTEST, 1.0) * view.strength;
}

// A corner of the line segment from `a` to `b` in view space. `before` and `after` are the neighbouring points of a curve, or
// `a` and `b` again at free ends, which get square caps. `corner`: bit 0 selects the end, bit 1 the side. `size` is the
// container's on screen in pixels.
fn line_vertex(before: vec3f, a: vec3f, b: vec3f, after: vec3f, corner: u32, curve: bool, size: f32, node: Node) -> LineVertex {
    let clip_a = to_clip(a);
    let clip_b = to_clip(b);
    var range = vec2f(0.0, 1.0);
    range = cut(range, clip_a.z - view.near, clip_b.z - view.near);
    range = cut(range, GUARD * clip_a.z - clip_a.x, GUARD * clip_b.z - clip_b.x);
    range = cut(range, GUARD * clip_a.z + clip_a.x, GUARD * clip_b.z + clip_b.x);
    range = cut(range, GUARD * clip_a.z - clip_a.y, GUARD * clip_b.z - clip_b.y);
    range = cut(range, GUARD * clip_a.z + clip_a.y, GUARD * clip_b.z + clip_b.y);
    range = cut(range, -dot(view.section, vec4f(a, 1.0)), -dot(view.section, vec4f(b, 1.0)));
    if range.x >= range.y {
        return nowhere();
    }
    let screen_a = to_screen(mix(clip_a, clip_b, range.x));
    let screen_b = to_screen(mix(clip_a, clip_b, range.y));
    let along = direction_between(screen_a, screen_b, vec2f(1.0, 0.0));

    let at_end = (corner & 1u) != 0u;
    let side = select(-1.0, 1.0, (corner & 2u) != 0u);
    let clip = mix(clip_a, clip_b, select(range.x, range.y, at_end));
    let role = (node.flags >> ROLE_SHIFT) & ROLE_MASK;
    let strength = strength_of(size, role);
    let half_width = view.half_width_px * width_of(role) * level_width(node.depth, role) * mix(0.6, 1.0, min(1.0, size / FULL_SIZE_PX));
    // Includes the antialiased edge.
    let reach = half_width + 0.5 + select(0.0, EDGE_PX, view.neutral != 0u);

    // Segments of a curve share the direction at their common point, so that they meet without gap or overlap.
    var tangent = along;
    let whole = range.x == 0.0 && range.y == 1.0;
    let neighbour = to_clip(select(before, after, at_end));
    if curve && whole && neighbour.z > view.near {
        let beyond = to_screen(neighbour);
        tangent = select(direction_between(beyond, screen_b, along), direction_between(screen_a, beyond, along), at_end);
    }
    let cap = select(half_width, 0.0, curve) * select(-1.0, 1.0, at_end);
    let offset = vec2f(-tangent.y, tangent.x) * side * reach + along * cap;
    let screen = select(screen_a, screen_b, at_end) + offset;

    var out: LineVertex;
    out.position = vec4f(screen * 2.0 / view.viewport.zw * clip.z, 0.5 * clip.z, clip.z);
    out.depth = mix(a.z, b.z, select(range.x, range.y, at_end));
    out.offset_w = side * reach * clip.z;
    out.w = clip.z;
    out.half_width = half_width;
    out.color = color_of(node, role);
    out.strength = strength;
    return out;
}

fn width_of(role: u32) -> f32 {
    switch role {
        case ROLE_SELECTED: { return SELECTED_WIDTH; }
        case ROLE_TRACED: { return TRACED_WIDTH; }
        case ROLE_FIRST_CHILD: { return FIRST_CHILD_WIDTH; }
        case ROLE_SECOND_CHILD: { return SECOND_CHILD_WIDTH; }
        case ROLE_HOVERED: { return HOVERED_WIDTH; }
        case ROLE_FAULTY: { return FAULTY_WIDTH; }
        default: { return 1.0; }
    }
}

// Place of a depth among the drawn levels: 0 for the first, 1 for the last, 0.5 where there is one level.
fn level_of(depth: u32) -> f32 {
    let count = view.levels.y - view.levels.x;
    return select(clamp((f32(depth) - view.levels.x) / count, 0.0, 1.0), 0.5, count < 1.0);
}

// Levels above are wider.
fn level_width(depth: u32, role: u32) -> f32 {
    return select(1.0, mix(WIDEST_LEVEL, NARROWEST_LEVEL, level_of(depth)), role == ROLE_SHOWN);
}

// Levels above are lighter.
fn level_color(color: vec3f, depth: u32) -> vec3f {
    let level = level_of(depth) * 2.0 - 1.0;
    return select(mix(color, vec3f(1.0), -level * LIGHTEST_LEVEL), color * (1.0 - level * DARKEST_LEVEL), level > 0.0);
}

fn color_of(node: Node, role: u32) -> vec4f {
    let marked_alpha = max(view.hidden_alpha, 0.4);
    switch role {
        case ROLE_SELECTED: { return vec4f(SELECTED_COLOR, marked_alpha); }
        case ROLE_FIRST_CHILD: { return vec4f(FIRST_CHILD_COLOR, marked_alpha); }
        case ROLE_SECOND_CHILD: { return vec4f(SECOND_CHILD_COLOR, marked_alpha); }
        case ROLE_HOVERED: { return vec4f(HOVERED_COLOR, marked_alpha); }
        case ROLE_TRACED: { return vec4f(TRACED_COLOR, marked_alpha); }
        case ROLE_WAITING: { return vec4f(WAITING_COLOR, view.hidden_alpha); }
        case ROLE_OVERLAP: { return vec4f(OVERLAP_COLOR, marked_alpha); }
        case ROLE_FAULTY: { return vec4f(FAULTY_COLOR, marked_alpha); }
        default: {}
    }
    if view.neutral != 0u {
        return vec4f(1.0, 1.0, 1.0, view.hidden_alpha);
    }
    let t = node.place * f32(RAMP_STOPS - 1u);
    let stop = min(u32(t), RAMP_STOPS - 2u);
    let color = mix(view.ramp[stop].rgb, view.ramp[stop + 1u].rgb, t - f32(stop));
    return vec4f(select(color, level_color(color, node.depth), view.by_depth != 0u), view.hidden_alpha);
}

// True where a view depth is in front of the surface at a pixel.
fn is_in_front(position: vec2f, depth: f32) -> bool {
    // `position` is in pixels of the render target, not of the viewport.
    let uv = (position - view.viewport.xy) / view.covered;
    let size = vec2i(textureDimensions(traced_depth));
    let texel = clamp(vec2i(floor(uv * vec2f(size))), vec2i(0), size - 1);
    let surface = textureLoad(traced_depth, texel, 0).r;
    // The slack prevents z-fighting of tight containers with the surfaces that they touch.
    let slack = max(abs(surface) * 1e-3, view.depth_slack);
    return view.show_picture == 0u || depth <= surface + slack;
}

@fragment
fn fs_line(in: LineVertex) -> @location(0) vec4f {
    let distance = abs(in.offset_w / in.w);
    let coverage = clamp(in.half_width + 0.5 - distance, 0.0, min(1.0, 2.0 * in.half_width));
    // Lines behind the surface fade twice with the size.
    let opacity = in.strength * select(in.color.a * in.strength, 1.0, is_in_front(in.position.xy, in.depth));
    let edge = clamp(in.half_width + 0.5 + EDGE_PX - distance, 0.0, 1.0) * EDGE_ALPHA * f32(view.neutral);
    return vec4f(to_target(in.color.rgb) * coverage, max(coverage, edge)) * opacity;
}
