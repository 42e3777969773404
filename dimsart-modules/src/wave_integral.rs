//! Wave counters: transmit a wave over a link that loses packets without losing its integral.
//!
//! The sender integrates its wave (`U = sum h u`) and its energy (`W = sum h/2 u²`) in wrapping integer counters, whose
//! resolution does not degrade over time. The receiver keeps the same sums of its output; the differences are the
//! outstanding wave and energy (idea: Niemeyer and Slotine, ICRA 1998). An output of at most `sqrt(2 E / h)` keeps the
//! link passive.

use dimsart_core::math;

/// `sqrt(W)·s` per count of the wave counter: 2^-28, so it wraps after ±8.
const WAVE_QUANTUM: f32 = 1.0 / 268_435_456.0;
/// `J` per count of the energy counter: 2^-30, so it wraps after 4.
const ENERGY_QUANTUM: f32 = 1.0 / 1_073_741_824.0;

/// Maximum counts per tick: an energy of 4 J and a wave of 8 `sqrt(W)·s`. Excess is discarded instead of kept in the
/// rests.
const MAX_ENERGY: f32 = 4_294_967_040.0;
const MAX_WAVE: f32 = 2_147_483_520.0;
/// Margin above the rounding error of an energy in `f32`.
const MARGIN: f32 = 1.0 + 8.0 * f32::EPSILON;

dimsart_core::words! {
    /// Totals sent by one axis since the module was created.
    pub struct SentTotals { wave: u32, energy: u32, wave_rest: f32, energy_rest: f32 }

    /// Totals received by one axis, and the part outstanding.
    pub struct ReceivedTotals {
        wave: u32,
        energy: u32,
        owed: i32,
        unspent: u32,
        /// Output but not subtracted from `unspent` yet, in counts, at most 1.
        spent_rest: f32,
    }
}

impl SentTotals {
    /// Adds the wave of this tick. Returns the wave and both counters.
    ///
    /// At most 4 J per tick are counted. Above that, a receiver that limits its output by energy outputs too little; a
    /// receiver without that limit recovers the full wave.
    pub(super) fn add(&mut self, wave: f32, period_s: f32) -> (f32, [u32; 2]) {
        let energy_counts = self.energy_rest + (0.5 * wave * wave) * (period_s / ENERGY_QUANTUM);
        let energy_counts = math::min(energy_counts, MAX_ENERGY);
        let counts = math::limit(self.wave_rest + wave * (period_s / WAVE_QUANTUM), MAX_WAVE);
        let whole = to_count(counts);
        self.wave_rest = counts - from_count(whole);
        self.wave = self.wave.wrapping_add(whole.cast_unsigned());
        let whole = to_unsigned(energy_counts);
        self.energy_rest = energy_counts - from_unsigned(whole);
        self.energy = self.energy.wrapping_add(whole);
        (wave, [self.wave, self.energy])
    }
}

impl ReceivedTotals {
    /// Adds the counters of a new packet; the outstanding wave saturates.
    pub(super) fn update(&mut self, [wave, energy]: [u32; 2]) {
        if self.owed == 0 && self.unspent == 0 {
            // Waves passed through so far may contain a fraction that the sender has not counted yet.
            self.spent_rest = 1.0;
        }
        self.owed = self.owed.saturating_add(wave.wrapping_sub(self.wave).cast_signed());
        self.unspent = self.unspent.saturating_add(energy.wrapping_sub(self.energy));
        self.wave = wave;
        self.energy = energy;
    }

    /// Checks that no wave is outstanding.
    pub(super) fn is_settled(&self) -> bool {
        self.owed == 0
    }

    /// Adopts the counters of a new packet and clears the outstanding wave and energy.
    pub(super) fn settle(&mut self, [wave, energy]: [u32; 2]) {
        self.wave = wave;
        self.energy = energy;
        self.owed = 0;
        self.unspent = 0;
    }

    /// Returns the wave that outputs the outstanding integral evenly in `ticks` ticks (0: at once); with `is_limited`,
    /// at most as much as the received energy allows.
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
        // Spread the energy over the ticks: the backlog of an outage must not exhaust the energy of the jitter buffer.
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

/// Rounds towards zero; saturates.
#[expect(clippy::cast_possible_truncation, reason = "saturating, towards zero: intended")]
fn to_count(counts: f32) -> i32 {
    counts as i32
}

#[expect(clippy::cast_precision_loss, reason = "a difference of counters, as exact as the wave itself")]
fn from_count(counts: i32) -> f32 {
    counts as f32
}

/// Rounds towards zero; saturates.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturating: intended")]
fn to_unsigned(counts: f32) -> u32 {
    counts as u32
}

#[expect(clippy::cast_precision_loss, reason = "an energy, as exact as the wave itself")]
fn from_unsigned(counts: u32) -> f32 {
    counts as f32
}
