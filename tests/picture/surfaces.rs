//! Colours of surfaces worked out by hand: a wall of panels, seen straight from the front by parallel rays, so that each pixel
//! shows a known point of a panel. Textures, cut-outs, emission and vertex colours of each format that has them.

use std::path::Path;
use std::sync::Arc;

use bvhscope::accel::Accel;
use bvhscope::camera::{Camera, Projection};
use bvhscope::render::{Exposure, Frame, Light, RenderRequest, RenderSettings, Shading, render};
use bvhscope::scene::{LoadOptions, Scene, SceneSource, load};
use bvhscope_engine::{BuildSettings, CancelToken};
use glam::Vec3;
use serde_json::{Value, json};

/// Pixels along an edge of a panel, which is 1 wide and 1 high.
const PIXELS: u32 = 4;

type Color = [f64; 3];

/// Linear light of an sRGB component, both 0 to 1 (IEC 61966-2-1).
fn decode(encoded: f64) -> f64 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// The byte that shows linear light.
fn encode(linear: f64) -> u8 {
    let encoded = if linear <= 0.0031308 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (encoded.clamp(0.0, 1.0) * 255.0).round() as u8
}

/// Each channel of `f` of the channels of `a` and `b`.
fn zip(a: Color, b: Color, f: impl Fn(f64, f64) -> f64) -> Color {
    std::array::from_fn(|channel| f(a[channel], b[channel]))
}

/// Light of the sky on a surface facing the camera, half of (0.50, 0.55, 0.62) above and (0.26, 0.23, 0.20) below, and of the
/// headlight.
const SKY: Color = [0.38, 0.39, 0.41];
const HEADLIGHT: Color = [0.85, 0.84, 0.82];

/// A surface whose normal is tilted from camera and headlight by an angle with this cosine, sideways so that the sky is the same.
#[derive(Clone, Copy)]
struct Paint {
    base: Color,
    metallic: f64,
    roughness: f64,
    occlusion: f64,
    cosine: f64,
}

/// A rough dielectric that faces the camera.
const ROUGH: Paint = Paint { base: [0.0; 3], metallic: 0.0, roughness: 1.0, occlusion: 1.0, cosine: 1.0 };

/// Radiance of a surface in the light of sky and headlight: the model of glTF 2.0, appendix B, for the headlight, and Karis's
/// fit of 2014 for what is mirrored of the sky.
fn radiance(Paint { base, metallic, roughness: r, occlusion, cosine }: Paint) -> Color {
    let f0 = base.map(|base| 0.04 * (1.0 - metallic) + base * metallic);
    let a = (1.0 - r).powi(2).min((-9.28 * cosine).exp2()) * (1.0 - r) + 0.0425 - 0.0275 * r;
    let mirrored = f0.map(|f0| f0 * (1.04 - 0.572 * r - 1.04 * a) + 0.022 * r - 0.04 + 1.04 * a);
    let scattered = 1.0 - mirrored.into_iter().fold(0.0, f64::max);
    // π D V for half vector, light and view in one direction.
    let square = r.powi(4);
    let distribution = square / (cosine * cosine * (square - 1.0) + 1.0).powi(2);
    let visibility = 0.25 / (cosine * (cosine * cosine * (1.0 - square) + square).sqrt());
    std::array::from_fn(|k| {
        let diffuse = base[k] * (1.0 - metallic);
        let sky = SKY[k] * occlusion * (diffuse * scattered + mirrored[k]);
        sky + HEADLIGHT[k] * cosine * (diffuse * (1.0 - f0[k]) + f0[k] * distribution * visibility)
    })
}

/// Radiance of a rough dielectric of this base colour.
fn lit(base: Color) -> Color {
    radiance(Paint { base, ..ROUGH })
}

