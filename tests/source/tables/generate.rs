//! Each table as Markdown.

use serde_json::Value;

use super::measured_rows::{Rows, Shown, rate, source};

/// Every table.
pub const NAMES: [&str; 12] = [
    "ready",
    "ready-one",
    "costs",
    "trees",
    "memory",
    "rays",
    "single",
    "robust",
    "queries",
    "engines",
    "picture",
    "paper",
];

/// Every sentence, with the part of the rows that it is about.
const SENTENCES: [(&str, &str); 3] = [("picture-range", "picture"), ("costs-range", "tree"), ("paper-range", "paper")];

/// Settings with their names in tables.
const SETTINGS: [Setting; 19] = [
    ("bvhscope", "box swift", "Swift"),
    ("bvhscope", "box fast", "Fast"),
    ("bvhscope", "box hq", "HQ"),
    ("bvhscope", "box best", "Best"),
    ("bvhscope", "box finest", "Finest"),
    ("embree", "low", "Embree LOW"),
    ("embree", "medium", "Embree MEDIUM"),
    ("embree", "high", "Embree HIGH"),
    ("embree", "low robust", "Embree robust LOW"),
    ("embree", "medium robust", "Embree robust MEDIUM"),
    ("embree 4", "low", "Embree 4 LOW"),
    ("embree 4", "medium", "Embree 4 MEDIUM"),
    ("embree 4", "high", "Embree 4 HIGH"),
    ("embree 4", "low robust", "Embree 4 robust LOW"),
    ("embree 4", "medium robust", "Embree 4 robust MEDIUM"),
    ("obvhs", "fastest", "obvhs fastest"),
    ("obvhs", "medium", "obvhs medium"),
    ("tinybvh", "default", "tinybvh"),
    ("tinybvh", "hq", "tinybvh HQ"),
];
/// Settings that tables with a line for each scene show.
const CHOSEN: [&str; 5] = ["Swift", "Fast", "Best", "Embree LOW", "Embree MEDIUM"];
/// The setting to which others are relative.
const BASE: &str = "Embree MEDIUM";
const COMPARED: [(&str, &str); 4] =
    [("Swift", "Embree LOW"), ("Fast", "Embree LOW"), ("HQ", "Embree MEDIUM"), ("Best", "Embree MEDIUM")];
const KINDS: [(&str, &str); 3] = [("primary", "primary"), ("ao", "ambient occlusion"), ("diffuse", "diffuse")];
/// Rates of all hits and of closest points.
const QUERIES: [Rates<'_>; 3] = [
    Rates { kind: "all-hits", title: "all hits", interface: "", is_robust: false },
    Rates { kind: "all-hits", title: "all hits, robust", interface: "", is_robust: true },
    Rates { kind: "closest-point", title: "closest point", interface: "", is_robust: false },
];
/// Engines with their names in tables.
const ENGINES: [(&str, &str); 5] = [
    ("bvhscope", "this engine"),
    ("embree", "Embree"),
    ("embree 4", "Embree 4"),
    ("obvhs", "obvhs"),
    ("tinybvh", "tinybvh"),
];

