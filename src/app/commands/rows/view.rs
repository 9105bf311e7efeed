//! Actions of the menu "View".

use bvhscope_engine::follow::Policy;
use bvhscope_engine::settings::{BuildSettings, Preset};
use egui::Key;

use super::picture;
use crate::accel::Follow;
use crate::app::commands::camera;
use crate::app::commands::row::{CTRL, Item, NONE, Row, SHIFT, current, flip, is_presented, item, many, one};
use crate::app::state::action::{Action, OrbitStep, ViewDirection};
use crate::app::state::{AppState, Clock, Navigation, Side, Theme, preferences};
use crate::app::viewport::ZOOM_STEP;
use crate::camera::Projection;
use crate::view::NamedView;

pub(in crate::app::commands) static ROWS: &[&[Row]] = &[
    CAMERA,
    TIME,
    picture::ROWS,
    &[
        one(Action::ToggleLeftPanel, "Left panel", "Show scene and statistics", &[(NONE, Key::F3)], |state, _| {
            state.toggle_panel(Side::Left);
        })
        .switch(|state, _| Some(state.shows_panel(Side::Left))),
        one(Action::ToggleRightPanel, "Right panel", "Show the settings", &[(NONE, Key::F4)], |state, _| {
            state.toggle_panel(Side::Right);
        })
        .switch(|state, _| Some(state.shows_panel(Side::Right))),
        many(themes, |state, index| state.preferences.theme = THEMES[index].0)
            .switch(|state, index| Some(state.preferences.theme == THEMES[index].0))
            .within("Theme"),
    ],
];

const CAMERA: &[Row] = &[
    many(directions, |state, index| camera::view_from(state, ViewDirection::ALL[index])).within("View from"),
    one(
        Action::ToggleOrthographic,
        "Orthographic",
        "Parallel rays instead of perspective",
        &[(NONE, Key::Num5)],
        |state, _| {
            let projection = &mut state.wanted.camera.projection;
            *projection = match projection {
                Projection::Perspective => Projection::Orthographic,
                Projection::Orthographic => Projection::Perspective,
            };
        },
    )
    .switch(|state, _| Some(state.wanted.camera.projection == Projection::Orthographic)),
    one(Action::ToggleUpAxis, "Switch up axis", "Let y or z point up", &[(NONE, Key::U)], |state, _| {
        camera::toggle_up(state);
    }),
    one(
        Action::ToggleFly,
        "Fly mode",
        "Move with W, A, S, D, Q and E instead of orbiting; Shift is faster",
        &[(NONE, Key::V)],
        |state, _| {
            let navigation = &mut state.preferences.navigation;
            *navigation = match navigation {
                Navigation::Orbit => Navigation::Fly,
                Navigation::Fly => Navigation::Orbit,
            };
        },
    )
    .switch(|state, _| Some(state.preferences.navigation == Navigation::Fly)),
    one(
        Action::ResetView,
        "Reset view",
        "Go back to the default view: inside a model that encloses its centre, as a room does, otherwise outside",
        &[(NONE, Key::R)],
        |state, _| camera::reset(state, NamedView::Default),
    )
    .when(is_presented),
    one(
        Action::ViewOutside,
        "View from outside",
        "Look at the whole model from outside, also at a room",
        &[(SHIFT, Key::R)],
        |state, _| camera::reset(state, NamedView::Outside),
    ),
    one(
        Action::FrameSelection,
        "Frame selection",
        "Fill the view with the selected node, or with the whole model",
        &[(NONE, Key::F)],
        |state, _| camera::frame_selection(state),
    )
    .when(is_presented),
    current(cameras_of_file, camera::go_to_camera_of_file).within("Cameras of the file"),
    one(
        Action::CameraBack,
        "Previous view",
        "Go back to the camera before the last move",
        &[(NONE, Key::Backspace)],
        |state, _| {
            state.undo.cameras.back(&mut state.wanted.camera);
        },
    )
    .when(|state, _| state.undo.cameras.can_go_back(&state.wanted.camera))
    .repeated()
    .yielding(),
    one(
        Action::CameraForward,
        "Next view",
        "Go forward to the camera that was left by going back",
        &[(SHIFT, Key::Backspace)],
        |state, _| state.undo.cameras.forward(&mut state.wanted.camera),
    )
    .when(|state, _| state.undo.cameras.can_go_forward(&state.wanted.camera))
    .repeated()
    .yielding(),
    one(Action::AddBookmark, "Add bookmark", "Keep this camera, to come back to it", &[(CTRL, Key::D)], |state, _| {
        camera::add_bookmark(state);
    }),
    one(
        Action::NextBookmark,
        "Next bookmark",
        "Go to the next camera that was kept for this model",
        &[(NONE, Key::J)],
        |state, _| {
            let (source, here) = (&state.wanted.source, &state.wanted.camera);
            if let Some(index) = preferences::next_bookmark(&state.preferences.bookmarks, source, here) {
                camera::go_to_bookmark(state, index);
            }
        },
    )
    .when(|state, _| preferences::own_bookmarks(&state.preferences.bookmarks, &state.wanted.source).next().is_some())
    .within("Bookmarks"),
    one(Action::RemoveBookmark, "Remove bookmark", "Forget the bookmark that the camera is at", &[], |state, _| {
        camera::remove_bookmark(state);
    })
    .when(|state, _| camera::bookmark_here(state).is_some())
    .within("Bookmarks"),
    current(kept_cameras, camera::go_to_bookmark)
        .switch(|state, index| Some(camera::bookmark_here(state) == Some(index)))
        .within("Bookmarks"),
    many(orbit_steps, |state, index| camera::orbit_step(state, OrbitStep::ALL[index]))
        .repeated()
        .in_viewport()
        .within("Orbit and zoom"),
    one(
        Action::ZoomIn,
        "Zoom in",
        "Move closer to the point under the pointer",
        &[(NONE, Key::Plus), (NONE, Key::Equals)],
        |state, _| camera::zoom(state, ZOOM_STEP),
    )
    .repeated()
    .within("Orbit and zoom"),
    one(
        Action::ZoomOut,
        "Zoom out",
        "Move away from the point under the pointer",
        &[(NONE, Key::Minus)],
        |state, _| camera::zoom(state, 1.0 / ZOOM_STEP),
    )
    .repeated()
    .within("Orbit and zoom"),
];

