//! Normalizer: offset, scale and limit, for unit conversion or a channel of limited range.
//!
//! `out = clamp((in - OFFSET) SCALE, -LIMIT, LIMIT)`. `SCALE` may change the unit, so the output accepts any unit.

use dimsart_core::{Context, Input, Module, Output, Unit, math, types, words};

words! {
    /// Parameters of one axis.
    pub parameters Gains {
        /// Scale factor.
        scale: f32 = per_axis("SCALE", Unit::One, -1e9..=1e9, 1.0),
        /// Offset, subtracted before scaling.
        offset: f32 = per_axis("OFFSET", Unit::Any, -1e9..=1e9, 0.0),
        /// Maximum output, in either direction.
        limit: f32 = per_axis("LIMIT", Unit::Any, 0.0..=1e9, 1e9),
    }
    /// Ports.
    pub ports Ports {
        input: Input = input("SIGNAL_IN", types::SIGNAL),
        output: Output = output("SIGNAL_OUT", types::SIGNAL_OUT),
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Normalizer;

impl Module for Normalizer {
    const NAME: &'static str = "NORMALIZER_MOD";
    const SUMMARY: &'static str = "Offsets, scales and limits a signal of any unit.";
    type Settings = ();
    type Gains = Gains;
    type State = ();
    type AxisState = ();
    type Ports = Ports;

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { input, output } = context.ports();
        context.map_axes([input], [output], |Gains { scale, offset, limit }, (), [x]| {
            [math::limit((x - offset) * scale, limit)]
        });
    }
}