/// Lines of cells; the first is the header, and after an empty line the next table begins.
type Lines = Vec<Vec<String>>;
/// Makes a table's lines from its newest rows. The other arguments are all rows, and which of them to show.
type Maker = fn(&[&Value], &Rows, Shown<'_>) -> Lines;

/// The table that a marker names, below a caption with its source; `None` where nothing of it was measured; an error where there is no
/// such table.
pub fn table(marker: &str, rows: &Rows) -> Result<Option<String>, String> {
    let (name, shown) = Shown::parse(marker);
    if let Some((_, part)) = SENTENCES.into_iter().find(|(sentence, _)| *sentence == name) {
        let newest = rows.newest(part, shown);
        return Ok((!newest.is_empty()).then(|| sentence(name, &newest)));
    }
    let (part, lines): (&str, Maker) = match name {
        "ready" => ("build", |rows, _, _| ready(rows, most_threads(rows))),
        "ready-one" => ("build", |rows, _, _| ready(rows, 1)),
        "costs" => ("tree", |rows, _, _| costs(rows)),
        "trees" => ("tree", |rows, _, _| trees(rows)),
        "memory" => ("tree", |rows, _, _| memory(rows)),
        "rays" => ("primary", |rows, all, shown| rays(&with_all_kinds(rows, all, shown), of_kinds("", false))),
        "single" => ("primary", |rows, all, shown| rays(&with_all_kinds(rows, all, shown), of_kinds("single", false))),
        "robust" => ("primary", |rows, all, shown| rays(&with_all_kinds(rows, all, shown), of_kinds("single", true))),
        "queries" => ("closest-point", |rows, all, shown| rays(&with_all_kinds(rows, all, shown), QUERIES)),
        "engines" => ("primary", |rows, all, shown| engines(&with_all_kinds(rows, all, shown))),
        "picture" => ("picture", |rows, _, _| pictures(rows)),
        "paper" => ("paper", |rows, _, _| paper(rows)),
        _ => return Err(format!("'{name}' is no table")),
    };
    let newest = rows.newest(part, shown);
    let lines = if newest.is_empty() { Lines::new() } else { lines(&newest, rows, shown) };
    if lines.is_empty() {
        return Ok(None);
    }
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
    let rates = |of: &str| format!("Rays per second on one thread{repeat}, Best's over those of {of}.");
    match name {
        "ready" => format!("Milliseconds until ready to trace, {} threads{repeat}.", most_threads(rows)),
        "ready-one" => format!("Milliseconds until ready to trace, one thread{repeat}."),
        "costs" => "SAH cost of boxes, each tree with its best leaves.".to_owned(),
        "trees" => format!(
            "SAH cost with the best leaves, end-point overlap, and container and triangle tests per ray through the binary tree, each \
             over that of {BASE}: medians of all scenes."
        ),
        "memory" => "Bytes per triangle, ready to trace, and bytes that a ray reads of the tree in this engine's wide form: medians of all \
                     scenes."
            .to_owned(),
        "rays" => rates("Embree's fastest tree and interface"),
        "single" => rates("Embree, both one ray at a time"),
        "robust" => rates("Embree's robust scenes, which are as watertight, both one ray at a time"),
        "queries" => format!(
            "Queries per second on one thread{repeat}, Best's over those of Embree's fastest tree: all hits of primary rays in order, \
             with a filter function that collects, without and with its flag for robust scenes, and the nearest point of the mesh for \
             points in the scene's box."
        ),
        "engines" => format!(
            "Rays per second on one thread{repeat}, one ray at a time, over those of {BASE}: medians of all scenes."
        ),
        "picture" => format!(
            "Milliseconds from triangles to a picture with {} threads{repeat}: until ready to trace, primary rays, and 1, 16 or 256 \
             rays of ambient occlusion from each hit, with the setting that is soonest there.",
            most_threads(rows)
        ),
        _ => format!("Threshold 6, ε 0.2, 1024×1024 primary rays from outside{repeat}; ratio of box to sphere."),
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

/// Engine, setting and name of a row of [`SETTINGS`].
type Setting = (&'static str, &'static str, &'static str);
/// A number of a setting in a scene.
type Cell<'a> = Box<dyn Fn(&Scene<'_>, &Setting) -> Option<f64> + 'a>;

/// The rows of a scene.
struct Scene<'a> {
    label: String,
    rows: Vec<&'a Value>,
}

impl<'a> Scene<'a> {
    /// The scenes of `rows`, in order of appearance.
    fn all(rows: &[&'a Value]) -> Vec<Self> {
        let of_model = |model: &str| rows.iter().filter(|row| row["model"] == model).copied().collect();
        models(rows).into_iter().map(|(model, label)| Self { label, rows: of_model(&model) }).collect()
    }

    /// Rows of an engine's setting.
    fn of<'s>(&'s self, (engine, setting, _): &'s Setting) -> impl Iterator<Item = &'a Value> + 's {
        self.rows.iter().copied().filter(move |row| row["engine"] == *engine && row["setting"] == *setting)
    }

    /// A number of a setting's first row that `is_it`.
    fn number(&self, setting: &Setting, name: &str, is_it: impl Fn(&Value) -> bool) -> Option<f64> {
        self.of(setting).filter(|row| is_it(row)).map(|row| &row[name]).find_map(Value::as_f64)
    }
}

/// The scenes of `rows` with the rows of all kinds of rays and queries.
fn with_all_kinds<'a>(rows: &[&'a Value], all: &'a Rows, shown: Shown<'_>) -> Vec<Scene<'a>> {
    let kinds = KINDS.iter().map(|(kind, _)| *kind).chain(["all-hits", "closest-point"]);
    let kinds: Vec<&Value> = kinds.flat_map(|kind| all.newest(kind, shown)).collect();
    let mut scenes = Scene::all(&kinds);
    scenes.retain(|scene| rows.iter().any(|row| row["model"] == scene.rows[0]["model"]));
    scenes
}

