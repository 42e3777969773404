//! Argument: side of a scheme.

use clap::builder::{PossibleValuesParser, TypedValueParser};

use hil_sim::schemes::SIDES;

/// Parses the name of a side.
pub(super) fn side() -> impl TypedValueParser<Value = &'static str> {
    let named = |name: String| SIDES.iter().find(|side| **side == name).copied();
    PossibleValuesParser::new(SIDES.iter().copied()).try_map(move |name| named(name).ok_or("unknown side"))
}
