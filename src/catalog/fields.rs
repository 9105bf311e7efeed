//! The fields of a row that are no numbers of its tree, each with its meaning, and the page that lists all fields.

use std::fmt::Write as _;

use super::numbers::NUMBERS;
use super::settings::parameters;
use super::values::keys;

/// Name in JSON and CSV, and meaning in one sentence without a full stop.
pub type Field = (&'static str, &'static str);

/// The tree that a row measures; in CSV before its settings.
pub const TREE: [Field; 8] = [
    ("command", "The command that made the row"),
    ("model", "The model as the command line named it"),
    ("triangles", "Number of triangles of the model"),
    ("builder", "Name of the builder; of a tree from a file as the file states it"),
    ("tree", "The file that holds the tree, where it was read; its settings are then absent"),
    (
        "label",
        "Name of the tree: that of `--label`; else of `diff` its settings, and of a file whose name another one has its whole path",
    ),
    ("preset", "Name of the preset that has these settings, whatever the containers; absent where none has"),
    ("container", "box, sphere, dop or oriented"),
];

/// Of `animate`, behind the settings.
pub const MOTION: [Field; 4] = [
    ("policy", "Of `animate`, and of others with `--policy`: the policy by which the tree follows the model"),
    ("clip", "Of `animate`, and of others with `--time`, `--clip` or `--frames`: name of the clip"),
    ("frame", "Of `animate`: the frame, from 0"),
    ("time_s", "Time of the clip in seconds"),
];

/// Of `compare`, behind the settings.
pub const FORM: [Field; 2] = [
    (
        "open",
        "Of `compare`, of a scene of copies: most parts for each copy in the tree above, 1 for whole copies, null for the flat scene",
    ),
    ("traced_bytes", "Of `compare`, of a scene of copies: bytes of what rays read, wide trees and places of copies"),
];

/// Behind the settings.
pub const THREADS: Field = ("threads", "Number of threads for building and tracing");

/// The conditions of the row; in CSV behind the numbers.
pub const CONDITIONS: [Field; 20] = [
    ("predicted_scaling", "Of `scaling --predict`: the speed-up predicted for more cores, in the row of one thread"),
    ("traversal", "How rays visit nodes of the binary tree: ordered or paper"),
    ("width_px", "Width of the traced picture in pixels"),
    ("height_px", "Height of the traced picture in pixels"),
    (
        "repeat",
        "Number of rounds behind each median: in each, every tree is built or updated and traced once, in the opposite order in each second one",
    ),
    (
        "times",
        "The value of each round by the name of the median; rows that were measured in turn have those of one round at one place",
    ),
    (
        "verdicts",
        "How times compare with those of the tree named by against that was measured in turn: of `compare` the preset fast, else the first; \
         of `animate`, in the rows of the last frame and over all frames, frame_ms with a ray for each pixel against the policy of the least \
         time and against rebuild. verdict (better, worse, not decided, the same tree, measured once) and interval hold with 99 %: factor is \
         the median of the ratios of this time over the other's in each of so many rounds (of animate frames), less of which are below 1; by \
         the sign test, of fewer than 8 rounds by the rank-sum test and beyond a factor of 1.1 alone. Against rebuild also break_even_rays, \
         the median over the frames of (ready_ms of rebuild − ready_ms) / (ray_ns − ray_ns of rebuild), its break_even_interval (null for \
         infinity), and pays_from, the frame from which on rebuilding takes less time in each to the end, absent where that is none or fewer than 8 frames are left",
    ),
    (
        "camera",
        "Where the camera stands: inside a model that encloses its centre, outside, front, back, left, right, top or bottom, at a camera of \
         the file (file 0), or given by a point",
    ),
    ("eye", "Position of the camera, as x, y and z; the camera is absent where no ray starts from it"),
    ("target", "The point at the centre of the picture"),
    ("up", "The up direction of the picture"),
    ("fov", "Vertical field of view in degrees"),
    ("simd", "Instructions of builds and rays: sse2, avx2, avx512 or neon"),
    ("version", "Version of the program"),
    (
        "commit",
        "Commit that the program was built from, with -dirty where files were changed since; absent where it was built without make",
    ),
    ("machine", "Name of the processor, with the number of threads that it runs at once"),
    ("date", "Day and minute of the measurement in UTC"),
    ("command_line", "The command that makes the row again, with the same counts"),
    (
        "populations",
        "Of `--rays`, for each population: its name, number of rays, entering_rays (those that enter the scene's box, the \
         axis-aligned one around all triangles), root_hits (those that enter the root of the tree), visits and predicted_visits of \
         all nodes, cost of a ray that enters the root, in which a visited interior node counts 1 and a tested triangle 1, and \
         tests_per_ray and tests_per_entering_ray, of all rays and of entering_rays, in which each container tested counts 1, too; of `info` also node_visits, the visits of each node in the order of `tree -o FILE.csv`; in CSV each number is a column, such as `ao_cost`",
    ),
    ("warnings", "Warnings of loading the model"),
];