/// A setting by its name in tables.
fn setting_of(name: &str) -> Option<&'static Setting> {
    SETTINGS.iter().find(|setting| setting.2 == name)
}

/// `cell` over that of [`BASE`].
fn relative<'a>(cell: impl Fn(&Scene<'_>, &Setting) -> Option<f64> + 'a) -> Cell<'a> {
    Box::new(move |scene, setting| Some(cell(scene, setting)? / cell(scene, setting_of(BASE)?)?))
}

/// A line for each scene, a column for each of [`CHOSEN`] that was measured.
fn by_scene(scenes: &[Scene], cell: &Cell<'_>, text: fn(f64) -> String) -> Lines {
    let is_measured = |setting: &&Setting| scenes.iter().any(|scene| cell(scene, setting).is_some());
    let settings: Vec<&Setting> = CHOSEN.into_iter().filter_map(setting_of).filter(is_measured).collect();
    if settings.is_empty() {
        return Lines::new();
    }
    let header = ["scene, triangles"].into_iter().chain(settings.iter().map(|setting| setting.2));
    let mut lines = vec![header.map(str::to_owned).collect()];
    lines.extend(scenes.iter().map(|scene| {
        let cells = settings.iter().map(|setting| cell(scene, setting).map_or_else(none, text));
        [scene.label.clone()].into_iter().chain(cells).collect::<Vec<_>>()
    }));
    lines
}

/// A line for each setting that was measured, and the measured ones of `columns`, with the medians of all scenes.
fn by_setting(scenes: &[Scene], columns: &[(&str, Cell<'_>)], text: fn(f64) -> String) -> Lines {
    let is_measured =
        |cell: &Cell<'_>| SETTINGS.iter().any(|setting| scenes.iter().any(|scene| cell(scene, setting).is_some()));
    let columns: Vec<_> = columns.iter().filter(|(_, cell)| is_measured(cell)).collect();
    let titles = columns.iter().map(|(title, _)| (*title).to_owned());
    let mut lines = vec![["setting".to_owned()].into_iter().chain(titles).collect()];
    for setting in &SETTINGS {
        let medians = columns.iter().map(|(_, cell)| {
            let numbers: Vec<f64> = scenes.iter().filter_map(|scene| cell(scene, setting)).collect();
            (!numbers.is_empty()).then(|| middle(numbers))
        });
        let medians: Vec<Option<f64>> = medians.collect();
        if medians.iter().any(Option::is_some) {
            let cells = medians.into_iter().map(|median| median.map_or_else(none, text));
            lines.push([setting.2.to_owned()].into_iter().chain(cells).collect());
        }
    }
    if lines.len() > 1 { lines } else { Lines::new() }
}

/// The cell of what was not measured.
fn none() -> String {
    "–".to_owned()
}

fn ratio(value: f64) -> String {
    format!("{value:.2}")
}

fn ready(rows: &[&Value], threads: u64) -> Lines {
    let ms =
        move |scene: &Scene<'_>, setting: &Setting| scene.number(setting, "ready_ms", |row| row["threads"] == threads);
    let scenes = Scene::all(rows);
    let cell: Cell<'_> = Box::new(ms);
    let mut lines = by_scene(&scenes, &cell, number);
    let rates = COMPARED.into_iter().filter_map(|(own, peer)| {
        let of_scene = |scene: &Scene<'_>| Some(ms(scene, setting_of(peer)?)? / ms(scene, setting_of(own)?)?);
        let rates: Vec<f64> = scenes.iter().filter_map(of_scene).collect();
        let (least, most) = (rates.iter().copied().reduce(f64::min)?, rates.iter().copied().reduce(f64::max)?);
        let name = format!("{own} of {peer}");
        Some([name].into_iter().chain([middle(rates), least, most].map(ratio)).collect::<Vec<_>>())
    });
    let rates: Lines = rates.collect();
    if !rates.is_empty() {
        lines.extend([Vec::new(), ["rate", "median", "least", "most"].map(str::to_owned).to_vec()]);
        lines.extend(rates);
    }
    lines
}

/// Scenes with trees. Embree 4 makes those of Embree 3.
fn tree_scenes<'a>(rows: &[&'a Value]) -> Vec<Scene<'a>> {
    Scene::all(&rows.iter().filter(|row| row["engine"] != "embree 4").copied().collect::<Vec<_>>())
}

