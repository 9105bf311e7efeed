//! Lessons: guided tours in steps, each a state of the window with a caption whose numbers are measured.

mod check;
mod numbers;
mod step;

mod text;

mod reading;

pub use check::Check;
pub use numbers::Numbers;
pub use reading::Reading;
pub use step::Step;
pub use text::Lesson;

/// The built-in lessons, in the order of the menu.
pub const LESSONS: [&str; 6] = [
    include_str!("../../../../assets/lessons/1-what-a-tree-saves.txt"),
    include_str!("../../../../assets/lessons/2-two-phases.txt"),
    include_str!("../../../../assets/lessons/3-threshold-and-reduction.txt"),
    include_str!("../../../../assets/lessons/4-box-or-sphere.txt"),
    include_str!("../../../../assets/lessons/5-when-sah-lies.txt"),
    include_str!("../../../../assets/lessons/6-why-here.txt"),
];
