//! The rows of the settings.

use bvhscope_engine::settings::{BuildSettings, BuilderKind, Curve, Pass, Passes, Preset};
use bvhscope_engine::tree::ContainerKind;

use super::setting::{Choice, Limits, Number, Setting, Settings, Value, Written};

/// All settings, in the order in which window and copied command lines have them.
pub static SETTINGS: [&Setting; 8] = [&BUILDER, &CONTAINER, &PRESET, &THRESHOLD, &EPSILON, &CURVE, &OPTIMIZE, &ROUNDS];

impl Settings for BuildSettings {
    const HEADING: &'static str = "Tree";

    fn rows() -> &'static [&'static Setting] {
        &SETTINGS
    }

    fn base() -> Option<&'static Setting> {
        Some(&PRESET)
    }

    /// Where a given setting is of AAC only and no builder is given, AAC is taken; where builder and container exclude each other, the
    /// one that is not given is replaced.
    fn settle(&mut self, is_given: &dyn Fn(&Setting) -> bool) {
        let [has_builder, has_container] = [is_given(&BUILDER), is_given(&CONTAINER)];
        let aac = Self { builder: BuilderKind::Aac, ..*self };
        let of_aac = |row: &&Setting| is_given(row) && !(row.applies)(self) && (row.applies)(&aac);
        if !has_builder && SETTINGS.into_iter().any(|row| of_aac(&row)) {
            self.builder = BuilderKind::Aac;
        }
        if self.refusal(0).is_some() {
            match (has_builder, has_container) {
                (true, false) => self.container = ContainerKind::Aabb,
                (false, true) => self.builder = BuilderKind::Aac,
                _ => {}
            }
        }
    }
}

/// The algorithm.
pub static BUILDER: Setting = Setting {
    key: "builder",
    value_name: "NAME",
    help: "The algorithm: {}",
    label: "Builder",
    tip: "The algorithm that builds the tree. Compare SAH cost and tests per ray after a change",
    value: Value::One {
        options: || BuilderKind::ALL.map(|kind| Choice::new(kind.name(), kind.label(), builder_sentence(kind))).into(),
        get: |build| BuilderKind::ALL.iter().position(|kind| *kind == build.builder),
        set: |build, index| build.builder = BuilderKind::ALL[index],
    },
    applies: |_| true,
    written: Written::Always,
};

const fn builder_sentence(kind: BuilderKind) -> &'static str {
    match kind {
        BuilderKind::Aac => "Approximate agglomerative clustering (Gu et al. 2013)",
        BuilderKind::Swift => {
            "AAC over leaves of up to four neighbours along the curve: a faster build, a slightly worse tree"
        }
        BuilderKind::Lbvh => {
            "Median split by Morton code (Lauterbach et al. 2009): the fastest build of all, the worst tree"
        }
        BuilderKind::Ploc => {
            "Merges mutual nearest neighbours along the curve, round by round (PLOC: Meister and Bittner 2018)"
        }
        BuilderKind::Hploc => {
            "PLOC on short lists, bottom-up along the nodes of an LBVH (H-PLOC: Benthin et al. 2024): faster, nearly as good a tree"
        }
        BuilderKind::BinnedSah => "Top-down splits by the surface area heuristic (Wald 2007), not with spheres",
        BuilderKind::Sweep => {
            "Top-down, the best of all splits by the surface area heuristic (Wald 2007): slower than bins, not with spheres"
        }
        BuilderKind::Sbvh => {
            "Sweep SAH that also splits space by planes, so that several leaves hold one triangle (Stich et al. 2009): for walls and \
             beams, slow, boxes only"
        }
        BuilderKind::Exact => "Always merges the closest pair (Walter et al. 2008); small scenes only",
        BuilderKind::None => "No tree: every ray tests every triangle",
    }
}

/// Boxes, spheres or 14-DOPs.
pub static CONTAINER: Setting = Setting {
    key: "container",
    value_name: "KIND",
    help: "What the tree is made of: {}",
    label: "Container",
    tip: "Bounding volume of each node. Boxes are tighter than spheres; 14-DOPs fit slanted and thin things, at a higher price of each test",
    value: Value::One {
        options: || {
            ContainerKind::ALL.map(|kind| Choice::new(kind.name(), kind.label(), container_sentence(kind))).into()
        },
        get: |build| ContainerKind::ALL.iter().position(|kind| *kind == build.container),
        set: |build, index| build.container = ContainerKind::ALL[index],
    },
    applies: |_| true,
    written: Written::Always,
};

