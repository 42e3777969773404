//! Serialisation of a configuration to words for transfer and storage.

use crate::configuration::{Configuration, Encoder, Inverter, Joint, Limits, Motor};

impl Configuration {
    /// Layout version of the words; changes with their order or meaning.
    pub const LAYOUT: u16 = 2;
    /// Number of words.
    pub const WORDS: usize = 24;

    /// Returns the words: the bits of the values, in the order of the fields.
    #[must_use]
    pub fn to_words(&self) -> [u32; Self::WORDS] {
        let Self { bandwidth_rad_per_s, aligning_current_a, .. } = *self;
        let Self { motor, encoder, joint, limits, inverter, .. } = *self;
        let (kind, counts_per_turn) = match encoder {
            Encoder::Incremental { counts_per_turn } => (0, counts_per_turn),
            Encoder::As5047p => (1, 0),
            Encoder::Mt6701 => (2, 0),
            Encoder::As5600 => (3, 0),
        };
        [
            bandwidth_rad_per_s.to_bits(),
            aligning_current_a.to_bits(),
            motor.resistance_ohm.to_bits(),
            motor.direct_inductance_h.to_bits(),
            motor.quadrature_inductance_h.to_bits(),
            motor.flux_linkage_vs.to_bits(),
            u32::from(motor.pole_pairs) | u32::from(motor.is_encoder_reversed) << 8,
            motor.encoder_offset_rad.to_bits(),
            kind,
            counts_per_turn,
            joint.gear_ratio.to_bits(),
            joint.zero_rad.to_bits(),
            limits.current_a.to_bits(),
            limits.trip_current_a.to_bits(),
            limits.min_bus_v.to_bits(),
            limits.max_bus_v.to_bits(),
            limits.derating_c.to_bits(),
            limits.trip_c.to_bits(),
            limits.speed_rad_per_s.to_bits(),
            limits.stall_s.to_bits(),
            inverter.period_s.to_bits(),
            inverter.dead_time_share.to_bits(),
            inverter.dead_time_current_a.to_bits(),
            inverter.max_duty.to_bits(),
        ]
    }

    /// Decodes words of this [layout](Self::LAYOUT) without validation. Returns `None` for a wrong number of words or
    /// an unknown encoder or flag.
    #[must_use]
    pub fn from_words(words: &[u32]) -> Option<Self> {
        let words: &[u32; Self::WORDS] = words.try_into().ok()?;
        let number = words.map(f32::from_bits);
        let [bandwidth_rad_per_s, aligning_current_a, ..] = number;
        let [_, _, resistance_ohm, direct_inductance_h, quadrature_inductance_h, flux_linkage_vs, ..] =
            number;
        let [_, _, _, _, _, _, poles, _, kind, counts_per_turn, ..] = *words;
        let [.., stall_s, period_s, dead_time_share, dead_time_current_a, max_duty] = number;
        let [_, _, _, _, _, _, _, encoder_offset_rad, _, _, gear_ratio, zero_rad, rest @ ..] = number;
        let [current_a, trip_current_a, min_bus_v, max_bus_v, derating_c, trip_c, speed_rad_per_s, ..] = rest;
        let [pole_pairs, is_encoder_reversed @ (0 | 1), 0, 0] = poles.to_le_bytes() else { return None };
        let encoder = match kind {
            0 => Encoder::Incremental { counts_per_turn },
            1 => Encoder::As5047p,
            2 => Encoder::Mt6701,
            3 => Encoder::As5600,
            _ => return None,
        };
        Some(Self {
            bandwidth_rad_per_s,
            aligning_current_a,
            motor: Motor {
                resistance_ohm,
                direct_inductance_h,
                quadrature_inductance_h,
                flux_linkage_vs,
                pole_pairs,
                is_encoder_reversed: is_encoder_reversed == 1,
                encoder_offset_rad,
            },
            encoder,
            joint: Joint { gear_ratio, zero_rad },
            limits: Limits {
                current_a,
                trip_current_a,
                min_bus_v,
                max_bus_v,
                derating_c,
                trip_c,
                speed_rad_per_s,
                stall_s,
            },
            inverter: Inverter { period_s, dead_time_share, dead_time_current_a, max_duty },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOLD: Configuration = Configuration {
        bandwidth_rad_per_s: 1.0,
        aligning_current_a: 2.0,
        motor: Motor {
            resistance_ohm: 4.0,
            direct_inductance_h: 5.0,
            quadrature_inductance_h: 6.0,
            flux_linkage_vs: 7.0,
            pole_pairs: 8,
            is_encoder_reversed: true,
            encoder_offset_rad: 9.0,
        },
        encoder: Encoder::Incremental { counts_per_turn: 10 },
        joint: Joint { gear_ratio: 11.0, zero_rad: 12.0 },
        limits: Limits {
            current_a: 13.0,
            trip_current_a: 14.0,
            min_bus_v: 15.0,
            max_bus_v: 16.0,
            derating_c: 17.0,
            trip_c: 18.0,
            speed_rad_per_s: 19.0,
            stall_s: f32::INFINITY,
        },
        inverter: Inverter {
            period_s: 20.0,
            dead_time_share: 21.0,
            dead_time_current_a: 22.0,
            max_duty: 23.0,
        },
    };

    #[test]
    fn words_say_what_they_were_made_of() {
        for encoder in [
            Encoder::Incremental { counts_per_turn: 4096 },
            Encoder::As5047p,
            Encoder::Mt6701,
            Encoder::As5600,
        ] {
            for is_encoder_reversed in [false, true] {
                let motor = Motor { is_encoder_reversed, ..TOLD.motor };
                let told = Configuration { motor, encoder, ..TOLD };
                assert_eq!(Configuration::from_words(&told.to_words()), Some(told));
            }
        }
    }

    #[test]
    fn the_order_is_that_of_the_layout() {
        // When this changes, increment `LAYOUT`: boards store these words.
        let numbers = TOLD.to_words().map(f32::from_bits);
        assert_eq!(numbers[..6], [1.0, 2.0, 4.0, 5.0, 6.0, 7.0]);
        assert_eq!(TOLD.to_words()[6], 8 | 1 << 8);
        assert_eq!(TOLD.to_words()[8..10], [0, 10]);
        assert_eq!(numbers[10..19], [11.0, 12.0, 13.0, 14.0, 15.0, 16.0, 17.0, 18.0, 19.0]);
        assert_eq!(numbers[20..], [20.0, 21.0, 22.0, 23.0]);
        assert_eq!(Configuration::LAYOUT, 2);
    }

    #[test]
    fn words_that_say_nothing_are_no_configuration() {
        let words = TOLD.to_words();
        for (place, wrong) in [(6, 2 << 8), (6, 1 << 16), (8, 4)] {
            let mut words = words;
            words[place] = wrong;
            assert_eq!(Configuration::from_words(&words), None);
        }
        assert_eq!(Configuration::from_words(&words[1..]), None);
        assert_eq!(Configuration::from_words(&[]), None);
    }
}
