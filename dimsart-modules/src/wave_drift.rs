//! Drift correction for wave variables: reduces the outgoing wave so that the far position returns to the local one.
//!
//! With `d` the far position minus the local one, `a = sqrt(2b)`:
//!
//! ```text
//! u' = u                    if d u <= 0
//! u' = u - a RATE d         as long as the sign does not change
//! u' = 0                    otherwise
//! ```
//!
//! (Niemeyer and Slotine, *IJRR* 23(9), 2004, "adjusting the wave command".) `|u'| <= |u|`, so no energy is added and
//! the link stays passive. Without an outgoing wave there is no correction, and a wave is never amplified. Wave
//! variables preserve position by themselves: use this module on links that lose packets with `STALE ZERO` or
//! `LIMITED`. In contact, the far side correctly lags by `F T/(2b)`; compare the desired positions of both wave ports,
//! not the positions of the devices.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::CH1_WAVES, types::DES_POSITION, types::FAR_POSITION],
//!     "all WDRIFT_MOD RATE 10\nall WDRIFT_MOD B_PARAM 2\nall MOD_ENG MOD_ON WDRIFT_MOD\nall MOD_ENG MATCHING_CHECK",
//! )?;
//! assert_eq!(bench.tick(&[1.0, 0.0, 0.025], "CH1_TD_WAVES"), Some(0.5)); // 1 - 2 * 10 * 0.025
//! assert_eq!(bench.tick(&[1.0, 0.0, 0.9], "CH1_TD_WAVES"), Some(0.0));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use dimsart_core::{Context, DeviceDescriptor, Input, Module, Output, Unit, math, types, words};

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Wave impedance b.
        impedance: f32 = real("B_PARAM", Unit::Damping, 1e-3..=1e4, 10.0),
        /// Rate of drift correction; 0: none.
        rate_hz: f32 = real("RATE", Unit::Hertz, 0.0..=1e3, 1.0),
        /// `sqrt(2 b) RATE`.
        wave_per_position: f32,
    }
    /// Ports.
    pub ports Ports {
        waves_in: Input = input("WAVES_IN", types::CH1_WAVES),
        position: Input = input("POSITION", types::DES_POSITION),
        far_position: Input = input("FAR_POSITION", types::FAR_POSITION),
        waves_out: Output = output("WAVES_OUT", types::CH1_TD_WAVES),
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct WaveDrift;

impl Module for WaveDrift {
    const NAME: &'static str = "WDRIFT_MOD";
    const SUMMARY: &'static str = "Drift correction: reduces the outgoing wave to realign the two positions.";
    type Settings = Settings;
    type Gains = ();
    type State = ();
    type AxisState = ();
    type Ports = Ports;

    fn prepare(settings: &mut Settings, _: &DeviceDescriptor) {
        settings.wave_per_position = math::sqrt(2.0 * settings.impedance) * settings.rate_hz;
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { waves_in, position, far_position, waves_out } = context.ports();
        let Settings { wave_per_position, .. } = context.settings();
        context.map_axes([waves_in, position, far_position], [waves_out], |(), (), [wave, x, far]| {
            let excess = wave_per_position * (far - x);
            [if wave > 0.0 { wave - excess.max(0.0).min(wave) } else { wave - excess.min(0.0).max(wave) }]
        });
    }
}
