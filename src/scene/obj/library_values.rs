//! What statements of a material library are made of: numbers, colours, and textures with their options.

use glam::Vec3;

use super::statement::number;

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

/// What a texture statement says.
pub(super) struct TextureName<'a> {
    /// The name of the file.
    pub(super) name: &'a [u8],
    /// An option that is not used would change the picture.
    pub(super) ignored: bool,
    /// The option -bm.
    pub(super) bump_multiplier: f32,
}

/// Takes a texture statement apart: options, then the name.
pub(super) fn texture_name(mut rest: &[u8]) -> TextureName<'_> {
    let (mut ignored, mut bump_multiplier) = (false, 1.0);
    while rest.starts_with(b"-") {
        let (option, mut after) = split_word(rest);
        let (least, most, default) = match option {
            b"-mm" => (2, 2, &[0.0, 1.0][..]),
            b"-s" => (1, 3, &[1.0; 3][..]),
            b"-o" | b"-t" => (1, 3, &[0.0; 3][..]),
            _ => (1, 1, &[][..]),
        };
        for k in 0..most {
            let (word, next) = split_word(after);
            let value = number(word);
            if k >= least && value.is_none() {
                break;
            }
            if option == b"-bm" {
                bump_multiplier = value.filter(|value| value.is_finite()).unwrap_or(1.0);
            }
            ignored |= match option {
                b"-clamp" | b"-cc" => word == b"on",
                _ => default.get(k).is_some_and(|default| value != Some(*default)),
            };
            after = next;
        }
        rest = after;
    }
    TextureName { name: rest.trim_ascii(), ignored, bump_multiplier }
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
    fn options_stand_before_the_name() {
        let TextureName { name, ignored, bump_multiplier } = texture_name(b"-bm 0.25 -s 1 1 1 a b.png");
        assert_eq!((name, ignored, bump_multiplier), (&b"a b.png"[..], false, 0.25));
        assert_eq!(texture_name(b"-bm x a.png").bump_multiplier, 1.0);
    }
}
