//! The clusters over the picture in place of depths, as the view "Merges" chooses them: the step that they are of, how it plays, and
//! what was derived for it.

mod standing;

pub use standing::{ChoiceOf, CutNodes, MergeStudy, Standing};

use std::sync::{Arc, Weak};

use serde::{Deserialize, Serialize};

use crate::accel::{Accel, is_same};
use crate::app::state::study::Study;
use crate::lab::merges::{Merges, TreeOfRecord};
use crate::render::cluster_cut::ClusterCut;
use crate::visibility::NodeIdentity;
use bvhscope_engine::construction::{Cut, ExactComparison, MergeChoice, MergeOrder};

/// Merges a second at which a construction plays at first.
const SPEED: f64 = 20.0;

/// Nodes that the overlay draws while the view is open.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum CutKind {
    /// The active clusters at the step.
    #[default]
    Step,
    /// The largest nodes up to an area.
    Area,
    /// The largest nodes up to a number of triangles.
    Triangles,
}

/// The part of the plot beside the merges.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum MergePage {
    /// The list that the merge chose from.
    #[default]
    Why,
    /// The reduction function.
    Reduction,
    /// The exact tree beside AAC's.
    Price,
}

/// The user's choices, and the data derived for them.
#[derive(Debug)]
pub struct PictureCut {
    /// The merges of the presented tree; an error states why there are none.
    pub study: Study<MergeOrder, Result<MergeStudy, String>>,
    /// Why the two clusters of the present step were merged.
    pub choice: Study<ChoiceOf, Option<MergeChoice>>,
    /// Nodes of a cut by area or by number of triangles.
    pub cut: Study<Cut, CutNodes>,
    /// A subtree beside the exact one.
    pub price: Study<u32, Result<ExactComparison, String>>,
    /// The node of which the price is wanted.
    pub price_of: Option<u32>,
    /// The tree that the node belongs to; none where another window named it.
    price_tree: Weak<Accel>,
    /// The order in which merges are shown.
    pub order: MergeOrder,
    /// Number of active clusters at the present step; `None` while no step is chosen. Kept from tree to tree.
    pub left: Option<u32>,
    /// The part of a merge that has not been shown yet, while it plays.
    pub playing: Option<f64>,
    /// Merges a second.
    pub speed: f64,
    /// Number of merges at the end that the plot shows; `None` for all.
    pub window: Option<u32>,
    /// Nodes that the overlay draws.
    pub cut_kind: CutKind,
    /// Largest area of a cut, as a fraction of the root's.
    pub cut_area: f32,
    /// Largest number of triangles of a cut.
    pub cut_triangles: u32,
    /// The page beside the plot.
    pub page: MergePage,
    /// The selected node whose merge was shown last.
    pub followed: Option<u32>,
    /// The clusters that were drawn last, so that they are found once.
    standing: Option<Arc<Standing>>,
}

/// The part of the view in a shared state. Earlier versions share order, step and cut beside it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SharedMerges {
    speed: f64,
    window: Option<u32>,
    cut_area: f32,
    cut_triangles: u32,
    page: MergePage,
    price_of: Option<u32>,
}

impl Default for SharedMerges {
    fn default() -> Self {
        PictureCut::default().shared()
    }
}

impl Default for PictureCut {
    fn default() -> Self {
        Self {
            study: Study::default(),
            choice: Study::default(),
            cut: Study::default(),
            price: Study::default(),
            price_of: None,
            price_tree: Weak::new(),
            order: MergeOrder::default(),
            left: None,
            playing: None,
            speed: SPEED,
            window: None,
            cut_kind: CutKind::default(),
            cut_area: 0.01,
            cut_triangles: 100,
            page: MergePage::default(),
            followed: None,
            standing: None,
        }
    }
}

impl PictureCut {
    /// Name of its view.
    pub const VIEW: &str = "Merges";
    /// Slowest and fastest playing in merges a second.
    pub const SPEEDS: [f64; 2] = [1.0, 1e6];
    /// Least and largest area of a cut, as fractions of the root's.
    pub const CUT_AREA: [f32; 2] = [1e-6, 1.0];

