//! The overlay: which nodes are shown, and what their lines look like when drawn without a window.

#![cfg(feature = "gui")]
#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]

use std::sync::Arc;

use bvhscope::accel::Accel;
use bvhscope::bvh::stats::tree_stats;
use bvhscope::bvh::{BuildSettings, Container, ContainerKind, Node, Tree};
use bvhscope::camera::{Camera, Projection};
use bvhscope::cancel::CancelToken;
use bvhscope::geometry::{Aabb, Sphere, Triangle};
use bvhscope::overlay::{
    ColorBy, DrawInput, NodeTable, OffscreenError, OverlaySettings, PictureInput, Role, Selection, Shown,
    draw_offscreen, highlighted, legend,
};
use bvhscope::scene::{LoadOptions, Material, Scene, SceneSource, Warnings, load};
use glam::Vec3;

const FAR: f32 = 1e30;

/// A tree that splits the list of triangles in the middle down to single ones.
fn halving_tree<C: Container>(triangles: &[Triangle]) -> Tree<C> {
    let around = |part: &[Triangle]| part.iter().fold(C::EMPTY, |all, one| all.union(&C::of_triangle(one)));
    let mut nodes = vec![Node { container: around(triangles), first: 0, count: triangles.len() as u32 }];
    let mut max_depth = 0;
    let mut open = vec![(0_usize, 0)];
    while let Some((index, depth)) = open.pop() {
        max_depth = max_depth.max(depth);
        let (start, count) = (nodes[index].first as usize, nodes[index].count as usize);
        if count < 2 {
            continue;
        }
        let half = count / 2;
        let children = nodes.len();
        for (start, count) in [(start, half), (start + half, count - half)] {
            let container = around(&triangles[start..start + count]);
            nodes.push(Node { container, first: start as u32, count: count as u32 });
            open.push((nodes.len() - 1, depth + 1));
        }
        (nodes[index].first, nodes[index].count) = (children as u32, 0);
    }
    Tree { nodes, primitive_indices: (0..triangles.len() as u32).collect(), max_depth }
}

fn accel<C: Container>(triangles: Vec<Triangle>) -> Arc<Accel> {
    let tree = C::into_any(halving_tree::<C>(&triangles));
    let bounds = triangles.iter().fold(Aabb::EMPTY, |all, one| all.union(&one.bounds()));
    let scene = Scene {
        source: SceneSource::default_builtin(),
        triangles,
        bounds,
        up: Vec3::Y,
        attributes: None,
        material_indices: Vec::new(),
        materials: vec![Material::clay()],
        textures: Vec::new(),
        mesh_count: 1,
        warnings: Warnings::default(),
    };
    let settings = BuildSettings { container: C::KIND, ..BuildSettings::default() };
    let mut accel = Accel::build(&Arc::new(scene), &settings, &CancelToken::new()).unwrap();
    // A tree of known shape in place of the builder's.
    accel.tree = tree;
    accel.report.stats = tree_stats(&accel.tree);
    Arc::new(accel)
}

/// `count` triangles in a row along x, each larger than the one before.
fn row(count: usize) -> Vec<Triangle> {
    (0..count)
        .map(|index| {
            let (x, size) = (index as f32 * 2.0, 0.2 + index as f32 * 0.05);
            let at = |dx: f32, dy: f32, dz: f32| Vec3::new(x + dx * size, dy * size, dz * size);
            Triangle { a: at(0.0, 0.0, 0.0), b: at(1.0, 0.0, 1.0), c: at(0.0, 1.0, 0.5) }
        })
        .collect()
}

/// One triangle whose box is the cube from -1 to 1.
fn cube_triangle() -> Vec<Triangle> {
    vec![Triangle { a: Vec3::splat(-1.0), b: Vec3::splat(1.0), c: Vec3::new(1.0, -1.0, 0.0) }]
}

fn table<C: Container>(triangles: Vec<Triangle>) -> Arc<NodeTable> {
    Arc::new(NodeTable::new(&accel::<C>(triangles)))
}

fn settings(first: u32, last: u32) -> OverlaySettings {
    OverlaySettings { depth: [first, last], ..OverlaySettings::default() }
}

