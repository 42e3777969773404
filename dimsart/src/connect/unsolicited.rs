//! What a device says by itself: that it lives, and signals.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use dimsart_link::protocol::{Heartbeat, Sample, client_of, decode_heartbeat, decode_sample};
use hil_sim::clock;

/// Samples that wait to be taken; the oldest make room for newer ones.
const ROOM: usize = 16_384;

/// What came that nobody had asked for, as far as it was not taken yet.
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

    /// Takes what a device says to everybody, and the samples that are for `client`.
    pub(super) fn take(&mut self, content: &[u8], client: u8) {
        if let Ok((_, heartbeat)) = decode_heartbeat(content) {
            (self.heard, self.heartbeat) = (clock::now(), Some(heartbeat));
        } else if let Ok(sample) = decode_sample(content)
            && client_of(sample.id) == client
        {
            if self.samples.len() == ROOM {
                self.samples.pop_front();
            }
            self.samples.push_back(sample);
        }
    }

    /// The last heartbeat, if there was one.
    pub(super) fn heartbeat(&self) -> Option<Heartbeat> {
        self.heartbeat
    }

    pub(super) fn forget_heartbeat(&mut self) {
        self.heartbeat = None;
    }

    /// How long the last heartbeat is ago, or the beginning.
    pub(super) fn silence(&self) -> Duration {
        clock::since(self.heard)
    }

    /// The samples that came since the last look, oldest first.
    pub(super) fn samples(&mut self) -> impl Iterator<Item = Sample> {
        self.samples.drain(..)
    }
}
