//! Every subset of two sets of eight modules, in both orders, runs exactly when a model of readers and
//! writers allows it, and leaves no memory behind.
#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "in helpers of tests as in tests"
)]

use std::collections::BTreeSet;

use dimsart_core::{Command, CommandError, Finding, ModuleRef, Usage, Vocabulary as _, types};
use dimsart_modules::ALL;

use crate::common::Bench;

/// A module, its bindings, and the signals that it reads and writes.
struct Known {
    name: &'static str,
    rows: &'static str,
    reads: &'static [&'static str],
    writes: &'static [&'static str],
    /// Reads of its late stage, which runs as soon as its inputs have been written.
    late: Option<Late>,
}

struct Late {
    reads: &'static [&'static str],
    writes: &'static [&'static str],
}

impl Known {
    const fn new(
        name: &'static str,
        rows: &'static str,
        reads: &'static [&'static str],
        writes: &'static [&'static str],
    ) -> Self {
        Self { name, rows, reads, writes, late: None }
    }

    fn signals(&self) -> impl Iterator<Item = &'static str> {
        let late = self.late.iter().flat_map(|late| late.reads.iter().chain(late.writes));
        self.reads.iter().chain(self.writes).chain(late).copied()
    }
}

type Set = [Known; 8];

/// The modules of Table 1, a source of waves in place of the receiver, a P controller in place of the PD
/// controller, and a recorder.
const TABLE_1: Set = [
    Known::new("COMM_RXMOD", "CRX_ADD_DATA CH2_WAVES", &[], &["CH2_WAVES"]),
    Known::new("SIGGEN_MOD", "PORT_SIGNAL_OUT CH2_WAVES", &[], &["CH2_WAVES"]),
    Known {
        late: Some(Late { reads: &["DES_FORCE"], writes: &["CH1_WAVES", "LINE_FORCE", "LINE_VELOCITY"] }),
        ..Known::new("WTRANSF_MOD", "B_PARAM 10", &["CH2_WAVES", "POSITION"], &["DES_POSITION"])
    },
    Known::new("PDCTRL_MOD", "K_PARAM 3000", &["POSITION", "DES_POSITION"], &["DES_FORCE"]),
    Known::new("PCTRL_MOD", "K_PARAM 1000", &["POSITION", "DES_POSITION"], &["DES_FORCE"]),
    Known::new("TIMEDELAY_MOD", "TD_PARAM 10", &["CH1_WAVES"], &["CH1_TD_WAVES"]),
    Known::new("RECORDER_MOD", "PORT_SIGNAL_IN LINE_FORCE", &["LINE_FORCE"], &["RECORDED_ROWS"]),
    Known::new("COMM_TXMOD", "CTX_ADD_DATA CH1_TD_WAVES", &["CH1_TD_WAVES"], &[]),
];

const OTHERS: Set = [
    Known::new(
        "DIFFERENTIATOR_MOD",
        "PORT_SIGNAL_IN POSITION\nPORT_SIGNAL_OUT VELOCITY",
        &["POSITION"],
        &["VELOCITY"],
    ),
    Known::new("SIGGEN_MOD", "PORT_SIGNAL_OUT DES_VELOCITY", &[], &["DES_VELOCITY"]),
    Known::new("VEL2POS_MOD", "", &["POSITION", "DES_VELOCITY"], &["DES_POSITION"]),
    Known::new(
        "PCTRL_MOD",
        "K_PARAM 100\nPORT_DES_FORCE DES_FORCE.2",
        &["POSITION", "DES_POSITION"],
        &["DES_FORCE.2"],
    ),
    Known::new("VWALL_MOD", "PORT_DES_FORCE DES_FORCE.3", &["POSITION"], &["DES_FORCE.3"]),
    Known::new(
        "SUM_MOD",
        "PORT_A DES_FORCE.2\nPORT_B DES_FORCE.3\nPORT_SIGNAL_OUT DES_FORCE",
        &["DES_FORCE.2", "DES_FORCE.3"],
        &["DES_FORCE"],
    ),
    Known::new("PDCTRL_MOD", "K_PARAM 50", &["POSITION", "DES_POSITION"], &["DES_FORCE"]),
    Known::new("RECORDER_MOD", "PORT_SIGNAL_IN VELOCITY", &["VELOCITY"], &["RECORDED_ROWS"]),
];

/// A call of a tick: signals read and written.
type Call = (&'static [&'static str], &'static [&'static str]);

/// Returns the calls of modules plugged in in this order.
fn calls(order: &[&Known]) -> Vec<Call> {
    let mut calls = Vec::<Call>::new();
    // No set has two late stages.
    let mut waiting = None::<Call>;
    for (place, known) in order.iter().enumerate() {
        calls.push((known.reads, known.writes));
        if let Some(Late { reads, writes }) = &known.late {
            assert!(waiting.replace((reads, writes)).is_none());
        }
        let is_to_come = |signal| order[place + 1..].iter().any(|later| later.writes.contains(signal));
        if waiting.is_some_and(|(reads, _)| !reads.iter().any(is_to_come)) {
            calls.extend(waiting.take());
        }
    }
    calls
}

fn module(known: &Known) -> ModuleRef {
    ALL.module(known.name).unwrap()
}

