//! Shared control: a blend of what the operator commands and what a program commands.
//!
//! `y = a + s (b - a)`, where the share `s` goes to `SHARE` by at most `RATE` per second, so that authority changes hands
//! without a jump. `a` is the operator's, `s = 1` gives all to the program. Where it takes over from another module it begins
//! with the operator's share (0) and goes from there; otherwise with `SHARE`. Both commands have the same unit, any one.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::DES_POSITION, types::FAR_POSITION],
//!     "all SHARED_MOD PORT_OPERATOR DES_POSITION\nall SHARED_MOD PORT_PROGRAM FAR_POSITION
//!      all SHARED_MOD SHARE 0.25\nall MOD_ENG MOD_ON SHARED_MOD\nall MOD_ENG MATCHING_CHECK",
//! )?;
//! assert_eq!(bench.tick(&[1.0, 5.0], "SIGNAL_OUT"), Some(2.0));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use dimsart_core::math::CompensatedSum;
use dimsart_core::{
    Context, Declare, DeviceDescriptor, Input, Module, Output, Unit, UnitRelation, types, words,
};

words! {
    /// Of all axes.
    pub parameters Settings {
        /// Largest change of the share per second.
        rate_hz: f32 = real("RATE", Unit::Hertz, 1e-3..=1e4, 1.0),
        most_per_tick: f32,
    }
    /// Of an axis.
    pub parameters Gains {
        /// Share of the program; 1 is all.
        share: f32 = per_axis("SHARE", Unit::One, 0.0..=1.0, 0.0),
    }
    /// Of an axis.
    pub struct Axis { share: CompensatedSum }
    /// Signals.
    pub ports Ports { operator: Input, program: Input, output: Output }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct SharedControl;

impl Module for SharedControl {
    const NAME: &'static str = "SHARED_MOD";
    const SUMMARY: &'static str = "Blends the operator's command with a program's, by a share that slews.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type Axis = Axis;
    type Ports = Ports;

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        settings.most_per_tick = settings.rate_hz * device.sample_period_s();
    }

    fn ports(_: &Settings, declare: &mut Declare<'_>) -> Ports {
        let second = types::SIGNAL.copy(2);
        let ports = Ports {
            operator: declare.any_unit().input("OPERATOR", types::SIGNAL),
            program: declare.any_unit().of_signal(second).input("PROGRAM", types::SIGNAL),
            output: declare.any_unit().output("SIGNAL_OUT", types::SIGNAL_OUT),
        };
        declare.tie("PROGRAM", UnitRelation::Same, "OPERATOR");
        declare.tie("SIGNAL_OUT", UnitRelation::Same, "OPERATOR");
        ports
    }

    fn begin(context: &Context<'_, Self>) {
        let takes_over = context.takes_over();
        context.begin_axes([], |gains, []| Axis {
            share: CompensatedSum::new(if takes_over { 0.0 } else { gains.share }),
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { operator, program, output } = context.ports();
        let Settings { most_per_tick, .. } = context.settings();
        context.map_axes([operator, program], [output], |gains, axis, [operator, program]| {
            axis.share.approach(gains.share, most_per_tick);
            [operator + axis.share.value() * (program - operator)]
        });
    }
}
