//! A module whose call exceeds its budget is isolated in that tick; one within its budget never is.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

use std::cell::Cell;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use dimsart_core::{
    Command, Context, Cost, Costs, Counter, FaultCause, Input, KindId, Module, ModuleKinds, ModuleRef,
    Output, TickResult, Unit, types, words,
};
use dimsart_link::protocol::DeviceInfo;
use dimsart_link::{Event, EventKind, EventLog};

use crate::common::Bench;

words! {
    ports Ports {
        input: Input = input("IN", types::SIGNAL),
        output: Output = output("OUT", types::SIGNAL_OUT),
    }
    parameters Settings {
        /// Duration of a call.
        cycles: u32 = count("CYCLES", Unit::One, 0..=1_000_000, 0),
    }
}

thread_local! {
    /// Stands for the processor's counter, one per test thread.
    static COUNTER: &'static AtomicU32 = Box::leak(Box::new(AtomicU32::new(u32::MAX - 1000)));
    static CALLS: Cell<u32> = const { Cell::new(0) };
}

/// Passes a signal on and takes the set time.
#[derive(Debug)]
struct Slow;

impl Module for Slow {
    const NAME: &'static str = "SLOW_MOD";
    const SUMMARY: &'static str = "Takes its time.";
    type Settings = Settings;
    type Gains = ();
    type State = ();
    type AxisState = ();
    type Ports = Ports;

    fn compute(context: &Context<'_, Self>) {
        let Ports { input, output } = context.ports();
        CALLS.with(|calls| calls.set(calls.get() + 1));
        COUNTER.with(|counter| counter.fetch_add(context.settings().cycles, Relaxed));
        context.map_axis_contexts([input], [output], |_, _, [signal]| [signal]);
    }
}

const SLOWS: ModuleKinds = dimsart_core::kinds![Slow];

const DOF: usize = 2;
const SPARE_CYCLES: u32 = 50;
/// Cost of a call: 400 and 50 for each of two axes.
const COST: u32 = 500;
const BUDGET: u32 = COST + COST / 4 + SPARE_CYCLES;
static COSTS: [Cost; 2] = [Cost::new(1000, 0), Cost::new(400, 50)];

fn slow(number: u8) -> ModuleRef {
    ModuleRef::new(Slow::NAME, number)
}

/// The first module drives the device, the second reads the first's output, the third is independent.
fn bench() -> Bench {
    bench_with_counter(1)
}

/// A controller whose counter has so many counts per cycle.
fn bench_with_counter(counts_per_cycle: u32) -> Bench {
    let mut bench = Bench::with_kinds(SLOWS, DOF, &[types::SIGNAL], &[types::DES_FORCE]);
    let engine = bench.dimsart.engine_mut();
    engine.set_costs(Some(Costs::new(&COSTS, const { &[KindId::from_name(Slow::NAME)] })));
    let counter =
        Counter::counting_up(COUNTER.with(|counter| *counter)).with_counts_per_cycle(counts_per_cycle);
    engine.set_call_timer(counter, SPARE_CYCLES);
    let signal = |number| dimsart_core::TypeRef { id: types::SIGNAL_OUT.id, number };
    let bindings = [
        (types::SIGNAL.first(), types::DES_FORCE.first()),
        (types::DES_FORCE.first(), signal(2)),
        (types::SIGNAL.first(), signal(3)),
    ];
    for (number, (input, output)) in (1..).zip(bindings) {
        bench.dimsart.command(Command::bind(slow(number), 0, input)).unwrap();
        bench.dimsart.command(Command::bind(slow(number), 1, output)).unwrap();
        bench.dimsart.command(Command::PlugIn(slow(number))).unwrap();
    }
    bench.dimsart.command(Command::Check).unwrap();
    bench
}

fn set_cycles(bench: &mut Bench, number: u8, cycles: u32) {
    bench.rows(&format!("SLOW_MOD.{number} CYCLES {cycles}"));
}

#[test]
fn a_call_may_take_its_cost_a_quarter_more_and_what_interrupts_take() {
    let mut bench = bench();
    for cycles in [0, COST, COST * 11 / 10, BUDGET] {
        (1..=3).for_each(|number| set_cycles(&mut bench, number, cycles));
        for _ in 0..100 {
            assert_eq!(bench.tick(&[1.0, -2.0]), [1.0, -2.0], "{cycles} cycles");
        }
        assert_eq!(bench.dimsart.engine().module_fault(), None);
    }
}

