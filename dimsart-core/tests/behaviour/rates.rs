//! Modules that do not run in every tick: what they compute, in which ticks, and what is said of it.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]
#![expect(clippy::cast_possible_truncation, clippy::cast_precision_loss, reason = "small by construction")]

use std::collections::BTreeMap;

use dimsart_core::modules::Standard;
use dimsart_core::{
    AxisKind, Command, DeviceDescriptor, Dimsart, Direction, EVERY_TICKS, Engine, ModuleList, ModuleRef,
    Observer, Tick, Value, Word, types,
};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

use crate::common::{Bench, H, Types, surroundings};

const PERIODS: [u8; 8] = [1, 2, 4, 5, 10, 20, 50, 100];
const DOF: usize = 2;

/// Counts the calls of a tick.
struct Count(u32);

impl Observer for Count {
    fn call(&mut self, _: usize, call: impl FnOnce()) {
        self.0 += 1;
        call();
    }
}

fn calls<M: ModuleList>(dimsart: &mut Dimsart<M>) -> u32 {
    let mut count = Count(0);
    let measured = vec![Word(0); dimsart.frame().output_words()];
    let mut commanded = vec![Word(0); dimsart.frame().input_words()];
    assert_eq!(dimsart.tick_observed(&measured, &mut commanded, &mut count), Tick::Ran);
    count.0
}

/// One module alone, on random parameters.
fn alone(module: ModuleRef, every_ticks: u8, period_s: f32, seed: u64) -> Option<Dimsart> {
    let mut random = Pcg32::seed_from_u64(seed);
    let (measured, bindings) = surroundings(module);
    let axes = &[AxisKind::Linear; DOF];
    let device = DeviceDescriptor::new("bench", axes, period_s, measured.leak(), &[]).unwrap();
    let mut dimsart = Dimsart::new(device).unwrap();
    for (port, signal) in bindings {
        dimsart.command(Command::bind(module, port, signal)).unwrap();
    }
    dimsart.command(Command::set(module, EVERY_TICKS, choice(every_ticks))).unwrap();
    for parameter in 0..8 {
        let value = Value::Real((random.next_u32() % 40) as f32 * 0.1);
        let _ = dimsart.command(Command::set(module, parameter, value));
    }
    dimsart.command(Command::PlugIn(module)).ok()?;
    assert_eq!(dimsart.command(Command::Check), Ok(()), "{module:?}");
    Some(dimsart)
}

fn choice(every_ticks: u8) -> Value {
    Value::Choice(PERIODS.iter().position(|period| *period == every_ticks).unwrap() as u8)
}

/// What a module computes in every n-th tick is what it computes in every tick of a device that is n times as slow; its
/// signals hold meanwhile. So the gains that it works out are those of its own period.
#[test]
fn a_module_computes_with_its_own_period_and_holds_between() {
    let mut compared = BTreeMap::new();
    for (kind, found) in (0..).zip(Standard::KINDS) {
        let module = ModuleRef { kind, number: 1 };
        for every_ticks in PERIODS {
            let seed = u64::from(kind) << 8 | u64::from(every_ticks);
            let Some(mut fast) = alone(module, every_ticks, H, seed) else { continue };
            let mut slow = alone(module, 1, H * f32::from(every_ticks), seed).unwrap();
            let mut random = Pcg32::seed_from_u64(seed);
            for tick in 0..3 * u32::from(every_ticks) + 20 {
                let words = fast.frame().output_words();
                let measured: Vec<_> =
                    (0..words).map(|_| Word::from((random.next_u32() >> 8) as f32 / 16_777_216.0)).collect();
                let computes = |tick| matches!(tick, Tick::Ran | Tick::LinkDown { .. });
                assert!(computes(fast.tick(&measured, &mut [])));
                if tick % u32::from(every_ticks) == 0 {
                    assert!(computes(slow.tick(&measured, &mut [])));
                }
                let [fast, slow] = [&fast, &slow].map(|dimsart| own_signals(dimsart, module));
                assert_eq!(fast, slow, "{} in one of {every_ticks} ticks, tick {tick}", found.name);
                *compared.entry(found.name).or_insert(0) += fast.len();
            }
        }
    }
    let with_signals = compared.values().filter(|signals| **signals > 0).count();
    assert!(with_signals >= 13, "{compared:?}");
}

