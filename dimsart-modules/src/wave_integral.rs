//! Counters that carry a wave over a link that loses packets.
//!
//! The sender adds up its wave (`U = sum h u`) and its energy (`W = sum h/2 u²`) in wrapping integer
//! counters, so neither loses resolution however long it runs. The receiver keeps the same two sums
//! of what it has given out; the differences are what the line still owes (idea: Niemeyer and
//! Slotine, ICRA 1998). Giving out at most `sqrt(2 E / h)` keeps the line passive.

use dimsart_core::math;

/// `sqrt(W)·s` per count of the wave counter: 2^-28, so it wraps after ±8.
const WAVE_QUANTUM: f32 = 1.0 / 268_435_456.0;
/// `J` per count of the energy counter: 2^-30, so it wraps after 4.
const ENERGY_QUANTUM: f32 = 1.0 / 1_073_741_824.0;

/// Most counts of one tick: an energy of 4 J, and a wave of 8 `sqrt(W)·s`. What is beyond is not counted, or it would stay in
/// the rests.
const MOST_ENERGY: f32 = 4_294_967_040.0;
const MOST_WAVE: f32 = 2_147_483_520.0;
/// More than the roundings of an energy that is worked out in `f32`.
const MARGIN: f32 = 1.0 + 8.0 * f32::EPSILON;

dimsart_core::words! {
    /// What one axis has sent since the module was made.
    pub struct Sent { wave: u32, energy: u32, wave_rest: f32, energy_rest: f32 }

    /// What one axis has received, and of that what it still owes.
    pub struct Received {
        wave: u32,
        energy: u32,
        owed: i32,
        unspent: u32,
        /// Given out but not taken off `unspent` yet, in counts, below 1 or 1.
        spent_rest: f32,
    }
}

impl Sent {
    /// Adds the wave that is to be sent this tick; gives what is sent, and both counters.
    ///
    /// Of a wave with more than 4 J in a tick, no more energy than that is counted: so a receiver that limits what it gives
    /// out gives out too little, and one that does not makes up for all of it.
    pub(super) fn add(&mut self, wave: f32, period_s: f32) -> (f32, [u32; 2]) {
        let energy_counts = self.energy_rest + (0.5 * wave * wave) * (period_s / ENERGY_QUANTUM);
        let energy_counts = math::min(energy_counts, MOST_ENERGY);
        let counts = math::limit(self.wave_rest + wave * (period_s / WAVE_QUANTUM), MOST_WAVE);
        let whole = to_count(counts);
        self.wave_rest = counts - from_count(whole);
        self.wave = self.wave.wrapping_add(whole.cast_unsigned());
        let whole = to_unsigned(energy_counts);
        self.energy_rest = energy_counts - from_unsigned(whole);
        self.energy = self.energy.wrapping_add(whole);
        (wave, [self.wave, self.energy])
    }
}

impl Received {
    /// Takes the counters of a new packet. A debt beyond the counter's range stays at its end.
    pub(super) fn update(&mut self, [wave, energy]: [u32; 2]) {
        if self.owed == 0 && self.unspent == 0 {
            // The waves handed through so far may hold a fraction that the sender has not counted yet.
            self.spent_rest = 1.0;
        }
        self.owed = self.owed.saturating_add(wave.wrapping_sub(self.wave).cast_signed());
        self.unspent = self.unspent.saturating_add(energy.wrapping_sub(self.energy));
        self.wave = wave;
        self.energy = energy;
    }

    /// Whether nothing is owed.
    pub(super) fn is_settled(&self) -> bool {
        self.owed == 0
    }

    /// Takes the counters of a new packet after which nothing is owed, whatever happened before.
    pub(super) fn settle(&mut self, [wave, energy]: [u32; 2]) {
        self.wave = wave;
        self.energy = energy;
        self.owed = 0;
        self.unspent = 0;
    }

    /// The wave that pays what is owed evenly in `ticks` ticks, 0 for at once; with `is_limited` only as much of it as
    /// the energy received and not given out yet allows.
    #[inline(never)]
    pub(super) fn pay(&mut self, period_s: f32, ticks: u16, is_limited: bool) -> f32 {
        let mut counts = self.owed.checked_div(ticks.into()).unwrap_or(self.owed);
        let to_wave = WAVE_QUANTUM / period_s;
        if !is_limited {
            self.unspent = 0;
            self.owed = self.owed.saturating_sub(counts);
            return from_count(counts) * to_wave;
        }
        let energy = (from_unsigned(self.unspent) - self.spent_rest).max(0.0) / (MARGIN * MARGIN);
        // No more of it than of the time: what an outage has left unpaid must not use up what evens out jitter.
        let share = energy / f32::from(ticks.max(1));
        let largest = math::sqrt(2.0 * share * ENERGY_QUANTUM / period_s);
        let limit = to_count(largest * (period_s / WAVE_QUANTUM));
        counts = counts.max(-limit).min(limit);
        let wave = from_count(counts) * to_wave;
        let spent = self.spent_rest + (0.5 * wave * wave) * (period_s / ENERGY_QUANTUM) * MARGIN;
        let whole = to_unsigned(spent);
        self.spent_rest = spent - from_unsigned(whole);
        self.unspent = self.unspent.saturating_sub(whole);
        self.owed = self.owed.saturating_sub(counts);
        wave
    }
}

/// Towards zero; saturates.
#[expect(clippy::cast_possible_truncation, reason = "saturating, towards zero: what is meant")]
fn to_count(counts: f32) -> i32 {
    counts as i32
}

#[expect(clippy::cast_precision_loss, reason = "a difference of counters, as exact as the wave itself")]
fn from_count(counts: i32) -> f32 {
    counts as f32
}

/// Towards zero; saturates.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturating: what is meant")]
fn to_unsigned(counts: f32) -> u32 {
    counts as u32
}

#[expect(clippy::cast_precision_loss, reason = "an energy, as exact as the wave itself")]
fn from_unsigned(counts: u32) -> f32 {
    counts as f32
}
