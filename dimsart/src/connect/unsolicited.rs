//! Unsolicited frames of a device: heartbeats and telemetry samples.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use dimsart_link::protocol::{Heartbeat, Sample, decode_heartbeat, decode_sample, request_client};
use hil_sim::clock;

/// Capacity of the sample queue; the oldest samples are dropped.
const ROOM: usize = 16_384;

/// Unsolicited frames that are not yet read.
#[derive(Debug)]
pub(super) struct Unsolicited {
    heard: Instant,
    heartbeat: Option<Heartbeat>,
    samples: VecDeque<Sample>,
}

impl Unsolicited {
    pub(super) fn new() -> Self {
        Self { heard: clock::now(), heartbeat: None, samples: VecDeque::new() }
    }

    /// Handles heartbeats, and samples for `client`.
    pub(super) fn take(&mut self, content: &[u8], client: u8) {
        if let Ok((_, heartbeat)) = decode_heartbeat(content) {
            (self.heard, self.heartbeat) = (clock::now(), Some(heartbeat));
        } else if let Ok(sample) = decode_sample(content)
            && request_client(sample.id) == client
        {
            if self.samples.len() == ROOM {
                self.samples.pop_front();
            }
            self.samples.push_back(sample);
        }
    }

    /// Returns the last heartbeat.
    pub(super) fn heartbeat(&self) -> Option<Heartbeat> {
        self.heartbeat
    }

    pub(super) fn forget_heartbeat(&mut self) {
        self.heartbeat = None;
    }

    /// Returns the time since the last heartbeat, or since the start.
    pub(super) fn silence(&self) -> Duration {
        clock::elapsed_since(self.heard)
    }

    /// Takes the samples since the last call, oldest first.
    pub(super) fn samples(&mut self) -> impl Iterator<Item = Sample> {
        self.samples.drain(..)
    }
}
