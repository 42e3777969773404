//! Normalizer: scale, offset and limit, for unit conversion or for a channel of limited range.
//!
//! `out = clamp((in - OFFSET) SCALE, -LIMIT, LIMIT)`; `SCALE` may change the unit, so the output's is free.

use dimsart_core::{Context, Declare, Input, Module, Output, Parameters, Unit, math, types, words};

words! {
    /// Of an axis.
    pub struct Gains { scale: f32, offset: f32, limit: f32 }
    /// Signals.
    pub struct Ports { input: Input, output: Output }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Normalizer;

impl Module for Normalizer {
    const NAME: &'static str = "NORMALIZER_MOD";
    const SUMMARY: &'static str = "Scales, shifts and limits a signal of any unit.";
    type Settings = ();
    type Gains = Gains;
    type State = ();
    type Axis = ();
    type Ports = Ports;

    fn parameters(_: &mut (), gains: &mut Gains, visit: &mut Parameters<'_>) {
        let Gains { scale, offset, limit } = gains;
        visit.per_axis(scale, "SCALE", Unit::One, -1e9..=1e9, 1.0, "Factor.");
        visit.per_axis(offset, "OFFSET", Unit::Any, -1e9..=1e9, 0.0, "Taken off before scaling.");
        visit.per_axis(limit, "LIMIT", Unit::Any, 0.0..=1e9, 1e9, "Largest output either way.");
    }

    fn ports(_: &(), declare: &mut Declare<'_>) -> Ports {
        Ports {
            input: declare.input("SIGNAL_IN", types::SIGNAL),
            output: declare.output("SIGNAL_OUT", types::SIGNAL_OUT),
        }
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { input, output } = context.ports();
        context.map_axes([input], [output], |Gains { scale, offset, limit }, (), [x]| {
            [math::limit((x - offset) * scale, limit)]
        });
    }
}
