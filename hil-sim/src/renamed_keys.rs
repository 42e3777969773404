//! Renamed keys of rigs, settings and motor files: old names are accepted for one release, with a warning.

use std::borrow::Cow;
use std::fmt::{self, Display};
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

const RENAMED: [RenamedKey; 9] = [
    RenamedKey { old: "size", new: "amplitude" },
    RenamedKey { old: "burst_start", new: "burst_entry_probability" },
    RenamedKey { old: "burst_end", new: "burst_exit_probability" },
    RenamedKey { old: "damping_ns_per_m", new: "damping_n_s_per_m" },
    RenamedKey { old: "impedance_ns_per_m", new: "impedance_n_s_per_m" },
    RenamedKey { old: "most_torque_nm", new: "max_torque_nm" },
    RenamedKey { old: "least_bus_v", new: "min_bus_v" },
    RenamedKey { old: "most_bus_v", new: "max_bus_v" },
    RenamedKey { old: "most_duty", new: "max_duty" },
];

/// A renamed key; its text is a warning.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RenamedKey {
    /// Accepted until the next release.
    pub old: &'static str,
    /// Replacement.
    pub new: &'static str,
}

impl Display for RenamedKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "key `{}` is now `{}`; the next release rejects the old name", self.old, self.new)
    }
}

/// Replaces old keys in a TOML text; returns the new text and the replaced keys, each once. A text that is not TOML is
/// returned unchanged.
#[must_use]
pub fn replace_renamed_keys(text: &str) -> (Cow<'_, str>, Vec<RenamedKey>) {
    let mut found = Vec::new();
    if let Ok(document) = DeTable::parse(text) {
        find(document.get_ref(), &mut found);
    }
    if found.is_empty() {
        return (Cow::Borrowed(text), Vec::new());
    }
    found.sort_by_key(|(_, span)| span.start);
    let mut updated = text.to_owned();
    for (key, span) in found.iter().rev() {
        updated.replace_range(span.clone(), key.new);
    }
    let mut keys: Vec<RenamedKey> = Vec::new();
    for (key, _) in found {
        if !keys.contains(&key) {
            keys.push(key);
        }
    }
    (Cow::Owned(updated), keys)
}

/// Replaces old parts of a dotted key, such as `hand.damping_ns_per_m`.
#[must_use]
pub fn replace_renamed_path(path: &str) -> (String, Option<RenamedKey>) {
    let (mut parts, mut renamed) = (Vec::new(), None);
    for part in path.split('.').map(str::trim) {
        let key = RENAMED.iter().find(|key| key.old == part);
        renamed = renamed.or(key.copied());
        parts.push(key.map_or(part, |key| key.new));
    }
    (parts.join("."), renamed)
}

fn find(table: &DeTable<'_>, found: &mut Vec<(RenamedKey, Range<usize>)>) {
    for (key, value) in table {
        found.extend(
            RENAMED
                .iter()
                .filter(|renamed| renamed.old == &**key.get_ref())
                .map(|renamed| (*renamed, key.span())),
        );
        find_in(value, found);
    }
}

fn find_in(value: &Spanned<DeValue<'_>>, found: &mut Vec<(RenamedKey, Range<usize>)>) {
    match value.get_ref() {
        DeValue::Table(table) => find(table, found),
        DeValue::Array(entries) => entries.iter().for_each(|entry| find_in(entry, found)),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn old_keys_are_replaced_wherever_they_are_and_nothing_else() {
        let text =
            "a.size = 1\nname = \"size\" # size\n[[move]]\nstep = { at_s = 0.1, size = 2 }\nmost_duty = 3\n";
        let (updated, keys) = replace_renamed_keys(text);
        assert_eq!(
            updated,
            "a.amplitude = 1\nname = \"size\" # size\n[[move]]\nstep = { at_s = 0.1, amplitude = 2 }\nmax_duty = 3\n"
        );
        assert_eq!(keys.iter().map(|key| key.old).collect::<Vec<_>>(), ["size", "most_duty"]);
        assert!(keys[0].to_string().contains("`size` is now `amplitude`"));
        assert_eq!(super::replace_renamed_keys("size = "), (Cow::Borrowed("size = "), vec![]));
        let (path, key) = replace_renamed_path("hand.damping_ns_per_m");
        assert_eq!(
            (path.as_str(), key.map(|key| key.new)),
            ("hand.damping_n_s_per_m", Some("damping_n_s_per_m"))
        );
        assert_eq!(replace_renamed_path("seed"), ("seed".to_owned(), None));
    }
}
