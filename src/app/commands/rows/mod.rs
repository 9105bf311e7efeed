//! The table of actions: label, tip, keys, condition, switch and effect of each, one file per menu. Each list is in the order of
//! the menu, in groups that lines separate.

mod edit;
mod file;
mod help;
mod lab;
mod picture;
mod tree;
mod view;

pub(in crate::app) use tree::compare_description;
pub(in crate::app) use view::refused_policy;

use super::row::{Category, Row};

/// The rows of a menu in their groups, which lines separate.
pub(super) const fn groups(menu: Category) -> &'static [&'static [Row]] {
    match menu {
        Category::File => file::ROWS,
        Category::Edit => edit::ROWS,
        Category::View => view::ROWS,
        Category::Tree => tree::ROWS,
        Category::Lab => lab::ROWS,
        Category::Help => help::ROWS,
    }
}