/// One sentence about a kind of containers.
pub const fn container_sentence(kind: ContainerKind) -> &'static str {
    match kind {
        ContainerKind::Aabb => "Build and trace the tree with axis-aligned boxes",
        ContainerKind::Sphere => "Build and trace the tree with spheres",
        ContainerKind::Oriented => {
            "Build a tree of boxes, then give each node the smallest of its box, of one turned to fit and of one skewed to the planes of \
             the 14-DOP (the pass Orient)"
        }
        ContainerKind::Dop14 => {
            "Build and trace the tree with 14-DOPs, polytopes of 14 planes: boxes whose corners are cut off (Klosowski et al. 1998)"
        }
    }
}

/// Several settings by one name; the container stays.
pub static PRESET: Setting = Setting {
    key: "preset",
    value_name: "NAME",
    help: "AAC: threshold and ε by name: swift (6, 0.2 over leaf blocks), fast (6, 0.2), hq (12, 0.1), aac-fast (4, 0.2), aac-hq (20, 0.1), best (6, 0.2 and \
           collapse, restructure, reinsert), finest (6, 0.2 and every pass: takes minutes)",
    label: "Preset",
    tip: "AAC with named values of the settings below",
    value: Value::One {
        options: || {
            Preset::ALL.map(|preset| Choice::new(preset.name(), preset.label(), preset_sentence(preset))).into()
        },
        get: preset_of,
        set: |build, index| *build = BuildSettings::preset(Preset::ALL[index], build.container),
    },
    applies: |_| true,
    written: Written::If(|_| false),
};

fn preset_sentence(preset: Preset) -> String {
    let (threshold, epsilon) = preset.parameters();
    let purpose = match preset {
        Preset::Swift => "over leaves of up to four neighbouring triangles, the fastest build of AAC",
        Preset::Fast => "the fast setting of Mahmuda, Yuniarti and Nurul K.",
        Preset::Hq => "their better tree, in a slower build",
        Preset::AacFast => "the fast setting of Gu et al. 2013",
        Preset::AacHq => "the better tree of Gu et al. 2013, in a slower build",
        Preset::Best => "then collapse, restructure and reinsert, for scenes that do not move",
        Preset::Finest => "and every pass: the best tree, in minutes",
    };
    format!("Threshold {threshold}, ε {epsilon}: {purpose}")
}

/// Index of the preset with these settings. Presets without annealing have any number of rounds.
fn preset_of(build: &BuildSettings) -> Option<usize> {
    Preset::ALL.into_iter().position(|preset| {
        let named = BuildSettings::preset(preset, build.container);
        *build == if preset.is_slow() { named } else { BuildSettings { rounds: build.rounds, ..named } }
    })
}

/// The traversal stopping threshold δ.
pub static THRESHOLD: Setting = Setting {
    key: "threshold",
    value_name: "N",
    help: "AAC: fewer triangles than this are clustered, not split, {}",
    label: "Threshold δ",
    tip: "Groups of fewer triangles are clustered rather than split. Higher: slower build, mostly fewer tests per ray. \
          6 fast, 12 good ([ and ])",
    value: Value::Number(Number {
        symbol: "δ",
        limits: Limits::whole(BuildSettings::MIN_THRESHOLD, BuildSettings::MAX_THRESHOLD).logarithmic(),
        get: |build| build.threshold as f32,
        set: |build, value| build.threshold = value as u32,
    }),
    applies: is_aac,
    written: Written::Always,
};

/// The exponent ε of the reduction function.
pub static EPSILON: Setting = Setting {
    key: "epsilon",
    value_name: "X",
    help: "AAC: exponent of the reduction function, {}",
    label: "Reduction ε",
    tip: "How strongly clusters are reduced on the way up. Smaller: more clusters kept, slower build, better tree",
    value: Value::Number(Number {
        symbol: "ε",
        limits: Limits::decimal(0.0, BuildSettings::MAX_EPSILON, 2),
        get: |build| build.epsilon,
        set: |build, value| build.epsilon = value,
    }),
    applies: is_aac,
    written: Written::Always,
};

