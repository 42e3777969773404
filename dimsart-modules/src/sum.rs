//! Sum of two signals, for example the forces of a controller and of a wall.
//!
//! `out = A_GAIN a + B_GAIN b`. The gains are dimensionless, so all three signals have the same unit.

use dimsart_core::{Context, Declarations, Input, Module, Output, PortSet, Unit, UnitRelation, types, words};

words! {
    /// Parameters of one axis.
    pub parameters Gains {
        /// Gain of input A.
        a: f32 = per_axis("A_GAIN", Unit::One, -1e6..=1e6, 1.0),
        /// Gain of input B.
        b: f32 = per_axis("B_GAIN", Unit::One, -1e6..=1e6, 1.0),
    }
    /// Ports.
    pub ports Ports {
        a: Input = input("A", types::SIGNAL),
        b: Input = input("B", types::SIGNAL),
        output: Output = output("SIGNAL_OUT", types::SIGNAL_OUT),
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Sum;

impl Module for Sum {
    const NAME: &'static str = "SUM_MOD";
    const SUMMARY: &'static str = "Weighted sum of two signals.";
    type Settings = ();
    type Gains = Gains;
    type State = ();
    type AxisState = ();
    type Ports = Ports;

    fn ports(_: &(), declare: &mut Declarations<'_>) -> Ports {
        let ports = Ports::declare(declare);
        declare.constrain_unit("B", UnitRelation::Same, "A");
        declare.constrain_unit("SIGNAL_OUT", UnitRelation::Same, "A");
        ports
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { a, b, output } = context.ports();
        context.map_axes([a, b], [output], |gains, (), [a, b]| [gains.a * a + gains.b * b]);
    }
}
