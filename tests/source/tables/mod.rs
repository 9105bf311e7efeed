//! The tables of measurements in the documentation are generated from `docs/performance.jsonl`, those of counts from
//! `docs/counts.jsonl` ([`count_rows`]): no figure is typed. Tables of numbers that are neither are listed, so that no other is added.
//!
//! `make tables` (`UPDATE_TABLES=1 cargo test --workspace --test source tables`) writes them anew. A table stands between the lines
//! `<!-- table: NAME -->` and `<!-- end of table -->`, where NAME may be followed by `large`: then it shows scenes of 2 million
//! triangles and more, otherwise the others; and by `simd=LEVEL`: then only runs with that limit count, otherwise only those without
//! any. Each table comes from the newest run that measured what it shows; before there is one,
//! the text between the lines stays as it is.

mod count_rows;
mod generate;
mod measured_rows;
#[path = "../../../benches/peers/newest.rs"]
mod newest;
#[path = "../../../benches/peers/packed.rs"]
mod packed;

use std::path::Path;

use count_rows::Counts;
use generate::table;
use measured_rows::{Rows, Shown};
use serde_json::Value;

/// Documents with tables.
const DOCUMENTS: [&str; 4] = ["docs/performance.md", "docs/paper.md", "docs/containers.md", "README.md"];
const COUNTS: &str = "docs/counts.jsonl";
const ROWS: &str = "docs/performance.jsonl";
const PINNED: &str = "tests/picture/pinned_trees.txt";
const BEGIN: &str = "<!-- table: ";
const END: &str = "<!-- end of table -->";