/// Of `layouts`, behind the threads.
const LAYOUTS: [Field; 28] = [
    ("children", "Most children of a node of the layout"),
    (
        "collapse",
        "How they are chosen from the binary tree: greedy (by area), optimal (by SAH), memory (by MSAH) or visits (by measured visits); engine \
         for the program's own wide tree",
    ),
    (
        "planes",
        "How the planes of their boxes are stored: f32, or 16 or 8 bits in the grid of the parent; f32+8 where the program's own tree has nodes of both",
    ),
    ("leaf_limit", "Most triangles of a leaf; leaves of the binary tree that hold more stay"),
    ("layout_nodes", "Number of nodes with children"),
    ("layout_leaves", "Number of leaves"),
    ("fullness", "Children over the number that all nodes have room for"),
    ("triangles_per_leaf", "Mean number of triangles of a leaf"),
    ("node_bytes", "Bytes of all nodes"),
    ("triangle_bytes", "Bytes of the triangles of all leaves, 40 each"),
    ("layout_sah_cost", "Cost by the surface area heuristic, as sah_cost, of the boxes as they are stored"),
    (
        "msah_bytes",
        "Memory SAH: bytes of the nodes and triangles that a random line through the root's box enters, on average, of the boxes as they are stored",
    ),
    ("population", "The rays"),
    ("rays", "Number of rays, each as many times as rays it stands for"),
    ("hits", "Rays that hit something"),
    (
        "differing_hits",
        "Rays that hit something else than in the program's own tree: none, unless nodes of a tree from a file do not enclose what is below",
    ),
    ("nodes_per_ray", "Nodes with children that a ray visits, on average"),
    ("leaves_per_ray", "Leaves that it visits"),
    ("container_tests_per_ray", "Boxes that it is tested against: all children of a visited node"),
    ("primitive_tests_per_ray", "Triangles that it is tested against"),
    ("tests_per_ray", "Both"),
    ("bytes_per_ray", "Bytes of the nodes visited and the triangles tested"),
    ("lines_64_per_ray", "Distinct lines of 64 bytes that these lie in, as if none were cached before"),
    ("lines_128_per_ray", "Those of 128 bytes"),
    ("greatest_stack", "Most nodes that wait on the stack of a ray"),
    ("on_front", "True if no other layout reads fewer bytes and takes fewer tests by these rays"),
    ("width_px", "Width of the view in pixels"),
    ("height_px", "Height of the view in pixels"),
];

/// Of `copies --open`, behind the threads.
const FORMS: [Field; 15] = [
    ("form", "Form of the scene: flat, or two-level"),
    ("open", "Most parts for each copy in the tree above, 1 for whole copies; absent for the flat scene"),
    ("parts", "Parts of copies that the tree above is built of; absent for the flat scene"),
    (
        "ready_ms",
        "Wall-clock time until rays can be traced, in milliseconds, of one build: of two levels that of the meshes' trees and of the tree above",
    ),
    ("traced_bytes", "Bytes of what rays read: the wide trees, and of two levels the places of the copies"),
    ("population", "The rays"),
    ("rays", "Number of rays, each as many times as rays it stands for"),
    ("hits", "Rays that hit something"),
    ("differing_hits", "Rays that hit something else than in the first form: none"),
    ("entered_per_ray", "Copies, or parts of them, that a ray is carried into, on average; absent for the flat scene"),
    ("nodes_per_ray", "Wide nodes that a ray visits, in both levels: up to eight boxes are tested at once in each"),
    (
        "blocks_per_ray",
        "Blocks of up to four triangles that it is tested against, or of up to four boxes around parts of copies",
    ),
    ("lines_64_per_ray", "Distinct lines of 64 bytes that nodes and blocks lie in, as if none were cached before"),
    ("width_px", "Width of the view in pixels"),
    ("height_px", "Height of the view in pixels"),
];

