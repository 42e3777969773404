//! `cargo xtask long`: tests that continuous integration runs short, at their full length.

use std::io::{IsTerminal, Write};
use std::process::Stdio;
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::shell::{Outcome, cargo};
use crate::toolchain::Toolchain;
use crate::{boards, setup};

/// Tells a test to run at its full length.
const VARIABLE: &str = "DIMSART_LONG";
const A_MOMENT: Duration = Duration::from_secs(1);

/// A test that reads [`VARIABLE`].
struct Run {
    what: &'static str,
    /// On two cores, about.
    minutes: u64,
    package: &'static str,
    /// File in the package's `tests`, and the test in it.
    test: [&'static str; 2],
}

/// Every long run of tests.
const RUNS: &[Run] = &[
    Run {
        what: "10^7 bytes of noise through the emulated UART, a cut frame and a flood, then a command",
        minutes: 10,
        package: "hil-sim",
        test: ["emulated", "timer_tick::noise_a_cut_frame_and_a_flood_are_survived"],
    },
    Run::fault(1, "every 4 wrong bits in a frame of 24 bytes", "bit_errors::every_four_wrong_bits_are_found"),
    Run::fault(
        1,
        "2 x 10^7 bursts that the decoder finds, and as many that it cannot",
        "bit_errors::the_decoder_finds_exactly_what_has_a_syndrome",
    ),
    Run::fault(
        1,
        "2 x 10^8 randomly damaged frames, none taken",
        "bit_errors::no_random_damage_passes_the_crc_32",
    ),
    Run::fault(
        1,
        "the same with a CRC of 16 bits, which lets 1 in 65 536 pass",
        "bit_errors::the_same_damage_passes_a_crc_16_as_often_as_it_has_to",
    ),
    Run::fault(
        1,
        "10^8 frames of random bytes on classic CAN",
        "classic_can::random_bytes_pass_a_crc_8_as_often_as_they_have_to",
    ),
    Run::fault(
        1,
        "280 minutes of random losses in the two-sided loop",
        "loss::chance_losses_lose_the_link_only_when_nothing_came_for_twenty_ticks",
    ),
    Run::fault(
        1,
        "bursts of 1 to 1000 lost packets, at 3 moments, both ways, by 2 policies",
        "loss::bursts_of_nineteen_never_lose_the_link_and_of_twenty_always_do",
    ),
    Run::fault(
        1,
        "3 x 10^6 packets that come twice, late and in any order",
        "order::nothing_is_used_twice_or_out_of_order",
    ),
    Run::fault(
        1,
        "10^6 frames over a UART that drops and inserts bytes",
        "stream::every_frame_that_came_whole_is_taken_whatever_came_before_it",
    ),
    Run::fault(1, "10^7 forged tags of 64 bits", "forgery::no_forged_tag_of_64_bits_is_taken"),
    Run::fault(
        1,
        "10^7 forged tags of 24 bits at 8000 per second",
        "forgery::a_flood_of_forged_tags_of_24_bits_has_ten_tries_a_second",
    ),
    Run::fault(
        1,
        "10^8 forged tags of 24 bits with time between them, some of which are guessed",
        "forgery::with_all_the_time_there_is_tags_of_24_bits_are_guessed",
    ),
    Run::fault(1, "2 x 10^6 repetitions of what was taken", "forgery::nothing_that_was_taken_is_taken_again"),
    Run::fault(
        1,
        "100 times a link that goes and comes back",
        "bus_off::a_link_that_comes_back_moves_nothing_until_it_is_enabled_again",
    ),
    Run::fault(
        1,
        "100 CAN buses, four ways, that send their nodes away",
        "bus_off::a_node_that_stays_off_the_bus_leaves_both_sides_at_rest",
    ),
    Run::fault(1, "an hour with clocks 1000 ppm apart", "clocks::clocks_500_ppm_fast_and_slow_lose_no_link"),
];

impl Run {
    /// One of the root package's `tests/faults`.
    const fn fault(minutes: u64, what: &'static str, test: &'static str) -> Self {
        Self { what, minutes, package: "dimsart", test: ["faults", test] }
    }
}

/// Runs all of them, one after the other: each says how long it takes, and has taken.
pub(crate) fn run() -> Outcome {
    setup::emulator()?;
    boards::build_all(Toolchain::set_up()?)?;
    let minutes: u64 = RUNS.iter().map(|run| run.minutes).sum();
    println!("{} long runs, about {minutes} min on two cores", RUNS.len());
    let failed: Vec<&str> = RUNS.iter().filter(|run| run_one(run).is_err()).map(|run| run.what).collect();
    if failed.is_empty() { Ok(()) } else { Err(format!("failed: {}", failed.join("; "))) }
}

fn run_one(run: &Run) -> Outcome {
    let [file, name] = run.test;
    let test = ["test", "--release", "--quiet", "--package", run.package, "--test", file];
    let mut build = cargo(&test);
    crate::shell::run(build.arg("--no-run"))?;
    let mut test = cargo(&test);
    test.args(["--", "--exact", name]).env(VARIABLE, "1").env("DIMSART_FIRMWARE", boards::folder());
    println!("{} (about {} min)", run.what, run.minutes);
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
    let has_passed = output.status.success() && said.contains("test result: ok. 1 passed");
    println!("\r  {} after {} s", if has_passed { "passed" } else { "failed" }, start.elapsed().as_secs());
    if has_passed {
        return Ok(());
    }
    println!("{said}");
    Err(run.what.to_owned())
}
