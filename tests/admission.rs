//! Where a tick may take so long only, a module that could make it longer is not plugged in.
#![expect(clippy::unwrap_used, clippy::panic, reason = "in helpers of tests as in tests")]

mod common;

use std::num::NonZeroU32;

use common::Bench;
use dimsart_core::modules::{COSTS, P, Standard, TICK};
use dimsart_core::saved_scheme::{LoadError, fingerprint, load, save};
use dimsart_core::{
    Command, CommandError, Cost, Costs, Data, Engine, Input, Module, ModuleList, ModuleRef, Output, Ports,
    Verb, types,
};
use proptest::prelude::*;

const SCHEME: &str = include_str!("../schemes/bilateral.scheme");
const DOF: usize = 3;

fn robot<M: ModuleList>() -> Bench<M> {
    Bench::of(DOF, &[types::POSITION, types::DES_POSITION], &[types::DES_FORCE])
}

fn limit<M: ModuleList>(bench: &mut Bench<M>, cycles: u32) {
    bench.dimsart.engine_mut().limit_cycles(NonZeroU32::new(cycles));
}

fn module(name: &str) -> ModuleRef {
    Engine::<Standard>::module(name).unwrap()
}

fn cost(name: &str) -> u32 {
    robot::<Standard>().dimsart.engine().cycles_of(module(name).kind).unwrap()
}

#[test]
fn every_kind_of_the_library_has_a_cost_that_grows_with_the_axes_or_stays() {
    for kind in Standard::KINDS {
        let cost = kind.cost.unwrap_or_else(|| panic!("{}: run `cargo xtask costs`", kind.name));
        assert!(cost.cycles(1) > 0 && cost.cycles(7) >= cost.cycles(1), "{}", kind.name);
    }
    assert!(COSTS.iter().all(|(name, _)| Standard::KINDS.iter().any(|kind| kind.name == *name)));
}

#[test]
fn a_tick_costs_itself_and_what_is_plugged_in() {
    let mut bench = robot::<Standard>();
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
        let mut bench = robot::<Standard>();
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
    let mut bench = robot::<Standard>();
    limit(&mut bench, TICK.cycles(DOF) + cost("PDCTRL_MOD").max(cost("PCTRL_MOD")));
    bench.rows("MOD_ENG MOD_ON PDCTRL_MOD");
    assert!(matches!(bench.order("MOD_ENG MOD_ON PCTRL_MOD"), Err(CommandError::TooSlow { .. })));
    bench.rows("MOD_ENG MOD_OFF PDCTRL_MOD\nMOD_ENG MOD_ON PCTRL_MOD");
    assert!(matches!(bench.order("MOD_ENG MOD_ON PDCTRL_MOD"), Err(CommandError::TooSlow { .. })));
    bench.rows("MOD_ENG MOD_CLOSE PCTRL_MOD\nMOD_ENG MOD_ON PDCTRL_MOD");
}

#[test]
fn without_a_limit_every_module_is_taken_and_with_one_of_a_cycle_none() {
    let mut bench = robot::<Standard>();
    for kind in Standard::KINDS {
        bench.rows(&format!("MOD_ENG MOD_ON {}", kind.name));
    }
    let mut bench = robot::<Standard>();
    limit(&mut bench, 1);
    for kind in Standard::KINDS {
        let refused = bench.order(&format!("MOD_ENG MOD_ON {}", kind.name));
        assert!(matches!(refused, Err(CommandError::TooSlow { limit_cycles: 1, .. })), "{refused:?}");
    }
    assert_eq!(bench.dimsart.engine().usage().modules, 0);
}

/// A control law that nobody has worked out the cost of.
#[derive(Debug, Default)]
struct Own {
    position: Input,
    force: Output,
}

impl Module for Own {
    const NAME: &'static str = "OWN_MOD";
    const SUMMARY: &'static str = "As a user writes it.";

    fn activate(&mut self, ports: &mut Ports<'_>) {
        ports.input(&mut self.position, "POSITION", types::POSITION);
        ports.output(&mut self.force, "DES_FORCE", types::DES_FORCE);
    }

    fn compute(&mut self, _: &Data<'_>) {}
}

const OWN_COSTS: &Costs = &[("OWN_MOD", Cost::new(100, 10))];

dimsart_core::module_list! {
    enum Unknown { Own(Own), P(P) }
}
dimsart_core::module_list! {
    enum Known { Own(Own), P(P) }
    costs [OWN_COSTS, COSTS]
}

#[test]
fn a_kind_of_unknown_cost_is_refused_under_a_limit_only() {
    let mut bench = robot::<Unknown>();
    limit(&mut bench, u32::MAX);
    let before = bench.snapshot();
    let own = ModuleRef { kind: 0, number: 1 };
    assert_eq!(bench.order("MOD_ENG MOD_ON OWN_MOD"), Err(CommandError::CostUnknown(own)));
    assert_eq!(bench.snapshot(), before);
    limit(&mut bench, 0);
    bench.rows("MOD_ENG MOD_ON OWN_MOD");
    assert_eq!(bench.dimsart.engine().tick_cycles(), None);
    let mut bench = robot::<Known>();
    limit(&mut bench, u32::MAX);
    bench.rows("MOD_ENG MOD_ON OWN_MOD");
    assert_eq!(bench.dimsart.engine().tick_cycles(), Some(TICK.cycles(DOF) + Cost::new(100, 10).cycles(DOF)));
    assert_eq!(Known::KINDS[1].cost.unwrap().cycles(DOF), cost("PCTRL_MOD"));
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
    dimsart_core::scheme::load(SCHEME, "master", &["master", "slave"], &mut bench.dimsart, |error| {
        panic!("{error:?}")
    });
    bench
}

fn any_command() -> impl Strategy<Value = Command> {
    let module = (0..18_u8, 0..4_u8).prop_map(|(kind, number)| ModuleRef { kind, number });
    let verbs = vec![Verb::ModOn, Verb::ModOn, Verb::ModOn, Verb::ModOff, Verb::PlaceBefore, Verb::ModClose];
    let about =
        (module, prop::sample::select(verbs)).prop_map(|(module, verb)| Command::engine(verb, module));
    let plain =
        prop::sample::select(vec![Verb::MatchingCheck, Verb::Stop, Verb::Reset]).prop_map(Command::plain);
    prop_oneof![19 => about, 2 => plain, 1 => Just(Command::plain(Verb::Close))]
}

proptest! {
    #[test]
    fn no_commands_bring_a_tick_over_its_limit(
        limit_cycles in 500..20_000_u32,
        commands in prop::collection::vec(any_command(), 0..120),
    ) {
        let mut bench = robot::<Standard>();
        limit(&mut bench, limit_cycles);
        for command in commands {
            let refused = bench.dimsart.command(command);
            let engine = bench.dimsart.engine();
            let active = engine.instances().filter(|module| engine.is_plugged_in(*module));
            let costs: u32 = active.map(|module| engine.cycles_of(module.kind).unwrap()).sum();
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
