//! The results of a check as a table.

use super::finding::{Compared, Finding, RayCheck};
use super::judge::Agreement;
use crate::lab::report_table::ReportTable;
use crate::text::{count, number};

/// The table of a check, with the worst rays below.
pub fn check_table(title: String, check: &RayCheck) -> ReportTable {
    let heads = Agreement::ALL.map(Agreement::head).map(|[name, unit]| (name.to_owned(), unit.to_owned()));
    let first = ("tree".to_owned(), String::new());
    let rows = check.compared.iter().map(|compared| {
        let cells = compared.rays.iter().map(|&rays| if rays == 0 { "·".to_owned() } else { count(rays) });
        std::iter::once(compared.name.clone()).chain(cells).collect()
    });
    let faults: u64 = check.compared.iter().map(Compared::faults).sum();
    let mut notes = vec![if faults == 0 {
        "Every result is that of the scan, or within the rounding of single precision of it.".to_owned()
    } else {
        format!("Rounding explains all but the last four columns; the worst {}:", check.worst.len())
    }];
    notes.extend(check.worst.iter().map(line));
    let columns = std::iter::once(first).chain(heads).collect();
    ReportTable { title, columns, rows: rows.collect(), notes, ..ReportTable::default() }
}

/// A finding in a line.
fn line(finding: &Finding) -> String {
    let Finding { ray, name, method, exact, found, blamed, .. } = finding;
    let pixel = ray.pixel.map_or_else(String::new, |[x, y]| format!(", pixel {x},{y}"));
    let exact = exact
        .map_or_else(|| "nothing".to_owned(), |exact| format!("triangle {} at {}", exact.triangle, number(exact.t)));
    let found = match found {
        None => "a miss".to_owned(),
        Some((triangle, t)) => {
            let triangle = triangle.map_or_else(|| "a hit".to_owned(), |triangle| format!("triangle {triangle}"));
            triangle + &t.map_or_else(String::new, |t| format!(" at {}", number(f64::from(t))))
        }
    };
    let blamed = blamed.map_or_else(String::new, |blamed| {
        format!("; the ray hits it, and does not enter node {} above it, at depth {}", blamed.node, blamed.depth)
    });
    format!("  ray {}{pixel}, {name}, {method}: {found} for {exact}{blamed}", ray.index)
}
