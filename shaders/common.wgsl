// What every drawable shares: the camera, the viewport, the colour ramp. Joined in front of each other file.

struct View {
    // World space; `tangent` is half the width and height of the image plane: at distance 1 in perspective, in world units
    // in orthographic.
    eye: vec3f,
    perspective: f32,
    right: vec3f,
    near: f32,
    up: vec3f,
    depth_slack: f32,
    forward: vec3f,
    half_width_px: f32,
    tangent: vec2f,
    // What the picture covers, in pixels of the viewport: a little more than all of it where pixels are coarse.
    covered: vec2f,
    // Origin and size in pixels of the attachment.
    viewport: vec4f,
    hidden_alpha: f32,
    scale_low: f32,
    scale_high: f32,
    color_by: u32,
    circle_segments: u32,
    show_picture: u32,
    padding: vec2u,
    background: vec4f,
    // sRGB, 0 to 1.
    ramp: array<vec4f, RAMP_STOPS>,
}

@group(0) @binding(0) var<uniform> view: View;

// Whether the target encodes what is stored in it. Known when a pipeline is made, so that no pixel pays for the other case:
// drawn in software, the powers were most of a frame.
override LINEAR_TARGET: bool = false;

// sRGB-encoded colour into what the target stores: the bytes themselves, or their linear value where the target encodes.
fn to_target(srgb: vec3f) -> vec3f {
    if LINEAR_TARGET {
        return select(pow((srgb + 0.055) / 1.055, vec3f(2.4)), srgb / 12.92, srgb <= vec3f(0.04045));
    }
    return srgb;
}
