//! Sanitises text from a device, image, recording or network peer: replaces characters that a terminal or scheme
//! would interpret.
//!
//! Every reader of such text calls [`escape_line`] or [`escape_word`] at its entry.

use std::borrow::Cow;

/// Returns text on one line: control characters, changes of text direction and invisible characters become `?`.
#[must_use]
pub fn escape_line(text: &str) -> String {
    replaced(text, is_hidden)
}

/// Like [`escape_line`], for a name in schemes, where whitespace and `#` are separators.
#[must_use]
pub fn escape_word(text: &str) -> String {
    replaced(text, is_word_delimiter)
}

/// Like [`escape_line`], for several lines, such as a scheme: keeps whitespace, newlines and a byte order mark.
#[must_use]
pub fn escape_lines(text: &str) -> String {
    replaced(text, |found| is_hidden(found) && !['\n', '\r', '\t', '\u{feff}'].contains(&found))
}

/// Shortens a long text for a message.
#[must_use]
pub fn truncate(text: &str, max_chars: usize) -> Cow<'_, str> {
    match text.char_indices().nth(max_chars) {
        Some((end, _)) => Cow::Owned(format!("{}…", text.get(..end).unwrap_or_default())),
        None => Cow::Borrowed(text),
    }
}

fn replaced(text: &str, is_replaced: impl Fn(char) -> bool) -> String {
    text.replace(is_replaced, "?")
}

/// Whether a character is not allowed in a word of a scheme.
#[must_use]
pub fn is_word_delimiter(found: char) -> bool {
    is_hidden(found) || found.is_whitespace() || found == '#'
}

/// Whether a character affects the terminal or line instead of being displayed: control characters, line separators,
/// changes of text direction, and Unicode's default ignorable characters.
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
        assert_eq!(escape_line("\x1b[2J\r\n\u{202e}a\u{200b}b\u{e0041}\u{85}"), "?[2J???a?b??");
        assert_eq!(escape_line("N·m/rad, Ω µ 軸 — # "), "N·m/rad, Ω µ 軸 — # ");
        assert_eq!(escape_word("MOD ENG#\u{a0}X"), "MOD?ENG??X");
        assert_eq!(escape_lines("all\tA\r\nb\x1b"), "all\tA\r\nb?");
    }
}
