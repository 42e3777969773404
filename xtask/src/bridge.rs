//! Lints and tests of `dimsart bridge`, which takes minutes to build, with a router and separate processes.

use crate::shell::{Outcome, cargo, run};
use crate::steps::Steps;

/// Arguments that build `dimsart` with Zenoh.
const WITH_ZENOH: [&str; 7] =
    ["--quiet", "--package", "dimsart", "--features", "zenoh", "--lib", "--test=bridge"];

/// Builds and tests it.
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
