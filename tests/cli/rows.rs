//! Rows of the measuring commands: each holds the command line that makes it again.

use assert_cmd::Command;
use serde_json::Value;

fn rows(words: &[String]) -> Vec<Value> {
    let output = Command::cargo_bin("bvhscope").unwrap().args(words).arg("--json").output().unwrap();
    assert!(output.status.success(), "{words:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap().lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[test]
fn a_row_is_made_again_with_the_same_counts() {
    let common = "--size 24x16 --repeat 1 --threads 1 --camera front";
    for command in [
        "sweep builtin:teapot:2 --threshold 5 --epsilon 0.15",
        "bench builtin:teapot:2 --container sphere --traversal paper --rays primary",
        "bench builtin:teapot:2 --preset best --container box --fov 70",
        "bench builtin:cornell --builder lbvh --container box --curve hilbert --eye 1,2,9.125",
    ] {
        let words: Vec<String> = format!("{command} {common}").split(' ').map(str::to_owned).collect();
        for row in rows(&words) {
            let line = row["command_line"].as_str().unwrap();
            // No word of these has a space within.
            let words: Vec<String> = line.split(' ').skip(1).map(|word| word.trim_matches('\'').to_owned()).collect();
            let again = rows(&words);
            assert_eq!(again.len(), 1, "{line}");
            for field in [
                "tree_hash",
                "wide_tree_hash",
                "rays",
                "hits",
                "tests_per_ray",
                "container_tests_per_ray",
                "sah_cost",
                "epo",
                "eye",
                "target",
                "up",
                "fov",
                "width_px",
                "height_px",
                "traversal",
                "threads",
                "simd",
                "populations",
                "command_line",
            ] {
                assert_eq!(again[0].get(field), row.get(field), "{field} of {line}");
            }
        }
    }
}
