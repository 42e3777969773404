//! Schemes in flash with a power loss at every byte, and in worn flash.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]

#[path = "common/board.rs"]
mod board;
mod common;

use std::num::NonZeroU32;

use dimsart_core::{Command, CommandError, TypeRef, types};
use dimsart_link::protocol::{Fallback, Origin, SchemeStatus, Trial};
use dimsart_link::saved_scheme::{LoadError, SchemeBytes, Writer, fingerprint, load, save};
use dimsart_modules::ALL;
use embassy_futures::block_on;
use firmware::{SchemeStore, start};

use board::{BUILT_IN, Board, blank_flashes, controller, scheme, store};
use common::{Flash, PAGE, PAGES, WORD};

/// Steps of a user.
#[derive(Debug, Clone, Copy)]
enum Step {
    Save(u16),
    Confirm,
    RollBack,
    Restart,
}

/// A simple model of the stored state.
#[derive(Debug, Clone, Copy, Default)]
struct Model {
    saved: Option<u16>,
    trial: Option<(u16, bool)>,
}

impl Model {
    fn step(self, step: Step) -> Self {
        match step {
            Step::Save(gain) => Self { trial: Some((gain, false)), ..self },
            Step::Confirm => Self { saved: self.trial.map(|(gain, _)| gain), trial: None },
            Step::RollBack => Self { trial: None, ..self },
            Step::Restart => Self { trial: self.trial.map(|(gain, _)| (gain, true)), ..self },
        }
    }

    /// The scheme of a start without a new one on trial.
    fn confirmed(self) -> (u16, Origin) {
        self.saved.map_or((BUILT_IN, Origin::BuiltIn), |gain| (gain, Origin::Saved))
    }

    /// The scheme of the next start.
    fn next(self) -> (u16, Origin) {
        match self.trial {
            Some((gain, false)) => (gain, Origin::Trial),
            _ => self.confirmed(),
        }
    }
}

/// Long enough to use every page again.
fn script() -> Vec<Step> {
    use Step::{Confirm, Restart, RollBack, Save};
    let round = |gain: u16| {
        vec![
            Save(gain),
            Restart,
            Confirm,
            Restart,
            Save(gain + 1),
            Restart,
            Restart,
            Save(gain + 2),
            Save(gain + 3),
            RollBack,
            Restart,
            Save(gain + 4),
            Restart,
            Save(gain + 5),
            Restart,
            Confirm,
        ]
    };
    let mut script: Vec<_> = (0..4).flat_map(|number| round(10 + 7 * number)).collect();
    // An old confirmed scheme is moved from page to page.
    script.extend((0..24).flat_map(|gain| [Save(gain), RollBack]));
    script
}

/// Executes a step; returns the flash, and whether the step was completed.
fn act(step: Step, flash: Flash) -> (Flash, bool) {
    if matches!(step, Step::Restart) {
        let board = Board::start(flash);
        return (board.store.into_flash(), board.status.fallback != Some(Fallback::Storage));
    }
    let mut store = store(flash);
    store.open().unwrap();
    let result = match step {
        Step::Save(gain) => block_on(store.save(&scheme(gain))),
        Step::Confirm => block_on(store.confirm()),
        Step::RollBack | Step::Restart => block_on(store.roll_back()),
    };
    (store.into_flash(), result.is_ok())
}

#[test]
fn after_a_cut_at_any_write_the_old_or_the_new_scheme_runs_whole_and_commands_are_answered() {
    blank_flashes().into_iter().for_each(cut_at_any_write);
}

