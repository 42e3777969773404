//! A module that writes an invalid value is isolated with its dependents in the same tick; all other modules
//! continue.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]
#![expect(clippy::cast_possible_truncation, clippy::cast_precision_loss, reason = "small by construction")]

use std::collections::BTreeSet;

use dimsart_core::{
    Command, Context, DriveEvent, DriveState, FaultCause, Input, Module, ModuleKinds, ModuleRef, Output,
    SafetyReason, TickResult, TypeRef, Value, Word, types, words,
};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

use crate::common::{Bench, Types};

words! {
    ports Ports {
        a: Input = input("A", types::SIGNAL),
        b: Input = delayed().input("B", types::SIGNAL),
        out: Output = output("OUT", types::SIGNAL_OUT),
    }
    parameters Settings {
        /// Whether it corrupts its last axis.
        spoils: bool = flag("SPOILS", false),
    }
}

/// Integrates the sum of two signals, one of which may be a tick old.
#[derive(Debug)]
struct Mix;

impl Module for Mix {
    const NAME: &'static str = "MIX_MOD";
    const SUMMARY: &'static str = "Integrates a sum, or spoils it.";
    type Settings = Settings;
    type Gains = ();
    type State = ();
    type AxisState = f32;
    type Ports = Ports;

    fn compute(context: &Context<'_, Self>) {
        let Ports { a, b, out } = context.ports();
        let Settings { spoils, .. } = context.settings();
        let last = context.dof() - 1;
        context.map_axis_contexts([a, b], [out], |axis, lane, [a, b]| {
            let sum = lane.axis() * 0.5 + 0.25 * (a + b) + 1.0;
            let sum = if spoils && axis == last { f32::NAN } else { sum };
            lane.set_axis(sum);
            [sum]
        });
    }
}

const MIXERS: ModuleKinds = dimsart_core::kinds![Mix];

const DOF: usize = 2;
const NO_TYPES: Types = &[];

fn mix(number: u8) -> ModuleRef {
    ModuleRef::new(Mix::NAME, number)
}

fn signal(number: u8) -> TypeRef {
    TypeRef { id: types::SIGNAL_OUT.id, number }
}

/// Inputs of every mixer; a mixer has the index of its output.
type Graph = Vec<[u8; 2]>;

/// Random mixers: each reads an earlier mixer or the device, and a later mixer's value of the previous tick.
fn any_graph(random: &mut Pcg32) -> Graph {
    let count = 2 + (random.next_u32() % 20) as u8;
    let below = |random: &mut Pcg32, bound: u8| (random.next_u32() % u32::from(bound)) as u8;
    (1..=count).map(|number| [below(random, number), number + below(random, count - number + 1)]).collect()
}

/// A controller with these mixers. The last one commands the device.
fn bench(graph: &Graph) -> Bench {
    let mut bench = Bench::with_kinds(MIXERS, DOF, &[types::SIGNAL], &[types::DES_FORCE]);
    let give = |bench: &mut Bench, command| bench.dimsart.command(command).unwrap();
    for ([a, b], number) in graph.iter().zip(1..) {
        let a = if *a == 0 { types::SIGNAL.first() } else { signal(*a) };
        let is_last = usize::from(number) == graph.len();
        let out = |number: u8| {
            if usize::from(number) == graph.len() { types::DES_FORCE.first() } else { signal(number) }
        };
        let b = out(*b);
        let own = if is_last { types::DES_FORCE.first() } else { signal(number) };
        for (port, bound) in [a, b, own].into_iter().enumerate() {
            give(&mut bench, Command::bind(mix(number), port as u8, bound));
        }
        give(&mut bench, Command::PlugIn(mix(number)));
    }
    give(&mut bench, Command::Check);
    bench
}

/// Returns the modules that depend on these.
fn reached(graph: &Graph, from: &BTreeSet<u8>) -> BTreeSet<u8> {
    let mut reached = from.clone();
    loop {
        let further = (1..).zip(graph).filter(|(_, reads)| reads.iter().any(|read| reached.contains(read)));
        let further: BTreeSet<u8> = further.map(|(number, _)| number).collect();
        if further.is_subset(&reached) {
            return reached;
        }
        reached.extend(further);
    }
}

