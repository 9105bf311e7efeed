//! Views of a tree whose nodes have up to eight children: the wide tree that pictures are traced through, taken as a tree of
//! its own.

use std::collections::BTreeSet;
use std::sync::Arc;

use bvhscope::accel::Accel;
use bvhscope::camera::Camera;
use bvhscope::lab::icicle::{Icicle, IcicleWidth, subtree_sums};
use bvhscope::lab::ray::{RayMethod, RayRecord, RayRequest, Step, record};
use bvhscope::overlay::{NodeTable, OverlaySettings, Role, Selection, highlighted};
use bvhscope::render::cluster_cut::cluster_of_primitives;
use bvhscope::render::{HeatKind, RayKind, RayStart, RenderRequest, RenderSettings, Shading, render};
use bvhscope::scene::{LoadOptions, SceneSource, load};
use bvhscope::visibility::{NodeIdentity, TriangleSet};
use bvhscope_engine::CancelToken;
use bvhscope_engine::settings::BuildSettings;
use bvhscope_engine::tree::traverse::{RayEvent, Traversal};
use bvhscope_engine::tree::{Container as _, ContainerKind};
use bvhscope_engine::with_tree;

const SIZE: [u32; 2] = [40, 30];

/// A binary tree of the teapot, and the wide tree made from it.
fn trees(container: ContainerKind) -> [Arc<Accel>; 2] {
    let token = CancelToken::new();
    let source = SceneSource::Builtin { name: "teapot".to_owned(), size: Some(4) };
    let scene = Arc::new(load(&source, &LoadOptions::default(), &token).unwrap());
    let settings = BuildSettings { container, ..BuildSettings::default() };
    let binary = Accel::build(&scene, &settings, &token).unwrap();
    let wide = binary.wide().tree.to_tree(&binary.tree, &token).unwrap().expect("the same kind of container");
    let wide = Accel::with_tree(&scene, &settings, wide, &token).unwrap();
    let stats = &wide.report.stats;
    assert!(!stats.is_binary() && stats.max_arity == 8 && stats.mean_arity > 3.0, "{stats:?}");
    [Arc::new(binary), Arc::new(wide)]
}

fn indices(triangles: &TriangleSet, count: usize) -> BTreeSet<u32> {
    (0..count as u32).filter(|&triangle| triangles.contains(triangle)).collect()
}

#[test]
fn every_node_knows_its_family() {
    for container in ContainerKind::ALL {
        let [_, wide] = trees(container);
        let table = NodeTable::new(&wide);
        let count = wide.scene.triangles.len();
        // Parents before and after they are known for the whole tree.
        for _ in 0..2 {
            assert_eq!((table.parent(0), table.sibling(0, 1), table.depth(0)), (None, None, 0));
            let mut leaf_depths = BTreeSet::new();
            for node in 0..table.len() as u32 {
                let children = table.children(node);
                assert_eq!(children.is_empty(), table.is_leaf(node));
                for child in children.clone() {
                    assert_eq!((table.parent(child), table.depth(child)), (Some(node), table.depth(node) + 1));
                    let next = if child + 1 < children.end { child + 1 } else { children.start };
                    assert_eq!(table.sibling(child, 1), Some(next), "{child} of {children:?}");
                    assert_eq!(table.sibling(next, -1), Some(child), "{child} of {children:?}");
                }
                if table.is_leaf(node) {
                    leaf_depths.insert(table.depth(node));
                } else {
                    let below: BTreeSet<u32> =
                        children.flat_map(|child| indices(&table.triangles_below(child), count)).collect();
                    assert_eq!(indices(&table.triangles_below(node), count), below);
                }
            }
            let [first, last] = [leaf_depths.first(), leaf_depths.last()].map(|depth| *depth.unwrap());
            assert_eq!(table.leaf_depths(), Some([first, last]));
            table.study(&CancelToken::new()).unwrap();
        }
        assert_eq!(indices(&table.triangles_below(0), count).len(), count);
    }
}

