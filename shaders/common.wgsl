// Shared by all drawables: camera, viewport, colour ramp. Prepended to every other file, behind the constants that Rust writes.

struct View {
    // World space. `tangent` is half the width and height of the image plane: at distance 1 in perspective views, in world
    // units in orthographic ones.
    eye: vec3f,
    perspective: f32,
    right: vec3f,
    near: f32,
    up: vec3f,
    depth_slack: f32,
    forward: vec3f,
    half_width_px: f32,
    tangent: vec2f,
    // Size in viewport pixels that the picture covers; coarse pixels may extend beyond the viewport.
    covered: vec2f,
    // Origin and size in pixels of the render target.
    viewport: vec4f,
    hidden_alpha: f32,
    // 1 where colours stand for depths, which are lighter above.
    by_depth: u32,
    circle_segments: u32,
    show_picture: u32,
    // 1 where lines are white with a dark edge, over colours that stand for values.
    neutral: u32,
    // Opacity of containers that are not highlighted.
    strength: f32,
    // First and last depth of the drawn nodes, which differ in width and lightness.
    levels: vec2f,
    // The section plane in view space: what `dot(xyz, point) + w` is positive for is cut off. Zero normal: none.
    section: vec4f,
    background: vec4f,
    // sRGB, 0 to 1.
    ramp: array<vec4f, RAMP_STOPS>,
}

@group(0) @binding(0) var<uniform> view: View;

// The target encodes linear colours as sRGB. A pipeline constant: with a software driver, computing the powers per
// pixel took most of a frame.
override LINEAR_TARGET: bool = false;

// Converts an sRGB-encoded colour to what the target expects: unchanged, or linear if the target encodes.
fn to_target(srgb: vec3f) -> vec3f {
    if LINEAR_TARGET {
        return select(pow((srgb + 0.055) / 1.055, vec3f(2.4)), srgb / 12.92, srgb <= vec3f(0.04045));
    }
    return srgb;
}
