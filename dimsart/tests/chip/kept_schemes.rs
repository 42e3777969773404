//! Schemes in a board's flash, including slow and failing writes.

use chips::stm32g4::FlashFault;
use chips::{BOARDS, Bench, ChipModel};
use cycles::processor::Reset;
use dimsart::connect::{ConnectError, Device, StoredSchemesReport};

use crate::common::{CommandLine, Shared, bench_of, image};

/// Longer than a start.
const START_S: f64 = 0.1;
/// Time left for commands by the modules, at 168 MHz.
const HALF_TICK_CYCLES: u32 = 84_000;

fn stiffness(shared: &Shared) -> String {
    shared.identify().get("PDCTRL_MOD", "K_PARAM").unwrap().to_string()
}

/// Changes the scheme and saves it for a trial.
fn change_and_save(shared: &Shared, stiffness: &str) -> Result<String, String> {
    shared.identify().set("PDCTRL_MOD", "K_PARAM", stiffness).unwrap();
    write(shared, Device::save).map(|kept| kept.trial.to_owned())
}

/// Writes to the flash of a board. A single-bank board halts during the write, so its scheme is stopped before.
fn write(
    shared: &Shared,
    action: fn(&mut Device<CommandLine>) -> Result<StoredSchemesReport, ConnectError>,
) -> Result<StoredSchemesReport, String> {
    let mut device = shared.identify();
    if shared.bench().board.part == ChipModel::G474re {
        return action(&mut device).map_err(|error| error.to_string());
    }
    let refused = action(&mut device).unwrap_err().to_string();
    assert!(refused.contains("`stop` the scheme first"), "{refused}");
    device.stop().unwrap();
    let done = action(&mut device);
    device.check().unwrap();
    done.map_err(|error| error.to_string())
}

#[test]
fn a_scheme_is_saved_tried_and_confirmed() {
    for board in BOARDS {
        let Some(shared) = Shared::start(board.name) else { return };
        shared.run_for(START_S);
        let built_in = stiffness(&shared);
        assert_eq!(change_and_save(&shared, "0.25").as_deref(), Ok("waits"), "{}", board.name);

        shared.bench().reset();
        shared.run_for(START_S);
        assert_ne!(stiffness(&shared), built_in);
        assert_eq!(write(&shared, Device::confirm).unwrap().origin, "trial");
        shared.bench().reset();
        shared.run_for(START_S);
        let kept = shared.identify().overview().unwrap().status.schemes.unwrap();
        assert_eq!((kept.origin, kept.is_saved), ("saved", true), "{}", board.name);
        assert_ne!(stiffness(&shared), built_in);
        shared.assert_sound();
    }
}

#[test]
fn saving_until_pages_are_erased_holds_up_no_tick_where_there_are_two_banks() {
    for board in BOARDS {
        let Some(shared) = Shared::start(board.name) else { return };
        shared.run_for(START_S);
        let mut saves = 0;
        while shared.bench().chip().flash_writes().0 < 2 {
            saves += 1;
            assert!(saves < 200, "{:?}", shared.bench().chip().flash_writes());
            let stiffness = if saves % 2 == 0 { "0.25" } else { "0.24" };
            assert_eq!(change_and_save(&shared, stiffness).as_deref(), Ok("waits"), "{} {saves}", board.name);
        }
        let timing = shared.identify().overview().unwrap().status.timing.unwrap();
        println!("{}: {saves} saves, {timing:?}", board.name);
        assert!(timing.max_cycles < Some(HALF_TICK_CYCLES), "{timing:?}");
        if board.name == "nucleo-g474re" {
            assert_eq!((timing.late, timing.overruns), (0, 0), "{timing:?}");
        }
        assert_eq!(shared.bench().chip().resets(), [], "{}", board.name);
        shared.assert_sound();
    }
}

#[test]
fn a_scheme_that_the_flash_does_not_take_is_refused() {
    for board in BOARDS {
        for fault in [FlashFault::WriteProtected, FlashFault::WornOut] {
            let Some(shared) = Shared::start(board.name) else { return };
            shared.run_for(START_S);
            let built_in = stiffness(&shared);
            shared.bench().chip().set_flash_fault(fault);
            let refused = change_and_save(&shared, "0.25");
            assert!(refused.is_err(), "{} {fault:?}: {refused:?}", board.name);
            // The scheme continues, and the next start loads the previous one.
            shared.run_for(START_S);
            shared.bench().reset();
            shared.run_for(START_S);
            assert_eq!(stiffness(&shared), built_in, "{} {fault:?}", board.name);
            shared.assert_sound();
        }
    }
}

