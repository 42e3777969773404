//! A port of a module that is plugged in, in three bytes.

use crate::module::{Direction, PortSpec, Stage, TypeMismatch};
use crate::signal::{DataType, Format, UnitConstraint, UnitRelation};

/// A port of a module that is plugged in.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Port {
    pub(crate) slot: u8,
    flags: u8,
    /// Relation and port of its tie, or [`Port::NO_TIE`]; plus [`Port::COORDINATE`].
    tie: u8,
}

impl Port {
    const WRITTEN: u8 = 1;
    const LATE: u8 = 2;
    const DELAYED: u8 = 4;
    const MEMORY: u8 = 8;
    /// Shift of the number of its difference, two bits; 0 for none.
    const DIFFERENCE: u8 = 4;
    /// Shift of the index of its maximum value; 0 if its signal is not of format `f32`.
    const LARGEST: u8 = 6;
    const LARGEST_VALUES: [f32; 3] = [f32::MAX, 1e9, 1e12];
    const DIFFERENCES: [TypeMismatch; 3] = [TypeMismatch::Unit, TypeMismatch::Format, TypeMismatch::Shape];
    const RELATIONS: [UnitRelation; 4] =
        [UnitRelation::Same, UnitRelation::Integral, UnitRelation::Derivative, UnitRelation::SameType];
    const NO_TIE: u8 = 0x7F;
    /// Flag in the byte of the tie.
    const COORDINATE: u8 = 0x80;

    /// Creates a port bound to a signal of type `bound`; a memory without a type.
    pub(super) fn new(slot: u8, spec: &PortSpec, bound: Option<&DataType>) -> Self {
        let difference = bound.and_then(|bound| spec.difference(bound));
        let of_floats = bound.filter(|bound| bound.format == Format::F32);
        let known = |bound: &DataType| {
            let largest = bound.unit.max_magnitude().to_bits();
            Self::LARGEST_VALUES.iter().position(|known| known.to_bits() == largest).unwrap_or(0)
        };
        let largest = of_floats.map_or(0, |bound| known(bound) + 1);
        let flag = |is_set, flag| if is_set { flag } else { 0 };
        let number = |found: &TypeMismatch| Self::DIFFERENCES.iter().position(|known| known == found);
        let difference = difference.as_ref().and_then(number).map_or(0, |number| number + 1);
        let tie = spec.unit_constraint.and_then(|UnitConstraint { relation, port }| {
            let relation = Self::RELATIONS.iter().position(|known| *known == relation)?;
            Some(u8::try_from(relation).ok()? << 4 | port)
        });
        let flags = flag(spec.direction == Direction::Write, Self::WRITTEN)
            | flag(spec.stage == Stage::Late, Self::LATE)
            | flag(spec.is_delayed, Self::DELAYED)
            | flag(spec.data_type.is_none(), Self::MEMORY)
            | u8::try_from(difference).unwrap_or(0) << Self::DIFFERENCE
            | u8::try_from(largest).unwrap_or(0) << Self::LARGEST;
        let coordinate = flag(spec.takes_coordinate(), Self::COORDINATE);
        Self { slot, flags, tie: tie.unwrap_or(Self::NO_TIE) | coordinate }
    }

    pub(crate) fn is_written(self) -> bool {
        self.flags & Self::WRITTEN != 0
    }

    pub(crate) fn is_delayed(self) -> bool {
        self.flags & Self::DELAYED != 0
    }

    pub(crate) fn is_memory(self) -> bool {
        self.flags & Self::MEMORY != 0
    }

    pub(crate) fn stage(self) -> Stage {
        if self.flags & Self::LATE == 0 { Stage::Early } else { Stage::Late }
    }

    /// Returns whether it reads or writes its signal.
    pub(crate) fn direction(self) -> Direction {
        if self.is_written() { Direction::Write } else { Direction::Read }
    }

    /// Returns the difference between its signal and the expected type.
    pub(crate) fn difference(self) -> Option<TypeMismatch> {
        let number = usize::from(self.flags >> Self::DIFFERENCE & 3).checked_sub(1)?;
        Self::DIFFERENCES.get(number).copied()
    }

    /// Returns the maximum magnitude of its signal's words; none if not `f32`.
    pub(crate) fn largest(self) -> Option<f32> {
        Self::LARGEST_VALUES.get(usize::from(self.flags >> Self::LARGEST).checked_sub(1)?).copied()
    }

    /// Returns whether it accepts coordinates (joint or Cartesian).
    pub(crate) fn takes_coordinate(self) -> bool {
        self.tie & Self::COORDINATE != 0
    }

    pub(crate) fn tie(self) -> Option<UnitConstraint> {
        let tie = self.tie & !Self::COORDINATE;
        if tie == Self::NO_TIE {
            return None;
        }
        let relation = *Self::RELATIONS.get(usize::from(tie >> 4))?;
        Some(UnitConstraint { relation, port: tie & 0xF })
    }
}
