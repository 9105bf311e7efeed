//! Bytes, numbers of rays, the wide tree and the speed-ups.

use super::row::{ROW, known, megabytes};
use super::{Digits, Number, Section};
use crate::text::number;
use bvhscope_engine::tree::levels::Levels;

/// The rows, in the order of JSON, CSV and tables.
pub(super) const ROWS: &[Number] = &[
    Number {
        key: "tree_bytes",
        unit: "B",
        digits: Digits::Bytes,
        label: "Tree",
        meaning: "Nodes and triangle indices of the binary tree",
        get: |tree| known(tree.report.tree_bytes),
        panel: Some(Section::Memory),
        ..ROW
    },
    Number {
        key: "triangle_bytes",
        unit: "B",
        digits: Digits::Bytes,
        label: "Leaf triangles",
        meaning: "Triangles in leaf order",
        get: |tree| known(tree.report.triangle_bytes),
        panel: Some(Section::Memory),
        ..ROW
    },
    Number {
        key: "bytes_per_triangle",
        unit: "B",
        digits: Digits::Rounded,
        label: "Bytes per triangle",
        meaning: "Bytes of the binary tree and its triangles, per triangle of the model",
        get: |tree| known(tree.report.bytes_per_triangle()),
        info: Some(("memory", |tree| {
            let (report, each) = (tree.report, tree.report.bytes_per_triangle());
            let [nodes, triangles] = [report.tree_bytes, report.triangle_bytes].map(megabytes);
            let [one, several] = tree.primitives;
            Some(format!("{nodes} tree, {triangles} {several}, {each:.0} bytes a {one}"))
        })),
        column: Some(("memory", "B/tri")),
        ..ROW
    },
    Number {
        key: "rays",
        digits: Digits::Count,
        label: "Primary rays",
        meaning: "Number of primary rays, one through the centre of each pixel",
        get: |tree| known(tree.trace?.rays),
        ..ROW
    },
    Number {
        key: "hits",
        digits: Digits::Count,
        label: "Hits",
        meaning: "Number of primary rays that hit something",
        get: |tree| known(tree.trace?.hits),
        column: Some(("hits", "")),
        ..ROW
    },
    Number {
        key: "collapse_ms",
        unit: "ms",
        meaning: "Time of making the wide tree from the binary one: the median of the repetitions",
        get: |tree| known(tree.wide?.collapse_ms),
        info: Some(("wide tree", |tree| {
            let wide = tree.wide?;
            let [nodes, triangles] = [wide.node_bytes, wide.triangle_bytes].map(megabytes);
            let each = wide.bytes_per_triangle;
            let ready =
                tree.ready_ms.map_or_else(String::new, |ms| format!(", ready to trace after {} ms", number(ms)));
            let made = number(wide.collapse_ms);
            let [one, several] = tree.primitives;
            Some(format!("{nodes} nodes, {triangles} {several}, {each:.0} bytes a {one}, made in {made} ms{ready}"))
        })),
        ..ROW
    },
    Number {
        key: "wide_node_bytes",
        unit: "B",
        digits: Digits::Bytes,
        label: "Wide tree",
        meaning: "Nodes of the wide tree, with up to eight children, which camera rays traverse",
        get: |tree| known(tree.wide?.node_bytes),
        panel: Some(Section::Memory),
        ..ROW
    },
    Number {
        key: "wide_triangle_bytes",
        unit: "B",
        digits: Digits::Bytes,
        label: "Wide triangles",
        meaning: "Triangles of the wide tree in leaf order, without gaps",
        get: |tree| known(tree.wide?.triangle_bytes),
        panel: Some(Section::Memory),
        ..ROW
    },
    Number {
        key: "wide_bytes_per_triangle",
        unit: "B",
        digits: Digits::Rounded,
        meaning: "Bytes of the wide tree and its triangles, per triangle of the model",
        get: |tree| known(tree.wide?.bytes_per_triangle),
        ..ROW
    },
    Number {
        key: "overlay_bytes",
        unit: "B",
        digits: Digits::Bytes,
        label: "Overlay",
        meaning: "Indices of the nodes at each depth, for the overlay",
        get: |tree| known(Levels::bytes(tree.report.stats.nodes)),
        panel: Some(Section::Memory),
        ..ROW
    },
    Number {
        key: "speedup",
        label: "Speed-up of the build",
        meaning: "Of `scaling`: build time with one thread divided by this one",
        ..ROW
    },
    Number {
        key: "trace_speedup",
        label: "Speed-up of tracing",
        meaning: "Of `scaling`: trace time with one thread divided by this one",
        ..ROW
    },
];
