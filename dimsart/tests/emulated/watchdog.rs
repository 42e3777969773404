//! The watchdog: a control law that never returns during motion, and the report of the next start.

use std::fs;
use std::path::Path;
use std::thread;
use std::time::Duration;

use dimsart_core::{Command, Value};
use dimsart_link::exchange::{Frame, Tag};
use dimsart_link::protocol::Request;
use dimsart_modules::ALL;
use hil_sim::link::Stream;
use tempfile::TempDir;

use crate::by_hand::{ByHand, section};
use crate::common::{image, timer_image};
use crate::debugger::{Debugger, LINK, PROGRAM_COUNTER};
use crate::firmware::{Firmware, greet};
use crate::patched::{patched, symbol};
use crate::stopped::{
    HANG, IN_THE_TICK, NOT_FED, PANIC, SAYS_WHY, TICKS_OF_MOTION, WORDS_BYTES, measured, move_by_hand,
    request, without_peer,
};

/// The wave transformer's law in the form PRINTED, which the built-in scheme does not use: it runs after the restart.
const LAW: &[&str] = &["wave_transformer6follow"];
const FORM: u8 = 2;
const PRINTED: Value = Value::Choice(2);
const COUNTS_PER_MS: u32 = 25_000;

const SUPPLY: &str = "power-on";
const WATCHDOG: &str = "watchdog: ticks overran, or the communication stalled";

/// A board with a host and a copy of the image in which that law never returns.
fn with_endless_law(image: &Path, folder: &TempDir) -> Firmware {
    Firmware::start_image(patched(&fs::read(image).unwrap(), folder, &[(LAW, HANG)]), true)
}

/// Moves, switches the wave transformer to that form between two ticks, and returns the answer to the tick that never
/// ends.
fn loop_in_motion(line: &mut ByHand) -> Frame {
    move_by_hand(line);
    let [law, behind] = ["WTRANSF_MOD", "PDCTRL_MOD"].map(|name| ALL.module(name).unwrap());
    let commands = [
        Command::Begin,
        Command::Unplug(law),
        Command::set(law, FORM, PRINTED),
        Command::PlaceBefore(behind),
        Command::PlugIn(law),
        Command::Commit,
    ];
    let answers = (TICKS_OF_MOTION..).zip(commands).map(|(tick, command)| {
        let request = request(&Request::Command(command), tick);
        line.exchange(&[(Tag::Words, &measured(tick)), (Tag::Command, &request)])
    });
    let mut answers: Vec<Frame> = answers.collect();
    let stopped = answers.pop().unwrap();
    for answer in answers {
        assert_ne!(section(&answer, Tag::Words).unwrap(), [0; WORDS_BYTES], "the device moves until then");
    }
    let left = section(&stopped, Tag::Stopped).unwrap();
    assert!(left.len() > WORDS_BYTES && left.iter().all(|byte| *byte == 0), "{left:?}");
    stopped
}

/// Returns the time from the start of the endless tick until the outputs are safe, in counts of the emulator's time.
fn latency(stopped: &Frame) -> u32 {
    let stamps = section(stopped, Tag::Stamps).unwrap();
    let [before, after] = [0, 4].map(|at| u32::from_le_bytes(stamps[at..at + 4].try_into().unwrap()));
    after.wrapping_sub(before) & u32::MAX >> (32 - stamps[8])
}

#[test]
fn a_law_that_never_returns_leaves_the_outputs_at_rest_and_says_so() {
    let Some(image) = image() else { return };
    let latencies = [(); 2].map(|()| {
        let folder = tempfile::tempdir().unwrap();
        let firmware = with_endless_law(image.path(), &folder);
        let stopped = loop_in_motion(&mut ByHand::greet(firmware.folder()));
        let (code, log) = firmware.last_words();
        assert_eq!(code, Some(101));
        assert!(log.last().unwrap().starts_with(NOT_FED), "{log:?}");
        latency(&stopped)
    });
    println!("at rest after {latencies:?} counts");
    // 0.5 s after the end of the previous tick; then instruction by instruction.
    let expected = 499 * COUNTS_PER_MS..500 * COUNTS_PER_MS;
    assert!(expected.contains(&latencies[0]) && latencies[0] == latencies[1], "{latencies:?}");
}

#[test]
fn a_board_that_the_watchdog_reset_tells_it_and_is_still_until_somebody_moves_it() {
    let Some(image) = timer_image() else { return };
    let folder = tempfile::tempdir().unwrap();
    let firmware = with_endless_law(&image, &folder);
    let mut line = ByHand::greet(firmware.folder());
    let latency = latency(&loop_in_motion(&mut line));
    println!("at rest after {latency} counts");
    // Ten ticks after the end of the previous tick.
    assert!((9 * COUNTS_PER_MS..10 * COUNTS_PER_MS).contains(&latency), "{latency}");
    assert!(
        include_str!("../../../docs/faults.md")
            .contains("| a module never returns (mps2-an386) | 10 | 128 |")
    );

    let mut line = ByHand::greet(firmware.folder());
    without_peer(&mut line);
    let told = thread::scope(|scope| {
        let asked = scope.spawn(|| {
            let mut device = greet(firmware.uart());
            (device.events().unwrap().to_string(), device.live().unwrap().to_string())
        });
        for tick in (0..TICKS_OF_MOTION).cycle() {
            let answer = line.exchange(&[(Tag::Words, &measured(tick))]);
            assert_eq!(section(&answer, Tag::Words).unwrap(), [0; WORDS_BYTES]);
            if asked.is_finished() {
                break;
            }
        }
        asked.join().unwrap()
    });
    let (events, live) = told;
    let [first, .., last] = starts(&events)[..] else { panic!("{events}") };
    assert_eq!((first, last), (SUPPLY, WATCHDOG), "{events}");
    assert!(events.contains("scheme changed") && !events.contains("panic"), "{events}");
    assert!(live.contains("no client holds the lease"), "{live}");
    move_by_hand(&mut line);
}

