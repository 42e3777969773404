//! A page per module: its section of `docs/modules.md`, which the modules write of themselves, what its source says of its
//! equations, and what it takes on boards.

use std::fs;

use boards::BOARDS;

use super::{Page, head_of, read_text};
use crate::budget_file::BudgetFile;
use crate::shell::top;

/// All of them, in the order of the list.
pub(super) fn pages() -> Result<Vec<Page>, String> {
    let sources = sources()?;
    let page = read_text("docs/modules.md")?;
    sections(&page).map(|(name, section)| self::page(name, section, &sources)).collect()
}

/// The page of all modules, whose sections are pages of their own.
pub(super) fn index(page: &str) -> String {
    let head = page.split("\n## ").next().unwrap_or_default();
    let rows = sections(page).map(|(name, section)| {
        let summary = section.trim_start().lines().next().unwrap_or_default();
        format!("| [{name}]({}) | {summary} |\n", file(name))
    });
    rows.fold(head.to_owned() + "\n| Module | Does |\n|---|---|\n", |text, row| text + &row)
}

fn file(name: &str) -> String {
    format!("modules/{name}.md")
}

/// Name and text of each.
fn sections(page: &str) -> impl Iterator<Item = (&str, &str)> {
    page.split("\n## ").skip(1).filter_map(|section| section.split_once('\n'))
}

/// Path and text of the files that modules are in.
fn sources() -> Result<Vec<(String, String)>, String> {
    let folder = "dimsart-modules/src";
    let entries = fs::read_dir(top().join(folder)).map_err(|error| format!("{folder}: {error}"))?;
    let paths = entries.flatten().map(|entry| format!("{folder}/{}", entry.file_name().to_string_lossy()));
    let mut paths: Vec<String> = paths.filter(|path| path.ends_with(".rs")).collect();
    paths.sort_unstable();
    paths.into_iter().map(|path| Ok((path.clone(), read_text(&path)?))).collect()
}

fn page(name: &str, section: &str, sources: &[(String, String)]) -> Result<Page, String> {
    let mut text = format!("# {name}\n{}\n", section.trim_end());
    let named = format!("\"{name}\"");
    if let Some((path, source)) = sources.iter().find(|(_, source)| source.contains(&named)) {
        text += &format!("\n## What it computes\n\n{}\n`{path}`\n", head_of(source));
    }
    let mut rows = String::new();
    for board in BOARDS {
        if let Some(part) = BudgetFile::of(board)?.side("master").get(name) {
            rows += &format!("| {} | {} | {} |\n", board.name, part.cycles, part.stack_bytes);
        }
    }
    if !rows.is_empty() {
        text += "\n## What it takes\n\nAt most, in a tick of the shipped scheme with 3 degrees of freedom, by the machine \
                 code ([how](../cycles.md)):\n\n| Board | Cycles | Stack, bytes |\n|---|---:|---:|\n";
        text += &rows;
    }
    Ok(Page { title: name.to_owned(), path: format!("docs/{}", file(name)), text })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_module_has_a_page_with_its_ports_its_equations_and_its_costs() {
        let pages = pages().unwrap();
        for Page { title, text, .. } in &pages {
            assert!(text.contains("## What it computes\n\n"), "{title}: no source is found");
            assert!(text.contains("| port |") || text.contains("adds a port"), "{title}: {text}");
        }
        let pd = pages.iter().find(|page| page.title == "PDCTRL_MOD").unwrap();
        for part in ["| K_PARAM | N/m", "`F = K e + D", "| nucleo-g474re | 1", "`dimsart-modules/src/pd.rs`"]
        {
            assert!(pd.text.contains(part), "{}", pd.text);
        }
        let index = index(&read_text("docs/modules.md").unwrap());
        assert_eq!(index.matches("](modules/").count(), pages.len());
    }
}
