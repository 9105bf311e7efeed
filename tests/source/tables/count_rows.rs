//! Tables and numbers of sentences that come from `docs/counts.jsonl`, rows of counts with the labels of their line and column.
//!
//! A table's marker is `counts STUDY | HEAD | TITLE=FIELD:DIGITS, …`: the study, the head of its first column, and what its cells show. A
//! sentence is followed, within its paragraph, by `<!-- from STUDY: TEXT = LINE / COLUMN / FIELD; … -->`, or `TEXT % = LINE over LINE /
//! COLUMN / FIELD` for a difference in percent: each text must be what its rows give, and stand in the paragraph.

use serde_json::Value;

/// Begin of the source of a paragraph's numbers.
const FROM: &str = "<!-- from ";

/// The rows of all studies.
pub struct Counts(Vec<Value>);

impl Counts {
    /// Reads one JSON object a line.
    pub fn parse(text: &str) -> Result<Self, String> {
        let rows = text.lines().map(|line| serde_json::from_str(line).map_err(|error| format!("{line}: {error}")));
        Ok(Self(rows.collect::<Result<_, _>>()?))
    }

    fn number(&self, study: &str, [line, column, field]: [&str; 3]) -> Result<f64, String> {
        let is_it = |row: &&Value| row["study"] == study && row["line"] == line && row["column"] == column;
        let row = self.0.iter().find(is_it).ok_or_else(|| format!("no row '{line}' / '{column}' of '{study}'"))?;
        row[field].as_f64().ok_or_else(|| format!("no {field} of '{line}' / '{column}' of '{study}'"))
    }

    /// The table of a marker behind "counts ".
    pub fn table(&self, marker: &str) -> Result<String, String> {
        let parts: Vec<&str> = marker.split(" | ").collect();
        let [study, head, cells] =
            <[&str; 3]>::try_from(parts).map_err(|_| format!("'{marker}' has not three parts"))?;
        let cells: Vec<(&str, &str, usize)> = cells.split(", ").map(cell_of).collect::<Result<_, _>>()?;
        let labels = |name: &str| {
            let mut labels: Vec<&str> = Vec::new();
            for label in self.0.iter().filter(|row| row["study"] == study).filter_map(|row| row[name].as_str()) {
                if !labels.contains(&label) {
                    labels.push(label);
                }
            }
            labels
        };
        let (lines, columns) = (labels("line"), labels("column"));
        if lines.is_empty() {
            return Err(format!("there are no rows of '{study}'"));
        }
        let mut header = vec![head.to_owned()];
        for column in &columns {
            header.extend(cells.iter().map(|(title, ..)| match (*title, columns.len()) {
                ("", _) => (*column).to_owned(),
                (title, 1) => title.to_owned(),
                (title, _) => format!("{column}, {title}"),
            }));
        }
        let mut text = format!("| {} |\n|---|{}\n", header.join(" | "), "---:|".repeat(header.len() - 1));
        for line in lines {
            let mut row = vec![line.to_owned()];
            for column in &columns {
                for &(_, field, digits) in &cells {
                    // Not all lines have all columns.
                    let number = self.number(study, [line, column, field]);
                    row.push(number.map_or_else(|_| "–".to_owned(), |number| written(number, digits)));
                }
            }
            text += &format!("| {} |\n", row.join(" | "));
        }
        Ok(text)
    }

    /// Checks the numbers of the sentences of `document`; how many there are.
    pub fn check_sentences(&self, document: &str) -> Result<usize, String> {
        let mut count = 0;
        for paragraph in document.split("\n\n") {
            let Some((text, source)) = paragraph.split_once(FROM) else { continue };
            let source = source.split_whitespace().collect::<Vec<_>>().join(" ");
            let source = source.strip_suffix(" -->").ok_or_else(|| format!("'{source}' does not end the paragraph"))?;
            let (study, numbers) = source.split_once(": ").ok_or_else(|| format!("'{source}' names no study"))?;
            for number in numbers.split("; ") {
                self.check(study, number, &text.replace('\n', " "))?;
                count += 1;
            }
        }
        Ok(count)
    }