/// The signals that a module writes.
fn own_signals(dimsart: &Dimsart, module: ModuleRef) -> Vec<Vec<u32>> {
    let engine = dimsart.engine();
    let steps = engine.steps().filter(|step| step.module == module);
    let signals =
        steps.flat_map(|step| engine.step_signals(step)).filter(|(_, way)| *way == Direction::Write);
    let data_base = engine.data_base();
    signals.map(|(signal, _)| data_base.words(data_base.slot(signal).unwrap()).to_vec()).collect()
}

/// Controllers of that many rates, one behind the other, none of which reads from another one.
fn with_rates(rates: &[u8]) -> Bench {
    let mut bench = Bench::of(1, SERVO, &[]);
    let rows = (2..).zip(rates).map(|(number, every_ticks)| {
        format!(
            "PCTRL_MOD.{number} PORT_DES_FORCE DES_FORCE.{number}\nPCTRL_MOD.{number} EVERY_TICKS {every_ticks}\n\
             MOD_ENG MOD_ON PCTRL_MOD.{number}\n"
        )
    });
    bench.run(&rows.collect::<String>());
    bench
}

const SERVO: Types = &[types::POSITION, types::DES_POSITION];

/// Modules that run in a tick, over a whole cycle; the first tick, in which all of them begin, is left out.
fn cycle(bench: &mut Bench) -> Vec<u32> {
    calls(&mut bench.dimsart);
    (0..100).map(|_| calls(&mut bench.dimsart)).collect()
}

/// Fewest modules that must run together in some tick, wherever each of them runs.
fn fewest(rates: &[u8], load: &mut [u32; 100], best: u32) -> u32 {
    let Some((rate, others)) = rates.split_first() else { return load.iter().copied().max().unwrap() };
    let mut best = best;
    for place in 0..usize::from(*rate) {
        load.iter_mut().skip(place).step_by((*rate).into()).for_each(|load| *load += 1);
        if load.iter().max().is_some_and(|most| *most < best) {
            best = best.min(fewest(others, load, best));
        }
        load.iter_mut().skip(place).step_by((*rate).into()).for_each(|load| *load -= 1);
    }
    best
}

/// Against the best of all possible places, for random rates.
#[test]
fn modules_are_spread_so_that_the_worst_tick_is_short() {
    let mut random = Pcg32::seed_from_u64(5);
    let mut best = 0;
    for _ in 0..300 {
        let count = 1 + random.next_u32() as usize % 7;
        let rates: Vec<u8> =
            (0..count).map(|_| [1, 2, 4, 5, 10, 10][random.next_u32() as usize % 6]).collect();
        let cycle = cycle(&mut with_rates(&rates));
        let runs: u32 = rates.iter().map(|rate| 100 / u32::from(*rate)).sum();
        assert_eq!(cycle.iter().sum::<u32>(), runs, "{rates:?}");
        let (most, fewest) = (*cycle.iter().max().unwrap(), fewest(&rates, &mut [0; 100], u32::MAX));
        assert!(most <= fewest + 1, "{rates:?}: {most} run together where {fewest} could");
        best += u32::from(most == fewest);
    }
    assert!(best >= 270, "{best} of 300 are as short as can be");
}

/// Where each rate divides the next one, no tick has more to do than its share.
#[test]
fn rates_that_divide_each_other_are_spread_evenly() {
    for (rates, most) in [
        (&[2, 2][..], 1),
        (&[1, 2, 2, 4, 4, 4, 4], 3),
        (&[10; 10], 1),
        (&[10; 11], 2),
        (&[5, 5, 5, 5, 10, 10], 1),
        (&[1, 1, 100, 100, 100, 50], 3),
    ] {
        let cycle = cycle(&mut with_rates(rates));
        assert_eq!(cycle.iter().max(), Some(&most), "{rates:?}: {cycle:?}");
    }
}

