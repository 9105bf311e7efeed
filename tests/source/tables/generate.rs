//! Each table as Markdown.

use serde_json::Value;

use super::rows::{Rows, Shown, rate, source};

/// Every table.
pub const NAMES: [&str; 9] = ["ready", "ready-one", "trees", "rays", "single", "robust", "engines", "picture", "paper"];

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
const COMPARED: [(&str, &str); 4] =
    [("Swift", "Embree LOW"), ("Fast", "Embree LOW"), ("HQ", "Embree MEDIUM"), ("Best", "Embree MEDIUM")];
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
        "rays" => ("primary", |_, all, shown| rays(all, shown, "", false)),
        "single" => ("primary", |_, all, shown| rays(all, shown, "single", false)),
        "robust" => ("primary", |_, all, shown| rays(all, shown, "single", true)),
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
        "ready" => {
            format!("Milliseconds with {} threads{repeat}, and rates until ready of Embree's.", most_threads(rows))
        }
        "ready-one" => format!("Milliseconds with one thread{repeat}, and rates until ready of Embree's."),
        "trees" => "SAH cost with the best leaves, end-point overlap, and container and triangle tests per ray through the binary \
                    tree; bytes per triangle are those ready to trace."
            .to_owned(),
        "rays" => format!("Million rays per second on one thread{repeat}, Best beside Embree's fastest tree and interface."),
        "single" => format!("Million rays per second on one thread{repeat}, one ray at a time, Best beside Embree's."),
        "robust" => format!(
            "Million rays per second on one thread{repeat}, one ray at a time, Best beside Embree's robust scenes, which are as \
             watertight."
        ),
        "engines" => format!("Million rays per second on one thread{repeat}, one ray at a time."),
        "picture" => format!(
            "Milliseconds from triangles to a picture with {} threads{repeat}: until ready to trace, primary rays, and 1, 16 and \
             256 ambient occlusion rays from each hit.",
            most_threads(rows)
        ),
        _ => format!("Threshold 6, ε 0.2, 1024×1024 primary rays from the default camera{repeat}; ratio of box to sphere."),
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

/// Name, setting and label of a row of [`SETTINGS`].
type Setting = (&'static str, &'static str, &'static str);
/// A column of [`by_scene`]: its title, and its cell for a setting of a scene.
type Column<'a> = (&'static str, Box<dyn Fn(&Scene<'_>, &Setting) -> Option<String> + 'a>);

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

    /// A number of a setting's first row that `is_it`.
    fn number(&self, (engine, setting, _): &Setting, name: &str, is_it: impl Fn(&Value) -> bool) -> Option<f64> {
        let own = self.rows.iter().filter(|row| row["engine"] == *engine && row["setting"] == *setting && is_it(row));
        own.map(|row| &row[name]).find_map(Value::as_f64)
    }
}

/// A setting by its name in tables.
fn setting_of(name: &str) -> Option<&'static Setting> {
    SETTINGS.iter().find(|setting| setting.2 == name)
}

/// For each scene a table of the settings that have any of the `columns`, one number a cell.
fn by_scene(scenes: &[Scene], columns: &[Column]) -> Lines {
    let mut lines: Lines = Vec::new();
    for scene in scenes {
        if !lines.is_empty() {
            lines.push(Vec::new());
        }
        let titles = columns.iter().map(|column| column.0.to_owned());
        lines.push([scene.label.clone()].into_iter().chain(titles).collect());
        for setting in &SETTINGS {
            let cells: Vec<Option<String>> = columns.iter().map(|(_, cell)| cell(scene, setting)).collect();
            if cells.iter().any(Option::is_some) {
                let cells = cells.into_iter().map(|cell| cell.unwrap_or_else(|| "–".to_owned()));
                lines.push([setting.2.to_owned()].into_iter().chain(cells).collect());
            }
        }
    }
    lines
}

fn ready(rows: &[&Value], threads: u64) -> Lines {
    let ms =
        |scene: &Scene, setting: &Setting, clock: &str| scene.number(setting, clock, |row| row["threads"] == threads);
    let ratio = |scene: &Scene, setting: &Setting| {
        let (_, peer) = COMPARED.into_iter().find(|(own, _)| *own == setting.2)?;
        Some(ms(scene, setting_of(peer)?, "ready_ms")? / ms(scene, setting, "ready_ms")?)
    };
    let scenes = Scene::all(rows);
    let columns: [Column; 3] = [
        ("binary tree", Box::new(|scene, setting| ms(scene, setting, "build_ms").map(number))),
        ("ready to trace", Box::new(|scene, setting| ms(scene, setting, "ready_ms").map(number))),
        ("rate of Embree's", Box::new(|scene, setting| ratio(scene, setting).map(|x| format!("{x:.2}")))),
    ];
    let mut lines = by_scene(&scenes, &columns);
    let medians = COMPARED.into_iter().filter_map(|(own, peer)| {
        let ratios: Vec<f64> = scenes.iter().filter_map(|scene| ratio(scene, setting_of(own)?)).collect();
        (ratios.len() > 1).then(|| vec![format!("{own} of {peer}"), median(ratios)])
    });
    with_all_scenes(&mut lines, "rate, median", medians.collect());
    lines
}

/// Adds a table over all scenes, if there is any in `all`.
fn with_all_scenes(lines: &mut Lines, title: &str, all: Lines) {
    if !all.is_empty() {
        lines.extend([Vec::new(), vec!["all scenes".to_owned(), title.to_owned()]]);
        lines.extend(all);
    }
}

