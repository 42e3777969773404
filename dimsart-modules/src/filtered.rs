//! Ports of a filter: input and output of the same unit.

use dimsart_core::{Declarations, Input, Output, PortSet, UnitRelation, types, words};

words! {
    /// Input and output of a filter.
    pub struct FilterPorts { pub(super) input: Input, pub(super) output: Output }
}

impl PortSet for FilterPorts {
    fn declare(declare: &mut Declarations<'_>) -> Self {
        let input = declare.input("SIGNAL_IN", types::SIGNAL);
        let output = declare.output("SIGNAL_OUT", types::SIGNAL_OUT);
        declare.constrain_unit("SIGNAL_OUT", UnitRelation::Same, "SIGNAL_IN");
        Self { input, output }
    }
}
