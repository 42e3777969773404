//! When to drop pending frames of a CAN controller for newer ones.
//!
//! A controller repeats a frame until a node acknowledges it. Without other nodes, pending frames become
//! outdated and would be delivered first to a returning node. Before a new packet, pending frames are
//! therefore cancelled, unless frames have left: on a busy bus, a packet of several frames would otherwise
//! never be completed.

/// Counts the frames in a controller's FIFO, without access to the controller.
#[derive(Debug, Default, Clone)]
pub struct PendingFrames {
    /// Frames that would be pending if none had left since the start of the last packet.
    given: u32,
}

impl PendingFrames {
    /// Creates an empty counter.
    #[must_use]
    pub const fn new() -> Self {
        Self { given: 0 }
    }

    /// Starts a packet while `waiting` frames are pending; returns whether to cancel them first.
    #[must_use]
    pub fn should_cancel(&mut self, waiting: u32) -> bool {
        let is_stuck = waiting != 0 && waiting >= self.given;
        self.given = if is_stuck { 0 } else { waiting };
        is_stuck
    }

    /// Counts a frame given to the controller.
    pub fn add(&mut self) {
        self.given = self.given.saturating_add(1);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;
    use std::vec::Vec;

    use super::*;

    /// Frames buffered by the controller.
    const ROOM: usize = 3;
    /// Time slots per packet.
    const PERIOD: usize = 10;

    /// Sends packets of `frames` frames, one per [`PERIOD`], like the boards: a frame waits for room for a
    /// whole period, then pending frames are cancelled. In every slot the bus takes a frame if `is_free`.
    /// Returns slot, packet and index of each sent frame.
    fn send(frames: usize, packets: usize, is_free: impl Fn(usize) -> bool) -> Vec<(usize, usize, usize)> {
        let (mut unsent, mut fifo, mut left) = (PendingFrames::new(), VecDeque::new(), Vec::new());
        let (mut to_send, mut queue, mut patience) = (VecDeque::new(), VecDeque::new(), PERIOD);
        for slot in 0..PERIOD * packets {
            // Dropped if two are queued.
            if slot % PERIOD == 0 && queue.len() < 2 {
                queue.push_back(slot / PERIOD);
            }
            if to_send.is_empty()
                && let Some(packet) = queue.pop_front()
            {
                if unsent.should_cancel(u32::try_from(fifo.len()).unwrap()) {
                    fifo.clear();
                }
                to_send = (0..frames).map(|place| (packet, place)).collect();
                patience = PERIOD;
            }
            while fifo.len() < ROOM
                && let Some(frame) = to_send.pop_front()
            {
                fifo.push_back(frame);
                unsent.add();
                patience = PERIOD;
            }
            patience -= 1;
            if patience == 0 && !to_send.is_empty() {
                to_send.clear();
                fifo.clear();
            }
            if is_free(slot)
                && let Some((packet, place)) = fifo.pop_front()
            {
                left.push((slot, packet, place));
            }
        }
        left
    }

    #[test]
    fn who_comes_back_is_told_what_is_new() {
        for frames in 1..=6 {
            for back in 500..500 + PERIOD {
                let left = send(frames, 100, |slot| slot >= back);
                let whole = left.iter().filter(|(_, _, place)| *place == frames - 1);
                let ages: Vec<usize> = whole.map(|(slot, packet, _)| slot - PERIOD * packet).collect();
                assert!(ages.len() > 40, "{frames} frames: {ages:?}");
                // A packet waits for the cancellation of the previous one, and for the bus.
                assert!(ages.iter().all(|age| *age < 3 * PERIOD), "{frames} frames: {ages:?}");
                let (slot, first, _) = left[0];
                assert!(slot - PERIOD * first < 3 * PERIOD, "{frames} frames, back at {back}: {left:?}");
            }
        }
    }

    #[test]
    fn a_single_frame_is_superseded_by_the_next_one() {
        let left = send(1, 100, |slot| slot >= 505);
        assert_eq!(left[..2], [(505, 50, 0), (510, 51, 0)]);
    }

    #[test]
    fn a_slow_bus_cuts_no_packet() {
        // Four of ten slots are free: a packet of six frames never completes within its period.
        for (frames, expected) in [(3, 95), (4, 95), (5, 75), (6, 60)] {
            let left = send(frames, 100, |slot| slot % 5 < 2);
            let whole = left.iter().filter(|(_, _, place)| *place == frames - 1).count();
            assert!(whole >= expected, "{whole} packets of {frames} frames came whole");
            let is_in_order = |pair: &[(usize, usize, usize)]| {
                let [(_, packet, place), (_, next_packet, next)] = *pair else { return true };
                if packet == next_packet { next == place + 1 } else { place == frames - 1 && next == 0 }
            };
            assert!(left.windows(2).all(is_in_order), "{frames} frames: {left:?}");
        }
    }
}
