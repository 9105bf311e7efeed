//! The arrows between the modules of both crates run one way and never in a circle: reads every `use` line and every path
//! that begins with `crate`, `super` or `self`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// One crate: its source folder, and its rooms from the ground up. A room is a top-level module, or `app::NAME` for the rooms
/// inside the window. Each may import the rooms before it in the list, except those named with it; `*` stands for any rest of a
/// name.
struct Plan {
    source: &'static str,
    rooms: &'static [(&'static str, &'static [&'static str])],
}

const ENGINE: Plan = Plan {
    source: "engine/src",
    rooms: &[
        ("geometry", &[]),
        ("task_log", &["*"]),
        ("cancel", &["geometry"]),
        ("kernel", &["geometry"]),
        ("tree", &[]),
        ("settings", &["geometry", "cancel", "kernel"]),
        ("stage_times", &["geometry", "task_log", "kernel", "tree", "settings"]),
        ("order", &[]),
        ("aac", &[]),
        ("optimize", &[]),
        ("builders", &[]),
        ("construction", &["optimize"]),
        ("query", &["settings", "stage_times", "order", "aac", "optimize", "builders", "construction"]),
        ("wide", &["settings", "stage_times", "order", "aac", "optimize", "builders", "construction"]),
        ("layouts", &["settings", "stage_times", "order", "aac", "optimize", "builders", "construction", "query"]),
        ("refit", &["stage_times", "order", "construction", "layouts"]),
        (
            "fingerprint",
            &["settings", "stage_times", "order", "aac", "optimize", "builders", "construction", "layouts", "refit"],
        ),
        ("bvh", &["order", "optimize", "construction", "layouts", "refit", "fingerprint"]),
        ("instances", &["stage_times", "order", "aac", "optimize", "construction", "layouts", "refit", "fingerprint"]),
        ("follow", &["layouts", "instances", "stage_times", "order", "aac", "optimize", "construction", "fingerprint"]),
        (
            "tree_file",
            &[
                "settings",
                "stage_times",
                "aac",
                "optimize",
                "builders",
                "construction",
                "wide",
                "layouts",
                "refit",
                "fingerprint",
                "bvh",
                "instances",
                "follow",
            ],
        ),
    ],
};

const VIEWER: Plan = Plan {
    source: "src",
    rooms: &[
        ("text", &[]),
        ("catalog", &[]),
        ("colors", &["*"]),
        ("vectors", &["*"]),
        ("console", &["catalog"]),
        ("threads", &["*"]),
        ("provenance", &["console"]),
        ("budget", &["*"]),
        ("worker", &["*"]),
        ("export", &["console", "threads", "budget", "worker"]),
        ("camera", &["text", "catalog", "console", "threads", "provenance", "budget", "worker", "export"]),
        ("scene", &["console", "threads", "worker", "export", "camera"]),
        ("view", &["console", "threads", "budget", "worker", "export"]),
        ("ray_file", &["catalog", "vectors", "threads", "provenance", "worker", "export", "camera", "view"]),
        ("section", &["*"]),
        ("accel", &["console", "threads", "worker", "export", "camera", "view", "ray_file"]),
        ("visibility", &["console", "threads", "worker", "export", "camera", "view", "ray_file", "section"]),
        ("render", &["console", "threads", "worker", "export", "view", "ray_file"]),
        ("overlay", &["console", "threads", "worker", "export", "view", "ray_file", "render"]),
        ("lab", &["console", "worker", "overlay"]),
        ("legend", &["console", "worker"]),
        ("headless", &["worker"]),
        (
            "app::format",
            &[
                "console",
                "threads",
                "budget",
                "worker",
                "export",
                "camera",
                "scene",
                "view",
                "section",
                "accel",
                "visibility",
                "render",
                "overlay",
                "lab",
                "headless",
                "app::*",
            ],
        ),
        ("app::state", &["worker", "headless"]),
        ("app::theme", &["worker", "headless", "lab"]),
        ("app::widgets", &["worker", "headless", "lab"]),
        ("app::viewport", &["worker", "headless", "lab"]),
        ("app::studies", &["headless"]),
        ("app::views", &["worker", "headless"]),
        ("app::commands", &["worker", "headless"]),
        ("app::panels", &["worker", "headless"]),
        ("app::shell", &["headless"]),
        ("app", &["accel", "headless", "lab", "overlay", "render", "scene", "worker"]),
        ("cli", &["worker", "app::*"]),
        ("main", &["app*", "accel", "headless", "lab", "overlay", "render", "scene"]),
        ("bin", &["main", "app*", "accel", "headless", "lab", "overlay", "render", "scene"]),
    ],
};

