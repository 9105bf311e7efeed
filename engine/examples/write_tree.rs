//! Builds a tree by hand, four children a node, and writes it with its triangles as a file that bvhscope opens.
//!
//! `cargo run --release -p bvhscope-engine --features tree-file --example write_tree -- mine.bvh`, then `bvhscope mine.bvh`

mod meshes;

use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::Path;
use std::time::Instant;

use bvhscope_engine::tree::{Node, Tree};
use bvhscope_engine::tree_file::{Header, write_tree};
use bvhscope_engine::{Aabb, AnyTree, CancelToken, Triangle};

/// Most triangles in a leaf.
const LEAF_SIZE: usize = 4;

/// Makes node number `index` above the triangles `primitives[range]`, which it sorts, and everything below.
fn build(tree: &mut Tree<Aabb>, triangles: &[Triangle], index: usize, range: std::ops::Range<usize>) {
    let primitives = &mut tree.primitive_indices[range.clone()];
    let bounds =
        primitives.iter().map(|&i| triangles[i as usize].bounds()).fold(Aabb::EMPTY, |all, one| all.union(&one));
    if primitives.len() <= LEAF_SIZE {
        tree.nodes[index] = Node { container: bounds, first: range.start as u32, count: range.len() as u32 };
        return;
    }
    // Quarters: halves of halves, each along the longest axis of the whole.
    let extent = bounds.extent();
    let axis = (0..3).max_by(|&a, &b| extent[a].total_cmp(&extent[b])).unwrap_or(0);
    let center = |i: u32| {
        let Triangle { a, b, c } = triangles[i as usize];
        (a + b + c)[axis]
    };
    primitives.sort_by(|&i, &j| center(i).total_cmp(&center(j)));
    let first = tree.nodes.len();
    tree.nodes[index] = Node::interior(bounds, first as u32, 4);
    tree.nodes.resize(first + 4, Node { container: Aabb::EMPTY, first: 0, count: 0 });
    let cut = |quarter: usize| range.start + range.len() * quarter / 4;
    for quarter in 0..4 {
        build(tree, triangles, first + quarter, cut(quarter)..cut(quarter + 1));
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("usage: write_tree FILE")?;
    write(path.as_ref(), &meshes::bumpy_ball(70_000))
}

/// Builds the tree of `triangles` and writes both.
pub fn write(path: &Path, triangles: &[Triangle]) -> Result<(), Box<dyn Error>> {
    let start = Instant::now();
    let root = Node { container: Aabb::EMPTY, first: 0, count: 0 };
    let primitive_indices = (0..triangles.len() as u32).collect();
    // The depth is of no importance to the file.
    let mut tree = Tree { nodes: vec![root], primitive_indices, max_depth: 0 };
    build(&mut tree, triangles, 0, 0..triangles.len());
    let header = Header {
        builder: Some("quarters".to_owned()),
        build_ms: Some(start.elapsed().as_secs_f64() * 1e3),
        ..Header::new(triangles.len())
    };
    let mut file = BufWriter::new(File::create(path)?);
    write_tree(&AnyTree::Aabb(tree), &header, Some(triangles), &mut file, &CancelToken::new())?;
    file.flush()?;
    Ok(())
}
