//! docs/messages.md: one sample of each refusal and warning of the loader and the command line, with the message that it gives.
//! The page is compared with the program's messages; `UPDATE_MESSAGES=1` writes it again.

mod samples;

use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use bvhscope::scene::{LoadOptions, SceneSource, load};
use bvhscope_engine::cancel::CancelToken;

use crate::support::process::output;

/// A file, with others beside it, or a command line.
pub struct Sample {
    /// The fault, in a few words.
    what: String,
    /// Names and contents; the first file is loaded.
    files: Vec<(String, Vec<u8>)>,
    /// Arguments of the program, run where the files are; empty where the file is loaded by the library.
    args: Vec<String>,
}

/// A file that is loaded.
fn file(what: &str, name: &str, bytes: impl AsRef<[u8]>) -> Sample {
    Sample { what: what.to_owned(), files: vec![(name.to_owned(), bytes.as_ref().to_vec())], args: Vec::new() }
}

/// A command line, separated by blanks.
fn command(what: &str, args: &str) -> Sample {
    Sample { what: what.to_owned(), files: Vec::new(), args: args.split(' ').map(str::to_owned).collect() }
}

impl Sample {
    /// Puts another file beside the first.
    fn beside(mut self, name: &str, bytes: impl AsRef<[u8]>) -> Self {
        self.files.push((name.to_owned(), bytes.as_ref().to_vec()));
        self
    }

    /// The messages, without the folder's path.
    fn messages(&self) -> Vec<String> {
        let folder = tempfile::tempdir().unwrap();
        for (name, bytes) in &self.files {
            let path = folder.path().join(name);
            // A name without content is that of a missing file, one that ends in a slash that of a folder.
            match (name.ends_with('/'), bytes.is_empty() && self.what.contains("does not exist")) {
                (true, _) => std::fs::create_dir(path).unwrap(),
                (_, true) => {}
                _ => std::fs::write(path, bytes).unwrap(),
            }
        }
        let messages = if self.args.is_empty() { self.loaded(folder.path()) } else { self.ran(folder.path()) };
        let prefix = format!("{}/", folder.path().display());
        messages.into_iter().map(|message| message.replace(&prefix, "")).collect()
    }

    fn loaded(&self, folder: &Path) -> Vec<String> {
        let source = SceneSource::File(folder.join(&self.files[0].0));
        match load(&source, &LoadOptions::default(), &CancelToken::new()) {
            Ok(scene) => scene.warnings.entries.iter().map(ToString::to_string).collect(),
            Err(error) => vec![error.to_string()],
        }
    }

    fn ran(&self, folder: &Path) -> Vec<String> {
        let mut command = Command::new(env!("CARGO_BIN_EXE_bvhscope"));
        command.args(&self.args).current_dir(folder).stdin(Stdio::null());
        let output = output(command);
        assert!(!output.status.success(), "{:?}", self.args);
        let text = String::from_utf8_lossy(&output.stderr);
        let first = text.split("\n\n").next().unwrap_or_default();
        vec![first.trim().trim_start_matches("error: ").replace('\n', " ")]
    }
}

/// Memory and its limits differ between machines, and so do the numbers in their messages.
fn without_sizes(message: &str) -> String {
    match message.split_once(", but only ") {
        Some((start, rest)) if rest.contains("may still be used") => {
            let (_, end) = rest.split_once(" may still").unwrap();
            format!("{start}, but only … may still{end}")
        }
        _ => message.to_owned(),
    }
}

/// The page as it should be.
fn page() -> String {
    let mut page = "# Messages\n\nEvery file that cannot be used, or only in part, and what the program says about it. Each row is a sample; \
                    the test\n`tests/loading/messages` makes the file, loads it and compares the message with this page, and\n\
                    `UPDATE_MESSAGES=1 cargo test --test loading messages` writes the page again.\n"
        .to_owned();
    for (title, samples) in samples::sections() {
        write!(page, "\n## {title}\n\n| what | message |\n|---|---|\n").unwrap();
        for sample in samples {
            let messages = sample.messages();
            assert!(!messages.is_empty(), "{}: no message", sample.what);
            let shown: Vec<_> =
                messages.iter().map(|text| format!("`{}`", without_sizes(text).replace('|', "\\|"))).collect();
            writeln!(page, "| {} | {} |", sample.what.replace('|', "\\|"), shown.join("<br>")).unwrap();
        }
    }
    page
}

#[test]
fn the_page_of_messages_is_what_the_program_says() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/messages.md");
    let page = page();
    if std::env::var_os("UPDATE_MESSAGES").is_some() {
        std::fs::write(&path, &page).unwrap();
    }
    let written = std::fs::read_to_string(&path).unwrap_or_default();
    let old: Vec<&str> = written.lines().filter(|line| !page.lines().any(|other| other == *line)).collect();
    let new: Vec<&str> = page.lines().filter(|line| !written.lines().any(|other| other == *line)).collect();
    let (old, new) = (old.join("\n- "), new.join("\n+ "));
    assert!(written == page, "docs/messages.md disagrees (UPDATE_MESSAGES=1 writes it again):\n- {old}\n+ {new}");
}

/// Texts of the readers that are no messages: by these words a format is recognised.
const SIGNS: [&str; 6] =
    ["      1", "Kaydara FBX Binary", "; FBX ", "3D Geometry File Format", "# vtk DataFile", "AutoCAD Binary DXF"];

/// Each sentence in these readers is on the page: a refusal or warning without a sample is found here.
#[test]
fn every_message_of_the_scan_readers_has_a_sample() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = std::fs::read_to_string(root.join("docs/messages.md")).unwrap().replace("\\|", "|");
    let mut files = Vec::new();
    for folder in ["src/scene/ply", "src/scene/stl", "src/scene/recognise"] {
        files.extend(std::fs::read_dir(root.join(folder)).unwrap().map(|entry| entry.unwrap().path()));
    }
    let mut missing = Vec::new();
    for file in files {
        let text = std::fs::read_to_string(&file).unwrap();
        let code = text.split("#[cfg(test)]").next().unwrap();
        for line in code.lines().filter(|line| !line.trim_start().starts_with("//")) {
            let literals = line.split('"').skip(1).step_by(2);
            for literal in literals.filter(|literal| literal.matches(' ').count() > 1 && !SIGNS.contains(literal)) {
                let longest = literal.split(['{', '}']).max_by_key(|part| part.len()).unwrap_or_default();
                // Where there is one, the first word is in its singular.
                let (_, rest) = longest.split_once(' ').unwrap_or_default();
                if !page.contains(longest) && !page.contains(rest) {
                    missing.push(format!("{}: {literal}", file.display()));
                }
            }
        }
    }
    assert!(missing.is_empty(), "no sample in docs/messages.md gives these: {missing:#?}");
}
