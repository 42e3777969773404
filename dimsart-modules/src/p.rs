//! P controller on position: a spring between desired and measured position.
//!
//! `F = K (x_d - x)`

use dimsart_core::{Context, Input, Module, Output, Unit, types, words};

words! {
    /// Parameters of one axis.
    pub parameters Gains {
        /// Proportional gain: force per position error.
        stiffness: f32 = per_axis("K_PARAM", Unit::Stiffness, 0.0..=1e6, 0.0),
    }
    /// Ports.
    pub ports Ports {
        position: Input = input("POSITION", types::POSITION),
        desired_position: Input = input("DES_POSITION", types::DES_POSITION),
        force: Output = output("DES_FORCE", types::DES_FORCE),
    }
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
    type AxisState = ();
    type Ports = Ports;

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { position, desired_position, force } = context.ports();
        context.map_axes([position, desired_position], [force], |gains, (), [x, desired]| {
            [gains.stiffness * (desired - x)]
        });
    }
}