fn output(bench: &Bench, graph: &Graph, number: u8) -> Vec<u32> {
    let is_last = usize::from(number) == graph.len();
    let data_base = bench.dimsart.engine().data_base();
    let slot = data_base.slot(if is_last { types::DES_FORCE.first() } else { signal(number) });
    data_base.words(slot.unwrap()).to_vec()
}

fn fallen(bench: &Bench) -> BTreeSet<u8> {
    bench.dimsart.engine().isolated_modules().map(|module| module.number).collect()
}

fn spoil(bench: &mut Bench, number: u8, spoils: bool) {
    bench.dimsart.command(Command::set(mix(number), 0, Value::Flag(spoils))).unwrap();
}

/// Two controllers, one with corrupted modules. Independent modules continue as in the other controller, bit
/// by bit; all others are isolated in the same tick; after a reset all restart.
#[test]
fn what_depends_on_a_module_that_fails_falls_with_it_and_nothing_else_does() {
    let (mut lost, mut kept) = (0, 0);
    for seed in 0..400 {
        let mut random = Pcg32::seed_from_u64(seed);
        let graph = any_graph(&mut random);
        let count = graph.len() as u8;
        let (mut spoiled, mut twin) = (bench(&graph), bench(&graph));
        let mut culprits = BTreeSet::new();
        let measured = |tick: u32| [Word::from(tick as f32), Word::from(-0.5)];
        for tick in 0..60 {
            if tick > 5 && tick < 40 && random.next_u32().is_multiple_of(10) {
                let culprit = 1 + (random.next_u32() % u32::from(count)) as u8;
                spoil(&mut spoiled, culprit, true);
                culprits.insert(culprit);
            }
            let (came, commanded) = spoiled.try_tick(&measured(tick));
            let (_, twins) = twin.try_tick(&measured(tick));
            let expected = reached(&graph, &culprits);
            assert_eq!(fallen(&spoiled), expected, "seed {seed}, tick {tick}: {culprits:?} in {graph:?}");
            for number in (1..=count).filter(|number| !expected.contains(number)) {
                let found = output(&spoiled, &graph, number);
                assert_eq!(found, output(&twin, &graph, number), "seed {seed}, tick {tick}, module {number}");
            }
            let has_lost_device = expected.contains(&count);
            assert_eq!(matches!(came, TickResult::ModuleFailed(_)), has_lost_device, "{came:?}");
            assert_eq!(commanded, if has_lost_device { vec![Word(0); DOF] } else { twins });
            let fault = spoiled.dimsart.engine().module_fault();
            assert_eq!(fault.is_some(), !culprits.is_empty());
            if let Some(fault) = fault {
                assert!(culprits.contains(&fault.module.number));
                let FaultCause::InvalidOutput { word: 1, bits, .. } = fault.cause else {
                    panic!("{fault:?}")
                };
                assert!(f32::from_bits(bits).is_nan());
            }
            lost += u32::from(has_lost_device);
            kept += u32::from(!has_lost_device && !culprits.is_empty());
        }
        culprits.iter().for_each(|culprit| spoil(&mut spoiled, *culprit, false));
        let mut fresh = bench(&graph);
        for bench in [&mut spoiled, &mut twin, &mut fresh] {
            bench.dimsart.command(Command::Reset).unwrap();
        }
        assert_eq!(fallen(&spoiled), BTreeSet::new());
        for tick in 0..20 {
            let (came, commanded) = spoiled.try_tick(&measured(tick));
            assert_eq!(came, TickResult::Ran, "seed {seed}: no invalid value is left");
            assert!(commanded.iter().all(|word| f32::from_bits(word.0).is_finite()));
        }
    }
    assert!(lost > 1_000 && kept > 1_000, "{lost}, {kept}");
}

/// 1 reads the device, 2 reads 1, 3 reads the device, 4 reads 3 and drives the device.
fn two_chains() -> Graph {
    vec![[0, 1], [1, 2], [0, 3], [3, 4]]
}

