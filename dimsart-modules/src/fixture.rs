//! Virtual fixture: guides the operator along a line or a plane, or keeps it out of a region (Rosenberg, *Virtual
//! fixtures*, IEEE VRAIS 1993).
//!
//! With `e = x - ORIGIN`, the unit vector `n` along `DIRECTION` and `e_n = n (n · e)`, likewise for the velocity:
//!
//! | `FORM` | force |
//! |---|---|
//! | `PLANE`, `n` normal to it | `-K e_n - B v_n` |
//! | `LINE`, `n` along it | `-K (e - e_n) - B (v - v_n)` |
//! | `HALF_SPACE`, `n` out of the forbidden region | `n max(0, -K n·e - B n·v)` where `n · e < 0` |
//!
//! It is added to the force of a controller. `v` is a backward difference. All axes must have the same unit, metres or
//! radians; an axis with `DIRECTION` 0 is ignored by a plane. With all directions 0, a plane or half space has no
//! force.
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
    Context, Declarations, DeviceDescriptor, Input, Module, Output, ParameterSet, Parameters, Unit, choice,
    types, words,
};

choice! {
    /// Shape of the fixture.
    pub enum FixtureShape { Plane = "PLANE", Line = "LINE", HalfSpace = "HALF_SPACE" }
}

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Shape of the fixture.
        form: FixtureShape = choice("FORM"),
        /// Stiffness of the fixture.
        stiffness: f32 = real("K_PARAM", Unit::Stiffness, 0.0..=1e5, 0.0),
        /// Damping along the directions that the fixture resists.
        damping: f32 = real("B_PARAM", Unit::Damping, 0.0..=1e4, 0.0),
        damping_per_tick: f32,
    }
    /// Parameters of one axis.
    pub parameters Gains {
        /// Point on the line or plane.
        origin: f32 = per_axis("ORIGIN", Unit::Position, -1e3..=1e3, 0.0),
        /// Direction of the line or normal of the plane, of any length.
        direction: f32 = per_axis("DIRECTION", Unit::One, -1e3..=1e3, 0.0),
    }
    /// State of one axis.
    pub struct AxisState { previous: f32 }
    /// Ports.
    pub ports Ports { position: Input, wanted: Input, force: Output }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Fixture;

impl Module for Fixture {
    const NAME: &'static str = "FIXTURE_MOD";
    const SUMMARY: &'static str = "Virtual fixture: guides along a line or plane, or bars a half space.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn parameters(settings: &mut Settings, gains: &mut Gains, visit: &mut Parameters<'_>) {
        settings.visit(visit);
        gains.visit(visit);
    }

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        settings.damping_per_tick = settings.damping / device.sample_period_s();
    }

    fn ports(_: &Settings, declare: &mut Declarations<'_>) -> Ports {
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
        let Settings { form, stiffness, damping_per_tick, .. } = context.settings();
        // Products with the direction, not normalised yet.
        let (mut deep, mut pull, mut square) = (0.0, 0.0, 0.0);
        context.map_axes([position], [], |gains, axis, [x]| {
            deep += gains.direction * (x - gains.origin);
            pull +=
                gains.direction * (stiffness * (x - gains.origin) + damping_per_tick * (x - axis.previous));
            square += gains.direction * gains.direction;
            []
        });
        let is_free = form == FixtureShape::HalfSpace && (deep >= 0.0 || pull >= 0.0);
        let share = if square > 0.0 && !is_free { pull / square } else { 0.0 };
        context.map_axes([position, wanted], [force], |gains, axis, [x, wanted]| {
            let along = gains.direction * share;
            let whole = stiffness * (x - gains.origin) + damping_per_tick * (x - axis.previous);
            axis.previous = x;
            [wanted - if form == FixtureShape::Line { whole - along } else { along }]
        });
    }
}
