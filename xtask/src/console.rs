//! Runs the commands of documentation pages.
//!
//! In a block marked `console`, a line that starts with `$ ` is a command. The lines after it must occur in
//! its output in this order, among others; `...` and spaces between words match anything. Every command must
//! succeed; in a block marked `console fails`, every command must fail. A command that ends in ` &` runs in
//! the background; the next one starts when it has printed as many lines as are shown. A block marked `diff`
//! is applied as a patch; a block marked with a language and a file name creates that file.

use std::fmt::Write;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};

use crate::markdown::blocks;

/// Marks the start of a step's output.
const MARK: char = '\u{1e}';

/// A command or a change of files, with its expected output.
#[derive(Debug, PartialEq, Eq)]
struct Step {
    command: String,
    shown: Vec<String>,
    fails: bool,
}

/// Returns the steps of a page in order.
fn steps(page: &str) -> Vec<Step> {
    let mut steps = Vec::new();
    for block in blocks(page) {
        let text = &block.text;
        let fails = match block.info.split_once(' ').unwrap_or((&block.info, "")) {
            ("console", mark) => mark == "fails",
            ("diff", _) => {
                steps.push(Step::silent(format!("git apply -p0 <<'END'\n{text}END")));
                continue;
            }
            (_, "") => continue,
            (_, file) => {
                steps.push(Step::silent(format!("cat > {file} <<'END'\n{text}END")));
                continue;
            }
        };
        for line in text.lines() {
            if let Some(command) = line.strip_prefix("$ ") {
                steps.push(Step { command: command.to_owned(), shown: Vec::new(), fails });
            } else if let Some(step) = steps.last_mut() {
                step.shown.push(line.to_owned());
            }
        }
    }
    steps
}

impl Step {
    /// Creates a step without output.
    fn silent(command: String) -> Self {
        Self { command, shown: Vec::new(), fails: false }
    }

    /// Returns the step's part of the script.
    fn script(&self) -> String {
        let Self { command, fails, .. } = self;
        match command.strip_suffix(" &") {
            // The command is ready when it has printed the shown lines.
            Some(command) => format!(
                "said=$(mktemp)\n{command} > \"$said\" 2>&1 &\n\
                 until [ $(wc -l < \"$said\") -ge {lines} ]; do kill -0 $!; sleep 0.1; done\n\
                 cat \"$said\"; rm \"$said\"\n",
                lines = self.shown.len().max(1)
            ),
            None if *fails => format!("if {command}\nthen echo 'expected to fail'; exit 1; fi\n"),
            None => format!("{command}\n"),
        }
    }

    /// Returns the first expected line that is missing from the output.
    fn missing<'a>(&'a self, printed: &[String]) -> Option<&'a str> {
        let mut printed = printed.iter();
        self.shown.iter().find(|shown| !printed.any(|line| matches(shown, line))).map(String::as_str)
    }
}

/// Returns whether a line matches the shown one.
fn matches(shown: &str, line: &str) -> bool {
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let (shown, line) = (words(shown), words(line));
    let mut parts = shown.split("...");
    let Some(mut rest) = parts.next().and_then(|first| line.strip_prefix(first)) else { return false };
    let parts: Vec<&str> = parts.collect();
    let Some((last, between)) = parts.split_last() else { return rest.is_empty() };
    for part in between {
        let Some((_, after)) = rest.split_once(part) else { return false };
        rest = after;
    }
    rest.ends_with(last)
}