/// Returns the cause of each start of the board, by its events.
fn starts(events: &str) -> Vec<&str> {
    events.lines().filter_map(|line| line.split_once("128 started: ")).map(|(_, cause)| cause).collect()
}

/// The emulator's time is halted while it waits.
#[test]
fn a_slow_host_is_no_endless_loop() {
    let (Some(image), Some(timer_image)) = (image(), timer_image()) else { return };
    for image in [image.path(), &timer_image] {
        let firmware = Firmware::start_image(image.to_owned(), true);
        let mut line = ByHand::greet(firmware.folder());
        for _ in 0..2 {
            thread::sleep(Duration::from_secs(1));
            move_by_hand(&mut line);
        }
    }
}

/// A board that ticks without a host, and its image.
fn alone() -> Option<(Firmware, Vec<u8>)> {
    let firmware = Firmware::start(false)?;
    drop(greet(firmware.uart()));
    let elf = fs::read(firmware.image()).unwrap();
    Some((firmware, elf))
}

/// Returns its events after the watchdog reset.
fn events_after_reset(firmware: &Firmware, uart: Box<dyn Stream>) -> String {
    wait_for(firmware, |log| log.last().is_some_and(|line| line.starts_with(NOT_FED)));
    // It serves one client.
    drop(uart);
    greet(firmware.uart()).events().unwrap().to_string()
}

#[test]
fn what_stopped_the_board_before_the_watchdog_did_is_told_too() {
    let Some((firmware, elf)) = alone() else { return };
    let mut uart = firmware.uart();
    let mut debugger = Debugger::attach(&firmware);
    // The output of the reason never ends.
    for (function, instructions) in [(IN_THE_TICK, PANIC), (SAYS_WHY, HANG)] {
        debugger.write(symbol(&elf, function).0, instructions);
    }
    debugger.run_on();
    uart.write_all(&request(&Request::DataType { index: u16::MAX }, 1)).unwrap();
    let events = events_after_reset(&firmware, uart);
    let (_, panic) = events.split_once("132 panic\n").unwrap();
    assert_eq!(starts(&events), [SUPPLY, WATCHDOG], "{events}");
    assert_eq!(starts(panic), [WATCHDOG], "{events}");
}

#[test]
fn a_log_line_that_the_watchdog_cut_off_costs_no_other() {
    for place in ["_defmt_write", "_defmt_release"] {
        let Some((firmware, elf)) = alone() else { return };
        wait_for(&firmware, |log| log.iter().any(|line| line.starts_with("tick 1000: ")));
        let uart = firmware.uart();
        let mut debugger = Debugger::attach(&firmware);
        debugger.write(symbol(&elf, &[place]).0, HANG);
        debugger.run_on();
        let events = events_after_reset(&firmware, uart);
        assert_eq!(starts(&events), [SUPPLY, WATCHDOG], "{place}: {events}");
        let is_of_tick_1000 = |line: &&String| line.starts_with("tick 1000: LinkDown { link: 0 }, 0 late, ");
        wait_for(&firmware, |log| log.iter().filter(is_of_tick_1000).count() == 2);
    }
}

fn wait_for(firmware: &Firmware, is_so: impl Fn(&[String]) -> bool) {
    test_requirements::wait_until(|| format!("{:?}", firmware.log()), || is_so(&firmware.log()));
}

/// More than the time to write an event after its checksum.
const INSTRUCTIONS: usize = 120;

#[test]
fn an_event_that_the_watchdog_cut_off_costs_no_other() {
    let mut kept = [0; 2];
    for steps in (0..INSTRUCTIONS).step_by(5) {
        let Some((firmware, elf)) = alone() else { return };
        let mut uart = firmware.uart();
        let mut debugger = Debugger::attach(&firmware);
        uart.write_all(&request(&Request::Command(Command::Reset), 1)).unwrap();
        debugger.run_to(symbol(&elf, &["event_log8checksum"]).0);
        let behind = debugger.register(LINK) & !1;
        debugger.run_to(behind);
        (0..steps).for_each(|_| debugger.step());
        let place = debugger.register(PROGRAM_COUNTER);
        // One more than the number of instructions that a condition can skip.
        debugger.write(place, &HANG.repeat(5));
        debugger.run_on();
        let events = events_after_reset(&firmware, uart);
        assert_eq!(starts(&events), [SUPPLY, WATCHDOG], "{steps}: {events}");
        let numbers = events.lines().map(|line| line.split_whitespace().next().unwrap().parse().unwrap());
        let numbers: Vec<usize> = numbers.collect();
        assert_eq!(numbers, (1..=numbers.len()).collect::<Vec<_>>(), "{steps}: {events}");
        kept[usize::from(events.contains("129 reset"))] += 1;
    }
    println!("truncated event: {} times lost, {} times complete", kept[0], kept[1]);
    assert!(kept.iter().all(|count| *count > 0), "before and after its end: {kept:?}");
}
