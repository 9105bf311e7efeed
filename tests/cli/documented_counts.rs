//! The counts in the documentation: `docs/counts.txt` has the commands that make them, `docs/counts.jsonl` their numbers.
//!
//! A line of the first is `STUDY | LINE | COLUMN | FIELDS | COMMAND`: the table, its line and its column, in which `{field}` stands for a
//! field of the row, the numbers to keep, and the command with paths below the folder of models. Rows of one line and column are averaged.
//! `make counts` (`UPDATE_COUNTS=1 cargo test --test cli counts`) runs all, or with `UPDATE_COUNTS=STUDY,…` those of some studies.
//! Trees and rays are the same on every machine, so that the test runs the quickest of them again and expects the same numbers.

use std::path::Path;

use assert_cmd::Command;
use serde_json::{Map, Value, json};

use crate::support::models;

const RECIPES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/counts.txt");
const COUNTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/counts.jsonl");

/// The rows of a line and a column.
type Place = ([String; 2], Vec<Map<String, Value>>);

/// A command, and the labels of what it makes.
struct Recipe<'a> {
    study: &'a str,
    line: &'a str,
    column: &'a str,
    fields: Vec<&'a str>,
    command: &'a str,
}

fn recipes(text: &str) -> Vec<Recipe<'_>> {
    let lines = text.lines().filter(|line| !line.is_empty() && !line.starts_with('#'));
    let recipe = |line| {
        let [study, line, column, fields, command] = <[&str; 5]>::try_from(str::split(line, " | ").collect::<Vec<_>>())
            .unwrap_or_else(|parts| panic!("five parts are expected: {parts:?}"));
        Recipe { study, line, column, fields: fields.split(',').collect(), command }
    };
    lines.map(recipe).collect()
}

impl Recipe<'_> {
    /// Runs it below `folder`. A row for each line and column.
    fn run(&self, folder: &Path) -> Vec<Value> {
        let output = Command::cargo_bin("bvhscope")
            .unwrap()
            .args(self.command.split(' ').chain(["--repeat", "1", "--json"]))
            .current_dir(folder)
            .output()
            .unwrap();
        assert!(output.status.success(), "{}: {}", self.command, String::from_utf8_lossy(&output.stderr));
        let mut found: Vec<Place> = Vec::new();
        for line in std::str::from_utf8(&output.stdout).unwrap().lines() {
            let row = with_populations(serde_json::from_str(line).unwrap());
            if row.get("command").is_none() {
                continue;
            }
            let place = [self.line, self.column].map(|label| filled(label, &row));
            match found.iter_mut().find(|(of_place, _)| *of_place == place) {
                Some((_, rows)) => rows.push(row),
                None => found.push((place, vec![row])),
            }
        }
        let merged = |([line, column], rows): Place| {
            let mut merged = json!({ "study": self.study, "line": line, "column": column, "command": self.command });
            for name in &self.fields {
                let values: Vec<f64> = rows.iter().filter_map(|row| row.get(*name)?.as_f64()).collect();
                assert!(!values.is_empty(), "{}: no {name}", self.command);
                // Seven digits, as many as single precision has.
                let mean = values.iter().sum::<f64>() / values.len() as f64;
                merged[*name] = format!("{mean:.6e}").parse::<f64>().unwrap().into();
            }
            merged
        };
        found.into_iter().map(merged).collect()
    }

    /// Whether a machine without models runs it in a moment.
    fn is_quick(&self) -> bool {
        self.command.contains("builtin:tilted") || self.command.contains("builtin:cloth")
    }
}

/// A row in which each number of a population is a field, such as `ao_tests_per_entering_ray`.
fn with_populations(mut row: Map<String, Value>) -> Map<String, Value> {
    if let Some(Value::Array(populations)) = row.remove("populations") {
        for rays in populations {
            let name = rays["population"].as_str().unwrap().to_owned();
            let fields = rays.as_object().unwrap().iter().filter(|(_, value)| value.is_number());
            row.extend(fields.map(|(key, value)| (format!("{name}_{key}"), value.clone())));
        }
    }
    row
}