#[test]
fn families_are_found_from_any_member() {
    let table = table::<Aabb>(row(13));
    assert_eq!((table.parent(0), table.sibling(0), table.depth(0)), (None, None, 0));
    assert_eq!((table.parent(25), table.sibling(25)), (None, None), "there are 25 nodes");
    for node in 1..25 {
        let parent = table.parent(node).unwrap();
        let mut children = table.children(parent).unwrap();
        assert!(children.contains(&node));
        children.sort_unstable_by_key(|&child| child == node);
        assert_eq!(children, [table.sibling(node).unwrap(), node]);
        assert_eq!(table.depth(node), table.depth(parent) + 1);
    }
}

#[test]
fn depths_beyond_the_tree_are_clamped() {
    let table = table::<Aabb>(row(8));
    let nothing = Selection::default();
    assert_eq!(table.shown(&settings(1, 2), &nothing).nodes, table.by_depth(7)[1..7]);
    assert_eq!(table.shown(&settings(2, 1), &nothing), table.shown(&settings(1, 2), &nothing));
    assert_eq!(table.shown(&settings(90, 99), &nothing).wanted, 8, "the deepest level");
    let parents = OverlaySettings { parents: true, ..settings(2, 2) };
    assert_eq!(table.shown(&parents, &nothing).nodes, table.by_depth(7)[0..7]);
}

#[test]
fn the_budget_takes_the_largest() {
    let table = table::<Aabb>(row(64));
    let nothing = Selection::default();
    let Shown { nodes: all, depths, .. } = table.shown(&settings(2, 5), &nothing);
    assert!(all.iter().zip(&depths).all(|(&node, &depth)| table.depth(node) == depth));
    let cut = table.shown(&OverlaySettings { budget: 10, ..settings(2, 5) }, &nothing);
    assert_eq!((cut.nodes.len(), cut.wanted), (10, all.len()));
    assert!(cut.nodes.iter().zip(&cut.depths).all(|(&node, &depth)| table.depth(node) == depth));
    assert!(cut.nodes.is_sorted_by(|&a, &b| table.area_share(a) >= table.area_share(b)));
    let smallest = table.area_share(*cut.nodes.last().unwrap());
    for node in all.into_iter().filter(|node| !cut.nodes.contains(node)) {
        assert!(table.area_share(node) <= smallest);
    }
    let none = table.shown(&OverlaySettings { budget: 0, ..settings(2, 5) }, &nothing);
    assert_eq!((none.nodes.len(), none.wanted), (0, 60));
}

/// Over every range of depths, with every filter, cut by budgets of all sizes: as from a sorted list of all nodes.
#[test]
fn what_is_shown_is_what_a_sorted_list_gives() {
    let source = SceneSource::parse("builtin:terrain:700".as_ref()).unwrap();
    let scene = Arc::new(load(&source, &LoadOptions::default(), &CancelToken::new()).unwrap());
    let accel = Accel::build(&scene, &BuildSettings::default(), &CancelToken::new()).unwrap();
    let table = NodeTable::new(&Arc::new(accel));
    let area = |node: u32| table.node_box(node).relative_area();
    let deepest = table.max_depth();
    assert!(deepest > 8 && table.len() > 1_000);
    let some_hidden = Selection { hidden: (0..table.len() as u32).step_by(7).collect(), ..Selection::default() };
    let mut cuts = 0;
    for [first, last] in [[0, deepest], [0, 3], [5, 7], [deepest - 2, deepest], [6, 6]] {
        for [leaves_only, parents] in [[false, false], [true, false], [false, true], [true, true]] {
            for selection in [&Selection::default(), &some_hidden] {
                let from = if parents { 0 } else { first };
                let kept = |&node: &u32| {
                    let depth = table.depth(node);
                    (from..=last).contains(&depth)
                        && (!leaves_only || depth < first || table.is_leaf(node))
                        && !selection.hidden.contains(&node)
                };
                let mut sorted: Vec<u32> = (0..table.len() as u32).filter(kept).collect();
                sorted.sort_by(|&a, &b| area(b).total_cmp(&area(a)));
                for budget in [0, 1, 10, 60, 4_000] {
                    let settings =
                        OverlaySettings { depth: [first, last], leaves_only, parents, budget, ..settings(0, 0) };
                    let shown = table.shown(&settings, selection);
                    let drawn = sorted.len().min(budget as usize);
                    assert_eq!(shown.wanted, sorted.len(), "{settings:?}");
                    assert_eq!(table.count(&settings, selection), (drawn, sorted.len()), "{settings:?}");
                    assert!(shown.nodes.iter().zip(&shown.depths).all(|(&node, &depth)| table.depth(node) == depth));
                    if sorted.len() > drawn {
                        // Of nodes with the same area any may be cut.
                        let areas = |nodes: &[u32]| nodes.iter().map(|&node| area(node)).collect::<Vec<_>>();
                        assert_eq!(areas(&shown.nodes), areas(&sorted[..drawn]), "{settings:?}");
                        assert!(shown.nodes.iter().all(kept), "{settings:?}");
                        cuts += 1;
                    }
                    let mut nodes = shown.nodes;
                    nodes.sort_unstable();
                    nodes.dedup();
                    assert_eq!(nodes.len(), drawn, "{settings:?}");
                }
            }
        }
    }
    assert!(cuts > 50, "the budget cut only {cuts} times");
}

