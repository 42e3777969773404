//! Bus-off recovery of a CAN node: delayed, and limited in number.
//!
//! The node waits for [`REJOIN_DELAY_MS`], rejoins at most [`MAX_REJOINS`] times within any
//! [`REJOIN_WINDOW_MS`], and then stays off until a [`reset`]: a recurring fault is caused by the wiring and
//! disturbs all other nodes.

use core::sync::atomic::{AtomicBool, AtomicU8, Ordering::Relaxed};

use dimsart_link::EventKind;

/// Whether the controller was reset since the last poll.
static IS_RESET: AtomicBool = AtomicBool::new(false);
static LAST_EVENT: AtomicU8 = AtomicU8::new(EventKind::BusRejoined as u8);

/// Makes the board's node rejoin its bus at the next poll, even after giving up.
pub fn reset() {
    IS_RESET.store(true, Relaxed);
}

/// Returns the number of the last event of the board's node (joined, left or given up), for the tick's log.
#[must_use]
pub fn last_event() -> u8 {
    LAST_EVENT.load(Relaxed)
}

/// Delay before a rejoin, `ms`.
pub const REJOIN_DELAY_MS: u32 = 100;
/// Maximum number of rejoins within [`REJOIN_WINDOW_MS`].
pub const MAX_REJOINS: usize = 3;
/// Window for counting rejoins, `ms`.
pub const REJOIN_WINDOW_MS: u32 = 10_000;

/// The action to take now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RecoveryAction {
    /// No action.
    None,
    /// Rejoin the bus.
    Rejoin,
    /// Give up until a reset; returned once, for a report.
    GiveUp,
}

#[derive(Debug, Clone, Copy)]
enum State {
    On,
    /// A rejoin was requested; the next poll shows the result.
    Joining,
    Off {
        since_ms: u32,
    },
    GivenUp,
}

/// The recovery logic, without access to clock or controller.
#[derive(Debug, Clone)]
pub struct BusOff {
    state: State,
    /// Times of the last `count` rejoins, oldest first.
    joined_ms: [u32; MAX_REJOINS],
    count: u32,
}

impl Default for BusOff {
    fn default() -> Self {
        Self::new()
    }
}

impl BusOff {
    /// Creates a node on the bus.
    #[must_use]
    pub const fn new() -> Self {
        Self { state: State::On, joined_ms: [0; MAX_REJOINS], count: 0 }
    }

    /// Polls the logic at time `now_ms` (may wrap) with the node's bus-off state. Call about every 10 ms.
    pub fn poll(&mut self, now_ms: u32, is_off: bool) -> RecoveryAction {
        match self.state {
            State::GivenUp => RecoveryAction::None,
            _ if !is_off => {
                self.state = State::On;
                RecoveryAction::None
            }
            State::On | State::Joining => {
                self.state = State::Off { since_ms: now_ms };
                RecoveryAction::None
            }
            State::Off { since_ms } if now_ms.wrapping_sub(since_ms) < REJOIN_DELAY_MS => {
                RecoveryAction::None
            }
            State::Off { .. } if self.has_joined_too_often(now_ms) => {
                self.state = State::GivenUp;
                RecoveryAction::GiveUp
            }
            State::Off { .. } => {
                self.state = State::Joining;
                self.joined_ms.rotate_left(1);
                if let Some(last) = self.joined_ms.last_mut() {
                    *last = now_ms;
                }
                self.count = self.count.saturating_add(1);
                RecoveryAction::Rejoin
            }
        }
    }

    /// Like [`poll`](Self::poll), for the board's only node: also handles [`reset`] and updates
    /// [`last_event`].
    pub fn poll_board(&mut self, now_ms: u32, is_off: bool) -> RecoveryAction {
        if IS_RESET.swap(false, Relaxed) {
            self.reset(now_ms);
        }
        let step = self.poll(now_ms, is_off);
        LAST_EVENT.store(self.event() as u8, Relaxed);
        step
    }

    /// Rejoins the bus at the next poll, even after giving up; clears the count of rejoins.
    pub fn reset(&mut self, now_ms: u32) {
        self.joined_ms = [now_ms.wrapping_sub(REJOIN_WINDOW_MS); MAX_REJOINS];
        if !matches!(self.state, State::On) {
            self.state = State::Off { since_ms: now_ms.wrapping_sub(REJOIN_DELAY_MS) };
        }
    }

    /// Returns the last event.
    #[must_use]
    pub fn event(&self) -> EventKind {
        match self.state {
            State::On => EventKind::BusRejoined,
            State::Joining | State::Off { .. } => EventKind::BusOff,
            State::GivenUp => EventKind::BusOffPermanent,
        }
    }

