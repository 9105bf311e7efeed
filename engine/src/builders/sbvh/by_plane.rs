//! Divisions of a node by a plane: which one (the paper's *chopped binning*), and on which side each reference goes (its *reference
//! unsplitting*).

use glam::Vec3;

use crate::builders::clip::halves;
use crate::builders::sbvh::references::{FORK_ABOVE, Reference, Scene};
use crate::builders::sbvh::sides::{SideWriter, Sides};
use crate::cancel::{CancelToken, Cancelled, HEAVY_STEPS};
use crate::geometry::{Aabb, Triangle};
use crate::kernel::parallel::tasks_if;

/// Number of slabs along each axis; planes are tried between them.
const SLABS: usize = 32;

/// A plane that divides a node.
#[derive(Clone, Copy)]
pub struct PlaneSplit {
    /// Areas times numbers of references, summed over both sides, where each reference that the plane crosses is cut.
    pub cost: f64,
    axis: usize,
    position: f32,
    sides: [Side; 2],
}

/// One side of a plane.
#[derive(Clone, Copy)]
struct Side {
    /// Box around the references and the parts of references on it.
    bounds: Aabb,
    /// Number of these.
    count: usize,
}

impl Side {
    fn cost(&self) -> f64 {
        f64::from(self.bounds.half_area()) * self.count as f64
    }

    /// This side with the whole of a reference in place of its part.
    fn with_whole(&self, whole: &Aabb) -> Self {
        Self { bounds: self.bounds.union(whole), ..*self }
    }

    /// This side without a reference. Its box remains: the reference need not be why it is as large.
    fn without_one(&self) -> Self {
        Self { count: self.count.saturating_sub(1), ..*self }
    }
}

/// The cheapest of the planes across a node of `references` with these `bounds` that cut no more than `spare` of them; `None` where no
/// plane divides them.
pub fn best_plane_split(
    scene: &Scene<'_>,
    references: &[Reference],
    bounds: &Aabb,
    spare: usize,
    token: &CancelToken,
) -> Result<Option<PlaneSplit>, Cancelled> {
    let axes = (0..3).filter(|&axis| bounds.extent()[axis] > 0.0);
    let along = |axis: usize, token: &CancelToken| -> Result<Option<PlaneSplit>, Cancelled> {
        Ok(Slabs::new(scene, references, bounds, axis, token)?.best_plane(references.len(), spare))
    };
    let splits = tasks_if(references.len() > FORK_ABOVE, axes, token, along)?;
    Ok(splits.into_iter().flatten().reduce(|best, split| if split.cost < best.cost { split } else { best }))
}

/// Slabs of a node across an axis, with the parts of references in them.
struct Slabs {
    axis: usize,
    /// Where the first slab begins.
    min: f32,
    extent: f32,
    /// Boxes around the parts in each slab.
    boxes: [Aabb; SLABS],
    /// Number of references that begin in each slab.
    entries: [usize; SLABS],
    /// Number of references that end in each slab.
    exits: [usize; SLABS],
}

impl Slabs {
    fn new(
        scene: &Scene<'_>,
        references: &[Reference],
        bounds: &Aabb,
        axis: usize,
        token: &CancelToken,
    ) -> Result<Self, Cancelled> {
        let mut slabs = Self {
            axis,
            min: bounds.min[axis],
            extent: bounds.extent()[axis],
            boxes: [Aabb::EMPTY; SLABS],
            entries: [0; SLABS],
            exits: [0; SLABS],
        };
        for (at, reference) in references.iter().enumerate() {
            token.check_every(HEAVY_STEPS, at + 1)?;
            slabs.add(scene, reference);
        }
        Ok(slabs)
    }

    /// Position of the plane before `slab`.
    fn plane(&self, slab: usize) -> f32 {
        self.min + self.extent * (slab as f32 / SLABS as f32)
    }

    /// The slab from whose plane on `position` is, before the next one.
    fn slab_of(&self, position: f32) -> usize {
        let fraction = (position - self.min) / self.extent;
        let slab = ((fraction * SLABS as f32) as usize).min(SLABS - 1);
        // The quotient may be rounded over a plane.
        if slab > 0 && position < self.plane(slab) {
            slab - 1
        } else if slab + 1 < SLABS && position >= self.plane(slab + 1) {
            slab + 1
        } else {
            slab
        }
    }

    /// Cuts `reference` at all planes, so that each slab grows around its part only.
    fn add(&mut self, scene: &Scene<'_>, reference: &Reference) {
        let [min, max] = [reference.bounds.min, reference.bounds.max].map(|corner| corner[self.axis]);
        let (first, mut last) = (self.slab_of(min), self.slab_of(max));
        // One that ends at a plane does not reach beyond.
        if last > first && max <= self.plane(last) {
            last -= 1;
        }
        self.entries[first] += 1;
        self.exits[last] += 1;
        if first == last {
            self.boxes[first] = self.boxes[first].union(&reference.bounds);
            return;
        }
        let parts = self.parts(&scene.triangles[reference.triangle as usize], first, last);
        let overlap = Vec3::splat(scene.overlap as f32);
        for (all, Aabb { min, max }) in self.boxes[first..=last].iter_mut().zip(&parts[first..=last]) {
            let part = Aabb { min: min - overlap, max: max + overlap }.intersection(&reference.bounds);
            if !part.is_empty() {
                *all = all.union(&part);
            }
        }
    }