fn text_of(path: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn counts() -> Counts {
    Counts::parse(&text_of(COUNTS)).unwrap()
}

/// `document` with the tables that `rows` and `counts` give, and how many there are; a message where a marker is wrong.
fn with_tables(document: &str, rows: &Rows, counts: &Counts) -> Result<(String, usize), String> {
    let mut text = String::new();
    let (mut lines, mut tables) = (document.lines(), 0);
    while let Some(line) = lines.next() {
        text.extend([line, "\n"]);
        let Some(name) = line.strip_prefix(BEGIN) else {
            if line == END {
                return Err(format!("'{END}' without a beginning"));
            }
            continue;
        };
        let name = name.strip_suffix(" -->").ok_or_else(|| format!("'{line}' does not end with ' -->'"))?;
        let mut old = String::new();
        loop {
            match lines.next() {
                Some(END) => break,
                Some(line) if !line.starts_with(BEGIN) => old.extend([line, "\n"]),
                _ => return Err(format!("the table '{name}' has no end")),
            }
        }
        let table = match name.strip_prefix("counts ") {
            Some(marker) => Some(counts.table(marker)?),
            None => table(name, rows)?,
        };
        text.push_str(&table.unwrap_or(old));
        text.extend([END, "\n"]);
        tables += 1;
    }
    Ok((text, tables))
}

#[test]
fn tables_of_the_documentation_come_from_the_measured_rows() {
    let (rows, counts) = (Rows::parse(&text_of(ROWS)).unwrap(), counts());
    let (mut count, mut sentences) = (0, 0);
    for document in DOCUMENTS {
        let old = text_of(document);
        let (new, tables) = with_tables(&old, &rows, &counts).unwrap_or_else(|error| panic!("{document}: {error}"));
        count += tables;
        sentences += counts.check_sentences(&old).unwrap_or_else(|error| panic!("{document}: {error}"));
        if std::env::var_os("UPDATE_TABLES").is_some() {
            std::fs::write(Path::new(env!("CARGO_MANIFEST_DIR")).join(document), new).unwrap();
        } else {
            assert!(
                old == new,
                "{document}: a table is not what {ROWS} or {COUNTS} gives; `make tables` writes it anew"
            );
        }
    }
    assert!(count >= 10 && sentences >= 5, "there are only {count} tables and {sentences} numbers of sentences");
}

/// Tables of measurements whose rows were not kept: each is below the words that say how it was made.
const WITHOUT_ROWS: [&str; 12] = [
    "  | scene | file | camera |",
    "| cores | build | from",
    "| scene | 2 cores | 4 |",
    "| rays | hair box |",
    "| part | instructions |",
    "  | order | bunny |",
    "| update | boxes |",
    "| refit, instructions",
    "| update | dragon,",
    "| model, triangles | | build |",
    "| scene | rays | flat |",
    "| model | lbvh |",
];

#[test]
fn every_table_of_measurements_comes_from_rows_or_is_listed() {
    let has_decimals = |line: &str| {
        let digit = |c: Option<char>| c.is_some_and(|c| c.is_ascii_digit());
        line.char_indices()
            .any(|(at, c)| c == '.' && digit(line[..at].chars().last()) && digit(line[at + 1..].chars().next()))
    };
    for document in DOCUMENTS {
        let (mut in_table, mut head): (bool, Option<&str>) = (false, None);
        for line in text_of(document).leak().lines() {
            in_table = (in_table || line.starts_with(BEGIN)) && line != END;
            head = line.trim_start().starts_with('|').then(|| head.unwrap_or(line));
            let Some(head) = head.filter(|_| !in_table && has_decimals(line)) else { continue };
            let is_listed = WITHOUT_ROWS.iter().any(|listed| head.starts_with(listed));
            assert!(is_listed, "{document}: the table '{head}' comes from no rows");
        }
    }
}

/// The trees are the same on every machine, so that rows of another tree are out of date.
#[test]
fn the_papers_tables_are_of_the_trees_that_are_built_now() {
    let rows = Rows::parse(&text_of(ROWS)).unwrap();
    let pinned = text_of(PINNED);
    for row in rows.newest("paper", Shown::default()) {
        let (file, container) = (row["file"].as_str().unwrap(), row["container"].as_str().unwrap());
        let hash = row["tree_hash"].as_str().unwrap();
        let found = pinned.lines().find(|line| {
            let words: Vec<&str> = line.split(' ').collect();
            words[0] == file && words[2..4] == [row["preset"].as_str().unwrap(), container]
        });
        let expected = found.unwrap_or_else(|| panic!("{file} {container} is not in {PINNED}")).split(' ').nth(4);
        assert_eq!(
            expected,
            Some(hash),
            "{file} {container} was measured on another tree: measure again with `make peers PEERS=\"--scenes= --paper\"`"
        );
    }
}

const SAMPLE: &str = r#"
{"part":"build","date":"2026-01-02T03:04Z","machine":"A, 2 threads","commit":"0123456789","flags":"","model":"old","triangles":7,"engine":"bvhscope","setting":"box fast","threads":1,"build_ms":1.0,"ready_ms":2.0,"repeat":5}
{"part":"build","date":"2026-01-03T03:04Z","machine":"B, 2 threads","commit":"abcdef0123","flags":"--repeat 9","model":"bunny","triangles":69451,"engine":"bvhscope","setting":"box fast","threads":1,"build_ms":9.0,"ready_ms":14.0,"repeat":9}
{"part":"build","date":"2026-01-03T03:04Z","machine":"B, 2 threads","commit":"abcdef0123","flags":"--repeat 9","model":"bunny","triangles":69451,"engine":"bvhscope","setting":"box fast","threads":2,"build_ms":5.0,"ready_ms":8.0,"repeat":9}
{"part":"build","date":"2026-01-03T03:04Z","machine":"B, 2 threads","commit":"abcdef0123","flags":"--repeat 9","model":"bunny","triangles":69451,"engine":"embree","setting":"low","threads":2,"build_ms":null,"ready_ms":4.0,"repeat":9}
{"part":"build","date":"2026-01-03T03:04Z","machine":"B, 2 threads","commit":"abcdef0123","flags":"--repeat 9","model":"dragon","triangles":871198,"engine":"bvhscope","setting":"box fast","threads":2,"build_ms":50.0,"ready_ms":90.0,"repeat":9}
{"part":"build","date":"2026-01-03T03:04Z","machine":"B, 2 threads","commit":"abcdef0123","flags":"--repeat 9","model":"dragon","triangles":871198,"engine":"embree","setting":"low","threads":2,"build_ms":null,"ready_ms":63.0,"repeat":9}
{"part":"build","date":"2026-01-03T04:04Z","machine":"C, 2 threads","commit":"abcdef0123","flags":"--scenes terrain","model":"terrain","triangles":9999392,"engine":"embree","setting":"low","threads":2,"build_ms":null,"ready_ms":700.0,"repeat":9}
{"part":"build","date":"2026-01-04T03:04Z","machine":"B, 2 threads","simd":"avx2","commit":"abcdef0123","flags":"--simd avx2","model":"bunny","triangles":69451,"engine":"embree","setting":"low","threads":2,"build_ms":null,"ready_ms":6.0,"repeat":9}
"#;

#[test]
fn a_table_shows_the_newest_run_without_and_with_a_limit() {
    let rows = Rows::parse(SAMPLE).unwrap();
    let document = format!(
        "before\n{BEGIN}ready -->\nstale\n{END}\nbetween\n{BEGIN}ready simd=avx2 -->\n{END}\nafter\n\
                {BEGIN}ready large -->\n{END}\n"
    );
    let counts = Counts::parse("").unwrap();
    let (text, tables) = with_tables(&document, &rows, &counts).unwrap();
    assert_eq!(tables, 3);
    let lines: Vec<&str> = text.lines().filter(|line| line.starts_with('|')).collect();
    let expected = [
        "| scene, triangles | Fast | Embree LOW |",
        "|---|---|---|",
        "| bunny 69,451 | 8.0 | 4.0 |",
        "| dragon 871,198 | 90 | 63 |",
        "| rate | median | least | most |",
        "|---|---|---|---|",
        "| Fast of Embree LOW | 0.60 | 0.50 | 0.70 |",
    ];
    assert_eq!(lines[..7], expected);
    assert_eq!(lines[9], "| bunny 69,451 | 6.0 |", "the run with a limit");
    assert_eq!(lines[10..], ["| scene, triangles | Embree LOW |", "|---|---|", "| terrain 9,999,392 | 700 |"]);
    assert!(text.contains("B, 2 threads, 2026-01-03, commit abcdef0123."), "{text}");
    assert!(text.starts_with("before\n") && text.contains("\nbetween\n") && text.contains("\nafter\n"), "{text}");
    assert!(!text.contains("stale") && !text.contains("old"), "{text}");
    // As the documents' test does: what was written compares equal, and a changed figure does not.
    assert_eq!(with_tables(&text, &rows, &counts).unwrap().0, text);
    let changed = text.replace("| 90 |", "| 80 |");
    assert_ne!(with_tables(&changed, &rows, &counts).unwrap().0, changed);
}

/// As many numbers as a reader takes in at once.
#[test]
fn tables_have_at_most_six_columns_of_one_number_each() {
    let rows = Rows::parse(&text_of(ROWS)).unwrap();
    for name in generate::NAMES {
        let Some(text) = table(name, &rows).unwrap() else { continue };
        for line in text.lines().filter(|line| line.starts_with('|')) {
            assert!(line.matches('|').count() <= 7, "{name}: {line}");
            let cells = line.split('|').map(str::trim).skip(2);
            let several =
                cells.filter(|cell| cell.split([' ', '/', ',', ';']).filter(|w| w.parse::<f64>().is_ok()).count() > 1);
            assert_eq!(several.count(), 0, "{name}: {line}");
        }
    }
}

#[test]
fn the_file_holds_the_newest_run_of_each_machine_and_flags_and_is_small() {
    let text = text_of(ROWS);
    assert!(text.len() <= newest::MAX_BYTES, "{ROWS} has {} bytes", text.len());
    assert!(newest::newest(&text, newest::MAX_BYTES).unwrap() == text, "{ROWS} holds runs that were measured again");

    let run = |machine: &str, flags: &str, day: u32, part: &str| {
        format!("{{\"machine\":\"{machine}\",\"flags\":\"{flags}\",\"date\":\"2026-01-0{day}\",\"part\":\"{part}\"}}\n")
    };
    let [old, again, other] = [run("A", "", 1, "build"), run("A", "", 3, "build"), run("A", "--simd avx2", 2, "build")];
    let [first, second] = [run("B", "", 4, "build"), run("B", "", 4, "tree")];
    let all = [&old[..], &again, &other, &first, &second].concat();
    let kept = |max_bytes| newest::newest(&all, max_bytes).unwrap();
    assert_eq!(kept(1000), [&again[..], &other, &first, &second].concat(), "measured again");
    let all_but_one = again.len() + first.len() + second.len();
    assert_eq!(kept(all_but_one), [&again[..], &first, &second].concat(), "the oldest leaves");
    assert_eq!(kept(all_but_one - 1), [&first[..], &second].concat(), "as a whole, and a run with all its parts stays");
    assert_eq!(kept(1), [&first[..], &second].concat(), "the newest always stays");
    assert!(newest::newest("nonsense", 1000).is_err());
}

#[test]
fn rows_are_the_same_after_packing() {
    let mut run = Rows::parse(SAMPLE).unwrap().0;
    run.retain(|row| row["date"] == "2026-01-03T03:04Z");
    let lines: String = packed::pack(&run).iter().map(|line| format!("{line}\n")).collect();
    assert_eq!(lines.lines().count(), 1, "one part");
    let mut unpacked = Rows::parse(&lines).unwrap().0;
    for rows in [&mut run, &mut unpacked] {
        rows.sort_by_key(Value::to_string);
    }
    assert_eq!(unpacked, run);
    assert!(Rows::parse(&lines.replace("\"columns\":[", "\"columns\":[\"more\",")).unwrap_err().contains("do not fit"));
}

#[test]
fn a_table_without_rows_keeps_its_text_and_a_wrong_marker_is_an_error() {
    let (rows, counts) = (Rows::parse("").unwrap(), Counts::parse("").unwrap());
    for name in generate::NAMES {
        let document = format!("{BEGIN}{name} -->\n| as it was |\n{END}\n");
        assert_eq!(with_tables(&document, &rows, &counts).unwrap(), (document, 1));
    }
    for (document, message) in [
        (format!("{BEGIN}nonsense -->\n{END}\n"), "'nonsense' is no table"),
        (format!("{BEGIN}ready -->\nno end\n"), "the table 'ready' has no end"),
        (format!("{BEGIN}ready\n{END}\n"), "does not end with"),
        (format!("{END}\n"), "without a beginning"),
    ] {
        let error = with_tables(&document, &rows, &counts).unwrap_err();
        assert!(error.contains(message), "{error}");
    }
    assert!(Rows::parse("{\"part\":\"build\"}\n").unwrap_err().contains("line 1"), "a row without its run");
    assert!(Rows::parse("{}\nnonsense\n").is_err());
}