/// Waits for the start of a reset board, which erases nothing and ends before the watchdog timeout; returns the loaded scheme.
#[track_caller]
fn start_in_time(shared: &Shared, case: &str) -> StoredSchemesReport {
    let erased = shared.bench().chip().flash_writes().0;
    shared.run_for(START_S);
    let (now_erased, resets) = {
        let mut bench = shared.bench();
        (bench.chip().flash_writes().0, bench.chip().resets().to_vec())
    };
    assert!(resets.iter().all(|reset| *reset == Reset::Pin), "{case}: {resets:?}");
    assert_eq!(now_erased, erased, "{case}: erased by a start");
    let kept = shared.identify().stored_schemes().unwrap().unwrap();
    shared.assert_sound();
    kept
}

#[track_caller]
fn restart_in_time(shared: &Shared, case: &str) -> StoredSchemesReport {
    shared.bench().reset();
    start_in_time(shared, case)
}

#[test]
fn every_start_after_a_save_is_in_time_whatever_its_page_is_full_of() {
    for board in BOARDS {
        let Some(shared) = Shared::start(board.name) else { return };
        shared.run_for(START_S);
        for save in 1..=16 {
            let case = format!("{}, save {save}", board.name);
            let stiffness = if save % 2 == 0 { "0.25" } else { "0.24" };
            assert_eq!(change_and_save(&shared, stiffness).as_deref(), Ok("waits"), "{case}");
            let kept = restart_in_time(&shared, &case);
            assert_eq!((kept.origin, kept.reason), ("trial", None), "{case}");
            if save != 4 {
                write(&shared, Device::confirm).unwrap();
            }
            let (erased, _) = shared.bench().chip().flash_writes();
            assert!(erased <= save, "{case}: {erased} pages erased");
        }
    }
}

/// Flash address of a board's schemes.
fn storage(bench: &Bench) -> usize {
    if bench.board.part == ChipModel::G474re { 0x40000 } else { 0x1F000 }
}

#[test]
fn a_power_cut_between_the_words_of_a_trial_s_record_leaves_a_board_that_starts() {
    for board in BOARDS {
        let Some(shared) = Shared::start(board.name) else { return };
        shared.run_for(START_S);
        change_and_save(&shared, "0.25").unwrap();
        let (_, programmed) = shared.bench().chip().flash_writes();
        shared.bench().reset();
        while shared.bench().chip().flash_writes().1 == programmed {
            shared.run_for(20e-6);
        }
        let kept = restart_in_time(&shared, board.name);
        assert_eq!(kept.origin, "trial", "{}", board.name);
        let reason = kept.reason.unwrap();
        assert!(reason.contains("damaged or incomplete"), "{reason}");
        // The next save corrects it.
        change_and_save(&shared, "0.24").unwrap();
        let kept = restart_in_time(&shared, board.name);
        assert_eq!((kept.origin, kept.reason), ("trial", None), "{}", board.name);
    }
}

#[test]
fn a_damaged_byte_of_what_is_kept_is_told_by_a_board_that_starts() {
    for board in BOARDS {
        let Some(shared) = Shared::start(board.name) else { return };
        shared.run_for(START_S);
        change_and_save(&shared, "0.25").unwrap();
        restart_in_time(&shared, board.name);
        let place = storage(&shared.bench());
        let page = shared.bench().chip().flash()[place..][..2048].to_vec();
        let end = page.iter().rposition(|byte| *byte != 0xFF).unwrap().next_multiple_of(8);
        // The record of the trial, part of the scheme, and the header of the page.
        for byte in (end - 16..end - 6).chain([8, 16, 17, 40, 41]).chain([0, 5]) {
            let case = format!("{}, byte {byte} of {end}", board.name);
            let damaged = Shared::of(shared.bench().clone());
            damaged.bench().chip().flash()[place + byte] ^= 0x10;
            let kept = restart_in_time(&damaged, &case);
            assert!(kept.reason.is_some(), "{case}: {kept:?}");
        }
    }
}

/// With keys, a start erases key pages that a power failure left incomplete.
#[test]
fn a_start_that_erases_the_pages_of_keys_is_in_time_and_one_that_never_ends_is_reset() {
    const KEYS: [usize; 2] = [0x42000, 0x42800];
    let Some(image) = image("nucleo-g474re-auth") else { return };
    let shared = Shared::of(bench_of("nucleo-g474re", image));
    for page in KEYS {
        shared.bench().chip().flash()[page + 512] = 0;
    }
    let mut broken = shared.bench().clone();
    shared.run_for(2.0 * START_S);
    assert_eq!(shared.bench().chip().flash_writes().0, 2);
    assert_eq!(shared.bench().chip().resets(), []);
    shared.identify();
    shared.assert_sound();

    broken.chip().set_flash_fault(FlashFault::NeverErased);
    broken.run_for(0.6).unwrap();
    assert_eq!(broken.chip().resets(), [Reset::Chip]);
    broken.chip().set_flash_fault(FlashFault::None);
    broken.run_for(0.6).unwrap();
    let resets = broken.chip().resets().len();
    let shared = Shared::of(broken);
    shared.run_for(2.0 * START_S);
    assert_eq!(shared.bench().chip().resets().len(), resets);
    shared.identify();
}