/// Returns every fault of these modules plugged in in this order: kind and signal.
fn faults(order: &[&Known]) -> Vec<(&'static str, &'static str)> {
    let mut faults = Vec::new();
    let calls = calls(order);
    let signals: BTreeSet<&str> =
        order.iter().flat_map(|known| known.signals()).chain(["DES_FORCE"]).collect();
    for signal in signals.into_iter().filter(|signal| *signal != "POSITION") {
        let writers: Vec<usize> =
            (0..calls.len()).filter(|place| calls[*place].1.contains(&signal)).collect();
        let readers = (0..calls.len()).filter(|place| calls[*place].0.contains(&signal));
        faults.extend(writers.iter().skip(1).map(|_| ("two providers", signal)));
        for reader in readers {
            match writers.first() {
                None => faults.push(("no provider", signal)),
                Some(writer) if reader < *writer => faults.push(("delay", signal)),
                Some(_) => {}
            }
        }
        if signal == "DES_FORCE" && writers.is_empty() {
            faults.push(("no provider", signal));
        }
    }
    faults.sort_unstable();
    faults
}

fn found(bench: &Bench, set: &Set) -> Vec<(&'static str, &'static str)> {
    let engine = bench.dimsart.engine();
    let name = |signal| {
        let named = engine.signal_name(signal).to_string();
        let all = set.iter().flat_map(Known::signals);
        all.chain(["DES_FORCE"]).find(|known| *known == named).unwrap()
    };
    let report = engine.check();
    let faults = report.findings().iter().filter(|finding| finding.is_fault());
    let mut found: Vec<_> = faults
        .map(|fault| match *fault {
            Finding::NoWriter { signal, .. } => ("no provider", name(signal)),
            Finding::MultipleWriters { signal, .. } => ("two providers", name(signal)),
            Finding::Delay { signal, .. } => ("delay", name(signal)),
            other => panic!("{other:?}"),
        })
        .collect();
    found.sort_unstable();
    found
}

fn runs(bench: &mut Bench) {
    for tick in 0..20_u8 {
        let force = bench.tick(&[0.01 * f32::from(tick), -0.02]);
        assert!(force.iter().all(|force| force.is_finite() && force.abs() < 1e3), "{force:?}");
    }
}

fn leaves_nothing_behind(bench: &mut Bench, order: &[&Known], set: &Set, empty: Usage) {
    bench.dimsart.command(Command::Stop).unwrap();
    for known in order.iter().rev() {
        bench.dimsart.command(Command::Unplug(module(known))).unwrap();
    }
    for known in set {
        match bench.dimsart.command(Command::CloseModule(module(known))) {
            Ok(()) | Err(CommandError::NotPluggedIn(_)) => {}
            Err(other) => panic!("{other:?}"),
        }
    }
    assert_eq!(bench.dimsart.engine().usage(), empty);
}

/// Tries every set in both orders, by single commands and in a transaction; returns how many ran.
fn sound_sets(all: &Set) -> u32 {
    let mut sound = 0;
    for set in 0_u32..1 << all.len() {
        let mut order: Vec<&Known> =
            all.iter().enumerate().filter(|(bit, _)| set >> bit & 1 == 1).map(|(_, known)| known).collect();
        for is_reversed in [false, true] {
            if is_reversed {
                order.reverse();
            }
            let expected = faults(&order);
            let mut bench = Bench::of(2, &[types::POSITION], &[types::DES_FORCE]);
            let empty = bench.dimsart.engine().usage();
            for is_transaction in [false, true] {
                for known in &order {
                    known.rows.lines().for_each(|row| bench.rows(&format!("{} {row}", known.name)));
                }
                if is_transaction {
                    bench.dimsart.command(Command::Begin).unwrap();
                }
                for known in &order {
                    bench.dimsart.command(Command::PlugIn(module(known))).unwrap();
                }
                assert_eq!(found(&bench, all), expected, "set {set:#010b}, reversed: {is_reversed}");
                let refused =
                    (!expected.is_empty()).then_some(CommandError::HasFaults { faults: expected.len() });
                assert_eq!(bench.dimsart.command(Command::Check).err(), refused, "set {set:#010b}");
                if is_transaction {
                    let end = if expected.is_empty() { Command::Commit } else { Command::Abort };
                    bench.dimsart.command(end).unwrap();
                }
                let is_running = bench.dimsart.engine().is_running();
                assert_eq!(is_running, expected.is_empty());
                if is_running {
                    sound += 1;
                    runs(&mut bench);
                }
                let is_aborted = is_transaction && !is_running;
                leaves_nothing_behind(&mut bench, if is_aborted { &[] } else { &order }, all, empty);
            }
        }
    }
    sound
}

#[test]
fn every_set_runs_exactly_when_it_matches_and_leaves_nothing_behind() {
    // The sum needs all but four modules: 3 sets with DIFFERENTIATOR and RECORDER. PDCTRL alone, with or
    // without P and wall: 12. None in reverse order. Each by single commands and in a transaction.
    assert_eq!(sound_sets(&OTHERS), 2 * (3 + 12));
}

#[test]
fn so_does_every_set_of_the_modules_of_table_1() {
    // WTRANSF with one of two wave sources and one of two controllers; then no module, TIMEDELAY, or
    // TIMEDELAY and COMM_TX; with or without RECORDER. None in reverse order: WTRANSF decodes for the
    // controller. Each in both ways.
    assert_eq!(sound_sets(&TABLE_1), 2 * (2 * 2 * 3 * 2));
}