fn trees(rows: &[&Value]) -> Lines {
    // Embree 4 makes the trees of Embree 3.
    let scenes = Scene::all(&rows.iter().filter(|row| row["engine"] != "embree 4").copied().collect::<Vec<_>>());
    let plain = |name: &'static str, digits: usize| -> Column<'_> {
        let title = if name == "epo" { "overlap" } else { "SAH cost" };
        (title, Box::new(move |scene, setting| Some(format!("{:.digits$}", scene.number(setting, name, |_| true)?))))
    };
    let tests = KINDS.map(|(kind, title)| -> Column<'_> {
        let cell = move |scene: &Scene, setting: &Setting| {
            let of = |what: &str| scene.number(setting, &format!("{kind}_{what}_tests_per_ray"), |_| true);
            Some(format!("{:.1}", of("container")? + of("primitive")?))
        };
        (title, Box::new(cell))
    });
    let columns: Vec<Column> = [plain("sah_cost", 1), plain("epo", 2)].into_iter().chain(tests).collect();
    let mut lines = by_scene(&scenes, &columns);
    let bytes = SETTINGS.iter().filter_map(|setting| {
        let bytes = scenes.iter().filter_map(|scene| scene.number(setting, "bytes_per_triangle", |_| true));
        let bytes: Vec<f64> = bytes.collect();
        (!bytes.is_empty()).then(|| vec![setting.2.to_owned(), number(middle(bytes))])
    });
    with_all_scenes(&mut lines, "bytes per triangle, median", bytes.collect());
    lines
}

/// This engine's Best beside Embree, in the run of `rows`: all interfaces, or the one that is named, of Embree's settings whose name
/// ends as `robust` says.
fn rays(all: &Rows, shown: Shown<'_>, interface: &str, is_robust: bool) -> Lines {
    let mut lines = Lines::new();
    for (kind, title) in KINDS {
        let rows = all.newest(kind, shown);
        let mut ratios = Vec::new();
        let mut table = Lines::new();
        for scene in Scene::all(&rows) {
            let fastest = |engine: &str| {
                let of_engine = scene.rows.iter().filter(|row| {
                    let setting = row["setting"].as_str().unwrap_or_default();
                    let is_wanted = if engine == "bvhscope" {
                        setting == "box best"
                    } else {
                        setting.ends_with("robust") == is_robust
                    };
                    let fits = interface.is_empty() || row["interface"] == interface;
                    row["engine"] == engine && row["threads"] == 1 && is_wanted && fits
                });
                let rates = of_engine.filter_map(|row| Some((rate(row)?, row["interface"].as_str()?)));
                rates.max_by(|a, b| a.0.total_cmp(&b.0))
            };
            if let (Some((own, _)), Some((peer, name))) = (fastest("bvhscope"), fastest("embree")) {
                ratios.push(own / peer);
                let [own_rate, peer_rate] = [own, peer].map(|rate| format!("{rate:.1}"));
                table.push(vec![scene.label, own_rate, peer_rate, format!("{:.2}", own / peer), name.to_owned()]);
            }
        }
        if table.is_empty() {
            continue;
        }
        if !lines.is_empty() {
            lines.push(Vec::new());
        }
        lines.push([title, "this engine", "Embree", "ratio", "Embree's interface"].map(str::to_owned).to_vec());
        let is_several = table.len() > 1;
        lines.append(&mut table);
        if is_several {
            let none = String::new;
            lines.push(vec!["median".to_owned(), none(), none(), median(ratios), none()]);
        }
    }
    lines
}

/// Single rays through the tree of every setting, in the run of `rows`.
fn engines(rows: &[&Value], all: &Rows, shown: Shown<'_>) -> Lines {
    let kinds: Vec<&Value> = KINDS.iter().flat_map(|(kind, _)| all.newest(kind, shown)).collect();
    let scenes: Vec<Scene> = Scene::all(rows)
        .into_iter()
        .map(|scene| {
            let model = &scene.rows[0]["model"];
            let rows = kinds.iter().filter(|row| row["model"] == *model).copied().collect();
            Scene { label: scene.label, rows }
        })
        .collect();
    let columns = KINDS.map(|(kind, title)| -> Column<'_> {
        let cell = move |scene: &Scene, (engine, setting, _): &Setting| {
            let is_it = |row: &&&Value| {
                row["part"] == kind
                    && row["engine"] == *engine
                    && row["setting"] == *setting
                    && row["threads"] == 1
                    && row["interface"] == "single"
            };
            Some(format!("{:.1}", rate(scene.rows.iter().find(is_it)?)?))
        };
        (title, Box::new(cell))
    });
    by_scene(&scenes, &columns)
}

fn pictures(rows: &[&Value]) -> Lines {
    let threads = most_threads(rows);
    let columns = [(1, "1 ray"), (16, "16 rays"), (256, "256 rays")].map(|(samples, title)| -> Column<'_> {
        let cell = move |scene: &Scene, setting: &Setting| {
            let is_it = |row: &Value| row["threads"] == threads && row["samples"] == samples;
            scene.number(setting, "picture_ms", is_it).map(number)
        };
        (title, Box::new(cell))
    });
    by_scene(&Scene::all(rows), &columns)
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
    if ratios.is_empty() { "–".to_owned() } else { format!("{:.2}", middle(ratios)) }
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
