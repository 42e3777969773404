//! Formats values and sentences for a terminal.

use dimsart_core::scheme::switch;
use serde_json::Value;

/// Appends the unit, if any, to a value.
pub(super) fn with_unit(value: &str, unit: &str) -> String {
    format!("{value} {unit}").trim_end().to_owned()
}

/// Formats a value as `dimsart connect` does.
pub(super) fn value(value: &Value) -> String {
    match value {
        Value::Bool(flag) => switch(*flag).to_owned(),
        Value::String(name) => name.clone(),
        Value::Number(number) => match (number.as_i64(), number.as_f64()) {
            (Some(whole), _) => whole.to_string(),
            (None, Some(real)) if real.abs() != 0.0 && !(1e-4..1e7).contains(&real.abs()) => {
                format!("{real:e}")
            }
            (None, Some(real)) => real.to_string(),
            (None, None) => number.to_string(),
        },
        _ => "NaN or inf".to_owned(),
    }
}

/// Formats a changing number with constant width: five digits.
pub(super) fn moving(number: f64) -> String {
    match number.abs() {
        size if !size.is_finite() => "NaN or inf".to_owned(),
        size if size < 10.0 => format!("{number:.4}"),
        size if size < 100.0 => format!("{number:.3}"),
        size if size < 1000.0 => format!("{number:.2}"),
        size if size < 1e7 => format!("{number:.1}"),
        _ => format!("{number:.3e}"),
    }
}

/// Wraps a sentence at words to at most `most` lines, and truncates it with `…`.
pub(super) fn wrapped(sentence: &str, width: usize, most: usize) -> Vec<String> {
    let width = width.max(1);
    let mut lines: Vec<String> = Vec::new();
    for word in sentence.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    let is_cut = lines.len() > most;
    lines.truncate(most);
    if is_cut && let Some(last) = lines.last_mut() {
        let kept: String = last.chars().take(width - 1).collect();
        *last = format!("{kept}…");
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sentence_is_cut_where_it_has_no_room_and_says_so() {
        assert_eq!(wrapped("the device is at rest", 12, 2), ["the device", "is at rest"]);
        assert_eq!(wrapped("the device is at rest", 10, 1), ["the devic…"]);
        assert!(wrapped("", 10, 2).is_empty());
    }

    #[test]
    fn values_are_as_connect_writes_them() {
        for (json, text) in
            [("150.0", "150"), ("true", "ON"), ("1e-7", "1e-7"), ("null", "NaN or inf"), ("7", "7")]
        {
            assert_eq!(value(&serde_json::from_str(json).unwrap()), text);
        }
    }
}
