//! Cogging compensation: a feed-forward force as a periodic function of position, per turn or per magnet pitch.
//!
//! `F = TABLE(x)`, interpolated linearly between 16 evenly spaced entries; the first entry is at position 0 and every
//! whole `PERIOD` from there. Interpolating a sine is off by at most 2 % of its amplitude. For a motor with many pole
//! pairs, set `PERIOD` to the pitch of one pair, or use one module per harmonic.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all COGGING_MOD PERIOD 1.6
//!             all COGGING_MOD TABLE[0][15] 2
//!             all MOD_ENG MOD_ON COGGING_MOD
//!             all MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::POSITION], rows)?;
//! let force = bench.tick(&[-0.05], "FEED_FORCE").unwrap_or_default();
//! assert!((force - 1.0).abs() < 1e-5, "{force}");
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use core::f32::consts::TAU;

use dimsart_core::{Context, DeviceDescriptor, Input, Module, Output, Unit, math, types, words};

/// Table entries per period; a power of two.
const ENTRIES: usize = 16;

words! {
    /// Parameters of one axis.
    pub parameters Gains {
        /// Period of the cogging force.
        period: f32 = per_axis("PERIOD", Unit::Position, 1e-6..=1e3, TAU),
        /// Forces at 16 evenly spaced positions of the period, one row per axis.
        table: [f32; ENTRIES] = per_axis_row("TABLE", Unit::Force, -1e4..=1e4, 0.0),
        /// `1 / PERIOD`.
        per_period: f32,
    }
    /// Ports.
    pub ports Ports {
        position: Input = input("POSITION", types::POSITION),
        feed_force: Output = output("FEED_FORCE", types::FEED_FORCE),
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Cogging;

impl Module for Cogging {
    const NAME: &'static str = "COGGING_MOD";
    const SUMMARY: &'static str = "Compensates cogging by a force table over one period of position.";
    type Settings = ();
    type Gains = Gains;
    type State = ();
    type AxisState = ();
    type Ports = Ports;

    fn prepare_axis((): &(), gains: &mut Gains, _: &DeviceDescriptor) {
        gains.per_period = 1.0 / gains.period;
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { position, feed_force } = context.ports();
        context.map_axes([position], [feed_force], |gains, (), [x]| {
            let periods = x * gains.per_period;
            let part = math::fraction(periods.abs());
            let place = 16.0 * if periods < 0.0 { 1.0 - part } else { part };
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 0 to 16")]
            let entry = place as u8;
            let force =
                |entry: u8| gains.table.get(usize::from(entry) % ENTRIES).copied().unwrap_or_default();
            let (here, next) = (force(entry), force(entry + 1));
            [here + (place - f32::from(entry)) * (next - here)]
        });
    }
}
