//! Shared control: blends the operator's command with a program's command.
//!
//! `y = a + s (b - a)`, where `a` is the operator's command and `b` the program's. The share `s` follows `SHARE` by at
//! most `RATE` per second, so authority is handed over without a jump; `s = 1` gives full authority to the program. `s`
//! starts at `SHARE`; on takeover, at 0. Both commands have the same, arbitrary unit.
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
    Context, Declarations, DeviceDescriptor, Input, Module, Output, Unit, UnitRelation, types, words,
};

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Maximum rate of change of the share, per second.
        rate_hz: f32 = real("RATE", Unit::Hertz, 1e-3..=1e4, 1.0),
        max_per_tick: f32,
    }
    /// Parameters of one axis.
    pub parameters Gains {
        /// Share of the program's command; 1: program only.
        share: f32 = per_axis("SHARE", Unit::One, 0.0..=1.0, 0.0),
    }
    /// State of one axis.
    pub struct AxisState { share: CompensatedSum }
    /// Ports.
    pub ports Ports { operator: Input, program: Input, output: Output }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct SharedControl;

impl Module for SharedControl {
    const NAME: &'static str = "SHARED_MOD";
    const SUMMARY: &'static str = "Shared control: blends the operator's and a program's command.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        settings.max_per_tick = settings.rate_hz * device.sample_period_s();
    }

    fn ports(_: &Settings, declare: &mut Declarations<'_>) -> Ports {
        let second = types::SIGNAL.instance(2);
        let ports = Ports {
            operator: declare.any_unit().input("OPERATOR", types::SIGNAL),
            program: declare.any_unit().default_signal(second).input("PROGRAM", types::SIGNAL),
            output: declare.any_unit().output("SIGNAL_OUT", types::SIGNAL_OUT),
        };
        declare.constrain_unit("PROGRAM", UnitRelation::Same, "OPERATOR");
        declare.constrain_unit("SIGNAL_OUT", UnitRelation::Same, "OPERATOR");
        ports
    }

    fn begin(context: &Context<'_, Self>) {
        let takes_over = context.takes_over();
        context.begin_axes([], |gains, []| AxisState {
            share: CompensatedSum::new(if takes_over { 0.0 } else { gains.share }),
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { operator, program, output } = context.ports();
        let Settings { max_per_tick, .. } = context.settings();
        context.map_axes([operator, program], [output], |gains, axis, [operator, program]| {
            axis.share.move_towards(gains.share, max_per_tick);
            [operator + axis.share.value() * (program - operator)]
        });
    }
}
