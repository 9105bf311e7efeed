//! Times, rates and tests: how fast a tree is built and traced.

use serde_json::Value;

use super::row::{LESS, OF_VIEW, ROW, known, rate, single, tests};
use super::{Compared, Digits, Direction, Number, Section, millions_per_second};
use crate::catalog::terms;
use crate::text::number;
use bvhscope_engine::wide::trace::LINE_BYTES;

/// The rows, in the order of JSON, CSV and tables.
pub(super) const ROWS: &[Number] = &[
    Number {
        key: "build_ms",
        unit: "ms",
        label: "Build time",
        meaning: "Wall-clock time of building the binary tree, as in the paper: the median of the repetitions; null where the \
                  file of the tree does not state it",
        term: Some(terms::BUILD_TIME),
        get: |tree| known(tree.build.map_or(f64::NAN, |build| build.ms)),
        spread: Some(("build_ms_spread", |tree| tree.build?.spread)),
        compared: Some(Compared { name: "build ms", is_timed: true, ..LESS }),
        column: Some(("binary tree", "ms")),
        axis: Some("Build time (ms)"),
        ..ROW
    },
    Number {
        key: "ready_ms",
        unit: "ms",
        label: "Ready to trace",
        meaning: "Wall-clock time until rays can be traced at full speed: the binary tree and the wide one made from it; absent \
                  where the file of the tree does not state its build time",
        get: |tree| tree.ready_ms.map(Value::from),
        column: Some(("ready", "ms")),
        ..ROW
    },
    Number {
        key: "build_stages_ms",
        unit: "ms",
        label: "Stages",
        meaning: "Time of each stage of the build, each the median of its own repetitions",
        get: |tree| serde_json::to_value(&tree.stages_ms).ok(),
        ..ROW
    },
    Number {
        key: "mtriangles_per_s",
        unit: "Mtri/s",
        label: "Build speed",
        meaning: "Triangles built per second, in millions; absent of a tree that follows a model by a policy",
        get: |tree| known(millions_per_second(tree.triangles as u64, tree.build.filter(|_| !tree.is_update)?.ms)),
        panel: Some(Section::Build),
        ..ROW
    },
    Number {
        key: "trace_ms",
        unit: "ms",
        label: "Trace time",
        meaning: "Wall-clock time of tracing the primary rays one by one through the binary tree without shading, as in the paper: \
                  the median of the repetitions; of `render` the time of the whole picture",
        get: |tree| known(tree.trace?.binary?.ms),
        spread: Some(("trace_ms_spread", |tree| tree.trace?.binary?.spread)),
        column: Some(("binary trace", "ms")),
        axis: Some("Trace time, binary tree (ms)"),
        ..ROW
    },
    Number {
        key: "binary_mrays_per_s",
        unit: "Mray/s",
        meaning: "Primary rays per second through the binary tree, in millions, from `trace_ms`",
        get: |tree| tree.trace?.wide.and_then(|_| known(rate(tree, tree.trace?.binary?.ms)?)),
        ..ROW
    },
    Number {
        key: "wide_trace_ms",
        unit: "ms",
        meaning: "Wall-clock time of tracing the same primary rays in packets through the wide tree, as pictures are traced: the \
                  median of the repetitions",
        get: |tree| known(tree.trace?.wide?.ms),
        ..ROW
    },
    Number {
        key: "mrays_per_s",
        unit: "Mray/s",
        label: "Speed",
        meaning: "Primary rays per second through the wide tree, in millions, from `wide_trace_ms`; of `render` with the shading of \
                  the picture, and in the window of the measuring view of `tests_per_entering_ray`, repeated at rest",
        term: Some(terms::MRAYS_PER_SECOND),
        get: |tree| match (tree.at_rest, tree.trace?.wide) {
            (Some((rays, times)), _) => known(millions_per_second(rays, times.ms)),
            (None, Some(wide)) => known(rate(tree, wide.ms)?),
            (None, None) => tree.trace?.picture_mrays_per_s.map(Value::from),
        },
        spread: Some(("mrays_per_s_spread", |tree| {
            if let Some((rays, times)) = tree.at_rest {
                let [lower, upper] = times.spread?;
                return Some([millions_per_second(rays, upper), millions_per_second(rays, lower)]);
            }
            let [lower, upper] = tree.trace?.wide?.spread?;
            Some([rate(tree, upper)?, rate(tree, lower)?])
        })),
        compared: Some(Compared { name: "speed Mray/s", better: Some(Direction::More), is_timed: true, ..LESS }),
        column: Some(("speed", "Mray/s")),
        ..ROW
    },
    Number {
        key: "container_tests_per_ray",
        label: "Container tests",
        meaning: "Containers tested by a primary ray, on average over all, those that miss the root included",
        term: Some(terms::TESTS_PER_RAY),
        get: |tree| tests(tree, |[containers, _]| containers),
        compared: Some(Compared { name: "container tests/ray", ..OF_VIEW }),
        panel: Some(Section::Trace),
        column: Some(("containers", "tests/ray")),
        ..ROW
    },
    Number {
        key: "primitive_tests_per_ray",
        label: "Triangle tests",
        meaning: "Triangles tested by a primary ray, on average over all, those that miss the root included",
        term: Some(terms::TESTS_PER_RAY),
        get: |tree| tests(tree, |[_, primitives]| primitives),
        compared: Some(Compared { name: "triangle tests/ray", ..OF_VIEW }),
        panel: Some(Section::Trace),
        column: Some(("primitives", "tests/ray")),
        ..ROW
    },
    Number {
        key: "tests_per_ray",
        label: "Tests per pixel",
        meaning: "Containers and triangles tested by a primary ray, on average over all, those that miss the root included",
        term: Some(terms::TESTS_PER_RAY),
        get: |tree| tests(tree, |[containers, primitives]| containers + primitives),
        compared: Some(Compared { name: "tests/ray", ..OF_VIEW }),
        panel: Some(Section::Trace),
        column: Some(("all", "tests/ray")),
        ..ROW
    },
    Number {
        key: "tests_per_entering_ray",
        label: "Tests per ray",
        meaning: "Containers and triangles tested by a primary ray that enters the scene's box, the axis-aligned one around all \
                  triangles, on average, so that trees of all containers are judged by the same rays: each container tested counts 1, two for each interior node that is visited, and so does each triangle tested. In the window of \
                  the measuring view, 1024×1024 pixels from the model's default camera, whatever the window shows",
        term: Some(terms::TESTS_PER_RAY),
        get: |tree| single(tree.entering?.tests),
        compared: Some(Compared { name: "tests/entering ray", ..LESS }),
        column: Some(("entering", "tests/ray")),
        axis: Some("Tests per entering ray"),
        ..ROW
    },
    Number {
        key: "entering_rays",
        meaning: "Number of primary rays that enter the scene's box; where they are few, trees are not judged by them",
        get: |tree| tree.trace?.entering.map(Value::from),
        ..ROW
    },
    Number {
        key: "bytes_per_entering_ray",
        unit: "B",
        digits: Digits::Rounded,
        label: "Bytes per ray",
        meaning: "Memory of the wide tree that a ray of `tests_per_entering_ray` reads, on average: 64 bytes for each cache line of \
                  nodes or triangles that it touches, counted once a ray, as if none were cached before",
        term: Some(terms::CACHE_LINE),
        note: Some(|tree| {
            let [nodes, triangles] = tree.entering?.lines.map(|lines| number(lines.into()));
            Some(format!("{nodes} lines of nodes and {triangles} of triangles, in the measuring view"))
        }),
        get: |tree| single(tree.entering?.lines.iter().sum::<f32>() * LINE_BYTES as f32),
        compared: Some(Compared { name: "bytes/entering ray", ..LESS }),
        panel: Some(Section::Trace),
        column: Some(("reads", "B/ray")),
        axis: Some("Bytes per entering ray"),
        ..ROW
    },
    Number {
        key: "node_lines_per_entering_ray",
        meaning: "Cache lines of nodes among those of `bytes_per_entering_ray`, on average",
        get: |tree| single(tree.entering?.lines[0]),
        ..ROW
    },
    Number {
        key: "triangle_lines_per_entering_ray",
        meaning: "Cache lines of triangles among those of `bytes_per_entering_ray`, on average",
        get: |tree| single(tree.entering?.lines[1]),
        ..ROW
    },
    Number {
        key: "preparation_ms",
        unit: "ms",
        label: "Preparation",
        meaning: "Of `animate`: wall-clock time of everything before the first frame, once: of whole-clip its tree of eight poses, of keep also \
                  enclosing each frame",
        ..ROW
    },
    Number {
        key: "update_ms",
        unit: "ms",
        label: "Update",
        meaning: "Of `animate`: wall-clock time of making the binary tree that of the frame; `ready_ms` has the wide tree's too: \
                  the medians of the rounds, each from the tree of the frame before",
        ..ROW
    },
    Number {
        key: "behind_ms",
        unit: "ms",
        label: "Build behind",
        meaning: "Of `animate` and the policy rebuild-behind: time of building the next tree, beside the frames; absent where none was \
                  begun",
        ..ROW
    },
    Number {
        key: "ray_ns",
        unit: "ns",
        label: "Time of a ray",
        meaning: "Of `animate`: wall-clock time of finding the nearest hit of a ray of the first population through the wide tree, all \
                  threads together: the median of the repetitions",
        spread: Some(("ray_ns_spread", |_| None)),
        ..ROW
    },
    Number {
        key: "population_tests_per_ray",
        label: "Tests of a ray",
        meaning: "Of `animate`: containers and triangles tested by a ray of the first population, on average over all, those that miss \
                  the root included",
        ..ROW
    },
];