/// The program that measures beside other engines. Its modules have no order, but no circle either.
const PEERS: Plan = Plan { source: "benches/peers", rooms: &[] };

/// Crates that only the window and the overlay's wgpu pass know.
const WINDOW_CRATES: &[&str] = &["egui", "eframe", "egui_wgpu", "egui_plot", "egui_extras", "wgpu", "rfd"];

/// A source file: its path below the source folder, its module path and its code.
struct Source {
    file: String,
    module: Vec<String>,
    code: String,
}

impl Source {
    /// True for the crate's map, which only declares and re-exports.
    fn is_crate_root(&self) -> bool {
        self.module.is_empty()
    }
}

fn source_files(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("the source folder can be read") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            source_files(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
}

/// The module that a file is: its path without extension, `mod` and `lib`.
fn module_of(relative: &Path) -> Vec<String> {
    let mut module: Vec<String> =
        relative.with_extension("").iter().map(|part| part.to_string_lossy().into_owned()).collect();
    if module.last().is_some_and(|last| last == "mod" || last == "lib") {
        module.pop();
    }
    module
}

/// The code of a file without comments and without the unit tests at its end.
fn code(text: &str) -> String {
    let text = text.split("mod tests {").next().unwrap_or_default();
    text.lines().map(|line| line.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

fn sources(plan: &Plan) -> Vec<Source> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(plan.source);
    let mut files = Vec::new();
    source_files(&folder, &mut files);
    files.sort();
    files
        .iter()
        .map(|path| {
            let relative = path.strip_prefix(&folder).expect("inside the folder");
            let text = std::fs::read_to_string(path).expect("source is UTF-8");
            Source {
                file: format!("{}/{}", plan.source, relative.display()),
                module: module_of(relative),
                code: code(&text),
            }
        })
        .collect()
}

fn is_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Splits at the commas outside of braces.
fn split_list(list: &str) -> Vec<&str> {
    let (mut parts, mut depth, mut start) = (Vec::new(), 0, 0);
    for (at, c) in list.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(&list[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    parts.push(&list[start..]);
    parts
}

/// The paths of a use tree such as `a::{b, c::{self, d}}`.
fn expand(prefix: &[String], tree: &str, paths: &mut Vec<Vec<String>>) {
    for part in split_list(tree) {
        let part = part.split(" as ").next().unwrap_or_default().trim();
        let (head, rest) = part.split_once('{').map_or((part, None), |(head, rest)| (head, Some(rest)));
        let mut path = prefix.to_vec();
        path.extend(head.split("::").map(str::trim).filter(|name| !name.is_empty() && *name != "*").map(str::to_owned));
        match rest {
            Some(rest) => expand(&path, rest.trim_end().trim_end_matches('}'), paths),
            None if part.is_empty() => {}
            None => paths.push(path),
        }
    }
}

/// Every path in `code` that begins with `crate`, `super` or `self`, in `use` lines and elsewhere, from the crate's root on.
fn imported_paths(code: &str, module: &[String]) -> Vec<Vec<String>> {
    let mut paths = Vec::new();
    for start in ["crate", "super", "self"] {
        for (at, _) in code.match_indices(&format!("{start}::")) {
            // `$crate::` in a macro, longer names and later parts of a path are no beginnings; a visibility imports nothing.
            let before = &code[..at];
            if before.ends_with(|c: char| is_name(c) || c == '$' || c == ':') || before.ends_with("(in ") {
                continue;
            }
            let rest = &code[at..];
            let in_use = code[..at].rsplit([';', '}', '{']).next().is_some_and(|line| line.contains("use "));
            let mut trees = Vec::new();
            if in_use {
                let statement = rest.split(';').next().unwrap_or_default();
                expand(&[], statement, &mut trees);
            } else {
                let path: String = rest.chars().take_while(|&c| is_name(c) || c == ':').collect();
                trees.push(path.split("::").filter(|name| !name.is_empty()).map(str::to_owned).collect());
            }
            for tree in trees {
                let mut base = module.to_vec();
                let mut names = tree.iter().peekable();
                match names.next().map(String::as_str) {
                    Some("crate") => base.clear(),
                    Some("super") => {
                        base.pop();
                        while names.next_if(|name| *name == "super").is_some() {
                            base.pop();
                        }
                    }
                    _ => {}
                }
                base.extend(names.cloned());
                paths.push(base);
            }
        }
    }
    paths
}

/// The module that `path` names an item of: its longest beginning that is a file.
fn file_of<'a>(path: &'a [String], modules: &BTreeSet<Vec<String>>) -> Option<&'a [String]> {
    (1..=path.len()).rev().map(|end| &path[..end]).find(|beginning| modules.contains(*beginning))
}

/// The room of a module: its longest beginning that the plan lists.
fn room_of<'a>(module: &[String], plan: &'a Plan) -> Option<&'a str> {
    (1..=module.len()).rev().find_map(|end| {
        let name = module[..end].join("::");
        plan.rooms.iter().map(|(room, _)| *room).find(|room| *room == name)
    })
}

