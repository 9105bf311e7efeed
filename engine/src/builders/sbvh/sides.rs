//! Both sides of a divided node, and the range that they share.

use crate::builders::sbvh::references::Reference;
use crate::cancel::{CancelToken, Cancelled, LIGHT_STEPS};

/// Both sides of a divided node.
pub struct Sides {
    /// Numbers of their references.
    pub counts: [usize; 2],
    /// Where the range of the right side begins.
    pub middle: usize,
}

/// Writes the references of a node to its sides as they are read, in order: those of the left side in place, the others beside.
pub struct SideWriter<'a> {
    /// The range of the node.
    pub references: &'a mut [Reference],
    left: usize,
    right: Vec<Reference>,
}

impl<'a> SideWriter<'a> {
    pub fn new(references: &'a mut [Reference]) -> Self {
        Self { references, left: 0, right: Vec::new() }
    }

    /// Adds `reference` to the side 0 or 1. To the left at most one is added for each that was read before.
    pub fn push(&mut self, side: usize, reference: Reference) {
        if side == 0 {
            self.references[self.left] = reference;
            self.left += 1;
        } else {
            self.right.push(reference);
        }
    }

    /// Moves the right side behind the spare room of the left one: both have room in proportion to their references. `None`, and all
    /// references in the order in which they were added, where a side has none.
    pub fn finish(self) -> Option<Sides> {
        let Self { references, left, right } = self;
        let counts = [left, right.len()];
        let count = left + right.len();
        let spare = references.len() - count;
        let middle = left + (spare as u128 * left as u128 / count.max(1) as u128) as usize;
        references[middle..middle + right.len()].copy_from_slice(&right);
        (!counts.contains(&0)).then_some(Sides { counts, middle })
    }
}

/// Divides the first `count` of `references` without cutting any: those at places for which `is_left` holds, which are some and not
/// all, from the others.
pub fn divide_by_list(
    references: &mut [Reference],
    count: usize,
    is_left: impl Fn(usize) -> bool,
    token: &CancelToken,
) -> Result<Sides, Cancelled> {
    let mut sides = SideWriter::new(references);
    for at in 0..count {
        token.check_every(LIGHT_STEPS, at + 1)?;
        let reference = sides.references[at];
        sides.push(usize::from(!is_left(at)), reference);
    }
    Ok(sides.finish().unwrap_or_else(|| unreachable!("both sides have references")))
}