fn cut_at_any_write(mut flash: Flash) {
    let (mut model, mut cuts) = (Model::default(), 0);
    for step in script() {
        let next = model.step(step);
        for power in 0.. {
            let (mut cut, is_done) = act(step, Flash { power: Some(power), ..flash.clone() });
            if cut.power != Some(0) {
                assert!(is_done, "{step:?}");
                break;
            }
            cuts += 1;
            cut.power = None;
            let mut board = Board::start(cut);
            let found = (board.running(), board.status.origin);
            let allowed = [model.next(), next.next()];
            assert!(allowed.contains(&found), "{step:?} cut at {power}: {found:?} instead of {allowed:?}");
            // The store works as before.
            block_on(board.store.save(&scheme(77))).unwrap();
            let mut board = Board::start(board.store.into_flash());
            assert_eq!(
                (board.running(), board.status.origin),
                (77, Origin::Trial),
                "{step:?} cut at {power}"
            );
            // The confirmed scheme is kept if the new one is not confirmed.
            let mut board = Board::start(board.store.into_flash());
            let found = (board.running(), board.status.origin);
            let allowed = [model.confirmed(), next.confirmed()];
            assert!(allowed.contains(&found), "{step:?} cut at {power}: {found:?} instead of {allowed:?}");
        }
        flash = act(step, flash).0;
        model = next;
    }
    assert!(flash.erasures.iter().all(|erasures| *erasures > 0), "{:?}", flash.erasures);
    assert!(cuts > 9000, "{cuts} cuts: too little was written");
}

#[test]
fn ten_thousand_saved_schemes_lose_nothing_and_wear_every_page_alike() {
    blank_flashes().into_iter().for_each(save_ten_thousand);
}

fn save_ten_thousand(flash: Flash) {
    let schemes: Vec<_> = (0..100).map(scheme).collect();
    let mut board = Board::start(flash);
    for cycle in 0..10_000_u16 {
        block_on(board.store.save(&schemes[usize::from(cycle % 100)])).unwrap();
        if cycle % 100 == 50 {
            board = Board::start(board.store.into_flash());
            assert_eq!((board.running(), board.status.origin), (50, Origin::Trial), "cycle {cycle}");
        } else {
            block_on(board.store.begin_trial()).unwrap();
        }
        block_on(board.store.confirm()).unwrap();
        if cycle % 100 == 99 {
            board = Board::start(board.store.into_flash());
            assert_eq!((board.running(), board.status.origin), (99, Origin::Saved), "cycle {cycle}");
        }
    }
    let flash = board.store.into_flash();
    let (least, most) = (flash.erasures.iter().min().unwrap(), flash.erasures.iter().max().unwrap());
    // A page of an STM32G4 endures 10 000 erasures.
    assert!(*most < 2_000 && most - least <= 1, "{:?}", flash.erasures);
}

#[test]
fn a_flash_full_of_something_else_is_told_of_and_taken_over_by_a_save() {
    let mut seed = 1_u32;
    let mut noise = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        seed.to_le_bytes()[3]
    };
    for round in 0..200 {
        let mut flash = Flash::new();
        // All of it, or a part, in some page.
        let range = if round % 2 == 0 { 0..PAGES * PAGE } else { usize::from(noise()) * 16..5_000 };
        flash.bytes[range.clone()].fill_with(&mut noise);
        flash.is_written[range.start / WORD..range.end.div_ceil(WORD)].fill(true);
        let mut board = Board::start(flash);
        let found = (board.running(), board.status.origin, board.status.fallback);
        assert_eq!(found, (BUILT_IN, Origin::BuiltIn, Some(Fallback::Storage)), "round {round}");
        block_on(board.store.save(&scheme(7))).unwrap();
        let mut board = Board::start(board.store.into_flash());
        assert_eq!((board.running(), board.status.origin), (7, Origin::Trial), "round {round}");
    }
    assert_eq!(Board::start(Flash::new()).status.fallback, None);
}

/// A scheme without modules.
fn nothing(fingerprint: u32) -> SchemeBytes {
    let mut bytes = SchemeBytes::new();
    Writer::new(&mut bytes, fingerprint).finish().unwrap();
    bytes
}

/// A board with these bytes on trial.
fn with_trial(bytes: &[u8]) -> Board {
    let mut board = Board::start(Flash::new());
    block_on(board.store.save(&scheme(5))).unwrap();
    let mut board = Board::start(board.store.into_flash());
    block_on(board.store.confirm()).unwrap();
    block_on(board.store.save(bytes)).unwrap();
    Board::start(board.store.into_flash())
}

