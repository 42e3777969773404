//! Counters that carry a wave over a link that loses packets.
//!
//! The sender adds up its wave (`U = sum h u`) and its energy (`W = sum h/2 u²`) in wrapping integer
//! counters, so neither loses resolution however long it runs. The receiver keeps the same two sums
//! of what it has given out; the differences are what the line still owes (idea: Niemeyer and
//! Slotine, ICRA 1998). Giving out at most `sqrt(2 E / h)` keeps the line passive.

use crate::math;

/// `sqrt(W)·s` per count of the wave counter: 2^-28, so it wraps after ±8.
const WAVE_QUANTUM: f32 = 1.0 / 268_435_456.0;
/// `J` per count of the energy counter: 2^-30, so it wraps after 4.
const ENERGY_QUANTUM: f32 = 1.0 / 1_073_741_824.0;

/// What one axis has sent since it was reset.
#[derive(Debug, Default, Clone, Copy)]
pub(super) struct Sent {
    wave: u32,
    energy: u32,
    wave_rest: f32,
    energy_rest: f32,
}

impl Sent {
    /// Adds this tick's wave; gives both counters.
    pub(super) fn add(&mut self, wave: f32, period_s: f32) -> [u32; 2] {
        let counts = self.wave_rest + wave * (period_s / WAVE_QUANTUM);
        let whole = to_count(counts);
        self.wave_rest = counts - from_count(whole);
        self.wave = self.wave.wrapping_add(whole.cast_unsigned());
        let counts = self.energy_rest + (0.5 * wave * wave) * (period_s / ENERGY_QUANTUM);
        let whole = to_count(counts);
        self.energy_rest = counts - from_count(whole);
        self.energy = self.energy.wrapping_add(whole.cast_unsigned());
        [self.wave, self.energy]
    }
}

/// What one axis has received and given out.
#[derive(Debug, Default, Clone, Copy)]
pub(super) struct Received {
    wave: u32,
    energy: u32,
    given_wave: u32,
    given_energy: u32,
}

impl Received {
    /// Takes the counters of a new packet.
    pub(super) fn update(&mut self, [wave, energy]: [u32; 2]) {
        self.wave = wave;
        self.energy = energy;
    }

    /// Whether nothing is owed.
    pub(super) fn is_settled(&self) -> bool {
        self.wave == self.given_wave
    }

    /// Forgets what happened before: nothing is owed.
    pub(super) fn settle(&mut self) {
        self.given_wave = self.wave;
        self.given_energy = self.energy;
    }

    /// The wave that pays all that is owed in one tick, whatever energy that takes.
    pub(super) fn owed(&mut self, period_s: f32) -> f32 {
        let counts = self.wave.wrapping_sub(self.given_wave).cast_signed();
        self.settle();
        from_count(counts) * (WAVE_QUANTUM / period_s)
    }

    /// The wave that pays as much of it as the energy received and not given out yet allows.
    #[inline(never)]
    pub(super) fn owed_within_energy(&mut self, period_s: f32) -> f32 {
        let owed = self.wave.wrapping_sub(self.given_wave).cast_signed();
        let energy = self.energy.wrapping_sub(self.given_energy);
        let largest = math::sqrt(2.0 * unsigned(energy) * ENERGY_QUANTUM / period_s);
        let limit = to_count(largest * (period_s / WAVE_QUANTUM));
        let counts = owed.max(-limit).min(limit);
        let wave = from_count(counts) * (WAVE_QUANTUM / period_s);
        // Rounded up and never more than there is: the account must not go below zero.
        let spent = to_count((0.5 * wave * wave) * (period_s / ENERGY_QUANTUM)).cast_unsigned();
        let spent = spent.saturating_add(u32::from(counts != 0)).min(energy);
        self.given_wave = self.given_wave.wrapping_add(counts.cast_unsigned());
        self.given_energy = self.given_energy.wrapping_add(spent);
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

#[expect(clippy::cast_precision_loss, reason = "an energy, as exact as the wave itself")]
fn unsigned(counts: u32) -> f32 {
    counts as f32
}