#[test]
fn a_module_comes_back_by_its_own_reset_and_those_that_fell_with_it_begin() {
    let graph = two_chains();
    let mut bench = bench(&graph);
    for _ in 0..10 {
        assert_eq!(bench.try_tick(&[Word(0); DOF]).0, TickResult::Ran);
    }
    spoil(&mut bench, 1, true);
    assert_eq!(bench.try_tick(&[Word(0); DOF]).0, TickResult::Ran, "the device does not depend on it");
    assert_eq!(fallen(&bench), BTreeSet::from([1, 2]));
    assert_eq!(bench.dimsart.safety().reason(), SafetyReason::None);
    assert_eq!(bench.dimsart.engine().module_fault().map(|fault| fault.module), Some(mix(1)));
    spoil(&mut bench, 1, false);
    bench.dimsart.command(Command::ResetModule(mix(2))).unwrap();
    bench.try_tick(&[Word(0); DOF]);
    assert_eq!(fallen(&bench), BTreeSet::from([1, 2]), "2 itself has not failed");
    bench.dimsart.command(Command::ResetModule(mix(1))).unwrap();
    assert_eq!(output(&bench, &graph, 2), [0; DOF], "what it had written is not read");
    bench.try_tick(&[Word(0); DOF]);
    assert_eq!((fallen(&bench), bench.dimsart.engine().module_fault()), (BTreeSet::new(), None));
    let begun = [1, 2].map(|number| f32::from_bits(output(&bench, &graph, number)[0]));
    assert_eq!(begun.map(f32::to_bits), [1.0_f32, 1.25].map(f32::to_bits), "as in a first tick");
}

#[test]
fn a_transaction_that_puts_another_in_its_place_leaves_nothing_cut_out() {
    let graph = two_chains();
    let mut bench = bench(&graph);
    bench.try_tick(&[Word(0); DOF]);
    spoil(&mut bench, 1, true);
    bench.try_tick(&[Word(0); DOF]);
    let give = |bench: &mut Bench, command| bench.dimsart.command(command).unwrap();
    // A module that only changes its place is still the failed one.
    for command in
        [Command::Begin, Command::Unplug(mix(1)), Command::PlaceBefore(mix(2)), Command::PlugIn(mix(1))]
    {
        give(&mut bench, command);
    }
    assert_eq!(fallen(&bench), BTreeSet::from([1, 2]));
    give(&mut bench, Command::Commit);
    assert_eq!(fallen(&bench), BTreeSet::from([1, 2]));
    for command in [
        Command::Begin,
        Command::Unplug(mix(1)),
        Command::bind(mix(5), 0, types::SIGNAL.first()),
        Command::bind(mix(5), 1, signal(1)),
        Command::bind(mix(5), 2, signal(1)),
        Command::PlaceBefore(mix(2)),
        Command::PlugIn(mix(5)),
        Command::Commit,
    ] {
        give(&mut bench, command);
    }
    assert_eq!((fallen(&bench), bench.dimsart.engine().module_fault()), (BTreeSet::new(), None));
    for _ in 0..5 {
        assert_eq!(bench.try_tick(&[Word(0); DOF]).0, TickResult::Ran);
    }
    assert_eq!(fallen(&bench), BTreeSet::new());
}

/// The limits of each unit, in both directions, to the last bit.
#[test]
fn a_signal_beyond_what_its_unit_can_be_is_a_fault_and_the_largest_value_is_none() {
    for (out, largest) in
        [(types::DES_FORCE, 1e9_f32), (types::DES_POSITION, 1e9), (types::SIGNAL_OUT, f32::MAX)]
    {
        assert_eq!(out.unit.max_magnitude().to_bits(), largest.to_bits());
        let inputs: Types = Box::leak(Box::new([out]));
        for sign in [1.0, -1.0] {
            let mut bench = Bench::of(1, &[types::SIGNAL], inputs);
            bench.rows(&format!("SUM_MOD PORT_SIGNAL_OUT {}", out.name));
            bench.run("SUM_MOD B_GAIN 0\nMOD_ENG MOD_ON SUM_MOD");
            assert_eq!(bench.tick(&[sign * largest]), [sign * largest]);
            let beyond = f32::from_bits(largest.to_bits() + 1);
            if beyond.is_finite() {
                let (tick, commanded) = bench.try_tick(&[Word::from(sign * beyond)]);
                let fault = bench.dimsart.engine().module_fault().unwrap();
                assert_eq!(tick, TickResult::ModuleFailed(fault.module));
                let bits = (sign * beyond).to_bits();
                assert_eq!(fault.cause, FaultCause::InvalidOutput { signal: out.first(), word: 0, bits });
                assert_eq!(commanded, [Word(0)]);
            }
        }
    }
}

