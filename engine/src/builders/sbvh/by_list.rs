//! The best division of a list of references: a full sweep along each axis, as by the builder of sweep SAH.

use glam::Vec3;

use crate::builders::sbvh::references::{FORK_ABOVE, Reference};
use crate::builders::sweep::{Split, best_split_in_order, ordered_bits};
use crate::cancel::{CancelToken, Cancelled, MEDIUM_STEPS};
use crate::geometry::Aabb;
use crate::kernel::parallel::{par_collect, tasks_if};
use crate::order::radix_sort;

/// A division of a list.
pub struct ListSplit {
    /// Areas times numbers of references, summed over both sides.
    pub cost: f64,
    /// Boxes around both sides.
    pub sides: [Aabb; 2],
    /// For each reference whether it is on the left side.
    pub is_left: Vec<bool>,
}

/// The best of all divisions of `references`, of at least two, in the order of their centres along an axis; of equal ones the most even.
pub fn best_list_split(references: &[Reference], token: &CancelToken) -> Result<ListSplit, Cancelled> {
    // Two references have one division, whatever the axis.
    if let [first, second] = references {
        let sides = [first.bounds, second.bounds];
        let cost = sides.iter().map(|side| f64::from(side.half_area())).sum();
        return Ok(ListSplit { cost, sides, is_left: vec![true, false] });
    }
    let forks = references.len() > FORK_ABOVE;
    let Swept { split, order } = tasks_if(forks, 0..3, token, |axis, token| sweep_axis(references, axis, token))?
        .into_iter()
        .reduce(|best, swept| if swept.split.is_better_than(&best.split) { swept } else { best })
        .unwrap_or_else(|| unreachable!("there are three axes"));
    let mut is_left = vec![false; references.len()];
    let mut sides = [Aabb::EMPTY; 2];
    for (at, key) in order.iter().enumerate() {
        if forks {
            token.check_every(MEDIUM_STEPS, at)?;
        }
        let (place, side) = (*key as u32 as usize, usize::from(at >= split.left));
        is_left[place] = side == 0;
        sides[side] = sides[side].union(&references[place].bounds);
    }
    Ok(ListSplit { cost: split.cost, sides, is_left })
}

/// The best division along an axis.
struct Swept {
    split: Split,
    /// Centres of the references with the places of these in the list, sorted.
    order: Vec<u64>,
}

/// Sweeps `references` along `axis`. Of equal centres that of the first triangle comes first.
fn sweep_axis(references: &[Reference], axis: usize, token: &CancelToken) -> Result<Swept, Cancelled> {
    let count = references.len();
    let key = |place: usize| {
        // Adding zero makes negative zeros positive, so that their bits are equal, too.
        let centre = references[place].bounds.center() + Vec3::ZERO;
        u64::from(ordered_bits(centre[axis])) << 32 | place as u64
    };
    let order = if count > FORK_ABOVE {
        let mut keys = par_collect(count, token, key)?;
        radix_sort(&mut keys, u64::BITS, token)?;
        keys
    } else {
        let mut keys: Vec<u64> = (0..count).map(key).collect();
        keys.sort_unstable();
        keys
    };
    let bounds_at = |at: usize| &references[order[at] as u32 as usize].bounds;
    let split = best_split_in_order(count, bounds_at, &mut vec![0; count], axis, token)?;
    Ok(Swept { split, order })
}