#[test]
fn leaves_and_hidden_nodes_are_told_apart() {
    let table = table::<Aabb>(row(13));
    let leaves = OverlaySettings { leaves_only: true, ..settings(0, 99) };
    let shown = table.shown(&leaves, &Selection::default());
    assert_eq!(shown.wanted, 13);
    assert!(shown.nodes.iter().all(|&node| table.is_leaf(node)));

    let hidden = Selection { hidden: [0, 2].into(), ..Selection::default() };
    let shown = table.shown(&settings(0, 99), &hidden);
    assert_eq!(shown.wanted, 23, "only the hidden ones themselves are missing");
    assert!(!shown.nodes.contains(&0) && !shown.nodes.contains(&2));
}

#[test]
fn an_empty_tree_shows_nothing() {
    let mut empty = Arc::into_inner(accel::<Aabb>(row(1))).unwrap();
    empty.tree = Aabb::into_any(Tree { nodes: Vec::new(), primitive_indices: Vec::new(), max_depth: 0 });
    empty.report.stats = tree_stats(&empty.tree);
    let table = NodeTable::new(&Arc::new(empty));
    assert!(table.is_empty());
    assert_eq!(table.max_depth(), 0);
    assert_eq!(table.shown(&settings(0, 9), &Selection::default()).wanted, 0);
    for color_by in ColorBy::ALL {
        assert!(!legend(&OverlaySettings { color_by, ..settings(0, 9) }, &table).stops.is_empty());
    }
}

#[test]
fn the_other_container_holds_the_same_triangles() {
    let triangles = row(9);
    let of_boxes = table::<Aabb>(triangles.clone());
    let of_spheres = table::<Sphere>(triangles.clone());
    assert_eq!(of_boxes.container_kind(), ContainerKind::Aabb);
    assert_eq!(of_spheres.container_kind(), ContainerKind::Sphere);
    // Both trees have the same shape, so a node's exact box is the same in both.
    for node in 0..of_boxes.len() as u32 {
        assert_eq!(of_boxes.node_box(node), of_spheres.node_box(node));
        let own = of_spheres.node_sphere(node);
        let other = of_boxes.node_sphere(node);
        for triangle in &triangles {
            for corner in [triangle.a, triangle.b, triangle.c] {
                let below = of_boxes.node_box(node).contains_point(corner, 0.0);
                assert!(!below || other.contains_point(corner, 1e-4) && own.contains_point(corner, 1e-4));
            }
        }
    }
}

