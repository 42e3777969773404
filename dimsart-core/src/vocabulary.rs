//! Vocabulary: names and descriptions of a controller's modules, parameters, ports and types.

pub(crate) mod description;
pub mod names;

pub(crate) use description::{
    DataTypeDescription, ParameterDescription, ParameterTypeDescription, PortDescription,
};
pub(crate) use names::Name;

use core::fmt;

use crate::module::{EVERY_TICKS, KindId, ModuleRef};
use crate::signal::{AxisKind, Shape, TypeRef, Unit};
use crate::vocabulary::names::{numbered, split};

/// Names and descriptions of a controller's module kinds, parameters, ports and data types.
///
/// An [`Engine`](crate::Engine) implements it, and so does a host's copy of a device's descriptions.
/// [Rows](crate::scheme::Row) are parsed and [findings](crate::Explanation) are printed with either.
pub trait Vocabulary {
    /// Returns the name of the device.
    fn device_name(&self) -> &str;

    /// Returns the kind of each axis of the device.
    fn axes(&self) -> &[AxisKind];

    /// Returns the degrees of freedom.
    fn dof(&self) -> u8 {
        u8::try_from(self.axes().len()).unwrap_or(u8::MAX)
    }

    /// Returns the name of the module kind at an index of the list; none after the last one.
    fn kind_at(&self, place: u8) -> Option<&str>;

    /// Returns parameter `index` of a module kind; none after the last one, except number 127, the
    /// [period](crate::Rate) of the module.
    fn parameter_text(&self, kind: KindId, index: u8) -> Option<ParameterDescription<'_>>;

    /// Returns port `index` of a module with its current parameters; none after the last one.
    fn port_text(&self, module: ModuleRef, index: u8) -> Option<PortDescription<'_>>;

    /// Returns the data type at `index` of the list: the standard types, then the device's own; none after
    /// the last one.
    fn type_text(&self, index: u16) -> Option<DataTypeDescription<'_>>;

    /// Returns the names of all module kinds.
    fn kind_names(&self) -> impl Iterator<Item = &str> {
        (0..=u8::MAX).map_while(|place| self.kind_at(place))
    }

    /// Returns the name of a module kind.
    fn kind_name(&self, kind: KindId) -> Option<&str> {
        self.kind_names().find(|name| KindId::from_name(name) == kind)
    }

    /// Returns the parameters of a module kind.
    fn parameter_texts(&self, kind: KindId) -> impl Iterator<Item = ParameterDescription<'_>> {
        (0..=u8::MAX).map_while(move |index| self.parameter_text(kind, index))
    }

    /// Returns the ports of a module.
    fn port_texts(&self, module: ModuleRef) -> impl Iterator<Item = PortDescription<'_>> {
        (0..=u8::MAX).map_while(move |index| self.port_text(module, index))
    }

    /// Returns all data types.
    fn type_texts(&self) -> impl Iterator<Item = DataTypeDescription<'_>> {
        (0..=u16::MAX).map_while(|index| self.type_text(index))
    }

    /// Finds a module by name, `PDCTRL_MOD` or `PDCTRL_MOD.2`. The instance need not exist.
    fn find_module(&self, word: &str) -> Option<ModuleRef> {
        numbered(self.kind_names(), word)
    }

    /// Returns the name of a module; `?` for an unknown kind.
    fn module_name(&self, module: ModuleRef) -> Name<'_> {
        Name { name: self.kind_name(module.kind).unwrap_or("?"), number: module.number }
    }

    /// Finds a parameter of a module kind by name, and its number.
    fn find_parameter(&self, kind: KindId, name: &str) -> Option<(u8, ParameterDescription<'_>)> {
        let of_all = self.parameter_text(kind, EVERY_TICKS).map(|parameter| (EVERY_TICKS, parameter));
        let mut found = (0..=u8::MAX).zip(self.parameter_texts(kind)).chain(of_all);
        found.find(|(_, parameter)| parameter.name == name)
    }

    /// Finds a signal by name, `FORCE` or `FORCE.2`.
    fn signal_named(&self, word: &str) -> Option<TypeRef> {
        let (name, number) = split(word)?;
        // A device's own type overrides a standard type of the same name.
        let found = self.type_texts().filter(|found| found.name == name).last()?;
        Some(TypeRef { id: found.id, number })
    }

    /// Returns the data type of a signal.
    fn type_of(&self, signal: TypeRef) -> Option<DataTypeDescription<'_>> {
        self.type_texts().find(|found| found.id == signal.id)
    }

    /// Returns the name of a signal; `?` for an unknown type.
    fn signal_name(&self, signal: TypeRef) -> Name<'_> {
        Name { name: self.type_of(signal).map_or("?", |found| found.name), number: signal.number }
    }
}

/// A unit's symbol for the axes of a device: both symbols if the axes differ. Empty if dimensionless.
#[derive(Debug, Clone, Copy)]
pub struct AxisUnit<'a> {
    unit: Unit,
    axes: &'a [AxisKind],
}

impl Unit {
    /// Returns the unit for these axes.
    #[must_use]
    pub fn for_axes(self, axes: &[AxisKind]) -> AxisUnit<'_> {
        AxisUnit { unit: self, axes }
    }

    /// Returns the unit of one word of a signal, for its row's axis. Scalars, and rows after the last axis,
    /// have the unit of all axes.
    #[must_use]
    pub fn for_word(self, shape: Shape, word: usize, axes: &[AxisKind]) -> AxisUnit<'_> {
        let (row, _) = shape.place(word, axes.len());
        let axis = axes.chunks(1).nth(row).filter(|_| shape != Shape::Scalar);
        self.for_axes(axis.unwrap_or(axes))
    }
}

impl AxisUnit<'_> {
    /// Returns whether the unit is dimensionless.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.unit == Unit::One
    }
}

impl fmt::Display for AxisUnit<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [linear, rotary] = [AxisKind::Linear, AxisKind::Rotary].map(|kind| self.unit.symbol(kind));
        let is_all = |kind| self.axes.iter().all(|axis| *axis == kind);
        if linear == rotary || is_all(AxisKind::Linear) {
            f.pad(linear)
        } else if is_all(AxisKind::Rotary) {
            f.pad(rotary)
        } else {
            write!(f, "{linear} or {rotary}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_has_the_unit_of_its_rows_axis_or_of_all_axes() {
        let axes = [AxisKind::Linear, AxisKind::Rotary];
        for (shape, expected) in [
            (Shape::Scalar, &["N or N·m"][..]),
            (Shape::Vector, &["N", "N·m"]),
            (Shape::Square, &["N", "N", "N·m", "N·m"]),
            (Shape::Matrix(3, 1), &["N", "N·m", "N or N·m"]),
            (Shape::Matrix(2, 3), &["N", "N", "N", "N·m", "N·m", "N·m"]),
        ] {
            for (word, expected) in expected.iter().enumerate() {
                assert_eq!(
                    std::format!("{}", Unit::Force.for_word(shape, word, &axes)),
                    *expected,
                    "{shape:?}"
                );
            }
        }
    }
}
