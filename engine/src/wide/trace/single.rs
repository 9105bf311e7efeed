//! Traversal of a single ray.

use fearless_simd::Simd;

use crate::geometry::{Hit, PreparedRay, Ray, Shear};
use crate::tree::traverse::{Nearest, Probe};
use crate::wide::block::{BlockRay, TriangleBlock};
use crate::wide::bounds::{NodeBounds, WideContainer};
use crate::wide::layout::WIDTH;
use crate::wide::ray_lanes::RayLanes;
use crate::wide::trace::stack::Stack;
use crate::wide::tree::{Child, WideNode, WideTree};

/// The closest hit of `ray`: exactly that of the binary tree. `probe` is told of each node whose children are tested as one
/// container test and of each block as one primitive test, and of the events of [`Probe`].
#[inline(always)]
pub fn closest_hit<S: Simd, B: NodeBounds, P: Probe>(
    simd: S,
    tree: &WideTree<B>,
    ray: &Ray,
    probe: &mut P,
) -> Option<Hit> {
    nearest::<S, B, P, false>(simd, tree, ray, probe).hit()
}

/// Whether anything lies on `ray` between its `t_min` and `t_max`.
#[inline(always)]
pub fn any_hit<S: Simd, B: NodeBounds, P: Probe>(simd: S, tree: &WideTree<B>, ray: &Ray, probe: &mut P) -> bool {
    nearest::<S, B, P, true>(simd, tree, ray, probe).found()
}

/// The closest hit; with `ANY` the first one found.
#[inline(always)]
pub(crate) fn nearest<S: Simd, B: NodeBounds, P: Probe, const ANY: bool>(
    simd: S,
    tree: &WideTree<B>,
    ray: &Ray,
    probe: &mut P,
) -> Nearest {
    let mut nearest = Nearest::new(ray.t_max);
    let Some(mut current) = tree.root else { return nearest };
    let Some(lanes) = RayLanes::single(ray) else { return nearest };
    let container_ray = B::Container::prepare(simd, &lanes, 0);
    let block_ray = BlockRay::new(simd, &lanes, 0);
    let mut stack = Stack::new();
    loop {
        probe.visited(current.bits());
        if current.is_leaf() {
            for block in tree.leaves.blocks(current) {
                probe.primitive_test();
                if P::EVENTS {
                    report_block(block, ray, nearest, probe);
                }
                if !ANY {
                    block_ray.closest_hit(simd, block, ray, &mut nearest);
                } else if block_ray.any_hit(simd, block, ray, nearest.t()) {
                    return Nearest::ANYTHING;
                }
            }
        } else {
            probe.container_test();
            let node = &tree.nodes[current.index()];
            let mut space = B::Container::EMPTY_BOUNDS;
            let bounds = node.bounds.unpack(simd, &mut space);
            let (mut hits, entries) = B::Container::intersect_mask(simd, bounds, &container_ray, nearest.t());
            if P::EVENTS {
                let (in_all, entries) =
                    B::Container::intersect_mask(simd, bounds, &container_ray, Nearest::new(ray.t_max).t());
                report_children(node, hits, in_all, &entries, probe);
            }
            if hits != 0 {
                let mark = stack.reserve();
                // Branches for one, two and more children: the processor predicts which comes next and starts to load it.
                let first = take_lane(&mut hits);
                if hits == 0 {
                    current = node.children[first];
                    continue;
                }
                let waiting = |lane: usize| Waiting::new(entries[lane], node.children[lane]);
                let (first, second) = (waiting(first), waiting(take_lane(&mut hits)));
                let (mut next, mut other) = if (first < second) == ANY { (second, first) } else { (first, second) };
                tree.prefetch_any(other.child());
                stack.push(other);
                while hits != 0 {
                    other = waiting(take_lane(&mut hits));
                    // For any hit, visit the farthest child first: what a ray starts from rarely blocks it.
                    if (other < next) != ANY {
                        std::mem::swap(&mut other, &mut next);
                    }
                    tree.prefetch_any(other.child());
                    stack.push(other);
                    if !ANY {
                        stack.sort_last(mark, |a, b| a < b);
                    }
                }
                if P::EVENTS {
                    stack.since(mark).iter().for_each(|waiting| probe.pushed(waiting.child().bits()));
                }
                current = next.child();
                continue;
            }
        }
        current = loop {
            let Some(waiting) = stack.pop() else { return nearest };
            let (child, entry) = (waiting.child(), waiting.entry());
            if P::EVENTS {
                probe.popped(child.bits());
            }
            if ANY || entry <= nearest.t() {
                break child;
            }
            if P::EVENTS {
                probe.culled(child.bits(), entry);
            }
        };
    }
}

/// A child to visit and its distance of entry, which is not negative, in one number: nearer ones are smaller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Waiting(u64);

impl Waiting {
    #[inline(always)]
    fn new(entry: f32, child: Child) -> Self {
        Self(u64::from(entry.to_bits()) << 32 | u64::from(child.bits()))
    }

    #[inline(always)]
    fn entry(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }

    #[inline(always)]
    fn child(self) -> Child {
        Child(self.0 as u32)
    }
}

/// Removes the lowest lane from `lanes`.
#[inline(always)]
fn take_lane(lanes: &mut u32) -> usize {
    let lane = lanes.trailing_zeros() as usize % WIDTH;
    *lanes &= *lanes - 1;
    lane
}

/// Reports the tests of the children of `node`: `hits` are the lanes entered before the nearest hit, `in_all` those entered
/// anywhere on the ray, at `entries`.
#[cold]
fn report_children<B, P: Probe>(node: &WideNode<B>, hits: u32, in_all: u32, entries: &[f32; WIDTH], probe: &mut P) {
    // Unused lanes come last and refer to the root, which is nobody's child.
    let used = node.children.iter().take_while(|child| **child != Child::ROOT);
    for (lane, child) in used.enumerate() {
        if in_all >> lane & 1 == 0 {
            probe.missed(child.bits());
            continue;
        }
        probe.entered(child.bits(), entries[lane]);
        if hits >> lane & 1 == 0 {
            probe.culled(child.bits(), entries[lane]);
        }
    }
}

/// Reports the test of `block`, one triangle at a time: that has the same results. `nearest` is the nearest hit before the test.
#[cold]
fn report_block<P: Probe>(block: TriangleBlock<'_>, ray: &Ray, mut nearest: Nearest, probe: &mut P) {
    let t_max = nearest.t();
    let (prepared, shear) = (PreparedRay::new(*ray), Shear::new(ray.direction));
    let mut is_nearer = false;
    for lane in 0..block.count() {
        let hit = block.triangle(lane).intersect(&prepared, &shear, t_max);
        probe.tested(block.primitive_index(lane), hit.map(|hit| hit.t));
        is_nearer |= hit.is_some_and(|hit| nearest.offer(hit, block.primitive_index(lane)));
    }
    if is_nearer {
        probe.nearer(nearest.t());
    }
}
