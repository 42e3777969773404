//! Modules that do not run in every tick: results, phases and findings.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]
#![expect(clippy::cast_possible_truncation, clippy::cast_precision_loss, reason = "small by construction")]

use std::collections::BTreeMap;

use dimsart_core::{
    AxisKind, Command, DeviceDescriptor, Dimsart, Direction, EVERY_TICKS, ModuleRef, Observer,
    ProvidedMemory, TickResult, Value, Word, types,
};
use dimsart_modules::ALL;
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

fn calls(dimsart: &mut Dimsart) -> u32 {
    let mut count = Count(0);
    let measured = vec![Word(0); dimsart.frame().output_words()];
    let mut commanded = vec![Word(0); dimsart.frame().input_words()];
    assert_eq!(dimsart.tick_observed(&measured, &mut commanded, &mut count), TickResult::Ran);
    count.0
}

/// A single module with random parameters.
fn alone(module: ModuleRef, every_ticks: u8, period_s: f32, seed: u64) -> Option<Dimsart> {
    let mut random = Pcg32::seed_from_u64(seed);
    let (measured, bindings) = surroundings(module);
    let axes = &[AxisKind::Linear; DOF];
    let device = DeviceDescriptor::new("bench", axes, period_s, measured.leak(), &[]).unwrap();
    let mut dimsart = Dimsart::new(ProvidedMemory::leak_default(), device, ALL).unwrap();
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

/// A module that runs every n ticks computes the same as on a device with n times the period; its signals
/// hold their values in between. So its derived gains use its own period.
#[test]
fn a_module_computes_with_its_own_period_and_holds_between() {
    let mut compared = BTreeMap::new();
    for found in ALL.list() {
        let kind = found.id;
        let module = ModuleRef { kind, number: 1 };
        for every_ticks in PERIODS {
            let seed = u64::from(kind.bits()) << 8 | u64::from(every_ticks);
            let Some(mut fast) = alone(module, every_ticks, H, seed) else { continue };
            let mut slow = alone(module, 1, H * f32::from(every_ticks), seed).unwrap();
            let mut random = Pcg32::seed_from_u64(seed);
            for tick in 0..3 * u32::from(every_ticks) + 20 {
                let words = fast.frame().output_words();
                let measured: Vec<_> =
                    (0..words).map(|_| Word::from((random.next_u32() >> 8) as f32 / 16_777_216.0)).collect();
                let computes = |tick| matches!(tick, TickResult::Ran | TickResult::LinkDown { .. });
                assert!(computes(fast.tick(&measured, &mut [])));
                if tick % u32::from(every_ticks) == 0 {
                    assert!(computes(slow.tick(&measured, &mut [])));
                }
                let [fast, slow] = [&fast, &slow].map(|dimsart| own_signals(dimsart, module));
                assert_eq!(fast, slow, "{} every {every_ticks} ticks, tick {tick}", found.name);
                *compared.entry(found.name).or_insert(0) += fast.len();
            }
        }
    }
    let with_signals = compared.values().filter(|signals| **signals > 0).count();
    assert!(with_signals >= 13, "{compared:?}");
}

/// The signals that the module writes.
fn own_signals(dimsart: &Dimsart, module: ModuleRef) -> Vec<Vec<u32>> {
    let engine = dimsart.engine();
    let steps = engine.steps().filter(|step| step.module == module);
    let signals =
        steps.flat_map(|step| engine.step_signals(step)).filter(|(_, way)| *way == Direction::Write);
    let data_base = engine.data_base();
    signals.map(|(signal, _)| data_base.words(data_base.slot(signal).unwrap()).to_vec()).collect()
}

/// Independent controllers with these rates.
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

/// Modules that run in each tick of a cycle, except the first tick, in which all run.
fn cycle(bench: &mut Bench) -> Vec<u32> {
    calls(&mut bench.dimsart);
    (0..100).map(|_| calls(&mut bench.dimsart)).collect()
}

/// The minimum, over all phases, of the maximum number of modules in a tick.
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

/// Compared with the best of all phases, for random rates.
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
        assert!(most <= fewest + 1, "{rates:?}: {most} run together, the optimum is {fewest}");
        best += u32::from(most == fewest);
    }
    assert!(best >= 270, "{best} of 300 are optimal");
}

