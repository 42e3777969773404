//! With a cycle limit, a module that could make a tick too long is not plugged in.
#![expect(clippy::unwrap_used, clippy::panic, reason = "in helpers of tests as in tests")]

use std::num::NonZeroU32;

use crate::common::Bench;
use crate::common::IDS;
use crate::common::module_at;
use dimsart_core::{Command, CommandError, Cost, Costs, ModuleRef, types};
use dimsart_link::saved_scheme::{LoadError, fingerprint, load, save};
use dimsart_modules::ALL;
use proptest::prelude::*;

const SCHEME: &str = include_str!("../../../schemes/bilateral.scheme");
const DOF: usize = 3;

const KINDS: usize = ALL.list().len();
const TICK: Cost = Cost::new(557, 69);
/// As in a stamp: the tick's cost, then one for each kind.
const LINES: [Cost; 1 + KINDS] = {
    let mut lines = [TICK; 1 + KINDS];
    let (mut rest, mut per_dof): (&mut [Cost], u16) = (&mut lines, 20);
    while let [next, others @ ..] = rest {
        *next = Cost::new(10 * per_dof, per_dof);
        (rest, per_dof) = (others, per_dof + 1);
    }
    lines[0] = TICK;
    lines
};
/// Costs of an image whose stamp lacks the last kind.
const LACKING: [Cost; 1 + KINDS] = {
    let mut lines = LINES;
    lines[KINDS] = Cost::UNKNOWN;
    lines
};

fn robot() -> Bench {
    stamped(&LINES)
}

fn stamped(lines: &'static [Cost]) -> Bench {
    let mut bench = Bench::of(DOF, &[types::POSITION, types::DES_POSITION], &[types::DES_FORCE]);
    bench.dimsart.engine_mut().set_costs(Some(Costs::new(lines, &IDS)));
    bench
}

fn limit(bench: &mut Bench, cycles: u32) {
    bench.dimsart.engine_mut().set_cycle_limit(NonZeroU32::new(cycles));
}

fn module(name: &str) -> ModuleRef {
    ALL.module(name).unwrap()
}

fn cost(name: &str) -> u32 {
    robot().dimsart.engine().module_cycles(module(name).kind).unwrap()
}

#[test]
fn a_tick_costs_itself_and_what_is_plugged_in() {
    let mut bench = robot();
    let own = TICK.cycles(DOF);
    let cycles = |bench: &Bench| bench.dimsart.engine().tick_cycles();
    assert_eq!(cycles(&bench), Some(own));
    bench.rows("PDCTRL_MOD K_PARAM 1\nMOD_ENG MOD_ON PCTRL_MOD");
    assert_eq!(cycles(&bench), Some(own + cost("PCTRL_MOD")), "PDCTRL_MOD is not plugged in");
    bench.rows("MOD_ENG MOD_ON PDCTRL_MOD\nMOD_ENG MOD_OFF PCTRL_MOD");
    assert_eq!(cycles(&bench), Some(own + cost("PDCTRL_MOD")));
    bench.rows("MOD_ENG CLOSE");
    assert_eq!(cycles(&bench), Some(own));
}

#[test]
fn a_module_too_many_is_refused_with_the_numbers_and_changes_nothing() {
    let limit_cycles = TICK.cycles(DOF) + cost("PDCTRL_MOD") + cost("SUM_MOD") - 1;
    for existed in [false, true] {
        let mut bench = robot();
        limit(&mut bench, limit_cycles);
        bench.run("PDCTRL_MOD K_PARAM 10\nMOD_ENG MOD_ON PDCTRL_MOD");
        if existed {
            bench.rows("SUM_MOD A_GAIN 2");
        }
        bench.tick(&[0.1, 0.2, 0.3, 0.4, 0.5, 0.6]);
        let before = bench.snapshot();
        let too_slow = CommandError::TooSlow {
            module: module("SUM_MOD"),
            cycles: cost("SUM_MOD"),
            tick_cycles: limit_cycles + 1,
            limit_cycles,
        };
        assert_eq!(bench.order("MOD_ENG MOD_ON SUM_MOD"), Err(too_slow));
        assert_eq!(bench.snapshot(), before);
        let message = too_slow.to_string();
        for number in [cost("SUM_MOD"), limit_cycles, limit_cycles + 1] {
            assert!(message.contains(&number.to_string()), "{message}");
        }
    }
}

#[test]
fn a_module_that_just_fits_is_taken_and_unplugging_makes_room() {
    let mut bench = robot();
    limit(&mut bench, TICK.cycles(DOF) + cost("PDCTRL_MOD").max(cost("PCTRL_MOD")));
    bench.rows("MOD_ENG MOD_ON PDCTRL_MOD");
    assert!(matches!(bench.order("MOD_ENG MOD_ON PCTRL_MOD"), Err(CommandError::TooSlow { .. })));
    bench.rows("MOD_ENG MOD_OFF PDCTRL_MOD\nMOD_ENG MOD_ON PCTRL_MOD");
    assert!(matches!(bench.order("MOD_ENG MOD_ON PDCTRL_MOD"), Err(CommandError::TooSlow { .. })));
    bench.rows("MOD_ENG MOD_CLOSE PCTRL_MOD\nMOD_ENG MOD_ON PDCTRL_MOD");
}

