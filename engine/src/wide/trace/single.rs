//! Traversal of a single ray.

use std::hint::black_box;
use std::ops::ControlFlow;

use fearless_simd::Simd;

use crate::geometry::{Hit, PreparedRay, Ray, Shear};
use crate::tree::ContainerKind;
use crate::tree::traverse::{Nearest, Probe};
use crate::wide::block::{BlockRay, TriangleBlock};
use crate::wide::bounds::WideContainer;
use crate::wide::box_lanes::LaneTest;
use crate::wide::child::Child;
use crate::wide::layout::WIDTH;
use crate::wide::ray_lanes::{RayLanes, TriangleLanes};
use crate::wide::trace::stack::Stack;
use crate::wide::tree::{Addresses, WideTree};

/// The closest hit of `ray`: exactly that of the binary tree. `probe` is called for each node whose children are tested as one
/// container test and of each block as one primitive test, and of the events of [`Probe`].
#[inline(always)]
pub fn closest_hit<S: Simd, C: WideContainer, P: Probe>(
    simd: S,
    tree: &WideTree<C>,
    ray: &Ray,
    probe: &mut P,
) -> Option<Hit> {
    nearest_by_level::<S, C, P, false>(simd, tree, ray, probe).hit()
}

/// Whether anything lies on `ray` between its `t_min` and `t_max`.
#[inline(always)]
pub fn any_hit<S: Simd, C: WideContainer, P: Probe>(simd: S, tree: &WideTree<C>, ray: &Ray, probe: &mut P) -> bool {
    nearest_by_level::<S, C, P, true>(simd, tree, ray, probe).found()
}

/// [`nearest`], in a function of its own also at the level that every machine has. It would else become part of the function
/// that chooses the level, and every ray would pay for its large stack frame.
#[inline(always)]
fn nearest_by_level<S: Simd, C: WideContainer, P: Probe, const ANY: bool>(
    simd: S,
    tree: &WideTree<C>,
    ray: &Ray,
    probe: &mut P,
) -> Nearest {
    #[inline(never)]
    fn outlined<S: Simd, C: WideContainer, P: Probe, const ANY: bool>(
        simd: S,
        tree: &WideTree<C>,
        ray: &Ray,
        probe: &mut P,
    ) -> Nearest {
        simd.vectorize(
            #[inline(always)]
            || nearest::<S, C, P, ANY>(simd, tree, ray, probe),
        )
    }
    // By the width, a constant, because the compiler would make `outlined` for the levels that never call it, too.
    if const { size_of::<S::f32s>() <= 16 } {
        outlined::<S, C, P, ANY>(simd, tree, ray, probe)
    } else {
        nearest::<S, C, P, ANY>(simd, tree, ray, probe)
    }
}

/// The closest hit; with `ANY` the first one found.
#[inline(always)]
pub(crate) fn nearest<S: Simd, C: WideContainer, P: Probe, const ANY: bool>(
    simd: S,
    tree: &WideTree<C>,
    ray: &Ray,
    probe: &mut P,
) -> Nearest {
    // Probes record the exact tests.
    if P::ACTIVE || C::KIND != ContainerKind::Aabb {
        return nearest_exactly::<S, C, P, ANY>(simd, tree, ray, probe);
    }
    if let Some(root) = tree.root
        && let Some((container_ray, lanes)) = C::prepare_fused(simd, ray)
    {
        // Read from memory, so that the compiler does not keep each number in all lanes of a vector, which it would have to store.
        let (container_ray, lanes) = black_box((&container_ray, &lanes));
        if let Some(nearest) = walk::<S, C, _, P, ANY>(simd, tree, root, ray, lanes, container_ray, probe) {
            return nearest;
        }
    }
    nearest_outlined::<S, C, P, ANY>(simd, tree, ray, probe)
}

/// [`nearest_exactly`] for the few rays that nothing shorter can decide. Apart, so that the loop for all others calls no
/// function: the compiler would keep in memory what it needs after the call.
#[cold]
#[inline(never)]
fn nearest_outlined<S: Simd, C: WideContainer, P: Probe, const ANY: bool>(
    simd: S,
    tree: &WideTree<C>,
    ray: &Ray,
    probe: &mut P,
) -> Nearest {
    simd.vectorize(
        #[inline(always)]
        || nearest_exactly::<S, C, P, ANY>(simd, tree, ray, probe),
    )
}

