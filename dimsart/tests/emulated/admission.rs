//! Effects of a board's stamp, over its command line.

use std::process::Command;

use dimsart::stamp::StampedImage;
use dimsart_core::limits::MAX_DOF;
use dimsart_link::saved_scheme;
use dimsart_modules::ALL;
use hil_sim::rig::SimulatedDimsart;
use hil_sim::schemes::device;
use hil_sim::schemes::{self, SchemeText};
use tempfile::TempDir;

use crate::common::timer_image;
use crate::firmware::Firmware;

/// Returns the output of `dimsart connect`, standard output and error.
fn connect(firmware: &Firmware, arguments: &[&str]) -> (bool, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dimsart"));
    let output =
        command.args(["connect", &firmware.port(), "--timeout-s", "5"]).args(arguments).output().unwrap();
    let said = [output.stdout, output.stderr].concat();
    (output.status.success(), String::from_utf8(said).unwrap())
}

/// The image with the tick from a timer and another stamp; `None`, with a note, without it.
fn stamped(folder: &TempDir, change: impl FnOnce(&mut StampedImage)) -> Option<Firmware> {
    let mut image = StampedImage::read(&timer_image()?).unwrap();
    change(&mut image);
    let path = folder.path().join("image");
    image.write(&path).unwrap();
    Some(Firmware::start_image(path, false))
}

#[test]
fn a_module_too_many_is_refused_with_the_numbers_of_the_stamp() {
    const LIMIT: u32 = 11_000;
    let folder = tempfile::tempdir().unwrap();
    // The code differs only at the start of a tick.
    let Some(plain) = test_requirements::stamped_image("mps2-an386") else { return };
    let plain = StampedImage::read(&plain).unwrap();
    let (costs, memory) = (plain.costs().unwrap(), plain.memory().unwrap());
    let firmware = stamped(&folder, |image| image.set_costs(&costs, &memory, LIMIT).unwrap());
    let Some(firmware) = firmware else { return };
    let (shows, overview) = connect(&firmware, &["show"]);
    assert!(shows && !overview.contains("unstamped") && !overview.contains("without a scheme"), "{overview}");
    // A running scheme refuses a module that reads a signal without a writer.
    assert!(connect(&firmware, &["stop"]).0);
    let refused = (2..=16).find_map(|number| {
        let (is_taken, said) = connect(&firmware, &["on", &format!("RECORDER_MOD.{number}")]);
        (!is_taken).then_some(said)
    });
    let refused = refused.unwrap();
    assert!(refused.contains(&format!("it may take {LIMIT}: unplug another module")), "{refused}");
}

#[test]
fn without_a_stamp_a_board_says_so_and_takes_what_there_is_memory_for() {
    let folder = tempfile::tempdir().unwrap();
    let Some(firmware) = stamped(&folder, |_| ()) else { return };
    let (shows, overview) = connect(&firmware, &["show"]);
    assert!(shows && overview.contains(" unstamped, protocol"), "{overview}");
    assert!(connect(&firmware, &["stop"]).0);
    let (is_taken, said) = connect(&firmware, &["on", "RECORDER_MOD"]);
    assert!(is_taken, "{said}");
}

#[test]
fn one_image_starts_as_the_side_that_it_is_stamped_with() {
    let text = SchemeText::read("builtin:bilateral").unwrap();
    for (side, mode) in [("master", "MASTER"), ("slave", "SLAVE")] {
        let mut dimsart = SimulatedDimsart::new(device(side, MAX_DOF, 1e-3).unwrap(), ALL).unwrap();
        assert!(schemes::load(&text, side, &[], &mut dimsart).is_valid());
        let scheme = saved_scheme::save(dimsart.engine_mut()).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let firmware = stamped(&folder, |image| image.set_scheme("bilateral", side, &scheme).unwrap());
        let Some(firmware) = firmware else { return };
        let (shows, value) = connect(&firmware, &["get", "WTRANSF_MOD", "CONF_MODE"]);
        assert!(shows && value.starts_with(&format!("CONF_MODE = {mode}")), "{value}");
    }
}
