//! A side as an argument.

use clap::builder::{PossibleValuesParser, TypedValueParser};

use hil_sim::bilateral::Side;

/// Takes the name of a side.
pub(super) fn side() -> impl TypedValueParser<Value = Side> {
    let sides = [Side::Master, Side::Slave];
    let named = move |name: String| sides.into_iter().find(|side| side.name() == name);
    PossibleValuesParser::new(sides.map(Side::name))
        .try_map(move |name| named(name).ok_or("there is no such side"))
}
