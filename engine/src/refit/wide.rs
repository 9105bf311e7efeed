//! Refitting of the wide tree: its blocks get the moved triangles, its lanes the containers of the binary nodes that they stand for.

use crate::cancel::{CancelToken, Cancelled, HEAVY_STEPS};
use crate::geometry::Triangle;
use crate::kernel::parallel::par_tasks;
use crate::tree::ancestry::Ancestry;
use crate::tree::{AnyTree, Tree};
use crate::wide::{AnyWideTree, Child, CompactBounds, LeafRange, Sources, WideContainer, WideNode, WideTree};

/// Nodes that one task fits.
const NODES_PER_TASK: usize = 1 << 10;
/// Leaves that one task writes.
const LEAVES_PER_TASK: usize = 1 << 10;
/// Lanes of a node.
const WIDTH: usize = crate::wide::layout::WIDTH;
/// Stands for an unused lane.
const UNUSED: u32 = u32::MAX;

/// Which binary node each lane of a wide tree stands for: made once for a tree, and used each time that its triangles have moved.
///
/// ```
/// use bvhscope_engine::builders::build_binary;
/// use bvhscope_engine::glam::Vec3;
/// use bvhscope_engine::refit::{WideRefit, refit};
/// use bvhscope_engine::{BuildSettings, CancelToken, Ray, Triangle, WideBvh};
///
/// let at = |z: f32| vec![Triangle { a: Vec3::Z * z, b: Vec3::X + Vec3::Z * z, c: Vec3::Y + Vec3::Z * z }; 20];
/// let token = CancelToken::new();
/// let (mut tree, _) = build_binary(&at(0.0), &BuildSettings::default(), &token)?;
/// let mut wide = WideBvh::new(&tree, &at(0.0), &token)?;
/// let lanes = WideRefit::new(&wide.tree, &tree, &token)?;
/// for z in [1.0, 2.0] {
///     refit(&mut tree, &at(z), &token)?;
///     lanes.apply(&mut wide.tree, &tree, &at(z), &token)?;
///     let hit = wide.closest_hit(&Ray::new(Vec3::new(0.2, 0.2, 5.0), Vec3::NEG_Z));
///     assert_eq!(hit.map(|hit| hit.t), Some(5.0 - z));
/// }
/// # Ok::<(), bvhscope_engine::BuildError>(())
/// ```
#[derive(Debug, Clone)]
pub struct WideRefit {
    /// For each lane of the full nodes, and of the compact ones, the index of the binary node.
    lanes: [Vec<[u32; WIDTH]>; 2],
    /// All leaves, in the order of their triangles.
    leaves: Vec<LeafRange>,
}

impl WideRefit {
    /// The lanes of `wide`, which was made from the binary tree `binary`.
    ///
    /// # Panics
    ///
    /// Where it was made from another tree, or from one that is not binary.
    pub fn new(wide: &AnyWideTree, binary: &AnyTree, token: &CancelToken) -> Result<Self, Cancelled> {
        match (wide, binary) {
            (AnyWideTree::Aabb(wide), AnyTree::Aabb(binary)) => Self::of(wide, binary, token),
            (AnyWideTree::Sphere(wide), AnyTree::Sphere(binary)) => Self::of(wide, binary, token),
            (AnyWideTree::Dop14(wide), AnyTree::Dop14(binary)) => Self::of(wide, binary, token),
            (AnyWideTree::Oriented(wide), AnyTree::Oriented(binary)) => Self::of(wide, binary, token),
            _ => panic!("the trees have different containers"),
        }
    }

    fn of<C: WideContainer>(wide: &WideTree<C>, binary: &Tree<C>, token: &CancelToken) -> Result<Self, Cancelled> {
        assert!(binary.is_binary(token)?, "a wide tree is refitted with the binary one that it was made from");
        let Some(root) = wide.root else { return Ok(Self { lanes: [Vec::new(), Vec::new()], leaves: Vec::new() }) };
        let firsts = FirstSlots::new(wide, root, token)?;
        let counts = Ancestry::new(binary, token)?.primitive_counts;
        let mut lanes = [wide.nodes.len(), wide.compact_nodes.len()].map(|count| vec![[UNUSED; WIDTH]; count]);
        let mut leaves = Vec::new();
        // Wide nodes, and the binary ones that they replace.
        let (mut open, mut done) = (vec![(root, 0_u32)], 0_usize);
        while let Some((child, node)) = open.pop() {
            done += 1;
            token.check_every(HEAVY_STEPS, done)?;
            if child.is_leaf() {
                leaves.push(wide.leaves.range(child));
                continue;
            }
            let children: Vec<Child> = wide.children_of(child).collect();
            let below = nodes_of_lanes(
                binary,
                node,
                &children.iter().map(|&child| firsts.of(wide, child)).collect::<Vec<_>>(),
                &counts,
            );
            lanes[usize::from(child.is_compact())][child.index()][..below.len()].copy_from_slice(&below);
            open.extend(children.into_iter().zip(below));
        }
        leaves.sort_unstable_by_key(|leaf: &LeafRange| leaf.first);
        Ok(Self { lanes, leaves })
    }

    /// Fits `wide` to its triangles, in the calling thread's rayon pool. `binary` is the tree that it was made from, fitted to the same
    /// triangles. The same for any number of threads.
    ///
    /// # Panics
    ///
    /// Where these are other trees than those of [`WideRefit::new`], or `triangles` a shorter list.
    pub fn apply(
        &self,
        wide: &mut AnyWideTree,
        binary: &AnyTree,
        triangles: &[Triangle],
        token: &CancelToken,
    ) -> Result<(), Cancelled> {
        token.begin_stage("wide refit");
        match (wide, binary) {
            (AnyWideTree::Aabb(wide), AnyTree::Aabb(binary)) => self.fit(wide, binary, triangles, token),
            (AnyWideTree::Sphere(wide), AnyTree::Sphere(binary)) => self.fit(wide, binary, triangles, token),
            (AnyWideTree::Dop14(wide), AnyTree::Dop14(binary)) => self.fit(wide, binary, triangles, token),
            (AnyWideTree::Oriented(wide), AnyTree::Oriented(binary)) => self.fit(wide, binary, triangles, token),
            _ => panic!("the trees have different containers"),
        }
    }

