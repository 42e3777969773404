//! The files of `boards/budgets`: budgets of a board's firmware.

use std::collections::BTreeMap;
use std::fmt::Write;

use boards::catalogue::BoardInfo;
use serde::Deserialize;

/// The content of a file.
#[derive(Debug, Deserialize)]
pub(crate) struct BudgetFile {
    /// Budget of the default image; `None` if unlimited.
    pub(crate) flash_bytes: Option<u64>,
    pub(crate) ram_bytes: Option<u64>,
    /// Compiler of the images for the other figures, such as `1.95.0`.
    pub(crate) rustc: Option<Version>,
    /// Budgets of the shipped scheme by side and part of the tick.
    #[serde(default)]
    master: BTreeMap<String, Part>,
    #[serde(default)]
    slave: BTreeMap<String, Part>,
}

/// A compiler version.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Version {
    pub(crate) version: String,
}

/// Budget of a tick or a module.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Part {
    pub(crate) cycles: u64,
    pub(crate) stack_bytes: u64,
}

/// Names and budgets in the order of calls.
pub(crate) type Parts = Vec<(String, Part)>;

impl BudgetFile {
    /// Returns the file of a board.
    pub(crate) fn of(board: &BoardInfo) -> Result<Self, String> {
        Self::read(board.budget).map_err(|error| format!("{}: {error}", name(board)))
    }

    fn read(text: &str) -> Result<Self, String> {
        toml::from_str(text).map_err(|error| error.to_string())
    }

    /// Returns the budgets of a side of the shipped scheme.
    pub(crate) fn side(&self, side: &str) -> &BTreeMap<String, Part> {
        if side == "slave" { &self.slave } else { &self.master }
    }
}

/// Returns the path of a board's file.
pub(crate) fn name(board: &BoardInfo) -> String {
    format!("boards/budgets/{}.toml", board.name)
}

/// Returns a file's text with new parts by another compiler; the text before them is kept.
pub(crate) fn with_parts(text: &str, rustc: &str, sides: &[(&str, Parts)]) -> String {
    let before = text.split_inclusive('\n').take_while(|line| !line.starts_with('['));
    let mut text: String = before.collect();
    let _ = writeln!(text, "[rustc]\nversion = \"{rustc}\"");
    for (side, parts) in sides {
        let _ = writeln!(text, "\n[{side}]");
        let keys = || parts.iter().map(|(name, part)| (key(name), part));
        let width = keys().map(|(key, _)| key.len()).max().unwrap_or_default();
        for (key, Part { cycles, stack_bytes }) in keys() {
            let _ =
                writeln!(text, "{key:<width$} = {{ cycles = {cycles:>5}, stack_bytes = {stack_bytes:>4} }}");
        }
    }
    text
}

/// Formats a name as a TOML key, with quotes unless it is the first module of a kind.
fn key(name: &str) -> String {
    let is_bare = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'-');
    if name.bytes().all(is_bare) { name.to_owned() } else { format!("\"{name}\"") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parts(parts: &[(&str, u64, u64)]) -> Parts {
        let part = |(name, cycles, stack_bytes): &(&str, u64, u64)| {
            ((*name).to_owned(), Part { cycles: *cycles, stack_bytes: *stack_bytes })
        };
        parts.iter().map(part).collect()
    }

    #[test]
    fn what_was_written_is_read_again_and_the_rest_stays() {
        let before = "# Of a board.\ntick_cycles = 84_000\nflash_bytes = 98_304\nram_bytes = 32_768\n\n# Of the scheme.\n";
        let [master, slave] =
            [[("tick", 3187, 232), ("PCTRL_MOD.2", 285, 36)], [("tick", 12, 0), ("PCTRL_MOD.2", 7, 104)]];
        let sides = [("master", parts(&master)), ("slave", parts(&slave))];
        let text = with_parts(before, "1.95.0", &sides);
        assert!(text.starts_with(before), "{text}");
        let file = BudgetFile::read(&text).unwrap();
        assert_eq!(file.rustc, Some(Version { version: "1.95.0".to_owned() }));
        assert_eq!((file.flash_bytes, file.ram_bytes), (Some(98_304), Some(32_768)));
        for (side, parts) in &sides {
            assert_eq!(*file.side(side), parts.iter().cloned().collect());
        }
        let others = [("master", parts(&[("tick", 1, 2)])), ("slave", Parts::new())];
        let text = with_parts(&text, "1.96.1", &others);
        let parts = "[master]\ntick = { cycles =     1, stack_bytes =    2 }\n\n[slave]\n";
        assert_eq!(text, format!("{before}[rustc]\nversion = \"1.96.1\"\n\n{parts}"));
    }

    #[test]
    fn a_part_that_lacks_a_figure_or_has_one_too_many_is_told() {
        for wrong in
            ["{ cycles = 1 }", "{ cycles = 1, stack_bytes = -1 }", "{ cycles = 1, stack_bytes = 2, ram = 3 }"]
        {
            let error = BudgetFile::read(&format!("[slave]\ntick = {wrong}\n")).unwrap_err();
            assert!(error.contains("line 2"), "{error}");
        }
    }
}
