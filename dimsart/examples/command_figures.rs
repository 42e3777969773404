//! Cost of commands in their tick, on the emulated board, as a table.
//!
//! `cargo run --release -p dimsart --example command_figures`, after `cargo board mps2-an386`.

use std::error::Error;

use dimsart_core::{Command, ModuleRef, TypeRef, Value, types};
use dimsart_link::protocol::{MAX_FRAME_BYTES, Request, encode_request, request_id};
use dimsart_modules::ALL;
use hil_sim::emulated::{Image, pin_to_current_cpu};
use hil_sim::experiment::Experiment;
use hil_sim::rig::Rig;
use hil_sim::rig_file::RigFile;

/// Additional P controllers, to measure the dependence on the number of modules.
const BESIDE: [u8; 3] = [0, 9, 23];
/// Modules of the shipped scheme, and two more that can be made to fail.
const MODULES: u8 = 5 + 2;
/// In series, they exceed the range of a position; until then the first one has zero gain.
const GAIN: f32 = 1e6;
const TICKS_UNTIL_MOTION: u32 = 2_000;
/// The client that holds the board's lease: the host that simulates the device.
const CLIENT: u8 = 1;

fn main() -> Result<(), Box<dyn Error>> {
    pin_to_current_cpu();
    let columns = BESIDE.map(measure);
    let columns = columns.into_iter().collect::<Result<Vec<_>, _>>()?;
    let heads: Vec<_> = BESIDE.iter().map(|beside| format!("{} modules", MODULES + beside)).collect();
    println!("| Command, instructions | {} |", heads.join(" | "));
    println!("|---|{}", "---:|".repeat(heads.len()));
    let names = columns.first().into_iter().flatten().map(|(name, _)| *name);
    for (row, name) in names.enumerate() {
        let costs: Vec<_> =
            columns.iter().filter_map(|column| column.get(row)).map(|(_, cost)| cost.to_string()).collect();
        println!("| {name} | {} |", costs.join(" | "));
    }
    Ok(())
}

/// Commands that replace the controller in one transaction, with the cost of each.
fn measure(beside: u8) -> Result<Vec<(&'static str, i64)>, Box<dyn Error>> {
    let module = |name| ALL.module(name).ok_or("no such module");
    let [p, pd] = [module("PCTRL_MOD")?, module("PDCTRL_MOD")?];
    let [pid, delay, sum] = [module("PIDCTRL_MOD")?, module("TIMEDELAY_MOD")?, module("SUM_MOD")?];
    let mut experiment = Experiment::new(&RigFile::from_shipped("bilateral", &[])?)?;
    let station = experiment.rig_mut().stations_mut().first_mut().ok_or("no station")?;
    let position = |number| TypeRef { number, ..types::POSITION.first() };
    for number in 1..=2 {
        let sum = ModuleRef { number, ..sum };
        for (port, signal) in
            [position(number), position(number), position(number + 1)].into_iter().enumerate()
        {
            station.dimsart.command(Command::bind(sum, u8::try_from(port)?, signal))?;
        }
        for (parameter, gain) in [if number == 1 { 0.0 } else { GAIN }, 0.0].into_iter().enumerate() {
            station.dimsart.command(Command::set(sum, u8::try_from(parameter)?, Value::Real(gain)))?;
        }
        station.dimsart.command(Command::PlugIn(sum))?;
    }
    // They fail together with the second one.
    for number in 1..=beside {
        let p = ModuleRef { number, ..p };
        let own = TypeRef { number: number + 1, ..types::DES_FORCE.first() };
        station.dimsart.command(Command::bind(p, 0, position(3)))?;
        station.dimsart.command(Command::bind(p, 2, own))?;
        station.dimsart.command(Command::PlugIn(p))?;
    }
    experiment.emulate("master", &Image::find(None)?, None)?;
    let rig = experiment.rig_mut();
    let gain = |module| Command::set(module, 0, Value::Real(3_000.0));
    let mut costs = Vec::new();
    for (name, command) in [
        ("set a parameter, without a transaction", gain(pd)),
        ("begin", Command::Begin),
        ("unplug", Command::Unplug(pd)),
        ("commit, refused", Command::Commit),
        ("set a parameter", gain(pid)),
        ("place before", Command::PlaceBefore(delay)),
        ("plug in", Command::PlugIn(pid)),
        ("check", Command::Check),
        ("commit, and initialisation of the modules", Command::Commit),
        ("begin again", Command::Begin),
        ("abort", Command::Abort),
    ] {
        let mut quiet = u32::MAX;
        for _ in 0..20 {
            quiet = tick(rig, None)?.min(quiet);
        }
        costs.push((name, i64::from(tick(rig, Some(command))?) - i64::from(quiet)));
    }
    // The same command with and without a failure: the difference is the cost of the failure.
    let mut ticks = Vec::new();
    // The hand moves by then.
    for _ in 0..TICKS_UNTIL_MOTION {
        tick(rig, None)?;
    }
    for gain in [0.0, GAIN] {
        ticks.push(i64::from(tick(rig, Some(Command::set(sum, 0, Value::Real(gain))))?));
    }
    if let [sound, failed] = ticks.as_slice() {
        costs.push(("a module fails and is isolated with its dependents", failed - sound));
    }
    Ok(costs)
}

/// Runs a tick; returns its instructions, including the command.
fn tick(rig: &mut Rig, command: Option<Command>) -> Result<u32, Box<dyn Error>> {
    let mut buffer = [0; MAX_FRAME_BYTES];
    let frame = match command {
        Some(command) => encode_request(&Request::Command(command), request_id(CLIENT, 2), &mut buffer)?,
        None => &[],
    };
    let station = rig.stations_mut().first_mut().ok_or("no station")?;
    station.board_mut().ok_or("no board")?.send_command_bytes(frame);
    rig.step();
    if let Some((side, trouble)) = rig.take_board_error() {
        return Err(format!("{side}: {trouble}").into());
    }
    let station = rig.stations_mut().first_mut().ok_or("no station")?;
    let instructions = station.board_mut().and_then(|board| board.instructions());
    Ok(instructions.ok_or("no cycle counter")?)
}
