//! Checks that every command line in the documentation is valid: no removed sub-commands or options.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Parser as _;
use clap::error::ErrorKind;
use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};

use super::Arguments;

/// Calls of `dimsart`, here and in a project.
const CALLS: [&str; 3] = ["dimsart ", "cargo run --release -- ", "cargo dimsart "];

/// The pages of the repository.
fn pages() -> Vec<PathBuf> {
    fn below(folder: &Path, pages: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                below(&path, pages);
            } else if path.extension().is_some_and(|extension| extension == "md") {
                pages.push(path);
            }
        }
    }
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let top = here.parent().unwrap();
    let mut pages = vec![top.join("README.md"), here.join("src/cli/new_project/README.md")];
    below(&top.join("docs"), &mut pages);
    pages
}

/// The arguments of each command line in a page, and whether it is in a code block, where it must be complete.
fn command_lines(page: &str) -> Vec<(String, bool)> {
    let (mut found, mut block) = (Vec::new(), None::<String>);
    for event in Parser::new_ext(page, Options::ENABLE_TABLES) {
        match (event, &mut block) {
            (Event::Start(Tag::CodeBlock(_)), _) => block = Some(String::new()),
            (Event::Text(text), Some(block)) => *block += &text,
            (Event::End(TagEnd::CodeBlock), _) => {
                let text = block.take().unwrap_or_default().replace("\\\n", " ");
                found.extend(text.lines().filter_map(arguments).map(|line| (line, true)));
            }
            (Event::Code(text), None) => found.extend(arguments(&text).map(|line| (line, false))),
            _ => {}
        }
    }
    found
}

fn arguments(line: &str) -> Option<String> {
    let line = line.trim_start().trim_start_matches("$ ");
    CALLS.iter().find_map(|call| line.strip_prefix(call)).map(str::to_owned)
}

/// The words for `dimsart` itself, without optional parts.
fn words(arguments: &str) -> Vec<String> {
    let shown = arguments.split(" [").enumerate().map(|(place, part)| match place {
        0 => part,
        _ => part.split_once(']').map_or(part, |(_, behind)| behind),
    });
    let words = shlex::split(&shown.collect::<String>()).unwrap();
    let is_shell = |word: &String| word.starts_with(['>', '|', '&', '#', ';']);
    words.into_iter().take_while(|word| !is_shell(word)).filter(|word| word != "...").collect()
}

/// The error of a command line, if any.
fn fault((arguments, is_whole): &(String, bool)) -> Option<String> {
    let words = words(arguments);
    // `COMMAND` is a placeholder; a version is part of an image's name.
    if words.first().is_some_and(|word| !word.starts_with(|first: char| first.is_lowercase() || first == '-'))
    {
        return None;
    }
    let error = Arguments::try_parse_from(std::iter::once("dimsart".to_owned()).chain(words)).err()?;
    let is_fine = match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => true,
        // Within a sentence, arguments can be missing or `…`.
        ErrorKind::MissingRequiredArgument
        | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand
        | ErrorKind::InvalidValue
        | ErrorKind::ValueValidation => !is_whole,
        _ => false,
    };
    (!is_fine)
        .then(|| format!("dimsart {arguments}\n  {}", error.to_string().lines().next().unwrap_or_default()))
}

#[test]
fn every_command_line_of_the_documentation_is_understood() {
    let (mut lines, mut faults) = (0, Vec::new());
    for path in pages() {
        let page = fs::read_to_string(&path).unwrap();
        let found = command_lines(&page);
        lines += found.len();
        faults.extend(found.iter().filter_map(fault).map(|fault| format!("{}: {fault}", path.display())));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert!(lines > 100, "only {lines} command lines were found");
}

#[test]
fn an_option_that_is_gone_is_found_wherever_it_stands() {
    let page = "Do `dimsart run [SCENARIO] --gone`, `dimsart check`:\n\n    dimsart check | less\n\n```console\n$ cargo dimsart \
                run my.toml --set a=1 > file # runs\n$ dimsart run --set x \\\n  --lost\n```\n\n| `dimsart went` |\n|---|\n";
    let faults: Vec<String> = command_lines(page).iter().filter_map(fault).collect();
    let found = |part: &str| faults.iter().any(|fault| fault.contains(part));
    assert!(
        faults.len() == 4 && ["--gone", "--lost", "'went'", "check | less"].iter().all(|part| found(part)),
        "{faults:?}"
    );
}
