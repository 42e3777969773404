//! Structs of parameters.

use super::Parameters;
use crate::signal::Words;

/// A set of parameters; [`words!`](crate::words!) implements it.
pub trait ParameterSet: Words + Default {
    /// Visits every parameter, in order.
    fn visit(&mut self, parameters: &mut Parameters<'_>) {
        let _ = parameters;
    }
}

impl ParameterSet for () {}

impl<A: ParameterSet, B: ParameterSet> ParameterSet for (A, B) {
    fn visit(&mut self, parameters: &mut Parameters<'_>) {
        self.0.visit(parameters);
        self.1.visit(parameters);
    }
}

/// Declares a struct of parameters; used by [`words!`](crate::words!).
#[doc(hidden)]
#[macro_export]
macro_rules! parameters {
    (@visit $parameters:ident, $field:expr, $help:tt) => {};
    (@visit $parameters:ident, $field:expr, [$($help:literal),*], $method:ident, $($argument:expr),*) => {
        $parameters.$method(&mut $field, $($argument,)* concat!($($help),*))
    };
    ($(#[$meta:meta])* $visibility:vis struct $name:ident {
        $($(#[doc = $help:literal])* $field_visibility:vis $field:ident: $type:ty
            $(= $method:ident($($argument:expr),* $(,)?))?),* $(,)?
    }) => {
        $crate::words! {
            $(#[$meta])*
            $visibility struct $name { $($(#[doc = $help])* $field_visibility $field: $type),* }
        }

        impl $crate::ParameterSet for $name {
            #[inline(always)]
            #[allow(unused_variables)]
            fn visit(&mut self, parameters: &mut $crate::Parameters<'_>) {
                $($crate::parameters!(@visit parameters, self.$field, [$($help),*] $(, $method, $($argument),*)?);)*
            }
        }
    };
}
