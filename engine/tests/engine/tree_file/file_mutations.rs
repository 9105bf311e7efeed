//! Files that are cut off or changed at random: refused or read, never a panic.

use bvhscope_engine::tree_file::serde_json::json;
use bvhscope_engine::tree_file::{TreeFile, read_corners};
use bvhscope_engine::{CancelToken, with_tree};

use super::draft::{Draft, read, sample, sample_mesh};
use super::n_ary::{random_tree, scrambled};
use crate::random::Random;
use crate::trees;

/// Memory that reading a damaged file may take.
const LIMIT: u64 = 1 << 24;

/// Reads damaged bytes in every way. What is read holds together: each child stands behind its parent, each slot exists.
fn survive(bytes: &[u8]) -> bool {
    let token = CancelToken::new();
    let _ = read_corners(bytes, LIMIT, &token);
    let mesh = sample_mesh();
    [None, Some(&mesh[..])].into_iter().any(|mesh| {
        let Ok(file) = TreeFile::read(bytes, mesh, LIMIT, &token) else { return false };
        with_tree!(&file.tree, tree => {
            for (number, node) in tree.nodes.iter().enumerate() {
                assert!(node.children().all(|child| number < child as usize && (child as usize) < tree.nodes.len()));
                assert!(!node.is_leaf() || node.slots().end <= tree.primitive_indices.len());
            }
            let children: u32 = tree.nodes.iter().map(|node| node.arity()).sum();
            assert_eq!(children as usize + usize::from(!tree.nodes.is_empty()), tree.nodes.len());
        });
        true
    })
}

#[test]
fn a_file_cut_off_anywhere_is_refused() {
    let bytes = sample().bytes();
    for end in 0..bytes.len() {
        let error = read(&bytes[..end], None).expect_err("a part of a file is no tree");
        assert!(!error.contains('\n'), "{error}");
        assert!(!survive(&bytes[..end]));
    }
    assert!(survive(&bytes));
}

/// `whole` with up to three changes: bytes and bits set at random, parts left out, the end cut off.
pub fn damaged(whole: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    for _ in 0..=random.below(3) {
        let at = random.below(bytes.len());
        match random.below(5) {
            0 => bytes[at] = random.next() as u8,
            1 => bytes[at] ^= 1 << random.below(8),
            2 => bytes.truncate(at),
            3 => drop(bytes.drain(at..(at + 1 + random.below(9)).min(bytes.len()))),
            _ => bytes[at] = [0, 1, b'9', 0x7F, 0x80, 0xFF][random.below(6)],
        }
        if bytes.is_empty() {
            break;
        }
    }
    bytes
}

#[test]
fn changed_bytes_are_refused_or_read() {
    let mut random = Random(71);
    let triangles = trees::soup(60, 0.3, 7);
    let tree = random_tree::<bvhscope_engine::Sphere>(&triangles, 5, &mut random);
    let (other, _) = scrambled(&tree, &triangles, 5, 4, &mut random);
    let corners = Some(triangles.iter().map(|triangle| bytemuck::cast(*triangle)).collect());
    let files = [sample().bytes(), Draft { corners, ..other }.bytes()];
    let (mut read, mut refused) = (0, 0);
    for round in 0..6_000 {
        let bytes = damaged(&files[round % 2], &mut random);
        *if survive(&bytes) { &mut read } else { &mut refused } += 1;
    }
    assert!(read > 300 && refused > 3_000, "{read} read, {refused} refused");
}

#[test]
fn sizes_that_the_file_does_not_bear_out_cost_nothing() {
    for (field, value) in [("nodes", u32::MAX), ("indices", u32::MAX), ("triangles", u32::MAX), ("nodes", 1 << 31)] {
        let mut draft = sample();
        draft.header.insert(field.to_owned(), value.into());
        // No limit: the sizes alone must lead to the refusal.
        assert!(draft.read(None).unwrap_err().contains("of the data, which has"), "{field} {value}");
    }
    let mut draft = Draft { corners: None, ..sample() };
    draft.header.extend(super::draft::header(json!({"triangles": u32::MAX})));
    assert_eq!(draft.read(None).unwrap().faults[0].count, u64::from(u32::MAX) - 4);
}
