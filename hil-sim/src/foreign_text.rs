//! Text from a device, image, recording or network peer: characters that a terminal or a scheme would act on are replaced.
//!
//! Every reader of such text calls [`visible`] or [`visible_word`] where the text enters, so that no later use has to.

use std::borrow::Cow;

/// The text on one line: control characters, changes of the text direction and invisible characters become `?`.
#[must_use]
pub fn visible(text: &str) -> String {
    replaced(text, is_hidden)
}

/// The same for a name in schemes, where blanks and `#` separate and end rows.
#[must_use]
pub fn visible_word(text: &str) -> String {
    replaced(text, ends_word)
}

/// The same for several lines, such as a scheme: what separates words and lines stays, and so does a byte order mark.
#[must_use]
pub fn visible_lines(text: &str) -> String {
    replaced(text, |found| is_hidden(found) && !['\n', '\r', '\t', '\u{feff}'].contains(&found))
}

/// The text as messages show it: of a long one its beginning, so that a message stays one that is read.
#[must_use]
pub fn shortened(text: &str, most_chars: usize) -> Cow<'_, str> {
    match text.char_indices().nth(most_chars) {
        Some((end, _)) => Cow::Owned(format!("{}…", text.get(..end).unwrap_or_default())),
        None => Cow::Borrowed(text),
    }
}

fn replaced(text: &str, is_replaced: impl Fn(char) -> bool) -> String {
    text.replace(is_replaced, "?")
}

/// Whether a character is not allowed within a word of a scheme.
#[must_use]
pub fn ends_word(found: char) -> bool {
    is_hidden(found) || found.is_whitespace() || found == '#'
}

/// Whether a character changes a terminal or a line instead of being seen: control characters, line separators, changes of
/// the text direction, and Unicode's default ignorable characters.
#[must_use]
pub fn is_hidden(found: char) -> bool {
    found.is_control()
        || matches!(
            found,
            '\u{ad}'
                | '\u{34f}'
                | '\u{61c}'
                | '\u{115f}'..='\u{1160}'
                | '\u{17b4}'..='\u{17b5}'
                | '\u{180b}'..='\u{180f}'
                | '\u{200b}'..='\u{200f}'
                | '\u{2028}'..='\u{202e}'
                | '\u{2060}'..='\u{206f}'
                | '\u{3164}'
                | '\u{fe00}'..='\u{fe0f}'
                | '\u{feff}'
                | '\u{ffa0}'
                | '\u{fff0}'..='\u{fffb}'
                | '\u{1bca0}'..='\u{1bca3}'
                | '\u{1d173}'..='\u{1d17a}'
                | '\u{e0000}'..='\u{e0fff}'
        )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hidden_characters_are_replaced_and_others_kept() {
        assert_eq!(visible("\x1b[2J\r\n\u{202e}a\u{200b}b\u{e0041}\u{85}"), "?[2J???a?b??");
        assert_eq!(visible("N·m/rad, Ω µ 軸 — # "), "N·m/rad, Ω µ 軸 — # ");
        assert_eq!(visible_word("MOD ENG#\u{a0}X"), "MOD?ENG??X");
        assert_eq!(visible_lines("all\tA\r\nb\x1b"), "all\tA\r\nb?");
    }
}
