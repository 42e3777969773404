//! The visit of a module's parameters: one list of calls, asked in turn for everything a parameter is for.

use super::{Accepts, Choice, Parameter, ParameterError, PerAxis, TypeList, Value};
use crate::unit::Unit;

/// Visits a module's parameters, one call per parameter; see the [module docs](super).
#[derive(Debug)]
pub struct Parameters<'a> {
    request: Request<'a>,
    index: u8,
}

#[derive(Debug)]
enum Request<'a> {
    Defaults,
    Describe {
        index: u8,
        found: &'a mut Option<Parameter>,
    },
    Get {
        index: u8,
        axis: u8,
        found: &'a mut Option<Value>,
    },
    Set {
        index: u8,
        axis: Option<u8>,
        value: Value,
        may_restructure: bool,
        result: &'a mut Result<(), ParameterError>,
    },
    Changed {
        dof: u8,
        skip: &'a mut u16,
        found: &'a mut Option<Change>,
    },
}

/// A value that is not the default one, and how to set it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    /// Number of the parameter.
    pub index: u8,
    /// Axis; none for all axes.
    pub axis: Option<u8>,
    /// The value; for a list, one of its entries.
    pub value: Value,
}

// A call and no more for each line of a parameter list: nothing of it is inlined or generic.
impl<'a> Parameters<'a> {
    /// Sets every parameter to its default.
    #[must_use]
    pub fn defaults() -> Self {
        Self { request: Request::Defaults, index: 0 }
    }

    /// Fills `found` with the description of parameter `index`.
    pub fn describe(index: u8, found: &'a mut Option<Parameter>) -> Self {
        Self { request: Request::Describe { index, found }, index: 0 }
    }

    /// Fills `found` with the value of parameter `index`; of the last entry for a list.
    pub fn get(index: u8, axis: u8, found: &'a mut Option<Value>) -> Self {
        Self { request: Request::Get { index, axis, found }, index: 0 }
    }

    /// Sets parameter `index`; without an axis, of all axes. `result` starts as
    /// [`ParameterError::Unknown`] and says how it went.
    pub fn set(
        index: u8,
        axis: Option<u8>,
        value: Value,
        may_restructure: bool,
        result: &'a mut Result<(), ParameterError>,
    ) -> Self {
        *result = Err(ParameterError::Unknown);
        Self { request: Request::Set { index, axis, value, may_restructure, result }, index: 0 }
    }

    /// Fills `found` with a value that is not the default one, or an entry of a list: the first one after
    /// `skip` others, which are counted down. Axes from `dof` on are not looked at.
    pub fn changed(dof: u8, skip: &'a mut u16, found: &'a mut Option<Change>) -> Self {
        Self { request: Request::Changed { dof, skip, found }, index: 0 }
    }

    /// A real number, the same for all axes.
    #[inline(never)]
    pub fn real(
        &mut self,
        field: &mut f32,
        name: &'static str,
        unit: Unit,
        range: core::ops::RangeInclusive<f32>,
        default: f32,
        summary: &'static str,
    ) {
        let (min, max) = range.into_inner();
        let accepts = Accepts::Real { min, max, per_axis: false };
        self.visit(
            name,
            unit,
            accepts,
            Some(Value::Real(default)),
            false,
            summary,
            &mut |access| match access {
                Access::Get(_, found) => *found = Some(Value::Real(*field)),
                Access::Set(_, Value::Real(value)) => *field = value,
                Access::Set(..) => {}
            },
        );
    }

