//! Bit timing of a CAN controller: time quanta per bit, and sample point.
//!
//! A bit consists of one synchronisation quantum and the quanta before and after the sample point. A quantum
//! is one or two clock cycles, because the transmitter delay compensation (RM0440, FDCAN, "Transmitter delay
//! compensation") allows no other prescaler.

/// A bit timing, in quanta.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BitTiming {
    /// Clock cycles per quantum.
    pub prescaler: u8,
    /// Quanta before the sample point, without the synchronisation quantum.
    pub segment_1: u8,
    /// Quanta after the sample point.
    pub segment_2: u8,
}

/// Limits: maximum quanta before and after the sample point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BitTimingLimits(pub u8, pub u8);

/// Limits of an STM32G4's `FDCAN_NBTP`, less one quantum that the driver cannot write.
pub const NOMINAL: BitTimingLimits = BitTimingLimits(255, 127);
/// Limits of its `FDCAN_DBTP`, likewise.
pub const DATA: BitTimingLimits = BitTimingLimits(31, 15);

impl BitTiming {
    /// Finds the bit timing of exactly this rate with the shortest quanta and the closest sample point;
    /// `None` if the clock cannot make this rate.
    #[must_use]
    pub const fn find(
        clock_hz: u32,
        bits_per_s: u32,
        sample_permille: u32,
        BitTimingLimits(max_before, max_behind): BitTimingLimits,
    ) -> Option<Self> {
        let mut prescaler: u8 = 1;
        while prescaler <= 2 {
            let quantum_hz = clock_hz / prescaler as u32;
            let quanta = quantum_hz / bits_per_s;
            let is_exact = quanta * bits_per_s * prescaler as u32 == clock_hz;
            // Rounded to a quantum.
            let sampled = (quanta * sample_permille + 500) / 1000;
            if is_exact && sampled >= 2 && sampled < quanta {
                let (before, behind) = (sampled - 1, quanta - sampled);
                if before <= max_before as u32 && behind <= max_behind as u32 {
                    #[expect(
                        clippy::cast_possible_truncation,
                        reason = "both are within the limits, of 8 bits"
                    )]
                    return Some(Self { prescaler, segment_1: before as u8, segment_2: behind as u8 });
                }
            }
            prescaler += 1;
        }
        None
    }

    /// Returns the sample point in thousandths of a bit.
    #[must_use]
    pub const fn sample_permille(self) -> u32 {
        let sampled = 1 + self.segment_1 as u32;
        1000 * sampled / (sampled + self.segment_2 as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock_switch::{CAN_4_MBIT_CLOCK_HZ, CAN_5_MBIT_CLOCK_HZ};

    #[test]
    fn a_bit_has_its_rate_its_sample_and_its_limits() {
        for clock_hz in [80_000_000, 140_000_000, 160_000_000, CAN_4_MBIT_CLOCK_HZ, CAN_5_MBIT_CLOCK_HZ] {
            for bits_per_s in [500_000, 1_000_000, 2_000_000, 4_000_000, 5_000_000, 8_000_000] {
                for limits in [NOMINAL, DATA] {
                    let Some(bit) = BitTiming::find(clock_hz, bits_per_s, 666, limits) else { continue };
                    let BitTiming { prescaler, segment_1, segment_2 } = bit;
                    let quanta = 1 + u32::from(segment_1) + u32::from(segment_2);
                    assert_eq!(quanta * u32::from(prescaler) * bits_per_s, clock_hz, "{bit:?}");
                    assert!(
                        segment_1 >= 1 && segment_2 >= 1 && segment_1 <= limits.0 && segment_2 <= limits.1,
                        "{bit:?}"
                    );
                    // Half a quantum.
                    assert!(bit.sample_permille().abs_diff(666) <= 500 / quanta + 1, "{bit:?}");
                }
            }
        }
    }

    #[test]
    fn only_the_faster_clock_makes_a_moteus_data_rate() {
        assert_eq!(BitTiming::find(CAN_4_MBIT_CLOCK_HZ, 5_000_000, 666, DATA), None);
        assert_eq!(BitTiming::find(CAN_5_MBIT_CLOCK_HZ, 4_000_000, 666, DATA), None);
        let data = BitTiming { prescaler: 1, segment_1: 22, segment_2: 11 };
        assert_eq!(BitTiming::find(CAN_5_MBIT_CLOCK_HZ, 5_000_000, 666, DATA), Some(data));
        let nominal = BitTiming { prescaler: 1, segment_1: 112, segment_2: 57 };
        assert_eq!(BitTiming::find(CAN_5_MBIT_CLOCK_HZ, 1_000_000, 666, NOMINAL), Some(nominal));
        assert_eq!((data.sample_permille(), nominal.sample_permille()), (676, 664));
    }

    /// Every output Q of the PLL with a processor clock of 168 MHz, and the crystals.
    #[test]
    fn no_other_clock_beside_168_mhz_makes_it_either() {
        let oscillator_hz = 2 * CAN_4_MBIT_CLOCK_HZ;
        let of_pll = [2, 4, 6, 8].map(|divider| oscillator_hz / divider);
        for clock_hz in of_pll.into_iter().chain([8_000_000, 24_000_000]) {
            assert_eq!(BitTiming::find(clock_hz, 5_000_000, 666, DATA), None, "{clock_hz}");
        }
    }

    #[test]
    fn a_bit_that_needs_more_quanta_than_there_are_has_longer_ones() {
        let bit = BitTiming::find(CAN_4_MBIT_CLOCK_HZ, 2_000_000, 666, DATA).unwrap();
        assert_eq!(bit.prescaler, 2);
        assert_eq!(BitTiming::find(CAN_4_MBIT_CLOCK_HZ, 500_000, 800, DATA), None);
        assert_eq!(
            BitTiming::find(3_000_000, 1_000_000, 666, DATA),
            Some(BitTiming { prescaler: 1, segment_1: 1, segment_2: 1 })
        );
    }
}