#[test]
fn an_instance_says_what_its_node_is() {
    let table = table::<Aabb>(row(8));
    let by_primitives = OverlaySettings { color_by: ColorBy::Primitives, show_spheres: true, ..settings(0, 9) };
    let root = table.instance(0, 0, &by_primitives);
    assert_eq!((root.depth, root.primitives, root.flags, root.area_share, root.overlap), (0, 8, 0, 1.0, 0.0));
    assert!(root.sphere_radius > 7.0);
    let leaf = table.instance(*table.by_depth(table.len() as u32).last().unwrap(), 3, &by_primitives);
    assert_eq!((leaf.depth, leaf.primitives, leaf.flags), (3, 1, 1));
    assert!(leaf.area_share > 0.0 && leaf.area_share < 0.1);
    let [left, right] = table.children(0).unwrap();
    assert_eq!(table.overlap(left), 0.0, "a row along x overlaps nowhere");
    assert_eq!(table.primitives(left) + table.primitives(right), 8);
}

#[test]
fn those_that_stand_out_are_the_family_and_the_hovered_one() {
    let table = table::<Aabb>(row(4));
    let [first, second] = table.children(0).unwrap();
    let marked = |selected, hovered| highlighted(&table, &Selection { selected, hovered, ..Selection::default() });
    let family = vec![(first, Role::FirstChild), (second, Role::SecondChild), (0, Role::Selected)];
    assert_eq!(marked(Some(0), Some(0)), family);
    assert_eq!(marked(Some(999), Some(second)), [(second, Role::Hovered)]);
    assert!(marked(None, None).is_empty());
}

#[test]
fn legends_ascend_within_the_ramp() {
    let table = table::<Aabb>(row(200));
    for color_by in ColorBy::ALL {
        for depth in [[0, 0], [4, 6], [0, 99]] {
            let legend = legend(&OverlaySettings { color_by, depth, ..OverlaySettings::default() }, &table);
            assert!(legend.stops.len() <= 8 && !legend.title.is_empty());
            assert!(legend.stops.is_sorted_by(|a, b| a.0 < b.0), "{:?}", legend.stops);
            assert!(legend.stops.iter().all(|(place, _)| (0.0..=1.0).contains(place)));
            assert!(legend.color(1.0)[0] > legend.color(0.0)[0]);
        }
    }
}

/// Of the colour that the legend gives to the first depth.
fn brightest_channel(settings: &OverlaySettings, table: &NodeTable) -> u8 {
    let legend = legend(settings, table);
    legend.color(legend.stops[0].0).into_iter().max().unwrap()
}

/// A picture of one colour and one depth.
struct Flat {
    size: [u32; 2],
    rgba: Vec<[u8; 4]>,
    depth: Vec<f32>,
}

impl Flat {
    fn new(size: [u32; 2], color: [u8; 4], depth: f32) -> Self {
        let count = (size[0] * size[1]) as usize;
        Self { size, rgba: vec![color; count], depth: vec![depth; count] }
    }

    fn input(&self) -> PictureInput<'_> {
        PictureInput { id: 1, width_px: self.size[0], height_px: self.size[1], rgba: &self.rgba, depth: &self.depth }
    }
}

/// Looks along -z at the origin.
fn camera(distance: f32, projection: Projection) -> Camera {
    Camera { eye: Vec3::Z * distance, target: Vec3::ZERO, up: Vec3::Y, fov_y: 0.8, projection }
}

/// Needs a driver, a software one at least.
fn draw(
    picture: &Flat,
    camera: Camera,
    table: Option<&Arc<NodeTable>>,
    settings: OverlaySettings,
    selection: &Selection,
) -> Vec<[u8; 4]> {
    let input = DrawInput {
        picture: picture.input(),
        camera,
        table,
        settings,
        selection,
        show_picture: true,
        viewport_px: [0, 0, picture.size[0], picture.size[1]],
        pixels_per_point: 1.0,
    };
    let drawn = draw_offscreen(&input).unwrap();
    if let Ok(folder) = std::env::var("BVHSCOPE_KEEP_PICTURES") {
        let name = std::thread::current().name().unwrap_or("drawn").to_owned();
        let bytes: Vec<u8> = drawn.iter().flatten().copied().collect();
        let image = image::RgbaImage::from_raw(picture.size[0], picture.size[1], bytes).unwrap();
        image.save(format!("{folder}/{name}.png")).unwrap();
    }
    drawn
}