#[test]
fn a_budget_is_in_cycles_whatever_the_counter_counts() {
    let mut bench = bench_with_counter(3);
    set_cycles(&mut bench, 1, 3 * BUDGET);
    assert_eq!(bench.tick(&[1.0, -2.0]), [1.0, -2.0]);
    set_cycles(&mut bench, 1, 3 * BUDGET + 1);
    assert_eq!(bench.try_tick(&[1.0_f32.into(); 2]).0, TickResult::ModuleFailed(slow(1)));
    let cause = bench.dimsart.engine().module_fault().map(|fault| fault.cause);
    assert_eq!(cause, Some(FaultCause::TimeExceeded { budget_cycles: BUDGET }));
}

#[test]
fn one_that_is_cut_out_is_in_the_log_once_though_the_device_goes_on() {
    static LOG: EventLog = EventLog::new();
    let mut bench = bench();
    let mut info: DeviceInfo = DeviceInfo::new("").with_events(&LOG);
    set_cycles(&mut bench, 3, BUDGET + 1);
    for _ in 0..3 {
        let (tick, _) = bench.try_tick(&[1.0_f32.into(); 2]);
        info.end_tick(tick, &bench.dimsart);
    }
    let cut_out: Vec<_> =
        (0..).map_while(|back| LOG.get(back)).filter(|event| event.module.is_some()).collect();
    assert_eq!(cut_out.len(), 1, "{cut_out:?}");
    let Event { tick, what, module, detail, .. } = cut_out[0];
    assert_eq!((tick, what, module, detail), (1, EventKind::ModuleIsolated as u8, Some(slow(3)), BUDGET));
}

#[test]
fn one_that_takes_longer_is_cut_out_in_that_tick_with_what_depends_on_it() {
    for percent in [127, 140, 150, 200, 300, 600] {
        let cycles = (COST * percent / 100).max(BUDGET + 1);
        let mut bench = bench();
        assert_eq!(bench.tick(&[1.0, -2.0]), [1.0, -2.0]);
        // The device does not depend on the third module.
        set_cycles(&mut bench, 3, cycles);
        assert_eq!(bench.tick(&[1.0, -2.0]), [1.0, -2.0]);
        assert_eq!(bench.dimsart.engine().isolated_modules().collect::<Vec<_>>(), [slow(3)]);
        let (tick, commanded) = {
            set_cycles(&mut bench, 1, cycles);
            CALLS.set(0);
            bench.try_tick(&[1.0_f32.into(), (-2.0_f32).into()])
        };
        assert_eq!(tick, TickResult::ModuleFailed(slow(1)), "{percent} %");
        assert!(commanded.iter().all(|word| word.0 == 0), "{commanded:?}");
        assert_eq!(CALLS.get(), 1, "dependents and previously isolated modules are not called");
        assert_eq!(bench.dimsart.engine().isolated_modules().count(), 3);
        let fault = bench.dimsart.engine().module_fault().unwrap();
        assert_eq!(fault.module, slow(1));
        assert_eq!(fault.cause, FaultCause::TimeExceeded { budget_cycles: BUDGET });
        let text = bench.dimsart.engine().explain_module_fault(fault).to_string();
        assert!(text.contains(&format!("SLOW_MOD exceeded its budget of {BUDGET} cycles")), "{text}");
        // It latches until a reset; a reset alone does not repair it.
        set_cycles(&mut bench, 1, 0);
        assert_eq!(bench.try_tick(&[1.0_f32.into(); 2]).0, TickResult::ModuleFailed(slow(1)));
        bench.dimsart.command(Command::Reset).unwrap();
        set_cycles(&mut bench, 3, 0);
        assert_eq!(bench.tick(&[1.0, -2.0]), [1.0, -2.0]);
        set_cycles(&mut bench, 1, cycles);
        assert_eq!(bench.try_tick(&[1.0_f32.into(); 2]).0, TickResult::ModuleFailed(slow(1)));
    }
}

#[test]
fn without_costs_a_call_may_take_as_long_as_it_likes() {
    let mut bench = bench();
    bench.dimsart.engine_mut().set_costs(None);
    set_cycles(&mut bench, 1, 1_000_000);
    // The change of the scheme recomputes the budgets.
    bench.dimsart.command(Command::Unplug(slow(3))).unwrap();
    assert_eq!(bench.tick(&[1.0, -2.0]), [1.0, -2.0]);
}
