//! Pseudo-random binary sequence (PRBS): `OFFSET ± A` with a flat spectrum, for system identification.
//!
//! A shift register of `BITS` bits, initially all 1, shifts every `EVERY` ticks: it outputs its oldest bit `s_k` and
//! inserts `s_{k+n} = s_k ⊕ s_{k+a} ⊕ …` with the taps `a` of a primitive polynomial (Golomb, *Shift Register
//! Sequences*), the same taps as `scipy.signal.max_len_seq`. The sequence repeats after `2^BITS - 1` shifts. A bit 1 is
//! `+A`.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all PRBS_MOD AMPLITUDE 3\nall MOD_ENG MOD_ON PRBS_MOD\nall MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::POSITION], rows)?;
//! let period: Vec<_> = (0..1023).filter_map(|_| bench.tick(&[0.0], "SIGNAL_OUT")).collect();
//! assert_eq!(period.iter().filter(|value| **value > 0.0).count(), 512);
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use dimsart_core::{Context, DeviceDescriptor, Module, Output, Unit, types, words};

/// Tap masks for registers of 2 to 16 bits: the new bit is the parity of the tapped bits.
const TAPS: [u32; 15] = [
    0b11,
    0b101,
    0b1001,
    0b1001,
    0b10_0001,
    0b100_0001,
    0b1100_0011,
    0b10_0001,
    0b1000_0001,
    0b10_0000_0001,
    0b1100_0001_0001,
    0b1_1001_0000_0001,
    0b11_0000_0000_0101,
    0b100_0000_0000_0001,
    0b1010_0000_0001_0001,
];

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Length of the shift register.
        bits: u32 = structural_count("BITS", Unit::One, 2..=16, 10),
        /// Ticks per bit.
        every_ticks: u32 = count("EVERY", Unit::Tick, 1..=1_000_000, 1),
        taps: u32,
    }
    /// Parameters of one axis.
    pub parameters Gains {
        /// Amplitude.
        amplitude: f32 = per_axis("AMPLITUDE", Unit::Any, -1e6..=1e6, 0.0),
        /// Offset added to the signal.
        offset: f32 = per_axis("OFFSET", Unit::Any, -1e6..=1e6, 0.0),
    }
    /// State common to all axes.
    pub struct State { register: u32, ticks: u32 }
    /// Ports.
    pub ports Ports { output: Output = output("SIGNAL_OUT", types::SIGNAL_OUT) }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct BinaryNoise;

impl Module for BinaryNoise {
    const NAME: &'static str = "PRBS_MOD";
    const SUMMARY: &'static str = "Generates a pseudo-random binary sequence of maximal length.";
    type Settings = Settings;
    type Gains = Gains;
    type State = State;
    type AxisState = ();
    type Ports = Ports;

    fn prepare(settings: &mut Settings, _: &DeviceDescriptor) {
        let place = usize::try_from(settings.bits.saturating_sub(2)).unwrap_or(0);
        settings.taps = TAPS.get(place).copied().unwrap_or(1);
    }

    fn begin(context: &Context<'_, Self>) {
        let register = 1_u32.wrapping_shl(context.settings().bits).wrapping_sub(1);
        context.set_state(State { register, ticks: 0 });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Settings { bits, every_ticks, taps } = context.settings();
        let State { mut register, ticks } = context.state();
        let side = if register & 1 == 1 { 1.0 } else { -1.0 };
        context.map_axes([], [context.ports().output], |Gains { amplitude, offset }, (), []| {
            [offset + side * amplitude]
        });
        let mut ticks = ticks + 1;
        if ticks >= every_ticks {
            let parity = (register & taps).count_ones() & 1;
            register = register >> 1 | parity.wrapping_shl(bits.wrapping_sub(1));
            ticks = 0;
        }
        context.set_state(State { register, ticks });
    }
}
