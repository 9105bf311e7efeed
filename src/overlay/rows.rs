//! The rows of the settings of the containers over the picture.

use bvhscope_engine::tree::ContainerKind;

use super::settings::{ColorBy, OverlaySettings};
use crate::catalog::settings::{Choice, Limits, Number, Setting, Settings, Value, Written};

/// All settings, in the order in which help texts and copied command lines have them.
static SETTINGS: [&Setting<OverlaySettings>; 10] =
    [&CONTAINERS, &DEPTH, &LEAVES, &PARENTS, &FACES, &OVERLAP, &COLOR_BY, &HIDDEN_LINES, &LINE_WIDTH, &AT_MOST];

impl Settings for OverlaySettings {
    const HEADING: &'static str = "Overlay";

    fn rows() -> &'static [&'static Setting<Self>] {
        &SETTINGS
    }
}

/// The kinds of containers that are drawn, chosen by hand.
pub static CONTAINERS: Setting<OverlaySettings> = Setting {
    key: "overlay",
    value_name: "LIST",
    help: "Draw containers over the picture: {}, or several of them separated by commas; both (box and sphere), all (but oriented), or \
           none but the selected node's [default: none]",
    label: "Show",
    tip: "Boxes, spheres and 14-DOPs, whichever the tree is built with (B hides all)",
    value: Value::Any {
        options: || {
            ContainerKind::WITH_ORIENTED
                .map(|kind| {
                    let (label, tip) = match kind {
                        ContainerKind::Aabb => ("Boxes", "Draw the boxes around nodes"),
                        ContainerKind::Sphere => ("Spheres", "Draw the spheres around nodes"),
                        ContainerKind::Dop14 => ("14-DOPs", "Draw the 14-DOPs around nodes"),
                        ContainerKind::Oriented => {
                            ("Oriented", "Draw the turned and skewed boxes of a tree after the pass Orient")
                        }
                    };
                    Choice::new(kind.name(), label, tip)
                })
                .into()
        },
        get: |overlay, index| overlay.containers.contains(ContainerKind::WITH_ORIENTED[index]),
        set: |overlay, index, on| {
            let (kind, kinds) = (ContainerKind::WITH_ORIENTED[index], overlay.containers);
            *overlay = overlay.with_kinds(if on { kinds.with(kind) } else { kinds.without(kind) });
        },
        all: ContainerKind::ALL.len(),
        // Earlier versions had names in place of lists.
        names: &[
            ("both", "box,sphere"),
            ("box-dop", "box,dop"),
            ("sphere-dop", "sphere,dop"),
            ("box-oriented", "box,oriented"),
        ],
        refusal: |_, _| None,
    },
    applies: |_| true,
    written: Written::Always,
};

/// First and last depth.
pub static DEPTH: Setting<OverlaySettings> = Setting {
    key: "depth",
    value_name: "A..B",
    help: "Tree levels that are drawn, root 0, both ends included [default: those that hold 100 to 200 nodes]",
    label: "",
    tip: "",
    value: Value::Range {
        limits: Limits::whole(0, 1 << 24),
        expected: "a tree level, or the first and the last one as A..B (root 0), is expected",
        single: true,
        get: |overlay| overlay.depth.map(|depth| depth.map(|level| level as f32)),
        set: |overlay, depth| overlay.depth = depth.map(|depth| depth.map(|level| level as u32)),
    },
    applies: |_| true,
    written: Written::Changed,
};

/// Leaves alone.
pub static LEAVES: Setting<OverlaySettings> = Setting {
    key: "leaves",
    value_name: "",
    help: "Draw only leaves",
    label: "Of these",
    tip: "Draw only the leaves within the chosen depths",
    value: Value::Switch {
        name: "Leaves only",
        get: |overlay| overlay.leaves_only,
        set: |overlay, on| overlay.leaves_only = on,
    },
    applies: |_| true,
    written: Written::Changed,
};

/// Levels above the depths.
pub static PARENTS: Setting<OverlaySettings> = Setting {
    key: "parents",
    value_name: "",
    help: "Draw all levels above the chosen ones too",
    label: "Of these",
    tip: "Also draw all levels above the chosen depths",
    value: Value::Switch { name: "Parents", get: |overlay| overlay.parents, set: |overlay, on| overlay.parents = on },
    applies: |_| true,
    written: Written::Changed,
};

/// Filled sides.
pub static FACES: Setting<OverlaySettings> = Setting {
    key: "faces",
    value_name: "",
    help: "Fill the sides of containers that face the viewer, faintly",
    label: "Fill",
    tip: "Fill the sides that face you, faintly, so that near and far are told apart",
    value: Value::Switch { name: "Faces", get: |overlay| overlay.faces, set: |overlay, on| overlay.faces = on },
    applies: |_| true,
    written: Written::Changed,
};

