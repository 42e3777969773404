//! Wave filter: first-order low-pass on a wave.
//!
//! `y += α (u - y)`, `α = 1 - exp(-2π f_c h)`. Its gain never exceeds 1, so it keeps the link passive at any place
//! (Niemeyer and Slotine, *IJRR* 23(9), 2004). It stabilises a port that amplifies reflections at high frequency, such
//! as `FORM PRINTED` of the wave transformer, with a cutoff below about `sqrt(k/2) / (2π h)`, `k = h K/b`. It adds a
//! delay of `1 / (2π f_c)`, and the line inertia and compliance of this delay. Initial state: the first wave received.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let mut bench: Bench =
//!     Bench::new(dimsart_modules::ALL, &[types::CH2_WAVES], "all WFILTER_MOD CUTOFF 50\nall MOD_ENG MOD_ON WFILTER_MOD\nall MOD_ENG MATCHING_CHECK")?;
//! bench.tick(&[0.0], "CH2_TD_WAVES");
//! let first = bench.tick(&[1.0], "CH2_TD_WAVES").unwrap();
//! assert!((first - (1.0 - (-0.1 * core::f32::consts::PI).exp())).abs() < 1e-6);
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use core::f32::consts::TAU;

use dimsart_core::{Context, DeviceDescriptor, Input, Module, Output, Unit, math, types, words};

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Cutoff frequency (-3 dB).
        cutoff_hz: f32 = real("CUTOFF", Unit::Hertz, 1e-2..=1e4, 60.0),
        smoothing: f32,
    }
    /// State of one axis.
    pub struct AxisState { filtered: f32 }
    /// Ports.
    pub ports Ports {
        waves_in: Input = input("WAVES_IN", types::CH2_WAVES),
        waves_out: Output = output("WAVES_OUT", types::CH2_TD_WAVES),
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct WaveFilter;

impl Module for WaveFilter {
    const NAME: &'static str = "WFILTER_MOD";
    const SUMMARY: &'static str = "First-order low-pass on a wave.";
    type Settings = Settings;
    type Gains = ();
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        settings.smoothing = 1.0 - math::exp(-TAU * settings.cutoff_hz * device.sample_period_s());
    }

    fn begin(context: &Context<'_, Self>) {
        context.begin_axes([context.ports().waves_in], |(), [wave]| AxisState { filtered: wave });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { waves_in, waves_out } = context.ports();
        let Settings { smoothing, .. } = context.settings();
        context.map_axes([waves_in], [waves_out], |(), axis, [wave]| {
            axis.filtered += smoothing * (wave - axis.filtered);
            [axis.filtered]
        });
    }
}
