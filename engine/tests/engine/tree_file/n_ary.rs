//! Random n-ary trees in our order, and the same trees in any other.

use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::tree::{Container, Node, Tree};

use super::draft::{Draft, NONE};
use crate::random::Random;

/// A tree over `triangles` whose nodes have 1 to `arity` children and whose leaves hold 1 to 4 primitives. The root has `arity`
/// children where there are enough triangles.
pub fn random_tree<C: Container>(triangles: &[Triangle], arity: u32, random: &mut Random) -> Tree<C> {
    let mut tree = Tree { nodes: Vec::new(), primitive_indices: Vec::new(), max_depth: 0 };
    if triangles.is_empty() {
        return tree;
    }
    let mut all: Vec<u32> = (0..triangles.len() as u32).collect();
    for last in (1..all.len()).rev() {
        all.swap(last, random.below(last + 1));
    }
    tree.nodes.push(Node { container: C::EMPTY, first: 0, count: 1 });
    // Numbered depth first, siblings together: what is still to be split, its number and its depth.
    let mut open = vec![(all, 0, 0)];
    while let Some((primitives, number, depth)) = open.pop() {
        tree.max_depth = depth.max(tree.max_depth);
        let first = tree.primitive_indices.len() as u32;
        let is_leaf = primitives.len() == 1 || depth > 0 && primitives.len() <= 4 && random.below(2) == 0;
        if is_leaf && (depth > 0 || primitives.len() == 1) {
            tree.nodes[number] = Node { container: C::EMPTY, first, count: primitives.len() as u32 };
            tree.primitive_indices.extend(primitives);
            continue;
        }
        let most = (arity as usize).min(primitives.len());
        let parts = if depth == 0 { most } else { 1 + random.below(most) };
        // Some nodes have a single child, yet not all: the tree ends.
        let parts = if parts == 1 && depth % 3 != 1 { most } else { parts };
        let first = tree.nodes.len();
        tree.nodes[number] = Node::interior(C::EMPTY, first as u32, parts as u32);
        let mut children = Vec::new();
        let mut rest = &primitives[..];
        for part in 0..parts {
            let left = parts - part - 1;
            let size = if left == 0 { rest.len() } else { 1 + random.below(rest.len() - left) };
            children.push((rest[..size].to_vec(), first + part, depth + 1));
            rest = &rest[size..];
        }
        tree.nodes.extend(vec![Node { container: C::EMPTY, first: 0, count: 1 }; parts]);
        children.reverse();
        open.extend(children);
    }
    enclose(&mut tree, triangles);
    tree
}

/// Gives every node the container of what is below it.
fn enclose<C: Container>(tree: &mut Tree<C>, triangles: &[Triangle]) {
    for number in (0..tree.nodes.len()).rev() {
        let node = tree.nodes[number];
        let of_triangle = |&primitive: &u32| C::of_triangle(&triangles[primitive as usize]);
        let containers: Vec<C> = if node.is_leaf() {
            tree.primitive_indices[node.slots()].iter().map(of_triangle).collect()
        } else {
            node.children().map(|child| tree.nodes[child as usize].container).collect()
        };
        tree.nodes[number].container = containers.iter().fold(C::EMPTY, |all, one| all.union(one));
    }
}

/// The file of `tree` with nodes and leaves in another order, empty slots anywhere, `empty` nodes that hold nothing, and gaps between
/// the indices. Also returns the number in the file of each node.
pub fn scrambled<C: Container + bytemuck::Pod>(
    tree: &Tree<C>,
    triangles: &[Triangle],
    arity: u32,
    empty: usize,
    random: &mut Random,
) -> (Draft, Vec<u32>) {
    let plain = Draft::of(tree, triangles, arity as usize);
    let count = tree.nodes.len();
    // The root stays the root.
    let mut numbers: Vec<u32> = (0..(count + empty) as u32).collect();
    for last in (2..numbers.len()).rev() {
        numbers.swap(last, 1 + random.below(last));
    }
    let numbers_of_nodes = numbers[..count].to_vec();
    let mut draft = Draft {
        bounds: vec![vec![f32::NAN; plain.bounds[0].len()]; count + empty],
        children: vec![vec![NONE; arity as usize]; count + empty],
        leaves: vec![[77, 0]; count + empty],
        indices: Vec::new(),
        ..plain.clone()
    };
    let mut left_over = numbers[count..].to_vec();
    let mut leaves: Vec<usize> = (0..count).filter(|&node| tree.nodes[node].is_leaf()).collect();
    for last in (1..leaves.len()).rev() {
        leaves.swap(last, random.below(last + 1));
    }
    for node in leaves {
        // An index that no leaf has may be any number.
        draft.indices.extend((0..random.below(2)).map(|_| 1_000_000));
        let number = numbers[node] as usize;
        draft.leaves[number] = [draft.indices.len() as u32, tree.nodes[node].count];
        draft.children[number] = vec![123; arity as usize];
        draft.indices.extend(&tree.primitive_indices[tree.nodes[node].slots()]);
    }
    for node in 0..count {
        let number = numbers[node] as usize;
        draft.bounds[number] = plain.bounds[node].clone();
        if tree.nodes[node].is_leaf() {
            continue;
        }
        let mut row: Vec<u32> = tree.nodes[node].children().map(|child| numbers[child as usize]).collect();
        while row.len() < arity as usize {
            // A slot that says that it is empty, or one whose node is.
            let slot = if random.below(2) == 0 { NONE } else { left_over.pop().unwrap_or(NONE) };
            row.insert(random.below(row.len() + 1), slot);
        }
        draft.children[number] = row;
    }
    draft.header.insert("unused".to_owned(), left_over.len().into());
    (draft, numbers_of_nodes)
}
