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
        "bench builtin:teapot:2 --preset fast --container oriented --allow-outside --fps 30",
        "bench builtin:teapot:2 --container box --no-bvh",
    ] {
        let words: Vec<String> = format!("{command} {common}").split(' ').map(str::to_owned).collect();
        for row in rows(&words) {
            let line = row["command_line"].as_str().unwrap();
            // No word of these has a space within.
            let words: Vec<String> = line.split(' ').skip(1).map(|word| word.trim_matches('\'').to_owned()).collect();
            let again = rows(&words);
            // A row without a tree stands below the row of one.
            let again = again.into_iter().filter(|again| again["builder"] == row["builder"]).collect::<Vec<_>>();
            assert_eq!(again.len(), 1, "{line}");
            for field in [
                "preset",
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

/// The names of the outermost object of `json`, in order, those that stand there twice too.
fn names(json: &str) -> Vec<String> {
    struct Names(Vec<String>);
    impl<'de> serde::Deserialize<'de> for Names {
        fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            struct Visitor;
            impl<'de> serde::de::Visitor<'de> for Visitor {
                type Value = Names;
                fn expecting(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                    formatter.write_str("an object")
                }
                fn visit_map<A: serde::de::MapAccess<'de>>(self, mut map: A) -> Result<Names, A::Error> {
                    let mut names = Vec::new();
                    while let Some((name, _)) = map.next_entry::<String, serde::de::IgnoredAny>()? {
                        names.push(name);
                    }
                    Ok(Names(names))
                }
            }
            deserializer.deserialize_map(Visitor)
        }
    }
    serde_json::from_str::<Names>(json).unwrap().0
}

#[test]
fn each_command_states_its_conditions_once_under_names_of_the_list() {
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/fields.md")).unwrap();
    let model = "builtin:teapot:2";
    let folder = tempfile::tempdir().unwrap();
    let render = format!("render --size 8x8 -o {}", folder.path().join("x.png").display());
    let view = ["eye", "target", "up", "fov", "width_px", "height_px"];
    for (command, has_view) in [
        ("info", false),
        ("info --rays primary --camera front", true),
        (render.as_str(), true),
        ("ray --pixel 4,4 --size 8x8", true),
        ("ray --origin 0,9,0 --direction 0,-1,0", false),
        ("bench --container box --size 8x8 --repeat 1", true),
        ("sweep --threshold 6 --size 8x8 --repeat 1", true),
        ("scaling --threads 1 --size 8x8 --repeat 1", true),
        ("diff --b preset=hq --size 8x8 --repeat 1", false),
    ] {
        let words = format!("{command} {model} --json");
        let output = Command::cargo_bin("bvhscope").unwrap().args(words.split(' ')).output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(output.status.success(), "{command}: {}", String::from_utf8_lossy(&output.stderr));
        let names = names(text.lines().next().unwrap());
        for (index, name) in names.iter().enumerate() {
            assert!(!names[..index].contains(name), "{command}: {name} stands there twice");
            assert!(page.contains(&format!("| `{name}` |")), "{command}: {name} is not in docs/fields.md");
        }
        let has = |name: &str| names.iter().any(|known| known == name);
        assert!(has("command_line"), "{command}");
        if !command.starts_with("diff") {
            for name in
                ["threads", "simd", "version", "machine", "date", "builder", "container", "threshold", "sah_cost"]
            {
                assert!(has(name), "{command} lacks {name}");
            }
            view.iter().for_each(|name| assert_eq!(has(name), has_view, "{command}: {name}"));
        }
    }
}
