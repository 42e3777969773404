//! The texts of the repository by line: Markdown without its code, comments and string literals of source files.

use crate::shell::command;

/// Files that contain English, relative to the top.
pub(super) fn files() -> Result<Vec<String>, String> {
    let listed = command("git", ["ls-files"]).output().map_err(|error| format!("cannot run git: {error}"))?;
    let listed = String::from_utf8_lossy(&listed.stdout).into_owned();
    let endings = [".md", ".rs", ".js", ".html", ".toml", ".scheme"];
    // Texts for users and readers of the code: neither tests nor libraries.
    let not_checked = ["tests/", "tests.rs", ".min.js", "examples/", "xtask/src/wording"];
    let is_checked = |path: &&str| {
        endings.iter().any(|ending| path.ends_with(ending))
            && !not_checked.iter().any(|part| path.contains(part))
    };
    Ok(listed.lines().filter(is_checked).map(str::to_owned).collect())
}

/// Each text with its line number.
pub(super) fn texts<'t>(path: &str, text: &'t str) -> Vec<(usize, &'t str)> {
    match path.rsplit_once('.').map(|(_, ending)| ending) {
        Some("md") => markdown(text),
        Some("rs" | "js") => source(text),
        Some("html") => (1..).zip(text.lines()).collect(),
        // Others have comments behind `#`.
        _ => {
            (1..).zip(text.lines()).filter_map(|(line, text)| Some((line, text.split_once('#')?.1))).collect()
        }
    }
}

fn markdown(text: &str) -> Vec<(usize, &str)> {
    let mut is_code = false;
    let is_prose = |(_, line): &(usize, &str)| {
        let is_fence = line.trim_start().starts_with("```");
        is_code ^= is_fence;
        !is_code && !is_fence && !line.starts_with("    ")
    };
    (1..).zip(text.lines()).filter(is_prose).collect()
}

/// What the scanner of source files is in.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Within {
    Code,
    Text,
    /// A raw string, with the number of its `#`.
    Raw(usize),
}

/// Comments and string literals, each split at line ends.
fn source(text: &str) -> Vec<(usize, &str)> {
    let mut found = Vec::new();
    let mut within = Within::Code;
    for (number, line) in (1..).zip(text.lines()) {
        let mut rest = line;
        loop {
            let end = match within {
                Within::Code => {
                    let Some((next, after)) = leave_code(rest) else { break };
                    if let Opening::Comment = next {
                        found.push((number, after.trim_start_matches(['/', '!', ' '])));
                        break;
                    }
                    within = if let Opening::Raw(hashes) = next { Within::Raw(hashes) } else { Within::Text };
                    rest = after;
                    continue;
                }
                Within::Text => end_of_text(rest).map(|end| (end, end + 1)),
                Within::Raw(hashes) => {
                    let closing = format!("\"{}", "#".repeat(hashes));
                    rest.find(&closing).map(|end| (end, end + closing.len()))
                }
            };
            let (content, after) =
                end.map_or((rest, None), |(end, next)| (&rest[..end], Some(&rest[next..])));
            found.push((number, content));
            let Some(after) = after else { break };
            (rest, within) = (after, Within::Code);
        }
    }
    found
}

/// The beginning of a comment or a string literal.
enum Opening {
    Comment,
    Text,
    Raw(usize),
}

/// The next comment or string literal in a line of code, with the text after its opening.
fn leave_code(line: &str) -> Option<(Opening, &str)> {
    let mut rest = line;
    let mut before = ' ';
    loop {
        if let Some(after) = rest.strip_prefix("//") {
            return Some((Opening::Comment, after));
        }
        if let Some(after) = rest.strip_prefix('"') {
            return Some((Opening::Text, after));
        }
        if let Some(after) = rest.strip_prefix('r').filter(|_| !before.is_ascii_alphanumeric()) {
            let literal = after.trim_start_matches('#');
            if let Some(literal_after) = literal.strip_prefix('"') {
                return Some((Opening::Raw(after.len() - literal.len()), literal_after));
            }
        }
        // A quotation mark as a character.
        let skipped = ["'\"'", "'\\\"'", "'\\''"].iter().find_map(|character| rest.strip_prefix(character));
        let mut characters = rest.chars();
        before = characters.next()?;
        rest = skipped.unwrap_or(characters.as_str());
    }
}

/// Where a string literal ends.
fn end_of_text(text: &str) -> Option<usize> {
    let mut is_escaped = false;
    text.bytes().position(|byte| {
        let is_end = byte == b'"' && !is_escaped;
        is_escaped = byte == b'\\' && !is_escaped;
        is_end
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_and_literals_are_found_and_code_is_not() {
        let text = "//! Head\nlet a = \"one \\\n   two\"; // three\nlet b = 'x'; let c: &'static str = r#\"a \"b\" c\"#;\nlet d = '\"'; f(\"e\\\"f\")\n";
        let expected =
            [(1, "Head"), (2, "one \\"), (3, "   two"), (3, "three"), (4, "a \"b\" c"), (5, "e\\\"f")];
        assert_eq!(texts("a.rs", text), expected);
        assert_eq!(texts("a.md", "A\n```\nb\n```\n    c\nD"), [(1, "A"), (6, "D")]);
        assert_eq!(texts("a.toml", "a = 1 # unit\nb = 2"), [(1, " unit")]);
    }
}
