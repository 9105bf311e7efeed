//! The whole state as one line of text: the command line that opens it, which can be pasted over the window too, so that two
//! people see the same thing.
//!
//! `bvhscope --state '1 {"wanted":{"build":{"threshold":12}}}'`: a version, then those values as JSON that differ from the
//! defaults.

use std::collections::BTreeSet;

use glam::DVec3;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::app::state::json::{difference, merge, plain_value};
use crate::app::state::paper::PaperPlan;
use crate::app::state::shared_picture::SharedPicture;
use crate::app::state::views::SharedViews;
use crate::app::state::wanted::Wanted;
use crate::scene::{Instancing, SceneSource};
use crate::text::{quote, unquote};

/// Version of the line. A line of another version is refused.
const VERSION: u32 = 1;
/// The text before the quoted state in a line that was copied.
const COMMAND: &str = "bvhscope --state ";

/// Everything that another person needs to see the same.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SharedState {
    /// Model, tree, camera, picture, containers.
    pub wanted: Wanted,
    /// The form of copies of meshes; where it is automatic, that of the other window.
    #[serde(default)]
    pub copies: Instancing,
    /// The traced picture is shown.
    pub show_geometry: bool,
    /// Containers are drawn.
    pub show_containers: bool,
    /// Name of the open view of the dock.
    pub dock: Option<String>,
    /// Selected and hidden nodes.
    pub nodes: SharedNodes,
    /// Drawing over the picture, and the rays that measure visits.
    pub picture: SharedPicture,
    /// The part of each view of the dock.
    pub views: SharedViews,
    /// Measurements of the view "Paper" and how it shows them.
    pub paper: PaperPlan,
}

/// Selected and hidden nodes, by their indices: a tree is the same wherever it is built.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SharedNodes {
    /// The selected node.
    pub selected: Option<u32>,
    /// The selected triangle.
    pub triangle: Option<u32>,
    /// Hidden nodes.
    pub hidden: BTreeSet<u32>,
    /// The node outside of whose subtree everything is hidden.
    pub isolated: Option<u32>,
    /// The triangles all others of which are hidden, as ranges with both ends.
    pub only: Option<Vec<[u32; 2]>>,
}

impl Default for SharedState {
    fn default() -> Self {
        Self {
            wanted: Wanted::new(SceneSource::default_builtin()),
            copies: Instancing::default(),
            show_geometry: true,
            show_containers: true,
            dock: None,
            nodes: SharedNodes::default(),
            picture: SharedPicture::default(),
            views: SharedViews::default(),
            paper: PaperPlan::default(),
        }
    }
}

impl SharedState {
    /// Whether the line leaves the camera out, which then is the model's default view.
    pub fn has_own_view(&self) -> bool {
        self.wanted.camera == Self::default().wanted.camera
    }

    /// The line that opens this state.
    pub fn line(&self) -> String {
        let mut own = plain_value(self);
        move_points(&mut own, 1.0);
        let difference = difference(&plain_value(&Self::default()), own);
        let difference = difference.unwrap_or_else(|| Value::Object(<_>::default()));
        format!("{COMMAND}{}", quote(&format!("{VERSION} {difference}")))
    }

    /// The state of a line, or of the argument of `--state` in it; `Err` is the reason why it cannot be used. Numbers beyond their
    /// limits are clamped.
    pub fn parse(text: &str) -> Result<Self, String> {
        let text = text.trim();
        let text = text.strip_prefix(COMMAND.trim_end()).map_or_else(|| text.to_owned(), |word| unquote(word.trim()));
        let (version, json) = text
            .split_once(' ')
            .and_then(|(version, json)| Some((version.parse::<u32>().ok()?, json)))
            .ok_or("this is no state of bvhscope; Ctrl+L copies one, which begins with: bvhscope --state")?;
        if version != VERSION {
            return Err(format!("this state is of version {version}, and this program reads version {VERSION}"));
        }
        let broken = |error: serde_json::Error| format!("this state is damaged: {error}");
        let mut value = serde_json::to_value(Self::default()).map_err(broken)?;
        let mut changes = serde_json::from_str(json).map_err(broken)?;
        move_earlier_places(&mut changes);
        merge(&mut value, changes);
        move_points(&mut value, -1.0);
        let state: Self = serde_json::from_value(value).map_err(broken)?;
        let mut paper = state.paper;
        paper.limit();
        Ok(Self { wanted: state.wanted.within_limits(), paper, ..state })
    }
}

