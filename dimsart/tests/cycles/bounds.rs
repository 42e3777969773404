//! The bound compared with all runs.

use cycles::timing::{Column, Profile, Timing};
use dimsart::cycles::{Figures, Firmware, Row, Setup, measure};
use dimsart_core::Command;
use hil_sim::rig_file::RigFile;

use crate::common::firmware;
use test_requirements::length;

/// Maximum ratio of bound and observed maximum.
const TICK_RATIO: f64 = 1.15;
const MODULE_RATIO: f64 = 1.30;

#[test]
fn the_whole_of_table_1_on_the_master() {
    table_1("master");
}

#[test]
fn the_whole_of_table_1_on_the_slave() {
    table_1("slave");
}

/// Both sides, with late and lost packets, so that all paths are executed.
fn table_1(side: &'static str) {
    let Some(firmware) = firmware() else { return };
    for column in [Column::Likely, Column::Upper] {
        let figures = figures(&firmware, side, column, &["link.jitter_ticks=2", "link.loss=0.02"]);
        assert!(figures.ticks > 9_000, "incomplete run: {} ticks", figures.ticks);
        hold(&figures);
        let ratio = figures.tick.ratio.unwrap();
        assert!(ratio <= TICK_RATIO, "tick: {ratio}");
        for row in figures.modules.iter().chain(&figures.packets) {
            assert!(row.ratio.unwrap() <= MODULE_RATIO, "{row:?}");
        }
        assert_eq!(figures.modules.len(), 5);
    }
}

#[test]
fn any_number_of_axes() {
    let Some(firmware) = firmware() else { return };
    for dof in [1, 7] {
        hold(&figures(&firmware, "master", Column::Upper, &["duration_s=1", &format!("dof={dof}")]));
    }
}

#[test]
fn flash_that_waits_costs_more_and_has_a_bound() {
    let Some(firmware) = firmware() else { return };
    let scenario = RigFile::from_shipped("bilateral", &["duration_s=1".to_owned()]).unwrap();
    let [without, with] =
        [Profile::ZeroWait, Profile::Flash(cycles::timing::Flash::STM32G4)].map(|profile| {
            let timing = Timing::new(profile, Column::Upper);
            let figures = run(&firmware, &scenario, "master", None, timing, 500);
            hold(&figures);
            figures
        });
    // A tick in CCM SRAM waits at most for constants.
    assert!(with.tick.emulated_max >= without.tick.emulated_max, "{:?} {:?}", without.tick, with.tick);
    let bounds = |figures: &Figures| {
        let [entry, exit, floats] = &figures.interrupt[..] else { panic!("{:?}", figures.interrupt) };
        [&figures.tick, entry, exit, floats].map(|row| row.bound.unwrap())
    };
    let (without, with) = (bounds(&without), bounds(&with));
    assert_eq!(without[1..], [12, 12, 17]);
    // 4 wait states: the current read, the handler's address and its first line; and two reads on return.
    assert!(with[0] > without[0]);
    assert_eq!(with[1..], [12 + 3 * 4, 12 + 2 * 4, 17]);
}

fn figures(firmware: &Firmware, side: &'static str, column: Column, settings: &[&str]) -> Figures {
    let settings: Vec<String> = settings.iter().map(|setting| (*setting).to_owned()).collect();
    let scenario = RigFile::from_shipped("bilateral", &settings).unwrap();
    let timing = Timing::new(Profile::ZeroWait, column);
    run(firmware, &scenario, side, None, timing, length(5_000, 250_000))
}

pub(crate) fn run(
    firmware: &Firmware,
    rig: &RigFile,
    side: &'static str,
    commands: Option<&[Command]>,
    timing: Timing,
    random_ticks: u64,
) -> Figures {
    let setup = Setup {
        firmware,
        rig,
        side,
        commands,
        timing,
        random_ticks,
        counts_instructions: false,
        profile: "",
        column: "",
    };
    measure(&setup, |_, _| {}).unwrap()
}

/// All runs kept their bounds.
pub(crate) fn hold(figures: &Figures) {
    assert_eq!(figures.no_bound, None);
    let parts = [&figures.tick, &figures.frame_and_engine].into_iter().chain(&figures.modules);
    for row in parts.chain(&figures.packets).chain(&figures.commands) {
        let Row { name, emulated_max, random_max, bound, stack_bytes, stack_emulated_bytes, .. } = row;
        let (bound, stack_bytes) = (bound.unwrap(), stack_bytes.unwrap());
        assert!(*emulated_max <= bound && *random_max <= bound, "{name}: {row:?}");
        assert!(*stack_emulated_bytes <= stack_bytes, "{name}: {row:?}");
    }
}
