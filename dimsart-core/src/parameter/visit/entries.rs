//! Parameters with several values, and signed whole numbers.

use core::ops::RangeInclusive;

use super::{Parameters, Request, Set};
use crate::limits::MAX_DOF;
use crate::parameter::{Choice, Parameter, ParameterShape, ParameterType, Value};
use crate::signal::{Summary, Unit};

impl Parameters<'_> {
    /// Declares a signed whole number for all axes.
    #[inline(always)]
    pub fn integer(
        &mut self,
        field: &mut i32,
        name: &'static str,
        unit: Unit,
        range: RangeInclusive<i32>,
        default: i32,
        summary: &'static str,
    ) {
        self.signed(
            field,
            name,
            unit,
            range.into_inner(),
            default,
            ParameterShape::ONE,
            Summary::new(summary),
        );
    }

    /// Declares a signed whole number per axis.
    #[inline(always)]
    pub fn per_axis_integer(
        &mut self,
        field: &mut i32,
        name: &'static str,
        unit: Unit,
        range: RangeInclusive<i32>,
        default: i32,
        summary: &'static str,
    ) {
        self.signed(
            field,
            name,
            unit,
            range.into_inner(),
            default,
            ParameterShape::AXES,
            Summary::new(summary),
        );
    }

    /// Declares a whole number per axis.
    #[inline(always)]
    pub fn per_axis_count(
        &mut self,
        field: &mut u32,
        name: &'static str,
        unit: Unit,
        range: RangeInclusive<u32>,
        default: u32,
        summary: &'static str,
    ) {
        let (range, summary) = (range.into_inner(), Summary::new(summary));
        self.whole(field, name, unit, range, default, ParameterShape::AXES, false, summary);
    }

    /// Declares a switch per axis.
    #[inline(always)]
    pub fn per_axis_flag(
        &mut self,
        field: &mut bool,
        name: &'static str,
        default: bool,
        summary: &'static str,
    ) {
        self.switch(field, name, default, ParameterShape::AXES, false, Summary::new(summary));
    }

    /// Declares a choice per axis.
    #[inline(always)]
    pub fn per_axis_choice<C: Choice>(&mut self, field: &mut C, name: &'static str, summary: &'static str) {
        let summary = Summary::new(summary);
        let index = self.named(field.index(), C::NAMES, name, ParameterShape::AXES, false, summary);
        *field = C::from_index(index);
    }

    /// Declares a matrix of real numbers in the settings, such as a state-feedback gain. All settings of a
    /// module have at most 24 words.
    pub fn matrix<const R: usize, const C: usize>(
        &mut self,
        field: &mut [[f32; C]; R],
        name: &'static str,
        unit: Unit,
        range: RangeInclusive<f32>,
        default: f32,
        summary: &'static str,
    ) {
        const { assert!(R * C > 1 && R * C <= 255, "a matrix parameter has 2 to 255 elements") };
        #[expect(clippy::cast_possible_truncation, reason = "checked above")]
        let entries = ParameterShape { rows: R as u8, columns: C as u8 };
        let summary = Summary::new(summary);
        self.elements(field.as_flattened_mut(), name, unit, range.into_inner(), default, entries, summary);
    }

    /// Declares a row of real numbers per axis, stored in the gains of each axis: together a matrix with one
    /// row per axis. At most 31 columns.
    pub fn per_axis_row<const C: usize>(
        &mut self,
        field: &mut [f32; C],
        name: &'static str,
        unit: Unit,
        range: RangeInclusive<f32>,
        default: f32,
        summary: &'static str,
    ) {
        const { assert!(C > 0 && C * MAX_DOF <= 255, "a row has 1 to 31 elements") };
        #[expect(clippy::cast_possible_truncation, reason = "checked above")]
        let entries = ParameterShape { columns: C as u8, ..ParameterShape::SQUARE };
        self.elements(field, name, unit, range.into_inner(), default, entries, Summary::new(summary));
    }

    /// Declares a matrix with one row and one column per axis, as [`per_axis_row`](Self::per_axis_row).
    pub fn square(
        &mut self,
        field: &mut [f32; MAX_DOF],
        name: &'static str,
        unit: Unit,
        range: RangeInclusive<f32>,
        default: f32,
        summary: &'static str,
    ) {
        let (range, summary) = (range.into_inner(), Summary::new(summary));
        self.elements(field, name, unit, range, default, ParameterShape::SQUARE, summary);
    }

    #[expect(clippy::too_many_arguments, reason = "one line of a parameter list, never called elsewhere")]
    #[inline(never)]
    pub(super) fn elements(
        &mut self,
        fields: &mut [f32],
        name: &'static str,
        unit: Unit,
        (min, max): (f32, f32),
        default: f32,
        entries: ParameterShape,
        summary: Summary,
    ) {
        if !self.is_asked() {
            return;
        }
        let (accepts, default) = (ParameterType::Real { min, max }, Some(Value::Real(default)));
        let parameter = Parameter { name, unit, accepts, entries, default, is_structural: false, summary };
        let element = match &self.request {
            Request::Get { entry, .. } | Request::Set(Set { element: entry, .. }) => *entry,
            Request::Defaults => None,
        };
        let mine = element.map(usize::from);
        let value = fields.get(mine.unwrap_or(0)).copied().map(Value::Real);
        let Some(Value::Real(value)) = self.answer(&parameter, value) else { return };
        for (place, field) in fields.iter_mut().enumerate() {
            if mine.is_none_or(|mine| mine == place) {
                *field = value;
            }
        }
    }

    #[expect(clippy::too_many_arguments, reason = "one line of a parameter list, never called elsewhere")]
    #[inline(never)]
    fn signed(
        &mut self,
        field: &mut i32,
        name: &'static str,
        unit: Unit,
        (min, max): (i32, i32),
        default: i32,
        entries: ParameterShape,
        summary: Summary,
    ) {
        if !self.is_asked() {
            return;
        }
        let (accepts, default) = (ParameterType::Integer { min, max }, Some(Value::Integer(default)));
        let parameter = Parameter { name, unit, accepts, entries, default, is_structural: false, summary };
        if let Some(Value::Integer(value)) = self.answer(&parameter, Some(Value::Integer(*field))) {
            *field = value;
        }
    }
}
