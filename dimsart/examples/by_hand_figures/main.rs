//! Cost of a tick of Table 1 on a board, compared with one hand-written function.
//!
//! `cargo run --release -p dimsart --example by_hand_figures [ELF]`, after `cargo board nucleo-g474re,by-hand`.

mod hand;

use std::error::Error;
use std::path::{Path, PathBuf};

use cycles::timing::{Column, Timing};
use dimsart::cycles::{Firmware, Setup, UNIT, measure};
use dimsart_core::{Packet, is_newer};
use hil_sim::emulated::IMAGE_FOLDER_VARIABLE;
use hil_sim::experiment::Experiment;
use hil_sim::rig::{Station, TickTrace};
use hil_sim::rig_file::RigFile;

use crate::hand::Hand;

const IMAGE: &str = "nucleo-g474re-by-hand";

fn main() -> Result<(), Box<dyn Error>> {
    let given = std::env::args().nth(1).map(PathBuf::from);
    let collected = || std::env::var_os(IMAGE_FOLDER_VARIABLE).map(|folder| Path::new(&folder).join(IMAGE));
    let firmware = Firmware::find(given.or_else(collected).as_deref(), None)?;
    let scenario =
        RigFile::from_shipped("bilateral", &["link.jitter_ticks=2", "link.loss=0.02"].map(str::to_owned))?;
    println!(
        "`{}`, {UNIT}, memory {}; means, and ratios to the hand-written tick.\n",
        firmware.name,
        firmware.memory().name()
    );
    println!("| Master, 3 axes | Likely | By hand: 1 | Upper | By hand: 1 |");
    println!("|---|---:|---:|---:|---:|");
    let typical = parts(&firmware, &scenario, Column::Likely)?;
    let upper = parts(&firmware, &scenario, Column::Upper)?;
    let [(_, likely_by_hand), ..] = *typical else { return Ok(()) };
    let [(_, upper_by_hand), ..] = *upper else { return Ok(()) };
    for ((name, typical), (_, upper)) in typical.iter().zip(&upper) {
        let (likely_ratio, upper_ratio) = (typical / likely_by_hand, upper / upper_by_hand);
        println!("| {name} | {typical:.0} | {likely_ratio:.2} | {upper:.0} | {upper_ratio:.2} |");
    }
    Ok(())
}

/// Mean cycles of the hand-written tick, of the image's tick and of its parts.
fn parts(firmware: &Firmware, rig: &RigFile, column: Column) -> Result<Vec<(String, f64)>, Box<dyn Error>> {
    let timing = Timing::new(firmware.memory().profile(), column);
    let setup = Setup {
        firmware,
        rig,
        side: "master",
        commands: None,
        counts_instructions: false,
        timing,
        random_ticks: 0,
        profile: firmware.memory().name(),
        column: "",
    };
    let by_hand = by_hand(firmware, rig, timing)?;
    let figures = measure(&setup, |_, _| {})?;
    let rows = [&figures.tick, &figures.frame_and_engine].into_iter().chain(&figures.modules);
    let named = rows.map(|row| (row.name.clone(), row.emulated_mean));
    Ok([("by hand".to_owned(), by_hand)].into_iter().chain(named).collect())
}

/// Mean cycles of the hand-written master over every tick of the scenario. Its commands and packets must be bit-identical.
fn by_hand(firmware: &Firmware, file: &RigFile, timing: Timing) -> Result<f64, Box<dyn Error>> {
    let mut experiment = Experiment::new(file)?.without_recording();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast saturates")]
    let ticks = (experiment.duration_s() / file.sample_period_s).round() as u32;
    let rig = experiment.rig_mut();
    rig.stations_mut().first_mut().ok_or("no master")?.start_trace();
    let mut hand = Hand::new(firmware, timing)?;
    let mut cycles = 0;
    for tick in 0..ticks {
        rig.step();
        let trace = rig.stations().iter().find_map(Station::trace).ok_or("no trace")?;
        cycles += hand.tick(&trace.measured, newest(trace).as_ref())?.cycles;
        let (_, sent) = trace.sent.first().ok_or("nothing was sent")?;
        if hand.commanded()? != trace.commands || !hand.sent(sent)? {
            return Err(format!("the hand-written master differs in tick {tick}").into());
        }
    }
    Ok(cycles as f64 / f64::from(ticks))
}

/// Returns the packet of a tick from the received ones.
fn newest(trace: &TickTrace) -> Option<Packet> {
    let packets =
        trace.received.iter().filter_map(|(_, channel, bytes)| Packet::from_bytes(bytes, *channel).ok());
    packets.reduce(|kept, packet| if is_newer(packet.counter, kept.counter) { packet } else { kept })
}
