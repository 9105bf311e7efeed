//! Each table as Markdown.

use serde_json::Value;

use super::rows::{Rows, Shown, rate, source};

/// Every table.
pub const NAMES: [&str; 8] = ["ready", "ready-one", "trees", "rays", "single", "engines", "picture", "paper"];

/// Settings with their names in tables, and the peer's setting that each is compared with.
const SETTINGS: [(&str, &str, &str); 14] = [
    ("bvhscope", "box fast", "Fast"),
    ("bvhscope", "box hq", "HQ"),
    ("bvhscope", "box best", "Best"),
    ("bvhscope", "box finest", "Finest"),
    ("embree", "low", "Embree LOW"),
    ("embree", "medium", "Embree MEDIUM"),
    ("embree", "high", "Embree HIGH"),
    ("embree 4", "low", "Embree 4 LOW"),
    ("embree 4", "medium", "Embree 4 MEDIUM"),
    ("embree 4", "high", "Embree 4 HIGH"),
    ("obvhs", "fastest", "obvhs fastest"),
    ("obvhs", "medium", "obvhs medium"),
    ("tinybvh", "default", "tinybvh"),
    ("tinybvh", "hq", "tinybvh HQ"),
];
const COMPARED: [(&str, &str); 3] = [("Fast", "LOW"), ("HQ", "MEDIUM"), ("Best", "MEDIUM")];
const KINDS: [(&str, &str); 3] = [("primary", "primary"), ("ao", "ambient occlusion"), ("diffuse", "diffuse")];

/// Lines of cells; the first is the header, and after an empty line the next table begins.
type Lines = Vec<Vec<String>>;
/// Makes a table's lines from its newest rows. The other arguments are all rows, and which of them to show.
type Maker = fn(&[&Value], &Rows, Shown<'_>) -> Lines;

/// The table that a marker names, below a caption with its source; `None` where nothing of it was measured; an error where there is no
/// such table.
pub fn table(marker: &str, rows: &Rows) -> Result<Option<String>, String> {
    let (name, shown) = Shown::parse(marker);
    let (part, lines): (&str, Maker) = match name {
        "ready" => ("build", |rows, _, _| ready(rows, most_threads(rows))),
        "ready-one" => ("build", |rows, _, _| ready(rows, 1)),
        "trees" => ("tree", |rows, _, _| trees(rows)),
        "rays" => ("primary", |rows, all, shown| rays(rows, all, shown, "")),
        "single" => ("primary", |rows, all, shown| rays(rows, all, shown, "single")),
        "engines" => ("primary", engines),
        "picture" => ("picture", |rows, _, _| pictures(rows)),
        "paper" => ("paper", |rows, _, _| paper(rows)),
        _ => return Err(format!("'{name}' is no table")),
    };
    let newest = rows.newest(part, shown);
    if newest.is_empty() {
        return Ok(None);
    }
    let lines = lines(&newest, rows, shown);
    let mut text = format!("{} {}.\n\n", contents(name, &newest), source(&newest));
    let mut is_header = true;
    for line in lines {
        if line.is_empty() {
            text.push('\n');
            is_header = true;
            continue;
        }
        text += &format!("| {} |\n", line.join(" | ")).replace("|  |", "| |").replace("|  |", "| |");
        if is_header {
            text += &format!("|{}\n", "---|".repeat(line.len()));
            is_header = false;
        }
    }
    Ok(Some(text))
}

/// Contents and unit of a table.
fn contents(name: &str, rows: &[&Value]) -> String {
    let repeat = rows[0]["repeat"].as_u64().map_or_else(String::new, |repeat| format!(", medians of {repeat} rounds"));
    match name {
        "ready" => format!(
            "Milliseconds with {} threads{repeat}, binary tree / **ready to trace**, and rates until ready of Embree's.",
            most_threads(rows)
        ),
        "ready-one" => format!(
            "Milliseconds with one thread{repeat}, binary tree / **ready to trace**, and rates until ready of Embree's."
        ),
        "trees" => {
            "SAH cost with the best leaves; end-point overlap; container and triangle tests per ray through the binary \
                    tree (primary, ambient occlusion, diffuse); bytes per triangle, ready to trace."
                .to_owned()
        }
        "rays" => format!("Million rays per second on one thread{repeat}, beside Embree's fastest tree and interface."),
        "single" => format!("Million rays per second on one thread{repeat}, one ray at a time, beside Embree's."),
        "engines" => format!(
            "Million rays per second on one thread{repeat}, one ray at a time: primary, ambient occlusion, diffuse."
        ),
        "picture" => format!(
            "Milliseconds from triangles to a picture with {} threads{repeat}: until ready to trace, primary rays, and 1, 16 and \
             256 ambient occlusion rays from each hit.",
            most_threads(rows)
        ),
        _ => format!("Threshold 6, ε 0.2, 1024×1024 primary rays from the default camera{repeat}; box / sphere."),
    }
}

fn most_threads(rows: &[&Value]) -> u64 {
    rows.iter().filter_map(|row| row["threads"].as_u64()).max().unwrap_or(1)
}

/// Names of the models in order of appearance, each with its number of triangles.
fn models(rows: &[&Value]) -> Vec<(String, String)> {
    let mut models: Vec<(String, String)> = Vec::new();
    for row in rows {
        let name = row["model"].as_str().unwrap_or_default().to_owned();
        if !models.iter().any(|model| model.0 == name) {
            let label = format!("{name} {}", count(row["triangles"].as_u64().unwrap_or(0)));
            models.push((name, label));
        }
    }
    models
}

/// The row of a setting, by its name in tables.
fn of_setting<'a>(rows: &[&'a Value], model: &str, threads: u64, name: &str) -> Option<&'a Value> {
    let (engine, setting, _) = SETTINGS.into_iter().find(|setting| setting.2 == name)?;
    let is_it = |row: &&&Value| {
        row["model"] == model && row["engine"] == engine && row["setting"] == setting && row["threads"] == threads
    };
    rows.iter().find(is_it).copied()
}

