//! Cost of the firmware on the emulated board: ticks per second and instructions per tick, as a table.
//!
//! `cargo run --release -p dimsart --example firmware_figures [TICKS]`, after `cargo board mps2-an386`. Ticks per
//! second depend on the machine and its load; instructions do not.

use std::error::Error;
use std::time::Instant;

use dimsart_link::protocol::{MAX_FRAME_BYTES, Request, encode_request};
use hil_sim::emulated::{Image, pin_to_current_cpu};
use hil_sim::experiment::Experiment;
use hil_sim::rig::{RemoteController, Rig};
use hil_sim::rig_file::RigFile;

/// Default number of measured ticks.
const TICKS: u32 = 100_000;
/// Bytes of 115 200 baud per tick of 1 ms, times 100.
const FLOOD_BYTES: usize = 1_152;

fn main() -> Result<(), Box<dyn Error>> {
    let ticks = std::env::args().nth(1).map_or(Ok(TICKS), |ticks| ticks.parse())?;
    pin_to_current_cpu();
    let mut buffer = [0; MAX_FRAME_BYTES];
    let request = encode_request(&Request::Status, 1, &mut buffer)?.to_vec();
    let flood = request.repeat(FLOOD_BYTES.div_ceil(request.len()));
    let noise: Vec<u8> = flood.iter().map(|byte| byte ^ 0x55).collect();
    println!("| Command line load | Ticks per second | Instructions, min | Mean | Max |");
    println!("|---|---:|---:|---:|---:|");
    for (name, bytes) in [
        ("nothing", [].as_slice()),
        ("a request per tick", &request),
        ("requests at 100 times the line's rate", &flood),
        ("noise at 100 times the line's rate", &noise),
    ] {
        println!("| {name} | {} |", measure(ticks, bytes)?);
    }
    Ok(())
}

/// With `bytes` on the command line in every tick.
fn measure(ticks: u32, bytes: &[u8]) -> Result<String, Box<dyn Error>> {
    let mut experiment = Experiment::new(&RigFile::from_shipped("bilateral", &[])?)?;
    experiment.emulate("master", &Image::find(None)?, None)?;
    let rig = experiment.rig_mut();
    let (mut min, mut max, mut sum) = (u32::MAX, 0, 0_u64);
    let start = Instant::now();
    for _ in 0..ticks {
        if let Some(board) = board(rig) {
            board.send_command_bytes(bytes);
        }
        rig.step();
        if let Some((side, trouble)) = rig.take_board_error() {
            return Err(format!("{side}: {trouble}").into());
        }
        let instructions = board(rig).and_then(|board| board.instructions()).ok_or("no cycle counter")?;
        (min, max) = (min.min(instructions), max.max(instructions));
        sum += u64::from(instructions);
    }
    let per_second = f64::from(ticks) / start.elapsed().as_secs_f64();
    Ok(format!("{per_second:.0} | {min} | {} | {max}", sum / u64::from(ticks)))
}

fn board(rig: &mut Rig) -> Option<&mut (dyn RemoteController + 'static)> {
    rig.stations_mut().first_mut()?.board_mut()
}
