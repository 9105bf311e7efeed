//! The rows of the settings of the picture. Exposure as it is metered, section plane and background are set elsewhere.

use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::tree::traverse::Traversal;

use super::settings::{Exposure, HeatKind, Light, NormalSource, RenderSettings, Shading};
use crate::catalog::settings::{Choice, Limits, Number, Setting, Settings, Value, Written};
use crate::colors::ColorMap;

/// All settings, in the order in which window, help texts and copied command lines have them.
static SETTINGS: [&Setting<RenderSettings>; 13] = [
    &SHADING,
    &LIGHT,
    &EXPOSURE,
    &GROUND,
    &CLUSTER_DEPTH,
    &TRAVERSAL,
    &COLOR_MAP,
    &HEAT_RANGE,
    &NORMALS,
    &CREASE,
    &MESH_EDGES,
    &SAMPLES,
    &SIMD,
];

impl Settings for RenderSettings {
    const HEADING: &'static str = "Picture";

    fn rows() -> &'static [&'static Setting<Self>] {
        &SETTINGS
    }
}

/// The meaning of a pixel's colour.
pub static SHADING: Setting<RenderSettings> = Setting {
    key: "shading",
    value_name: "NAME",
    help: "What colours mean: {}",
    label: "Shading",
    tip: "What the colour of a pixel means (Alt+1 to Alt+11)",
    value: Value::One {
        options: || Shading::ALL.map(|mode| Choice::new(mode.name(), mode.label(), shading_sentence(mode))).into(),
        get: |render| Shading::ALL.iter().position(|mode| *mode == render.shading),
        set: |render, index| render.shading = Shading::ALL[index],
    },
    applies: |_| true,
    written: Written::Always,
};

/// One sentence about a shading mode.
pub const fn shading_sentence(shading: Shading) -> &'static str {
    match shading {
        Shading::Lit => "Light, materials and textures",
        Shading::Normals => "The direction of the surface as a colour",
        Shading::Depth => "Distance along the view direction",
        Shading::AmbientOcclusion => "How open the surface is to its surroundings",
        Shading::Thickness => "How thick the model is along the whole ray of each pixel, by all hits: of closed models",
        Shading::Distance => {
            "Distance of each point of the section plane, or of a plane across the middle, from the surface, by the closest point; with lines of equal distance"
        }
        Shading::Clusters => "Each surface in the colour of the container, at the cluster depth, that holds it",
        Shading::Copies => "Each copy of a mesh in a colour of its own, in a scene of two levels",
        Shading::Meshes => "All copies of a mesh in one colour, in a scene of two levels",
        Shading::Heat(HeatKind::Both) => "Container and triangle tests that each pixel cost",
        Shading::Heat(HeatKind::Containers) => "Container tests that each pixel cost",
        Shading::Heat(HeatKind::Primitives) => "Triangle tests that each pixel cost",
        Shading::Heat(HeatKind::Steps) => {
            "Nodes and blocks of the eight-wide tree, which makes the pictures, that each pixel cost"
        }
        Shading::Heat(HeatKind::Lines) => {
            "Cache lines of 64 bytes that the ray of each pixel reads of the eight-wide tree, nodes and triangles, each once"
        }
        Shading::Heat(HeatKind::AllHits) => "Container and triangle tests that all hits of the ray of each pixel cost",
        Shading::Heat(HeatKind::ClosestPoint) => {
            "Container and triangle tests that the closest point of the surface costs, from each point of the section plane, or of a plane across the middle"
        }
        Shading::Heat(HeatKind::Copies) => {
            "Copies of meshes whose trees the ray of each pixel is tested with, in a scene of two levels: where boxes of copies overlap"
        }
        Shading::Heat(HeatKind::WholeRay) => {
            "Containers that the ray of each pixel enters from one end to the other, as if no surface stopped it: how much they overlap"
        }
    }
}

/// The key light.
pub static LIGHT: Setting<RenderSettings> = Setting {
    key: "light",
    value_name: "NAME",
    help: "Light of the lit mode: {}; sun and file (its own lights) cast shadows",
    label: "Light",
    tip: "Where the light comes from",
    value: Value::One {
        options: || {
            LIGHTS
                .map(|light| {
                    let (label, tip) = match light {
                        Light::Headlight => ("Headlight", "From the camera, without shadows: faster"),
                        Light::Sun => ("Sun", "From high above, with shadows"),
                        Light::File => {
                            ("File", "The lights of the model's file, with shadows; the sun where it has none")
                        }
                    };
                    Choice::new(light.name(), label, tip)
                })
                .into()
        },
        get: |render| LIGHTS.iter().position(|light| *light == render.light),
        set: |render, index| render.light = LIGHTS[index],
    },
    applies: is_lit,
    written: Written::Changed,
};