#[test]
fn the_overlay_draws_all_children() {
    for container in ContainerKind::ALL {
        let [_, wide] = trees(container);
        let table = NodeTable::new(&wide);
        let settings = |depth| OverlaySettings { depth: Some(depth), ..OverlaySettings::default() };
        let of_root: Vec<u32> = table.children(0).collect();
        let mut shown = table.shown(&settings([1, 1]), &Selection::default(), None).nodes.to_vec();
        shown.sort_unstable();
        assert_eq!(shown, of_root);
        let all = table.shown(&settings([0, 99]), &Selection::default(), None);
        assert_eq!(all.wanted, table.len());
        // Cut by a budget: the largest, which with their parents make a tree from the top.
        let few = OverlaySettings { budget: Some(30), ..settings([0, 99]) };
        let few = table.shown(&few, &Selection::default(), None).nodes.to_vec();
        let mut by_area: Vec<u32> = (0..table.len() as u32).collect();
        by_area.sort_by(|&a, &b| table.area_share(b).total_cmp(&table.area_share(a)).then(a.cmp(&b)));
        let smallest = table.area_share(by_area[29]);
        assert_eq!(few.len(), 30);
        assert!(few.iter().all(|&node| table.area_share(node) >= smallest * 0.999), "{container:?}");
        // A selected node is drawn with every child.
        let selection = Selection { selected: Some(0), ..Selection::default() };
        let marked = highlighted(&table, &selection);
        let children = marked.iter().filter(|(_, role)| matches!(role, Role::FirstChild | Role::SecondChild));
        assert_eq!(children.map(|(node, _)| *node).collect::<Vec<_>>(), of_root);
        // Children have something in common with a sibling exactly where there is overlap.
        for node in (0..table.len() as u32).filter(|&node| !table.is_leaf(node)) {
            assert!(!table.overlap_instances(node).is_empty() || table.overlap(node) == Some(0.0), "{node}");
        }
        assert!(table.overlap_instances(0).len() > 1, "several pairs of the root's children overlap");
        // Containers of the other kind hold those below them.
        for node in 0..table.len() as u32 {
            for child in table.children(node) {
                let slack = 1e-4 * wide.scene.bounds.extent().length();
                assert!(table.node_box(node).contains(&table.node_box(child), slack));
                assert!(table.node_sphere(node).contains(&table.node_sphere(child), slack));
            }
        }
    }
}

#[test]
fn hiding_a_child_hides_its_triangles_and_no_sibling() {
    let [_, wide] = trees(ContainerKind::Aabb);
    let table = NodeTable::new(&wide);
    let count = wide.scene.triangles.len();
    for hidden in table.children(0) {
        let visibility = table.visibility(&Selection { hidden: [hidden].into(), ..Selection::default() }).unwrap();
        assert_eq!(indices(&visibility.triangles, count), indices(&table.triangles_below(hidden), count));
        let is_hidden: Vec<u32> = table.children(0).filter(|&child| visibility.hides(child)).collect();
        assert_eq!(is_hidden, [hidden]);
        let only = Selection { only: Some(Arc::new(table.triangles_below(hidden))), ..Selection::default() };
        let visible = table.visibility(&only).unwrap();
        assert_eq!(table.children(0).filter(|&child| !visible.hides(child)).collect::<Vec<_>>(), [hidden]);
    }
}

#[test]
fn nodes_are_found_again_in_trees_of_other_arity() {
    let [binary, wide] = trees(ContainerKind::Aabb);
    for node in 0..wide.tree.node_count() as u32 {
        let identity = NodeIdentity::of(&wide, node).unwrap();
        let there = identity.find(&binary).expect("each node of the wide tree was one of the binary tree");
        assert_eq!(NodeIdentity::of(&binary, there), Some(identity));
        assert_eq!(identity.find(&wide), Some(node), "no two nodes have the same triangles");
    }
    let lost = (0..binary.tree.node_count() as u32)
        .filter(|&node| NodeIdentity::of(&binary, node).unwrap().find(&wide).is_none());
    assert!(lost.count() > wide.tree.node_count() / 4, "the wide tree has no nodes between");
}

#[test]
fn the_icicle_lays_out_all_children() {
    let [_, wide] = trees(ContainerKind::Aabb);
    let table = NodeTable::new(&wide);
    for width in [IcicleWidth::Cost, IcicleWidth::Area, IcicleWidth::Primitives] {
        let sums = subtree_sums(&wide, width, None, None, &CancelToken::new()).unwrap();
        if width == IcicleWidth::Primitives {
            assert_eq!(sums[0] as usize, wide.scene.triangles.len());
        }
        let icicle = Icicle::new(|node| table.children(node), &sums, 0, 4_000, 99);
        let mut families = 0;
        for cell in &icicle.cells {
            let children: Vec<_> = table.children(cell.node).filter_map(|child| icicle.cell_of(child)).collect();
            for child in &children {
                assert!(child.level == cell.level + 1);
                assert!(cell.left_px <= child.left_px && child.right_px <= cell.right_px);
                let share = f64::from(sums[child.node as usize]) / f64::from(sums[0]) * 4_000.0;
                assert!((f64::from(child.right_px - child.left_px) - share).abs() <= 1.5, "{width:?}: {child:?}");
            }
            assert!(children.is_sorted_by(|a, b| a.right_px <= b.left_px), "{width:?}: children overlap");
            families += usize::from(children.len() == 8);
        }
        assert!(families > 2, "{width:?}: {families} nodes with all eight children in view");
    }
}