/// [`nearest`] by exact tests of containers.
#[inline(always)]
fn nearest_exactly<S: Simd, C: WideContainer, P: Probe, const ANY: bool>(
    simd: S,
    tree: &WideTree<C>,
    ray: &Ray,
    probe: &mut P,
) -> Nearest {
    let (Some(root), Some(lanes)) = (tree.root, RayLanes::single::<S, C>(simd, ray)) else {
        return Nearest::new(ray.t_max);
    };
    walk::<S, C, _, P, ANY>(simd, tree, root, ray, &lanes.triangles, &C::prepare(simd, &lanes, 0), probe)
        .unwrap_or_else(|| unreachable!("exact tests decide every ray"))
}

/// [`nearest`] from `root` on, for a ray that was prepared as `lanes` and `container_ray`. `None` where a test that is not exact
/// meets a triangle that takes double precision, or more nodes than the stack holds without heap allocation.
#[inline(always)]
fn walk<S: Simd, C: WideContainer, T: LaneTest<S, C::Bounds>, P: Probe, const ANY: bool>(
    simd: S,
    tree: &WideTree<C>,
    root: Child,
    ray: &Ray,
    lanes: &TriangleLanes<1>,
    container_ray: &T,
    probe: &mut P,
) -> Option<Nearest> {
    let mut nearest = Nearest::new(ray.t_max);
    let block_ray = BlockRay::new(lanes, 0);
    let addresses = tree.addresses();
    let mut current = root;
    let mut stack = Stack::new();
    loop {
        probe.visited(current.bits());
        if current.is_leaf() {
            let blocks = tree.leaves.blocks(current);
            if let ControlFlow::Break(end) =
                visit_leaf::<S, C, T, P, ANY>(simd, blocks, block_ray, ray, &mut nearest, probe)
            {
                return end;
            }
        } else {
            probe.container_test();
            let mut space = None;
            let (bounds, children) = tree.node(current).unpack(simd, &mut space);
            let (mut hits, entries) = container_ray.intersect(simd, bounds, nearest.t());
            if P::EVENTS {
                let (in_all, entries) = container_ray.intersect(simd, bounds, Nearest::new(ray.t_max).t());
                report_children(children, hits, in_all, &entries, probe);
            }
            if hits != 0 {
                // Branches for one, two and more children: the processor predicts which comes next and starts to load it.
                let first = take_lane(&mut hits);
                if hits != 0 && !T::EXACT && stack.is_full() {
                    return None;
                }
                let next = if hits == 0 {
                    first
                } else {
                    push_all_but_next::<_, _, ANY>(&addresses, children, &entries, first, hits, &mut stack, probe)
                };
                current = predicted(children, next);
                continue;
            }
        }
        current = loop {
            let Some(waiting) = stack.pop() else { return Some(nearest) };
            let (child, entry) = (waiting.child(), waiting.entry());
            if P::EVENTS {
                probe.popped(child.bits());
            }
            if ANY || entry <= nearest.t() * T::SLACK {
                break child;
            }
            if P::EVENTS {
                probe.culled(child.bits(), entry);
            }
        };
    }
}

/// Tests the blocks of a leaf. Breaks with the result of [`walk`].
#[inline(always)]
fn visit_leaf<'a, S: Simd, C: WideContainer, T: LaneTest<S, C::Bounds>, P: Probe, const ANY: bool>(
    simd: S,
    blocks: impl Iterator<Item = TriangleBlock<'a>>,
    block_ray: BlockRay<'_, 1>,
    ray: &Ray,
    nearest: &mut Nearest,
    probe: &mut P,
) -> ControlFlow<Option<Nearest>> {
    for block in blocks {
        probe.primitive_test();
        if P::EVENTS {
            report_block(block, ray, *nearest, probe);
        }
        if !T::EXACT {
            let (is_hit, uncertain) = if ANY {
                block_ray.any_certain_hit(simd, block, ray, nearest.t())
            } else {
                (false, block_ray.closest_certain_hit::<S, true>(simd, block, ray, nearest))
            };
            if is_hit || uncertain != 0 {
                return ControlFlow::Break(is_hit.then_some(Nearest::ANYTHING));
            }
        } else if !ANY {
            block_ray.closest_hit(simd, block, ray, nearest);
        } else if block_ray.any_hit(simd, block, ray, nearest.t()) {
            return ControlFlow::Break(Some(Nearest::ANYTHING));
        }
    }
    ControlFlow::Continue(())
}