/// A packet of the tick in which its sender was isolated is not sent.
#[test]
fn a_sender_that_falls_sends_nothing_until_a_reset() {
    let mut bench = Bench::of(1, &[types::SIGNAL], NO_TYPES);
    bench.run(
        "SUM_MOD A_GAIN 1000000\nMOD_ENG MOD_ON SUM_MOD\nCOMM_TXMOD CTX_ADD_DATA SIGNAL_OUT\n\
         MOD_ENG MOD_ON COMM_TXMOD",
    );
    bench.tick(&[1.0]);
    assert!(bench.dimsart.take_outgoing(0).is_some());
    assert_eq!(bench.try_tick(&[Word::from(f32::MAX)]).0, TickResult::Ran, "no device depends on it");
    assert!(bench.dimsart.take_outgoing(0).is_none());
    bench.tick(&[1.0]);
    assert!(bench.dimsart.take_outgoing(0).is_none());
    assert_eq!(bench.dimsart.engine().isolated_modules().count(), 2);
    bench.rows("MOD_ENG RESET");
    bench.tick(&[1.0]);
    let packet = bench.dimsart.take_outgoing(0).unwrap();
    assert_eq!(packet.counter, 2, "its counter continues");
}

#[test]
fn the_drive_has_the_transitions_of_cia_402_and_no_other() {
    use DriveState::{
        Fault, FaultReactionActive, NotReadyToSwitchOn, OperationEnabled, QuickStopActive, ReadyToSwitchOn,
        SwitchOnDisabled, SwitchedOn,
    };
    // By number, as in the standard's figure; 0 and 1 are one transition here.
    let transitions = [
        (1, NotReadyToSwitchOn, DriveEvent::Initialized, SwitchOnDisabled),
        (2, SwitchOnDisabled, DriveEvent::Shutdown, ReadyToSwitchOn),
        (3, ReadyToSwitchOn, DriveEvent::SwitchOn, SwitchedOn),
        (4, SwitchedOn, DriveEvent::EnableOperation, OperationEnabled),
        (5, OperationEnabled, DriveEvent::DisableOperation, SwitchedOn),
        (6, SwitchedOn, DriveEvent::Shutdown, ReadyToSwitchOn),
        (7, ReadyToSwitchOn, DriveEvent::DisableVoltage, SwitchOnDisabled),
        (7, ReadyToSwitchOn, DriveEvent::QuickStop, SwitchOnDisabled),
        (8, OperationEnabled, DriveEvent::Shutdown, ReadyToSwitchOn),
        (9, OperationEnabled, DriveEvent::DisableVoltage, SwitchOnDisabled),
        (10, SwitchedOn, DriveEvent::DisableVoltage, SwitchOnDisabled),
        (10, SwitchedOn, DriveEvent::QuickStop, SwitchOnDisabled),
        (11, OperationEnabled, DriveEvent::QuickStop, QuickStopActive),
        (12, QuickStopActive, DriveEvent::Stopped, SwitchOnDisabled),
        (12, QuickStopActive, DriveEvent::DisableVoltage, SwitchOnDisabled),
        (14, FaultReactionActive, DriveEvent::Stopped, Fault),
        (15, Fault, DriveEvent::FaultReset, SwitchOnDisabled),
        (16, QuickStopActive, DriveEvent::EnableOperation, OperationEnabled),
    ];
    let events = [
        DriveEvent::Initialized,
        DriveEvent::Shutdown,
        DriveEvent::SwitchOn,
        DriveEvent::EnableOperation,
        DriveEvent::DisableOperation,
        DriveEvent::DisableVoltage,
        DriveEvent::QuickStop,
        DriveEvent::Stopped,
        DriveEvent::Fault,
        DriveEvent::FaultReset,
    ];
    for state in DriveState::ALL {
        for event in events {
            let mut found = transitions.iter().filter(|(_, from, on, _)| (*from, *on) == (state, event));
            let expected = match found.next() {
                Some((_, _, _, to)) => Some(*to),
                // 13: from every state.
                None if event == DriveEvent::Fault && !state.is_fault() => Some(FaultReactionActive),
                None => None,
            };
            assert_eq!(state.transition(event), expected, "{state:?}, {event:?}");
            assert!(found.next().is_none());
        }
    }
    let words = DriveState::ALL.map(|state| state as u8);
    assert_eq!(words, [0x00, 0x40, 0x21, 0x23, 0x27, 0x07, 0x0F, 0x08], "the statusword's bits");
    assert!(DriveState::ALL.iter().all(|state| !state.name().is_empty()));
}
