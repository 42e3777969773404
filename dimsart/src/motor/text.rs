//! Writes a configuration as commented text.

use drive::Configuration;
use toml::{Table, Value};

use super::EXAMPLE;

/// Returns the text of the [example](EXAMPLE) with the values of a configuration.
#[must_use]
pub fn text(told: &Configuration) -> String {
    let mut table = String::new();
    EXAMPLE.lines().skip(1).filter_map(|line| rewritten(line, &values(told), &mut table)).collect()
}

/// Lists the differences between two configurations: name, old and new value.
#[must_use]
pub fn differences(from: &Configuration, to: &Configuration) -> Vec<(String, String, String)> {
    let flat = |told: &Configuration| {
        let mut flat = Vec::new();
        for (name, value) in values(told) {
            match value {
                Value::Table(table) => {
                    flat.extend(table.iter().map(|(key, value)| (format!("{name}.{key}"), shown(value))));
                }
                value => flat.push((name, shown(&value))),
            }
        }
        flat
    };
    let (from, to) = (flat(from), flat(to));
    let value = |flat: &[(String, String)], name: &str| {
        flat.iter().find(|(known, _)| known == name).map_or("none".to_owned(), |(_, value)| value.clone())
    };
    let mut names: Vec<_> = from.iter().chain(&to).map(|(name, _)| name.clone()).collect();
    names.sort();
    names.dedup();
    let rows = names.into_iter().map(|name| (value(&from, &name), value(&to, &name), name));
    rows.filter(|(from, to, _)| from != to).map(|(from, to, name)| (name, from, to)).collect()
}

fn values(told: &Configuration) -> Table {
    Table::try_from(told).unwrap_or_default()
}

/// Returns a line of the example with the value of its name; `None` if the name has no value.
fn rewritten(line: &str, values: &Table, table: &mut String) -> Option<String> {
    if let Some(name) = line.strip_prefix('[') {
        *table = name.split(']').next().unwrap_or_default().to_owned();
    }
    let Some((name, rest)) = line.split_once(" = ") else { return Some(format!("{line}\n")) };
    let holder = if table.is_empty() { Some(values) } else { values.get(table).and_then(Value::as_table) };
    let set = format!("{name} = {}", shown(holder?.get(name)?));
    Some(match rest.split_once('#') {
        Some((_, word)) => format!("{set:33} #{word}\n"),
        None => format!("{set}\n"),
    })
}

/// Formats a number as short as possible for an `f32`.
#[expect(clippy::cast_possible_truncation, reason = "it was one")]
fn shown(value: &Value) -> String {
    match value {
        Value::Float(number) => format!("{:?}", *number as f32),
        value => value.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use drive::Encoder;

    use super::*;

    #[test]
    fn it_says_what_was_told_and_a_word_about_each_value() {
        let mut told: Configuration = toml::from_str(EXAMPLE).unwrap();
        for encoder in [Encoder::Incremental { counts_per_turn: 2_000 }, Encoder::As5047p] {
            told.encoder = encoder;
            told.joint.gear_ratio = -50.5;
            told.limits.stall_s = f32::INFINITY;
            told.motor.direct_inductance_h = 2.5e-6;
            let text = text(&told);
            assert_eq!(toml::from_str::<Configuration>(&text).unwrap(), told, "{text}");
            assert!(text.contains("gear_ratio = -50.5") && text.contains("# rotor turns per joint turn"));
        }
    }

    #[test]
    fn what_differs_is_named() {
        let told: Configuration = toml::from_str(EXAMPLE).unwrap();
        assert_eq!(differences(&told, &told), []);
        let mut other = told;
        (other.motor.pole_pairs, other.encoder) = (7, Encoder::Mt6701);
        let found = differences(&told, &other);
        let row = |name: &str, from: &str, to: &str| (name.to_owned(), from.to_owned(), to.to_owned());
        assert_eq!(
            found,
            [
                row("encoder.counts_per_turn", "4096", "none"),
                row("encoder.kind", "\"incremental\"", "\"mt6701\""),
                row("motor.pole_pairs", "10", "7"),
            ]
        );
    }
}
