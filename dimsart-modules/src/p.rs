//! P controller: spring between desired and measured position.
//!
//! `F = K (x_d - x)`

use dimsart_core::{Context, Declare, Input, Module, Output, Parameters, Unit, types, words};

words! {
    /// Of an axis.
    pub struct Gains { stiffness: f32 }
    /// Signals.
    pub struct Ports { position: Input, desired_position: Input, force: Output }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct P;

impl Module for P {
    const NAME: &'static str = "PCTRL_MOD";
    const SUMMARY: &'static str = "P controller on position: F = K (x_d - x).";
    type Settings = ();
    type Gains = Gains;
    type State = ();
    type Axis = ();
    type Ports = Ports;

    fn parameters(_: &mut (), gains: &mut Gains, visit: &mut Parameters<'_>) {
        let stiffness = &mut gains.stiffness;
        visit.per_axis(stiffness, "K_PARAM", Unit::Stiffness, 0.0..=1e6, 0.0, "Proportional gain.");
    }

    fn ports(_: &(), declare: &mut Declare<'_>) -> Ports {
        Ports {
            position: declare.input("POSITION", types::POSITION),
            desired_position: declare.input("DES_POSITION", types::DES_POSITION),
            force: declare.output("DES_FORCE", types::DES_FORCE),
        }
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { position, desired_position, force } = context.ports();
        context.map_axes([position, desired_position], [force], |gains, (), [x, desired]| {
            [gains.stiffness * (desired - x)]
        });
    }
}
