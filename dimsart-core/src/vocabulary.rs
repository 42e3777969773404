//! What a controller says of itself, by number and by name: an engine at hand, or a device that was asked.

pub(crate) mod description;
pub mod names;

pub(crate) use description::{Accepted, DataTypeText, ParameterText, PortText};
pub(crate) use names::Name;

use core::fmt;

use crate::module::{EVERY_TICKS, KindId, ModuleRef};
use crate::signal::{AxisKind, Shape, TypeRef, Unit};
use crate::vocabulary::names::{numbered, split};

/// Kinds of modules, parameters, ports and data types of a controller.
///
/// An [`Engine`](crate::Engine) is one. A host that has asked a device for its descriptions has another one.
/// [Rows](crate::scheme::Row) are read and [findings](crate::Explanation) are put into words with either.
/// To ask changes nothing.
pub trait Vocabulary {
    /// Name of the device.
    fn device_name(&self) -> &str;

    /// What moves on each axis of the device.
    fn axes(&self) -> &[AxisKind];

    /// Degrees of freedom.
    fn dof(&self) -> u8 {
        u8::try_from(self.axes().len()).unwrap_or(u8::MAX)
    }

    /// Name of the kind of module at a place in the list; none past the last one.
    fn kind_at(&self, place: u8) -> Option<&str>;

    /// Parameter `index` of a kind of module; none past the last one, but for number 127: [every how many
    /// ticks](crate::Rate) a module runs.
    fn parameter_text(&self, kind: KindId, index: u8) -> Option<ParameterText<'_>>;

    /// Port `index` of a module as its parameters are now; none past the last one.
    fn port_text(&self, module: ModuleRef, index: u8) -> Option<PortText<'_>>;

    /// The data type at place `index` of the list: the standard ones, then the device's own; none past the last one.
    fn type_text(&self, index: u16) -> Option<DataTypeText<'_>>;

    /// Names of all kinds of modules.
    fn kind_names(&self) -> impl Iterator<Item = &str> {
        (0..=u8::MAX).map_while(|place| self.kind_at(place))
    }

    /// Name of a kind of module.
    fn kind_name(&self, kind: KindId) -> Option<&str> {
        self.kind_names().find(|name| KindId::of(name) == kind)
    }

    /// Parameters of a kind of module.
    fn parameter_texts(&self, kind: KindId) -> impl Iterator<Item = ParameterText<'_>> {
        (0..=u8::MAX).map_while(move |index| self.parameter_text(kind, index))
    }

    /// Ports of a module.
    fn port_texts(&self, module: ModuleRef) -> impl Iterator<Item = PortText<'_>> {
        (0..=u8::MAX).map_while(move |index| self.port_text(module, index))
    }

    /// All data types.
    fn type_texts(&self) -> impl Iterator<Item = DataTypeText<'_>> {
        (0..=u16::MAX).map_while(|index| self.type_text(index))
    }

    /// Finds a module by name, `PDCTRL_MOD` or `PDCTRL_MOD.2`. It need not exist yet.
    fn module_named(&self, word: &str) -> Option<ModuleRef> {
        numbered(self.kind_names(), word)
    }

    /// Name of a module; `?` for a kind that is not there.
    fn name_of_module(&self, module: ModuleRef) -> Name<'_> {
        Name { name: self.kind_name(module.kind).unwrap_or("?"), number: module.number }
    }

    /// Finds a parameter of a kind of module by name, and its number.
    fn parameter_named(&self, kind: KindId, name: &str) -> Option<(u8, ParameterText<'_>)> {
        let of_all = self.parameter_text(kind, EVERY_TICKS).map(|parameter| (EVERY_TICKS, parameter));
        let mut found = (0..=u8::MAX).zip(self.parameter_texts(kind)).chain(of_all);
        found.find(|(_, parameter)| parameter.name == name)
    }

    /// Finds a signal by name, `FORCE` or `FORCE.2`.
    fn signal_named(&self, word: &str) -> Option<TypeRef> {
        let (name, number) = split(word)?;
        // A device's own types come last, and may have a standard one's name.
        let found = self.type_texts().filter(|found| found.name == name).last()?;
        Some(TypeRef { id: found.id, number })
    }

    /// The data type of a signal.
    fn type_of(&self, signal: TypeRef) -> Option<DataTypeText<'_>> {
        self.type_texts().find(|found| found.id == signal.id)
    }

    /// Name of a signal; `?` for a number that no type has.
    fn name_of_signal(&self, signal: TypeRef) -> Name<'_> {
        Name { name: self.type_of(signal).map_or("?", |found| found.name), number: signal.number }
    }
}

/// A unit's symbol on the axes of a device: both where they differ. Empty for a pure number.
#[derive(Debug, Clone, Copy)]
pub struct UnitOn<'a> {
    unit: Unit,
    axes: &'a [AxisKind],
}

impl Unit {
    /// The unit on these axes.
    #[must_use]
    pub fn on(self, axes: &[AxisKind]) -> UnitOn<'_> {
        UnitOn { unit: self, axes }
    }

    /// The unit of one word of a signal: on its row's axis. A scalar, and a row beyond the last axis, are of all axes.
    #[must_use]
    pub fn of_word(self, shape: Shape, word: usize, axes: &[AxisKind]) -> UnitOn<'_> {
        let (row, _) = shape.place(word, axes.len());
        let axis = axes.chunks(1).nth(row).filter(|_| shape != Shape::Scalar);
        self.on(axis.unwrap_or(axes))
    }
}

impl UnitOn<'_> {
    /// Whether it is a pure number.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.unit == Unit::One
    }
}

impl fmt::Display for UnitOn<'_> {
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
                    std::format!("{}", Unit::Force.of_word(shape, word, &axes)),
                    *expected,
                    "{shape:?}"
                );
            }
        }
    }
}
