//! Soft limits: adds a spring and damper beyond two positions to the force of a controller.
//!
//! `F = F_in - max(0, K p + B v)` at a penetration `p = x - HIGH > 0`, likewise below `LOW` with the opposite sign: the
//! limits push and never pull. `v` is a backward difference, initially 0.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all SOFTLIMIT_MOD PORT_FORCE_IN FEED_FORCE\nall SOFTLIMIT_MOD K_PARAM 100
//!             all MOD_ENG MOD_ON SOFTLIMIT_MOD\nall MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::POSITION, types::FEED_FORCE], rows)?;
//! assert_eq!(bench.tick(&[1.5, 7.0], "DES_FORCE"), Some(-43.0));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use dimsart_core::{Context, Declarations, DeviceDescriptor, Input, Module, Output, Unit, types, words};

words! {
    /// Parameters of one axis.
    pub parameters Gains {
        /// Position of the lower limit.
        low: f32 = per_axis("LOW", Unit::Position, -1e3..=1e3, -1.0),
        /// Position of the upper limit.
        high: f32 = per_axis("HIGH", Unit::Position, -1e3..=1e3, 1.0),
        /// Stiffness beyond the limits.
        stiffness: f32 = per_axis("K_PARAM", Unit::Stiffness, 0.0..=1e6, 0.0),
        /// Damping beyond the limits.
        damping: f32 = per_axis("B_PARAM", Unit::Damping, 0.0..=1e4, 0.0),
        /// `B / h`.
        damping_per_tick: f32,
    }
    /// State of one axis.
    pub struct AxisState { previous: f32 }
    /// Ports.
    pub ports Ports { position: Input, wanted: Input, force: Output }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct SoftLimit;

impl Module for SoftLimit {
    const NAME: &'static str = "SOFTLIMIT_MOD";
    const SUMMARY: &'static str = "Soft position limits: adds a spring and damper beyond them.";
    type Settings = ();
    type Gains = Gains;
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn prepare_axis((): &(), gains: &mut Gains, device: &DeviceDescriptor) {
        gains.damping_per_tick = gains.damping / device.sample_period_s();
    }

    fn ports((): &(), declare: &mut Declarations<'_>) -> Ports {
        let wanted = types::DES_FORCE.instance(2);
        Ports {
            position: declare.input("POSITION", types::POSITION),
            wanted: declare.default_signal(wanted).input("FORCE_IN", types::DES_FORCE),
            force: declare.output("DES_FORCE", types::DES_FORCE),
        }
    }

    fn begin(context: &Context<'_, Self>) {
        context.begin_axes([context.ports().position], |_, [x]| AxisState { previous: x });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { position, wanted, force } = context.ports();
        context.map_axes([position, wanted], [force], |gains, axis, [x, wanted]| {
            let push = gains.damping_per_tick * (x - axis.previous);
            axis.previous = x;
            let above = x - gains.high;
            let below = x - gains.low;
            let upper = if above > 0.0 { (gains.stiffness * above + push).max(0.0) } else { 0.0 };
            let lower = if below < 0.0 { (gains.stiffness * below + push).min(0.0) } else { 0.0 };
            [wanted - upper - lower]
        });
    }
}
