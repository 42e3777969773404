//! Parses headings, links and code blocks of Markdown.

use pulldown_cmark::{CodeBlockKind, Event, Options, Parser, Tag, TagEnd};

/// A block of code.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Block {
    /// Text after the fence; empty for an indented block.
    pub(crate) info: String,
    pub(crate) text: String,
}

fn events(page: &str) -> Parser<'_> {
    Parser::new_ext(page, Options::ENABLE_TABLES)
}

/// Returns all code blocks in order.
pub(crate) fn blocks(page: &str) -> Vec<Block> {
    let (mut blocks, mut open) = (Vec::new(), None::<Block>);
    for event in events(page) {
        match (event, &mut open) {
            (Event::Start(Tag::CodeBlock(kind)), _) => {
                let info = match kind {
                    CodeBlockKind::Fenced(info) => info.into_string(),
                    CodeBlockKind::Indented => String::new(),
                };
                open = Some(Block { info, text: String::new() });
            }
            (Event::Text(text), Some(block)) => block.text += &text,
            (Event::End(TagEnd::CodeBlock), _) => blocks.extend(open.take()),
            _ => {}
        }
    }
    blocks
}

/// Returns inline code, such as in a table.
#[cfg(test)]
pub(crate) fn code_spans(page: &str) -> Vec<String> {
    let code = |event| if let Event::Code(text) = event { Some(text.into_string()) } else { None };
    events(page).filter_map(code).collect()
}

/// Returns the anchors of headings, as Git hosts and mdBook name them.
#[cfg(test)]
pub(crate) fn anchors(page: &str) -> Vec<String> {
    let (mut anchors, mut open) = (Vec::new(), None::<String>);
    let mut seen = std::collections::BTreeMap::<String, usize>::new();
    for event in events(page) {
        match (event, &mut open) {
            (Event::Start(Tag::Heading { .. }), _) => open = Some(String::new()),
            (Event::Text(text) | Event::Code(text), Some(heading)) => *heading += &text,
            (Event::End(TagEnd::Heading(_)), _) => {
                let anchor = anchor(&open.take().unwrap_or_default());
                let times = seen.entry(anchor.clone()).or_default();
                anchors.push(if *times == 0 { anchor } else { format!("{anchor}-{times}") });
                *times += 1;
            }
            _ => {}
        }
    }
    anchors
}

#[cfg(test)]
fn anchor(heading: &str) -> String {
    let letters = heading.trim().chars().filter_map(|letter| match letter {
        ' ' => Some('-'),
        '-' | '_' => Some(letter),
        _ => letter.is_alphanumeric().then_some(letter),
    });
    letters.flat_map(char::to_lowercase).collect()
}

/// Returns the targets of links and pictures, including HTML.
pub(crate) fn links(page: &str) -> Vec<String> {
    let mut links = Vec::new();
    for event in events(page) {
        match event {
            Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => {
                links.push(dest_url.into_string());
            }
            Event::Html(text) | Event::InlineHtml(text) => {
                for attribute in ["href=\"", "src=\"", "srcset=\""] {
                    let values = text.split(attribute).skip(1).filter_map(|rest| rest.split('"').next());
                    links.extend(values.map(str::to_owned));
                }
            }
            _ => {}
        }
    }
    links
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str = "\
# A page: *how* `it` is read

See [this](other.md#there) and ![that](images/a.png) <img src=\"b.png\" srcset=\"c.png\">.

| cell |
|---|
| [in a table](d.md), `code` |

## Twice
```console fails
$ false
```

    indented

## Twice
";

    #[test]
    fn headings_links_and_code_are_found() {
        assert_eq!(anchors(PAGE), ["a-page-how-it-is-read", "twice", "twice-1"]);
        let mut found = links(PAGE);
        found.sort_unstable();
        assert_eq!(found, ["b.png", "c.png", "d.md", "images/a.png", "other.md#there"]);
        let block = |info: &str, text: &str| Block { info: info.to_owned(), text: text.to_owned() };
        assert_eq!(blocks(PAGE), [block("console fails", "$ false\n"), block("", "indented\n")]);
        assert_eq!(code_spans(PAGE), ["it", "code"]);
    }
}
