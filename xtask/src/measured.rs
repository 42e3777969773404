//! Measured figures: a summary in `docs/`, and details that only the book contains.

use std::fs;
use std::path::PathBuf;

use crate::shell::{Outcome, target, top};

/// Commands that measure, and the pages that they write.
pub(crate) const PAGES: [(&str, &str); 2] = [("write figures", "firmware"), ("bench", "benchmarks")];

/// Writes `docs/NAME.md`, and the details for the book to the target folder.
pub(crate) fn write(name: &str, summary: &str, details: &str) -> Outcome {
    for (file, text) in [(top().join(format!("docs/{name}.md")), summary), (details_file(name), details)] {
        let written = file.parent().map_or(Ok(()), fs::create_dir_all).and_then(|()| fs::write(&file, text));
        written.map_err(|error| format!("cannot write {}: {error}", file.display()))?;
    }
    Ok(())
}

/// Returns the details of a page if they were measured here.
pub(crate) fn details(name: &str) -> Option<String> {
    fs::read_to_string(details_file(name)).ok()
}

fn details_file(name: &str) -> PathBuf {
    target().join("measured").join(format!("{name}.md"))
}
