//! One thing that is checked, and what came of it.

use std::fmt;

use serde::{Deserialize, Serialize};

/// What came of a check.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// As expected.
    Passed,
    /// Not as expected.
    Failed,
    /// Nothing is known.
    NotRun,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Passed => "passed",
            Self::Failed => "FAILED",
            Self::NotRun => "not run",
        })
    }
}

/// One thing that was checked.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Check {
    /// What it is about.
    pub name: String,
    /// What came of it.
    pub verdict: Verdict,
    /// What was found, with its figure; why the check was not run.
    pub found: String,
    /// What it should be; empty where it was not run.
    pub expected: String,
    /// What to do next; empty unless it failed.
    pub next_step: String,
}

impl Check {
    /// A check that was run; `next_step` counts where it is not as expected.
    #[must_use]
    pub fn new(
        name: &str,
        is_well: bool,
        found: impl Into<String>,
        expected: impl Into<String>,
        next_step: &str,
    ) -> Self {
        Self {
            name: name.to_owned(),
            verdict: if is_well { Verdict::Passed } else { Verdict::Failed },
            found: found.into(),
            expected: expected.into(),
            next_step: if is_well { String::new() } else { next_step.to_owned() },
        }
    }

    /// A check that was not run, and why.
    #[must_use]
    pub fn not_run(name: &str, why: impl Into<String>) -> Self {
        Self {
            name: name.to_owned(),
            verdict: Verdict::NotRun,
            found: why.into(),
            expected: String::new(),
            next_step: String::new(),
        }
    }
}

impl fmt::Display for Check {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, verdict, found, expected, next_step } = self;
        write!(f, "{verdict:<8} {name}: {found}")?;
        if *verdict == Verdict::Failed {
            write!(f, "; expected: {expected}; next: {next_step}")?;
        }
        Ok(())
    }
}
