//! Names: from the words of a scheme to numbers and back.

use core::fmt;

use crate::command::ModuleRef;
use crate::data_type::TypeRef;
use crate::device::DeviceDescriptor;
use crate::engine::Engine;
use crate::kind::ModuleList;

/// A name and which copy of it, printed `NAME` or `NAME.2`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Name {
    /// The plain name.
    pub name: &'static str,
    /// 1 for the plain name.
    pub number: u8,
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.number == 1 { f.pad(self.name) } else { write!(f, "{}.{}", self.name, self.number) }
    }
}

/// Splits `NAME.2` into `NAME` and 2; none when the number is not 1 to 255.
#[must_use]
pub fn split(word: &str) -> Option<(&str, u8)> {
    match word.rsplit_once('.') {
        None => Some((word, 1)),
        Some((name, number)) => number.parse().ok().filter(|number| *number > 0).map(|number| (name, number)),
    }
}

/// Splits `K_PARAM[1]` into `K_PARAM` and axis 1; none when the axis is no number.
#[must_use]
pub fn split_axis(word: &str) -> Option<(&str, Option<u8>)> {
    match word.strip_suffix(']') {
        None => Some((word, None)),
        Some(rest) => {
            let (name, axis) = rest.split_once('[')?;
            Some((name, Some(axis.parse().ok()?)))
        }
    }
}

impl DeviceDescriptor {
    /// Name of a signal; `?` for a number that no type has.
    #[must_use]
    pub fn signal_name(&self, signal: TypeRef) -> Name {
        let name = self.data_type(signal.id).map_or("?", |data_type| data_type.name);
        Name { name, number: signal.number }
    }

    /// Finds a signal by name, `FORCE` or `FORCE.2`.
    #[must_use]
    pub fn signal(&self, word: &str) -> Option<TypeRef> {
        let (name, number) = split(word)?;
        Some(TypeRef { number, ..self.data_type_named(name)?.first() })
    }
}

impl<M: ModuleList, const WORDS: usize> Engine<M, WORDS> {
    /// Name of a module; `?` for a kind that is not in the image.
    #[must_use]
    pub fn module_name(module: ModuleRef) -> Name {
        let name = M::KINDS.get(usize::from(module.kind)).map_or("?", |kind| kind.name);
        Name { name, number: module.number }
    }

    /// Finds a module by name, `PDCTRL_MOD` or `PDCTRL_MOD.2`. It need not exist yet.
    #[must_use]
    pub fn module(word: &str) -> Option<ModuleRef> {
        let (name, number) = split(word)?;
        let kind = M::KINDS.iter().position(|kind| kind.name == name)?;
        Some(ModuleRef { kind: u8::try_from(kind).ok()?, number })
    }

    /// Finds a parameter of a kind of module by name.
    #[must_use]
    pub fn parameter(kind: u8, name: &str) -> Option<u8> {
        (0..=u8::MAX)
            .map_while(|index| Some((index, Self::describe_parameter(kind, index)?)))
            .find(|(_, parameter)| parameter.name == name)
            .map(|(index, _)| index)
    }
}
