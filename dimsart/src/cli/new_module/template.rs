//! Template: describe the law in one line.
//!
//! `F = K (x_d - x)`: its equation, with the source.

use dimsart_core::{Context, Input, Module, Output, Unit, types, words};

words! {
    /// Parameters per axis.
    pub parameters Gains {
        /// Stiffness.
        stiffness: f32 = per_axis("K_PARAM", Unit::Stiffness, 0.0..=1e6, 0.0),
    }
    /// Signals.
    pub ports Ports {
        position: Input = input("POSITION", types::POSITION),
        desired_position: Input = input("DES_POSITION", types::DES_POSITION),
        force: Output = output("DES_FORCE", types::DES_FORCE),
    }
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
    type AxisState = ();
    type Ports = Ports;

    fn compute(context: &Context<'_, Self>) {
        let Ports { position, desired_position, force } = context.ports();
        context.map_axes([position, desired_position], [force], |gains, (), [x, desired]| {
            // Replace this spring by your law.
            [gains.stiffness * (desired - x)]
        });
    }
}