/// If each rate divides the next one, no tick has more load than its share.
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

/// Modules that stay keep their phase; new ones run at once, then in other ticks.
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
    // The new one in the first tick, the other one in the third.
    assert_eq!(after, [1, 0, 1, 0, 0, 1, 0, 1, 0, 0, 1, 0, 1]);
}

/// Modules with all kinds of connections: late stages, loops, chained filters.
const SCHEMES: &[&[&str]] = &[
    &["WTRANSF_MOD FORM SPLIT", "PDCTRL_MOD K_PARAM 1000"],
    &["WTRANSF_MOD FORM IMPLICIT", "PDCTRL_MOD K_PARAM 1000\nPDCTRL_MOD LAW_OUTPUT ON"],
    &["WTRANSF_MOD FORM PRINTED", "PDCTRL_MOD K_PARAM 1000"],
    &[
        "WSCALE_MOD POSITION_SCALE 2",
        "WTRANSF_MOD PORT_WAVES_IN CH2_TD_WAVES",
        "PDCTRL_MOD PORT_DES_FORCE DES_FORCE.2\nPDCTRL_MOD K_PARAM 500",
        "NORMALIZER_MOD PORT_SIGNAL_IN DES_FORCE.2\nNORMALIZER_MOD PORT_SIGNAL_OUT DES_FORCE\nNORMALIZER_MOD SCALE 0.5",
    ],
    &[
        "PASSIVITY_MOD CAUSALITY ADMITTANCE\nPASSIVITY_MOD PORT_POSITION_IN FAR_POSITION",
        "PDCTRL_MOD K_PARAM 100",
    ],
    &["TDPA_MOD CAUSALITY ADMITTANCE", "PDCTRL_MOD K_PARAM 100"],
    &[
        "PLANAR_TIP_MOD LENGTH 0.5",
        "PCTRL_MOD PORT_POSITION TIP_POSITION\nPCTRL_MOD PORT_DES_POSITION TIP_POSITION\n\
         PCTRL_MOD PORT_DES_FORCE DES_TIP_FORCE",
    ],
    &[
        "LOWPASS_MOD PORT_SIGNAL_IN FAR_POSITION\nLOWPASS_MOD PORT_SIGNAL_OUT DES_POSITION",
        "PIDCTRL_MOD K_PARAM 100\nPIDCTRL_MOD I_PARAM 50\nPIDCTRL_MOD D_PARAM 2",
    ],
];

const MEASURED: Types = &[types::POSITION, types::CH2_WAVES, types::FAR_POSITION, types::FAR_ENERGY];

/// The scheme on a device of this period, each module at its own rate.
fn scheme(modules: &[&str], period_s: f32, rates: &[u8]) -> (Bench, Vec<String>) {
    let device = DeviceDescriptor::new("bench", &[AxisKind::Rotary; DOF], period_s, MEASURED, &[]).unwrap();
    let mut bench = Bench { dimsart: Dimsart::new(ProvidedMemory::leak_default(), device, ALL).unwrap() };
    for (rows, every_ticks) in modules.iter().zip(rates) {
        let name = rows.split(' ').next().unwrap();
        bench.rows(&format!("{rows}\n{name} EVERY_TICKS {every_ticks}\nMOD_ENG MOD_ON {name}"));
    }
    let errors = bench.load("MOD_ENG MATCHING_CHECK");
    (bench, errors)
}

