//! Reception of packets: sequence check, loss and timeout detection, link statistics.

use dimsart_core::mailbox::{LinkPort, LinkTimeout, START_COUNTERS, counter_distance, is_newer, low_u16};
use dimsart_core::{Content, LinkState};

/// Silence after which two packets out of sequence, the second newer than the first, indicate a restart of the sender.
const RESTART_TICKS: u32 = 100;
/// Maximum plausible loss, in ticks, beyond the time without packets: covers packets that were delayed together. A
/// larger jump ahead of the counter is implausible.
const LATE_TICKS: u32 = 1000;
/// Maximum counter step reported as `OkSomeLost`; AUTOSAR's `MaxDeltaCounter`.
const MAX_DELTA: u32 = 3;
/// Weight of a new deviation in the smoothed jitter (RFC 3550, 6.4.1).
const SMOOTHING: f32 = 1.0 / 16.0;

dimsart_core::words! {
    /// Expected packets; depends on parameters only.
    pub(super) struct Expected {
        pub(super) content: Content,
        /// Number of sample words in the packet; counters follow.
        pub(super) samples: u32,
        /// Ticks per packet.
        pub(super) every_ticks: u32,
        /// Ticks without a due packet until the link is lost; 0: never.
        pub(super) timeout_ticks: u32,
    }

    /// State of the reception.
    pub(super) struct Reception {
        /// Counter of the newest accepted packet; 0 before the first.
        counter: u16,
        /// Counter of a packet that may be the first after a restart of the sender.
        restart_counter: u16,
        /// Counter of the newest accepted packet at that time.
        restart_accepted: u16,
        pub(super) age_ticks: u32,
        pub(super) lost: u32,
        pub(super) refused: u32,
        pub(super) round_trip_ticks: u32,
        pub(super) jitter_ticks: f32,
        state: LinkState,
        is_lost: bool,
        /// Ticks for which the newest packet's wave is still held; a new packet waits meanwhile.
        held_ticks: u32,
        /// Ticks that the waiting packet has waited.
        waits_ticks: u32,
        /// Ticks that the packet before it waited.
        waited_ticks: u32,
    }
}

/// How an accepted packet arrived.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Came {
    /// Next in sequence.
    Next,
    /// After missing packets.
    AfterLoss,
    /// First packet, or first after a restart of the sender.
    Restarted,
    /// Earlier: its wave is still held.
    Held,
}

impl Reception {
    /// Holds the newest packet's wave for another tick.
    #[cold]
    pub(super) fn hold(&mut self, link: &LinkPort) {
        self.held_ticks = self.held_ticks.saturating_sub(1);
        self.age_ticks = self.age_ticks.saturating_add(1);
        self.waits_ticks += u32::from(link.received.is_full());
    }

    /// Ends the hold.
    pub(super) fn hold_no_more(&mut self) {
        self.held_ticks = 0;
    }

    /// Returns the counter of the newest accepted packet; 0 before the first.
    pub(super) fn counter(&self) -> u16 {
        self.counter
    }

    /// Checks whether the newest packet's wave is held for another tick.
    #[inline]
    pub(super) fn is_holding(&self) -> bool {
        self.held_ticks != 0
    }

    /// Accepts the next packet in sequence on a healthy link with one packet per tick, if all its words are finite as
    /// `f32`. Returns false, unchanged, in any other case. Does not write to the link.
    #[inline(always)]
    pub(super) fn accept_next(&mut self, link: &LinkPort, expected: &Expected) -> bool {
        let received = &link.received;
        let counter = received.counter();
        let is_next = received.is_full()
            && received.content() == expected.content
            && u32::from(received.finite_word_count()) >= expected.samples
            && counter == self.counter.wrapping_add(1)
            && self.counter != 0
            && expected.every_ticks == 1
            && !self.is_lost;
        if is_next {
            self.state = LinkState::Ok;
            self.measure_jitter(1, 1);
            self.counter = counter;
            self.age_ticks = 0;
            let echo = received.echo();
            if echo != 0 {
                self.measure_round_trip(link, echo);
            }
        }
        is_next
    }

    /// Records the accepted packet in the link.
    #[inline(always)]
    pub(super) fn acknowledge(&self, link: &LinkPort) {
        link.has_refused.set(false);
        link.skipped_ticks.set(0);
        link.accepted_counter.set(self.counter);
    }

    /// Accepts or refuses a new packet and updates the statistics. Returns how an accepted packet arrived.
    pub(super) fn accept(&mut self, link: &LinkPort, expected: &Expected) -> Option<Came> {
        if !link.received.is_full() {
            return self.go_without(link, expected);
        }
        link.received.clear();
        if link.received.content() != expected.content
            || u32::from(link.received.finite_word_count()) < expected.samples
        {
            return self.refuse(LinkState::Error, link, expected);
        }
        let counter = link.received.counter();
        let came = if self.counter != 0 && counter == self.counter.wrapping_add(1) {
            self.state = LinkState::Ok;
            self.measure_jitter(expected.every_ticks, expected.every_ticks);
            Came::Next
        } else {
            self.accept_jump(link, counter, expected)?
        };
        self.counter = counter;
        self.age_ticks = 0;
        self.held_ticks = expected.every_ticks.saturating_sub(1);
        self.acknowledge(link);
        let echo = link.received.echo();
        if echo != 0 {
            self.measure_round_trip(link, echo);
        }
        Some(came)
    }