/// Pushes those of `children` in the lane `first` and in the lanes of `hits`, at least one, but for the one to visit next.
/// Returns that one's lane.
#[inline(always)]
fn push_all_but_next<C: WideContainer, P: Probe, const ANY: bool>(
    addresses: &Addresses<C>,
    children: &[Child; WIDTH],
    entries: &[f32; WIDTH],
    first: usize,
    mut hits: u32,
    stack: &mut Stack<Waiting>,
    probe: &mut P,
) -> usize {
    let mark = stack.reserve();
    let waiting = |lane: usize| Waiting::new(entries[lane], children[lane]);
    let (mut next, mut next_lane) = (waiting(first), first);
    loop {
        let lane = take_lane(&mut hits);
        let mut other = waiting(lane);
        // For any hit, visit the farthest child first: what a ray starts from rarely blocks it. Of several that it starts in, visit
        // the last lane, that of the most hits per cost.
        let is_sooner = if ANY { other.enters_no_sooner_than(next) } else { other < next };
        if is_sooner {
            std::mem::swap(&mut other, &mut next);
            next_lane = lane;
        }
        addresses.prefetch(other.child());
        stack.push(other);
        if !ANY {
            stack.sort_last(mark, |a, b| a < b);
        }
        if hits == 0 {
            break;
        }
    }
    if P::EVENTS {
        stack.since(mark).iter().for_each(|waiting| probe.pushed(waiting.child().bits()));
    }
    next_lane
}

/// A child to visit and its distance of entry, which is not negative, in one number: nearer ones are smaller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Waiting(u64);

impl Waiting {
    #[inline(always)]
    pub(crate) fn new(entry: f32, child: Child) -> Self {
        Self(u64::from(entry.to_bits()) << 32 | u64::from(child.bits()))
    }

    #[inline(always)]
    pub(crate) fn entry(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }

    /// Compares distances of entry, whatever the children: true where that of `other` is not larger.
    #[inline(always)]
    fn enters_no_sooner_than(self, other: Self) -> bool {
        self.0 | u64::from(u32::MAX) >= other.0
    }

    #[inline(always)]
    pub(crate) fn child(self) -> Child {
        Child(self.0 as u32)
    }
}

/// The child in a `lane`, from a branch for each: the processor predicts it and loads the child before the containers are tested.
#[inline(always)]
fn predicted(children: &[Child; WIDTH], lane: usize) -> Child {
    // Without a black box for each lane, of another number each, the compiler would make one of all branches.
    macro_rules! branches {
        ($($lane:literal),*) => {
            match lane {
                $($lane => {
                    let child = children[$lane];
                    black_box($lane);
                    child
                })*
                _ => children[WIDTH - 1],
            }
        };
    }
    branches!(0, 1, 2, 3, 4, 5, 6)
}

/// Removes the lowest lane from `lanes`.
#[inline(always)]
pub(crate) fn take_lane(lanes: &mut u32) -> usize {
    let lane = lanes.trailing_zeros() as usize % WIDTH;
    *lanes &= *lanes - 1;
    lane
}

/// Reports the tests of a node's `children`: `hits` are the lanes entered before the nearest hit, `in_all` those entered
/// anywhere on the ray, at `entries`.
#[cold]
fn report_children<P: Probe>(children: &[Child; WIDTH], hits: u32, in_all: u32, entries: &[f32; WIDTH], probe: &mut P) {
    // Unused lanes come last and refer to the root, which is nobody's child.
    let used = children.iter().take_while(|child| **child != Child::ROOT);
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