const LIGHTS: [Light; 3] = [Light::File, Light::Sun, Light::Headlight];

fn is_lit(render: &RenderSettings) -> bool {
    render.shading == Shading::Lit
}

/// How much light is shown as white; metered where it is not given.
pub static EXPOSURE: Setting<RenderSettings> = Setting {
    key: "exposure",
    value_name: "EV",
    help: "Exposure of the lit mode: auto (metered), or a number of stops, {}, of which each doubles the light",
    label: "Stops",
    tip: "Exposure in stops (EV): each doubles the light, 0 shows it as it is. Moving it switches the meter off",
    value: Value::Optional {
        limits: Limits::decimal(-Exposure::MAX_FIXED, Exposure::MAX_FIXED, 1)
            .slider(-Exposure::MAX_AUTO, Exposure::MAX_AUTO),
        none: "auto",
        get: |render| if let Exposure::Fixed(stops) = render.exposure { Some(stops) } else { None },
        set: |render, stops| render.exposure = stops.map_or(Exposure::Auto, Exposure::Fixed),
    },
    applies: is_lit,
    written: Written::Changed,
};

/// A ground that catches the shadow.
pub static GROUND: Setting<RenderSettings> = Setting {
    key: "ground",
    value_name: "",
    help: "Catch the model's shadow on a ground below it, in the lit mode",
    label: "Ground",
    tip: "Let the model's shadow fall on a ground below it, so that it does not float. The tree and all counts stay as they are",
    value: Value::Switch { name: "Shadow", get: |render| render.ground, set: |render, on| render.ground = on },
    applies: is_lit,
    written: Written::Changed,
};

/// Depth of the nodes whose colours surfaces take.
pub static CLUSTER_DEPTH: Setting<RenderSettings> = Setting {
    key: "cluster-depth",
    value_name: "LEVEL",
    help: "Tree level that cluster colours show",
    label: "Cluster depth",
    tip: "The depth of the containers whose colours surfaces take. Deeper: smaller patches",
    value: Value::Number(Number {
        symbol: "",
        limits: Limits::whole(0, 1_000_000),
        get: |render| render.cluster_depth as f32,
        set: |render, depth| render.cluster_depth = depth as u32,
    }),
    applies: |render| render.shading == Shading::Clusters,
    written: Written::Changed,
};

/// Order in which rays visit nodes while tests are counted.
pub static TRAVERSAL: Setting<RenderSettings> = Setting {
    key: "traversal",
    value_name: "NAME",
    help: "How rays visit nodes where tests are counted: {} (unordered, no culling by distance)",
    label: "Traversal",
    tip: "How rays visit nodes while tests are counted",
    value: Value::One {
        options: || {
            Traversal::ALL
                .map(|order| {
                    let (label, tip) = match order {
                        Traversal::Ordered => ("Ordered", "Near child first, culled by distance"),
                        Traversal::Paper => ("Paper", "Unordered and not culled, as printed: many more tests"),
                    };
                    Choice::new(order.name(), label, tip)
                })
                .into()
        },
        get: |render| Traversal::ALL.iter().position(|order| *order == render.traversal),
        set: |render, index| render.traversal = Traversal::ALL[index],
    },
    applies: is_heat,
    written: Written::Changed,
};

const fn is_heat(render: &RenderSettings) -> bool {
    matches!(render.shading, Shading::Heat(_))
}

/// Colours of depths and counts.
pub static COLOR_MAP: Setting<RenderSettings> = Setting {
    key: "color-map",
    value_name: "NAME",
    help: "Colours of depth and heat maps: {}",
    label: "Colour map",
    tip: "Colours from the smallest to the largest value",
    value: Value::One {
        options: || {
            ColorMap::ALL
                .map(|map| {
                    let tip = match map {
                        ColorMap::Viridis => "Violet over green to yellow: even steps, also for the colour-blind",
                        ColorMap::Inferno => "Black over red to pale yellow: even steps, darkest start",
                        ColorMap::Turbo => "Blue over green to red: the most distinguishable colours",
                    };
                    Choice::new(map.name(), map.label(), tip)
                })
                .into()
        },
        get: |render| ColorMap::ALL.iter().position(|map| *map == render.color_map),
        set: |render, index| render.color_map = ColorMap::ALL[index],
    },
    applies: |render| render.shading.has_values(),
    written: Written::Always,
};