    /// Its part of a shared state.
    pub fn shared(&self) -> SharedMerges {
        #[rustfmt::skip]
        let Self {
            speed, window, cut_area, cut_triangles, page, price_of,
            // In the shared state beside this part, as in earlier versions.
            order: _, left: _, cut_kind: _,
            // Derived, or of the moment.
            study: _, choice: _, cut: _, price: _, price_tree: _, followed: _, standing: _, playing: _,
        } = self;
        let (speed, window, cut_area, cut_triangles) = (*speed, *window, *cut_area, *cut_triangles);
        SharedMerges { speed, window, cut_area, cut_triangles, page: *page, price_of: *price_of }
    }

    /// Shows what another window showed.
    pub fn show_shared(&mut self, shared: SharedMerges) {
        let SharedMerges { speed, window, cut_area, cut_triangles, page, price_of } = shared;
        let [least, most] = Self::CUT_AREA;
        self.speed = speed.clamp(Self::SPEEDS[0], Self::SPEEDS[1]);
        (self.window, self.page, self.price_of, self.price_tree) = (window, page, price_of, Weak::new());
        (self.cut_area, self.cut_triangles) = (cut_area.max(least).min(most), cut_triangles.max(1));
    }

    /// Wants the price of a node of `accel`.
    pub fn want_price(&mut self, accel: &Arc<Accel>, node: u32) {
        self.price.resume();
        (self.price_of, self.price_tree) = (Some(node), Arc::downgrade(accel));
    }

    /// Moves the wanted price to the node with the same triangles in `new`, the tree in place of `old`; there may be none.
    pub fn carry_price(&mut self, old: &Arc<Accel>, new: &Arc<Accel>) {
        if is_same(&self.price_tree, old) {
            let survives = |node| NodeIdentity::of(old, node)?.find(new);
            self.price_of = self.price_of.filter(|_| Arc::ptr_eq(&old.scene, &new.scene)).and_then(survives);
        }
        self.price_tree = Arc::downgrade(new);
    }

    /// The merges of this tree, in whatever order they are known.
    pub fn known(&self, accel: &Arc<Accel>) -> Option<Arc<Result<MergeStudy, String>>> {
        self.study.of_tree(accel).cloned()
    }

    /// The present step of `merges`; `None` where none is chosen.
    pub fn step(&self, merges: &Merges) -> Option<u32> {
        self.left.map(|left| merges.timeline.step_with(left))
    }

    /// Chooses a step of `merges`.
    pub fn set_step(&mut self, merges: &Merges, step: u32) {
        self.left = Some(merges.timeline.standing(step));
    }

    /// Chooses a step of `merges` by hand: playing pauses, and the overlay shows the step.
    pub fn go(&mut self, merges: &Merges, step: u32) {
        (self.playing, self.cut_kind) = (None, CutKind::Step);
        self.set_step(merges, step);
    }

    /// Plays from the present step, from the beginning where that is the last, or pauses.
    pub fn toggle_play(&mut self, merges: &Merges) {
        if self.playing.take().is_some() {
            return;
        }
        self.playing = Some(0.0);
        if self.step(merges).is_none_or(|step| step >= merges.timeline.steps()) {
            self.set_step(merges, 0);
        }
    }

    /// Advances by `seconds` of playing. Stops at the end.
    pub fn advance(&mut self, merges: &Merges, seconds: f64) {
        let (Some(rest), Some(step)) = (self.playing, self.step(merges)) else {
            self.playing = None;
            return;
        };
        let due = rest + self.speed * seconds;
        let next = f64::from(step) + due.floor();
        let steps = merges.timeline.steps();
        self.playing = (next < f64::from(steps)).then_some(due.fract());
        self.set_step(merges, next.min(f64::from(steps)) as u32);
    }

    /// Chooses no step: the overlay shows its depths again.
    pub fn clear(&mut self) {
        (self.left, self.playing, self.cut_kind) = (None, None, CutKind::Step);
    }

    /// The cut that is wanted, where it is not one of steps.
    pub fn wanted_cut(&self) -> Option<Cut> {
        match self.cut_kind {
            CutKind::Step => None,
            CutKind::Area => Some(Cut::Area(self.cut_area)),
            CutKind::Triangles => Some(Cut::Primitives(self.cut_triangles)),
        }
    }

    /// Shows a cut by area or by number of triangles, or the step where it is none of these.
    pub fn show_cut(&mut self, cut: Option<Cut>) {
        self.cut_kind = match cut {
            Some(Cut::Area(share)) => {
                let [least, most] = Self::CUT_AREA;
                // A minimum and a maximum that are numbers leave one of NaN too.
                self.cut_area = share.max(least).min(most);
                CutKind::Area
            }
            Some(Cut::Primitives(most)) => {
                self.cut_triangles = most.max(1);
                CutKind::Triangles
            }
            _ => CutKind::Step,
        };
    }

