//! A check and its result.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Result of a check.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// As expected.
    Passed,
    /// Not as expected.
    Failed,
    /// Not run.
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

/// A check.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Check {
    /// Name.
    pub name: String,
    /// Result.
    pub verdict: Verdict,
    /// Finding with its value, or why the check was not run.
    pub found: String,
    /// Expected finding; empty if the check was not run.
    pub expected: String,
    /// Next step; empty unless the check failed.
    pub remedy: String,
}

impl Check {
    /// Returns a completed check; `remedy` applies if it failed.
    #[must_use]
    pub fn new(
        name: &str,
        is_well: bool,
        found: impl Into<String>,
        expected: impl Into<String>,
        remedy: &str,
    ) -> Self {
        Self {
            name: name.to_owned(),
            verdict: if is_well { Verdict::Passed } else { Verdict::Failed },
            found: found.into(),
            expected: expected.into(),
            remedy: if is_well { String::new() } else { remedy.to_owned() },
        }
    }

    /// Returns a check that was not run, with the reason.
    #[must_use]
    pub fn not_run(name: &str, why: impl Into<String>) -> Self {
        Self {
            name: name.to_owned(),
            verdict: Verdict::NotRun,
            found: why.into(),
            expected: String::new(),
            remedy: String::new(),
        }
    }
}

impl fmt::Display for Check {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, verdict, found, expected, remedy } = self;
        write!(f, "{verdict:<8} {name}: {found}")?;
        if *verdict == Verdict::Failed {
            write!(f, "; expected: {expected}; next: {remedy}")?;
        }
        Ok(())
    }
}
