//! `cargo xtask long`: runs tests at full length that continuous integration shortens or omits.

use std::fs::File;
use std::io::{IsTerminal, Write};
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::boards::{Image, Images};
use crate::shell::{EMULATOR, Outcome, cargo, target};
use crate::steps::Steps;
use crate::toolchain::Toolchain;
use crate::{
    boards, cycle_table, fuzz, module_costs, page, panic_free, setup, stack, test, tutorial, two_engines,
};

/// Variables that select the full length, here and in the emulator's workspace.
const VARIABLES: [&str; 2] = ["DIMSART_LONG", "LONG_TESTS"];
const A_MOMENT: Duration = Duration::from_secs(1);

/// Inputs of each decoder, and the hours they take.
const INPUTS: u64 = 1_000_000_000;
const HOURS: u64 = 8;

/// Tests that read one of [`VARIABLES`].
struct Run {
    what: &'static str,
    /// Approximate time on two cores.
    minutes: u64,
    /// Cargo manifest of the workspace.
    workspace: &'static str,
    package: &'static str,
    /// File in the package's `tests`, and the prefix of the tests' names.
    test: [&'static str; 2],
}

/// All long runs.
const RUNS: &[Run] = &[
    Run::new(
        11,
        "10^7 bytes of noise through the emulated UART, a cut frame and a flood, then a command; 5000 ticks a period apart",
        "dimsart",
        ["emulated", "timer_tick::"],
    ),
    Run::new(
        3,
        "10^5 ticks of both sides on emulated boards, with every module, bit by bit",
        "dimsart",
        ["emulated", "same_bits::"],
    ),
    Run::new(3, "10^4 random transactions on an emulated board", "dimsart", ["emulated", "transactions::"]),
    Run {
        workspace: EMULATOR,
        ..Run::new(
            2,
            "10^7 random instructions in the emulated processor and in QEMU, register by register",
            "dimsart-cycles",
            ["qemu", "random_instructions"],
        )
    },
    Run::new(
        2,
        "10^4 ticks of every board in its emulated chip",
        "dimsart",
        ["chip", "boot::boards_tick_by_the_rules"],
    ),
    Run::new(
        10,
        "10^6 ticks with random inputs in the emulated processor, of both sides, against their bounds",
        "dimsart",
        ["cycles", "bounds::the_whole_of_table_1"],
    ),
    Run::new(
        5,
        "10^6 ticks with random inputs and parameters of every kind of module, against its bound",
        "dimsart",
        ["cycles", "kinds::every_kind_of_module"],
    ),
    Run::new(
        60,
        "10^6 scenarios of faults and operators in both sides, every tick checked against every policy",
        "hil-sim",
        ["policies", "every_policy"],
    ),
    Run::new(
        1,
        "intervals of identified joints: 8 kinds of recordings, 40 seeds each",
        "hil-sim",
        ["identify_coverage", "the_truth"],
    ),
    Run::new(
        4,
        "a day of the shipped experiment, over a line with loss and jitter, by two clocks",
        "dimsart-tests",
        ["soak", "a_day"],
    ),
    Run::core_faults(
        2,
        "2 x 10^8 damaged frames, every 4 wrong bits, 2 x 10^7 bursts; the same with a CRC of 16 bits",
        "faults::bit_errors::",
    ),
    Run::core_faults(1, "10^8 random classic CAN frames", "faults::classic_can::"),
    Run::core_faults(1, "3 x 10^6 duplicate, late and reordered packets", "faults::order::"),
    Run::core_faults(1, "10^6 frames over a UART that drops and inserts bytes", "faults::stream::"),
    Run::core_faults(2, "10^7 forged tags of 64 bits, 10^8 of 24, 2 x 10^6 replays", "faults::forgery::"),
    Run::core_faults(1, "an hour with clocks 1000 ppm apart", "faults::clocks::"),
    Run::loop_faults(
        2,
        "280 minutes of random losses in the two-sided loop, and every burst of 1 to 1000",
        "loss::",
    ),
    Run::loop_faults(1, "100 links that drop out and return, 400 CAN buses with bus-off nodes", "bus_off::"),
];

impl Run {
    const fn new(minutes: u64, what: &'static str, package: &'static str, test: [&'static str; 2]) -> Self {
        Self { what, minutes, workspace: "Cargo.toml", package, test }
    }

    /// A run of the core's tests.
    const fn core_faults(minutes: u64, what: &'static str, module: &'static str) -> Self {
        Self::new(minutes, what, "dimsart-core", ["behaviour", module])
    }

    /// A run of the root package's `tests/faults`.
    const fn loop_faults(minutes: u64, what: &'static str, module: &'static str) -> Self {
        Self::new(minutes, what, "dimsart-tests", ["faults", module])
    }
}

/// Runs all of them in sequence, even after failures, and prints the expected and actual times.
pub(crate) fn run() -> Outcome {
    Steps::run(|steps| {
        let toolchain = steps.step("tools", || {
            setup::emulator()?;
            Toolchain::set_up()
        })?;
        let images = steps.step("images", || boards::build_for_tests(toolchain, Images::All))?;
        steps.step("stamps of every variant", || images.iter().try_for_each(Image::stamp))?;
        let minutes: u64 = RUNS.iter().map(|run| run.minutes).sum();
        let count = RUNS.len();
        println!("{count} long runs, about {minutes} min on two cores, then fuzzing, about {HOURS} h");
        let mut outcomes: Vec<Outcome> =
            RUNS.iter().map(|run| steps.step(run.what, || run_one(run))).collect();
        outcomes.extend([
            steps.step("tests of every image", tests_of_images),
            steps.step("lints of every image", || boards::lint(toolchain, Images::All)),
            steps.step("lints of the simulator alone", test::lint_simulator),
            steps.step("documentation of every board", || boards::document(toolchain, Images::All)),
            steps.step("stack of every image", || stack::hold(&images, &stack::bounds(&images)?)),
            steps.step("no panic in a tick of any image", || panic_free::hold(&images)),
            steps.step("stack frames against the compiler", || stack::cross_check(toolchain)),
            steps.step("chips against the flashing tool", || {
                let test =
                    ["test", "--quiet", "--package", "boards", "--features", "probe-rs", "--test", "chips"];
                crate::shell::run(&mut cargo(&test))
            }),
            steps.step("cycle table, emulated", || cycle_table::cycle_table("mps2-an386")),
            steps.step("two engines, emulated", two_engines::run),
            steps.step("the tutorial", tutorial::follow),
            // In real time, without other load.
            steps.step("the page in a browser", page::page),
            steps.step("costs of the other modules", || module_costs::hold_others(toolchain)),
            steps.step("fuzzing", || fuzz::fuzz(INPUTS)),
        ]);
        let failed: Vec<String> = outcomes.into_iter().filter_map(Result::err).collect();
        if failed.is_empty() { Ok(()) } else { Err(failed.join("\n")) }
    })
}

fn run_one(run: &Run) -> Outcome {
    let [file, name] = run.test;
    println!("about {} min", run.minutes);
    let what = ["--release", "--manifest-path", run.workspace, "--package", run.package, "--test", file];
    complete(&what, &["--", name], Some(run.minutes))
}

/// Runs tests that need images not built by `cargo xtask test`, at their short length.
fn tests_of_images() -> Outcome {
    let files = ["--test", "chip", "--test", "cycles", "--test", "emulated", "--test", "check"];
    // Of the whole workspace, like `cargo xtask test`, to reuse its build.
    complete(&[&["--workspace"], &files[..]].concat(), &[], None)
}

/// Runs tests, at full length if the minutes are given; fails if one is skipped.
fn complete(what: &[&str], names: &[&str], minutes: Option<u64>) -> Outcome {
    let arguments = [&["test", "--quiet"], what].concat();
    let test = || {
        let mut test = cargo(&arguments);
        test.env("CARGO_TARGET_DIR", target());
        test
    };
    crate::shell::run(test().arg("--no-run"))?;
    let mut tests = test();
    tests.args(names).env("DIMSART_FIRMWARE", crate::shell::image_folder());
    if minutes.is_some() {
        tests.envs(VARIABLES.map(|variable| (variable, "1")));
    }
    let (succeeds, said) = wait_for(&mut tests, minutes)?;
    let is_skipped = |line: &str| line.starts_with("skipped:");
    // A filter that matches no test is a failure.
    if succeeds && !said.contains("ok. 0 passed") && !said.lines().any(is_skipped) {
        return Ok(());
    }
    println!("{said}");
    Err("failed".to_owned())
}

/// Runs a command; returns whether it succeeds and its output, and shows the elapsed time.
fn wait_for(command: &mut Command, minutes: Option<u64>) -> Result<(bool, String), String> {
    let file = target().join("long.log");
    let failed = |error: std::io::Error| format!("{}: {error}", file.display());
    let log = File::create(&file).map_err(failed)?;
    let errors = log.try_clone().map_err(failed)?;
    let start = Instant::now();
    let child = command.stdin(Stdio::null()).stdout(log).stderr(errors).spawn();
    let mut child = child.map_err(|error| format!("cannot start cargo: {error}"))?;
    let is_shown = std::io::stdout().is_terminal();
    let status = loop {
        match child.try_wait() {
            Ok(Some(status)) => break status,
            Ok(None) => sleep(A_MOMENT),
            Err(error) => return Err(format!("cannot wait for cargo: {error}")),
        }
        if let (true, Some(minutes)) = (is_shown, minutes) {
            print!("\r  {} of about {} s ", start.elapsed().as_secs(), 60 * minutes);
            let _ = std::io::stdout().flush();
        }
    };
    println!("\r  ended after {} s", start.elapsed().as_secs());
    let said = std::fs::read(&file).map_err(failed)?;
    Ok((status.success(), String::from_utf8_lossy(&said).into_owned()))
}
