//! Numbers in text, as the programs of all systems write them.

/// Values that are not finite in the spelling of older C libraries of Windows, in lower case and without a sign; digits may follow
/// "#ind" and its like.
const WINDOWS_SPELLINGS: [(&[u8], f64); 6] = [
    (b"1.#ind", f64::NAN),
    (b"1.#qnan", f64::NAN),
    (b"1.#snan", f64::NAN),
    (b"1.#inf", f64::INFINITY),
    (b"nan(ind)", f64::NAN),
    (b"nan(snan)", f64::NAN),
];

/// A word as a number.
pub(super) fn number(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok().or_else(|| windows_number(word))
}

fn windows_number(word: &[u8]) -> Option<f64> {
    let (sign, digits) = match word.split_first()? {
        (b'-', digits) => (-1.0, digits),
        (b'+', digits) => (1.0, digits),
        _ => (1.0, word),
    };
    let (_, value) = WINDOWS_SPELLINGS.iter().find(|(spelling, _)| {
        let is_same = digits.get(..spelling.len()).is_some_and(|start| start.eq_ignore_ascii_case(spelling));
        is_same && digits[spelling.len()..].iter().all(|byte| *byte == b'0')
    })?;
    Some(sign * value)
}

/// Remedy for a word that is not a number.
pub(super) fn advice_about(word: &[u8]) -> &'static str {
    let is_number = |word: &[u8]| number(word).is_some();
    let digits = word.strip_prefix(b"-").unwrap_or(word);
    if word.strip_suffix(b",").is_some_and(is_number) || word.strip_prefix(b",").is_some_and(is_number) {
        "take out the commas between numbers"
    } else if word.contains(&b',')
        && word.iter().any(u8::is_ascii_digit)
        && word.iter().all(|byte| b"0123456789+-.,eE".contains(byte))
    {
        "write decimals with a point, or export the model with an English number format"
    } else if digits.starts_with(b"0x") || digits.starts_with(b"0X") {
        "write it in decimal digits"
    } else {
        "correct the line or export the model again"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_spellings_are_numbers() {
        for word in
            ["-nan(ind)", "nan(ind)", "-1.#IND", "1.#QNAN", "-1.#IND00", "1.#QNAN0", "1.#SNAN", "nan(snan)", "nan"]
        {
            assert!(number(word.as_bytes()).is_some_and(f64::is_nan), "{word}");
        }
        assert_eq!(number(b"1.#INF"), Some(f64::INFINITY));
        assert_eq!(number(b"-1.#INF00"), Some(f64::NEG_INFINITY));
        for word in ["1.#", "1.#IN", "2.#INF", "--1.#INF", "1.#INF7", "nan(", "nan()", "1,5", "", "-", "\u{ff11}"] {
            assert_eq!(number(word.as_bytes()), None, "{word}");
        }
    }

    #[test]
    fn commas_between_numbers_are_no_decimals() {
        for (word, advice) in [
            ("0,", "take out"),
            (",1.5", "take out"),
            ("-1e3,", "take out"),
            ("1,5", "with a point"),
            ("1,5,", "with a point"),
            ("0x10", "decimal digits"),
            ("--1", "correct the line"),
            (",", "correct the line"),
        ] {
            assert!(advice_about(word.as_bytes()).contains(advice), "{word}: {}", advice_about(word.as_bytes()));
        }
    }
}
