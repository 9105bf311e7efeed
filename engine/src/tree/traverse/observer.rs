//! Probes behind pointers, for traversals that are compiled once, whatever observes them.

use super::probe::{Probe, TestCounts};
use super::ray_event::RayEvent;

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
    fn event(&mut self, event: RayEvent) {
        self.0.event(event);
    }
}

/// The part of [`Probe`] that can stand behind a pointer.
trait Told {
    fn container_test(&mut self);
    fn primitive_test(&mut self);
    fn event(&mut self, event: RayEvent);
}

impl<P: Probe> Told for P {
    fn container_test(&mut self) {
        Probe::container_test(self);
    }

    fn primitive_test(&mut self) {
        Probe::primitive_test(self);
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