    /// Boxes around the parts of `triangle` in the slabs `first` to `last`, of which these two include all that is beyond them.
    fn parts(&self, triangle: &Triangle, first: usize, last: usize) -> [Aabb; SLABS] {
        let mut parts = [Aabb::EMPTY; SLABS];
        let mut add = |slab: usize, point: Vec3| {
            let Aabb { min, max } = parts[slab];
            parts[slab] = Aabb { min: min.min(point), max: max.max(point) };
        };
        let Triangle { a, b, c } = *triangle;
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let (low, high) = if from[self.axis] <= to[self.axis] { (from, to) } else { (to, from) };
            let [low_slab, high_slab] = [low, high].map(|corner| self.slab_of(corner[self.axis]).clamp(first, last));
            add(low_slab, low);
            add(high_slab, high);
            let slope = (high - low) / (high[self.axis] - low[self.axis]);
            for slab in low_slab..high_slab {
                let position = self.plane(slab + 1);
                let mut cut = low + slope * (position - low[self.axis]);
                cut[self.axis] = position;
                add(slab, cut);
                add(slab + 1, cut);
            }
        }
        parts
    }

    /// The cheapest plane between slabs with references on both sides, of all `count` together, that cuts at most `spare`.
    fn best_plane(&self, count: usize, spare: usize) -> Option<PlaneSplit> {
        // Boxes around all slabs from each one on.
        let mut right_boxes = self.boxes;
        for slab in (0..SLABS - 1).rev() {
            right_boxes[slab] = right_boxes[slab].union(&right_boxes[slab + 1]);
        }
        let mut left = Side { bounds: Aabb::EMPTY, count: 0 };
        let mut ended = 0;
        let mut best: Option<PlaneSplit> = None;
        for (slab, right_bounds) in right_boxes.into_iter().enumerate().skip(1) {
            left.bounds = left.bounds.union(&self.boxes[slab - 1]);
            left.count += self.entries[slab - 1];
            ended += self.exits[slab - 1];
            let right = Side { bounds: right_bounds, count: count - ended };
            let cost = left.cost() + right.cost();
            let divides = left.count > 0 && right.count > 0 && left.count + right.count - count <= spare;
            if divides && best.is_none_or(|best| cost < best.cost) {
                best = Some(PlaneSplit { cost, axis: self.axis, position: self.plane(slab), sides: [left, right] });
            }
        }
        best
    }
}

/// Divides the first `count` of `references` by a plane. `None` where all are on one side; some of them may have become smaller then.
pub fn divide_by_plane(
    scene: &Scene<'_>,
    references: &mut [Reference],
    count: usize,
    mut plane: PlaneSplit,
    token: &CancelToken,
) -> Result<Option<Sides>, Cancelled> {
    let mut spare = references.len() - count;
    let mut sides = SideWriter::new(references);
    for at in 0..count {
        token.check_every(HEAVY_STEPS, at + 1)?;
        let reference = sides.references[at];
        let part = |bounds: Aabb| Reference { bounds, ..reference };
        if reference.bounds.max[plane.axis] <= plane.position {
            sides.push(0, reference);
        } else if reference.bounds.min[plane.axis] >= plane.position {
            sides.push(1, reference);
        } else {
            let triangle = &scene.triangles[reference.triangle as usize];
            let halves = halves(triangle, &reference.bounds, plane.axis, plane.position, scene.overlap);
            match plane.place(&reference.bounds, &halves, spare > 0) {
                Place::Both => {
                    sides.push(0, part(halves[0]));
                    sides.push(1, part(halves[1]));
                    spare -= 1;
                }
                Place::Part(side) => sides.push(side, part(halves[side])),
                Place::Whole(side) => sides.push(side, reference),
            }
        }
    }
    Ok(sides.finish())
}

/// Where a reference goes that a plane crosses.
enum Place {
    /// Each half to its side.
    Both,
    /// The half on this side, where there is nothing on the other.
    Part(usize),
    /// All of it to this side.
    Whole(usize),
}

impl PlaneSplit {
    /// Where a reference goes whose box is `whole` and the boxes of whose parts are `halves`: into both sides, if it `may_split`, or as a
    /// whole into one, whichever is the cheapest. Updates the sides.
    fn place(&mut self, whole: &Aabb, halves: &[Aabb; 2], may_split: bool) -> Place {
        let [left, right] = self.sides;
        match halves.each_ref().map(Aabb::is_empty) {
            [false, false] => {}
            [false, true] => {
                self.sides = [left, right.without_one()];
                return Place::Part(0);
            }
            [true, false] => {
                self.sides = [left.without_one(), right];
                return Place::Part(1);
            }
            // The triangle lies outside of the box by rounding.
            [true, true] => {
                self.sides = [left.with_whole(whole), right.without_one()];
                return Place::Whole(0);
            }
        }
        let only_left = [left.with_whole(whole), right.without_one()];
        let only_right = [left.without_one(), right.with_whole(whole)];
        let [in_both, in_left, in_right] =
            [&self.sides, &only_left, &only_right].map(|[left, right]| left.cost() + right.cost());
        if may_split && in_both < in_left.min(in_right) {
            return Place::Both;
        }
        let side = usize::from(in_right < in_left);
        self.sides = if side == 0 { only_left } else { only_right };
        Place::Whole(side)
    }
}