fn is_aac(build: &BuildSettings) -> bool {
    build.builder.is_aac()
}

/// The space-filling curve.
pub static CURVE: Setting = Setting {
    key: "curve",
    value_name: "NAME",
    help: "AAC, LBVH, PLOC and H-PLOC: the curve along which triangles are sorted: {} (Morton and size)",
    label: "Curve",
    tip: "Space-filling curve along which triangles are sorted before they are clustered",
    value: Value::One {
        options: || Curve::ALL.map(|curve| Choice::new(curve.name(), curve.label(), curve_sentence(curve))).into(),
        get: |build| Curve::ALL.iter().position(|curve| *curve == build.curve),
        set: |build, index| build.curve = Curve::ALL[index],
    },
    applies: |build| build.builder.sorts_along_curve(),
    written: Written::Changed,
};

const fn curve_sentence(curve: Curve) -> &'static str {
    match curve {
        Curve::Morton => "The bits of x, y and z in turn: the paper's, and the fastest",
        Curve::Hilbert => "Neighbours on it always touch. Helps spheres most",
        Curve::Extended => "With the triangles' size as a fourth axis (Vinkler et al. 2017)",
    }
}

/// Passes beside the builder's own work.
pub static OPTIMIZE: Setting = Setting {
    key: "optimize",
    value_name: "LIST",
    help: "Optimisation passes, separated by commas: split (large triangles, boxes only), collapse, restructure, reinsert and \
           anneal (boxes only; anneal takes minutes), orient (boxes only; turns and skews them in the end); or all (but orient), none",
    label: "Passes",
    tip: "What improves the tree before and after the builder. Each pass takes time",
    value: Value::Any {
        options: || Pass::ALL.map(|pass| Choice::new(pass.name(), pass.label(), pass_sentence(pass))).into(),
        get: |build, index| build.optimize.contains(Pass::ALL[index]),
        set: |build, index, on| {
            let pass = Pass::ALL[index];
            build.optimize = if on { build.optimize.with(pass) } else { build.optimize.without(pass) };
        },
        all: Pass::ALL.len() - 1,
        names: &[],
        refusal: |build, index| {
            let pass = Pass::ALL[index];
            let wanted = BuildSettings { optimize: Passes::NONE.with(pass), ..*build };
            if wanted.passes().contains(pass) {
                None
            } else if pass.boxes_only() && build.container != ContainerKind::Aabb {
                Some("For boxes only: choose the box container")
            } else {
                Some("Not with this builder")
            }
        },
    },
    applies: |_| true,
    written: Written::Changed,
};

const fn pass_sentence(pass: Pass) -> &'static str {
    match pass {
        Pass::Split => {
            "Puts large triangles into several boxes before the tree is built (Karras and Aila 2013). Helps walls and beams that \
             are not axis-aligned, takes more memory"
        }
        Pass::Collapse => "Makes leaves of several triangles where that is cheaper: fewer nodes",
        Pass::Restructure => "Builds treelets again from the top by SAH and keeps what is cheaper. Helps scans most",
        Pass::Reinsert => "Moves subtrees to where they cost less (Meister and Bittner 2018)",
        Pass::Anneal => {
            "Moves every subtree again and again, at first even where that costs more: hundreds of times as slow as all others, \
             and the best tree there is"
        }
        Pass::Orient => {
            "Gives each node of the finished tree the smallest of its box, of one turned to fit and of one skewed to the planes of the \
             14-DOP. Helps hair and plants"
        }
    }
}

/// Rounds of annealing.
pub static ROUNDS: Setting = Setting {
    key: "rounds",
    value_name: "N",
    help: "The pass anneal: number of rounds, {}; more give a better tree in proportionally more time",
    label: "Rounds",
    tip: "Rounds of annealing. More give a better tree in proportionally more time",
    value: Value::Number(Number {
        symbol: "",
        limits: Limits::whole(1, BuildSettings::MAX_ROUNDS).logarithmic(),
        get: |build| build.rounds as f32,
        set: |build, value| build.rounds = value as u32,
    }),
    applies: |build| build.annealing_rounds().is_some(),
    written: Written::If(|build| build.annealing_rounds().is_some()),
};