const TIME: &[Row] = &[
    one(
        Action::PlayClip,
        "Play clip",
        "Play the clip of a model that moves, or pause; each frame gets a tree of its own",
        &[(NONE, Key::Space)],
        |state, _| {
            if let Some(mut clock) = state.clock() {
                clock.toggle_play();
            }
        },
    )
    .when(moves)
    .switch(|state, _| Some(state.model.playback.playing))
    .yielding()
    .within("Time"),
    one(
        Action::StepFrame(true),
        "Next frame",
        "Go to the next frame of the clip",
        &[(SHIFT, Key::ArrowRight)],
        |state, _| change_time(state, |clock| clock.step(true)),
    )
    .when(moves)
    .repeated()
    .yielding()
    .within("Time"),
    one(
        Action::StepFrame(false),
        "Previous frame",
        "Go to the previous frame of the clip",
        &[(SHIFT, Key::ArrowLeft)],
        |state, _| change_time(state, |clock| clock.step(false)),
    )
    .when(moves)
    .repeated()
    .yielding()
    .within("Time"),
    one(Action::LoopClip, "Loop clip", "Begin again after the end of the clip", &[(NONE, Key::L)], |state, _| {
        flip(&mut state.model.playback.looped);
    })
    .when(moves)
    .switch(|state, _| Some(state.model.playback.looped))
    .within("Time"),
    one(
        Action::FilePose,
        "Pose of the file",
        "Show a model that moves as its nodes and skins are in the file, without a clip",
        &[],
        |state, _| change_time(state, |clock| clock.choose_clip(None)),
    )
    .when(moves)
    .switch(|state, _| Some(state.wanted.moment.is_none()))
    .within("Time"),
    many(policies, |state, index| {
        let side = state.edited_side();
        *state.wanted.policy_mut(side) = Policy::ALL[index];
    })
    .when(|state, index| moves(state, index) && refused_policy(state, Policy::ALL[index]).is_none())
    .switch(|state, index| {
        Some(state.wanted.follow_at(state.edited_side(), state.wanted.moment).policy == Policy::ALL[index])
    })
    .within("Policy"),
];