/// Colour added to black in column `x`: the profile of what crosses it.
fn column(pixels: &[[u8; 4]], size: [u32; 2], x: u32) -> Vec<u8> {
    (0..size[1]).map(|y| pixels[(y * size[0] + x) as usize]).map(|[r, g, b, _]| r.max(g).max(b)).collect()
}

#[test]
fn a_picture_alone_comes_out_unchanged() {
    // 93 pixels a row are no multiple of 256 bytes.
    let size = [93, 41];
    let mut picture = Flat::new(size, [0; 4], FAR);
    for (index, pixel) in picture.rgba.iter_mut().enumerate() {
        *pixel = [index as u8, (index / 7) as u8, (index / 93 * 5) as u8, 255];
    }
    let nothing = Selection::default();
    let drawn = draw(&picture, camera(5.0, Projection::Perspective), None, settings(0, 9), &nothing);
    assert!(drawn == picture.rgba);
}

#[test]
fn hidden_lines_are_faint() {
    let size = [200, 200];
    let table = table::<Aabb>(cube_triangle());
    let nothing = Selection::default();
    for projection in [Projection::Perspective, Projection::Orthographic] {
        let brightest = |depth: f32, hidden_alpha: f32| {
            let picture = Flat::new(size, [0, 0, 0, 255], depth);
            let settings = OverlaySettings { hidden_alpha, line_width: 2.0, ..settings(0, 0) };
            let drawn = draw(&picture, camera(5.0, projection), Some(&table), settings, &nothing);
            column(&drawn, size, 100).into_iter().max().unwrap()
        };
        let visible = brightest(FAR, 0.15);
        let expected = brightest_channel(&settings(0, 0), &table);
        assert!(visible.abs_diff(expected) <= 1, "{visible} in place of {expected}");
        // The cube reaches from depth 4 to 6.
        assert_eq!(brightest(3.0, 0.0), 0);
        let faint = brightest(3.0, 0.2);
        let expected = f32::from(expected) * 0.2;
        // In orthographic views the back edge lies under the front edge: 1 - 0.8² = 0.36.
        let layers = if projection == Projection::Perspective { 1.0 } else { 1.8 };
        assert!((f32::from(faint) - expected * layers).abs() < 2.0, "{faint} in place of {}", expected * layers);
        let half = brightest(5.0, 0.0);
        assert!(half.abs_diff(visible) <= 1, "the front of the cube stands before the surface");
        assert!(brightest(4.0, 0.0).abs_diff(visible) <= 1, "touching is not hidden");
    }
}

#[test]
fn lines_keep_their_width_under_zoom() {
    let size = [300, 300];
    let picture = Flat::new(size, [0, 0, 0, 255], FAR);
    let table = table::<Aabb>(cube_triangle());
    let nothing = Selection::default();
    for line_width in [1.0, 3.0] {
        for distance in [3.5, 6.0, 12.0] {
            let settings = OverlaySettings { line_width, ..settings(0, 0) };
            let camera = camera(distance, Projection::Perspective);
            let drawn = draw(&picture, camera, Some(&table), settings, &nothing);
            let profile = column(&drawn, size, 150);
            let full = f32::from(brightest_channel(&settings, &table));
            // Front and back, top and bottom: four lines cross the middle.
            let width = profile.iter().map(|value| f32::from(*value) / full).sum::<f32>() / 4.0;
            assert!((width - line_width).abs() < 0.1, "{width} px in place of {line_width} at distance {distance}");
        }
    }
}