    /// Checks one number, of which `text` is the paragraph.
    fn check(&self, study: &str, number: &str, text: &str) -> Result<(), String> {
        let (stated, from) = number.split_once(" = ").ok_or_else(|| format!("'{number}' has no '='"))?;
        let place: Vec<&str> = from.split(" / ").collect();
        let [line, column, field] = <[&str; 3]>::try_from(place).map_err(|_| format!("'{from}' is no place"))?;
        let digits = stated.trim_end_matches(" %").split_once('.').map_or(0, |(_, digits)| digits.len());
        let found = match line.split_once(" over ") {
            Some((line, base)) => {
                let [of_line, of_base] = [line, base].map(|line| self.number(study, [line, column, field]));
                format!("{} %", written(((of_line? / of_base?) - 1.0).abs() * 100.0, digits))
            }
            None => written(self.number(study, [line, column, field])?, digits),
        };
        if found != stated {
            return Err(format!("'{stated}' is {found} in {study}, {from}"));
        }
        let stands = text.split(|c: char| !(c.is_alphanumeric() || c == '.' || c == '%' || c == ' ')).any(|part| {
            let words = |text: &str| {
                text.split(' ')
                    .filter(|word| !word.is_empty())
                    .map(|word| word.trim_end_matches('.').to_owned())
                    .collect::<Vec<_>>()
            };
            let (part, stated) = (words(part), words(stated));
            part.windows(stated.len()).any(|window| window == stated)
        });
        if stands { Ok(()) } else { Err(format!("'{stated}' of {study} is not in: {text}")) }
    }
}

/// Title, field and digits of "TITLE=FIELD:DIGITS".
fn cell_of(text: &str) -> Result<(&str, &str, usize), String> {
    let parts = text.split_once('=').and_then(|(title, of)| Some((title, of.split_once(':')?)));
    let (title, (field, digits)) = parts.ok_or_else(|| format!("'{text}' is no TITLE=FIELD:DIGITS"))?;
    Ok((title, field, digits.parse().map_err(|error| format!("'{text}': {error}"))?))
}

fn written(number: f64, digits: usize) -> String {
    format!("{number:.digits$}")
}

#[cfg(test)]
const SAMPLE: &str = r#"{"study":"trees","line":"Fast","column":"bunny","sah_cost":35.94,"ao":50.0}
{"study":"trees","line":"Best","column":"bunny","sah_cost":31.56,"ao":48.0}
{"study":"trees","line":"Best","column":"sponza","sah_cost":60.96,"ao":26.5}
{"study":"other","line":"Best","column":"sponza","sah_cost":1.0}"#;

#[test]
fn a_table_of_counts_has_a_line_and_a_column_for_each_label() {
    let counts = Counts::parse(SAMPLE).unwrap();
    let expected = "| tree | bunny | sponza |\n|---|---:|---:|\n| Fast | 35.9 | – |\n| Best | 31.6 | 61.0 |\n";
    assert_eq!(counts.table("trees | tree | =sah_cost:1").unwrap(), expected);
    let two = counts.table("trees | tree | SAH=sah_cost:0, ao=ao:1").unwrap();
    assert!(two.starts_with("| tree | bunny, SAH | bunny, ao | sponza, SAH | sponza, ao |\n"), "{two}");
    for wrong in ["trees | tree", "none | tree | =sah_cost:1", "trees | tree | sah_cost"] {
        assert!(counts.table(wrong).is_err(), "{wrong}");
    }
}

#[test]
fn numbers_of_sentences_are_those_of_the_rows() {
    let counts = Counts::parse(SAMPLE).unwrap();
    let check = |text: &str, source: &str| {
        counts.check_sentences(&format!("before 7\n\n{text}\n{FROM}trees: {source} -->\n\nafter"))
    };
    let text = "Best costs 31.6 on the\nbunny, 12 % less than Fast.";
    let both = "31.6 = Best / bunny / sah_cost; 12 % = Best over Fast / bunny / sah_cost";
    assert_eq!(check(text, both), Ok(2));
    assert_eq!(counts.check_sentences("no source, 31.6"), Ok(0));
    for (text, source, error) in [
        (text, "31.6 = Fast / bunny / sah_cost", "'31.6' is 35.9"),
        ("Best costs 131.6.", "31.6 = Best / bunny / sah_cost", "is not in"),
        (text, "31.6 = Worst / bunny / sah_cost", "no row 'Worst'"),
        (text, "11 % = Best over Fast / bunny / sah_cost", "is 12 %"),
    ] {
        let found = check(text, source).unwrap_err();
        assert!(found.contains(error), "{found}");
    }
}
