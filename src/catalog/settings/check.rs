//! Checks of rows, for the tests of each table.

use std::collections::BTreeSet;

use super::setting::{Limits, Number, Setting, Settings, Value, limit};

/// Checks that each value is read as it is written, that help texts name every value, and that numbers outside their range are refused
/// and limited.
#[expect(clippy::unwrap_used, reason = "a test fails by panicking")]
pub(crate) fn check_rows<T: Settings>() {
    for row in T::rows() {
        let key = row.key;
        for text in row.examples() {
            let mut settings = T::default();
            row.parse(&mut settings, &text).unwrap();
            assert_eq!(row.text(&settings), text, "{key}");
        }
        if let Value::One { options, .. } | Value::Any { options, .. } = &row.value {
            let help = row.flag_help();
            for choice in options().into_iter().filter(|choice| choice.is_flag) {
                let mut words = help.split(|c: char| !(c.is_alphanumeric() || c == '-'));
                assert!(words.any(|word| word == choice.name), "{help} lacks {}", choice.name);
            }
        }
        let mut settings = T::default();
        let high = match &row.value {
            Value::Number(Number { limits: Limits { range: [_, high], .. }, set, .. }) => {
                set(&mut settings, high + 1.0);
                high
            }
            Value::Optional { limits: Limits { range: [_, high], .. }, set, .. } => {
                set(&mut settings, Some(high + 1.0));
                high
            }
            _ => continue,
        };
        let above = (high + 1.0).to_string();
        assert!(row.parse(&mut T::default(), &above).unwrap_err().contains(&high.to_string()), "{key}");
        limit(&mut settings);
        assert_eq!(row.text(&settings), high.to_string(), "{key}");
    }
}

/// Calls `check` with each row and `base` with each value of that row but its present one. At most one row, that of the processor's
/// instructions, may have no other value.
#[expect(clippy::unwrap_used, reason = "a test fails by panicking")]
pub(crate) fn each_other_value<T: Settings>(base: &T, mut check: impl FnMut(&'static Setting<T>, &T)) {
    let mut checked = BTreeSet::new();
    for &row in T::rows() {
        for text in row.examples().into_iter().filter(|text| *text != row.text(base)) {
            let mut settings = base.clone();
            row.parse(&mut settings, &text).unwrap();
            check(row, &settings);
            checked.insert(row.key);
        }
    }
    assert!(checked.len() + 1 >= T::rows().len(), "{checked:?}");
}
