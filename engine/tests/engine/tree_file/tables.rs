//! The nodes as tables for notebooks.

use bvhscope_engine::CancelToken;
use bvhscope_engine::tree_file::serde_json::{self, Value, json};
use bvhscope_engine::tree_file::{write_nodes_csv, write_nodes_json};

use super::draft::{Draft, header, is_cancelled, sample};

#[test]
fn each_node_is_a_row() {
    let file = sample().read(None).unwrap();
    let mut text = Vec::new();
    write_nodes_csv(&file.tree, &mut text, &CancelToken::new()).unwrap();
    let expected = "\
node,parent,depth,first_child,children,first_primitive,primitives,min_x,min_y,min_z,max_x,max_y,max_z,triangles
0,,0,1,2,0,4,0.0,0.0,0.0,3.0,1.0,1.0,
1,0,1,3,2,0,2,0.0,0.0,0.0,1.0,1.0,1.0,
2,0,1,,0,2,2,2.0,0.0,0.0,3.0,1.0,1.0,2 3
3,1,2,,0,0,1,0.0,0.0,0.0,0.0,1.0,1.0,0
4,1,2,,0,1,1,1.0,0.0,0.0,1.0,1.0,1.0,1
";
    assert_eq!(String::from_utf8(text).unwrap(), expected);
}

#[test]
fn json_has_the_same_rows_and_the_primitives() {
    let draft = Draft {
        header: header(json!({"container": "sphere", "arity": 2, "builder": "a \"b\"", "build_ms": 2.5})),
        bounds: vec![vec![1.5, 0.5, 0.5, 4.0]; 5],
        ..sample()
    };
    let file = draft.read(None).unwrap();
    let mut text = Vec::new();
    write_nodes_json(&file.tree, &file.header, &mut text, &CancelToken::new()).unwrap();
    let found: Value = serde_json::from_slice(&text).unwrap();
    let expected = json!({
        "container": "sphere", "triangles": 4, "builder": "a \"b\"", "build_ms": 2.5,
        "columns": ["node", "parent", "depth", "first_child", "children", "first_primitive", "primitives",
                    "center_x", "center_y", "center_z", "radius"],
        "nodes": [
            [0, null, 0, 1, 2, 0, 4, 1.5, 0.5, 0.5, 4.0],
            [1, 0, 1, 3, 2, 0, 2, 1.5, 0.5, 0.5, 4.0],
            [2, 0, 1, null, 0, 2, 2, 1.5, 0.5, 0.5, 4.0],
            [3, 1, 2, null, 0, 0, 1, 1.5, 0.5, 0.5, 4.0],
            [4, 1, 2, null, 0, 1, 1, 1.5, 0.5, 0.5, 4.0],
        ],
        "indices": [0, 1, 2, 3],
    });
    assert_eq!(found, expected);
}

#[test]
fn a_tree_without_nodes_is_a_table_without_rows() {
    let empty = bvhscope_engine::AnyTree::Aabb(bvhscope_engine::tree::Tree::EMPTY);
    let about = bvhscope_engine::tree_file::Header::new(0);
    let (mut csv, mut text) = (Vec::new(), Vec::new());
    write_nodes_csv(&empty, &mut csv, &CancelToken::new()).unwrap();
    write_nodes_json(&empty, &about, &mut text, &CancelToken::new()).unwrap();
    assert_eq!(csv.iter().filter(|&&byte| byte == b'\n').count(), 1);
    let found: Value = serde_json::from_slice(&text).unwrap();
    assert_eq!((&found["nodes"], &found["indices"]), (&json!([]), &json!([])));
    let token = CancelToken::new();
    token.cancel();
    let file = sample().read(None).unwrap();
    assert!(is_cancelled(&write_nodes_csv(&file.tree, &mut Vec::new(), &token).unwrap_err()));
}
