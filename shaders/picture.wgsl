// The traced picture over the whole viewport.

@group(0) @binding(2) var picture: texture_2d<f32>;
@group(0) @binding(3) var smooth_sampler: sampler;

@vertex
fn vs_picture(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    // One triangle that covers the viewport: (-1,-1), (3,-1), (-1,3).
    let corner = vec2f(f32((index << 1u) & 2u), f32(index & 2u));
    return vec4f(corner * 2.0 - 1.0, 0.5, 1.0);
}

// The picture has fewer pixels than the viewport.
override SMOOTH: bool = false;

@fragment
fn fs_picture(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let pixel = position.xy - view.viewport.xy;
    var color: vec4f;
    if SMOOTH {
        color = textureSampleLevel(picture, smooth_sampler, pixel / view.covered, 0.0);
    } else {
        // Same size: the bytes unchanged.
        color = textureLoad(picture, vec2i(pixel), 0);
    }
    color = select(vec4f(color.rgb * color.a, color.a), view.background, view.show_picture == 0u);
    return vec4f(to_target(color.rgb), color.a);
}