/// Of `copies --advice`, behind the threads.
const ADVICE: [Field; 23] = [
    ("population", "The rays"),
    (
        "change",
        "Another division into meshes: none (the scene as it is), split (a mesh in parts) or merge (two meshes as one)",
    ),
    ("mesh", "Index of the mesh that is changed, from 0; absent for the scene as it is"),
    ("parts", "Number of meshes that it is split into; absent for others"),
    ("with_mesh", "Index of the mesh that it is merged with; absent for others"),
    ("traced_bytes", "Bytes of what rays read: the wide trees and the places of the copies"),
    ("rays", "Number of rays, each as many times as rays it stands for"),
    ("hits", "Rays that hit something"),
    (
        "differing_hits",
        "Rays that end at another distance than in the scene as it is: of split at any other, none; of merge at one that differs by more than 0.01 %",
    ),
    ("entered_per_ray", "Copies that a ray is carried into, on average"),
    ("nodes_per_ray", "Wide nodes that a ray visits, in both levels: up to eight boxes are tested at once in each"),
    (
        "blocks_per_ray",
        "Blocks of up to four triangles that it is tested against, or of up to four boxes around copies",
    ),
    ("lines_64_per_ray", "Distinct lines of 64 bytes that nodes and blocks lie in, as if none were cached before"),
    ("nodes_change", "`nodes_per_ray` over that of the scene as it is, less 1; null for that, and where that is 0"),
    ("blocks_change", "The same of `blocks_per_ray`"),
    ("visits_change", "The same of nodes and blocks together"),
    ("bytes_change", "The same of `traced_bytes`"),
    ("entered_meshes", "Meshes that rays are carried into"),
    (
        "measured_meshes",
        "Those with most tests by the rays of all populations, which are measured in parts, and among which pairs are looked for",
    ),
    ("pairs", "Pairs of these whose copies stand together"),
    ("measured_pairs", "Pairs that are measured as one mesh"),
    ("width_px", "Width of the view in pixels"),
    ("height_px", "Height of the view in pixels"),
];

/// Of `copies`, behind the threads.
const COPIES: [Field; 20] = [
    ("population", "The rays"),
    ("rays", "Number of rays"),
    ("part", "Of the scene: all, above (the tree over the copies), mesh (all copies of it) or copy"),
    ("mesh", "Index of the mesh, from 0; absent where the part is not of one mesh"),
    ("copy", "Index of the copy, from 0; absent where the part is not one"),
    ("copies", "Number of copies in it"),
    ("mesh_triangles", "Triangles of one copy; absent where the part is not of one mesh"),
    ("center", "Middle of the box of the copy, as containers have it; absent where the part is not one"),
    (
        "mesh_box_ratio",
        "Surface area of the box around the turned box of the mesh, over that of the box of the copy's triangles: the mean over its copies; absent above the copies and where all lie on a line",
    ),
    ("copy_box_ratio", "The same of the box that the tree over the copies has around the copy"),
    (
        "measured_copies",
        "Number of copies that these are means over: all, or so many at equal distances in the list that few triangles need be placed",
    ),
    ("entered_per_ray", "Copies of it that a ray is carried into, whose trees it is tested with, on average"),
    ("hits_per_ray", "Part of the rays that end on it"),
    ("wasted_share", "Part of the entries after which the ray ends elsewhere or nowhere; null where there are none"),
    ("container_tests_per_ray", "Boxes that a ray is tested against in it, on average"),
    ("primitive_tests_per_ray", "Triangles that it is tested against in it"),
    ("tests_per_ray", "Both"),
    ("share_of_tests", "Part of the tests of the whole scene; null where there are none"),
    ("width_px", "Width of the view in pixels"),
    ("height_px", "Height of the view in pixels"),
];

