//! The profiles of single packages in Cargo.toml are of packages that there are.

use std::path::Path;

#[test]
fn each_profile_of_a_package_names_one_of_the_lock_file() {
    let read = |file: &str| std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).unwrap();
    let (manifest, lock) = (read("Cargo.toml"), read("Cargo.lock"));
    let packages: Vec<&str> =
        lock.lines().filter_map(|line| line.strip_prefix("name = \"")?.strip_suffix('"')).collect();
    let profiles = manifest.lines().filter_map(|line| {
        let profile = line.strip_prefix("[profile.")?.strip_suffix(']')?;
        profile.split_once(".package.").map(|(_, name)| name.trim_matches('"'))
    });
    let profiles: Vec<&str> = profiles.filter(|name| *name != "*").collect();
    assert!(profiles.len() > 10, "{profiles:?}");
    let unknown: Vec<_> = profiles.iter().filter(|name| !packages.contains(name)).collect();
    assert!(unknown.is_empty(), "profiles of packages that are no longer used: {unknown:?}");
}
