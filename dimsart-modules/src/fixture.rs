//! Virtual fixture: guides an operator along a line or a plane of several axes, or keeps out of a region (Rosenberg,
//! *Virtual fixtures*, IEEE VRAIS 1993).
//!
//! With `e = x - ORIGIN`, the direction `n` of length 1 along `DIRECTION`, `e_n = n (n · e)`, and so for the velocity:
//!
//! | `FORM` | force |
//! |---|---|
//! | `PLANE`, `n` across it | `-K e_n - B v_n` |
//! | `LINE`, `n` along it | `-K (e - e_n) - B (v - v_n)` |
//! | `HALF_SPACE`, `n` out of what is forbidden | `n max(0, -K n·e - B n·v)` where `n · e < 0` |
//!
//! It is added to the force of a controller. `v` by backward difference. The axes are to be of one kind, metres or radians;
//! one with `DIRECTION` 0 is not part of a plane. With no direction, there is no force of a plane or a half space.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all FIXTURE_MOD PORT_FORCE_IN FEED_FORCE\nall FIXTURE_MOD K_PARAM 100\nall FIXTURE_MOD DIRECTION 2
//!             all MOD_ENG MOD_ON FIXTURE_MOD\nall MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::POSITION, types::FEED_FORCE], rows)?;
//! assert_eq!(bench.tick(&[0.5, 1.0], "DES_FORCE"), Some(-49.0));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use dimsart_core::{
    Context, Declare, DeviceDescriptor, Input, Module, Output, ParameterSet, Parameters, Unit, choice, types,
    words,
};

choice! {
    /// What it guides to.
    pub enum Form { Plane = "PLANE", Line = "LINE", HalfSpace = "HALF_SPACE" }
}

words! {
    /// Of all axes.
    pub parameters Settings {
        /// What it guides to.
        form: Form = choice("FORM"),
        /// Stiffness.
        stiffness: f32 = real("K_PARAM", Unit::Stiffness, 0.0..=1e5, 0.0),
        /// Damping of what it acts against.
        damping: f32 = real("B_PARAM", Unit::Damping, 0.0..=1e4, 0.0),
        damping_per_tick: f32,
    }
    /// Of an axis.
    pub parameters Gains {
        /// A point of the line or plane.
        origin: f32 = per_axis("ORIGIN", Unit::Position, -1e3..=1e3, 0.0),
        /// Along the line or across the plane, of any length.
        direction: f32 = per_axis("DIRECTION", Unit::One, -1e3..=1e3, 0.0),
    }
    /// Of an axis.
    pub struct Axis { previous: f32 }
    /// Signals.
    pub ports Ports { position: Input, wanted: Input, force: Output }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Fixture;

impl Module for Fixture {
    const NAME: &'static str = "FIXTURE_MOD";
    const SUMMARY: &'static str = "Guides along a line or a plane of the axes, or keeps out of a half space.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type Axis = Axis;
    type Ports = Ports;

    fn parameters(settings: &mut Settings, gains: &mut Gains, visit: &mut Parameters<'_>) {
        settings.visit(visit);
        gains.visit(visit);
    }

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        settings.damping_per_tick = settings.damping / device.sample_period_s();
    }

    fn ports(_: &Settings, declare: &mut Declare<'_>) -> Ports {
        let wanted = types::DES_FORCE.copy(2);
        Ports {
            position: declare.input("POSITION", types::POSITION),
            wanted: declare.of_signal(wanted).input("FORCE_IN", types::DES_FORCE),
            force: declare.output("DES_FORCE", types::DES_FORCE),
        }
    }

    fn begin(context: &Context<'_, Self>) {
        context.begin_axes([context.ports().position], |_, [x]| Axis { previous: x });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { position, wanted, force } = context.ports();
        let Settings { form, stiffness, damping_per_tick, .. } = context.settings();
        // Products with a direction that is not of length 1 yet.
        let (mut deep, mut pull, mut square) = (0.0, 0.0, 0.0);
        context.map_axes([position], [], |gains, axis, [x]| {
            deep += gains.direction * (x - gains.origin);
            pull +=
                gains.direction * (stiffness * (x - gains.origin) + damping_per_tick * (x - axis.previous));
            square += gains.direction * gains.direction;
            []
        });
        let is_free = form == Form::HalfSpace && (deep >= 0.0 || pull >= 0.0);
        let share = if square > 0.0 && !is_free { pull / square } else { 0.0 };
        context.map_axes([position, wanted], [force], |gains, axis, [x, wanted]| {
            let along = gains.direction * share;
            let whole = stiffness * (x - gains.origin) + damping_per_tick * (x - axis.previous);
            axis.previous = x;
            [wanted - if form == Form::Line { whole - along } else { along }]
        });
    }
}