/// A label with its fields filled in.
fn filled(label: &str, row: &Map<String, Value>) -> String {
    row.iter().fold(label.to_owned(), |text, (name, value)| {
        let value = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        text.replace(&format!("{{{name}}}"), &value)
    })
}

#[test]
fn the_counts_of_the_documentation_are_made_by_its_commands() {
    let text = std::fs::read_to_string(RECIPES).unwrap();
    let recipes = recipes(&text);
    let recorded = std::fs::read_to_string(COUNTS).unwrap_or_default();
    let recorded: Vec<Value> = recorded.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    if let Some(studies) = std::env::var_os("UPDATE_COUNTS") {
        let folder = models().unwrap().canonicalize().unwrap();
        let studies = studies.into_string().unwrap();
        let is_wanted = |study: &str| studies == "1" || studies.split(',').any(|wanted| wanted == study);
        let of = |recipe: &Recipe| {
            if is_wanted(recipe.study) {
                return recipe.run(&folder);
            }
            let is_it = |row: &&Value| row["study"] == recipe.study && row["command"] == recipe.command;
            recorded.iter().filter(is_it).cloned().collect()
        };
        let mut lines: Vec<String> = recipes.iter().flat_map(of).map(|row| format!("{row}\n")).collect();
        lines.dedup();
        std::fs::write(COUNTS, lines.concat()).unwrap();
        return;
    }
    for row in &recorded {
        let is_it = |recipe: &&Recipe| row["study"] == recipe.study && row["command"] == recipe.command;
        assert!(recipes.iter().any(|recipe| is_it(&recipe)), "{row} is of no command in docs/counts.txt");
    }
    let quick: Vec<&Recipe> = recipes.iter().filter(|recipe| recipe.is_quick()).collect();
    assert!(quick.len() >= 2, "{}", quick.len());
    let near = |a: &Value, b: &Value| match (a.as_f64(), b.as_f64()) {
        (Some(a), Some(b)) => (a - b).abs() <= 2e-6 * b.abs(),
        _ => a == b,
    };
    for recipe in quick {
        for row in recipe.run(Path::new(".")) {
            let is_it = |old: &&Value| ["study", "line", "column"].iter().all(|name| old[*name] == row[*name]);
            let old = recorded.iter().find(is_it).unwrap_or_else(|| panic!("{row} is not in docs/counts.jsonl"));
            let is_same = row.as_object().unwrap().iter().all(|(name, value)| near(value, &old[name]));
            assert!(is_same, "{row} was {old}: `make counts` measures again");
        }
    }
}

/// Times are left out of them: rows of counts are the same on every machine.
#[test]
fn the_figures_of_thresholds_are_plots_of_the_counts() {
    let counts = std::fs::read_to_string(COUNTS).unwrap();
    let counts: Vec<Value> = counts.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let folder = tempfile::tempdir().unwrap();
    for container in ["box", "sphere"] {
        let study = format!("threshold-{container}");
        let row = |row: &Value| {
            let mut measured = json!({
                "command": "sweep", "model": row["column"], "builder": "aac", "container": container, "epsilon": 0.2,
                "traversal": "ordered", "threads": 1, "width_px": 512, "height_px": 512, "repeat": 1,
            });
            measured["threshold"] = row["line"].as_str().unwrap().parse::<f64>().unwrap().into();
            for field in ["tests_per_entering_ray", "sah_cost"] {
                measured[field] = row[field].clone();
            }
            measured["triangles"] = (row["triangles"].as_f64().unwrap() as u64).into();
            format!("{measured}\n")
        };
        let rows: String = counts.iter().filter(|row| row["study"] == study.as_str()).map(row).collect();
        let [from, to] = ["rows.jsonl", "plot.svg"].map(|name| folder.path().join(name));
        std::fs::write(&from, rows).unwrap();
        Command::cargo_bin("bvhscope").unwrap().arg("plot").arg(&from).arg("-o").arg(&to).assert().success();
        let plot = std::fs::read(&to).unwrap();
        let kept = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("assets/paper/sweep-{container}.svg"));
        if std::env::var_os("UPDATE_COUNTS").is_some() {
            std::fs::write(&kept, &plot).unwrap();
        }
        assert!(std::fs::read(&kept).unwrap() == plot, "{}: `make counts` draws it again", kept.display());
    }
}
