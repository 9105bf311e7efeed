//! Skipped tests are printed and listed, and are errors in continuous integration.

use std::path::Path;
use std::process::{Command, Output};

use crate::skip::{Lack, is_allowed, skip};

#[test]
fn only_what_is_listed_may_be_skipped_in_continuous_integration() {
    for ci in [None, Some(""), Some("0"), Some("false")] {
        assert!(is_allowed(Lack::Graphics, ci, None), "CI={ci:?}");
    }
    for (may_skip, allowed) in [
        (None, false),
        (Some(""), false),
        (Some("models"), false),
        (Some("graphics"), true),
        (Some("models graphics"), true),
        (Some("graphicsmodels"), false),
    ] {
        assert_eq!(is_allowed(Lack::Graphics, Some("true"), may_skip), allowed, "BVHSCOPE_MAY_SKIP={may_skip:?}");
    }
}

/// The variable with which this program is started again to skip a test.
const SKIPS: &str = "BVHSCOPE_TEST_OF_SKIPPING";

/// Runs this test once more, as one that is skipped.
fn skipped(list: &Path, ci: Option<&str>, may_skip: &str) -> Output {
    let mut program = Command::new(std::env::current_exe().unwrap());
    program.args(["--exact", "skips::a_skipped_test_is_said_and_listed"]).env(SKIPS, "1");
    program.env("BVHSCOPE_SKIPPED", list).env("BVHSCOPE_MAY_SKIP", may_skip).env_remove("CI");
    program.envs(ci.map(|value| ("CI", value))).output().unwrap()
}

#[test]
fn a_skipped_test_is_said_and_listed() {
    if std::env::var_os(SKIPS).is_some() {
        return skip(Lack::Mounts, "no disk");
    }
    let folder = std::env::temp_dir().join(format!("bvhscope-skips-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let list = folder.join("skipped.log");
    let line = "skipped for want of mounts: skips::a_skipped_test_is_said_and_listed: no disk\n";
    for ci in [None, Some("true")] {
        let output = skipped(&list, ci, "models mounts");
        // Past the capture of the harness, which hides what tests that pass print.
        assert!(output.status.success() && String::from_utf8_lossy(&output.stderr).contains(line), "{output:?}");
    }
    assert_eq!(std::fs::read_to_string(&list).unwrap(), line.repeat(2), "each skip is a line");
    let output = skipped(&list, Some("true"), "models");
    assert!(!output.status.success(), "{output:?}");
    assert!(String::from_utf8_lossy(&output.stdout).contains("no disk"), "the failure says why: {output:?}");
    assert_eq!(std::fs::read_to_string(&list).unwrap(), line.repeat(2), "a failure is not listed as a skip");
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Nothing leaves a test out but [`skip()`].
#[test]
fn no_test_is_left_out_in_another_way() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut folders = vec![root.join("tests"), root.join("src"), root.join("engine/src"), root.join("engine/tests")];
    let mut faults = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let Ok(text) = std::fs::read_to_string(&path) else { continue };
            // In two pieces, so that this file does not find itself.
            let marks = [concat!("#[ign", "ore"), concat!("ln!(\"ski", "p"), concat!("stderr(), \"ski", "p")];
            if path.extension().is_some_and(|extension| extension == "rs")
                && marks.iter().any(|mark| text.contains(mark))
            {
                faults.push(path);
            }
        }
    }
    assert!(faults.is_empty(), "skipped without support::skip: {faults:?}");
}