    /// A real number per axis, such as a gain.
    #[inline(never)]
    pub fn per_axis(
        &mut self,
        field: &mut PerAxis,
        name: &'static str,
        unit: Unit,
        range: core::ops::RangeInclusive<f32>,
        default: f32,
        summary: &'static str,
    ) {
        let (min, max) = range.into_inner();
        let accepts = Accepts::Real { min, max, per_axis: true };
        self.visit(
            name,
            unit,
            accepts,
            Some(Value::Real(default)),
            false,
            summary,
            &mut |access| match access {
                Access::Get(axis, found) => *found = field.get(usize::from(axis)).copied().map(Value::Real),
                Access::Set(None, Value::Real(value)) => field.fill(value),
                Access::Set(Some(axis), Value::Real(value)) => {
                    if let Some(entry) = field.get_mut(usize::from(axis)) {
                        *entry = value;
                    }
                }
                Access::Set(..) => {}
            },
        );
    }

    /// A whole number that can be changed at any time.
    pub fn count(
        &mut self,
        field: &mut u32,
        name: &'static str,
        unit: Unit,
        range: core::ops::RangeInclusive<u32>,
        default: u32,
        summary: &'static str,
    ) {
        self.whole(field, name, unit, range, default, false, summary);
    }

    /// A whole number that decides how much memory the module takes when it is plugged in.
    pub fn structural_count(
        &mut self,
        field: &mut u32,
        name: &'static str,
        unit: Unit,
        range: core::ops::RangeInclusive<u32>,
        default: u32,
        summary: &'static str,
    ) {
        self.whole(field, name, unit, range, default, true, summary);
    }

    /// A switch that can be changed at any time.
    pub fn flag(&mut self, field: &mut bool, name: &'static str, default: bool, summary: &'static str) {
        self.switch(field, name, default, false, summary);
    }

    /// A switch that decides which ports the module has.
    pub fn structural_flag(
        &mut self,
        field: &mut bool,
        name: &'static str,
        default: bool,
        summary: &'static str,
    ) {
        self.switch(field, name, default, true, summary);
    }

    /// One of a set of names, changeable at any time.
    pub fn choice<C: Choice>(&mut self, field: &mut C, name: &'static str, summary: &'static str) {
        self.choose(field, name, false, summary);
    }

    /// One of a set of names that decides which ports the module has.
    pub fn structural_choice<C: Choice>(&mut self, field: &mut C, name: &'static str, summary: &'static str) {
        self.choose(field, name, true, summary);
    }

    /// A list of data types; each command adds one.
    #[inline(never)]
    pub fn types(&mut self, field: &mut TypeList, name: &'static str, summary: &'static str) {
        if matches!(self.request, Request::Defaults) {
            field.clear();
        }
        if let Request::Changed { skip, found, .. } = &mut self.request {
            for signal in field.iter() {
                let change = Change { index: self.index, axis: None, value: Value::Type(*signal) };
                change.put(skip, found);
            }
        }
        let is_full = field.is_full();
        let is_mine = matches!(self.request, Request::Set { index, .. } if index == self.index);
        self.visit(name, Unit::Any, Accepts::Types, None, true, summary, &mut |access| match access {
            Access::Get(_, found) => *found = field.last().copied().map(Value::Type),
            Access::Set(_, Value::Type(value)) => drop(field.push(value)),
            Access::Set(..) => {}
        });
        if let Request::Set { result, .. } = &mut self.request
            && is_mine
            && is_full
            && result.is_ok()
        {
            **result = Err(ParameterError::ListFull);
        }
    }

    #[inline(never)]
    fn switch(
        &mut self,
        field: &mut bool,
        name: &'static str,
        default: bool,
        is_structural: bool,
        summary: &'static str,
    ) {
        let default = Some(Value::Flag(default));
        self.visit(
            name,
            Unit::One,
            Accepts::Flag,
            default,
            is_structural,
            summary,
            &mut |access| match access {
                Access::Get(_, found) => *found = Some(Value::Flag(*field)),
                Access::Set(_, Value::Flag(value)) => *field = value,
                Access::Set(..) => {}
            },
        );
    }