/// Members of states by earlier versions, and their places now.
const EARLIER_PLACES: [(&[&str], &[&str]); 7] = [
    (&["nodes", "topmost"], &["views", "Icicle", "topmost"]),
    (&["nodes", "unfolded"], &["views", "Nodes", "unfolded"]),
    (&["lab", "icicle"], &["views", "Icicle"]),
    (&["lab", "nodes"], &["views", "Nodes", "order"]),
    (&["lab", "plots"], &["views", "Plots"]),
    (&["lab", "motion"], &["views", "Motion"]),
    (&["lab"], &["picture"]),
];

/// Points of a state that the line has in the coordinates of the file.
const POINTS: [&str; 5] = [
    "/wanted/camera/eye",
    "/wanted/camera/target",
    "/picture/ray/start/pixel/camera/eye",
    "/picture/ray/start/pixel/camera/target",
    "/picture/ray/start/ray/origin",
];

/// Moves the points and the section plane of a state as JSON by `times` its offset, in double precision.
fn move_points(state: &mut Value, times: f64) {
    let vector = |value: Option<&Value>| value.and_then(|value| serde_json::from_value::<DVec3>(value.clone()).ok());
    let Some(offset) = vector(state.pointer("/wanted/offset")).filter(|offset| offset.is_finite()) else { return };
    let shift = offset * times;
    if shift == DVec3::ZERO {
        return;
    }
    for path in POINTS {
        if let Some(place) = state.pointer_mut(path)
            && let Some(point) = vector(Some(place))
        {
            *place = (point + shift).to_array().to_vec().into();
        }
    }
    let normal = vector(state.pointer("/wanted/render/section/normal"));
    if let (Some(normal), Some(along)) = (normal, state.pointer_mut("/wanted/render/section/offset")) {
        *along = (along.as_f64().unwrap_or_default() + normal.dot(shift)).into();
    }
}

