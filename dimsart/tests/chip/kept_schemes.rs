//! Schemes that a board keeps in its flash, which takes its time and fails.

use chips::BOARDS;
use chips::stm32g4::FlashFault;

use crate::common::Shared;

/// Longer than a start takes.
const START_S: f64 = 0.1;

fn damping(shared: &Shared) -> String {
    shared.greet().get("PDCTRL_MOD", "B_PARAM").unwrap().to_string()
}

/// Changes the scheme and keeps it for a trial.
fn change_and_save(shared: &Shared, damping: &str) -> Result<String, String> {
    let mut device = shared.greet();
    device.set("PDCTRL_MOD", "B_PARAM", damping).unwrap();
    device.save().map(|kept| kept.trial.to_owned()).map_err(|error| error.to_string())
}

#[test]
fn a_scheme_is_saved_tried_and_confirmed() {
    for board in BOARDS {
        let Some(shared) = Shared::start(board.name) else { return };
        shared.run_for(START_S);
        let built_in = damping(&shared);
        assert_eq!(change_and_save(&shared, "0.00025").as_deref(), Ok("waits"), "{}", board.name);
        let (pages, words) = shared.bench().chip().flash_writes();
        assert!(pages > 0 && words > 0, "{pages} pages, {words} words");

        shared.bench().reset();
        shared.run_for(START_S);
        assert_ne!(damping(&shared), built_in);
        assert_eq!(shared.greet().confirm().unwrap().origin, "trial");
        shared.bench().reset();
        shared.run_for(START_S);
        let kept = shared.greet().overview().unwrap().status.schemes.unwrap();
        assert_eq!((kept.origin, kept.is_saved), ("saved", true), "{}", board.name);
        assert_ne!(damping(&shared), built_in);
        shared.assert_sound();
    }
}

#[test]
fn a_scheme_that_the_flash_does_not_take_is_refused() {
    for board in BOARDS {
        for fault in [FlashFault::WriteProtected, FlashFault::WornOut] {
            let Some(shared) = Shared::start(board.name) else { return };
            shared.run_for(START_S);
            let built_in = damping(&shared);
            shared.bench().chip().set_flash_fault(fault);
            let refused = change_and_save(&shared, "0.00025");
            assert!(refused.is_err(), "{} {fault:?}: {refused:?}", board.name);
            // It goes on, and the next start is the old one.
            shared.run_for(START_S);
            shared.bench().reset();
            shared.run_for(START_S);
            assert_eq!(damping(&shared), built_in, "{} {fault:?}", board.name);
            shared.assert_sound();
        }
    }
}
