//! Every set of eight modules, in both orders: it runs exactly when lists of who writes and reads what say so, and leaves
//! nothing behind.
#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "in helpers of tests as in tests"
)]

use std::collections::BTreeSet;

use dimsart_core::{
    Command, CommandError, Engine, Finding, ModuleRef, Usage, Vocabulary as _, modules::Standard, types,
};

use crate::common::Bench;

/// A module, what its ports are bound to, and what it reads and writes then.
struct Known {
    name: &'static str,
    rows: &'static str,
    reads: &'static [&'static str],
    writes: &'static str,
}

const KNOWN: [Known; 8] = [
    Known {
        name: "DIFFERENTIATOR_MOD",
        rows: "PORT_SIGNAL_IN POSITION\nPORT_SIGNAL_OUT VELOCITY",
        reads: &["POSITION"],
        writes: "VELOCITY",
    },
    Known { name: "SIGGEN_MOD", rows: "PORT_SIGNAL_OUT DES_VELOCITY", reads: &[], writes: "DES_VELOCITY" },
    Known { name: "VEL2POS_MOD", rows: "", reads: &["POSITION", "DES_VELOCITY"], writes: "DES_POSITION" },
    Known {
        name: "PCTRL_MOD",
        rows: "K_PARAM 100\nPORT_DES_FORCE DES_FORCE.2",
        reads: &["POSITION", "DES_POSITION"],
        writes: "DES_FORCE.2",
    },
    Known {
        name: "VWALL_MOD",
        rows: "PORT_DES_FORCE DES_FORCE.3",
        reads: &["POSITION"],
        writes: "DES_FORCE.3",
    },
    Known {
        name: "SUM_MOD",
        rows: "PORT_A DES_FORCE.2\nPORT_B DES_FORCE.3\nPORT_SIGNAL_OUT DES_FORCE",
        reads: &["DES_FORCE.2", "DES_FORCE.3"],
        writes: "DES_FORCE",
    },
    Known {
        name: "PDCTRL_MOD",
        rows: "K_PARAM 50",
        reads: &["POSITION", "DES_POSITION"],
        writes: "DES_FORCE",
    },
    Known {
        name: "RECORDER_MOD",
        rows: "PORT_SIGNAL_IN VELOCITY",
        reads: &["VELOCITY"],
        writes: "RECORDED_ROWS",
    },
];

fn module(known: &Known) -> ModuleRef {
    Engine::<Standard>::module(known.name).unwrap()
}

/// Every fault of these modules, plugged in in this order, as what it is and the signal.
fn faults(order: &[&Known]) -> Vec<(&'static str, &'static str)> {
    let mut faults = Vec::new();
    let signals: BTreeSet<&str> = order
        .iter()
        .flat_map(|known| known.reads.iter().copied().chain([known.writes]))
        .chain(["DES_FORCE"])
        .collect();
    for signal in signals.into_iter().filter(|signal| *signal != "POSITION") {
        let writers: Vec<usize> = (0..order.len()).filter(|place| order[*place].writes == signal).collect();
        let readers = (0..order.len()).filter(|place| order[*place].reads.contains(&signal));
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

fn found(bench: &Bench) -> Vec<(&'static str, &'static str)> {
    let engine = bench.dimsart.engine();
    let name = |signal| {
        let named = engine.name_of_signal(signal).to_string();
        let all = KNOWN.iter().flat_map(|known| known.reads.iter().copied().chain([known.writes]));
        all.chain(["DES_FORCE"]).find(|known| *known == named).unwrap()
    };
    let report = engine.check();
    let faults = report.findings().iter().filter(|finding| finding.is_fault());
    let mut found: Vec<_> = faults
        .map(|fault| match *fault {
            Finding::NoProvider { signal, .. } => ("no provider", name(signal)),
            Finding::TwoProviders { signal, .. } => ("two providers", name(signal)),
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

fn leaves_nothing_behind(bench: &mut Bench, order: &[&Known], empty: Usage) {
    bench.dimsart.command(Command::Stop).unwrap();
    for known in order.iter().rev() {
        bench.dimsart.command(Command::Unplug(module(known))).unwrap();
    }
    for known in &KNOWN {
        match bench.dimsart.command(Command::CloseModule(module(known))) {
            Ok(()) | Err(CommandError::NotPluggedIn(_)) => {}
            Err(other) => panic!("{other:?}"),
        }
    }
    assert_eq!(bench.dimsart.engine().usage(), empty);
}

#[test]
fn every_set_runs_exactly_when_it_matches_and_leaves_nothing_behind() {
    let mut sound = 0;
    for set in 0_u32..1 << KNOWN.len() {
        let mut order: Vec<&Known> =
            KNOWN.iter().enumerate().filter(|(bit, _)| set >> bit & 1 == 1).map(|(_, known)| known).collect();
        for is_reversed in [false, true] {
            if is_reversed {
                order.reverse();
            }
            let expected = faults(&order);
            let mut bench: Bench = Bench::of(2, &[types::POSITION], &[types::DES_FORCE]);
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
                assert_eq!(found(&bench), expected, "set {set:#010b}");
                let refused =
                    (!expected.is_empty()).then_some(CommandError::DoesNotMatch { faults: expected.len() });
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
                leaves_nothing_behind(&mut bench, if is_aborted { &[] } else { &order }, empty);
            }
        }
    }
    // The sum needs all but four: 3 sets with DIFFERENTIATOR and RECORDER as they match; PDCTRL alone: with or without P
    // and wall, 12. None in reverse. Each one by one and in a transaction.
    assert_eq!(sound, 2 * (3 + 12));
}
