//! `dimsart bridge`, which takes minutes to build: its lints, and its tests with a router and processes of their own.

use crate::shell::{Outcome, cargo, run};
use crate::steps::Steps;

/// What of `dimsart` is built with Zenoh for it.
const WITH_ZENOH: [&str; 7] =
    ["--quiet", "--package", "dimsart", "--features", "zenoh", "--lib", "--test=bridge"];

/// Builds it and tries it.
pub(crate) fn bridge() -> Outcome {
    Steps::run(|steps| {
        steps.step("build", || run(cargo(&["test", "--no-run"]).args(WITH_ZENOH)))?;
        steps.step("lints", || {
            run(cargo(&["clippy", "--bins"]).args(WITH_ZENOH).args(["--", "--deny", "warnings"]))
        })?;
        steps.step("documentation", || {
            let mut document =
                cargo(&["doc", "--quiet", "--no-deps", "--package", "dimsart", "--features", "zenoh"]);
            run(document.env("RUSTDOCFLAGS", "--deny warnings"))
        })?;
        steps.step("tests", || run(cargo(&["test"]).args(WITH_ZENOH)))
    })
}
