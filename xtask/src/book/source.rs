//! Input of mdBook: the repository's pages, the generated pages and the summary.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path};

use super::{Page, boards, faults, modules, pins, read, read_text};
use crate::markdown::links;
use crate::shell::top;

/// Files by path: pages, and what they link to and show.
pub(super) type Files = BTreeMap<String, Vec<u8>>;

/// Every page that the summary in `docs/` names, with generated pages and linked files. `module_details` are from
/// [`modules::details`].
pub(super) fn files(module_details: &str) -> Result<Files, String> {
    let summary = read_text("docs/SUMMARY.md")?;
    let made = [
        ("docs/modules.md", modules::pages(module_details)?),
        ("docs/firmware.md", measured("firmware")?.into_iter().chain(boards::pages()?).collect()),
        ("docs/benchmarks.md", measured("benchmarks")?),
        ("docs/faults.md", faults::pages()?),
    ];
    let mut files = Files::new();
    let mut wanted = BTreeSet::new();
    for path in links(&summary).iter().map(|link| place("docs/SUMMARY.md", link)) {
        let mut text = read_text(&path)?;
        match path.as_str() {
            "docs/modules.md" => text = modules::with_links(&text),
            "docs/faults.md" => text = faults::with_links(&text),
            _ => {}
        }
        wanted.extend(linked(&path, &text));
        files.insert(path, text.into_bytes());
    }
    for (_, pages) in &made {
        for Page { path, text, .. } in pages {
            wanted.extend(linked(path, text));
            files.insert(path.clone(), text.clone().into_bytes());
        }
    }
    for (path, picture) in ::boards::BOARDS.iter().flat_map(pins::pictures) {
        files.insert(path, picture.into_bytes());
    }
    // A page that the summary does not name would be none in the book.
    for path in wanted.into_iter().filter(|path| !path.ends_with(".md")) {
        if !files.contains_key(&path) && top().join(&path).is_file() {
            files.insert(path.clone(), read(&path)?);
        }
    }
    files.insert("SUMMARY.md".to_owned(), with_made(&summary, &made).into_bytes());
    Ok(files)
}

/// A page with measured details, unless nothing was measured in this checkout.
fn measured(name: &str) -> Result<Vec<Page>, String> {
    let Some(text) = crate::measured::details(name) else { return Ok(Vec::new()) };
    let title = text.lines().next().and_then(|line| line.strip_prefix("# "));
    let title = title.ok_or_else(|| format!("the measured details of {name} have no title"))?.to_owned();
    Ok(vec![Page { title, path: format!("docs/measured/{name}.md"), text }])
}

/// The files of this repository that a page links to.
fn linked(page: &str, text: &str) -> Vec<String> {
    let inside = |link: &String| !link.contains("://") && !link.starts_with('#');
    let links = links(text).into_iter().filter(inside);
    links.map(|link| place(page, link.split('#').next().unwrap_or_default())).collect()
}

