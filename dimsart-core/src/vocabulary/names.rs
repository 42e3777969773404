//! Names: conversion between words of a scheme and numbers.

use core::fmt;

use crate::device::DeviceDescriptor;
use crate::module::ModuleRef;
use crate::signal::TypeRef;

/// A name and an instance number, printed `NAME` or `NAME.2`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Name<'a> {
    /// The plain name.
    pub name: &'a str,
    /// Instance number; 1 for the plain name.
    pub number: u8,
}

impl fmt::Display for Name<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.number == 1 { f.pad(self.name) } else { write!(f, "{}.{}", self.name, self.number) }
    }
}

/// Splits `NAME.2` into `NAME` and 2; none if the number is not 1 to 255.
#[must_use]
pub fn split(word: &str) -> Option<(&str, u8)> {
    match word.rsplit_once('.') {
        None => Some((word, 1)),
        Some((name, number)) => number.parse().ok().filter(|number| *number > 0).map(|number| (name, number)),
    }
}

/// Finds `NAME` or `NAME.2` among the names of module kinds.
pub(crate) fn numbered<'a>(mut kinds: impl Iterator<Item = &'a str>, word: &str) -> Option<ModuleRef> {
    let (name, number) = split(word)?;
    kinds.any(|kind| kind == name).then(|| ModuleRef::new(name, number))
}

/// Splits `K_PARAM[1]` into `K_PARAM` and axis 1, and `K[1][2]` into `K`, row 1 and column 2. Returns the
/// name alone if no valid index follows.
#[must_use]
pub fn split_axis(word: &str) -> (&str, Option<[Option<u8>; 2]>) {
    let Some((name, rest)) = word.split_once('[') else { return (word, Some([None; 2])) };
    let indices = || {
        let indices = rest.strip_suffix(']')?;
        let (first, second) = match indices.split_once("][") {
            None => (indices, None),
            Some((first, second)) => (first, Some(second.parse().ok()?)),
        };
        Some([Some(first.parse().ok()?), second])
    };
    (name, indices())
}

impl DeviceDescriptor {
    /// Returns the name of a signal; `?` for an unknown type.
    #[must_use]
    pub fn signal_name(&self, signal: TypeRef) -> Name<'static> {
        let name = self.data_type(signal.id).map_or("?", |data_type| data_type.name);
        Name { name, number: signal.number }
    }

    /// Finds a signal by name, `FORCE` or `FORCE.2`.
    #[must_use]
    pub fn signal(&self, word: &str) -> Option<TypeRef> {
        let (name, number) = split(word)?;
        Some(TypeRef { number, ..self.data_type_by_name(name)?.first() })
    }
}
