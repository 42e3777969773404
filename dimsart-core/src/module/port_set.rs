//! Structs of handles.

use super::Declarations;
use crate::data_base::{Input, Memory, Output, Signal};
use crate::signal::Words;

/// A module's handles; [`words!`](crate::words!) implements it.
pub trait PortSet: Words {
    /// Declares the ports, in order. An undeclared handle reads zero, and writes to it are dropped.
    #[must_use]
    fn declare(declare: &mut Declarations<'_>) -> Self {
        let _ = declare;
        Self::load(&[])
    }
}

impl PortSet for () {}
impl PortSet for Memory {}
impl<S: Signal> PortSet for Input<S> {}
impl<S: Signal> PortSet for Output<S> {}
impl<A: PortSet, B: PortSet> PortSet for (A, B) {}
impl<T: PortSet, const N: usize> PortSet for [T; N] {}

/// Declares a struct of handles; used by [`words!`](crate::words!).
#[doc(hidden)]
#[macro_export]
macro_rules! ports {
    ($(#[$meta:meta])* $visibility:vis struct $name:ident {
        $($(#[$field_meta:meta])* $field_visibility:vis $field:ident: $type:ty
            $(= $($method:ident($($argument:expr),* $(,)?)).+)?),* $(,)?
    }) => {
        $crate::words! {
            $(#[$meta])*
            $visibility struct $name { $($(#[$field_meta])* $field_visibility $field: $type),* }
        }

        impl $crate::PortSet for $name {
            #[inline(always)]
            #[allow(unused_mut, unused_variables)]
            fn declare(declare: &mut $crate::Declarations<'_>) -> Self {
                let mut ports = Self::default();
                $($(ports.$field = declare.$($method($($argument),*)).+;)?)*
                ports
            }
        }
    };
}
