//! The book: the pages in `docs/`, with generated pages per module, board and fault.

mod boards;
mod faults;
mod modules;
mod pins;
mod source;

use std::fs;
use std::path::Path;

use crate::measured;
use crate::setup;
use crate::shell::{Outcome, command, run, target, top};

/// A generated page.
struct Page {
    title: String,
    /// Path from the repository's top folder.
    path: String,
    text: String,
}

/// Builds the book to `target/book`.
pub(crate) fn book() -> Outcome {
    let mdbook = setup::mdbook()?;
    let (folder, book) = (target().join("book-source"), target().join("book"));
    if folder.exists() {
        fs::remove_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    }
    for (path, bytes) in source::files(&modules::details()?)? {
        write(&folder.join("pages").join(path), &bytes)?;
    }
    for file in ["book.toml", "book.css"] {
        write(&folder.join(file), &read(&format!("docs/{file}"))?)?;
    }
    for (measuring, name) in measured::PAGES.iter().filter(|(_, name)| measured::details(name).is_none()) {
        println!(
            "without the details of docs/{name}.md: run `cargo xtask {measuring}` before `cargo xtask book`"
        );
    }
    run(command(mdbook, ["build", "--dest-dir"]).arg(&book).arg(&folder))?;
    println!("the book: {}", book.join("index.html").display());
    Ok(())
}

/// Reads a file of the repository.
fn read(path: &str) -> Result<Vec<u8>, String> {
    fs::read(top().join(path)).map_err(|error| format!("cannot read {path}: {error}"))
}

fn read_text(path: &str) -> Result<String, String> {
    String::from_utf8(read(path)?).map_err(|error| format!("{path}: {error}"))
}

fn write(path: &Path, bytes: &[u8]) -> Outcome {
    let written = path.parent().map_or(Ok(()), fs::create_dir_all).and_then(|()| fs::write(path, bytes));
    written.map_err(|error| format!("cannot write {}: {error}", path.display()))
}

/// Returns a Rust file's module documentation as Markdown.
fn head_of(source: &str) -> String {
    let lines = source.lines().map_while(|line| line.strip_prefix("//!"));
    // Links to items work only in rustdoc: replaced by their text.
    lines.fold(String::new(), |text, line| {
        text + &without_item_links(line.strip_prefix(' ').unwrap_or(line)) + "\n"
    })
}

/// Replaces `[text](crate::Item)` and ``[`Item`]`` by their texts.
fn without_item_links(line: &str) -> String {
    let (mut text, mut rest) = (String::new(), line);
    while let Some((before, (label, after))) =
        rest.split_once('[').and_then(|(before, from)| Some((before, from.split_once(']')?)))
    {
        text += before;
        let target = after.strip_prefix('(').and_then(|from| from.split_once(')'));
        match target {
            Some((target, after)) if target.contains("::") => {
                text += label;
                rest = after;
            }
            None if label.starts_with('`') => {
                text += label;
                rest = after;
            }
            _ => {
                text = text + "[" + label + "]";
                rest = after;
            }
        }
    }
    text + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_head_of_a_source_file_is_markdown_without_links_to_items() {
        let source = "//! A law: see [`Pd`] and [content](crate::Content).\n//!\n//! `e[k-1]`, [web](https://a.b)\n\nuse x;\n//! no\n";
        assert_eq!(head_of(source), "A law: see `Pd` and content.\n\n`e[k-1]`, [web](https://a.b)\n");
    }
}