/// Each source file's imports from its own crate, as modules.
fn arrows(sources: &[Source]) -> BTreeMap<Vec<String>, BTreeSet<Vec<String>>> {
    let modules: BTreeSet<Vec<String>> = sources.iter().map(|source| source.module.clone()).collect();
    let mut arrows = BTreeMap::new();
    for source in sources.iter().filter(|source| !source.is_crate_root()) {
        let mut targets: BTreeSet<Vec<String>> = imported_paths(&source.code, &source.module)
            .iter()
            .filter_map(|path| file_of(path, &modules).map(<[String]>::to_vec))
            .collect();
        // A face's `pub use child::Item` names its children without `self`.
        for line in source.code.split(';') {
            let Some((_, tree)) = line.split_once("use ") else { continue };
            let mut paths = Vec::new();
            expand(&source.module, tree.trim_start(), &mut paths);
            targets.extend(
                paths
                    .iter()
                    .filter_map(|path| file_of(path, &modules))
                    .filter(|found| found.len() > source.module.len())
                    .map(<[String]>::to_vec),
            );
        }
        targets.remove(&source.module);
        arrows.insert(source.module.clone(), targets);
    }
    arrows
}

fn check_rooms(plan: &Plan) {
    let sources = sources(plan);
    let arrows = arrows(&sources);
    let (mut count, mut wrong) = (0, Vec::new());
    for source in sources.iter().filter(|source| !source.is_crate_root()) {
        let Some(room) = room_of(&source.module, plan) else {
            wrong.push(format!("{}: this module has no room in the plan: give it one", source.file));
            continue;
        };
        let place = |name: &str| plan.rooms.iter().position(|(room, _)| *room == name).expect("found in the plan");
        let (own, excepted) = (place(room), plan.rooms[place(room)].1);
        for target in &arrows[&source.module] {
            let Some(other) = room_of(target, plan).filter(|other| *other != room) else { continue };
            count += 1;
            let is_excepted = excepted.iter().any(|name| match name.strip_suffix('*') {
                Some(beginning) => other.starts_with(beginning),
                None => *name == other,
            });
            if place(other) > own || is_excepted {
                wrong.push(format!("{}: '{room}' must not import '{other}' ({})", source.file, target.join("::")));
            }
        }
    }
    assert!(count > 20, "only {count} imports between rooms of {} were found: the reader is broken", plan.source);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The circles among `arrows`: sets of modules that reach each other.
fn circles(arrows: &BTreeMap<Vec<String>, BTreeSet<Vec<String>>>) -> Vec<Vec<&Vec<String>>> {
    let reach: BTreeMap<&Vec<String>, BTreeSet<&Vec<String>>> = arrows
        .keys()
        .map(|start| {
            let (mut seen, mut open) = (BTreeSet::new(), vec![start]);
            while let Some(module) = open.pop() {
                for target in arrows.get(module).into_iter().flatten() {
                    if seen.insert(target) {
                        open.push(target);
                    }
                }
            }
            (start, seen)
        })
        .collect();
    let mut found: BTreeSet<Vec<&Vec<String>>> = BTreeSet::new();
    for (start, seen) in &reach {
        if seen.contains(start) {
            let members = reach
                .iter()
                .filter(|(other, back)| seen.contains(*other) && back.contains(start))
                .map(|(other, _)| *other);
            found.insert(members.collect());
        }
    }
    found.into_iter().collect()
}

fn check_circles(plan: &Plan) {
    let sources = sources(plan);
    let arrows = arrows(&sources);
    let text: Vec<String> = circles(&arrows)
        .iter()
        .map(|circle| {
            let arrows_within = circle.iter().flat_map(|module| {
                arrows[*module]
                    .iter()
                    .filter(|target| circle.contains(target))
                    .map(|target| format!("    {} -> {}", module.join("::"), target.join("::")))
            });
            format!("a circle in {}:\n{}", plan.source, arrows_within.collect::<Vec<_>>().join("\n"))
        })
        .collect();
    assert!(text.is_empty(), "{}", text.join("\n"));
}

#[test]
fn no_arrow_of_the_engine_runs_the_wrong_way() {
    check_rooms(&ENGINE);
}

#[test]
fn no_arrow_of_the_viewer_runs_the_wrong_way() {
    check_rooms(&VIEWER);
}

/// The folder of a view of the dock that a module lies in.
fn view_of(module: &[String]) -> Option<&String> {
    const SHARED: [&str; 2] = ["axes", "parts"];
    let inside = module.strip_prefix(&["app".to_owned(), "views".to_owned()][..])?;
    inside.first().filter(|name| !SHARED.contains(&name.as_str()))
}

#[test]
fn views_import_nothing_of_each_other() {
    let arrows = arrows(&sources(&VIEWER));
    let views: BTreeSet<&String> = arrows.keys().filter_map(|module| view_of(module)).collect();
    assert!(views.len() >= 6, "only {views:?} were found");
    for (module, targets) in &arrows {
        let Some(view) = view_of(module) else { continue };
        let others: Vec<_> =
            targets.iter().filter(|target| view_of(target).is_some_and(|other| other != view)).collect();
        assert!(others.is_empty(), "{} imports {others:?}", module.join("::"));
    }
}

#[test]
fn the_state_of_the_window_has_at_most_nine_fields() {
    let sources = sources(&VIEWER);
    let state = sources.iter().find(|source| source.file == "src/app/state/mod.rs").expect("the state's file");
    let (_, fields) = state.code.split_once("pub struct AppState {").expect("the state");
    let count = fields.split('}').next().unwrap_or_default().matches(':').count();
    assert!((5..=9).contains(&count), "AppState has {count} fields; views and the parts of the model own theirs");
}

#[test]
fn no_modules_of_the_engine_import_each_other_in_a_circle() {
    check_circles(&ENGINE);
}

#[test]
fn no_modules_of_the_viewer_import_each_other_in_a_circle() {
    check_circles(&VIEWER);
}

#[test]
fn no_modules_of_the_measuring_program_import_each_other_in_a_circle() {
    let arrows = arrows(&sources(&PEERS));
    assert!(arrows.values().map(BTreeSet::len).sum::<usize>() > 20, "the reader is broken: {arrows:?}");
    check_circles(&PEERS);
}

#[test]
fn only_the_window_knows_the_toolkit() {
    let mut checked = 0;
    for source in sources(&VIEWER).iter().chain(&sources(&ENGINE)) {
        if source.module.first().is_some_and(|room| room == "app" || room == "overlay") {
            continue;
        }
        checked += 1;
        for name in WINDOW_CRATES {
            let path = format!("{name}::");
            let known = source.code.match_indices(&path).any(|(at, _)| !source.code[..at].ends_with(is_name));
            assert!(!known, "{}: only app and overlay may know {name}", source.file);
        }
    }
    assert!(checked > 100, "only {checked} files were read");
}

#[test]
fn the_engine_knows_nothing_of_the_viewer() {
    for source in sources(&ENGINE) {
        for name in ["bvhscope::", "image::", "tobj::", "gltf::", "std::fs", "std::thread::spawn"] {
            assert!(!source.code.contains(name), "{}: the engine must not know {name}", source.file);
        }
    }
}

#[test]
fn the_reader_understands_every_form_of_import() {
    let text = "use crate::scene::{Scene, load};\nuse crate::{tree::{Node, Tree}, with_tree,\n    camera as eye};\n\
                use super::super::a::b;\nuse self::c;\nfn f() { crate::accel::x(); super::y() } // crate::render\n\
                $crate::lab::y; mycrate::app::z; std::path::self_other::q; pub(in crate::app) fn g()";
    let module = ["app", "panels", "side"].map(str::to_owned);
    let found: BTreeSet<String> = imported_paths(&code(text), &module).iter().map(|path| path.join("::")).collect();
    let expected = [
        "accel::x",
        "app::a::b",
        "app::panels::side::c",
        "app::panels::y",
        "camera",
        "scene::Scene",
        "scene::load",
        "tree::Node",
        "tree::Tree",
        "with_tree",
    ];
    assert_eq!(found, expected.map(str::to_owned).into());
}

#[test]
fn a_circle_is_found() {
    let module = |name: &str| vec![name.to_owned()];
    let arrow = |to: &[&str]| to.iter().map(|name| module(name)).collect::<BTreeSet<_>>();
    let arrows = BTreeMap::from([
        (module("a"), arrow(&["b"])),
        (module("b"), arrow(&["c"])),
        (module("c"), arrow(&["b"])),
        (module("d"), arrow(&["a", "c"])),
    ]);
    assert_eq!(circles(&arrows), [vec![&module("b"), &module("c")]]);
}
