//! A free-running hardware counter, for time measurement.

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// A register that counts processor clock cycles, up or down, and wraps.
#[derive(Debug, Clone, Copy)]
pub struct Counter {
    register: &'static AtomicU32,
    /// XOR mask that turns a down-counter into an up-counter.
    flip: u32,
    /// Mask of the counting bits.
    mask: u32,
    counts_per_cycle: u32,
}

impl Counter {
    /// Creates a counter from a register whose 32 bits count up.
    #[must_use]
    pub const fn counting_up(register: &'static AtomicU32) -> Self {
        Self { register, flip: 0, mask: u32::MAX, counts_per_cycle: 1 }
    }

    /// Creates a counter from a register whose lowest `bits` (1 to 32) count down.
    #[must_use]
    pub const fn counting_down(register: &'static AtomicU32, bits: u32) -> Self {
        Self {
            register,
            flip: u32::MAX,
            mask: if bits < 32 { (1 << bits) - 1 } else { u32::MAX },
            counts_per_cycle: 1,
        }
    }

    /// Sets the counts per processor cycle, at least 1: an emulator's counter can be faster than its
    /// processor.
    #[must_use]
    pub const fn with_counts_per_cycle(self, counts_per_cycle: u32) -> Self {
        Self { counts_per_cycle: if counts_per_cycle == 0 { 1 } else { counts_per_cycle }, ..self }
    }

    /// Returns the counts per processor cycle.
    #[must_use]
    pub const fn counts_per_cycle(&self) -> u32 {
        self.counts_per_cycle
    }

    /// Reads the counter, for [`elapsed_since`](Self::elapsed_since).
    #[inline]
    #[must_use]
    pub fn now(&self) -> u32 {
        self.register.load(Relaxed) ^ self.flip
    }

    /// Returns the counts since `start`, modulo 2^[`bits`](Self::bits).
    #[inline]
    #[must_use]
    pub fn elapsed_since(&self, start: u32) -> u32 {
        self.elapsed_between(start, self.now())
    }

    /// Returns the counts between two readings, modulo 2^[`bits`](Self::bits).
    #[inline]
    #[must_use]
    pub fn elapsed_between(&self, start: u32, end: u32) -> u32 {
        end.wrapping_sub(start) & self.mask
    }

    /// Returns the number of counting bits.
    #[must_use]
    pub const fn bits(&self) -> u32 {
        self.mask.count_ones()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ways_of_counting_give_the_same_across_the_wrap() {
        static UP: AtomicU32 = AtomicU32::new(u32::MAX - 1);
        static DOWN: AtomicU32 = AtomicU32::new(1);
        let (up, down) = (Counter::counting_up(&UP), Counter::counting_down(&DOWN, 24));
        let starts = [up.now(), down.now()];
        UP.store(5, Relaxed);
        DOWN.store(0xff_fffa, Relaxed);
        assert_eq!([up.elapsed_since(starts[0]), down.elapsed_since(starts[1])], [7, 7]);
        assert_eq!([up.bits(), down.bits(), Counter::counting_down(&DOWN, 99).bits()], [32, 24, 32]);
    }
}