/// A column of the rows of trees.
fn column(scene: &Scene<'_>, setting: &Setting, name: &str) -> Option<f64> {
    scene.number(setting, name, |_| true)
}

fn costs(rows: &[&Value]) -> Lines {
    let cell: Cell<'_> = Box::new(|scene, setting| column(scene, setting, "sah_cost"));
    by_scene(&tree_scenes(rows), &cell, |cost| format!("{cost:.1}"))
}

fn trees(rows: &[&Value]) -> Lines {
    let plain = ["sah_cost", "epo"].map(|name| relative(move |scene, setting| column(scene, setting, name)));
    let tests = KINDS.map(|(kind, title)| {
        let tests = move |scene: &Scene<'_>, setting: &Setting| {
            let of = |what: &str| column(scene, setting, &format!("{kind}_{what}_tests_per_ray"));
            Some(of("container")? + of("primitive")?)
        };
        (title, relative(tests))
    });
    let columns: Vec<_> = ["SAH cost", "overlap"].into_iter().zip(plain).chain(tests).collect();
    by_setting(&tree_scenes(rows), &columns, ratio)
}

fn memory(rows: &[&Value]) -> Lines {
    let of = |name: String| -> Cell<'static> { Box::new(move |scene, setting| column(scene, setting, &name)) };
    let reads = KINDS.map(|(kind, title)| (title, of(format!("{kind}_bytes_per_ray"))));
    let columns: Vec<_> = [("a triangle", of("bytes_per_triangle".to_owned()))].into_iter().chain(reads).collect();
    by_setting(&tree_scenes(rows), &columns, number)
}

/// A column of rates over Embree's.
#[derive(Clone, Copy)]
struct Rates<'a> {
    kind: &'a str,
    title: &'a str,
    /// The interface of both; all of them where it is empty.
    interface: &'a str,
    /// Whether Embree's are its robust settings.
    is_robust: bool,
}

/// [`Rates`] of each of [`KINDS`].
fn of_kinds(interface: &str, is_robust: bool) -> [Rates<'_>; KINDS.len()] {
    KINDS.map(|(kind, title)| Rates { kind, title, interface, is_robust })
}