    fn fit<C: WideContainer>(
        &self,
        wide: &mut WideTree<C>,
        binary: &Tree<C>,
        triangles: &[Triangle],
        token: &CancelToken,
    ) -> Result<(), Cancelled> {
        self.write_leaves(
            &mut wide.leaves.values,
            Sources { triangles, primitive_indices: &binary.primitive_indices },
            token,
        )?;
        let [full, compact] = &self.lanes;
        fit_nodes(&mut wide.nodes, full, token, |bounds, nodes| {
            for (lane, node) in used(nodes) {
                binary.nodes[node].container.store(bounds, lane);
            }
        })?;
        fit_nodes(&mut wide.compact_nodes, compact, token, |bounds, nodes| {
            let mut exact = C::EMPTY_BOUNDS;
            for (lane, node) in used(nodes) {
                binary.nodes[node].container.store(&mut exact, lane);
            }
            *bounds = C::Compact::pack(&exact, used(nodes).count());
        })
    }

    /// Writes the triangles of all leaves to `values`, where they lie one after another.
    fn write_leaves(&self, mut values: &mut [f32], sources: Sources<'_>, token: &CancelToken) -> Result<(), Cancelled> {
        let mut parts = Vec::with_capacity(self.leaves.len() / LEAVES_PER_TASK + 1);
        for leaves in self.leaves.chunks(LEAVES_PER_TASK) {
            let count: u32 = leaves.iter().map(|leaf| leaf.count).sum();
            let own;
            (own, values) = values.split_at_mut(crate::wide::layout::VALUES * count as usize);
            parts.push((leaves, own));
        }
        par_tasks(parts, token, |(leaves, part), token| sources.write(leaves, leaves[0].first, part, token)).map(drop)
    }
}

/// Slot of the first triangle below each node of a wide tree.
struct FirstSlots([Vec<u32>; 2]);

impl FirstSlots {
    fn new<C: WideContainer>(wide: &WideTree<C>, root: Child, token: &CancelToken) -> Result<Self, Cancelled> {
        // Parents before their children.
        let mut nodes = if root.is_leaf() { Vec::new() } else { vec![root] };
        let mut next = 0;
        while let Some(&node) = nodes.get(next) {
            token.check_every(HEAVY_STEPS, next)?;
            nodes.extend(wide.children_of(node).filter(|child| !child.is_leaf()));
            next += 1;
        }
        let mut firsts = Self([vec![UNUSED; wide.nodes.len()], vec![UNUSED; wide.compact_nodes.len()]]);
        for &node in nodes.iter().rev() {
            let first = wide.children_of(node).map(|child| firsts.of(wide, child)).min();
            firsts.0[usize::from(node.is_compact())][node.index()] = first.unwrap_or(UNUSED);
        }
        Ok(firsts)
    }

    fn of<C: WideContainer>(&self, wide: &WideTree<C>, child: Child) -> u32 {
        if child.is_leaf() {
            wide.leaves.range(child).first
        } else {
            self.0[usize::from(child.is_compact())][child.index()]
        }
    }
}

/// The binary nodes that the lanes of a wide node stand for: those below `node`, which it replaces, whose triangles begin at the slots
/// `firsts`, as high up as no two lanes meet in one. `counts` are the triangles below each binary node.
fn nodes_of_lanes<C: WideContainer>(binary: &Tree<C>, node: u32, firsts: &[u32], counts: &[u32]) -> Vec<u32> {
    let mut found = vec![UNUSED; firsts.len()];
    let mut open = vec![node];
    while let Some(node) = open.pop() {
        let mut leftmost = &binary.nodes[node as usize];
        while !leftmost.is_leaf() {
            leftmost = &binary.nodes[leftmost.first as usize];
        }
        let slots = leftmost.first..leftmost.first + counts[node as usize];
        let mut within = (0..firsts.len()).filter(|&lane| slots.contains(&firsts[lane]));
        match (within.next(), within.next()) {
            (Some(lane), None) => found[lane] = node,
            (Some(_), Some(_)) => open.extend(binary.nodes[node as usize].children()),
            (None, _) => panic!("the wide tree was made from another one"),
        }
    }
    found
}

/// The lanes in use and their binary nodes.
fn used(nodes: &[u32; WIDTH]) -> impl Iterator<Item = (usize, usize)> {
    nodes.iter().take_while(|&&node| node != UNUSED).map(|&node| node as usize).enumerate()
}

/// Calls `fit` for the containers of all nodes and the binary nodes of their lanes.
fn fit_nodes<B: Send>(
    nodes: &mut [WideNode<B>],
    lanes: &[[u32; WIDTH]],
    token: &CancelToken,
    fit: impl Fn(&mut B, &[u32; WIDTH]) + Sync,
) -> Result<(), Cancelled> {
    assert_eq!(nodes.len(), lanes.len(), "the lanes are those of another tree");
    par_tasks(nodes.chunks_mut(NODES_PER_TASK).zip(lanes.chunks(NODES_PER_TASK)), token, |(nodes, lanes), _| {
        nodes.iter_mut().zip(lanes).for_each(|(node, lanes)| fit(&mut node.bounds, lanes));
        Ok(())
    })
    .map(drop)
}
