//! Wave filter: first-order low-pass on a wave.
//!
//! `y += α (u - y)`, `α = 1 - exp(-2π f_c h)`. Its gain is nowhere above 1, so a line stays passive wherever it stands
//! (Niemeyer and Slotine, *IJRR* 23(9), 2004). It tames a port that reflects more than it got at high frequency, as
//! `FORM PRINTED` of the wave transformer does, below about `sqrt(k/2) / (2π h)` with `k = h K/b`. It delays as much as
//! `1 / (2π f_c)`, and so adds the line's inertia and softness of that time. It begins with the wave it finds.
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
    /// Of all axes.
    pub parameters Settings {
        /// Frequency at which half of the power is left.
        cutoff_hz: f32 = real("CUTOFF", Unit::Hertz, 1e-2..=1e4, 60.0),
        smoothing: f32,
    }
    /// Of an axis.
    pub struct Axis { filtered: f32 }
    /// Signals.
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
    const SUMMARY: &'static str = "Low-pass of first order on a wave.";
    type Settings = Settings;
    type Gains = ();
    type State = ();
    type Axis = Axis;
    type Ports = Ports;

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        settings.smoothing = 1.0 - math::exp(-TAU * settings.cutoff_hz * device.sample_period_s());
    }

    fn begin(context: &Context<'_, Self>) {
        context.begin_axes([context.ports().waves_in], |(), [wave]| Axis { filtered: wave });
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
