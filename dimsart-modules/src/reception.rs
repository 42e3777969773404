//! Which packets a receiver accepts, and what it knows of its link.

use dimsart_core::mailbox::{LinkPort, START_COUNTERS, Silence, counters_ahead, is_newer, low_half};
use dimsart_core::{Content, LinkState};

/// Silence after which two packets that are not next ones, the second newer than the first, mean that the
/// sender has started anew.
const RESTART_TICKS: u32 = 100;
/// Ticks of packets that can be missing at once beyond those that nothing came in: packets that were late together.
/// A longer way ahead is none that a sender can have gone.
const LATE_TICKS: u32 = 1000;
/// Largest step of the counter with which too little is lost to be worth more than a word: AUTOSAR's `MaxDeltaCounter`.
const MAX_DELTA: u32 = 3;
/// Share of a new deviation in the smoothed jitter (RFC 3550, 6.4.1).
const SMOOTHING: f32 = 1.0 / 16.0;

dimsart_core::words! {
    /// What the receiver listens for; it changes with parameters only.
    pub(super) struct Expected {
        pub(super) content: Content,
        /// Words of the packet that are samples; counters follow.
        pub(super) samples: u32,
        /// Ticks from a packet to the next one.
        pub(super) every_ticks: u32,
        /// Ticks without a packet that was due after which the link is lost; 0 for never.
        pub(super) timeout_ticks: u32,
    }

    /// What came so far.
    pub(super) struct Reception {
        /// Of the newest packet accepted; 0 before the first.
        counter: u16,
        /// What may be the first packet of a sender that has started anew.
        restart_counter: u16,
        /// The newest one accepted then.
        restart_accepted: u16,
        pub(super) age_ticks: u32,
        pub(super) lost: u32,
        pub(super) refused: u32,
        pub(super) round_trip_ticks: u32,
        pub(super) jitter_ticks: f32,
        state: LinkState,
        is_lost: bool,
        /// Ticks that the newest packet's wave is still held for; a packet that comes meanwhile waits.
        held_ticks: u32,
        /// Ticks that the packet which waits now has waited.
        waits_ticks: u32,
        /// Ticks that the one before it had to wait.
        waited_ticks: u32,
    }
}

/// How a packet came that was accepted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Came {
    /// Right after the one before it.
    Next,
    /// After some that are missing.
    Jumped,
    /// As the first one of another life of its sender.
    Restarted,
    /// A while ago: its wave goes on.
    Held,
}

impl Reception {
    /// Lets the newest packet's wave go on for another tick.
    #[cold]
    pub(super) fn hold(&mut self, link: &LinkPort) {
        self.held_ticks = self.held_ticks.saturating_sub(1);
        self.age_ticks = self.age_ticks.saturating_add(1);
        self.waits_ticks += u32::from(link.received.is_full());
    }

    /// Does not let it go on any more.
    pub(super) fn hold_no_more(&mut self) {
        self.held_ticks = 0;
    }

    /// Counter of the newest packet that was accepted; 0 before the first.
    pub(super) fn counter(&self) -> u16 {
        self.counter
    }

    /// Whether the wave of the newest packet goes on for another tick.
    #[inline]
    pub(super) fn is_holding(&self) -> bool {
        self.held_ticks != 0
    }

    /// Whether the packet right after the last one is there, every sample finite if it is read as `f32`, on a link that
    /// is as it should be and brings one every tick; takes note of its header then, and has not changed otherwise.
    /// Writes nothing of the link.
    #[inline(always)]
    pub(super) fn accept_next(&mut self, link: &LinkPort, expected: &Expected) -> bool {
        let received = &link.received;
        let counter = received.counter();
        let is_next = received.is_full()
            && received.content() == expected.content
            && u32::from(received.finite_words()) >= expected.samples
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

    /// Tells the link which packet was accepted.
    #[inline(always)]
    pub(super) fn acknowledge(&self, link: &LinkPort) {
        link.is_damaged.set(false);
        link.missed_ticks.set(0);
        link.accepted_counter.set(self.counter);
    }

    /// How a new packet came, if there is one that is accepted; takes note of its header.
    pub(super) fn accept(&mut self, link: &LinkPort, expected: &Expected) -> Option<Came> {
        if !link.received.is_full() {
            return self.go_without(link, expected);
        }
        link.received.clear();
        if link.received.content() != expected.content
            || u32::from(link.received.finite_words()) < expected.samples
        {
            return self.refuse(LinkState::Error, link, expected);
        }
        let counter = link.received.counter();
        // The first one of all has none before it.
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

    /// What came of the present tick; told to the link when it is lost.
    #[inline]
    pub(super) fn state(&self, link: &LinkPort) -> LinkState {
        if self.is_lost {
            link.silence.set(Silence::Lost);
            return LinkState::Timeout;
        }
        self.state
    }

    /// Ticks since the next packet was due, that tick included.
    pub(super) fn overdue_ticks(&self, every_ticks: u32) -> u32 {
        (self.age_ticks + 1).saturating_sub(every_ticks)
    }

    #[inline(never)]
    fn go_without(&mut self, link: &LinkPort, expected: &Expected) -> Option<Came> {
        self.catch_up(link);
        self.grow_older(link, expected);
        if link.is_damaged.replace(false) {
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

    /// Time has gone on in ticks that computed nothing; before the first packet there is nothing that ages.
    fn catch_up(&mut self, link: &LinkPort) {
        let missed_ticks = link.missed_ticks.take();
        if self.counter != 0 {
            self.age_ticks = self.age_ticks.saturating_add(missed_ticks).min(u32::MAX - 1);
        }
    }

    fn grow_older(&mut self, link: &LinkPort, expected: &Expected) {
        self.age_ticks = self.age_ticks.saturating_add(1).min(u32::MAX - 1);
        let Expected { every_ticks, timeout_ticks, .. } = *expected;
        let is_late = timeout_ticks != 0 && self.overdue_ticks(every_ticks) >= timeout_ticks;
        if is_late && self.counter == 0 {
            link.silence.set(Silence::Down);
        }
        self.is_lost |= is_late && self.counter != 0;
    }

    /// Between packets that were sent so many ticks apart, as RFC 3550 does.
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
        let packets = u32::from(counters_ahead(low_half(sent_number), echo));
        // Not of a life of this side before its last start.
        if packets < sent_number {
            self.round_trip_ticks = packets * link.sent_every_ticks.get() + link.since_sent_ticks.get() + 1;
        }
    }

    /// How a packet came that is not the next one, if it is new; counts what is missing before it.
    #[cold]
    fn accept_jump(&mut self, link: &LinkPort, counter: u16, expected: &Expected) -> Option<Came> {
        self.catch_up(link);
        if counter == self.counter {
            return self.refuse(LinkState::Repeated, link, expected);
        }
        let delta = u32::from(counters_ahead(counter, self.counter));
        let sent_ticks = delta.saturating_mul(expected.every_ticks);
        // Counters go round: what seems to be ahead can come from a sender that has started anew.
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
            return Some(if delta == 1 { Came::Next } else { Came::Jumped });
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
