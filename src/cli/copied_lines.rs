//! Command lines that the window copies are read back as they were meant.

#[cfg(all(test, feature = "gui"))]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failure here is a failed test")]

    use std::sync::Arc;

    use clap::Parser as _;

    use super::super::args::{Cli, CommandArgs};
    use super::super::resolve;
    use crate::accel::Follow;
    use crate::app::commands::command_line;
    use crate::app::state::{AppState, CompareView, Preferences, SecondTree, SharedState, Wanted};
    use crate::catalog::settings::{SETTINGS, Setting, Settings, Value, each_other_value};
    use crate::headless::diff::DiffTree;
    use crate::headless::{MomentChoice, RenderCommand, Times};
    use crate::overlay::OverlaySettings;
    use crate::render::RenderSettings;
    use crate::render::rows::SIMD;
    use crate::scene::{LoadOptions, Moment, SceneSource, load};
    use bvhscope_engine::cancel::CancelToken;
    use bvhscope_engine::follow::Policy;
    use bvhscope_engine::settings::{BuildSettings, Pass, Passes, Preset};
    use bvhscope_engine::tree::ContainerKind;

    /// The `render` command that the window copies.
    fn copied(state: &AppState) -> RenderCommand {
        let line = command_line(state);
        let cli = Cli::try_parse_from(shell_words(&line)).unwrap_or_else(|error| panic!("{line}\n{error}"));
        let Some(CommandArgs::Render(args)) = cli.command else { panic!("{line} does not render") };
        resolve::render(args).unwrap()
    }

    /// A build that uses every setting.
    fn finest() -> BuildSettings {
        BuildSettings::preset(Preset::Finest, ContainerKind::Aabb)
    }

    #[test]
    fn every_setting_is_copied() {
        let mut state = AppState::new(Wanted::new(SceneSource::default_builtin()), Preferences::default());
        each_other_value(&finest(), |row, build| {
            state.wanted.build = *build;
            assert_eq!(row.text(&copied(&state).build), row.text(build), "{row:?}");
        });
        each_other_value(&RenderSettings::default(), |row, render| {
            state.wanted.render = *render;
            assert_eq!(row.text(&copied(&state).settings), row.text(render), "{row:?}");
        });
        each_other_value(&OverlaySettings::default(), |row, overlay| {
            state.wanted.overlay = *overlay;
            assert_eq!(row.text(&copied(&state).overlay.unwrap()), row.text(overlay), "{row:?}");
        });
    }

    /// The settings that the window begins with after `bvhscope` with the flag of a setting.
    fn started<T: Settings>(row: &Setting<T>, settings: &T) -> Wanted {
        let value = (!matches!(row.value, Value::Switch { .. })).then(|| row.text(settings));
        let words = ["bvhscope".to_owned(), format!("--{}", row.key)].into_iter().chain(value);
        let cli = Cli::try_parse_from(words).unwrap();
        let mut wanted = Wanted::new(SceneSource::default_builtin());
        resolve::viewer(cli.viewer).overrides.apply(&mut wanted, &mut Preferences::default());
        wanted
    }

    #[test]
    fn every_flag_reaches_the_window() {
        each_other_value(&BuildSettings::default(), |row, build| {
            assert_eq!(row.text(&started(row, build).build), row.text(build), "{row:?}");
        });
        each_other_value(&RenderSettings::default(), |row, render| {
            assert_eq!(row.text(&started(row, render).render), row.text(render), "{row:?}");
        });
        each_other_value(&OverlaySettings::default(), |row, overlay| {
            assert_eq!(row.text(&started(row, overlay).overlay), row.text(overlay), "{row:?}");
        });
    }

    #[test]
    fn every_setting_is_shared() {
        let shared = |wanted: Wanted| {
            let line = SharedState { wanted, ..SharedState::default() }.line();
            SharedState::parse(&line).unwrap_or_else(|error| panic!("{line}: {error}")).wanted
        };
        let wanted = Wanted::new(SceneSource::default_builtin());
        each_other_value(&finest(), |row, build| {
            let again = shared(Wanted { build: *build, ..wanted.clone() });
            assert_eq!(row.text(&again.build), row.text(build), "{row:?}");
        });
        each_other_value(&RenderSettings::default(), |row, render| {
            let again = shared(Wanted { render: *render, ..wanted.clone() });
            // The instructions are the processor's own.
            assert!(row == &SIMD || row.text(&again.render) == row.text(render), "{row:?}");
        });
        each_other_value(&OverlaySettings::default(), |row, overlay| {
            let again = shared(Wanted { overlay: *overlay, ..wanted.clone() });
            assert_eq!(row.text(&again.overlay), row.text(overlay), "{row:?}");
        });
    }

    #[test]
    fn two_trees_in_view_are_copied_as_a_comparison() {
        let mut wanted = Wanted::new(SceneSource::default_builtin());
        let mut b = BuildSettings {
            container: ContainerKind::Sphere,
            optimize: Passes::NONE.with(Pass::Collapse),
            ..wanted.build
        };
        for row in SETTINGS {
            if let Value::Number(number) = &row.value
                && (row.applies)(&b)
            {
                (number.set)(&mut b, number.limits.range[1]);
            }
        }
        let mut state = AppState::new(wanted.clone(), Preferences::default());
        state.layout.viewport_px = [640, 360];
        for view in CompareView::ALL {
            wanted.second = Some(SecondTree { view, ..SecondTree::new(b) });
            state.wanted = wanted.clone();
            let line = command_line(&state);
            let words = shell_words(&line);
            let cli = Cli::try_parse_from(&words).unwrap_or_else(|error| panic!("{line}\n{error}"));
            match (view, cli.command) {
                (CompareView::Split | CompareView::Difference, Some(CommandArgs::Diff(args))) => {
                    let job = resolve::diff(args);
                    let trees = [wanted.build, b].map(DiffTree::Built);
                    assert_eq!((job.trees, job.trace.size), (trees, [640, 360]), "{line}");
                    assert_eq!(job.camera.eye, Some(crate::scene::to_file(wanted.camera.eye, wanted.offset)));
                }
                (CompareView::A, Some(CommandArgs::Render(args))) => {
                    assert_eq!(args.build.settings.0.settings(), wanted.build);
                }
                (CompareView::B, Some(CommandArgs::Render(args))) => assert_eq!(args.build.settings.0.settings(), b),
                (view, other) => panic!("{view:?}: {line} is {other:?}"),
            }
        }
    }

    #[test]
    fn the_moment_is_copied_by_both_commands() {
        let source = SceneSource::Builtin { name: "walker".to_owned(), size: Some(600) };
        let scene = load(&source, &LoadOptions::default(), &CancelToken::new()).unwrap();
        let mut state = AppState::new(Wanted::new(source), Preferences::default());
        state.layout.viewport_px = [64, 36];
        state.model.loaded = Some(Arc::new(scene));
        let clip = state.motion().unwrap().clips.len() - 1;
        let moment = MomentChoice {
            times: Some(Times::At(0.25)),
            clip: (clip > 0).then(|| state.motion().unwrap().clips[clip].name.clone()),
        };
        state.wanted.moment = Some(Moment { clip, seconds: 0.25 });
        let parsed = |state: &AppState| {
            let line = command_line(state);
            let command = line.split(" # ").next().unwrap();
            Cli::try_parse_from(shell_words(command)).unwrap().command
        };
        let Some(CommandArgs::Render(args)) = parsed(&state) else { panic!("one tree is rendered") };
        let job = resolve::render(args).unwrap();
        assert_eq!((job.moments, job.follow), (moment.clone(), Follow::default()));
        state.wanted.follow = Follow { policy: Policy::Rotate, frames: 50 };
        let Some(CommandArgs::Render(args)) = parsed(&state) else { panic!("one tree is rendered") };
        assert_eq!(resolve::render(args).unwrap().follow, state.wanted.follow);
        state.wanted.second = Some(SecondTree::new(state.wanted.build));
        let Some(CommandArgs::Diff(args)) = parsed(&state) else { panic!("two trees are compared") };
        assert_eq!(resolve::diff(args).moments, moment);
        let line = command_line(&state);
        assert!(line.ends_with(" # without the policy of A"), "{line}");
    }

    /// The words of a command line as a shell splits them, with single quotes only.
    fn shell_words(line: &str) -> Vec<String> {
        let mut words = vec![String::new()];
        for (index, part) in line.split('\'').enumerate() {
            if index % 2 == 1 {
                words.last_mut().unwrap().push_str(part);
                continue;
            }
            for (index, piece) in part.split(' ').enumerate() {
                if index > 0 {
                    words.push(String::new());
                }
                words.last_mut().unwrap().push_str(piece);
            }
        }
        words.retain(|word| !word.is_empty());
        words
    }
}