    /// The clusters that cluster colours show: that cut, or the clusters of the present step of the merges of `accel`, where they are
    /// known.
    pub fn cluster_cut(&self, accel: Option<&Arc<Accel>>) -> Option<ClusterCut> {
        if let Some(cut) = self.wanted_cut() {
            return Some(ClusterCut { cut, merges: None });
        }
        let (accel, known) = (accel?, self.known(accel?)?);
        let merges = &known.as_ref().as_ref().ok()?.merges;
        let cut = Cut::Step { order: merges.order(), step: self.step(merges)? };
        let accel = match &merges.history.of {
            TreeOfRecord::Same => Arc::clone(accel),
            TreeOfRecord::Before(before) => Arc::clone(before),
        };
        Some(ClusterCut { cut, merges: Some((accel, Arc::clone(&merges.timeline))) })
    }

    /// The merge that the present step shows, to be explained; `None` while playing.
    pub fn wanted_choice(&self, accel: &Arc<Accel>) -> Option<ChoiceOf> {
        let known = self.known(accel)?;
        let merges = &known.as_ref().as_ref().ok()?.merges;
        let merge = merges.merge_number(self.step(merges)?)?;
        let wanted = self.page == MergePage::Why && self.playing.is_none();
        wanted.then(|| ChoiceOf { history: Arc::clone(&merges.history), merge })
    }

    /// The clusters of `accel` that the overlay draws in place of the chosen depths, at most `count` of them; `None` where it draws those depths.
    pub fn standing(&mut self, accel: &Arc<Accel>, count: usize) -> Option<Arc<Standing>> {
        let wanted = if let Some(cut) = self.wanted_cut() {
            Standing::of_cut(Arc::clone(self.cut.get(accel, &cut)?), count)
        } else {
            let study = self.known(accel)?;
            let merges = &study.as_ref().as_ref().ok()?.merges;
            let step = self.step(merges)?;
            if let Some(last) = self.standing.as_ref().filter(|last| last.is_at(&study, step, count)) {
                return Some(Arc::clone(last));
            }
            Standing::at_step(&study, step, count)?
        };
        let same = self.standing.take().filter(|last| **last == wanted);
        self.standing = Some(same.unwrap_or_else(|| Arc::new(wanted)));
        self.standing.clone()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use crate::lab::merges::History;
    use crate::scene::{LoadOptions, SceneSource, load};
    use bvhscope_engine::cancel::CancelToken;
    use bvhscope_engine::settings::BuildSettings;

    use super::*;

    fn merges() -> Merges {
        let token = CancelToken::new();
        let source = SceneSource::Builtin { name: "teapot".to_owned(), size: Some(1) };
        let scene = Arc::new(load(&source, &LoadOptions::default(), &token).unwrap());
        let accel = Accel::build_binary(&scene, &BuildSettings::default(), &token).unwrap();
        let history = Arc::new(History::new(&accel, &token).unwrap());
        Merges::new(&accel, &history, MergeOrder::Level, &token).unwrap()
    }

    #[test]
    fn playing_shows_as_many_merges_as_time_has_passed() {
        let merges = merges();
        let mut state = PictureCut { speed: 10.0, ..PictureCut::default() };
        state.toggle_play(&merges);
        assert_eq!(state.step(&merges), Some(0));
        for _ in 0..25 {
            state.advance(&merges, 0.05);
        }
        assert_eq!(state.step(&merges), Some(12), "1.25 s at 10 a second, whatever the frames");
        state.advance(&merges, 1e9);
        assert_eq!((state.step(&merges), state.playing), (Some(merges.timeline.steps()), None));
        state.toggle_play(&merges);
        assert_eq!(state.step(&merges), Some(0), "from the end it begins anew");
        state.toggle_play(&merges);
        assert_eq!(state.playing, None);
    }

    #[test]
    fn a_step_beyond_the_end_is_the_end() {
        let merges = merges();
        let mut state = PictureCut::default();
        state.go(&merges, u32::MAX);
        assert_eq!((state.left, state.step(&merges)), (Some(1), Some(merges.timeline.steps())));
        state.left = Some(u32::MAX);
        assert_eq!(state.step(&merges), Some(0));
    }
}
