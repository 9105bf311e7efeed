//! Observers of a traversal.

use std::iter::Sum;
use std::ops::{Add, AddAssign};

use super::ray_event::RayEvent;

/// Observer of the traversal of one ray: receives each test and, if it wants events, every step of the traversal. A probe
/// that does nothing costs nothing.
///
/// `node` is the index of a node of a [`Tree`](crate::tree::Tree), of any arity. In a [`wide`](crate::wide) tree it is
/// [`Child::bits`] of the reference to a node or leaf, 0 for the root where that is a node.
///
/// A traversal calls, in this order:
///
/// - for each container that it tests [`entered`](Self::entered) or [`missed`](Self::missed), the root's first (but not that of a
///   root that is a leaf, and never that of a wide tree's root), all siblings in their order;
/// - [`culled`](Self::culled) after `entered` where the container begins behind the nearest hit: it will not be visited;
/// - [`pushed`](Self::pushed) for each node that is put on the stack, so that the last pushed is the first popped;
/// - [`popped`](Self::popped) for each node taken from the stack, followed by `culled` where a hit found meanwhile is nearer;
/// - [`visited`](Self::visited) for the node that it goes into, before its children or its primitives are tested;
/// - [`tested`](Self::tested) for each primitive, and [`nearer`](Self::nearer) where its hit becomes the nearest.
///
/// [`Child::bits`]: crate::wide::Child::bits
pub trait Probe {
    /// Whether events are wanted. Where this is `false`, only [`container_test`](Self::container_test),
    /// [`primitive_test`](Self::primitive_test) and [`visited`](Self::visited) are called, and the traversal omits what it would
    /// compute only for the others.
    const EVENTS: bool = false;
    /// Whether it records anything at all. Where this is `false`, traversals may take a shorter way to the same hit.
    const ACTIVE: bool = true;

    /// This probe for the traversals that are compiled once for all probes, those of [`AnyTree`](crate::AnyTree) and
    /// [`AnyWideTree`](crate::wide::AnyWideTree).
    #[doc(hidden)]
    fn observer(&mut self) -> Observer<'_>
    where
        Self: Sized,
    {
        Observer::pointed(self)
    }

    /// Called for each container test. In a [`wide`](crate::wide) tree one test is that of all children of a node at once.
    fn container_test(&mut self);
    /// Called for each primitive test. In a wide tree one test is that of a block of up to four primitives at once.
    fn primitive_test(&mut self);
    /// The ray is carried into the coordinates of the mesh of a copy, of those in a tree of two levels, whose tree it is tested with.
    #[inline(always)]
    fn carried(&mut self, copy: u32) {
        let _ = copy;
    }
    /// The traversal goes into a node of the tree of a mesh, in trees of two levels: of the tree above alone nodes have numbers.
    #[inline(always)]
    fn visited_below(&mut self) {}
    /// Called with each of what follows, unless that is overridden.
    #[inline(always)]
    fn event(&mut self, event: RayEvent) {
        let _ = event;
    }
    /// The traversal goes into `node`.
    #[inline(always)]
    fn visited(&mut self, node: u32) {
        self.event(RayEvent::Visit { node });
    }
    /// The ray enters the container of `node` at distance `t`, before its own `t_max`.
    #[inline(always)]
    fn entered(&mut self, node: u32, t: f32) {
        self.event(RayEvent::Enter { node, t });
    }
    /// The ray misses the container of `node`.
    #[inline(always)]
    fn missed(&mut self, node: u32) {
        self.event(RayEvent::Miss { node });
    }
    /// `node`, entered at `t`, is skipped: it begins behind the nearest hit so far.
    #[inline(always)]
    fn culled(&mut self, node: u32, t: f32) {
        self.event(RayEvent::Cull { node, t });
    }
    /// `node` is put on the stack, to be visited later.
    #[inline(always)]
    fn pushed(&mut self, node: u32) {
        self.event(RayEvent::Push { node });
    }
    /// `node` is taken from the stack.
    #[inline(always)]
    fn popped(&mut self, node: u32) {
        self.event(RayEvent::Pop { node });
    }
    /// The primitive `primitive_index` (in the list that the tree was built from) was tested: the distance of its hit, `None`
    /// where the ray misses it or hits it behind the nearest hit.
    #[inline(always)]
    fn tested(&mut self, primitive_index: u32, t: Option<f32>) {
        self.event(RayEvent::Triangle { index: primitive_index, t });
    }
    /// The nearest hit is now at `t`. A block of primitives reports the nearest of its hits.
    #[inline(always)]
    fn nearer(&mut self, t: f32) {
        self.event(RayEvent::Nearer { t });
    }
}