    /// Returns the link state of this tick; marks a lost link.
    #[inline]
    pub(super) fn state(&self, link: &LinkPort) -> LinkState {
        if self.is_lost {
            link.timeout.set(LinkTimeout::Lost);
            return LinkState::Timeout;
        }
        self.state
    }

    /// Returns the ticks since the next packet was due, including that tick.
    pub(super) fn overdue_ticks(&self, every_ticks: u32) -> u32 {
        (self.age_ticks + 1).saturating_sub(every_ticks)
    }

    #[inline(never)]
    fn go_without(&mut self, link: &LinkPort, expected: &Expected) -> Option<Came> {
        self.catch_up(link);
        self.grow_older(link, expected);
        if link.has_refused.replace(false) {
            self.state = LinkState::Error;
        } else if self.overdue_ticks(expected.every_ticks) > 0 {
            self.state = LinkState::NoData;
        }
        None
    }

    #[cold]
    fn refuse(&mut self, state: LinkState, link: &LinkPort, expected: &Expected) -> Option<Came> {
        self.refused = self.refused.wrapping_add(1);
        self.state = state;
        self.waits_ticks = 0;
        self.grow_older(link, expected);
        None
    }

    /// Adds the ticks in which the module was not computed; nothing ages before the first packet.
    fn catch_up(&mut self, link: &LinkPort) {
        let skipped_ticks = link.skipped_ticks.take();
        if self.counter != 0 {
            self.age_ticks = self.age_ticks.saturating_add(skipped_ticks).min(u32::MAX - 1);
        }
    }

    fn grow_older(&mut self, link: &LinkPort, expected: &Expected) {
        self.age_ticks = self.age_ticks.saturating_add(1).min(u32::MAX - 1);
        let Expected { every_ticks, timeout_ticks, .. } = *expected;
        let is_late = timeout_ticks != 0 && self.overdue_ticks(every_ticks) >= timeout_ticks;
        if is_late && self.counter == 0 {
            link.timeout.set(LinkTimeout::Down);
        }
        self.is_lost |= is_late && self.counter != 0;
    }

    /// Updates the jitter for packets sent `sent_ticks` apart (RFC 3550).
    #[inline]
    fn measure_jitter(&mut self, sent_ticks: u32, every_ticks: u32) {
        let mut came_ticks = self.age_ticks + 1;
        if every_ticks > 1 {
            came_ticks = came_ticks.saturating_add(self.waited_ticks).saturating_sub(self.waits_ticks);
            self.waited_ticks = core::mem::take(&mut self.waits_ticks);
        }
        #[expect(clippy::cast_precision_loss, reason = "few ticks, or so many that it does not matter")]
        let deviation = came_ticks.abs_diff(sent_ticks) as f32;
        self.jitter_ticks += (deviation - self.jitter_ticks) * SMOOTHING;
    }

    #[inline]
    fn measure_round_trip(&mut self, link: &LinkPort, echo: u16) {
        let sent_number = link.sent_number.get();
        let packets = u32::from(counter_distance(low_u16(sent_number), echo));
        // Ignore echoes from before the last start of this side.
        if packets < sent_number {
            self.round_trip_ticks = packets * link.send_period_ticks.get() + link.ticks_since_sent.get() + 1;
        }
    }

    /// Accepts or refuses a packet out of sequence and counts lost packets.
    #[cold]
    fn accept_jump(&mut self, link: &LinkPort, counter: u16, expected: &Expected) -> Option<Came> {
        self.catch_up(link);
        if counter == self.counter {
            return self.refuse(LinkState::Repeated, link, expected);
        }
        let delta = u32::from(counter_distance(counter, self.counter));
        let sent_ticks = delta.saturating_mul(expected.every_ticks);
        // Counters wrap: an apparent jump ahead can be a restart of the sender.
        let is_start = counter <= START_COUNTERS && u32::from(self.counter) > LATE_TICKS;
        let is_ahead = !is_start
            && is_newer(counter, self.counter)
            && sent_ticks <= self.age_ticks.saturating_add(1 + LATE_TICKS);
        let first = self.restart_counter;
        let follows_first = self.restart_accepted == self.counter && is_newer(counter, first);
        self.state = LinkState::WrongSequence;
        if self.counter == 0 {
            self.state = LinkState::Ok;
        } else if is_ahead && !(follows_first && first <= START_COUNTERS) {
            self.lost = self.lost.wrapping_add(delta.wrapping_sub(1));
            self.measure_jitter(sent_ticks, expected.every_ticks);
            self.state = match delta {
                1 => LinkState::Ok,
                2..=MAX_DELTA => LinkState::OkSomeLost,
                _ => LinkState::WrongSequence,
            };
            return Some(if delta == 1 { Came::Next } else { Came::AfterLoss });
        } else if !is_ahead {
            let is_silent = self.age_ticks >= RESTART_TICKS;
            if is_silent || is_start {
                (self.restart_counter, self.restart_accepted) = (counter, self.counter);
            }
            if !(is_silent && follows_first) {
                return self.refuse(LinkState::WrongSequence, link, expected);
            }
        }
        self.round_trip_ticks = 0;
        Some(Came::Restarted)
    }
}
