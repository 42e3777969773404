//! Source of a trajectory's target.

use dimsart_core::{Data, Declarations, Input, choice, types};

choice! {
    /// Source of the target.
    pub(super) enum Source { Parameter = "PARAMETER", Signal = "SIGNAL" }
}

impl Source {
    /// Declares the port of the target for `SIGNAL`.
    pub(super) fn port(self, declare: &mut Declarations<'_>) -> Input {
        let signal = types::DES_POSITION.instance(2);
        match self {
            Self::Parameter => Input::default(),
            Self::Signal => declare.default_signal(signal).input("TARGET", types::DES_POSITION),
        }
    }

    /// Returns the target of an axis.
    #[inline(always)]
    pub(super) fn target(self, data: &Data<'_>, port: Input, axis: usize, parameter: f32) -> f32 {
        match self {
            Self::Parameter => parameter,
            Self::Signal => data.axis(port, axis),
        }
    }
}
