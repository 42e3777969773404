//! All tests, with everything they need.

use crate::shell::{Outcome, cargo, command, run, top};
use crate::toolchain::Toolchain;
use crate::{bench, boards, budgets, cycle_table, fuzz, panic_free, setup, stack};

/// Sets up what is missing, builds every board's image and runs every test.
pub(crate) fn test() -> Outcome {
    let python = setup::python()?;
    setup::emulator()?;
    let toolchain = Toolchain::set_up()?;
    let images = boards::build_all(toolchain)?;
    boards::hold(&images)?;
    stack::hold(&images, &stack::bounds(&images)?)?;
    budgets::hold(toolchain)?;
    cycle_table::cycle_table("mps2-an386")?;
    let oracle = top().join("target/oracle");
    let script = ["-B", "tests/oracle/two_sided_loop.py", "--out"];
    run(command(python, script).arg(&oracle))?;
    run(cargo(&["test", "--workspace"])
        .env("DIMSART_ORACLE", &oracle)
        .env("DIMSART_FIRMWARE", boards::folder()))
}

/// What continuous integration runs.
pub(crate) fn ci() -> Outcome {
    let toolchain = Toolchain::set_up()?;
    run(&mut cargo(&["fmt", "--all", "--check"]))?;
    run(&mut cargo(&["fmt", "--manifest-path", "fuzz/Cargo.toml", "--check"]))?;
    boards::check_format()?;
    run(&mut cargo(&["clippy", "--workspace", "--all-targets", "--quiet", "--", "--deny", "warnings"]))?;
    boards::lint(toolchain)?;
    run(cargo(&["doc", "--workspace", "--no-deps", "--quiet"]).env("RUSTDOCFLAGS", "--deny warnings"))?;
    boards::document(toolchain)?;
    test()?;
    fuzz::fuzz(fuzz::INPUTS)?;
    panic_free::run()?;
    stack::cross_check(toolchain)?;
    bench::run()
}
