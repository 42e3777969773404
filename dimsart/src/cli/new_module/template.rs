//! Template: say in a line what it does.
//!
//! `F = K (x_d - x)`: the equation, with the source of it.

use dimsart_core::{Context, Declare, Input, Module, Output, Parameters, Unit, types, words};

words! {
    /// Parameters of an axis.
    pub struct Gains { stiffness: f32 }
    /// Signals.
    pub struct Ports { position: Input, desired_position: Input, force: Output }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Template;

impl Module for Template {
    const NAME: &'static str = "TEMPLATE_MOD";
    const SUMMARY: &'static str = "One sentence for `dimsart modules`.";
    type Settings = ();
    type Gains = Gains;
    type State = ();
    type Axis = ();
    type Ports = Ports;

    fn parameters(_: &mut (), gains: &mut Gains, visit: &mut Parameters<'_>) {
        visit.per_axis(&mut gains.stiffness, "K_PARAM", Unit::Stiffness, 0.0..=1e6, 0.0, "Stiffness.");
    }

    fn ports(_: &(), declare: &mut Declare<'_>) -> Ports {
        Ports {
            position: declare.input("POSITION", types::POSITION),
            desired_position: declare.input("DES_POSITION", types::DES_POSITION),
            force: declare.output("DES_FORCE", types::DES_FORCE),
        }
    }

    fn compute(context: &Context<'_, Self>) {
        let Ports { position, desired_position, force } = context.ports();
        context.map_axes([position, desired_position], [force], |gains, (), [x, desired]| {
            // Write your law here; this one is a spring.
            [gains.stiffness * (desired - x)]
        });
    }
}