fn ready(rows: &[&Value], threads: u64) -> Lines {
    let models = models(rows);
    let is_measured = |name: &str| models.iter().any(|model| of_setting(rows, &model.0, threads, name).is_some());
    let settings: Vec<&str> = SETTINGS.iter().map(|setting| setting.2).filter(|name| is_measured(name)).collect();
    let compared: Vec<(&str, String)> = COMPARED
        .into_iter()
        .map(|(own, peer)| (own, format!("Embree {peer}")))
        .filter(|(own, peer)| is_measured(own) && is_measured(peer))
        .collect();
    let mut header = vec!["scene, triangles".to_owned()];
    header.extend(settings.iter().map(|name| (*name).to_owned()));
    header.extend(compared.iter().map(|(own, peer)| format!("{own} of {}", peer.trim_start_matches("Embree "))));
    let mut lines = vec![header];
    let mut ratios = vec![Vec::new(); compared.len()];
    for (model, label) in &models {
        let ms = |name: &str, clock: &str| of_setting(rows, model, threads, name)?[clock].as_f64();
        let mut line = vec![label.clone()];
        line.extend(settings.iter().map(|name| match ms(name, "ready_ms") {
            Some(ready) => format!("{} / **{}**", ms(name, "build_ms").map_or("–".to_owned(), number), number(ready)),
            None => "–".to_owned(),
        }));
        for ((own, peer), ratios) in compared.iter().zip(&mut ratios) {
            let ratio = ms(peer, "ready_ms").zip(ms(own, "ready_ms")).map(|(peer, own)| peer / own);
            ratios.extend(ratio);
            line.push(ratio.map_or("–".to_owned(), |ratio| format!("{ratio:.2}")));
        }
        lines.push(line);
    }
    if models.len() > 1 && !compared.is_empty() {
        let mut line = vec!["median".to_owned()];
        line.extend(settings.iter().map(|_| String::new()));
        line.extend(ratios.into_iter().map(median));
        lines.push(line);
    }
    lines
}

fn trees(rows: &[&Value]) -> Lines {
    let is_measured = |engine: &str, setting: &str| {
        rows.iter().any(|row| row["engine"] == engine && row["setting"] == setting && row["sah_cost"].is_number())
    };
    // Embree 4 makes the trees of Embree 3.
    let is_shown = |&(engine, setting, _): &(&str, &str, &str)| engine != "embree 4" && is_measured(engine, setting);
    let settings: Vec<_> = SETTINGS.into_iter().filter(is_shown).collect();
    let mut lines = vec![vec!["scene, triangles".to_owned()]];
    lines[0].extend(settings.iter().map(|setting| setting.2.to_owned()));
    for (model, label) in models(rows) {
        let mut line = vec![label];
        for (engine, setting, _) in &settings {
            let is_it = |row: &&&Value| row["model"] == model && row["engine"] == *engine && row["setting"] == *setting;
            let Some(row) = rows.iter().find(is_it) else {
                line.push("–".to_owned());
                continue;
            };
            let tests: Vec<String> = KINDS
                .iter()
                .filter_map(|(kind, _)| {
                    let of = |what: &str| row[format!("{kind}_{what}_tests_per_ray")].as_f64();
                    Some(format!("{:.1}", of("container")? + of("primitive")?))
                })
                .collect();
            let plain =
                |name: &str, digits: usize| row[name].as_f64().map_or("–".to_owned(), |x| format!("{x:.digits$}"));
            let parts = [plain("sah_cost", 1), plain("epo", 2), tests.join(", "), plain("bytes_per_triangle", 0)];
            line.push(parts.join("; "));
        }
        lines.push(line);
    }
    lines
}