/// What stays in a scheme goes on in its ticks; what is new begins at once, and then runs in others.
#[test]
fn a_change_leaves_the_others_in_their_ticks() {
    let mut bench = with_rates(&[5]);
    let before: Vec<_> = (0..13).map(|_| calls(&mut bench.dimsart)).collect();
    assert_eq!(before, [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0]);
    bench.rows(
        "MOD_ENG BEGIN\nPCTRL_MOD.9 PORT_DES_FORCE DES_FORCE.9\nPCTRL_MOD.9 EVERY_TICKS 5\nMOD_ENG MOD_ON PCTRL_MOD.9\n\
         MOD_ENG COMMIT",
    );
    let after: Vec<_> = (0..13).map(|_| calls(&mut bench.dimsart)).collect();
    // The new one in the first tick and in the fourth, behind the other one in the third.
    assert_eq!(after, [1, 0, 1, 1, 0, 0, 0, 1, 1, 0, 0, 0, 1]);
}

/// The rate is changed by a transaction while the scheme runs; state and outputs stay.
#[test]
fn a_rate_is_changed_while_the_scheme_runs() {
    let mut bench = Bench::of(1, &[types::SIGNAL], &[]);
    bench.run("MOD_ENG MOD_ON INTEGRATOR_MOD");
    let rate = |bench: &mut Bench| bench.order("INTEGRATOR_MOD EVERY_TICKS 10");
    assert!(rate(&mut bench).is_err(), "its gains would be those of another period in mid-air");
    (0..1001).for_each(|_| drop(bench.tick(&[1.0])));
    let sum = |bench: &Bench| bench.signal("SIGNAL_OUT")[0];
    assert!((sum(&bench) - 1.0).abs() < 1e-3, "{}", sum(&bench));
    bench.rows("MOD_ENG BEGIN\nMOD_ENG MOD_OFF INTEGRATOR_MOD\nINTEGRATOR_MOD EVERY_TICKS 10");
    bench.rows("MOD_ENG MOD_ON INTEGRATOR_MOD\nMOD_ENG COMMIT");
    (0..1000).for_each(|_| drop(bench.tick(&[1.0])));
    assert!((sum(&bench) - 2.0).abs() < 1e-3, "{}", sum(&bench));
}

#[test]
fn what_does_not_run_in_every_tick_is_reported_with_how_old_its_signals_get() {
    let mut bench = with_rates(&[1, 20]);
    assert_eq!(
        bench.findings(),
        ["PCTRL_MOD.3 writes DES_FORCE.3 in one of 20 ticks: it is up to 19 ticks old where it is read"]
    );
    let rate = bench.dimsart.engine().rate_of(Engine::<Standard>::module("PCTRL_MOD.3").unwrap()).unwrap();
    assert_eq!(rate.every_ticks, 20);
    // It can be asked for, and goes back to every tick with the other parameters.
    let module = Engine::<Standard>::module("PCTRL_MOD.3").unwrap();
    assert_eq!(bench.dimsart.engine_mut().get(module, EVERY_TICKS, 0), Ok(Value::Choice(5)));
    bench.rows("MOD_ENG MOD_OFF PCTRL_MOD.3\nMOD_ENG MOD_INIT PCTRL_MOD.3\nMOD_ENG MOD_ON PCTRL_MOD.3");
    assert_eq!(bench.dimsart.engine_mut().get(module, EVERY_TICKS, 0), Ok(Value::Choice(0)));
    assert_eq!(bench.findings(), [""; 0]);
}

#[test]
fn rates_that_cannot_be_are_refused() {
    let mut bench: Bench = Bench::of(1, SERVO, &[]);
    assert_eq!(bench.load("PCTRL_MOD EVERY_TICKS 3").len(), 1, "no divisor of 100");
    assert_eq!(bench.load("PCTRL_MOD EVERY_TICKS 0").len(), 1);
    bench.rows("COMM_TXMOD EVERY_TICKS 2");
    let refused = bench.order("MOD_ENG MOD_ON COMM_TXMOD").unwrap_err();
    let module = Engine::<Standard>::module("COMM_TXMOD").unwrap();
    assert_eq!(refused, dimsart_core::CommandError::RunsEveryTick(module));
}
