//! Lead-lag compensator for a signal of any unit.
//!
//! `y = GAIN (1 + s/ω_z) / (1 + s/ω_p) x` by Tustin's rule, with the corner frequencies `ω_z = 2 pi ZERO` and
//! `ω_p = 2 pi POLE`: lead if the zero is below the pole, lag if it is above (Franklin, Powell & Emami-Naeini,
//! *Feedback Control of Dynamic Systems*, section 6.7). It is computed as `GAIN (x + (r - 1) (x - w))`, `r = ω_p/ω_z`,
//! where `w` is `x` after a low-pass at the pole and `x - w` is the state: the gain at 0 Hz is exactly `GAIN`, however
//! low the pole and however large `x`.
//!
//! Initial state: steady state for the first input. `GAIN` may change the unit, so the output accepts any unit.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all LEAD_LAG_MOD ZERO 10
//!             all LEAD_LAG_MOD POLE 30
//!             all LEAD_LAG_MOD GAIN 2
//!             all MOD_ENG MOD_ON LEAD_LAG_MOD
//!             all MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::SIGNAL], rows)?;
//! assert_eq!(bench.tick(&[1.0], "SIGNAL_OUT"), Some(2.0));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use core::f32::consts::PI;

use dimsart_core::{Context, DeviceDescriptor, Input, Module, Output, Unit, types, words};

words! {
    /// Parameters of one axis.
    pub parameters Gains {
        /// Corner frequency of the zero.
        zero_hz: f32 = per_axis("ZERO", Unit::Hertz, 1e-3..=1e5, 10.0),
        /// Corner frequency of the pole.
        pole_hz: f32 = per_axis("POLE", Unit::Hertz, 1e-3..=1e5, 10.0),
        /// Gain at 0 Hz.
        gain: f32 = per_axis("GAIN", Unit::One, -1e6..=1e6, 1.0),
        /// `g / (1 + g)`, `g = ω_p h/2`.
        share: f32,
        /// `GAIN (r - 1)`.
        lead: f32,
    }
    /// State of one axis.
    pub struct AxisState {
        /// Input of the last tick.
        previous: f32,
        /// Input minus the state of the low-pass.
        lacking: f32,
    }
    /// Ports.
    pub ports Ports {
        input: Input = input("SIGNAL_IN", types::SIGNAL),
        output: Output = output("SIGNAL_OUT", types::SIGNAL_OUT),
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct LeadLag;

impl Module for LeadLag {
    const NAME: &'static str = "LEAD_LAG_MOD";
    const SUMMARY: &'static str = "Lead-lag compensator: a zero, a pole and a gain.";
    type Settings = ();
    type Gains = Gains;
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn prepare_axis((): &(), gains: &mut Gains, device: &DeviceDescriptor) {
        let g = PI * gains.pole_hz * device.sample_period_s();
        let ratio = gains.pole_hz / gains.zero_hz;
        gains.share = g / (1.0 + g);
        gains.lead = gains.gain * (ratio - 1.0);
    }

    fn begin(context: &Context<'_, Self>) {
        context.begin_axes([context.ports().input], |_, [x]| AxisState { previous: x, lacking: 0.0 });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { input, output } = context.ports();
        context.map_axes([input], [output], |gains, axis, [x]| {
            let lacking = (x - axis.previous) + axis.lacking;
            let change = gains.share * lacking;
            *axis = AxisState { previous: x, lacking: lacking - 2.0 * change };
            [gains.gain * x + gains.lead * (lacking - change)]
        });
    }
}