/// Moves members of `changes` that an earlier version had elsewhere to their present places.
fn move_earlier_places(changes: &mut Value) {
    for (from, to) in EARLIER_PLACES {
        let Some((name, parents)) = from.split_last() else { continue };
        let parent = parents.iter().try_fold(&mut *changes, |value, name| value.get_mut(name));
        let Some(member) = parent.and_then(|parent| parent.as_object_mut()?.remove(*name)) else { continue };
        let mut place = &mut *changes;
        for name in to {
            if !place.is_object() {
                *place = Value::Object(<_>::default());
            }
            place = &mut place[name];
        }
        match (place, member) {
            (Value::Object(place), Value::Object(member)) => place.extend(member),
            (place, member) => *place = member,
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::app::state::model::Model;
    use crate::lab::ray::RayMethod;
    use crate::overlay::OverlaySettings;
    use crate::render::RayKind;
    use crate::render::Shading;
    use bvhscope_engine::tree::ContainerKind;

    #[test]
    fn a_line_gives_the_state_back() {
        let mut state = SharedState::default();
        assert_eq!(state.line(), "bvhscope --state '1 {}'");
        state.wanted.source = SceneSource::File("/models/Bob's bunny.obj".into());
        state.wanted.build.threshold = 17;
        state.wanted.camera.eye = glam::Vec3::new(0.1, -2.5, 1e-7);
        state.wanted.render.shading = Shading::ALL.into_iter().last().unwrap();
        state.wanted.overlay.depth = Some([3, 9]);
        state.copies = Instancing::TwoLevel;
        state.wanted.unfolded = [4, 5, 9].into_iter().collect();
        let only = Some(vec![[0, 3], [7, 7]]);
        state.nodes = SharedNodes { selected: Some(12), hidden: [4, 9].into(), only, ..SharedNodes::default() };
        state.dock = Some("Nodes".to_owned());
        state.picture.clusters_left = Some(40);
        let line = state.line();
        assert_eq!(SharedState::parse(&line).unwrap(), state, "{line}");
        let word = unquote(line.strip_prefix(COMMAND).unwrap());
        assert_eq!(SharedState::parse(&word).unwrap(), state, "as the shell hands it over: {word}");
    }

    #[test]
    fn lines_of_earlier_versions_are_read() {
        let overlay = SharedState::parse(r#"1 {"wanted":{"overlay":{"follows_tree":false,"show_spheres":true}}}"#);
        let expected = OverlaySettings::default().with_kinds(ContainerKind::OF_PAPER.into_iter().collect());
        assert_eq!(overlay.unwrap().wanted.overlay, expected);
        let line = r#"1 {"dock":"Ray","lab":{"icicle":{"width":"Visits"},"nodes":{"ascending":true},"merge_order":"level","ray":{"start":{"ray":{"origin":[0,0,0],"direction":[0,0,1]}},"kind":"shadow","method":"wide","step":3}},"nodes":{"selected":4,"topmost":2,"unfolded":[0,2]}}"#;
        let state = SharedState::parse(line).unwrap();
        assert_eq!((state.dock.as_deref(), state.nodes.selected), (Some("Ray"), Some(4)));
        let views = serde_json::to_string(&state.views).unwrap();
        assert_eq!(
            views,
            r#"{"Icicle":{"topmost":2,"width":"Visits"},"Nodes":{"order":{"ascending":true},"unfolded":[0,2]}}"#
        );
        let mut model = Model::default();
        model.show_shared_picture(state.picture);
        assert_eq!((model.ray.kind, model.ray.method, model.ray.cursor), (RayKind::Shadow, RayMethod::Wide, 3));
    }

    #[test]
    fn what_cannot_be_used_is_refused_with_the_reason() {
        for (text, reason) in [
            ("", "no state of bvhscope"),
            ("hello world", "no state of bvhscope"),
            ("bvhscope --state '2 {}'", "version 2"),
            ("bvhscope --state '1 {\"wanted\":'", "damaged"),
            ("1 {\"wanted\":{\"build\":{\"threshold\":\"many\"}}}", "damaged"),
        ] {
            let error = SharedState::parse(text).unwrap_err();
            assert!(error.contains(reason), "{text}: {error}");
        }
        let clamped = SharedState::parse("1 {\"wanted\":{\"build\":{\"threshold\":4000000}}}").unwrap();
        assert_eq!(clamped.wanted.build.threshold, bvhscope_engine::settings::BuildSettings::MAX_THRESHOLD);
    }

    /// Of a model far from the origin the line has the coordinates of the file, whatever they are in memory.
    #[test]
    fn points_and_planes_of_a_line_are_those_of_the_file() {
        let mut state = SharedState::default();
        state.wanted.offset = DVec3::new(408_204.0, 4_080_928.0, -0.5);
        state.wanted.camera.eye = glam::Vec3::new(-2.42, 0.1, 1.5);
        state.wanted.render.section =
            Some(crate::section::SectionPlane { normal: glam::Vec3::X, offset: 0.25, flipped: true });
        let line = state.line();
        for part in ["408201.58,4080928.1,1.0", "408204.25"] {
            assert!(line.contains(part), "{part}: {line}");
        }
        assert_eq!(SharedState::parse(&line), Ok(state));
        // Written by hand, without the offset, as precise as single precision is.
        let by_hand = SharedState::parse(r#"1 {"wanted":{"camera":{"eye":[408201.58,4080928.1,1.0]}}}"#).unwrap();
        assert_eq!((by_hand.wanted.offset, by_hand.wanted.camera.eye.x), (DVec3::ZERO, 408_201.6));
    }
}