/// Themes of the window, each with its name and tip.
const THEMES: [(Theme, &str, &str); 3] = [
    (Theme::Dark, "dark", "Light text on dark grey"),
    (Theme::Light, "light", "Dark text on light grey"),
    (Theme::System, "system", "Follow the desktop"),
];

fn themes() -> Vec<Item> {
    THEMES.map(|(theme, name, tip)| item(Action::Theme(theme), format!("Theme: {name}"), tip)).into()
}

fn directions() -> Vec<Item> {
    let direction = |direction| {
        let (name, key) = match direction {
            ViewDirection::Front => ("Front", (NONE, Key::Num1)),
            ViewDirection::Back => ("Back", (CTRL, Key::Num1)),
            ViewDirection::Right => ("Right", (NONE, Key::Num3)),
            ViewDirection::Left => ("Left", (CTRL, Key::Num3)),
            ViewDirection::Top => ("Top", (NONE, Key::Num7)),
            ViewDirection::Bottom => ("Bottom", (CTRL, Key::Num7)),
        };
        let tip = format!("Look at the model from the {}", name.to_lowercase());
        Item { key: Some(key), ..item(Action::View(direction), format!("{name} view"), tip) }
    };
    ViewDirection::ALL.map(direction).into()
}

fn orbit_steps() -> Vec<Item> {
    let step = |step| {
        let (name, key) = match step {
            OrbitStep::Left => ("left", Key::ArrowLeft),
            OrbitStep::Right => ("right", Key::ArrowRight),
            OrbitStep::Up => ("up", Key::ArrowUp),
            OrbitStep::Down => ("down", Key::ArrowDown),
        };
        let tip = "Orbit by 5 degrees; the key works while the picture has the focus";
        Item { key: Some((NONE, key)), ..item(Action::Orbit(step), format!("Orbit {name}"), tip) }
    };
    OrbitStep::ALL.map(step).into()
}

fn cameras_of_file(state: &AppState) -> Vec<Item> {
    let scene = state.model.presented.as_ref().map(|shown| &shown.accel.scene);
    let cameras = scene.into_iter().flat_map(|scene| scene.cameras.iter().enumerate());
    cameras
        .map(|(index, camera)| {
            let label = if camera.name.is_empty() { format!("Camera {index}") } else { camera.name.clone() };
            item(Action::GoToCameraOfFile(index), label, format!("Look through camera {index} of the model's file"))
        })
        .collect()
}

fn kept_cameras(state: &AppState) -> Vec<Item> {
    let source = state.wanted.source.absolute();
    let kept = state.preferences.bookmarks.iter().enumerate();
    kept.map(|(index, known)| {
        let model = if known.source == source { String::new() } else { format!(" of {}", known.source.label()) };
        let label = format!("Go to {}{model}", known.name);
        item(Action::GoToBookmark(index), label, format!("A camera kept for {}", known.source))
    })
    .collect()
}

fn policies() -> Vec<Item> {
    Policy::ALL
        .map(|policy| item(Action::Policy(policy), format!("Policy: {}", policy.label()), policy.meaning()))
        .into()
}

/// Why no tree of the edited one's containers can follow the model by a policy.
pub(in crate::app) fn refused_policy(state: &AppState, policy: Policy) -> Option<String> {
    let settings = BuildSettings::preset(Preset::Fast, state.edited_build().container);
    Follow::refusal(policy, &settings, state.model.loaded.as_ref()?)
}

/// Changes the time of a model that moves.
fn change_time(state: &mut AppState, change: impl FnOnce(&mut Clock<'_>)) {
    if let Some(mut clock) = state.clock() {
        change(&mut clock);
    }
}

fn moves(state: &AppState, _: usize) -> bool {
    state.motion().is_some()
}
