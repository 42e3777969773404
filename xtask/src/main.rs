//! The repository's own chores: `cargo xtask test` sets up what is missing and passes all tests.

mod bench;
mod boards;
mod book;
mod bridge;
mod budget_file;
mod budgets;
mod console;
mod cycle_table;
mod emulator;
mod example;
mod figures;
mod flash;
mod fuzz;
mod long;
mod markdown;
mod module_costs;
mod module_groups;
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

use std::process::ExitCode;

const USAGE: &str = "\
usage: cargo xtask COMMAND

  quick       format, lints, tests of the core and of the two-sided loop: while one works
  test        set up what is missing, build an image of every board, run all tests
  flash BOARD[,VARIANT] [master|slave]
              build a board's image, flash it through its debug probe and show its log
  cycle-table BOARD
              run the image that measures every row of the cycle table on a board (docs/cycles.md)
  silicon BOARD[,VARIANT] [--emulated] [--port PORT] [--locked-rotor] [...]
              flash a board, check all of it that can be checked, and write a report to runs/silicon/BOARD; further
              arguments are those of `dimsart commission`
  two-engines run a planner below a joint's interrupt on the emulated board, and check what crosses between them
  budgets     what the shipped scheme takes on every board, of cycles and stack, into boards/budgets/
  oracle      compare every module and plant with outside implementations: a table, and a page with the curves
  figures     memory and time of the firmware (docs/firmware.md)
  module-groups the section of docs/firmware.md on what each group of modules takes; takes half an hour
  module-costs what each kind of module costs, into boards/module-costs.txt
  bench       count the instructions of a tick, hold them to their budgets, and time the shipped scenario
              (docs/benchmarks.md)
  page        try the page of `dimsart serve` in a browser; its pictures go to target/page
  book        build the book of docs/, with a page per module, board and fault, to target/book; sets up mdBook first
  tutorial    follow docs/tutorial.md, command by command
  how-tos     the same with docs/howto/; takes seconds
  bridge      build `dimsart bridge`, which takes minutes, and try it with a Zenoh router
  fuzz [N]    give every decoder N inputs, 10 million unless told otherwise
  long        for the night: tests that ci runs short, at their full length; the images, lints, documentation and tests of all
              variants, the tutorial, the page in a browser, the cycle table and two engines, which ci leaves out;
              then fuzz 1000000000
  panic-free  show that nothing a tick reaches in the images' machine code can panic, and that it is in CCM SRAM
  stack       bound the stack of every image by its machine code, with the deepest calls of every priority
  ci          for every change: format, lints and documentation with warnings denied, then test, panic-free
              and the counts of bench
";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let result = match arguments.as_slice() {
        ["quick"] => test::quick(),
        ["test"] => test::test(),
        ["flash", board] => flash::flash(board, "master"),
        ["flash", board, side] => flash::flash(board, side),
        ["cycle-table", board] => cycle_table::cycle_table(board),
        ["silicon", words @ ..] => silicon::silicon(words),
        ["two-engines"] => two_engines::run(),
        ["budgets"] => budgets::write(),
        ["figures"] => figures::run(),
        ["module-groups"] => module_groups::write(),
        ["module-costs"] => module_costs::write(),
        ["bench"] => bench::run(),
        ["fuzz"] => fuzz::fuzz(fuzz::INPUTS),
        ["fuzz", inputs] => match inputs.parse() {
            Ok(inputs) => fuzz::fuzz(inputs),
            Err(error) => Err(format!("'{inputs}' is no number of inputs: {error}")),
        },
        ["book"] => book::book(),
        ["tutorial"] => tutorial::follow(),
        ["how-tos"] => tutorial::follow_how_tos(),
        ["bridge"] => bridge::bridge(),
        ["page"] => page::page(),
        ["oracle"] => oracle::report(),
        ["long"] => long::run(),
        ["panic-free"] => panic_free::run(),
        ["stack"] => stack::run(),
        ["ci"] => test::ci(),
        ["help" | "-h" | "--help", ..] => {
            print!("{USAGE}");
            return ExitCode::SUCCESS;
        }
        _ => {
            eprint!("{USAGE}");
            return ExitCode::from(2);
        }
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("xtask: {message}");
            ExitCode::FAILURE
        }
    }
}
