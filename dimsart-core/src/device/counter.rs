//! A counter that runs by itself, for whoever measures time.

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// A register that counts with the processor's clock, up or down, and wraps.
#[derive(Debug, Clone, Copy)]
pub struct Counter {
    register: &'static AtomicU32,
    /// What makes a register that counts down count up.
    flip: u32,
    /// Bits that count.
    mask: u32,
    counts_per_cycle: u32,
}

impl Counter {
    /// A register whose 32 bits count up.
    #[must_use]
    pub const fn up(register: &'static AtomicU32) -> Self {
        Self { register, flip: 0, mask: u32::MAX, counts_per_cycle: 1 }
    }

    /// A register whose lowest bits count down, 1 to 32 of them.
    #[must_use]
    pub const fn down(register: &'static AtomicU32, bits: u32) -> Self {
        Self {
            register,
            flip: u32::MAX,
            mask: if bits < 32 { (1 << bits) - 1 } else { u32::MAX },
            counts_per_cycle: 1,
        }
    }

    /// One that counts faster than the processor, as in an emulator: so many counts in a cycle, at least 1.
    #[must_use]
    pub const fn with_counts_per_cycle(self, counts_per_cycle: u32) -> Self {
        Self { counts_per_cycle: if counts_per_cycle == 0 { 1 } else { counts_per_cycle }, ..self }
    }

    /// Counts in a cycle of the processor.
    #[must_use]
    pub const fn counts_per_cycle(&self) -> u32 {
        self.counts_per_cycle
    }

    /// Now, to be shown to [`since`](Self::since).
    #[inline]
    #[must_use]
    pub fn now(&self) -> u32 {
        self.register.load(Relaxed) ^ self.flip
    }

    /// Counts since then, modulo the counter's [period](Self::bits).
    #[inline]
    #[must_use]
    pub fn since(&self, start: u32) -> u32 {
        self.between(start, self.now())
    }

    /// Counts from one [`now`](Self::now) to a later one, modulo the counter's [period](Self::bits).
    #[inline]
    #[must_use]
    pub fn between(&self, start: u32, end: u32) -> u32 {
        end.wrapping_sub(start) & self.mask
    }

    /// Bits that count.
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
        let (up, down) = (Counter::up(&UP), Counter::down(&DOWN, 24));
        let starts = [up.now(), down.now()];
        UP.store(5, Relaxed);
        DOWN.store(0xff_fffa, Relaxed);
        assert_eq!([up.since(starts[0]), down.since(starts[1])], [7, 7]);
        assert_eq!([up.bits(), down.bits(), Counter::down(&DOWN, 99).bits()], [32, 24, 32]);
    }
}
