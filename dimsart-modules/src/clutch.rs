//! Clutch: lets the operator move the master without the slave, to index it.
//!
//! ```text
//! closed   x_d += SCALE (x_in - x_in[k-1])
//! open     x_d  = x_d[k-1]
//! ```
//!
//! `CLUTCH` is closed where it is above 0.5. While it is open the slave's reference stays where it is; what the master did
//! meanwhile does not count, so that closing it makes no jump. `SCALE` changes motion and not what was reached: it can be
//! changed while it runs. The reference begins with what was commanded last, or where the device is.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::POSITION, types::FAR_POSITION, types::CONDITION],
//!     "all MOD_ENG MOD_ON CLUTCH_MOD\nall MOD_ENG MATCHING_CHECK",
//! )?;
//! bench.tick(&[0.0, 2.0, 0.0], "DES_POSITION");
//! assert_eq!(bench.tick(&[0.0, 3.0, 0.0], "DES_POSITION"), Some(0.0)); // open
//! assert_eq!(bench.tick(&[0.0, 3.5, 1.0], "DES_POSITION"), Some(0.5)); // closed: from here on it follows
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use dimsart_core::{Context, Input, Module, Output, Unit, math, types, words};

words! {
    /// Of an axis.
    pub parameters Gains {
        /// Motion of the reference per motion that comes in.
        scale: f32 = per_axis("SCALE", Unit::One, -1e3..=1e3, 1.0),
    }
    /// Of an axis.
    pub struct Axis { previous: f32, desired: math::CompensatedSum }
    /// Signals.
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
    const SUMMARY: &'static str =
        "Clutch and index: holds the reference while it is open, and goes on without a jump.";
    type Settings = ();
    type Gains = Gains;
    type State = ();
    type Axis = Axis;
    type Ports = Ports;

    fn begin(context: &Context<'_, Self>) {
        let Ports { position, wanted, desired_position, .. } = context.ports();
        let takes_over = context.takes_over();
        context.begin_axes([position, wanted, desired_position.last()], |_, [x, wanted, last]| Axis {
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
