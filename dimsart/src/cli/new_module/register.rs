//! Adds a module to a list of modules: its file, its type and its entry.

use super::names::Names;

/// End of a list's first line, and its last line.
const LIST: &str = "kinds![";
const LIST_END: &str = "];";

/// The lines that add a module to a list.
pub(super) fn lines(names: &Names) -> [String; 3] {
    let Names { file, kind, .. } = names;
    [format!("pub mod {file};"), format!("pub use {file}::{kind};"), format!("    {kind},")]
}

/// Adds the module to the text of a file with a [list of modules](dimsart_core::kinds); none if the list is missing.
pub(super) fn register(text: &str, names: &Names) -> Option<String> {
    let mut rows: Vec<String> = text.lines().map(str::to_owned).collect();
    let [module, use_of_it, entry] = lines(names);
    for (start, row) in [("pub mod ", module), ("pub use ", use_of_it)] {
        let is_like = |other: &String| other.starts_with(start);
        let name = |row: &str| row.trim_end_matches(';').to_owned();
        let after = |other: &String| is_like(other) && name(other) > name(&row);
        let place = rows.iter().position(after).or_else(|| Some(rows.iter().rposition(is_like)? + 1))?;
        rows.insert(place, row);
    }
    let list = rows.iter().rposition(|row| row.ends_with(LIST))?;
    let end = rows.iter().skip(list).position(|row| row == LIST_END)? + list;
    rows.insert(end, entry);
    Some(rows.join("\n") + "\n")
}

#[cfg(test)]
mod tests {
    use dimsart_core::ModuleKinds;

    use super::*;

    /// The lists of the library and of a project.
    #[test]
    fn a_module_comes_into_both_lists_among_its_like_and_at_the_end() {
        let names = Names::new("swing damper", ModuleKinds::NONE).unwrap();
        let library = include_str!("../../../../dimsart-modules/src/lib.rs");
        let project = include_str!("../new_project/modules.rs");
        for text in [library, project] {
            let registered = register(text, &names).unwrap();
            for line in lines(&names) {
                assert_eq!(registered.lines().filter(|row| **row == line).count(), 1, "{line}");
            }
            let without: Vec<&str> =
                registered.lines().filter(|row| !lines(&names).contains(&(*row).to_owned())).collect();
            assert_eq!(without, text.lines().collect::<Vec<_>>());
            let names = registered.lines().filter_map(|row| row.strip_prefix("pub mod ")?.strip_suffix(';'));
            let mods: Vec<&str> = names.collect();
            assert!(mods.is_sorted(), "{mods:?}");
        }
        let entries = register(library, &names).unwrap();
        let last = entries.lines().rev().find(|row| row.starts_with("    ")).unwrap();
        assert_eq!(last, "    SwingDamper,");
    }

    #[test]
    fn a_file_without_a_list_is_left_alone() {
        assert_eq!(register("fn main() {}\n", &Names::new("swing damper", ModuleKinds::NONE).unwrap()), None);
    }
}
