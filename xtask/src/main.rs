//! Development tasks: `cargo xtask test` installs missing tools and runs all tests.

mod bench;
mod boards;
mod book;
mod bridge;
mod budget_file;
mod budgets;
mod chore;
mod console;
mod cycle_table;
mod emulator;
mod example;
mod figures;
mod flash;
mod fuzz;
mod long;
mod markdown;
mod measured;
mod module_costs;
mod oracle;
mod page;
mod panic_free;
mod setup;
mod shell;
mod silicon;
mod stack;
mod steps;
mod table;
mod test;
mod test_programs;
mod toolchain;
mod tutorial;
mod two_engines;
mod wording;

use std::process::ExitCode;

use chore::{Chore, list};

const VERBS: &[Chore] = &[
    Chore::new("quick", "run format, lints, tests of the core and of the two-sided loop", test::quick),
    Chore::new("test", "set up missing tools, build an image of every board, run all tests", test::test),
    Chore::new("ci", "run all checks of a change: `test`, lints, documentation, budgets", test::ci),
    Chore::new("long", "run the nightly checks: tests at full length, all variants, most steps", long::run),
    Chore::with(
        "flash",
        "BOARD[,VARIANT] [master|slave]",
        "build a board's image, flash it through its debug probe and show its log",
        |words| match words {
            [board] => Some(flash::flash(board, "master")),
            [board, side] => Some(flash::flash(board, side)),
            _ => None,
        },
    ),
    Chore::with(
        "silicon",
        "BOARD[,VARIANT] [--emulated] [--port PORT] [--locked-rotor] [...]",
        "flash and check a board; pass more arguments to `dimsart commission`",
        |words| Some(silicon::silicon(words)),
    ),
    Chore::new(
        "bench",
        "count the instructions of a tick and time the simulator (docs/benchmarks.md)",
        bench::run,
    ),
    Chore::new("book", "build docs/ as a book in target/book with mdBook", book::book),
    Chore::one_of("write", "write a generated file, or list all", FILES),
    Chore::one_of("step", "run a single step, or list all", STEPS),
];

/// Generated files in the repository.
const FILES: &[Chore] = &[
    Chore::new(
        "budgets",
        "cycles and stack of the shipped scheme on every board: boards/budgets/",
        budgets::write,
    ),
    Chore::new(
        "figures",
        "memory of the firmware, docs/firmware.md, and its timing for the book",
        figures::run,
    ),
    Chore::new(
        "module-costs",
        "cycles of every kind of module: boards/module-costs.txt",
        module_costs::write,
    ),
];

/// Single steps.
const STEPS: &[Chore] = &[
    Chore::new("bridge", "build `dimsart bridge` (minutes) and test it with a Zenoh router", bridge::bridge),
    Chore::with(
        "cycle-table",
        "BOARD",
        "measure every row of the cycle table on a board (docs/cycles.md)",
        |words| match words {
            [board] => Some(cycle_table::cycle_table(board)),
            _ => None,
        },
    ),
    Chore::with(
        "fuzz",
        "[N]",
        "fuzz every decoder with N inputs (default: 10 million)",
        |words| match words {
            [] => Some(fuzz::fuzz(fuzz::INPUTS)),
            [inputs] => Some(match inputs.parse() {
                Ok(inputs) => fuzz::fuzz(inputs),
                Err(error) => Err(format!("invalid number of inputs '{inputs}': {error}")),
            }),
            _ => None,
        },
    ),
    Chore::new("how-tos", "follow docs/howto/, command by command", tutorial::follow_how_tos),
    Chore::new(
        "oracle",
        "compare modules and plants with outside implementations: a table and a page",
        oracle::report,
    ),
    Chore::new(
        "page",
        "test the page of `dimsart serve` in a browser, with pictures in target/page",
        page::page,
    ),
    Chore::new(
        "panic-free",
        "prove that no tick can panic and that its code is in CCM SRAM",
        panic_free::run,
    ),
    Chore::new("stack", "bound the stack of every image and show the deepest calls", stack::run),
    Chore::new("tutorial", "follow docs/tutorial.md, command by command", tutorial::follow),
    Chore::new(
        "two-engines",
        "run two engines on the emulated board, one interrupting the other",
        two_engines::run,
    ),
    Chore::new("wording", "check spelling and style of documents, messages and comments", wording::hold),
];

fn usage() -> String {
    let [verbs, files, steps] = [VERBS, FILES, STEPS].map(list);
    format!("usage: cargo xtask COMMAND\n\n{verbs}\nnames for `write`:\n{files}\nnames for `step`:\n{steps}")
}

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    if let ["help" | "-h" | "--help", ..] = words.as_slice() {
        print!("{}", usage());
        return ExitCode::SUCCESS;
    }
    match chore::run(VERBS, &words) {
        Some(Ok(())) => ExitCode::SUCCESS,
        Some(Err(message)) => {
            eprintln!("xtask: {message}");
            ExitCode::FAILURE
        }
        None => {
            eprint!("{}", usage());
            ExitCode::from(2)
        }
    }
}