/// A scheme that runs every n ticks computes the same as on a device with n times the period: each module
/// sees the values of the same tick, in both of its stages.
#[test]
fn a_scheme_computes_with_its_own_period_whatever_its_modules_read_of_each_other() {
    for modules in SCHEMES {
        for every_ticks in [2, 5, 10] {
            let (mut fast, errors) = scheme(modules, H, &vec![every_ticks; modules.len()]);
            assert_eq!(errors, [""; 0], "{modules:?}: {:?}", fast.findings());
            let (mut slow, _) = scheme(modules, H * f32::from(every_ticks), &vec![1; modules.len()]);
            let mut random = Pcg32::seed_from_u64(11);
            for tick in 0..100 * u32::from(every_ticks) {
                let measured: Vec<f32> = (0..MEASURED.len() * DOF)
                    .map(|_| ((random.next_u32() >> 8) as f32 / 16_777_216.0 - 0.5) * 0.01)
                    .collect();
                fast.tick(&measured);
                if tick % u32::from(every_ticks) == 0 {
                    slow.tick(&measured);
                    let [fast, slow] = [&fast, &slow].map(|bench| all_signals(&bench.dimsart));
                    assert_eq!(fast, slow, "{modules:?} every {every_ticks} ticks, tick {tick}");
                }
            }
        }
    }
}

fn all_signals(dimsart: &Dimsart) -> Vec<Vec<u32>> {
    let data_base = dimsart.engine().data_base();
    data_base.signals().map(|(slot, _)| data_base.words(slot).to_vec()).collect()
}

/// A late stage and the modules that connect it to its early stage: if one of them does not run with the late
/// stage, the scheme is refused and both are named; modules that only hold a value are allowed.
#[test]
fn a_late_stage_that_would_read_an_old_value_is_refused() {
    for modules in SCHEMES.iter().take(7) {
        for rates in [[1, 1], [2, 1], [10, 5], [1, 2], [2, 5], [4, 10], [2, 4]] {
            let mut each = vec![rates[1]; modules.len()];
            each[0] = rates[0];
            let (bench, errors) = scheme(modules, H, &each);
            // Two late stages in a loop need each other.
            let has_two = modules[0].starts_with("WSCALE");
            let is_sound = if has_two { rates[0] == rates[1] } else { rates[0] % rates[1] == 0 };
            assert_eq!(errors.is_empty(), is_sound, "{modules:?} {rates:?}: {:?}", bench.findings());
            let names = modules.first().zip(modules.get(1)).map(|(late, writer)| {
                let [late, writer] = [late, writer].map(|rows| rows.split(' ').next().unwrap());
                format!(
                    "{late} needs a new value from {writer} at every run, but {writer} runs every {every} ticks: set \
                     EVERY_TICKS of {late} to a multiple of {every}",
                    every = rates[1]
                )
            });
            let is_named = bench.findings().contains(&names.unwrap());
            assert_eq!(is_named, rates[0] % rates[1] != 0, "{:?}", bench.findings());
        }
    }
    // A collision observer commands nothing: the held force of a slow controller moves the arm.
    let mut bench = Bench::of(DOF, &[types::POSITION, types::VELOCITY, types::DES_POSITION], &[]);
    bench.run(
        "MOD_ENG MOD_ON PLANAR_COLLISION_MOD\nPDCTRL_MOD K_PARAM 100\nPDCTRL_MOD EVERY_TICKS 5\n\
         MOD_ENG MOD_ON PDCTRL_MOD",
    );
}