/// Fields that single commands add in JSON.
const OWN: [(&str, &[Field]); 10] = [
    (
        "Of `--rays`, in lines of JSON below the rows",
        &[
            (
                "population",
                "The rays: there is a line for each `model`, `camera`, `container` and kind of rays of which three trees or more were measured",
            ),
            ("trees", "Number of trees"),
            (
                "sah_cost_r",
                "Correlation (Pearson) of SAH cost and cost of a ray over the trees: 1 is a perfect prediction, 0 none",
            ),
            ("epo_r", "That of EPO and cost of a ray"),
            ("alpha", "The α from 0 to 1 of which (1−α)·SAH+α·EPO predicts the cost best"),
            ("alpha_r", "Correlation of that sum and the cost, fitted to the same trees that it is judged by"),
        ],
    ),
    (
        "Of `info`",
        &[
            ("copies", "Number of copies of the meshes in a scene of two levels; absent for a flat scene"),
            ("flat_bytes", "Bytes that the flat scene of these copies would have; absent for a flat scene"),
            ("meshes", "Number of meshes of the file"),
            ("materials", "Number of materials"),
            ("textures", "Number of images"),
            ("has_normals", "The file has normals of vertices"),
            ("has_uvs", "It has texture coordinates"),
            ("has_colors", "It has colours of vertices"),
            ("bounds_min", "Smallest coordinates, those of the file"),
            ("bounds_max", "Largest coordinates, those of the file"),
            ("edges", "Number of edges; corners at equal coordinates are one"),
            ("open_edges", "Edges of an odd number of triangles; the model is closed where there are none"),
            ("shared_edges", "Edges of more than two triangles; the model is manifold where there are none"),
            (
                "turned_edges",
                "Edges of two triangles that run along them in the same direction, one with its front, one with its back outside; it is \
                 consistently oriented where there are none",
            ),
            (
                "offset",
                "Subtracted from the coordinates of the file in the containers of trees; cameras and rays are in those of the file",
            ),
            ("scene_up", "The up direction of the model"),
            (
                "cameras",
                "Names of the cameras of the file, which `--camera` takes by their numbers from 0; absent where it has none",
            ),
            ("lights", "Names of its lights, which `--light file` shows; absent where it has none"),
            (
                "scenes",
                "Names of its scenes, which `--scene` takes by their numbers from 0; absent where the format has none",
            ),
            (
                "clips",
                "Clips of a model that moves, which `--clip` takes by name or number from 0: name, start and end in seconds; absent \
                 where there are none",
            ),
            ("scene_bytes", "Bytes of the model in memory"),
            (
                "by_depth",
                "The nodes at each depth: nodes, leaves, area (sum of their surface areas over the root's, the expected visits by a \
                 random line that meets the root), sah_cost (their part of it), empty_space (of interior nodes the part of \
                 their surface that the children do not fill, on average by area) and visits by the rays of each population of `--rays`",
            ),
            ("findings", "Findings of the diagnosis"),
        ],
    ),
    ("Of `layouts`", &LAYOUTS),
    ("Of `copies`", &COPIES),
    ("Of `copies --open`", &FORMS),
    ("Of `copies --advice`", &ADVICE),
    (
        "Of a tree from a file",
        &[
            ("max_arity", "Most children of a node, as the file states it"),
            ("builder_settings", "Settings of the builder, as the file states them"),
            ("empty_nodes", "Number of nodes without triangles, which were left out"),
            (
                "faults",
                "Faults of each kind, with their number, the first node, in two levels the mesh that has it, and the largest excess",
            ),
        ],
    ),
    (
        "Of `render`",
        &[
            ("samples", "Rays of each pixel"),
            ("layout", "The layout of wide trees whose counts the colours stand for, where `--layout` names one"),
            ("color_range", "Values at the two ends of the colours, where these stand for values"),
            ("output", "The file that was written"),
        ],
    ),
    (
        "Of `ray`",
        &[
            ("kind", "Purpose of the ray: primary, shadow, ao or bounce"),
            ("pixel", "The pixel that the ray is of"),
            ("origin", "Where the ray starts"),
            ("direction", "Its direction, of length 1"),
            ("t_min", "Smallest distance of a hit"),
            ("t_max", "Largest distance of a hit; null for infinity"),
            ("hit", "Distance and triangle of the hit; null for a miss"),
            (
                "all_hits",
                "All hits, as if none ended the ray: distance, triangle, side, number of surfaces passed, and of every second one the thickness before it",
            ),
            ("has_more_hits", "True where the ray has more hits than these"),
            ("container_tests", "Containers tested"),
            ("primitive_tests", "Triangles tested"),
            ("node_lines", "Cache lines of nodes that are read; only of the wide tree"),
            ("triangle_lines", "Cache lines of triangles that are read; only of the wide tree"),
            ("visited", "Nodes visited"),
            ("wasted", "Nodes visited below which nothing is hit"),
            ("skipped", "Nodes entered by the ray and not visited, because a nearer hit was known"),
            ("omitted_events", "Number of events that were left out"),
            ("events", "Each step, with the tests and the nodes on the stack after it"),
            ("containers", "Each container that the ray enters, with the distances at which it enters and leaves it"),
        ],
    ),
    (
        "Of `diff`",
        &[
            ("a", "The row of tree A"),
            ("b", "The row of tree B"),
            (
                "difference",
                "Numbers of B minus those of A, of populations tests_per_entering_ray under names such as `ao_tests_per_entering_ray`",
            ),
            ("survived_nodes", "Nodes of A that B has too, leaves included"),
            ("survived_share", "The same as a fraction of all nodes of A"),
            ("survived_interior", "Interior nodes of A that B has too"),
            ("survived_interior_share", "The same as a fraction of all interior nodes of A"),
            ("pixels_fewer", "Pixels with fewer tests in B"),
            ("pixels_same", "Pixels with as many"),
            ("pixels_more", "Pixels with more"),
            ("by_depth", "The nodes of A and of B at each depth, as `by_depth` of `info`"),
            ("difference_range", "Differences at the two ends of the picture's colours"),
        ],
    ),
];