/// Radiance on a screen: the Khronos PBR Neutral tone mapper.
fn shown(color: Color) -> Color {
    let least = color.into_iter().fold(f64::INFINITY, f64::min);
    let offset = if least < 0.08 { least - 6.25 * least * least } else { 0.04 };
    let color = color.map(|x| x - offset);
    let peak = color.into_iter().fold(0.0, f64::max);
    if peak < 0.76 {
        return color;
    }
    let new_peak = 1.0 - 0.24 * 0.24 / (peak + 0.24 - 0.76);
    let white = 1.0 - 1.0 / (0.15 * (peak - new_peak) + 1.0);
    color.map(|x| x * new_peak / peak * (1.0 - white) + new_peak * white)
}

fn load_model(path: &Path) -> Scene {
    let scene = load(&SceneSource::File(path.to_owned()), &LoadOptions::default(), &CancelToken::new()).unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    scene
}

/// A picture of `panels` panels side by side.
fn picture(scene: Scene, panels: u32) -> Frame {
    let accel = Accel::build(&Arc::new(scene), &BuildSettings::default(), &CancelToken::new()).unwrap();
    let middle = Vec3::new(panels as f32 / 2.0, 0.5, 0.0);
    let camera = Camera {
        eye: middle + Vec3::Z * 4.0,
        target: middle,
        up: Vec3::Y,
        // As high as a panel at the distance of 4.
        fov_y: 2.0 * (0.5_f32 / 4.0).atan(),
        projection: Projection::Orthographic,
    };
    let settings = RenderSettings {
        shading: Shading::Lit,
        light: Light::Headlight,
        exposure: Exposure::Fixed(0.0),
        samples: 1,
        ..Default::default()
    };
    let request = RenderRequest::new(&Arc::new(accel), camera, settings, [panels * PIXELS, PIXELS]);
    render(&request, &CancelToken::new(), &|_| ()).unwrap()
}

/// Where a panel has other colours than the linear light expected at (x, y) of it, y up. Rounding may move a byte by one.
fn differences(frame: &Frame, panel: u32, name: &str, expected: impl Fn(f64, f64) -> Color) -> Option<String> {
    let mut differences = Vec::new();
    for row in 0..PIXELS {
        for column in 0..PIXELS {
            let [x, y] =
                [f64::from(column), f64::from(PIXELS - 1 - row)].map(|pixel| (pixel + 0.5) / f64::from(PIXELS));
            let color = expected(x, y).map(encode);
            let [r, g, b, _] = frame.rgba[(row * frame.width_px + panel * PIXELS + column) as usize];
            if [r, g, b].iter().zip(color).any(|(found, expected)| found.abs_diff(expected) > 1) {
                differences.push(format!("at x {x}, y {y}: {:?} instead of {color:?}", [r, g, b]));
            }
        }
    }
    let some = differences[..differences.len().min(3)].join("; ");
    (!differences.is_empty()).then(|| format!("{name} has {} pixels of another colour: {some}", differences.len()))
}

/// Fails with the differences of all panels.
fn check<const N: usize>(panels: [Option<String>; N]) {
    let differences: Vec<String> = panels.into_iter().flatten().collect();
    assert!(differences.is_empty(), "{}", differences.join("\n"));
}

