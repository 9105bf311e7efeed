// The traced picture over the whole viewport.

@group(0) @binding(2) var picture: texture_2d<f32>;
@group(0) @binding(3) var smooth_sampler: sampler;

@vertex
fn vs_picture(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    // One triangle that covers the viewport: (-1,-1), (3,-1), (-1,3).
    let corner = vec2f(f32((index << 1u) & 2u), f32(index & 2u));
    return vec4f(corner * 2.0 - 1.0, 0.5, 1.0);
}

// Whether the picture has fewer pixels than the viewport.
override SMOOTH: bool = false;

// Pixels of the viewport for one of the picture, along one side, from which on interpolation between two is not smooth enough.
const COARSE: f32 = 1.75;

// The picture at a place in texels, through a cubic B-spline, which shows no texel as a square. The weights of its 4×4 texels
// are those of four samples between texels (Sigg and Hadwiger, Fast Third-Order Texture Filtering, GPU Gems 2, 2005).
fn spline(place: vec2f, size: vec2f) -> vec3f {
    let base = floor(place - 0.5);
    let f = place - 0.5 - base;
    let g = 1.0 - f;
    let w0 = g * g * g / 6.0;
    let w1 = (4.0 - 3.0 * f * f * (2.0 - f)) / 6.0;
    let w3 = f * f * f / 6.0;
    let w2 = 1.0 - w0 - w1 - w3;
    let low = (base - 0.5 + w1 / (w0 + w1)) / size;
    let high = (base + 1.5 + w3 / (w2 + w3)) / size;
    let upper = mix(texel(vec2f(low.x, low.y)), texel(vec2f(high.x, low.y)), w2.x + w3.x);
    let lower = mix(texel(vec2f(low.x, high.y)), texel(vec2f(high.x, high.y)), w2.x + w3.x);
    return mix(upper, lower, w2.y + w3.y);
}

fn texel(uv: vec2f) -> vec3f {
    return textureSampleLevel(picture, smooth_sampler, uv, 0.0).rgb;
}

@fragment
fn fs_picture(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let pixel = position.xy - view.viewport.xy;
    var color: vec3f;
    if SMOOTH {
        let size = vec2f(textureDimensions(picture));
        let uv = pixel / view.covered;
        if view.covered.x > COARSE * size.x {
            color = spline(uv * size, size);
        } else {
            color = texel(uv);
        }
    } else {
        // Same size: the bytes unchanged.
        color = textureLoad(picture, vec2i(pixel), 0).rgb;
    }
    return vec4f(to_target(select(color, view.background.rgb, view.show_picture == 0u)), 1.0);
}