/// Runs the commands of a page in a folder with these environment variables.
///
/// # Errors
/// The first command with a wrong exit status or output, with its full output.
pub(crate) fn follow(page: &str, folder: &Path, environment: &[(&str, &Path)]) -> Result<(), String> {
    let steps = steps(page);
    let mut script =
        "set -e\nexec 2>&1\ntrap 'kill $(jobs -p) 2> /dev/null || :' EXIT\nexport COLUMNS=120\n".to_owned();
    for step in &steps {
        let _ = writeln!(script, "printf '{MARK}\\n'");
        script += &step.script();
    }
    let mut shell = Command::new("bash");
    shell.args(["-c", &script]).current_dir(folder).stdin(Stdio::null()).stdout(Stdio::piped());
    // Makes `git apply` patch files of this folder, in any repository.
    shell.envs(environment.iter().copied()).env("GIT_CEILING_DIRECTORIES", folder);
    let unusable = |error: std::io::Error| format!("cannot run bash: {error}; install bash");
    let mut child = shell.spawn().map_err(unusable)?;
    let mut printed: Vec<Vec<String>> = Vec::new();
    for line in BufReader::new(child.stdout.take().into_iter().next().ok_or("bash has no output")?).lines() {
        let line = line.map_err(unusable)?;
        if line.starts_with(MARK) {
            let step = steps.get(printed.len());
            println!("  $ {}", step.map_or("", |step| step.command.lines().next().unwrap_or_default()));
            printed.push(Vec::new());
        } else if let Some(lines) = printed.last_mut() {
            lines.push(line);
        }
    }
    let status = child.wait().map_err(unusable)?;
    let wrong = |step: &Step, printed: &[String], what: &str| {
        format!("`{}` {what}. It printed:\n{}", step.command, printed.join("\n"))
    };
    for (step, printed) in steps.iter().zip(&printed) {
        if let Some(missing) = step.missing(printed).filter(|_| status.success()) {
            return Err(wrong(
                step,
                printed,
                &format!("did not print, after the lines before it,\n{missing}\n"),
            ));
        }
    }
    match (status.success(), printed.last(), printed.len().checked_sub(1).and_then(|last| steps.get(last))) {
        (true, ..) => Ok(()),
        (false, Some(printed), Some(step)) => Err(wrong(step, printed, &format!("ended with {status}"))),
        _ => Err(format!("bash ended with {status}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn result(page: &str) -> Result<(), String> {
        let folder = tempfile::tempdir().unwrap();
        follow(page, folder.path(), &[])
    }

    #[test]
    fn commands_share_folder_variables_and_files() {
        let page = "\
```console
$ mkdir here && cd here && printf 'one\\ntwo\\n' > file
$ x=3; pwd
.../here
```
```diff
--- file
+++ file
@@ -1,2 +1,2 @@
 one
-two
+three
```
```text other
five
```
```console
$ cat file; echo \"$x  is it\"
three
$ cat other
five
$ (echo ready; sleep 0.3; echo steady; exec sleep 60) &
ready
steady
$ kill %1
```
```console fails
$ ls nothing
ls: ...'nothing'...
```
```sh
false
```
";
        assert_eq!(result(page), Ok(()));
    }

    #[test]
    fn a_command_that_fails_or_prints_something_else_is_told_with_what_it_printed() {
        let error = |block: &str| result(&format!("```{block}\n```\n")).unwrap_err();
        let message = error("console\n$ echo so; false\n$ echo never");
        assert!(
            message.starts_with("`echo so; false` ended with") && message.ends_with(":\nso"),
            "{message}"
        );
        let message = error("console\n$ printf 'b\\na\\n'\na\nb");
        assert!(
            message.contains("did not print") && message.contains("\nb\n. It printed:\nb\na"),
            "{message}"
        );
        assert!(error("console fails\n$ true").contains("expected to fail"));
        assert!(error("console\n$ false &").contains("ended with"));
        assert!(error("diff\n--- no\n+++ no\n@@ -1 +1 @@\n-a\n+b").contains("git apply"));
    }

    #[test]
    fn dots_stand_for_anything() {
        for (shown, line) in [("...", ""), ("a ... c", "a  b c"), ("... 3 s", "took 3 s"), ("a...", "abc")] {
            assert!(matches(shown, line), "{shown}: {line}");
        }
        for (shown, line) in [("a", "ab"), ("a ... c", "a b d"), ("...b...d", "abc"), ("", "a")] {
            assert!(!matches(shown, line), "{shown}: {line}");
        }
    }
}
