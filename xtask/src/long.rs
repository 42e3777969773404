//! `cargo xtask long`: tests that continuous integration runs short, at their full length, and what it leaves out.

use std::io::{IsTerminal, Write};
use std::process::Stdio;
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::shell::{Outcome, cargo};
use crate::steps::Steps;
use crate::toolchain::Toolchain;
use crate::{boards, fuzz, module_costs, setup, stack};

/// Tells a test to run at its full length.
const VARIABLE: &str = "DIMSART_LONG";
const A_MOMENT: Duration = Duration::from_secs(1);

/// Inputs of each decoder, and the hours they take.
const INPUTS: u64 = 1_000_000_000;
const HOURS: u64 = 8;

/// Tests that read [`VARIABLE`].
struct Run {
    what: &'static str,
    /// On two cores, about.
    minutes: u64,
    package: &'static str,
    /// File in the package's `tests`, and how the names of the tests in it begin.
    test: [&'static str; 2],
}

/// Every long run of tests.
const RUNS: &[Run] = &[
    Run {
        what: "10^7 bytes of noise through the emulated UART, a cut frame and a flood, then a command",
        minutes: 10,
        package: "dimsart",
        test: ["emulated", "timer_tick::noise_a_cut_frame_and_a_flood_are_survived"],
    },
    Run {
        what: "10^6 ticks with random inputs in the emulated processor, of both sides, against their bounds",
        minutes: 10,
        package: "dimsart",
        test: ["cycles", "bounds::the_whole_of_table_1"],
    },
    Run {
        what: "10^6 ticks with random inputs and parameters of every kind of module, against its bound",
        minutes: 5,
        package: "dimsart",
        test: ["cycles", "kinds::every_kind_of_module"],
    },
    Run {
        what: "10^6 scenarios of faults and operators in both sides, every tick against every policy",
        minutes: 60,
        package: "hil-sim",
        test: ["policies", "every_policy"],
    },
    Run {
        what: "a day of the shipped experiment, over a line with loss and jitter, by two clocks",
        minutes: 4,
        package: "dimsart-tests",
        test: ["soak", "a_day"],
    },
    Run::core_faults(
        2,
        "2 x 10^8 damaged frames, every 4 wrong bits, 2 x 10^7 bursts; the same with a CRC of 16 bits",
        "faults::bit_errors::",
    ),
    Run::core_faults(1, "10^8 random classic CAN frames", "faults::classic_can::"),
    Run::core_faults(1, "3 x 10^6 packets that come twice, late and in any order", "faults::order::"),
    Run::core_faults(1, "10^6 frames over a UART that drops and inserts bytes", "faults::stream::"),
    Run::core_faults(2, "10^7 forged tags of 64 bits, 10^8 of 24, 2 x 10^6 repetitions", "faults::forgery::"),
    Run::core_faults(1, "an hour with clocks 1000 ppm apart", "faults::clocks::"),
    Run::loop_faults(
        2,
        "280 minutes of random losses in the two-sided loop, and every burst of 1 to 1000",
        "loss::",
    ),
    Run::loop_faults(1, "100 links that go and come, 400 CAN buses that send their nodes away", "bus_off::"),
];

impl Run {
    /// Of the core's tests.
    const fn core_faults(minutes: u64, what: &'static str, module: &'static str) -> Self {
        Self { what, minutes, package: "dimsart-core", test: ["behaviour", module] }
    }

    /// Of the root package's `tests/faults`.
    const fn loop_faults(minutes: u64, what: &'static str, module: &'static str) -> Self {
        Self { what, minutes, package: "dimsart-tests", test: ["faults", module] }
    }
}

/// Runs all of them, one after the other, whatever fails: each says how long it takes, and has taken.
pub(crate) fn run() -> Outcome {
    Steps::run(|steps| {
        let toolchain = steps.step("tools", || {
            setup::emulator()?;
            Toolchain::set_up()
        })?;
        let images = steps.step("images", || boards::build_all(toolchain))?;
        steps.step("stamps of every variant", || images.iter().try_for_each(boards::Image::stamp))?;
        let minutes: u64 = RUNS.iter().map(|run| run.minutes).sum();
        let count = RUNS.len();
        println!("{count} long runs, about {minutes} min on two cores, then fuzzing, about {HOURS} h");
        let mut outcomes: Vec<Outcome> =
            RUNS.iter().map(|run| steps.step(run.what, || run_one(run))).collect();
        outcomes.push(
            steps.step("frames on the stack as the compiler has them", || stack::cross_check(toolchain)),
        );
        outcomes.push(steps.step("costs of the other modules", || module_costs::hold_others(toolchain)));
        outcomes.push(steps.step("fuzzing", || fuzz::fuzz(INPUTS)));
        let failed: Vec<String> = outcomes.into_iter().filter_map(Result::err).collect();
        if failed.is_empty() { Ok(()) } else { Err(failed.join("\n")) }
    })
}

fn run_one(run: &Run) -> Outcome {
    let [file, name] = run.test;
    let test = ["test", "--release", "--quiet", "--package", run.package, "--test", file];
    let mut build = cargo(&test);
    crate::shell::run(build.arg("--no-run"))?;
    let mut test = cargo(&test);
    test.args(["--", name]).env(VARIABLE, "1").env("DIMSART_FIRMWARE", boards::folder());
    println!("about {} min", run.minutes);
    let start = Instant::now();
    let child = test.stdin(Stdio::null()).stdout(Stdio::piped()).spawn();
    let mut child = child.map_err(|error| format!("cargo could not be started: {error}"))?;
    let is_shown = std::io::stdout().is_terminal();
    while child.try_wait().is_ok_and(|status| status.is_none()) {
        if is_shown {
            print!("\r  {} of about {} s ", start.elapsed().as_secs(), 60 * run.minutes);
            let _ = std::io::stdout().flush();
        }
        sleep(A_MOMENT);
    }
    let output = child.wait_with_output().map_err(|error| format!("cargo was lost: {error}"))?;
    let said = String::from_utf8_lossy(&output.stdout);
    // A name that no test has is not a test that passed.
    let has_passed = output.status.success() && !said.contains("ok. 0 passed");
    println!("\r  {} after {} s", if has_passed { "passed" } else { "failed" }, start.elapsed().as_secs());
    if has_passed {
        return Ok(());
    }
    println!("{said}");
    Err("failed".to_owned())
}
