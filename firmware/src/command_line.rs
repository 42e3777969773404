//! The command line: receives and sends frames.

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use boards::Selected;
use dimsart_link::protocol::{
    Counters, Heartbeat, MAX_FRAME_BYTES, Receiver, Sample, encode_heartbeat, encode_sample,
};
use embedded_io_async::Write as _;

use crate::handover::QueueReceiver;

pub(crate) type CommandPort = <Selected as boards::Board>::CommandPort;

/// Unsolicited messages of the tick.
pub(crate) enum Unsolicited {
    Heartbeat(Heartbeat),
    Sample(Sample),
}

/// Increments while the task is alive.
static ALIVE: AtomicU32 = AtomicU32::new(0);

/// Returns a number that changes while the task is alive.
pub(crate) fn alive() -> u32 {
    ALIVE.load(Relaxed)
}

/// The line, and the queue of unsolicited messages.
pub(crate) struct CommandLine {
    pub(crate) port: CommandPort,
    pub(crate) reports: QueueReceiver<Unsolicited>,
    pub(crate) receiver: Receiver,
    pub(crate) frame: [u8; MAX_FRAME_BYTES],
    heartbeats: u16,
}

impl CommandLine {
    pub(crate) fn new(port: CommandPort, reports: QueueReceiver<Unsolicited>) -> Self {
        Self { port, reports, receiver: Receiver::new(), frame: [0; MAX_FRAME_BYTES], heartbeats: 0 }
    }

    /// Sends the next unsolicited message, if any.
    pub(crate) async fn say_report(&mut self) {
        let length = self.encode_report();
        self.say(length).await;
    }

    /// Encodes the next unsolicited message; returns its length, or 0 if there is none.
    #[inline(never)]
    pub(crate) fn encode_report(&mut self) -> usize {
        let encoded = match self.reports.try_receive() {
            None => return 0,
            Some(Unsolicited::Sample(sample)) => encode_sample(&sample, &mut self.frame),
            Some(Unsolicited::Heartbeat(mut heartbeat)) => {
                let Counters { damaged, too_long, .. } = self.receiver.counters();
                heartbeat.damaged = damaged.saturating_add(too_long);
                self.heartbeats = self.heartbeats.wrapping_add(1);
                encode_heartbeat(&heartbeat, self.heartbeats, &mut self.frame)
            }
        };
        encoded.map_or(0, <[u8]>::len)
    }

    /// Sends a frame. A line error loses the frame; the host detects that.
    pub(crate) async fn say(&mut self, length: usize) {
        ALIVE.store(alive().wrapping_add(1), Relaxed);
        let _ = self.port.write_all(self.frame.get(..length).unwrap_or_default()).await;
    }
}
