//! The tiers of tests: `quick` during development, `test` for all tests, `ci` for every change, `long` for
//! the night.

use crate::boards::{Image, Images};
use crate::shell::{EMULATOR, Outcome, cargo, cargo_emulator, run};
use crate::steps::Steps;
use crate::toolchain::Toolchain;
use crate::{
    bench, boards, budgets, module_costs, oracle, panic_free, setup, stack, test_programs, tutorial, wording,
};

/// Format, lints of the host, tests of the core and of the two-sided loop.
pub(crate) fn quick() -> Outcome {
    Steps::run(|steps| {
        steps.step("format", format)?;
        steps.step("wording", wording::hold)?;
        steps.step("lints", lint)?;
        steps.step("tests of the core", || {
            run(&mut cargo(&["test", "--quiet", "--package", "dimsart-core"]))
        })?;
        steps
            .step("tests of the loop", || run(&mut cargo(&["test", "--quiet", "--package", "dimsart-tests"])))
    })
}

/// Installs missing tools, builds every board's image and runs every test.
pub(crate) fn test() -> Outcome {
    Steps::run(|steps| {
        let toolchain = tools(steps)?;
        let host = || {
            python(steps)?;
            build(steps)
        };
        let images = Steps::both(|| images(steps, toolchain), host)?;
        hold(steps, toolchain, &images)?;
        tests(steps)
    })
}

/// The checks of continuous integration.
pub(crate) fn ci() -> Outcome {
    Steps::run(|steps| {
        steps.step("format", format)?;
        let toolchain = tools(steps)?;
        // Linking images takes one core; host code is built in another folder meanwhile.
        let images = Steps::both(
            || {
                let images = images(steps, toolchain)?;
                steps.step("lints of the boards", || boards::lint(toolchain, Images::Few))?;
                steps.step("documentation of a board", || boards::document(toolchain, Images::Few))?;
                Ok(images)
            },
            || {
                python(steps)?;
                steps.step("wording", wording::hold)?;
                steps.step("lints", lint)?;
                steps.step("documentation", document)?;
                build(steps)
            },
        )?;
        hold(steps, toolchain, &images)?;
        // Counts do not depend on load: tests can run at the same time.
        Steps::both(
            || {
                steps.step("no panic in a tick", || panic_free::hold(&images))?;
                steps.step("instructions of a tick", bench::hold)
            },
            || tests(steps),
        )
    })
}

fn tools(steps: &Steps) -> Result<Toolchain, String> {
    steps.step("tools", || {
        setup::emulator()?;
        Toolchain::set_up()
    })
}

fn python(steps: &Steps) -> Outcome {
    steps.step("Python packages", || setup::python().map(drop))
}

fn format() -> Outcome {
    run(&mut cargo(&["fmt", "--all", "--check"]))?;
    for workspace in [EMULATOR, "fuzz/Cargo.toml"] {
        run(&mut cargo(&["fmt", "--all", "--manifest-path", workspace, "--check"]))?;
    }
    boards::check_format()
}

fn lint() -> Outcome {
    for mut clippy in [cargo(&["clippy", "--workspace"]), cargo_emulator("clippy")] {
        run(clippy.args(["--all-targets", "--quiet", "--", "--deny", "warnings"]))?;
    }
    Ok(())
}

/// Lints the simulator without emulated boards, as used by tests of control laws.
pub(crate) fn lint_simulator() -> Outcome {
    run(&mut cargo(&["clippy", "--package", "hil-sim", "--quiet", "--", "--deny", "warnings"]))
}

fn document() -> Outcome {
    for mut document in [cargo(&["doc", "--workspace"]), cargo_emulator("doc")] {
        run(document.args(["--no-deps", "--quiet"]).env("RUSTDOCFLAGS", "--deny warnings"))?;
    }
    Ok(())
}

fn images(steps: &Steps, toolchain: Toolchain) -> Result<Vec<Image>, String> {
    steps.step("images", || boards::build_for_tests(toolchain, Images::Few))
}

fn build(steps: &Steps) -> Outcome {
    steps.step("build of the tests", || test_programs::builds().iter_mut().try_for_each(run))
}

/// Checks the images against their budgets and prepares the tests' requirements.
fn hold(steps: &Steps, toolchain: Toolchain, images: &[Image]) -> Outcome {
    steps.step("size of the images", || boards::hold(images))?;
    steps.step("stack of the images", || stack::hold(images, &stack::bounds(images)?))?;
    // Each of these uses one core.
    Steps::both(
        || {
            steps.step("stamp and costs of the modules", || module_costs::hold_plain(toolchain))?;
            steps.step("budgets of a tick", || budgets::hold(toolchain))
        },
        || {
            steps.step("reference runs", oracle::references)?;
            steps.step("the how-to pages", tutorial::follow_how_tos)
        },
    )
}

fn tests(steps: &Steps) -> Outcome {
    steps.step("tests", || {
        test_programs::run_all(&[
            ("DIMSART_ORACLE", oracle::folder().into()),
            ("DIMSART_FIRMWARE", crate::shell::image_folder().into()),
            ("REQUIRE_QEMU", "1".into()),
        ])
    })
}