#[test]
fn a_scheme_on_trial_that_does_not_load_gives_way_to_the_saved_one_with_the_reason() {
    let print = fingerprint(controller().engine_mut());
    let mut damaged = scheme(6);
    damaged[10] ^= 1;
    let faults = CommandError::HasFaults { faults: 1 };
    for (bytes, reason) in [
        (nothing(print).as_slice(), LoadError::Refused { command: 0, error: faults }),
        (&nothing(print ^ 1), LoadError::IncompatibleImage),
        (&damaged, LoadError::Damaged),
        (&[], LoadError::Damaged),
    ] {
        let mut board = with_trial(bytes);
        let expected = SchemeStatus {
            origin: Origin::Saved,
            fallback: Some(Fallback::Trial(reason)),
            trial: Trial::Tried,
            is_saved: true,
        };
        assert_eq!((board.status, board.running()), (expected, 5));
        let board = Board::start(board.store.into_flash());
        assert_eq!(
            (board.status.origin, board.status.fallback),
            (Origin::Saved, Some(Fallback::Unconfirmed))
        );
    }
}

#[test]
fn a_saved_scheme_of_another_image_gives_way_to_the_built_in_one() {
    let print = fingerprint(controller().engine_mut());
    let mut board = Board::start(Flash::new());
    block_on(board.store.save(&nothing(print ^ 1))).unwrap();
    block_on(board.store.confirm()).unwrap();
    let mut board = Board::start(board.store.into_flash());
    let fallback = Some(Fallback::Saved(LoadError::IncompatibleImage));
    let expected = SchemeStatus { origin: Origin::BuiltIn, fallback, trial: Trial::None, is_saved: true };
    assert_eq!((board.status, board.running()), (expected, BUILT_IN));
}

#[test]
fn without_any_scheme_that_loads_the_board_is_empty_and_answers() {
    let mut dimsart = controller();
    let status =
        block_on(start(None::<&mut SchemeStore<Flash>>, &mut SchemeBytes::new(), &[1, 2, 3], &mut dimsart));
    let fallback = Some(Fallback::BuiltIn(LoadError::Damaged));
    let expected = SchemeStatus { origin: Origin::Empty, fallback, trial: Trial::None, is_saved: false };
    assert_eq!((status, dimsart.engine().usage().modules), (expected, 0));
}

#[test]
fn a_saved_scheme_that_takes_too_long_gives_way_to_the_built_in_one() {
    let mut larger = controller();
    load(&scheme(5), fingerprint(larger.engine_mut()), &mut larger).unwrap();
    let p = ALL.module("PCTRL_MOD").unwrap();
    let beside = TypeRef { number: 2, ..types::DES_FORCE.first() };
    larger.command(Command::bind(p, 2, beside)).unwrap();
    larger.command(Command::PlugIn(p)).unwrap();
    let mut board = Board::start(Flash::new());
    block_on(board.store.save(&save(larger.engine_mut()).unwrap())).unwrap();
    block_on(board.store.confirm()).unwrap();

    let limit_cycles = board.dimsart.engine().tick_cycles().unwrap();
    let mut store = store(board.store.into_flash());
    let mut dimsart = controller();
    dimsart.engine_mut().set_cycle_limit(NonZeroU32::new(limit_cycles));
    let status = block_on(start(Some(&mut store), &mut SchemeBytes::new(), &scheme(BUILT_IN), &mut dimsart));
    let Some(Fallback::Saved(LoadError::Refused { error, .. })) = status.fallback else {
        panic!("{status:?}")
    };
    let tick_cycles = larger.engine().tick_cycles().unwrap();
    let cycles = tick_cycles - limit_cycles;
    assert_eq!(error, CommandError::TooSlow { module: p, cycles, tick_cycles, limit_cycles });
    assert_eq!((status.origin, status.is_saved), (Origin::BuiltIn, true));
    assert_eq!(Board { store, dimsart, status }.running(), BUILT_IN);
}