/// All columns of CSV, in order.
pub fn columns() -> Vec<&'static str> {
    let key = |(key, _): &Field| *key;
    let tree = TREE
        .iter()
        .map(key)
        .chain(parameters().map(|row| row.key))
        .chain(MOTION.iter().chain(&FORM).map(key))
        .chain([key(&THREADS)]);
    tree.chain(keys()).chain(CONDITIONS.iter().map(key)).collect()
}

/// All columns of the CSV of `layouts`, in order.
pub fn layout_columns() -> Vec<&'static str> {
    columns_with(&LAYOUTS)
}

/// All columns of the CSV of `copies`, in order.
pub fn copy_columns() -> Vec<&'static str> {
    columns_with(&COPIES)
}

/// All columns of the CSV of `copies --open`, in order.
pub fn form_columns() -> Vec<&'static str> {
    columns_with(&FORMS)
}

/// All columns of the CSV of `copies --advice`, in order.
pub fn advice_columns() -> Vec<&'static str> {
    columns_with(&ADVICE)
}

/// Those of a command with fields of its `own` between tree and conditions.
fn columns_with(own: &[Field]) -> Vec<&'static str> {
    let key = |(key, _): &Field| *key;
    let tree = TREE.iter().map(key).chain(parameters().map(|row| row.key)).chain([key(&THREADS)]);
    let is_own = |name: &&str| own.iter().any(|(key, _)| key == name);
    tree.chain(own.iter().map(key)).chain(CONDITIONS.iter().map(key).filter(|name| !is_own(name))).collect()
}

/// The page `docs/fields.md`.
pub fn page() -> String {
    let mut text = "# Fields of JSON and CSV\n\nThe rows of `bench`, `sweep`, `scaling`, `compare`, `animate`, `layouts`, `copies`, `info`, `render`, `ray`, and `a` and \
                    `b` of `diff`. Where a field does not apply it is absent; where it is not known it is null, in CSV empty. \
                    Written from the program's own table; a test compares both.\n"
        .to_owned();
    let mut section = |title: &str, rows: &mut dyn Iterator<Item = (String, &str, String)>| {
        let _ = write!(text, "\n## {title}\n\n| field | unit | meaning |\n|---|---|---|\n");
        rows.for_each(|(key, unit, meaning)| {
            let _ = writeln!(text, "| `{key}` | {unit} | {meaning} |");
        });
    };
    let plain = |(key, meaning): &Field| (String::from(*key), "", String::from(*meaning));
    let settings = parameters().map(|row| (row.key.to_owned(), "", format!("{}. {}", row.label, row.tip)));
    let behind = MOTION.iter().chain(&FORM).map(plain).chain([plain(&THREADS)]);
    section("The tree", &mut TREE.iter().map(plain).chain(settings).chain(behind));
    let numbers = NUMBERS.iter().flat_map(|number| {
        let own = (number.key.to_owned(), number.unit, number.meaning.to_owned());
        let spread = number.spread.map(|(key, _)| {
            (
                key.to_owned(),
                number.unit,
                format!("Lower and upper quartile of `{}` over the rounds; absent for a single one", number.key),
            )
        });
        [Some(own), spread].into_iter().flatten()
    });
    section("Its numbers", &mut numbers.into_iter());
    section("The conditions", &mut CONDITIONS.iter().map(plain));
    for (title, fields) in &OWN {
        section(title, &mut fields.iter().map(plain));
    }
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