/// The corners of a panel in the order of its vertices.
const CORNERS: [[f32; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];

/// The value at (x, y) of a panel whose corners have `values`: interpolated in each of its two triangles, whose common edge runs
/// from the second corner to the third.
fn interpolate(values: [Color; 4], x: f64, y: f64) -> Color {
    let [a, b, c, d] = values;
    let weights = if x + y <= 1.0 { [1.0 - x - y, x, y, 0.0] } else { [0.0, 1.0 - y, 1.0 - x, x + y - 1.0] };
    std::array::from_fn(|k| a[k] * weights[0] + b[k] * weights[1] + c[k] * weights[2] + d[k] * weights[3])
}

/// Four texels of a texture that is clamped at its edges, sRGB bytes and alpha, row by row from the top.
const TEXELS: [[u8; 4]; 4] = [[255, 40, 100, 255], [10, 200, 90, 255], [120, 0, 230, 255], [60, 160, 30, 255]];

/// [`TEXELS`], bilinearly interpolated in linear light.
fn textured(x: f64, y: f64) -> Color {
    let weight = |at: f64| (at * 2.0 - 0.5).clamp(0.0, 1.0);
    let (right, below) = (weight(x), weight(1.0 - y));
    let [a, b, c, d] = TEXELS.map(|[r, g, b, _]| [r, g, b].map(|byte| decode(f64::from(byte) / 255.0)));
    let across = |left: Color, other: Color| zip(left, other, |left, other| left * (1.0 - right) + other * right);
    zip(across(a, b), across(c, d), |above, under| above * (1.0 - below) + under * below)
}

/// Alpha of the texel in each pixel of the cut-out, row by row from the top. At least 128 of 255 is solid.
const ALPHA: [[u8; 4]; 4] = [[255, 0, 255, 255], [0, 127, 128, 0], [0, 0, 255, 129], [126, 255, 1, 254]];

fn solid(x: f64, y: f64) -> bool {
    ALPHA[((1.0 - y) * 4.0) as usize][(x * 4.0) as usize] >= 128
}

/// Occlusion, roughness and metal of a whole panel.
const NUMBERS: [u8; 4] = [153, 102, 51, 255];
/// A normal that leans along u.
const TILTED: [u8; 4] = [204, 128, 230, 255];

/// Vertex colours of the corners.
const PAINT: [[f32; 3]; 4] = [[0.75, 0.25, 0.0], [0.125, 0.5, 1.0], [0.0, 0.0, 0.375], [1.0, 0.625, 0.25]];

/// A glTF file of panels beside each other, with its images.
struct Wall {
    folder: tempfile::TempDir,
    buffer: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
    materials: Vec<Value>,
}

impl Wall {
    fn new() -> Self {
        let (folder, buffer) = (tempfile::tempdir().unwrap(), Vec::new());
        let [views, accessors, meshes, nodes, materials] = std::array::from_fn(|_| Vec::new());
        Self { folder, buffer, views, accessors, meshes, nodes, materials }
    }

    fn attribute<const N: usize>(&mut self, values: [[f32; N]; 4]) -> usize {
        let start = self.buffer.len();
        self.buffer.extend(values.as_flattened().iter().flat_map(|value| value.to_le_bytes()));
        self.views.push(json!({"buffer": 0, "byteOffset": start, "byteLength": 16 * N}));
        let kind = format!("VEC{N}");
        self.accessors
            .push(json!({"bufferView": self.views.len() - 1, "componentType": 5126, "count": 4, "type": kind}));
        self.accessors.len() - 1
    }

    /// Adds a panel whose left lower corner is at (x, 0, z).
    fn panel(&mut self, [x, z]: [f32; 2], painted: bool, material: Value) {
        let positions = self.attribute(CORNERS.map(|[u, v]| [x + u, v, z]));
        let uvs = self.attribute(CORNERS.map(|[u, v]| [u, 1.0 - v]));
        let mut attributes = json!({"POSITION": positions, "TEXCOORD_0": uvs});
        if painted {
            attributes["COLOR_0"] = self.attribute(PAINT).into();
        }
        self.nodes.push(json!({"mesh": self.meshes.len()}));
        self.meshes.push(json!({"primitives": [{
            "attributes": attributes, "indices": 0, "material": self.materials.len()
        }]}));
        self.materials.push(material);
    }

    /// Writes the model and its images, and loads it.
    fn load(mut self) -> Scene {
        let path = |name: &str| self.folder.path().join(name);
        let mut squares = image::RgbaImage::new(2, 2);
        squares.pixels_mut().zip(TEXELS).for_each(|(pixel, texel)| pixel.0 = texel);
        squares.save(path("squares.png")).unwrap();
        let mut holes = image::RgbaImage::new(4, 4);
        holes.pixels_mut().zip(ALPHA.as_flattened()).for_each(|(pixel, alpha)| pixel.0 = [255, 188, 0, *alpha]);
        holes.save(path("holes.png")).unwrap();
        image::RgbaImage::from_pixel(1, 1, image::Rgba(NUMBERS)).save(path("numbers.png")).unwrap();
        image::RgbaImage::from_pixel(1, 1, image::Rgba(TILTED)).save(path("tilted.png")).unwrap();
        let start = self.buffer.len();
        self.buffer.extend([0_u8, 1, 2, 1, 3, 2]);
        self.views.push(json!({"buffer": 0, "byteOffset": start, "byteLength": 6}));
        // All panels have the first accessor as their indices.
        for accessor in self.meshes.iter_mut().flat_map(|mesh| mesh["primitives"].as_array_mut().unwrap()) {
            accessor["indices"] = self.accessors.len().into();
        }
        self.accessors
            .push(json!({"bufferView": self.views.len() - 1, "componentType": 5121, "count": 6, "type": "SCALAR"}));
        std::fs::write(path("wall.bin"), &self.buffer).unwrap();
        let images = ["squares", "holes", "numbers", "tilted"].map(|name| json!({"uri": format!("{name}.png")}));
        let document = json!({
            "asset": {"version": "2.0"},
            "extensionsUsed": ["KHR_materials_unlit", "KHR_materials_emissive_strength"],
            "scenes": [{"nodes": (0..self.nodes.len()).collect::<Vec<_>>()}],
            "nodes": self.nodes,
            "meshes": self.meshes,
            "materials": self.materials,
            "textures": (0..4).map(|source| json!({"source": source, "sampler": 0})).collect::<Vec<_>>(),
            "samplers": [{"wrapS": 33071, "wrapT": 33071}],
            "images": images,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{"byteLength": self.buffer.len(), "uri": "wall.bin"}]
        });
        std::fs::write(path("wall.gltf"), document.to_string()).unwrap();
        load_model(&path("wall.gltf"))
    }
}