#[test]
fn the_outline_of_a_sphere_encloses_it() {
    let size = [400, 400];
    let picture = Flat::new(size, [0, 0, 0, 255], FAR);
    let table = table::<Sphere>(cube_triangle());
    let radius = table.node_sphere(0).radius;
    let center = table.node_sphere(0).center;
    let nothing = Selection::default();
    let settings = OverlaySettings { show_boxes: false, show_spheres: true, line_width: 1.0, ..settings(0, 0) };
    for projection in [Projection::Perspective, Projection::Orthographic] {
        let mut camera = camera(6.0, projection);
        camera.eye += center;
        camera.target += center;
        let drawn = draw(&picture, camera, Some(&table), settings, &nothing);
        let reach = match projection {
            // The angle of the tangent, not of the great circle.
            Projection::Perspective => (radius / 6.0).asin().tan() / 0.4_f32.tan() * 200.0,
            Projection::Orthographic => radius / (6.0 * 0.4_f32.tan()) * 200.0,
        };
        let lit = drawn.iter().enumerate().filter(|(_, pixel)| pixel[0].max(pixel[1]).max(pixel[2]) > 40);
        let distance = |index: usize| {
            let (x, y) = ((index % 400) as f32 + 0.5 - 200.0, (index / 400) as f32 + 0.5 - 200.0);
            x.hypot(y)
        };
        let farthest = lit.map(|(index, _)| distance(index)).fold(0.0, f32::max);
        assert!((farthest - reach).abs() < 1.5, "{farthest} px in place of {reach}");
        // And all the way around.
        for step in 0..360 {
            let (sin, cos) = (step as f32).to_radians().sin_cos();
            let on = [-1.0, 0.0, 1.0].into_iter().any(|off| {
                let (x, y) = (200.0 + cos * (reach + off), 200.0 + sin * (reach + off));
                let [r, g, b, _] = drawn[y as usize * 400 + x as usize];
                r.max(g).max(b) > 40
            });
            assert!(on, "a gap at {step}°");
        }
    }
}

#[test]
fn a_selected_node_is_drawn_though_nothing_else_is() {
    let size = [200, 200];
    let picture = Flat::new(size, [0, 0, 0, 255], FAR);
    let table = table::<Aabb>(cube_triangle());
    let selection = Selection { selected: Some(0), hidden: [0].into(), ..Selection::default() };
    let none = OverlaySettings { show_boxes: false, show_spheres: false, ..settings(0, 0) };
    let camera = camera(5.0, Projection::Perspective);
    let drawn = draw(&picture, camera, Some(&table), none, &selection);
    let warm = drawn.iter().filter(|[r, g, b, _]| *r == 255 && g.abs_diff(180) < 3 && b.abs_diff(84) < 3).count();
    assert!(warm > 500, "{warm} warm pixels");
    let drawn = draw(&picture, camera, Some(&table), none, &Selection::default());
    assert!(drawn == picture.rgba);
}

#[test]
fn an_observer_inside_sees_lines_without_streaks() {
    let size = [320, 200];
    let picture = Flat::new(size, [0, 0, 0, 255], FAR);
    let table = table::<Sphere>(row(40));
    let settings = OverlaySettings { show_boxes: true, show_spheres: true, ..settings(0, 9) };
    let inside = Camera {
        eye: Vec3::new(20.0, 0.5, 0.3),
        target: Vec3::new(60.0, 0.4, 0.2),
        ..camera(1.0, Projection::Perspective)
    };
    let drawn = draw(&picture, inside, Some(&table), settings, &Selection::default());
    let lit = drawn.iter().filter(|pixel| pixel[1] > 40).count();
    assert!(lit > 1_000 && lit < drawn.len() / 2, "{lit} of {} pixels", drawn.len());
}

#[test]
fn a_picture_beyond_the_driver_is_an_error() {
    let picture = Flat { size: [4_000_000, 1], rgba: Vec::new(), depth: Vec::new() };
    let nothing = Selection::default();
    let input = DrawInput {
        picture: picture.input(),
        camera: camera(5.0, Projection::Perspective),
        table: None,
        settings: settings(0, 0),
        selection: &nothing,
        show_picture: true,
        viewport_px: [0, 0, 1, 1],
        pixels_per_point: 1.0,
    };
    match draw_offscreen(&input) {
        Err(OffscreenError::NoAdapter(what)) => assert!(what.contains("mesa-vulkan-drivers")),
        Err(OffscreenError::Device(what)) => assert!(what.contains("4000000×1"), "{what}"),
        Ok(_) => panic!("no driver has textures of four million pixels"),
    }
}
