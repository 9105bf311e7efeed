//! Values chosen by name: parsers and help texts, both derived from the list that each type has of its own values.

use crate::headless::MeasuringRays;
use crate::lab::population::{Population, Populations};
use crate::lab::report_table::TableFormat;
use crate::render::{Background, Light, RayKind};
use crate::scene::Instancing;
use crate::view::NamedView;
use bvhscope_engine::construction::MergeOrder;
use bvhscope_engine::follow::Policy;
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::layouts::{Collapse, Planes};
use bvhscope_engine::settings::BuilderKind;
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::traverse::Traversal;

/// A closed set of values, each with a name on the command line.
pub trait Named: Copy + 'static {
    /// Every value.
    const VALUES: &'static [Self];

    /// The name of a value.
    fn value_name(self) -> &'static str;
}

macro_rules! named {
    ($($type:ty),+ $(,)?) => {$(
        impl Named for $type {
            const VALUES: &'static [Self] = &<$type>::ALL;

            fn value_name(self) -> &'static str {
                self.name()
            }
        }
    )+};
}

named!(
    BuilderKind,
    ContainerKind,
    NamedView,
    Light,
    Background,
    RayKind,
    Traversal,
    SimdLevel,
    MergeOrder,
    Population,
    Policy,
    TableFormat,
    Instancing,
    Collapse,
    Planes,
);

/// Parses the name of any value of `T`.
pub fn named<T: Named>(text: &str) -> Result<T, String> {
    named_among(text, T::VALUES)
}

/// Parses the name of one of `values`.
fn named_among<T: Named>(text: &str, values: &[T]) -> Result<T, String> {
    let found = values.iter().copied().find(|value| value.value_name() == text);
    found.ok_or_else(|| format!("one of {} is expected", names(values).join(", ")))
}

/// A help text with the names of every value of `T` in it: `before`, "a, b or c", `after`.
pub fn help<T: Named>(before: &str, after: &str) -> String {
    format!("{before}{}{after}", any_of(&names(T::VALUES)))
}

fn names<T: Named>(values: &[T]) -> Vec<&'static str> {
    values.iter().map(|value| value.value_name()).collect()
}

/// "a, b or c".
fn any_of(names: &[&str]) -> String {
    match names.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
        _ => names.concat(),
    }
}

/// Builders that make a tree: all but testing every triangle.
fn tree_builders() -> Vec<BuilderKind> {
    BuilderKind::ALL.into_iter().filter(|&kind| kind != BuilderKind::None).collect()
}

/// Parses the name of a builder that makes a tree.
pub fn tree_builder(text: &str) -> Result<BuilderKind, String> {
    named_among(text, &tree_builders())
}

/// A help text with the names of the builders that make a tree.
pub fn tree_builder_help(before: &str, after: &str) -> String {
    format!("{before}{}{after}", any_of(&names(&tree_builders())))
}

/// The containers that a measuring command compares.
#[derive(Debug, Clone)]
pub struct Containers(pub Vec<ContainerKind>);

/// The names for several containers at once: those of the paper, and every one.
const SEVERAL: [(&str, &[ContainerKind]); 2] =
    [("both", &ContainerKind::OF_PAPER), ("all", &ContainerKind::WITH_ORIENTED)];

/// Parses the name of a container, `both` or `all`.
pub fn containers(text: &str) -> Result<Containers, String> {
    if let Some((_, kinds)) = SEVERAL.iter().find(|(name, _)| *name == text) {
        return Ok(Containers(kinds.to_vec()));
    }
    let expected = || format!("one of {} is expected", container_names().join(", "));
    let kind = ContainerKind::WITH_ORIENTED.into_iter().find(|kind| kind.name() == text);
    kind.map(|kind| Containers(vec![kind])).ok_or_else(expected)
}

/// The names that [`containers`] takes.
fn container_names() -> Vec<&'static str> {
    names(&ContainerKind::WITH_ORIENTED).into_iter().chain(SEVERAL.map(|(name, _)| name)).collect()
}

/// A help text with the names that [`containers`] takes.
pub fn containers_help(before: &str, after: &str) -> String {
    format!("{before}{}{after}", any_of(&container_names()))
}

/// Parses a comma-separated list of populations of rays, `none` or `all`, and a file: a name with a point or a slash in it, or `-`.
pub fn rays(text: &str) -> Result<MeasuringRays, String> {
    let mut rays = MeasuringRays::default();
    for name in text.split(',').filter(|_| text != "none") {
        if name == "all" {
            rays.populations = Population::ALL.into_iter().fold(rays.populations, Populations::with);
        } else if !(name == "-" || name.contains(['.', '/', '\\'])) {
            rays.populations = rays.populations.with(named(name)?);
        } else if let Some(first) = rays.file.replace(name.into()) {
            return Err(format!("a list has one file of rays, and these are {} and {name}", first.display()));
        } else {
            rays.populations = rays.populations.with(Population::File);
        }
    }
    Ok(rays)
}

