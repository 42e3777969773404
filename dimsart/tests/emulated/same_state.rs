//! Firmware ticks in the cycle-counting machine and in QEMU: the same registers after every instruction.
#![expect(clippy::expect_used, reason = "in helpers of a test")]

#[path = "../../../emulator/cycles/tests/qemu/compare.rs"]
mod compare;
#[path = "../../../emulator/cycles/tests/qemu/emulator.rs"]
mod emulator;
#[path = "../../../emulator/cycles/tests/qemu/encode.rs"]
mod encode;

use std::fs;
use std::path::{Path, PathBuf};

use cycles::machine::Machine;
use cycles::timing::{Column, Profile, Timing};
use dimsart::cycles::{Controller, Firmware};
use dimsart_link::saved_scheme;
use hil_sim::experiment::Experiment;
use hil_sim::rig::Station;
use hil_sim::rig_file::RigFile;

use crate::common::image;
use compare::{lockstep, meet};
use emulator::Emulator;
use test_requirements::length;

/// Free flash after the image.
const TRAMPOLINE: u32 = 0x20_0000;
const SP: usize = 13;
const LR: usize = 14;

#[test]
fn ticks_of_both_sides_do_in_qemu_what_they_do_in_the_machine() {
    let Some(image) = image() else { return };
    let firmware = Firmware::find(Some(image.path()), None).unwrap();
    let mut instructions = 0;
    for side in ["master", "slave"] {
        instructions += compare_ticks(&firmware, side, length(30, 500));
    }
    println!("{instructions} instructions");
    assert!(instructions >= 60_000, "too few instructions for 60 ticks: {instructions}");
}

/// Runs the scenario, with some ticks of one side on both; returns the number of compared instructions.
fn compare_ticks(firmware: &Firmware, side: &str, ticks: usize) -> u64 {
    let scenario = RigFile::from_shipped("bilateral", &[]).unwrap();
    let mut experiment = Experiment::new(&scenario).unwrap().without_recording();
    let rig = experiment.rig_mut();
    let timing = Timing::new(Profile::ZeroWait, Column::Likely);
    let mut controller = Controller::new(firmware, timing, scenario.devices[0].axes.len()).unwrap();
    let station = rig.stations_mut().iter_mut().find(|station| station.name == side).unwrap();
    station.start_trace();
    controller.load(&saved_scheme::save(station.dimsart.engine_mut()).unwrap()).unwrap();
    let mut instructions = 0;
    let every = 3000 / ticks;
    for tick in 0..3000 {
        rig.step();
        let trace = rig.stations().iter().find_map(Station::trace).unwrap();
        for (link, channel, bytes) in &trace.received {
            controller.receive(*link, *channel, bytes).unwrap();
        }
        if tick % every == 0 {
            instructions += compare_tick(controller.before_tick(&trace.measured).unwrap());
        }
        controller.tick(&trace.measured).unwrap();
        assert_eq!(controller.commands(), trace.commands, "tick {tick} of {side}");
    }
    instructions
}

fn compare_tick(mut machine: Machine) -> u64 {
    let folder = tempfile::tempdir().unwrap();
    let mut emulator = Emulator::start(&memory(&machine, folder.path()));
    meet(&mut machine, &mut emulator);
    lockstep(&mut machine, &mut emulator, |_| {})
}

/// All memory as files, preceded by a program that calls the code to be executed.
fn memory(machine: &Machine, folder: &Path) -> Vec<(PathBuf, u32)> {
    let mut flash = vec![0; TRAMPOLINE as usize];
    let image = machine.image();
    for segment in image.segments.iter().filter(|segment| !segment.is_writable) {
        flash[segment.address as usize..][..segment.bytes.len()].copy_from_slice(&segment.bytes);
    }
    let registers = &machine.registers.core;
    flash[..4].copy_from_slice(&registers[SP].to_le_bytes());
    flash[4..8].copy_from_slice(&(TRAMPOLINE | 1).to_le_bytes());
    let mut trampoline = encode::float_unit_on();
    for register in [0, 1, 2, 3, LR] {
        trampoline.extend(encode::constant(u16::try_from(register).unwrap(), registers[register]));
    }
    trampoline.extend(encode::constant(12, machine.next().unwrap().address | 1));
    trampoline.push(0x4760); // bx r12
    flash.extend(trampoline.iter().flat_map(|half| half.to_le_bytes()));
    let parts = [(0, flash.as_slice())].into_iter().chain(machine.writable_memory());
    let file = |(address, bytes): (u32, &[u8])| {
        let file = folder.join(format!("{address:08x}"));
        fs::write(&file, bytes).unwrap();
        (file, address)
    };
    parts.map(file).collect()
}
