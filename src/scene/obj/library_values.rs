//! Values in statements of a material library: numbers, colours, and textures with their options.

use glam::Vec3;

use super::super::numbers;

/// A word as a number.
pub(super) fn number(word: &[u8]) -> Option<f32> {
    numbers::number(word).map(|value| value as f32)
}

/// The first word as a finite number.
pub(super) fn first_number(text: &[u8]) -> Option<f32> {
    number(split_word(text).0).filter(|value| value.is_finite())
}

/// A colour of one number (grey) or three.
pub(super) fn color(text: &[u8]) -> Option<Vec3> {
    let words = text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    let words = words.take_while(|word| word.first() != Some(&b'#')).take(3);
    let numbers: Vec<f32> = words.map(number).collect::<Option<_>>()?;
    let color = match numbers[..] {
        [grey] => Vec3::splat(grey),
        [r, g, b] => Vec3::new(r, g, b),
        _ => return None,
    };
    color.is_finite().then(|| color.max(Vec3::ZERO))
}

/// Value of a texture statement.
pub(super) struct TextureName<'a> {
    /// The name of the file.
    pub(super) name: &'a [u8],
    /// An option that is not used would change the picture.
    pub(super) ignored: bool,
    /// The option -bm.
    pub(super) bump_multiplier: f32,
}

/// Options of textures with the least and most number of values, and the values that change nothing.
const OPTIONS: [(&[u8], usize, usize, &[f32]); 13] = [
    (b"-blendu", 1, 1, &[]),
    (b"-blendv", 1, 1, &[]),
    (b"-bm", 1, 1, &[]),
    (b"-boost", 1, 1, &[]),
    (b"-cc", 1, 1, &[]),
    (b"-clamp", 1, 1, &[]),
    (b"-imfchan", 1, 1, &[]),
    (b"-mm", 2, 2, &[0.0, 1.0]),
    (b"-o", 1, 3, &[0.0; 3]),
    (b"-s", 1, 3, &[1.0; 3]),
    (b"-t", 1, 3, &[0.0; 3]),
    (b"-texres", 1, 1, &[]),
    (b"-type", 1, 1, &[]),
];

/// Takes a texture statement apart: options, then the name. Many programs put options or a comment after it, or quotes around it;
/// all that belongs to the name where a file is called so, which `exists` decides.
pub(super) fn texture_name(text: &[u8], exists: impl Fn(&[u8]) -> bool) -> TextureName<'_> {
    let mut found = TextureName { name: b"", ignored: false, bump_multiplier: 1.0 };
    let name = found.read_options(text).trim_ascii();
    found.name = name;
    if !exists(name) {
        let name = without_comment(name);
        let is_option = |at: &usize| name[*at].is_ascii_whitespace() && is_option(&name[at.saturating_add(1)..]);
        let end = (0..name.len()).find(is_option).unwrap_or(name.len());
        found.name = unquoted(name[..end].trim_ascii());
        found.read_options(name[end..].trim_ascii());
    }
    found
}

impl TextureName<'_> {
    /// Reads the options at the beginning of `rest` and returns what follows them.
    fn read_options<'t>(&mut self, mut rest: &'t [u8]) -> &'t [u8] {
        while rest.starts_with(b"-") {
            let (option, mut after) = split_word(rest);
            let known = OPTIONS.iter().find(|(name, ..)| *name == option);
            let (_, least, most, default) = known.copied().unwrap_or((option, 1, 1, &[]));
            for k in 0..most {
                let (word, next) = split_word(after);
                let value = number(word);
                if k >= least && value.is_none() {
                    break;
                }
                if option == b"-bm" {
                    self.bump_multiplier = value.filter(|value| value.is_finite()).unwrap_or(1.0);
                }
                self.ignored |= match option {
                    b"-clamp" | b"-cc" => word == b"on",
                    _ => default.get(k).is_some_and(|default| value != Some(*default)),
                };
                after = next;
            }
            rest = after;
        }
        rest
    }
}

/// Whether a text begins with an option of a texture.
fn is_option(text: &[u8]) -> bool {
    let (word, _) = split_word(text);
    text.starts_with(b"-") && OPTIONS.iter().any(|(name, ..)| *name == word)
}

/// A name without the comment after it.
pub(super) fn without_comment(name: &[u8]) -> &[u8] {
    let end = name.windows(2).position(|pair| pair[0].is_ascii_whitespace() && pair[1] == b'#');
    name[..end.unwrap_or(name.len())].trim_ascii_end()
}

/// A name without the quotes around it.
pub(super) fn unquoted(name: &[u8]) -> &[u8] {
    let inner = |mark: &[u8]| name.strip_prefix(mark)?.strip_suffix(mark).filter(|inner| !inner.is_empty());
    inner(b"\"").or_else(|| inner(b"'")).unwrap_or(name)
}

/// The first word and what follows it.
fn split_word(text: &[u8]) -> (&[u8], &[u8]) {
    let text = text.trim_ascii_start();
    let end = text.iter().position(u8::is_ascii_whitespace).unwrap_or(text.len());
    let (word, rest) = text.split_at(end);
    (word, rest.trim_ascii_start())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stand_among_options_quotes_and_comments() {
        let parts = |text: &'static [u8]| {
            let TextureName { name, ignored, bump_multiplier } = texture_name(text, |name| name == b"a # -s 2.png");
            (String::from_utf8_lossy(name).into_owned(), ignored, bump_multiplier)
        };
        for (text, expected) in [
            (&b"-bm 0.25 -s 1 1 1 a b.png"[..], ("a b.png", false, 0.25)),
            (b"-bm x a.png", ("a.png", false, 1.0)),
            (b"a b.png -s 1 1 1", ("a b.png", false, 1.0)),
            (b"a.png -s 2 -bm 0.5", ("a.png", true, 0.5)),
            (b"-s 2 2 1 \"a b.png\" # wood", ("a b.png", true, 1.0)),
            (b"a-s.png -clamp off", ("a-s.png", false, 1.0)),
            (b"a -b.png", ("a -b.png", false, 1.0)),
            (b"a#1.png", ("a#1.png", false, 1.0)),
            (b"a # -s 2.png", ("a # -s 2.png", false, 1.0)),
            (b"'a.png'", ("a.png", false, 1.0)),
            (b"\"", ("\"", false, 1.0)),
            (b"-s", ("", true, 1.0)),
            (b"", ("", false, 1.0)),
        ] {
            let (name, ignored, bump_multiplier) = expected;
            assert_eq!(parts(text), (name.to_owned(), ignored, bump_multiplier), "{}", String::from_utf8_lossy(text));
        }
    }
}
