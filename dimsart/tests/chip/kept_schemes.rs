//! Schemes that a board keeps in its flash, which takes its time and fails.

use chips::stm32g4::FlashFault;
use chips::{BOARDS, Part};
use dimsart::connect::{ConnectError, Device, KeptReport};

use crate::common::{CommandLine, Shared};

/// Longer than a start takes.
const START_S: f64 = 0.1;
/// What modules leave to commands, at 168 MHz.
const HALF_TICK_CYCLES: u32 = 84_000;

fn stiffness(shared: &Shared) -> String {
    shared.greet().get("PDCTRL_MOD", "K_PARAM").unwrap().to_string()
}

/// Changes the scheme and keeps it for a trial.
fn change_and_save(shared: &Shared, stiffness: &str) -> Result<String, String> {
    shared.greet().set("PDCTRL_MOD", "K_PARAM", stiffness).unwrap();
    write(shared, Device::save).map(|kept| kept.trial.to_owned())
}

/// Has a board write its flash. One with a single bank stands still meanwhile, so its scheme is stopped before.
fn write(
    shared: &Shared,
    action: fn(&mut Device<CommandLine>) -> Result<KeptReport, ConnectError>,
) -> Result<KeptReport, String> {
    let mut device = shared.greet();
    if shared.bench().board.part == Part::G474re {
        return action(&mut device).map_err(|error| error.to_string());
    }
    let refused = action(&mut device).unwrap_err().to_string();
    assert!(refused.contains("`stop` it first"), "{refused}");
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
        let kept = shared.greet().overview().unwrap().status.schemes.unwrap();
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
        let timing = shared.greet().overview().unwrap().status.timing.unwrap();
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
            // It goes on, and the next start is the old one.
            shared.run_for(START_S);
            shared.bench().reset();
            shared.run_for(START_S);
            assert_eq!(stiffness(&shared), built_in, "{} {fault:?}", board.name);
            shared.assert_sound();
        }
    }
}