/// This engine's Best beside Embree, in the run of `rows`; all interfaces, or the one that is named.
fn rays(rows: &[&Value], all: &Rows, shown: Shown<'_>, interface: &str) -> Lines {
    let mut lines = vec![vec!["scene, triangles".to_owned()]];
    lines[0].extend(KINDS.map(|kind| kind.1.to_owned()));
    let by_kind = KINDS.map(|(kind, _)| all.newest(kind, shown));
    let mut ratios = vec![Vec::new(); KINDS.len()];
    let models = models(rows);
    for (model, label) in &models {
        let mut line = vec![label.clone()];
        for (rows, ratios) in by_kind.iter().zip(&mut ratios) {
            let fastest = |engine: &str| {
                let of_engine = rows.iter().filter(|row| {
                    let is_own = engine != "bvhscope" || row["setting"] == "box best";
                    let fits = interface.is_empty() || row["interface"] == interface;
                    row["model"] == *model && row["engine"] == engine && row["threads"] == 1 && is_own && fits
                });
                let rates = of_engine.filter_map(|row| Some((rate(row)?, row["interface"].as_str()?)));
                rates.max_by(|a, b| a.0.total_cmp(&b.0))
            };
            line.push(match (fastest("bvhscope"), fastest("embree")) {
                (Some((own, _)), Some((peer, name))) => {
                    ratios.push(own / peer);
                    let name = if interface.is_empty() { format!(" ({name})") } else { String::new() };
                    format!("{own:.1} of {peer:.1}{name}: {:.2}", own / peer)
                }
                _ => "–".to_owned(),
            });
        }
        lines.push(line);
    }
    if models.len() > 1 {
        lines.push(["median".to_owned()].into_iter().chain(ratios.into_iter().map(median)).collect());
    }
    lines
}

/// Single rays through the tree of every setting, in the run of `rows`.
fn engines(rows: &[&Value], all: &Rows, shown: Shown<'_>) -> Lines {
    let by_kind = KINDS.map(|(kind, _)| all.newest(kind, shown));
    let rate_of = |rows: &[&Value], model: &str, (engine, setting, _): &(&str, &str, &str)| {
        let is_it = |row: &&&Value| {
            row["model"] == model
                && row["engine"] == *engine
                && row["setting"] == *setting
                && row["threads"] == 1
                && row["interface"] == "single"
        };
        rows.iter().find(is_it).and_then(|row| rate(row))
    };
    let models = models(rows);
    let is_measured = |setting: &_| models.iter().any(|(model, _)| rate_of(rows, model, setting).is_some());
    let settings: Vec<_> = SETTINGS.into_iter().filter(is_measured).collect();
    let mut lines = vec![vec!["scene, triangles".to_owned()]];
    lines[0].extend(settings.iter().map(|setting| setting.2.to_owned()));
    for (model, label) in &models {
        let mut line = vec![label.clone()];
        line.extend(settings.iter().map(|setting| {
            let rates = by_kind.iter().map(|rows| rate_of(rows, model, setting));
            rates.map(|rate| rate.map_or("–".to_owned(), |rate| format!("{rate:.1}"))).collect::<Vec<_>>().join(", ")
        }));
        lines.push(line);
    }
    lines
}

fn pictures(rows: &[&Value]) -> Lines {
    let threads = most_threads(rows);
    let models = models(rows);
    let is_measured = |name: &str| models.iter().any(|model| of_setting(rows, &model.0, threads, name).is_some());
    let settings: Vec<_> = SETTINGS.into_iter().filter(|setting| is_measured(setting.2)).collect();
    let mut lines = vec![vec!["scene, triangles".to_owned()]];
    lines[0].extend(settings.iter().map(|setting| setting.2.to_owned()));
    for (model, label) in &models {
        let mut line = vec![label.clone()];
        for (engine, setting, _) in &settings {
            let is_it = |row: &&&Value| {
                row["model"] == *model
                    && row["engine"] == *engine
                    && row["setting"] == *setting
                    && row["threads"] == threads
            };
            let times = rows.iter().filter(is_it).filter_map(|row| row["picture_ms"].as_f64());
            let times: Vec<String> = times.map(number).collect();
            line.push(if times.is_empty() { "–".to_owned() } else { times.join(", ") });
        }
        lines.push(line);
    }
    lines
}

