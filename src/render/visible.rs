//! The visible part of a scene: one side of the section plane, less the hidden triangles.

use std::borrow::Cow;

use crate::accel::tracer::first_that_counts;
use crate::scene::Scene;
use crate::section::SectionPlane;
use crate::visibility::TriangleSet;
use bvhscope_engine::geometry::{Hit, Ray};

/// The visible part of a scene.
#[derive(Debug, Clone, Copy)]
pub struct Visible<'a> {
    pub(super) scene: &'a Scene,
    pub(super) section: Option<SectionPlane>,
    /// Triangles that rays pass through; none where nothing is hidden.
    pub(super) hidden: Option<&'a TriangleSet>,
}

impl Visible<'_> {
    /// The part of a ray that the section plane leaves.
    #[inline]
    pub fn cut(&self, ray: Ray) -> Ray {
        self.section.map_or(ray, |plane| plane.clip(&ray))
    }

    /// The parts of rays that the section plane leaves, copied only where there is one.
    pub(super) fn cut_all<'r>(&self, rays: &'r [Ray]) -> Cow<'r, [Ray]> {
        match &self.section {
            Some(plane) => rays.iter().map(|ray| plane.clip(ray)).collect(),
            None => Cow::Borrowed(rays),
        }
    }

    /// True if rays pass through the triangle that a hit names.
    #[inline]
    pub fn is_hidden(&self, hit: u32) -> bool {
        self.hidden.is_some_and(|hidden| hidden.contains(self.scene.primitive_of(hit)))
    }

    /// The first hit of `closest` that is not hidden, in the part of a ray that the section plane leaves. Behind a hidden triangle
    /// the ray is traced again.
    #[inline(always)]
    pub fn first(&self, ray: Ray, closest: impl FnMut(&Ray) -> Option<Hit>) -> Option<Hit> {
        first_that_counts(self.cut(ray), |primitive_index| self.is_hidden(primitive_index), closest)
    }
}