#[test]
fn clusters_are_the_children_at_a_depth() {
    let [_, wide] = trees(ContainerKind::Sphere);
    let table = NodeTable::new(&wide);
    let count = wide.scene.triangles.len();
    with_tree!(&wide.tree, tree => {
        let clusters = cluster_of_primitives(tree, 1, &CancelToken::new()).unwrap();
        for child in table.children(0) {
            let own: BTreeSet<u32> = (0..count as u32).filter(|&triangle| clusters[triangle as usize] == child).collect();
            assert_eq!(own, indices(&table.triangles_below(child), count));
        }
        // A tree that lacks all but its last triangles.
        let mut faulty = tree.clone();
        faulty.nodes = vec![bvhscope_engine::tree::Node { first: 0, count: 1, ..faulty.nodes[0] }];
        faulty.primitive_indices = vec![count as u32 - 1];
        assert_eq!(cluster_of_primitives(&faulty, 3, &CancelToken::new()).unwrap(), vec![0; count]);
    });
}

fn picture(accel: &Arc<Accel>, settings: RenderSettings) -> RenderRequest {
    RenderRequest::new(accel, Camera::framing(&accel.scene.bounds, accel.scene.up), settings, SIZE)
}

#[test]
fn pictures_show_the_same_and_counters_say_how_many_children_were_tested() {
    for container in ContainerKind::ALL {
        let [binary, wide] = trees(container);
        let table = NodeTable::new(&wide);
        table.study(&CancelToken::new()).unwrap();
        let shown = |accel, settings| render(&picture(accel, settings), &CancelToken::new(), &|_| ()).unwrap();
        let plain = RenderSettings::default();
        assert_eq!(shown(&wide, plain).rgba, shown(&binary, plain).rgba, "{container:?}");
        for traversal in Traversal::ALL {
            let heat =
                RenderSettings { shading: Shading::Heat(HeatKind::Both), traversal, ..RenderSettings::default() };
            let values = shown(&wide, heat).values;
            let pixels = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| [x, y]));
            for (pixel, value) in pixels.zip(values) {
                let request = RayRequest {
                    start: RayStart::Pixel(pixel),
                    kind: RayKind::Primary,
                    method: RayMethod::Binary(traversal),
                    camera: Camera::framing(&wide.scene.bounds, wide.scene.up),
                    size_px: SIZE,
                    settings: RenderSettings::default(),
                    hidden: None,
                };
                let record = record(&wide, &request, &CancelToken::new()).unwrap().unwrap();
                assert_eq!((record.counts.containers + record.counts.primitives) as f32, value, "{pixel:?}");
                check_record(&table, &record);
            }
        }
    }
}

/// After each visit of an interior node all its children are reported in order, waiting nodes are on the stack, and spans nest.
fn check_record(table: &NodeTable, record: &RayRecord) {
    let mut told = Vec::new();
    let mut expected = Vec::new();
    for (index, step) in record.steps.iter().enumerate() {
        match step.what {
            Step::Event(RayEvent::Visit { node }) => expected.extend(table.children(node)),
            Step::Event(RayEvent::Enter { node, .. } | RayEvent::Miss { node }) if node != 0 => told.push(node),
            _ => {}
        }
        if index % 8 == 0 {
            assert_eq!(record.stack_after(index).len(), step.waiting as usize);
        }
    }
    assert_eq!(told, expected);
    assert_eq!(told.len() as u64 + 1, record.counts.containers);
    for span in &record.spans {
        assert_eq!(
            (span.tree_node, span.depth, span.is_leaf),
            (span.node, table.depth(span.node), table.is_leaf(span.node))
        );
    }
}

/// The wide tree made from a tree of eight children names nodes of that tree.
#[test]
fn rays_through_the_wide_tree_name_nodes_of_the_tree() {
    let [_, wide] = trees(ContainerKind::Aabb);
    let (mut exact, mut all) = (0, 0);
    for x in 0..SIZE[0] {
        let request = RayRequest {
            start: RayStart::Pixel([x, SIZE[1] / 2]),
            kind: RayKind::Primary,
            method: RayMethod::Wide,
            camera: Camera::framing(&wide.scene.bounds, wide.scene.up),
            size_px: SIZE,
            settings: RenderSettings::default(),
            hidden: None,
        };
        let record = record(&wide, &request, &CancelToken::new()).unwrap().unwrap();
        let table = NodeTable::new(&wide);
        for span in &record.spans {
            assert!((span.tree_node as usize) < table.len());
            all += 1;
            exact += usize::from(span.is_leaf == table.is_leaf(span.tree_node));
        }
    }
    // A leaf of the wide tree may hold several leaves of the tree.
    assert!(all > 100 && 2 * exact > all, "{exact} of {all} stand for a node of their own kind");
}