/// The place of what a page links to, from the top of the repository.
pub(super) fn place(page: &str, link: &str) -> String {
    let mut place: Vec<_> = Path::new(page).parent().into_iter().flat_map(Path::components).collect();
    for component in Path::new(link).components() {
        match component {
            Component::ParentDir => drop(place.pop()),
            Component::CurDir => {}
            _ => place.push(component),
        }
    }
    place.iter().map(|component| component.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/")
}

/// The summary from the top of the repository, with the pages that are made below those that they belong to.
fn with_made(summary: &str, made: &[(&str, Vec<Page>)]) -> String {
    let mut text = String::new();
    for line in summary.lines() {
        let Some((before, link)) = line.split_once("](").filter(|_| line.ends_with(')')) else {
            text = text + line + "\n";
            continue;
        };
        let path = place("docs/SUMMARY.md", link.trim_end_matches(')'));
        text = text + before + "](" + &path + ")\n";
        let indent: String = line.chars().take_while(|letter| *letter == ' ').collect();
        for Page { title, path, .. } in
            made.iter().filter(|(above, _)| *above == path).flat_map(|(_, pages)| pages)
        {
            text = text + &indent + "  - [" + title + "](" + path + ")\n";
        }
    }
    text
}

/// Every page of `docs/`.
#[cfg(test)]
pub(super) fn pages_of_docs() -> Vec<String> {
    fn below(folder: &str, pages: &mut Vec<String>) {
        for entry in std::fs::read_dir(top().join(folder)).unwrap() {
            let (entry, is_page) = (entry.unwrap(), |path: &str| path.ends_with(".md"));
            let path = format!("{folder}/{}", entry.file_name().to_string_lossy());
            match entry.file_type().unwrap().is_dir() {
                true => below(&path, pages),
                false if is_page(&path) && !path.ends_with("SUMMARY.md") => pages.push(path),
                false => {}
            }
        }
    }
    let mut pages = Vec::new();
    below("docs", &mut pages);
    pages
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chore;
    use crate::markdown::{anchors, blocks, code_spans};

    #[test]
    fn every_page_is_in_the_summary() {
        let summary = read_text("docs/SUMMARY.md").unwrap();
        let named: Vec<String> = links(&summary).iter().map(|link| place("docs/SUMMARY.md", link)).collect();
        let mut pages = pages_of_docs();
        pages.retain(|page| page != "docs/images/README.md");
        for page in pages.iter().map(String::as_str).chain([
            "README.md",
            "ARCHITECTURE.md",
            "CHANGELOG.md",
            "emulator/README.md",
        ]) {
            assert!(named.iter().any(|named| named == page), "docs/SUMMARY.md does not list {page}");
        }
    }

    /// On a Git host and in the book: of the repository's pages, of the book's, and of those that are made.
    #[test]
    fn every_link_leads_somewhere() {
        let (book, mut wrong) = (files("").unwrap(), Vec::new());
        let mut pages: Files = book.clone();
        for path in pages_of_docs() {
            pages.insert(format!("./{path}"), read(&path).unwrap());
        }
        for (path, bytes) in pages.iter().filter(|(path, _)| path.ends_with(".md")) {
            let text = String::from_utf8(bytes.clone()).unwrap();
            for link in links(&text).iter().filter(|link| !link.contains("://")) {
                let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
                let place = if file.is_empty() {
                    path.trim_start_matches("./").to_owned()
                } else {
                    place(path, file)
                };
                let there = match path.starts_with("./") {
                    true => read(&place).ok(),
                    false => book.get(&place).cloned(),
                };
                let has_anchor = |bytes: &[u8]| {
                    anchor.is_empty()
                        || anchors(&String::from_utf8_lossy(bytes)).iter().any(|known| known == anchor)
                };
                if !there.is_some_and(|bytes| has_anchor(&bytes)) && !top().join(&place).is_dir() {
                    wrong.push(format!("{path}: {link}"));
                }
            }
        }
        assert!(wrong.is_empty(), "broken links:\n{}", wrong.join("\n"));
    }

    #[test]
    fn every_chore_that_is_named_is_one() {
        for path in pages_of_docs().iter().map(String::as_str).chain([
            "README.md",
            "ARCHITECTURE.md",
            "emulator/README.md",
        ]) {
            let text = read_text(path).unwrap();
            let code = blocks(&text).into_iter().map(|block| block.text).chain(code_spans(&text));
            for code in code {
                for call in
                    code.split("cargo xtask ").skip(1).filter_map(|rest| rest.split(['\n', '`']).next())
                {
                    let words: Vec<&str> = call.split_whitespace().take(2).collect();
                    assert!(chore::names(crate::VERBS, &words), "{path}: cargo xtask {call}");
                }
            }
        }
    }

    #[test]
    fn pages_that_are_made_stand_below_theirs() {
        let page = Page { title: "B".to_owned(), path: "docs/a/b.md".to_owned(), text: String::new() };
        let summary = "# Summary\n\n[Top](../README.md)\n\n- [A](a.md)\n  - [C](c/d.md)\n";
        let wanted =
            "# Summary\n\n[Top](README.md)\n\n- [A](docs/a.md)\n  - [B](docs/a/b.md)\n  - [C](docs/c/d.md)\n";
        assert_eq!(with_made(summary, &[("docs/a.md", vec![page])]), wanted);
    }
}
