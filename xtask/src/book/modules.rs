//! A page per module kind: ports and parameters from `dimsart modules`, equations from its source, costs from the budgets.

use std::fs;

use boards::BOARDS;

use super::{Page, head_of, read_text};
use crate::budget_file::BudgetFile;
use crate::shell::{cargo, top};

/// The pages, in the order of the summary table. `details` are those of all modules, from [`details`].
pub(super) fn pages(details: &str) -> Result<Vec<Page>, String> {
    let sources = sources()?;
    let section_of =
        |wanted: &str| sections(details).find(|(name, _)| *name == wanted).map_or("", |(_, section)| section);
    let table = read_text("docs/modules.md")?;
    rows(&table).map(|(_, name)| page(name, section_of(name), &sources)).collect()
}

/// Adds a link to the module's page to each row of the summary table.
pub(super) fn with_links(page: &str) -> String {
    let row = |line: &str| match rows(line).next() {
        Some((_, name)) => line.replace(&format!("| {name} |"), &format!("| [{name}]({}) |", file(name))),
        None => line.to_owned(),
    };
    page.lines().map(|line| row(line) + "\n").collect()
}

/// Group and name in each row of the summary table.
fn rows(page: &str) -> impl Iterator<Item = (&str, &str)> {
    page.lines()
        .filter_map(cells)
        .filter(|(_, name)| name.starts_with(|first: char| first.is_ascii_uppercase()))
}

fn cells(line: &str) -> Option<(&str, &str)> {
    let (group, rest) = line.strip_prefix("| ")?.split_once(" | ")?;
    Some((group, rest.split_once(" | ")?.0))
}

/// The groups of the summary table, each once.
fn groups(page: &str) -> Vec<String> {
    let mut groups: Vec<String> = rows(page).map(|(group, _)| group.to_owned()).collect();
    groups.dedup();
    groups
}

/// Ports and parameters of all modules, as Markdown. Builds and runs `dimsart`.
pub(super) fn details() -> Result<String, String> {
    groups(&read_text("docs/modules.md")?).iter().map(|group| details_of(group)).collect()
}

fn details_of(group: &str) -> Result<String, String> {
    let mut command =
        cargo(&["run", "--quiet", "--package", "dimsart", "--", "modules", group, "--markdown"]);
    let output = command.output().map_err(|error| format!("cannot run dimsart modules: {error}"))?;
    if !output.status.success() {
        return Err(format!("dimsart modules {group}: {}", String::from_utf8_lossy(&output.stderr).trim()));
    }
    String::from_utf8(output.stdout).map_err(|error| format!("dimsart modules {group}: {error}"))
}

fn file(name: &str) -> String {
    format!("modules/{name}.md")
}

/// Name and text of each section.
fn sections(details: &str) -> impl Iterator<Item = (&str, &str)> {
    details.split("\n## ").skip(1).filter_map(|section| section.split_once('\n'))
}

/// Path and text of the source files of the library.
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
        text += &format!("\n## Equations\n\n{}\n`{path}`\n", head_of(source));
    }
    let mut rows = String::new();
    for board in BOARDS {
        if let Some(part) = BudgetFile::of(board)?.side("master").get(name) {
            rows += &format!("| {} | {} | {} |\n", board.name, part.cycles, part.stack_bytes);
        }
    }
    if !rows.is_empty() {
        text += "\n## Costs\n\nUpper bounds for one tick of the shipped scheme with 3 degrees of freedom \
                 ([how](../cycles.md)):\n\n| Board | Cycles | Stack, bytes |\n|---|---:|---:|\n";
        text += &rows;
    }
    Ok(Page { title: name.to_owned(), path: format!("docs/{}", file(name)), text })
}

#[cfg(test)]
mod tests {
    use super::*;

    const DETAILS: &str = "\n## PDCTRL_MOD\n\nPD controller.\n\n| port |\n| --- |\n| PORT |\n";

    #[test]
    fn every_module_has_a_source_with_its_equations() {
        let (table, sources) = (read_text("docs/modules.md").unwrap(), sources().unwrap());
        assert!(rows(&table).count() > 60);
        for (_, name) in rows(&table) {
            let page = page(name, "", &sources).unwrap();
            assert!(page.text.contains("## Equations\n\n"), "{name}: no source is found");
        }
        assert_eq!(with_links(&table).matches("](modules/").count(), rows(&table).count());
    }

    #[test]
    fn a_page_has_details_equations_and_costs() {
        let (name, section) = sections(DETAILS).next().unwrap();
        let page = page(name, section, &sources().unwrap()).unwrap();
        for part in ["| PORT |", "`F = K e + D", "| nucleo-g474re | 1", "`dimsart-modules/src/pd.rs`"] {
            assert!(page.text.contains(part), "{}", page.text);
        }
    }
}
