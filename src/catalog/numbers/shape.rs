//! Costs, nodes and hashes: what the tree is.

use serde_json::Value;

use super::row::{LESS, NEITHER, ROW, hash, known, single, singles};
use super::{Compared, Digits, Number, Section};
use crate::catalog::terms;
use crate::text::{count, number};
use bvhscope_engine::tree::statistics::INTERSECTION_COST;

/// The rows, in the order of JSON, CSV and tables.
pub(super) const ROWS: &[Number] = &[
    Number {
        key: "sah_cost",
        label: "SAH cost",
        meaning: "Expected cost of a ray that hits the root, by the surface area heuristic: each test weighted by the area of the \
                  node over the root's",
        term: Some(terms::SAH_COST),
        get: |tree| single(tree.report.stats.sah_cost),
        compared: Some(Compared { name: "SAH cost", across_containers: false, ..LESS }),
        info: Some(("SAH cost", |tree| {
            let cost = number(tree.report.stats.sah_cost.into());
            let container_test = tree.container.traversal_cost();
            Some(format!("{cost} (container test {container_test}, primitive test {INTERSECTION_COST})"))
        })),
        column: Some(("SAH cost", "")),
        axis: Some("SAH cost"),
        ..ROW
    },
    Number {
        key: "optimize_sah_costs",
        meaning: "SAH cost before the optimisation passes, under `tree`, and after each pass",
        get: |tree| {
            let costs = tree.report.stages.costs.iter().map(|&(pass, cost)| (pass.to_owned(), Value::from(cost)));
            Some(Value::Object(costs.collect())).filter(|_| !tree.report.stages.costs.is_empty())
        },
        ..ROW
    },
    Number {
        key: "traversal_cost",
        meaning: "Cost of a container test in the SAH cost",
        get: |tree| single(tree.container.traversal_cost()),
        ..ROW
    },
    Number {
        key: "intersection_cost",
        meaning: "Cost of a primitive test in the SAH cost",
        get: |_| single(INTERSECTION_COST),
        ..ROW
    },
    Number {
        key: "epo",
        label: "EPO",
        meaning: "End-point overlap (Aila et al. 2013): surface inside nodes that do not contain it, over the whole surface; \
                  inside an interior node it counts `traversal_cost`, inside a leaf 1 for each of its triangles",
        term: Some(terms::EPO),
        note: Some(|tree| tree.epo?.estimate_note()),
        get: |tree| single(tree.epo?.value),
        compared: Some(Compared { name: "EPO", across_containers: false, ..LESS }),
        panel: Some(Section::Tree),
        info: Some(("EPO", |tree| {
            let epo = tree.epo?;
            let note = epo.estimate_note().map_or_else(String::new, |note| format!(" ({note})"));
            Some(format!("{}{note}", number(epo.value.into())))
        })),
        column: Some(("EPO", "")),
        ..ROW
    },
    Number {
        key: "epo_margin",
        meaning: "Half-width of the 95 % interval around `epo`; absent where that is exact",
        get: |tree| single(tree.epo?.margin?),
        ..ROW
    },
    Number {
        key: "epo_triangles",
        meaning: "Number of triangles that `epo` was computed from; fewer than those of the model where it is an estimate",
        get: |tree| known(tree.epo?.sampled),
        ..ROW
    },
    Number {
        key: "nodes",
        digits: Digits::Count,
        label: "Nodes",
        meaning: "Interior nodes and leaves",
        term: Some(terms::NODE),
        get: |tree| known(tree.report.stats.nodes),
        compared: Some(Compared { name: "nodes", ..NEITHER }),
        panel: Some(Section::Tree),
        info: Some(("nodes", |tree| {
            let stats = &tree.report.stats;
            Some(format!("{}, leaves {}", stats.nodes, stats.leaves))
        })),
        column: Some(("nodes", "")),
        ..ROW
    },
    Number {
        key: "leaves",
        digits: Digits::Count,
        label: "Leaves",
        meaning: "Nodes that hold triangles",
        term: Some(terms::LEAF),
        get: |tree| known(tree.report.stats.leaves),
        compared: Some(Compared { name: "leaves", ..NEITHER }),
        panel: Some(Section::Tree),
        column: Some(("leaves", "")),
        ..ROW
    },
    Number {
        key: "max_depth",
        digits: Digits::Count,
        label: "Depth",
        meaning: "Depth of the deepest node, root 0",
        term: Some(terms::DEPTH),
        note: Some(|tree| Some(format!("leaves lie at {:.1} on average", tree.report.stats.mean_leaf_depth))),
        get: |tree| known(tree.report.stats.max_depth),
        compared: Some(Compared { name: "depth", ..NEITHER }),
        panel: Some(Section::Tree),
        info: Some(("depth", |tree| {
            let stats = &tree.report.stats;
            Some(format!("{}, mean over leaves {:.1}", stats.max_depth, stats.mean_leaf_depth))
        })),
        column: Some(("depth", "")),
        ..ROW
    },
    Number {
        key: "mean_leaf_depth",
        meaning: "Depth of the leaves, on average",
        get: |tree| single(tree.report.stats.mean_leaf_depth),
        ..ROW
    },
    Number {
        key: "children_per_node",
        label: "Children",
        meaning: "Children of an interior node: fewest, mean, most; absent for a binary tree",
        term: Some(terms::NODE),
        note: Some(|tree| {
            let counts = tree.report.stats.arity_histogram.iter().enumerate().filter(|(_, nodes)| **nodes > 0);
            let list: Vec<String> =
                counts.map(|(arity, nodes)| format!("{arity}: {}", count((*nodes).into()))).collect();
            Some(format!("nodes by children: {}", list.join(", ")))
        }),
        get: |tree| {
            let stats = Some(&tree.report.stats).filter(|stats| !stats.is_binary())?;
            singles([stats.min_arity() as f32, stats.mean_arity, stats.max_arity as f32])
        },
        panel: Some(Section::Tree),
        info: Some(("children", |tree| {
            let stats = Some(&tree.report.stats).filter(|stats| !stats.is_binary())?;
            Some(format!("{} to {} a node, mean {:.2}", stats.min_arity(), stats.max_arity, stats.mean_arity))
        })),
        ..ROW
    },
    Number {
        key: "nodes_per_arity",
        meaning: "Number of interior nodes by number of children, from 0; absent for a binary tree",
        get: |tree| {
            let stats = Some(&tree.report.stats).filter(|stats| !stats.is_binary())?;
            known(stats.arity_histogram.clone())
        },
        ..ROW
    },
    Number {
        key: "leaf_size",
        label: "Leaf size",
        meaning: "Triangles in a leaf: smallest, mean, largest",
        term: Some(terms::LEAF),
        get: |tree| {
            let stats = &tree.report.stats;
            singles([stats.min_leaf_size as f32, stats.mean_leaf_size, stats.max_leaf_size as f32])
        },
        panel: Some(Section::Tree),
        info: Some(("leaf size", |tree| {
            let stats = &tree.report.stats;
            let [min, mean, max] = [stats.min_leaf_size as f32, stats.mean_leaf_size, stats.max_leaf_size as f32];
            Some(format!("{min} to {max} {}, mean {mean:.2}", tree.primitives[1]))
        })),
        ..ROW
    },
    Number {
        key: "tree_hash",
        meaning: "Hash of the binary tree, 16 hexadecimal digits: the same on every machine",
        get: |tree| hash(tree, 0),
        ..ROW
    },
    Number {
        key: "wide_tree_hash",
        meaning: "Hash of the wide tree, 16 hexadecimal digits",
        get: |tree| hash(tree, 1),
        ..ROW
    },
];
