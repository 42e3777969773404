//! What a device says by itself: that it lives, and signals.

use std::time::{Duration, Instant};

use dimsart_core::protocol::{Heartbeat, Sample, decode_heartbeat, decode_sample};

/// The last of what came unsolicited.
#[derive(Debug)]
pub(super) struct Unsolicited {
    /// When the last heartbeat came, or the line was opened.
    heard: Instant,
    heartbeat: Option<Heartbeat>,
    /// The request whose samples are wanted.
    pub(super) telemetry: Option<u16>,
    sample: Option<Sample>,
}

impl Unsolicited {
    pub(super) fn new() -> Self {
        Self { heard: Instant::now(), heartbeat: None, telemetry: None, sample: None }
    }

    /// Keeps a frame's content if it is of use.
    pub(super) fn take(&mut self, content: &[u8]) {
        if let Ok((_, heartbeat)) = decode_heartbeat(content) {
            (self.heard, self.heartbeat) = (Instant::now(), Some(heartbeat));
        } else if let Ok(sample) = decode_sample(content)
            && self.telemetry == Some(sample.id)
        {
            self.sample = Some(sample);
        }
    }

    /// The last heartbeat.
    pub(super) fn heartbeat(&self) -> Option<Heartbeat> {
        self.heartbeat
    }

    /// Waits for the next heartbeat.
    pub(super) fn forget_heartbeat(&mut self) {
        self.heartbeat = None;
    }

    /// Time since the last heartbeat, or since the line was opened.
    pub(super) fn silence(&self) -> Duration {
        self.heard.elapsed()
    }

    /// The newest sample since the last call.
    pub(super) fn sample(&mut self) -> Option<Sample> {
        self.sample.take()
    }
}
