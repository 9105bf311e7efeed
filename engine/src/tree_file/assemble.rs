//! Brings the nodes into the order of a [`Tree`]: children neighbours behind their parents, the primitives below any node
//! contiguous.

use super::arrays::Arrays;
use super::bounds::FileContainer;
use super::error::TreeFileError;
use super::links::{Links, Steps};
use crate::cancel::{CancelToken, Cancelled};
use crate::kernel::parallel::{par_collect, zeros};
use crate::tree::{Node, Tree};

/// A tree in our order.
pub(super) struct Assembled<C> {
    pub tree: Tree<C>,
    /// The number that each node has in the file; `None` where all have kept theirs.
    pub numbers: Option<Vec<u32>>,
}

/// Makes the tree that `links` found. Nodes whose order is ours already keep their numbers, and so do their primitives;
/// otherwise nodes are numbered depth first, siblings together, in the order of the file's rows.
pub(super) fn assemble<C: FileContainer>(
    arrays: &Arrays<'_>,
    links: &Links,
    token: &CancelToken,
) -> Result<Assembled<C>, TreeFileError> {
    let count = links.order.len().saturating_sub(links.empty as usize);
    if count == 0 {
        let (items, of) = (arrays.items, arrays.kind);
        return if items == 0 {
            Ok(Assembled { tree: Tree::EMPTY, numbers: None })
        } else if arrays.nodes == 0 {
            Err(TreeFileError::NoNodes { items, of })
        } else {
            Err(TreeFileError::NoLeaves { items, of })
        };
    }
    let in_order = is_in_order(arrays, links, token)?;
    // Of each node of the file its number in the tree.
    let mut numbers: Vec<u32> = if in_order {
        par_collect(arrays.nodes as usize, token, |node| node as u32)?
    } else {
        zeros(arrays.nodes as usize, token)?
    };
    let mut file_numbers: Vec<u32> = zeros(if in_order { 0 } else { count }, token)?;
    let mut depths: Vec<u32> = zeros(count, token)?;
    let mut nodes: Vec<Node<C>> = zeros(count, token)?;
    let mut primitive_indices = Vec::with_capacity(arrays.indices as usize);
    let (mut next, mut max_depth) = (1_u32, 0);
    let mut steps = Steps::new(token, u64::from(arrays.nodes).saturating_add(u64::from(arrays.indices)));
    for &node in links.order.iter().filter(|&&node| links.kept.contains(node)) {
        steps.step()?;
        let container = C::read(arrays.bounds, node).map_err(|problem| TreeFileError::Bounds { node, problem })?;
        let number = numbers[node as usize] as usize;
        if let Some(file_number) = file_numbers.get_mut(number) {
            *file_number = node;
        }
        let [first, count] = arrays.leaf(node);
        if count > 0 {
            nodes[number] = Node { container, first: primitive_indices.len() as u32, count };
            for index in first..first.saturating_add(count) {
                steps.step()?;
                primitive_indices.push(arrays.item_at(index));
            }
            continue;
        }
        let depth = depths[number].saturating_add(1);
        max_depth = depth.max(max_depth);
        let (mut first, mut arity) = (next, 0_u32);
        for child in arrays.children(node).filter(|&child| links.kept.contains(child)) {
            if in_order && arity == 0 {
                first = child;
            } else if !in_order {
                numbers[child as usize] = next;
            }
            next = next.saturating_add(1);
            arity = arity.saturating_add(1);
            depths[numbers[child as usize] as usize] = depth;
        }
        nodes[number] = Node::interior(container, first, arity);
    }
    token.check()?;
    let tree = Tree { nodes, primitive_indices, max_depth };
    Ok(Assembled { tree, numbers: (!in_order).then_some(file_numbers) })
}

/// Whether the tree of the file is in our order, every node and every index part of it.
fn is_in_order(arrays: &Arrays<'_>, links: &Links, token: &CancelToken) -> Result<bool, Cancelled> {
    if links.order.len() != arrays.nodes as usize || links.empty > 0 {
        return Ok(false);
    }
    let mut next_index = 0_u32;
    let mut steps = Steps::silent(token);
    for &node in &links.order {
        steps.step()?;
        let [first, count] = arrays.leaf(node);
        if count > 0 {
            // Leaves from left to right have consecutive indices.
            if first != next_index {
                return Ok(false);
            }
            next_index = next_index.saturating_add(count);
            continue;
        }
        let mut expected = None;
        for child in arrays.children(node) {
            if child <= node || expected.is_some_and(|expected| child != expected) {
                return Ok(false);
            }
            expected = child.checked_add(1);
        }
    }
    Ok(next_index == arrays.indices)
}