/// Overlap of the selected node's children.
pub static OVERLAP: Setting<OverlaySettings> = Setting {
    key: "overlap",
    value_name: "",
    help: "Fill what the children of the selected node (--select) have in common, seen through the surface",
    label: "Fill",
    tip: "Fill what the children of the selected node have in common, seen through the surface: rays there must visit both. Of spheres the \
          smallest one around it is drawn",
    value: Value::Switch {
        name: "Overlap of children",
        get: |overlay| overlay.overlap,
        set: |overlay, on| overlay.overlap = on,
    },
    applies: |_| true,
    written: Written::Changed,
};

/// The meaning of a container's colour.
pub static COLOR_BY: Setting<OverlaySettings> = Setting {
    key: "color-by",
    value_name: "NAME",
    help: "What the colour of a line means: {}",
    label: "Colour by",
    tip: "What the colour of a container means; the legend has the numbers",
    value: Value::One {
        options: || ColorBy::ALL.map(color_choice).into(),
        get: |overlay| ColorBy::ALL.iter().position(|color_by| *color_by == overlay.color_by),
        set: |overlay, index| overlay.color_by = ColorBy::ALL[index],
    },
    applies: |_| true,
    written: Written::If(|overlay| overlay.color_by != ColorBy::Survival),
};

/// A command draws one tree, so that its flag cannot name what needs another.
fn color_choice(color_by: ColorBy) -> Choice {
    let (is_flag, former_names) = (color_by != ColorBy::Survival, color_by.former_names());
    Choice { is_flag, former_names, ..Choice::new(color_by.name(), color_by.label(), color_by.meaning()) }
}

/// Strength of lines behind the surface.
pub static HIDDEN_LINES: Setting<OverlaySettings> = Setting {
    key: "hidden-lines",
    value_name: "X",
    help: "Strength of lines behind the surface, {}",
    label: "Hidden lines",
    tip: "How strong lines behind the surface are. 0 hides them, 1 draws them like those in front",
    value: Value::Number(Number {
        symbol: "",
        limits: Limits::decimal(0.0, 1.0, 2),
        get: |overlay| overlay.hidden_alpha,
        set: |overlay, alpha| overlay.hidden_alpha = alpha,
    }),
    applies: |_| true,
    written: Written::Always,
};

/// Width of the lines.
pub static LINE_WIDTH: Setting<OverlaySettings> = Setting {
    key: "line-width",
    value_name: "PX",
    help: "Width of the lines, {} pixels; in the viewer points",
    label: "Line width",
    tip: "Width of the lines in points, the same at any zoom",
    value: Value::Number(Number {
        symbol: "",
        limits: Limits::decimal(0.25, 64.0, 2).slider(0.5, 4.0),
        get: |overlay| overlay.line_width,
        set: |overlay, width| overlay.line_width = width,
    }),
    applies: |_| true,
    written: Written::Always,
};

/// The budget of drawn containers.
pub static AT_MOST: Setting<OverlaySettings> = Setting {
    key: "at-most",
    value_name: "N",
    help: "Maximum number of containers of each kind that are drawn, the largest on screen first, {} [default: 250000]",
    label: "At most",
    tip: "Containers drawn of each kind; where the depths hold more, the largest on screen are shown. More is slower",
    value: Value::Optional {
        limits: Limits::whole(1, 1_000_000).slider(100.0, 1_000_000.0).logarithmic(),
        none: "",
        get: |overlay| overlay.budget.map(|budget| budget as f32),
        set: |overlay, budget| overlay.budget = budget.map(|budget| budget as u32),
    },
    applies: |_| true,
    written: Written::Changed,
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_keep_their_word() {
        crate::catalog::settings::check_rows::<OverlaySettings>();
    }

    #[test]
    fn names_of_earlier_versions_are_read() {
        for (text, list) in [
            ("none", "none"),
            ("oriented,box,box", "box,oriented"),
            ("both", "box,sphere"),
            ("box-dop", "box,dop"),
            ("sphere-dop", "sphere,dop"),
            ("all", "box,sphere,dop"),
            ("box-oriented", "box,oriented"),
        ] {
            let mut overlay = OverlaySettings::default();
            assert_eq!(CONTAINERS.parse(&mut overlay, text), Ok(()), "{text}");
            assert_eq!((CONTAINERS.text(&overlay).as_str(), overlay.follows_tree), (list, false), "{text}");
        }
        let mut overlay = OverlaySettings::default();
        assert_eq!(COLOR_BY.parse(&mut overlay, "size"), Ok(()));
        assert_eq!(COLOR_BY.text(&overlay), "area");
        let error = CONTAINERS.parse(&mut OverlaySettings::default(), "box,cube");
        assert_eq!(error, Err("one of box, sphere, dop, oriented is expected".to_owned()));
    }
}