#[test]
fn gltf_surfaces_have_the_colors_of_their_materials() {
    let unlit = json!({"KHR_materials_unlit": {}});
    let mut wall = Wall::new();
    wall.panel(
        [0.0, 0.0],
        false,
        json!({
            "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "baseColorFactor": [1.0, 0.5, 0.75, 1.0]},
            "extensions": unlit
        }),
    );
    wall.panel(
        [1.0, 0.0],
        false,
        json!({
            "pbrMetallicRoughness": {"baseColorTexture": {"index": 1}, "baseColorFactor": [1, 1, 1, 0.5]}, "alphaMode": "MASK", "alphaCutoff": 0.25, "extensions": unlit
        }),
    );
    // Behind the holes.
    wall.panel(
        [1.0, -1.0],
        false,
        json!({
            "pbrMetallicRoughness": {"baseColorFactor": [0.0, 0.125, 0.5, 1.0]}, "extensions": unlit
        }),
    );
    wall.panel(
        [2.0, 0.0],
        false,
        json!({
            "pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.1, 0.05, 1.0], "metallicFactor": 0.0},
            "emissiveFactor": [0.05, 0.1, 0.25],
            "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 2.0}}
        }),
    );
    wall.panel([3.0, 0.0], true, json!({"extensions": unlit}));
    wall.panel(
        [4.0, 0.0],
        true,
        json!({
            "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "baseColorFactor": [0.5, 0.75, 1.0, 1.0]},
            "emissiveFactor": [0.0, 0.0625, 0.03125],
            "extensions": unlit
        }),
    );
    let frame = picture(wall.load(), 5);
    let times = |a: Color, b: Color| zip(a, b, |a, b| a * b);
    let plus = |a: Color, b: Color| zip(a, b, |a, b| a + b);
    let paint = |x, y| interpolate(PAINT.map(|color| color.map(f64::from)), x, y);
    let cut_out = |x, y| if solid(x, y) { [1.0, decode(188.0 / 255.0), 0.0] } else { [0.0, 0.125, 0.5] };
    let emissive = |_, _| shown(plus(lit([0.2, 0.1, 0.05]), [0.1, 0.2, 0.5]));
    let all = |x, y| plus(times(times(textured(x, y), [0.5, 0.75, 1.0]), paint(x, y)), [0.0, 0.0625, 0.03125]);
    check([
        differences(&frame, 0, "the textured panel", |x, y| times(textured(x, y), [1.0, 0.5, 0.75])),
        differences(&frame, 1, "the panel with holes", cut_out),
        differences(&frame, 2, "the emissive panel", emissive),
        differences(&frame, 3, "the panel with vertex colours", paint),
        differences(&frame, 4, "the panel with texture, vertex colours and emission", all),
    ]);
}