/// A help text with the names that [`rays`] takes.
pub fn rays_help(before: &str) -> String {
    let names = names(Population::VALUES).join(", ");
    format!("{before}a list of {names} or all, and a file of rays, separated by commas [default: none]")
}

/// Policies of a tree that follows a model; all that apply where none is named.
#[derive(Debug, Clone)]
pub struct Policies(pub Vec<Policy>);

/// Parses a comma-separated list of policies, each once, or `all`.
pub fn policies(text: &str) -> Result<Policies, String> {
    let mut list = Vec::new();
    for name in text.split(',').filter(|_| text != "all") {
        let policy = named(name)?;
        if !list.contains(&policy) {
            list.push(policy);
        }
    }
    Ok(Policies(list))
}

/// Parses a SIMD level that this machine supports.
pub fn simd(text: &str) -> Result<SimdLevel, String> {
    let available: Vec<SimdLevel> = SimdLevel::ALL.into_iter().filter(|level| level.is_available()).collect();
    named_among(text, &available)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failure here is a failed test")]

    use clap::CommandFactory as _;

    use super::*;
    use crate::cli::args::Cli;

    /// Checks that the help of `--flag` of `command` names every value of `T`.
    fn assert_help_names<T: Named>(command: &str, flag: &str) {
        let cli = Cli::command();
        let command = cli.find_subcommand(command).unwrap();
        let argument = command.get_arguments().find(|argument| argument.get_long() == Some(flag)).unwrap();
        let help = argument.get_help().unwrap().to_string();
        for name in names(T::VALUES) {
            let is_named = help.split(|c: char| !(c.is_alphanumeric() || c == '-')).any(|word| word == name);
            assert!(is_named, "--{flag} does not name {name}: {help}");
        }
    }

    #[test]
    fn help_texts_name_every_value() {
        assert_help_names::<NamedView>("render", "camera");
        assert_help_names::<Traversal>("bench", "traversal");
        assert_help_names::<RayKind>("ray", "kind");
        assert_help_names::<Traversal>("ray", "traversal");
        assert_help_names::<ContainerKind>("sweep", "container");
        assert_help_names::<Population>("compare", "rays");
        assert_help_names::<Population>("info", "rays");
        assert_help_names::<Policy>("animate", "policy");
    }

    #[test]
    fn an_unknown_name_is_answered_with_all_names() {
        assert_eq!(named::<ContainerKind>("cube").unwrap_err(), "one of box, sphere, dop is expected");
        assert_eq!(containers("cube").unwrap_err(), "one of box, sphere, dop, oriented, both, all is expected");
        assert_eq!(containers("both").unwrap().0, ContainerKind::OF_PAPER);
        assert_eq!(containers("all").unwrap().0, ContainerKind::WITH_ORIENTED);
        assert_eq!(named::<NamedView>("left"), Ok(NamedView::Left));
        let some = Populations::NONE.with(Population::Random).with(Population::Primary);
        let of = |populations, file: Option<&str>| Ok(MeasuringRays { populations, file: file.map(Into::into) });
        assert_eq!(rays("random,primary"), of(some, None));
        assert_eq!((rays("all"), rays("none")), (of(Populations::ALL, None), of(Populations::NONE, None)));
        let file = Populations::NONE.with(Population::File);
        assert_eq!(rays("random,a.rays,primary"), of(some.with(Population::File), Some("a.rays")));
        assert_eq!((rays("-"), rays("./a")), (of(file, Some("-")), of(file, Some("./a"))));
        assert_eq!(rays("a.rays,all"), of(Populations::ALL.with(Population::File), Some("a.rays")));
        assert!(rays("a.rays,b.rays").unwrap_err().contains("one file"));
        let names = "one of primary, shadow, ao, bounce, random is expected";
        assert_eq!(rays("primary,photons").unwrap_err(), names);
        assert_eq!(policies("rebuild,refit,rebuild").unwrap().0, [Policy::Rebuild, Policy::Refit]);
        assert!(policies("all").unwrap().0.is_empty());
        let names =
            "one of keep, refit, rotate, reinsert, partial-rebuild, rebuild, rebuild-behind, whole-clip is expected";
        assert_eq!(policies("refit,reload").unwrap_err(), names);
        assert!(tree_builder("none").is_err() && tree_builder("exact").is_ok());
    }
}