/// The rate of this engine's Best over that of Embree.
fn rays<const N: usize>(scenes: &[Scene<'_>], columns: [Rates<'_>; N]) -> Lines {
    let ratio_of = |scene: &Scene<'_>, Rates { kind, interface, is_robust, .. }: Rates<'_>| {
        let fastest = |engine: &str| {
            let of_engine = scene.rows.iter().filter(|row| {
                let setting = row["setting"].as_str().unwrap_or_default();
                let is_wanted =
                    if engine == "bvhscope" { setting == "box best" } else { setting.ends_with("robust") == is_robust };
                let fits = interface.is_empty() || row["interface"] == interface;
                row["part"] == kind && row["engine"] == engine && row["threads"] == 1 && is_wanted && fits
            });
            of_engine.filter_map(|row| rate(row)).max_by(f64::total_cmp)
        };
        Some(fastest("bvhscope")? / fastest("embree")?)
    };
    let mut table = Lines::new();
    let mut ratios = [const { Vec::new() }; N];
    for scene in scenes {
        let in_columns = columns.map(|column| ratio_of(scene, column));
        ratios.iter_mut().zip(in_columns).for_each(|(ratios, ratio)| ratios.extend(ratio));
        if in_columns.iter().any(Option::is_some) {
            let cells = in_columns.map(|cell| cell.map_or_else(none, ratio));
            table.push([scene.label.clone()].into_iter().chain(cells).collect());
        }
    }
    if table.is_empty() {
        return table;
    }
    let header = ["scene, triangles"].into_iter().chain(columns.map(|column| column.title));
    table.insert(0, header.map(str::to_owned).collect());
    table.push(["median".to_owned()].into_iter().chain(ratios.map(median)).collect());
    table
}

/// Single rays through the tree of every setting.
fn engines(scenes: &[Scene<'_>]) -> Lines {
    let columns = KINDS.map(|(kind, title)| {
        let single = move |scene: &Scene<'_>, setting: &Setting| {
            let is_it = |row: &&Value| row["part"] == kind && row["threads"] == 1 && row["interface"] == "single";
            rate(scene.of(setting).find(is_it)?)
        };
        (title, relative(single))
    });
    by_setting(scenes, &columns, ratio)
}

/// The time of an engine's soonest picture of so many rays of ambient occlusion from each hit, with the name of the setting behind the label.
fn soonest(
    scene: &Scene<'_>,
    (engine, label): (&str, &str),
    threads: u64,
    samples: u64,
) -> Option<(f64, &'static str)> {
    let timed = SETTINGS.iter().filter(|setting| setting.0 == engine).filter_map(|setting| {
        let is_it = |row: &Value| row["threads"] == threads && row["samples"] == samples;
        let name = setting.2.strip_prefix(label).unwrap_or(setting.2).trim();
        Some((scene.number(setting, "picture_ms", is_it)?, name))
    });
    timed.min_by(|a, b| a.0.total_cmp(&b.0))
}

/// For each number of rays the time of each engine's soonest setting, with the setting's name.
fn pictures(rows: &[&Value]) -> Lines {
    let threads = most_threads(rows);
    let scenes = Scene::all(rows);
    let measured: Vec<_> = ENGINES
        .into_iter()
        .filter(|&engine| scenes.iter().any(|scene| soonest(scene, engine, threads, 1).is_some()))
        .collect();
    let mut lines = Lines::new();
    for (samples, title) in [(1, "1 ray a hit"), (16, "16 rays a hit"), (256, "256 rays a hit")] {
        if !lines.is_empty() {
            lines.push(Vec::new());
        }
        let titles = measured.iter().map(|(_, label)| (*label).to_owned());
        lines.push([title.to_owned()].into_iter().chain(titles).collect());
        let mut ratios = vec![Vec::new(); measured.len()];
        for scene in &scenes {
            let times: Vec<_> = measured.iter().map(|&engine| soonest(scene, engine, threads, samples)).collect();
            for (ratios, time) in ratios.iter_mut().zip(&times) {
                ratios.extend(time.zip(times[0]).map(|(time, own)| time.0 / own.0));
            }
            let cells = times.iter().map(|time| {
                time.map_or_else(none, |(ms, setting)| format!("{setting} {}", number(ms)).trim_start().to_owned())
            });
            lines.push([scene.label.clone()].into_iter().chain(cells).collect());
        }
        lines.push(
            ["of this engine's time, median".to_owned()].into_iter().chain(ratios.into_iter().map(median)).collect(),
        );
    }
    lines
}