#[test]
fn without_a_limit_every_module_is_taken_and_with_one_of_a_cycle_none() {
    let mut bench = robot();
    for kind in ALL.list() {
        bench.rows(&format!("MOD_ENG MOD_ON {0}\nMOD_ENG MOD_CLOSE {0}", kind.name));
    }
    limit(&mut bench, 1);
    for kind in ALL.list() {
        let refused = bench.order(&format!("MOD_ENG MOD_ON {}", kind.name));
        assert!(matches!(refused, Err(CommandError::TooSlow { limit_cycles: 1, .. })), "{refused:?}");
    }
    assert_eq!(bench.dimsart.engine().usage().modules, 0);
}

#[test]
fn a_kind_that_the_stamp_lacks_is_refused_under_a_limit_only() {
    let name = ALL.list()[KINDS - 1].name;
    let mut bench = stamped(&LACKING);
    limit(&mut bench, u32::MAX);
    let before = bench.snapshot();
    let plug_in = format!("MOD_ENG MOD_ON {name}");
    assert_eq!(bench.order(&plug_in), Err(CommandError::CostUnknown(module(name))));
    assert_eq!(bench.snapshot(), before);
    limit(&mut bench, 0);
    bench.rows(&plug_in);
    assert_eq!(bench.dimsart.engine().tick_cycles(), None);
}

#[test]
fn without_costs_nothing_is_refused_for_them_and_nothing_is_said_of_a_tick() {
    let mut bench = robot();
    bench.dimsart.engine_mut().set_costs(None);
    limit(&mut bench, 1);
    for kind in ALL.list() {
        bench.rows(&format!("MOD_ENG MOD_ON {}", kind.name));
        let engine = bench.dimsart.engine();
        assert_eq!(
            (engine.usage().modules, engine.tick_cycles(), engine.module_cycles(kind.id)),
            (1, None, None)
        );
        bench.rows(&format!("MOD_ENG MOD_CLOSE {}", kind.name));
    }
}

#[test]
fn a_saved_scheme_that_takes_too_long_is_not_loaded() {
    let mut bench = shipped();
    let bytes = save(bench.dimsart.engine_mut()).unwrap();
    let image = fingerprint(bench.dimsart.engine_mut());
    let cycles = bench.dimsart.engine().tick_cycles().unwrap();
    limit(&mut bench, cycles);
    load(&bytes, image, &mut bench.dimsart).unwrap();
    limit(&mut bench, cycles - 1);
    let error = load(&bytes, image, &mut bench.dimsart).unwrap_err();
    let LoadError::Refused { error: CommandError::TooSlow { tick_cycles, .. }, .. } = error else {
        panic!("{error:?}")
    };
    assert_eq!(tick_cycles, cycles);
    let engine = bench.dimsart.engine();
    assert_eq!((engine.is_running(), engine.usage().modules), (false, 0));
}

fn shipped() -> Bench {
    let mut bench = Bench::of(DOF, &[types::POSITION], &[types::DES_FORCE]);
    bench.dimsart.engine_mut().set_costs(Some(Costs::new(&LINES, &IDS)));
    dimsart_core::scheme::load(SCHEME, "master", &["master", "slave"], &mut bench.dimsart, |error| {
        panic!("{error:?}")
    });
    bench
}

fn any_command() -> impl Strategy<Value = Command> {
    let module = (0..18_usize, 0..4_u8).prop_map(|(kind, number)| module_at(kind, number));
    let about = prop_oneof![
        3 => module.clone().prop_map(Command::PlugIn),
        1 => module.clone().prop_map(Command::Unplug),
        1 => module.clone().prop_map(Command::PlaceBefore),
        1 => module.prop_map(Command::CloseModule),
    ];
    let plain = prop::sample::select(vec![Command::Check, Command::Stop, Command::Reset]);
    prop_oneof![19 => about, 2 => plain, 1 => Just(Command::Close)]
}

proptest! {
    #[test]
    fn no_commands_bring_a_tick_over_its_limit(
        limit_cycles in 500..20_000_u32,
        commands in prop::collection::vec(any_command(), 0..120),
    ) {
        let mut bench = robot();
        limit(&mut bench, limit_cycles);
        for command in commands {
            let refused = bench.dimsart.command(command);
            let engine = bench.dimsart.engine();
            let active = engine.instances().filter(|module| engine.is_plugged_in(*module));
            let costs: u32 = active.map(|module| engine.module_cycles(module.kind).unwrap()).sum();
            let cycles = TICK.cycles(DOF) + costs;
            prop_assert_eq!(engine.tick_cycles(), Some(cycles));
            prop_assert!(costs == 0 || cycles <= limit_cycles, "{} of {}", cycles, limit_cycles);
            if let Err(CommandError::TooSlow { cycles: added, tick_cycles, .. }) = refused {
                prop_assert_eq!(tick_cycles, cycles + added);
                prop_assert!(tick_cycles > limit_cycles);
            }
        }
    }
}
