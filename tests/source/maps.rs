//! The maps of the code name the modules that there are.

use std::path::Path;

/// The modules that a file declares, those of tests left out.
fn declared(file: &str) -> Vec<String> {
    let text = read(file);
    let names = text.lines().filter_map(|line| {
        let name = line.strip_prefix("pub mod ").or_else(|| line.strip_prefix("mod "))?;
        name.strip_suffix(';').map(str::to_owned)
    });
    let mut names: Vec<_> = names.filter(|name| name != "skip").collect();
    names.sort();
    names
}

/// The names in backticks of the first column of each table whose header begins with `| module |`, of those tables the one `at`.
fn mapped(file: &str, at: usize) -> Vec<String> {
    let text = read(file);
    let lines: Vec<&str> = text.lines().map(|line| line.trim_start_matches("//!").trim()).collect();
    let starts = lines.iter().enumerate().filter(|(_, line)| line.starts_with("| module |")).map(|(at, _)| at);
    let start = starts.into_iter().nth(at).unwrap_or_else(|| panic!("{file} has no table of modules {at}"));
    let rows = lines[start + 2..].iter().take_while(|line| line.starts_with('|'));
    let columns = rows.map(|row| row.split('|').nth(1).unwrap_or_default());
    // `[`mod@refit`]` and `[`scene`]` are links to modules.
    let names = columns
        .flat_map(|column| column.split('`').skip(1).step_by(2).map(|name| name.trim_start_matches("mod@").to_owned()));
    let mut names: Vec<_> = names.collect();
    names.sort();
    names
}

fn read(file: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).unwrap()
}

#[test]
fn both_maps_of_each_package_name_every_module() {
    for (source, at) in [("engine/src/lib.rs", 0), ("src/lib.rs", 1)] {
        let declared = declared(source);
        assert!(declared.len() > 10, "{declared:?}");
        // Where a module is private, the crate's own map names what is re-exported from it.
        let own: Vec<_> = mapped(source, 0).into_iter().filter(|name| name != "build_cache").collect();
        assert_eq!(own, declared, "the map in {source}");
        let others: Vec<_> = mapped("docs/architecture.md", at);
        assert_eq!(others, declared, "the table in docs/architecture.md for {source}");
    }
}
