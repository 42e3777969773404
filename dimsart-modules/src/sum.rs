//! Sum of two signals, for example the forces of a controller and of a wall.
//!
//! `out = A_GAIN a + B_GAIN b`; the gains are pure numbers, so all three have the same unit.

use dimsart_core::{Context, Declare, Input, Module, Output, Parameters, Unit, UnitRelation, types, words};

words! {
    /// Of an axis.
    pub struct Gains { a: f32, b: f32 }
    /// Signals.
    pub struct Ports { a: Input, b: Input, output: Output }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Sum;

impl Module for Sum {
    const NAME: &'static str = "SUM_MOD";
    const SUMMARY: &'static str = "Adds two signals, each with a gain.";
    type Settings = ();
    type Gains = Gains;
    type State = ();
    type Axis = ();
    type Ports = Ports;

    fn parameters(_: &mut (), gains: &mut Gains, visit: &mut Parameters<'_>) {
        visit.per_axis(&mut gains.a, "A_GAIN", Unit::One, -1e6..=1e6, 1.0, "Factor of the first.");
        visit.per_axis(&mut gains.b, "B_GAIN", Unit::One, -1e6..=1e6, 1.0, "Factor of the second.");
    }

    fn ports(_: &(), declare: &mut Declare<'_>) -> Ports {
        let ports = Ports {
            a: declare.input("A", types::SIGNAL),
            b: declare.input("B", types::SIGNAL),
            output: declare.output("SIGNAL_OUT", types::SIGNAL_OUT),
        };
        declare.tie("B", UnitRelation::Same, "A");
        declare.tie("SIGNAL_OUT", UnitRelation::Same, "A");
        ports
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { a, b, output } = context.ports();
        context.map_axes([a, b], [output], |gains, (), [a, b]| [gains.a * a + gains.b * b]);
    }
}