/// Random schemes: whatever is plugged in, in any order and while running, dependent modules run together as
/// often as their rates allow.
#[test]
fn modules_that_need_one_another_share_their_ticks() {
    let mut random = Pcg32::seed_from_u64(7);
    for _ in 0..200 {
        let mut bench = Bench::of(1, &[types::SIGNAL], &[]);
        let mut below = |bound: u32| random.next_u32() % bound;
        let mut needs: Vec<Vec<usize>> = Vec::new();
        for number in 0..8_usize {
            // Each reads two signals of earlier modules, or the measurement; some are plugged in while the
            // scheme runs.
            let sources = [below(number as u32 + 1), below(number as u32 + 1)].map(|source| source as usize);
            let name = |source: usize| match source {
                0 => "SIGNAL".to_owned(),
                place => format!("SIGNAL_OUT.{}", place + 1),
            };
            let mut needed: Vec<usize> = sources.iter().filter_map(|source| source.checked_sub(1)).collect();
            needed.extend(needed.clone().iter().flat_map(|place| needs[*place].clone()));
            needs.push(needed);
            let module = format!("SUM_MOD.{}", number + 2);
            bench.rows(&format!(
                "{module} PORT_A {}\n{module} PORT_B {}\n{module} PORT_SIGNAL_OUT SIGNAL_OUT.{}\n\
                 {module} EVERY_TICKS {}\nMOD_ENG MOD_ON {module}",
                name(sources[0]),
                name(sources[1]),
                number + 2,
                [1, 2, 4, 5, 10, 20][below(6) as usize]
            ));
            if number == 3 {
                bench.rows("MOD_ENG MATCHING_CHECK");
            }
            if number >= 3 {
                (0..below(7)).for_each(|_| drop(bench.tick(&[1.0])));
            }
        }
        let engine = bench.dimsart.engine();
        let module = |place: usize| ALL.module(&format!("SUM_MOD.{}", place + 2)).unwrap();
        let rates: Vec<_> = (0..8).map(|place| engine.module_rate(module(place)).unwrap()).collect();
        for (place, needed) in needs.iter().enumerate() {
            for other in needed {
                let (one, other) = (rates[place], rates[*other]);
                let runs =
                    |rate: dimsart_core::Rate, tick: u8| tick % rate.every_ticks == rate.ticks_until_run;
                assert!(
                    (0..100).any(|tick| runs(one, tick) && runs(other, tick)),
                    "{one:?} needs {other:?}: {needs:?} {rates:?}"
                );
            }
        }
    }
}

/// A transaction changes the rate of a running scheme; state and outputs are kept.
#[test]
fn a_rate_is_changed_while_the_scheme_runs() {
    let mut bench = Bench::of(1, &[types::SIGNAL], &[]);
    bench.run("MOD_ENG MOD_ON INTEGRATOR_MOD");
    let rate = |bench: &mut Bench| bench.order("INTEGRATOR_MOD EVERY_TICKS 10");
    assert!(rate(&mut bench).is_err(), "its gains would change their period in motion");
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
        ["PCTRL_MOD.3 writes DES_FORCE.3 every 20 ticks: readers get values up to 19 ticks old"]
    );
    let rate = bench.dimsart.engine().module_rate(ALL.module("PCTRL_MOD.3").unwrap()).unwrap();
    assert_eq!(rate.every_ticks, 20);
    // It can be read, and is reset with the other parameters.
    let module = ALL.module("PCTRL_MOD.3").unwrap();
    assert_eq!(bench.dimsart.engine_mut().get(module, EVERY_TICKS, 0), Ok(Value::Choice(5)));
    bench.rows("MOD_ENG MOD_OFF PCTRL_MOD.3\nMOD_ENG MOD_INIT PCTRL_MOD.3\nMOD_ENG MOD_ON PCTRL_MOD.3");
    assert_eq!(bench.dimsart.engine_mut().get(module, EVERY_TICKS, 0), Ok(Value::Choice(0)));
    assert_eq!(bench.findings(), [""; 0]);
}

#[test]
fn rates_that_cannot_be_are_refused() {
    let mut bench = Bench::of(1, SERVO, &[]);
    assert_eq!(bench.load("PCTRL_MOD EVERY_TICKS 3").len(), 1, "no divisor of 100");
    assert_eq!(bench.load("PCTRL_MOD EVERY_TICKS 0").len(), 1);
    bench.rows("COMM_TXMOD EVERY_TICKS 2");
    let refused = bench.order("MOD_ENG MOD_ON COMM_TXMOD").unwrap_err();
    let module = ALL.module("COMM_TXMOD").unwrap();
    assert_eq!(refused, dimsart_core::CommandError::RunsEveryTick(module));
}