#[test]
fn gltf_maps_of_numbers_and_normals_are_those_of_the_file() {
    let base = [0.5, 0.3, 0.2];
    let factors = json!({"baseColorFactor": [0.5, 0.3, 0.2, 1.0], "metallicFactor": 0.0});
    let mut wall = Wall::new();
    // Without factors a material is a rough metal.
    wall.panel([0.0, 0.0], false, json!({"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.3, 0.2, 1.0]}}));
    wall.panel(
        [1.0, 0.0],
        false,
        json!({"pbrMetallicRoughness": {
            "baseColorFactor": [0.5, 0.3, 0.2, 1.0], "metallicFactor": 0.5, "metallicRoughnessTexture": {"index": 2}
        }}),
    );
    wall.panel(
        [2.0, 0.0],
        false,
        json!({"pbrMetallicRoughness": factors, "occlusionTexture": {"index": 2, "strength": 0.5}}),
    );
    wall.panel(
        [3.0, 0.0],
        false,
        json!({"pbrMetallicRoughness": factors, "emissiveTexture": {"index": 2}, "emissiveFactor": [0.5, 0.25, 1.0]}),
    );
    for (x, scale) in [(4.0, 1.0), (5.0, -0.5)] {
        let normal = json!({"index": 3, "scale": scale});
        wall.panel([x, 0.0], false, json!({"pbrMetallicRoughness": factors, "normalTexture": normal}));
    }
    let frame = picture(wall.load(), 6);
    let [occlusion, roughness, metal, _] = NUMBERS.map(|byte| f64::from(byte) / 255.0);
    let emitted = [0.5, 0.25, 1.0];
    let glow: Color = std::array::from_fn(|k| emitted[k] * decode([occlusion, roughness, metal][k]));
    let [x, _, z, _] = TILTED.map(|byte| f64::from(byte) / 127.5 - 1.0);
    let cosine = |scale: f64| z / (x * scale).hypot(z);
    let rough = Paint { base, ..ROUGH };
    let panel = |panel, name, color: Color| differences(&frame, panel, name, |_, _| shown(color));
    check([
        panel(0, "the rough metal", radiance(Paint { metallic: 1.0, ..rough })),
        panel(1, "the panel with maps", radiance(Paint { metallic: 0.5 * metal, roughness, ..rough })),
        panel(2, "the shaded panel", radiance(Paint { occlusion: 0.5 + 0.5 * occlusion, ..rough })),
        panel(3, "the glowing panel", zip(radiance(rough), glow, |a, b| a + b)),
        panel(4, "the tilted panel", radiance(Paint { cosine: cosine(1.0), ..rough })),
        panel(5, "the less tilted panel", radiance(Paint { cosine: cosine(0.5), ..rough })),
    ]);
}

#[test]
fn obj_surfaces_have_the_colors_of_their_materials() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    // Four texels to each colour, so that no pixel lies between two colours, nor where the texture repeats.
    let mut image = image::RgbaImage::new(8, 8);
    for (x, y, pixel) in image.enumerate_pixels_mut() {
        pixel.0 = TEXELS[(x / 4 + y / 4 * 2) as usize];
    }
    image.save(path("squares.png")).unwrap();
    std::fs::write(
        path("wall.mtl"),
        "newmtl textured\nKd 0.25 0.5 0.75\nmap_Kd squares.png\nnewmtl glowing\nKd 0.1 0.2 0.3\nKe 0.25 0.125 0.0625\n\
         newmtl white\nKd 0.5 0.5 0.5\n",
    )
    .unwrap();
    let mut text = "mtllib wall.mtl\n".to_owned();
    for panel in 0..3 {
        for ([x, y], [r, g, b]) in CORNERS.into_iter().zip(PAINT) {
            let [r, g, b] = if panel == 2 { [r, g, b] } else { [1.0; 3] };
            text += &format!("v {} {y} 0 {r} {g} {b}\nvt {x} {y}\n", x + panel as f32);
        }
        text +=
            &format!("usemtl {}\nf -4/-4 -3/-3 -2/-2\nf -3/-3 -1/-1 -2/-2\n", ["textured", "glowing", "white"][panel]);
    }
    std::fs::write(path("wall.obj"), text).unwrap();
    let frame = picture(load_model(&path("wall.obj")), 3);
    let texel = |x: f64, y: f64| {
        let [r, g, b, _] = TEXELS[usize::from(x > 0.5) + 2 * usize::from(y < 0.5)];
        [r, g, b].map(|byte| decode(f64::from(byte) / 255.0))
    };
    let textured = |x, y| shown(lit(zip(texel(x, y), [0.25, 0.5, 0.75], |a, b| a * b)));
    let emissive = |_, _| shown(zip(lit([0.1, 0.2, 0.3]), [0.25, 0.125, 0.0625], |a, b| a + b));
    let corners = PAINT.map(|color| color.map(|x| decode(f64::from(x))));
    check([
        differences(&frame, 0, "the textured panel", textured),
        differences(&frame, 1, "the emissive panel", emissive),
        differences(&frame, 2, "the panel with vertex colours", |x, y| {
            shown(lit(interpolate(corners, x, y).map(|x| x * 0.5)))
        }),
    ]);
}

#[test]
fn ply_surfaces_have_their_vertex_colors() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wall.ply");
    let mut text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 2\nproperty list uchar int vertex_indices\n\
        end_header\n"
        .to_owned();
    let bytes = PAINT.map(|color| color.map(|x| (x * 200.0) as u8));
    for ([x, y], [r, g, b]) in CORNERS.into_iter().zip(bytes) {
        text += &format!("{x} {y} 0 {r} {g} {b}\n");
    }
    std::fs::write(&path, text + "3 0 1 2\n3 1 3 2\n").unwrap();
    let scene = load_model(&path);
    let base = scene.materials[0].base_color.to_array().map(f64::from);
    let frame = picture(scene, 1);
    let corners = bytes.map(|color| color.map(|byte| decode(f64::from(byte) / 255.0)));
    check([differences(&frame, 0, "the panel with vertex colours", |x, y| {
        shown(lit(zip(interpolate(corners, x, y), base, |color, base| color * base)))
    })]);
}

#[test]
fn what_is_behind_glass_is_seen_through_it() {
    let pane = |factor: f32, behind: [f32; 2]| {
        let mut wall = Wall::new();
        let unlit = |color: [f32; 4], transmission: f32| {
            json!({"pbrMetallicRoughness": {"baseColorFactor": color}, "extensions": {
                "KHR_materials_unlit": {}, "KHR_materials_transmission": {"transmissionFactor": transmission}
            }})
        };
        wall.panel([0.0, 0.0], false, unlit([1.0, 0.0, 0.0, 1.0], factor));
        wall.panel(behind, false, unlit([0.0, 0.0, 1.0, 1.0], 0.0));
        let frame = picture(wall.load(), 1);
        frame.rgba.iter().filter(|color| color[2] == 255).count()
    };
    let all = (PIXELS * PIXELS) as usize;
    assert_eq!(pane(0.0, [0.0, -1.0]), 0);
    // Most rays pass, as many as chance has it.
    let passed = pane(1.0, [0.0, -1.0]);
    assert!((all * 3 / 5..=all).contains(&passed), "{passed} of {all}");
    let half = pane(0.5, [0.0, -1.0]);
    assert!((all / 8..passed).contains(&half), "{half} of {all}");
}
