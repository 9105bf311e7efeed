//! The fields of a row that are no numbers of its tree, each with its meaning, and the page that lists all fields.

use std::fmt::Write as _;

use super::numbers::NUMBERS;

/// Name in JSON and CSV, and meaning in one sentence without a full stop.
pub type Field = (&'static str, &'static str);

/// The tree that a row measures; in CSV before the numbers.
pub const TREE: [Field; 13] = [
    ("command", "The command that made the row: bench, sweep, scaling, compare or diff"),
    ("model", "The model as the command line named it"),
    ("triangles", "Number of triangles of the model"),
    ("builder", "Name of the builder; of a tree from a file as the file states it"),
    (
        "tree",
        "The file that holds the tree, where it was read: threshold, epsilon, curve and optimize then mean nothing",
    ),
    ("preset", "Name of the preset that the settings come from, if any"),
    ("container", "box or sphere"),
    ("threshold", "The threshold δ of AAC, in primitives"),
    ("epsilon", "The reduction exponent ε of AAC"),
    ("curve", "Space-filling curve along which the primitives were sorted: morton, hilbert or extended"),
    ("optimize", "Optimisation passes, separated by commas"),
    ("rounds", "Rounds of annealing, where that is one of the passes"),
    ("threads", "Number of threads for building and tracing"),
];

/// The conditions of the measurement; in CSV behind the numbers.
pub const CONDITIONS: [Field; 17] = [
    ("predicted_scaling", "Of `scaling --predict`: the speed-up predicted for more cores, in the row of one thread"),
    ("traversal", "How rays visit nodes of the binary tree: ordered or paper"),
    ("width_px", "Width of the traced picture in pixels"),
    ("height_px", "Height of the traced picture in pixels"),
    ("repeat", "Number of repetitions behind each median"),
    ("eye", "Position of the camera, as x, y and z"),
    ("target", "The point at the centre of the picture"),
    ("up", "The up direction of the picture"),
    ("fov", "Vertical field of view in degrees"),
    ("simd", "Instructions of builds and rays: sse2, sse4, avx2, avx512 or neon"),
    ("version", "Version of the program"),
    ("commit", "Commit that the program was built from; absent where the build did not name it"),
    ("machine", "Name of the processor, with the number of threads that it runs at once"),
    ("date", "Day and minute of the measurement in UTC"),
    ("command_line", "The command that makes the row again, with the same counts"),
    (
        "populations",
        "Of `--rays`, for each population: its name, number of rays, root_hits (rays that enter the root), visits and \
         predicted_visits of all nodes, and cost of a ray that enters the root, in which a visited interior node counts 1 and a \
         tested triangle 1",
    ),
    ("warnings", "Warnings of loading the model"),
];

/// The page `docs/fields.md`.
pub fn page() -> String {
    let mut text = "# Fields of JSON and CSV\n\nThe rows of `bench`, `sweep`, `scaling`, `compare`, and `a` and `b` of `diff`. `info` \
                    and `render` have the same numbers under the same names. Where a field does not apply it is absent; where it is \
                    not known it is null, in CSV empty. Written from the program's own table; a test compares both.\n"
        .to_owned();
    let mut section = |title: &str, rows: &mut dyn Iterator<Item = (String, &str, String)>| {
        let _ = write!(text, "\n## {title}\n\n| field | unit | meaning |\n|---|---|---|\n");
        rows.for_each(|(key, unit, meaning)| {
            let _ = writeln!(text, "| `{key}` | {unit} | {meaning} |");
        });
    };
    let plain = |(key, meaning): &Field| (String::from(*key), "", String::from(*meaning));
    section("The tree", &mut TREE.iter().map(plain));
    let numbers = NUMBERS.iter().flat_map(|number| {
        let own = (number.key.to_owned(), number.unit, number.meaning.to_owned());
        let spread = number.spread.map(|(key, _)| {
            (
                key.to_owned(),
                number.unit,
                format!("Smallest and largest `{}`; absent for a single repetition", number.key),
            )
        });
        [Some(own), spread].into_iter().flatten()
    });
    section("Its numbers", &mut numbers.into_iter());
    section("The conditions", &mut CONDITIONS.iter().map(plain));
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `UPDATE_GOLDEN=1` writes the page.
    #[test]
    fn the_page_lists_the_fields_of_the_catalogue() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/fields.md");
        if std::env::var_os("UPDATE_GOLDEN").is_some() {
            assert!(std::fs::write(&path, page()).is_ok());
        }
        let written = std::fs::read_to_string(&path).unwrap_or_default();
        for (number, (written, expected)) in written.lines().zip(page().lines()).enumerate() {
            assert_eq!(written, expected, "docs/fields.md:{}", number + 1);
        }
        assert_eq!(written.lines().count(), page().lines().count());
    }
}