    #[expect(clippy::too_many_arguments, reason = "one line of a parameter list, never called elsewhere")]
    #[inline(never)]
    fn whole(
        &mut self,
        field: &mut u32,
        name: &'static str,
        unit: Unit,
        range: core::ops::RangeInclusive<u32>,
        default: u32,
        is_structural: bool,
        summary: &'static str,
    ) {
        let (min, max) = range.into_inner();
        let default = Some(Value::Count(default));
        self.visit(name, unit, Accepts::Count { min, max }, default, is_structural, summary, &mut |access| {
            match access {
                Access::Get(_, found) => *found = Some(Value::Count(*field)),
                Access::Set(_, Value::Count(value)) => *field = value,
                Access::Set(..) => {}
            }
        });
    }

    fn choose<C: Choice>(
        &mut self,
        field: &mut C,
        name: &'static str,
        is_structural: bool,
        summary: &'static str,
    ) {
        let position = C::VALUES.iter().position(|value| value == field);
        let mut position = position.and_then(|position| u8::try_from(position).ok()).unwrap_or(0);
        self.named(&mut position, C::NAMES, name, is_structural, summary);
        if let Some(value) = C::VALUES.get(usize::from(position)) {
            *field = *value;
        }
    }

    #[inline(never)]
    fn named(
        &mut self,
        field: &mut u8,
        names: &'static [&'static str],
        name: &'static str,
        is_structural: bool,
        summary: &'static str,
    ) {
        let (accepts, default) = (Accepts::Choice(names), Some(Value::Choice(0)));
        self.visit(name, Unit::One, accepts, default, is_structural, summary, &mut |access| match access {
            Access::Get(_, found) => *found = Some(Value::Choice(*field)),
            Access::Set(_, Value::Choice(index)) => *field = index,
            Access::Set(..) => {}
        });
    }

    #[expect(clippy::too_many_arguments, reason = "the fields of a Parameter, one by one")]
    fn visit(
        &mut self,
        name: &'static str,
        unit: Unit,
        accepts: Accepts,
        default: Option<Value>,
        is_structural: bool,
        summary: &'static str,
        field: &mut dyn FnMut(Access<'_>),
    ) {
        let mine = self.index;
        self.index = self.index.saturating_add(1);
        match &mut self.request {
            Request::Defaults => {
                if let Some(value) = default {
                    field(Access::Set(None, value));
                }
            }
            Request::Describe { index, found } if *index == mine => {
                **found = Some(Parameter { name, unit, accepts, default, is_structural, summary });
            }
            Request::Get { index, axis, found } if *index == mine => field(Access::Get(*axis, found)),
            Request::Set { index, axis, value, may_restructure, result } if *index == mine => {
                **result = accepts.admit(*value, *axis);
                if is_structural && !*may_restructure {
                    **result = Err(ParameterError::WhilePluggedIn);
                }
                if result.is_ok() {
                    field(Access::Set(*axis, *value));
                }
            }
            Request::Changed { dof, skip, found } => {
                let Some(default) = default else { return };
                let mut value_of = |axis| {
                    let mut found = None;
                    field(Access::Get(axis, &mut found));
                    found.unwrap_or(default)
                };
                let first = value_of(0);
                let is_per_axis = matches!(accepts, Accepts::Real { per_axis: true, .. });
                let is_uniform = !is_per_axis || (1..*dof).all(|axis| value_of(axis).is_same(first));
                for axis in 0..if is_uniform { 1 } else { *dof } {
                    let value = value_of(axis);
                    if !value.is_same(default) {
                        Change { index: mine, axis: (!is_uniform).then_some(axis), value }.put(skip, found);
                    }
                }
            }
            _ => {}
        }
    }
}

enum Access<'a> {
    Get(u8, &'a mut Option<Value>),
    Set(Option<u8>, Value),
}

impl Change {
    fn put(self, skip: &mut u16, found: &mut Option<Self>) {
        match skip.checked_sub(1) {
            Some(rest) => *skip = rest,
            None => {
                found.get_or_insert(self);
            }
        }
    }
}
