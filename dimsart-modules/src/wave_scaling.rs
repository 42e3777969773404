//! Scaling of wave variables between master and slave: the slave moves `p` times as far and pushes `f` times as hard.
//!
//! ```text
//! in' = s in       out' = out / s       s = sqrt(p f)
//! ```
//!
//! Place it between the line and the slave's wave port, and set `B_PARAM` of that port to `b f / p` with the master's
//! `b`: `p` and `f` determine `s` and this impedance, from `u = (b x' + F)/sqrt(2b)` with `p x'`, `f F` in place of
//! `x'`, `F`. The round-trip gain of a wave is 1, so a loop of passive ports is as stable as without scaling for any
//! `p`, `f`; the power at the slave is `p f` times the master's. With `p f = 1`, power is not scaled, `s = 1`, and the
//! impedance alone does the scaling. (Niemeyer and Slotine, *IJRR* 23(9), 2004; power scaling: Colgate, *IEEE T-RA*
//! 9(4), 1993.) For schemes without waves, use `NORMALIZER_MOD`.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::CH2_WAVES, types::CH1_WAVES],
//!     "all WSCALE_MOD POSITION_SCALE 2\nall WSCALE_MOD FORCE_SCALE 8
//!      all MOD_ENG MOD_ON WSCALE_MOD\nall MOD_ENG MATCHING_CHECK",
//! )?;
//! assert_eq!(bench.tick(&[1.0, 1.0], "CH2_TD_WAVES"), Some(4.0));
//! assert_eq!(bench.tick(&[1.0, 1.0], "CH1_TD_WAVES"), Some(0.25));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use dimsart_core::{Context, DeviceDescriptor, Input, Module, Output, Unit, math, types, words};

words! {
    /// Parameters of one axis.
    pub parameters Gains {
        /// Motion of the slave per motion of the master.
        position_scale: f32 = per_axis("POSITION_SCALE", Unit::One, 1e-3..=1e3, 1.0),
        /// Force of the slave per force of the master.
        force_scale: f32 = per_axis("FORCE_SCALE", Unit::One, 1e-3..=1e3, 1.0),
        /// `sqrt(p f)`.
        inwards: f32,
        /// `1 / sqrt(p f)`.
        outwards: f32,
    }
    /// Ports.
    pub ports Ports {
        line_in: Input = input("LINE_IN", types::CH2_WAVES),
        port_in: Output = output("PORT_IN", types::CH2_TD_WAVES),
        port_out: Input = late().input("PORT_OUT", types::CH1_WAVES),
        line_out: Output = late().output("LINE_OUT", types::CH1_TD_WAVES),
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct WaveScaling;

impl Module for WaveScaling {
    const NAME: &'static str = "WSCALE_MOD";
    const SUMMARY: &'static str = "Scales position and force between wave line and slave port.";
    type Settings = ();
    type Gains = Gains;
    type State = ();
    type AxisState = ();
    type Ports = Ports;

    fn prepare_axis((): &(), gains: &mut Gains, _: &DeviceDescriptor) {
        gains.inwards = math::sqrt(gains.position_scale * gains.force_scale);
        gains.outwards = 1.0 / gains.inwards;
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { line_in, port_in, .. } = context.ports();
        context.map_axes([line_in], [port_in], |gains, (), [wave]| [gains.inwards * wave]);
    }

    #[inline(always)]
    fn compute_late(context: &Context<'_, Self>) {
        let Ports { port_out, line_out, .. } = context.ports();
        context.map_axes([port_out], [line_out], |gains, (), [wave]| [gains.outwards * wave]);
    }
}
