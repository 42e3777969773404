//! The command line: bytes in, requests to the tick, answers back, bytes out.

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use boards::Selected;
use dimsart_core::{Command, CommandError};
use embassy_time::{Duration, with_timeout};
use embedded_io_async::Read as _;

use crate::handover::{Giver, Taker};

type CommandPort = <Selected as boards::Board>::CommandPort;

/// What became of a command.
pub(crate) type Answer = Result<(), CommandError>;

/// Counts up as long as this task is alive.
static HEARTBEAT: AtomicU32 = AtomicU32::new(0);
const HEARTBEAT_PERIOD: Duration = Duration::from_millis(10);

/// The task's heartbeat: another number as long as it is alive.
pub(crate) fn heartbeat() -> u32 {
    HEARTBEAT.load(Relaxed)
}

#[embassy_executor::task]
pub(crate) async fn serve(mut port: CommandPort, _commands: Giver<Command>, mut answers: Taker<Answer>) {
    let mut bytes = [0; 64];
    loop {
        HEARTBEAT.store(heartbeat().wrapping_add(1), Relaxed);
        if let Ok(Ok(length)) = with_timeout(HEARTBEAT_PERIOD, port.read(&mut bytes)).await {
            // Here the protocol takes `bytes[..length]` in, gives requests, and makes bytes of answers.
            defmt::debug!("{} command bytes without a protocol to read them", length);
        }
        while let Some(answer) = answers.take() {
            defmt::debug!("answer {}", answer);
        }
    }
}
