//! Clutch (indexing): the operator can reposition the master without moving the slave.
//!
//! ```text
//! closed   x_d += SCALE (x_in - x_in[k-1])
//! open     x_d  = x_d[k-1]
//! ```
//!
//! The clutch is closed while `CLUTCH` is above 0.5. While it is open, the slave's reference is held and motion of the
//! master is ignored, so closing it causes no jump. `SCALE` applies to increments only and can be changed while
//! running. The reference starts at the measured position; on takeover, at the last commanded one.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::POSITION, types::FAR_POSITION, types::CONDITION],
//!     "all MOD_ENG MOD_ON CLUTCH_MOD\nall MOD_ENG MATCHING_CHECK",
//! )?;
//! bench.tick(&[0.0, 2.0, 0.0], "DES_POSITION");
//! assert_eq!(bench.tick(&[0.0, 3.0, 0.0], "DES_POSITION"), Some(0.0)); // open
//! assert_eq!(bench.tick(&[0.0, 3.5, 1.0], "DES_POSITION"), Some(0.5)); // closed: follows from here on
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use dimsart_core::{Context, Input, Module, Output, Unit, math, types, words};

words! {
    /// Parameters of one axis.
    pub parameters Gains {
        /// Scale: motion of the reference per motion of the input.
        scale: f32 = per_axis("SCALE", Unit::One, -1e3..=1e3, 1.0),
    }
    /// State of one axis.
    pub struct AxisState { previous: f32, desired: math::CompensatedSum }
    /// Ports.
    pub ports Ports {
        position: Input = input("POSITION", types::POSITION),
        wanted: Input = input("POSITION_IN", types::FAR_POSITION),
        clutch: Input = input("CLUTCH", types::CONDITION),
        desired_position: Output = output("DES_POSITION", types::DES_POSITION),
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Clutch;

impl Module for Clutch {
    const NAME: &'static str = "CLUTCH_MOD";
    const SUMMARY: &'static str = "Clutch: holds the reference while open and resumes without a jump.";
    type Settings = ();
    type Gains = Gains;
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn begin(context: &Context<'_, Self>) {
        let Ports { position, wanted, desired_position, .. } = context.ports();
        let takes_over = context.takes_over();
        context.begin_axes([position, wanted, desired_position.last()], |_, [x, wanted, last]| AxisState {
            previous: wanted,
            desired: math::CompensatedSum::new(if takes_over { last } else { x }),
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { wanted, clutch, desired_position, .. } = context.ports();
        context.map_axes([wanted, clutch], [desired_position], |gains, axis, [wanted, clutch]| {
            let step = gains.scale * (wanted - axis.previous);
            axis.previous = wanted;
            [if clutch > 0.5 { axis.desired.add(step) } else { axis.desired.value() }]
        });
    }
}