/// Results of the paper for its scenes, boxes and spheres: build and trace time in milliseconds, tests per ray.
const PAPER: [(&str, [[f64; 2]; 3]); 6] = [
    ("teapot", [[92.0, 126.0], [626.0, 3985.0], [19.0, 49.0]]),
    ("sponza", [[815.0, 1083.0], [3373.0, 32462.0], [119.0, 430.0]]),
    ("car", [[1839.0, 2348.0], [1526.0, 11418.0], [42.0, 114.0]]),
    ("conference", [[2904.0, 3634.0], [2915.0, 51966.0], [114.0, 706.0]]),
    ("buddha", [[4425.0, 5774.0], [497.0, 2339.0], [15.0, 34.0]]),
    ("dragon", [[7807.0, 9824.0], [5042.0, 30999.0], [101.0, 228.0]]),
];
/// Its mean ratios of box to sphere.
const PAPER_MEANS: [&str; 3] = ["0.77", "0.14", "0.35"];

fn paper(rows: &[&Value]) -> Lines {
    let mut times = vec![["scene", "build ms", "paper's", "trace ms", "paper's"].map(str::to_owned).to_vec()];
    let header = ["tests per ray", "ordered", "ratio", "paper's order", "ratio", "paper's", "ratio"];
    let mut tests = vec![header.map(str::to_owned).to_vec()];
    let mut ratios = [const { Vec::new() }; 4];
    let milliseconds = |[a, b]: [f64; 2]| format!("{} / {}", number(a), number(b));
    for (model, published) in PAPER {
        let pair = |traversal: &str, column: &str| {
            ["box", "sphere"].map(|container| {
                let is_it = |row: &&&Value| {
                    row["model"] == model && row["traversal"] == traversal && row["container"] == container
                };
                rows.iter().find(is_it).and_then(|row| row[column].as_f64()).unwrap_or(f64::NAN)
            })
        };
        let [build, trace, ordered] = ["build_ms", "trace_ms", "tests_per_ray"].map(|column| pair("ordered", column));
        let unordered = pair("paper", "tests_per_ray");
        for (ratios, [a, b]) in ratios.iter_mut().zip([build, trace, ordered, unordered]) {
            ratios.push(a / b);
        }
        let [papers_build, papers_trace, papers_tests] = published;
        let whole = |[a, b]: [f64; 2]| format!("{a:.0} / {b:.0}");
        let cells = [milliseconds(build), whole(papers_build), milliseconds(trace), whole(papers_trace)];
        times.push([model.to_owned()].into_iter().chain(cells).collect());
        let cells = [ordered, unordered].map(|[a, b]| [format!("{a:.1} / {b:.1}"), format!("{:.2}", a / b)]);
        let papers = [whole(papers_tests), format!("{:.2}", papers_tests[0] / papers_tests[1])];
        tests.push([model.to_owned()].into_iter().chain(cells.into_iter().flatten()).chain(papers).collect());
    }
    let mean = |ratios: &Vec<f64>| format!("{:.2}", ratios.iter().sum::<f64>() / ratios.len() as f64);
    let [build, trace, ordered, unordered] = ratios.each_ref().map(mean);
    let [papers_build, papers_trace, papers_tests] = PAPER_MEANS.map(str::to_owned);
    times.push(vec!["mean box : sphere".to_owned(), build, papers_build, trace, papers_trace]);
    let none = String::new;
    tests.push(vec!["mean".to_owned(), none(), ordered, none(), unordered, none(), papers_tests]);
    times.push(Vec::new());
    times.append(&mut tests);
    times
}

fn median(mut ratios: Vec<f64>) -> String {
    ratios.sort_by(f64::total_cmp);
    let middle = ratios.len() / 2;
    match ratios.len() {
        0 => "–".to_owned(),
        count if count % 2 == 1 => format!("{:.2}", ratios[middle]),
        _ => format!("{:.2}", (ratios[middle - 1] + ratios[middle]) * 0.5),
    }
}

/// Two digits or more.
fn number(value: f64) -> String {
    if value < 10.0 { format!("{value:.1}") } else { format!("{value:.0}") }
}

/// With commas between thousands.
fn count(value: u64) -> String {
    let digits = value.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}