/// Counts at the two ends of the heat map.
pub static HEAT_RANGE: Setting<RenderSettings> = Setting {
    key: "heat-range",
    value_name: "A..B",
    help: "Test counts at the two ends of the heat map [default: fitted to the picture]",
    label: "",
    tip: "",
    value: Value::Range {
        limits: Limits::decimal(0.0, 1e9, 1),
        expected: "two counts A..B with 0 <= A < B are expected, as in 0..80",
        single: false,
        get: |render| render.heat_range,
        set: |render, range| render.heat_range = range,
    },
    applies: is_heat,
    written: Written::Changed,
};

/// Where normals come from.
pub static NORMALS: Setting<RenderSettings> = Setting {
    key: "normals",
    value_name: "NAME",
    help: "Normals: {} triangles; file is by crease angle where it has none",
    label: "Normals",
    tip: "What makes surfaces look smooth; the triangles stay as they are",
    value: Value::One {
        options: || {
            NormalSource::ALL
                .map(|source| {
                    let tip = match source {
                        NormalSource::File => "The file's, or by crease angle where it has none",
                        NormalSource::Crease => {
                            "Triangles that meet at less than the crease angle look like one curved surface"
                        }
                        NormalSource::Flat => "Every triangle is flat, as rays meet it",
                    };
                    Choice::new(source.name(), source.label(), tip)
                })
                .into()
        },
        get: |render| NormalSource::ALL.iter().position(|source| *source == render.normals),
        set: |render, index| render.normals = NormalSource::ALL[index],
    },
    applies: uses_normals,
    written: Written::Changed,
};

const fn uses_normals(render: &RenderSettings) -> bool {
    matches!(
        render.shading,
        Shading::Lit
            | Shading::Normals
            | Shading::AmbientOcclusion
            | Shading::Clusters
            | Shading::Copies
            | Shading::Meshes
    )
}

/// The crease angle.
pub static CREASE: Setting<RenderSettings> = Setting {
    key: "crease",
    value_name: "DEG",
    help: "Crease angle in degrees, {}: triangles that meet at less are smooth",
    label: "Crease angle",
    tip: "Degrees between triangles up to which their edge is smooth. Higher: rounder; lower: more sharp edges",
    value: Value::Number(Number {
        symbol: "",
        limits: Limits::decimal(0.0, 180.0, 1),
        get: |render| render.crease_degrees,
        set: |render, degrees| render.crease_degrees = degrees,
    }),
    applies: |render| uses_normals(render) && render.normals == NormalSource::Crease,
    written: Written::Changed,
};

/// Edges of the triangles.
pub static MESH_EDGES: Setting<RenderSettings> = Setting {
    key: "mesh-edges",
    value_name: "",
    help: "Draw the edges of the triangles over the picture",
    label: "Mesh",
    tip: "Draw the edges of triangles that are at least 2 pixels high: how fine the mesh is, and where triangles are long and thin (M)",
    value: Value::Switch { name: "Edges", get: |render| render.mesh_edges, set: |render, on| render.mesh_edges = on },
    applies: |_| true,
    written: Written::Changed,
};

/// Antialiasing samples a pixel.
pub static SAMPLES: Setting<RenderSettings> = Setting {
    key: "samples",
    value_name: "N",
    help: "Antialiasing samples a pixel, {}",
    label: "Samples",
    tip: "Samples per pixel once the picture is at rest. More: smoother edges and shadows, later",
    value: Value::Number(Number {
        symbol: "",
        limits: Limits::whole(1, 1024).slider(1.0, 256.0).logarithmic(),
        get: |render| render.samples as f32,
        set: |render, samples| render.samples = samples as u32,
    }),
    applies: |_| true,
    written: Written::Always,
};

/// SIMD level of builds and rays, which changes only the speed.
pub static SIMD: Setting<RenderSettings> = Setting {
    key: "simd",
    value_name: "LEVEL",
    help: "Vector instructions of builds and rays: sse2, avx2, avx512 or neon, where this machine has them [default: the best]",
    label: "",
    tip: "",
    value: Value::One {
        options: || levels().map(|level| Choice::new(level.name(), level.name(), "")).collect(),
        get: |render| levels().position(|level| level == render.simd),
        set: |render, index| render.simd = levels().nth(index).unwrap_or_default(),
    },
    applies: |_| true,
    written: Written::Changed,
};

/// The levels that this machine has.
fn levels() -> impl Iterator<Item = SimdLevel> {
    SimdLevel::ALL.into_iter().filter(|level| level.is_available())
}

#[cfg(test)]
mod tests {
    #[test]
    fn rows_keep_their_word() {
        crate::catalog::settings::check_rows::<super::RenderSettings>();
    }
}