    /// Returns the number of rejoins.
    #[must_use]
    pub fn rejoins(&self) -> u32 {
        self.count
    }

    fn has_joined_too_often(&self, now_ms: u32) -> bool {
        let [oldest, ..] = self.joined_ms;
        let all = usize::try_from(self.count).is_ok_and(|count| count >= MAX_REJOINS);
        all && now_ms.wrapping_sub(oldest) < REJOIN_WINDOW_MS
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;

    /// Polls every 10 ms with `is_off` by time since the start; returns the actions with their times.
    fn run(
        node: &mut BusOff,
        start_ms: u32,
        looks: u32,
        is_off: impl Fn(u32) -> bool,
    ) -> Vec<(u32, RecoveryAction)> {
        let times = (0..looks).map(|look| 10 * look);
        let steps = times.map(|time| (time, node.poll(start_ms.wrapping_add(time), is_off(time))));
        steps.filter(|(_, step)| *step != RecoveryAction::None).collect()
    }

    #[test]
    fn a_node_on_the_bus_does_nothing() {
        assert_eq!(run(&mut BusOff::new(), 0, 100_000, |_| false), []);
    }

    #[test]
    fn a_bus_that_stays_broken_is_joined_three_times_and_then_left_alone() {
        for start_ms in [0, u32::MAX - 150] {
            let mut node = BusOff::new();
            let steps = run(&mut node, start_ms, 1_000_000, |_| true);
            let expected = [
                (100, RecoveryAction::Rejoin),
                (210, RecoveryAction::Rejoin),
                (320, RecoveryAction::Rejoin),
                (430, RecoveryAction::GiveUp),
            ];
            assert_eq!(steps, expected);
            assert_eq!(node.rejoins(), 3);
            assert_eq!(node.poll(0, false), RecoveryAction::None);
            assert_eq!(node.event(), EventKind::BusOffPermanent);
        }
    }

    #[test]
    fn a_node_that_has_given_up_joins_at_a_reset_and_may_then_be_off_as_often_as_at_first() {
        for start_ms in [0, u32::MAX - 500] {
            let mut node = BusOff::new();
            let given_up = run(&mut node, start_ms, 50, |_| true);
            assert_eq!(given_up.last(), Some(&(430, RecoveryAction::GiveUp)));
            let now_ms = start_ms.wrapping_add(500);
            node.reset(now_ms);
            assert_eq!(node.event(), EventKind::BusOff);
            let again = run(&mut node, now_ms, 1_000, |_| true);
            let joins =
                [(0, RecoveryAction::Rejoin), (110, RecoveryAction::Rejoin), (220, RecoveryAction::Rejoin)];
            assert_eq!(again, [&joins[..], &[(330, RecoveryAction::GiveUp)]].concat());
            node.reset(now_ms.wrapping_add(10_000));
            assert_eq!(run(&mut node, now_ms.wrapping_add(10_000), 100, |time| time == 0).len(), 1);
            assert_eq!(node.event(), EventKind::BusRejoined);
        }
    }

    #[test]
    fn a_reset_changes_nothing_for_a_node_on_the_bus() {
        let mut node = BusOff::new();
        node.reset(0);
        assert_eq!(run(&mut node, 0, 1_000, |_| false), []);
        assert_eq!(node.event(), EventKind::BusRejoined);
    }

    #[test]
    fn trouble_now_and_then_is_never_the_last() {
        // Off for 200 ms every 4 s: at most 3 times in any 10 s.
        let mut node = BusOff::new();
        let steps = run(&mut node, 0, 40_000, |time| time % 4000 >= 3800 && time % 4000 <= 3900);
        assert!(steps.iter().all(|(_, step)| *step == RecoveryAction::Rejoin));
        assert_eq!((steps.len(), node.rejoins()), (100, 100));
    }

    #[test]
    fn a_fourth_time_within_ten_seconds_is_the_last_wherever_they_begin() {
        let mut node = BusOff::new();
        // The fourth is more than 10 s after the first; the fifth is the fourth within 9.1 s.
        let off = [0, 9000, 9500, 10_200, 10_700];
        let steps =
            run(&mut node, 0, 3000, |time| off.iter().any(|start| (*start..=start + 100).contains(&time)));
        let (last, others) = steps.split_last().unwrap();
        assert_eq!(others, [100, 9100, 9600, 10_300].map(|time| (time, RecoveryAction::Rejoin)));
        assert_eq!(*last, (10_800, RecoveryAction::GiveUp));
    }

    #[test]
    fn a_bus_that_comes_back_by_itself_is_not_joined() {
        assert_eq!(run(&mut BusOff::new(), 0, 1000, |time| time % 200 < 90), []);
    }
}