/// What the rows of a table say, as one sentence.
fn sentence(name: &str, rows: &[&Value]) -> String {
    let (scenes, threads) = (Scene::all(rows), most_threads(rows));
    match name {
        "picture-range" => {
            // Of Embree 3's soonest picture over this engine's.
            let range = |samples: u64| {
                let of = |scene: &Scene<'_>, engine| soonest(scene, (engine, ""), threads, samples).map(|(ms, _)| ms);
                range_of(scenes.iter().filter_map(|scene| Some(of(scene, "embree")? / of(scene, "bvhscope")?)))
            };
            format!(
                "With 256 rays of ambient occlusion from each hit, Embree 3 takes {} times as long as this engine, with 16 rays {},\nand \
                 with one ray {}: there the build decides, and LOW is ready first.\n",
                range(256),
                range(16),
                range(1)
            )
        }
        "paper-range" => {
            let boxes = rows.iter().filter(|row| row["container"] == "box" && row["traversal"] == "ordered");
            let ratio = |row: &&Value| Some(row["trace_ms"].as_f64()? / row["wide_trace_ms"].as_f64()?);
            format!(
                "Pictures are traced in packets through the wide tree made from it, {} times as fast for boxes.\n",
                range_of(boxes.filter_map(ratio))
            )
        }
        _ => {
            let scenes = tree_scenes(rows);
            let of_peer = |peer: &'static str| {
                let of = move |scene: &Scene<'_>, name: &str| column(scene, setting_of(name)?, "sah_cost");
                range_of(scenes.iter().filter_map(move |scene| Some(of(scene, "Best")? / of(scene, peer)?)))
            };
            format!(
                "SAH costs of Best are {} of those of Embree MEDIUM, {} of tinybvh's and {} of tinybvh HQ's.\n",
                of_peer(BASE),
                of_peer("tinybvh"),
                of_peer("tinybvh HQ")
            )
        }
    }
}

/// "0.60 to 1.38".
fn range_of(values: impl Iterator<Item = f64>) -> String {
    let values: Vec<f64> = values.collect();
    let [least, most] = [f64::min, f64::max].map(|of: fn(f64, f64) -> f64| values.iter().copied().reduce(of));
    format!("{} to {}", ratio(least.unwrap_or(f64::NAN)), ratio(most.unwrap_or(f64::NAN)))
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
    // Title, order of traversal, column, and place in the paper's results.
    let quantities = [
        ("build ms", "ordered", "build_ms", 0),
        ("trace ms", "ordered", "trace_ms", 1),
        ("tests per ray", "ordered", "tests_per_ray", 2),
        ("tests per ray, paper's order", "paper", "tests_per_ray", 2),
    ];
    let mut lines = Lines::new();
    for (title, traversal, column, published) in quantities {
        if !lines.is_empty() {
            lines.push(Vec::new());
        }
        lines.push([title, "box", "sphere", "ratio", "paper's box", "paper's sphere"].map(str::to_owned).to_vec());
        let mut ratios = Vec::new();
        for (model, papers) in PAPER {
            let [own_box, own_sphere] = ["box", "sphere"].map(|container| {
                let is_it = |row: &&&Value| {
                    row["model"] == model && row["traversal"] == traversal && row["container"] == container
                };
                rows.iter().find(is_it).and_then(|row| row[column].as_f64()).unwrap_or(f64::NAN)
            });
            ratios.push(own_box / own_sphere);
            let digit = |value: f64| if column == "tests_per_ray" { format!("{value:.1}") } else { number(value) };
            let own = [own_box, own_sphere].map(digit);
            let papers = papers[published].map(|value| format!("{value:.0}"));
            let ratio = format!("{:.2}", own_box / own_sphere);
            lines.push([model.to_owned()].into_iter().chain(own).chain([ratio]).chain(papers).collect());
        }
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        let none = String::new;
        let papers = format!("ratio {}", PAPER_MEANS[published]);
        lines.push(vec!["mean".to_owned(), none(), none(), format!("{mean:.2}"), papers, none()]);
    }
    lines
}

fn median(ratios: Vec<f64>) -> String {
    if ratios.is_empty() { none() } else { ratio(middle(ratios)) }
}

/// The median of at least one number.
fn middle(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    let middle = numbers.len() / 2;
    if numbers.len() % 2 == 1 { numbers[middle] } else { (numbers[middle - 1] + numbers[middle]) * 0.5 }
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