/// A probe that does nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoProbe;

impl Probe for NoProbe {
    const ACTIVE: bool = false;

    fn observer(&mut self) -> Observer<'_> {
        Observer::Nothing
    }
    #[inline(always)]
    fn container_test(&mut self) {}
    #[inline(always)]
    fn primitive_test(&mut self) {}
}

/// Numbers of container and primitive tests.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct TestCounts {
    /// Number of container tests.
    pub containers: u64,
    /// Number of primitive tests.
    pub primitives: u64,
}

impl TestCounts {
    /// Number of tests of either kind.
    pub fn total(self) -> u64 {
        self.containers + self.primitives
    }
}

impl Add for TestCounts {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { containers: self.containers + other.containers, primitives: self.primitives + other.primitives }
    }
}

impl AddAssign for TestCounts {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Sum for TestCounts {
    fn sum<I: Iterator<Item = Self>>(counts: I) -> Self {
        counts.fold(Self::default(), Self::add)
    }
}

impl Probe for TestCounts {
    fn observer(&mut self) -> Observer<'_> {
        Observer::Counts(self)
    }
    #[inline(always)]
    fn container_test(&mut self) {
        self.containers += 1;
    }
    #[inline(always)]
    fn primitive_test(&mut self) {
        self.primitives += 1;
    }
}

/// A probe as compiled traversals take it; see [`Probe::observer`].
pub enum Observer<'a> {
    /// None at all.
    Nothing,
    /// Counters, without a pointer's call for each test.
    Counts(&'a mut TestCounts),
    /// A probe that wants no events.
    Tests(Pointed<'a, false>),
    /// A probe that wants events.
    Events(Pointed<'a, true>),
}

impl<'a> Observer<'a> {
    /// The observer for a probe of any type.
    pub(super) fn pointed<P: Probe>(probe: &'a mut P) -> Self {
        if P::EVENTS { Self::Events(Pointed(probe)) } else { Self::Tests(Pointed(probe)) }
    }
}

/// A probe of any type, with its [`Probe::EVENTS`].
pub struct Pointed<'a, const EVENTS: bool>(&'a mut dyn Told);

impl<const EVENTS: bool> Probe for Pointed<'_, EVENTS> {
    const EVENTS: bool = EVENTS;

    #[inline(always)]
    fn container_test(&mut self) {
        self.0.container_test();
    }
    #[inline(always)]
    fn primitive_test(&mut self) {
        self.0.primitive_test();
    }
    #[inline(always)]
    fn carried(&mut self, copy: u32) {
        self.0.carried(copy);
    }
    #[inline(always)]
    fn visited_below(&mut self) {
        self.0.visited_below();
    }
    #[inline(always)]
    fn event(&mut self, event: RayEvent) {
        self.0.event(event);
    }
}

/// The part of [`Probe`] that can stand behind a pointer.
trait Told {
    fn container_test(&mut self);
    fn primitive_test(&mut self);
    fn carried(&mut self, copy: u32);
    fn visited_below(&mut self);
    fn event(&mut self, event: RayEvent);
}

impl<P: Probe> Told for P {
    fn container_test(&mut self) {
        Probe::container_test(self);
    }

    fn primitive_test(&mut self) {
        Probe::primitive_test(self);
    }

    fn carried(&mut self, copy: u32) {
        Probe::carried(self, copy);
    }

    fn visited_below(&mut self) {
        Probe::visited_below(self);
    }

    fn event(&mut self, event: RayEvent) {
        match event {
            RayEvent::Visit { node } => self.visited(node),
            RayEvent::Enter { node, t } => self.entered(node, t),
            RayEvent::Miss { node } => self.missed(node),
            RayEvent::Cull { node, t } => self.culled(node, t),
            RayEvent::Push { node } => self.pushed(node),
            RayEvent::Pop { node } => self.popped(node),
            RayEvent::Triangle { index, t } => self.tested(index, t),
            RayEvent::Nearer { t } => self.nearer(t),
        }
    }
}
