//! Visitor of a module's parameters: one list of calls serves every operation on parameters.

mod entries;

use core::ops::RangeInclusive;
use core::slice::from_mut;

use super::{Choice, Parameter, ParameterError, ParameterShape, ParameterType, TypeList, Value};
use crate::online::LawParameter;
use crate::signal::{Summary, Unit};

/// Visits a module's parameters, one call per parameter; see the [module docs](super).
#[derive(Debug)]
pub struct Parameters<'a> {
    request: Request<'a>,
    index: u8,
    /// Description of the requested parameter by the module's program, if it has one.
    of_program: Option<LawParameter>,
}

/// A parameter and its value; no value if a list has no such entry.
pub(crate) type Found = (Parameter, Option<Value>);

#[derive(Debug)]
enum Request<'a> {
    Defaults,
    Get { index: u8, entry: Option<u8>, found: &'a mut Option<Found> },
    Set(Set<'a>),
}

#[derive(Debug)]
struct Set<'a> {
    index: u8,
    element: Option<u8>,
    value: Value,
    may_restructure: bool,
    result: &'a mut Result<(), ParameterError>,
}

// Not inlined and not generic, so that each line of a parameter list compiles to one call.
impl<'a> Parameters<'a> {
    /// Creates a visitor that sets every parameter to its default.
    #[must_use]
    pub(crate) fn defaults() -> Self {
        Self::new(Request::Defaults)
    }

    /// Creates a visitor that reads parameter `index` and its value into `found`: of a list entry `entry`, or
    /// the last entry; of several values entry `entry`, or the first.
    pub(crate) fn get(index: u8, entry: Option<u8>, found: &'a mut Option<Found>) -> Self {
        Self::new(Request::Get { index, entry, found })
    }

    /// Creates a visitor that sets parameter `index`: entry `entry`, or all entries. `result` starts as
    /// [`ParameterError::Unknown`] and receives the outcome.
    pub(crate) fn set(
        index: u8,
        element: Option<u8>,
        value: Value,
        may_restructure: bool,
        result: &'a mut Result<(), ParameterError>,
    ) -> Self {
        *result = Err(ParameterError::Unknown);
        Self::new(Request::Set(Set { index, element, value, may_restructure, result }))
    }

    /// Returns the number of the requested parameter; none if all are visited.
    pub(crate) fn asked(&self) -> Option<u8> {
        match &self.request {
            Request::Defaults => None,
            Request::Get { index, .. } | Request::Set(Set { index, .. }) => Some(*index),
        }
    }

    /// Sets the description of the requested parameter by the module's program.
    pub(crate) fn set_law_description(&mut self, found: Option<LawParameter>) {
        self.of_program = found;
    }

    /// Declares a real number per axis, whose range and default the program defines.
    #[inline(never)]
    pub fn of_program(&mut self, field: &mut f32, name: &'static str, summary: &'static str) {
        const UNKNOWN: LawParameter =
            LawParameter { unit: Unit::Any, min: f32::MIN, max: f32::MAX, default: 0.0 };
        let LawParameter { unit, min, max, default } = self.of_program.unwrap_or(UNKNOWN);
        let (field, summary) = (from_mut(field), Summary::new(summary));
        self.elements(field, name, unit, (min, max), default, ParameterShape::AXES, summary);
    }

    fn new(request: Request<'a>) -> Self {
        Self { request, index: 0, of_program: None }
    }

    /// Returns whether a value has changed and the new set of values is valid, so that it is kept.
    pub(crate) fn admits_change(&mut self, validity: Result<(), ParameterError>) -> bool {
        match &mut self.request {
            Request::Defaults => true,
            Request::Set(Set { result, .. }) if result.is_ok() => {
                **result = validity;
                validity.is_ok()
            }
            _ => false,
        }
    }

    /// Declares a real number for all axes.
    #[inline(always)]
    pub fn real(
        &mut self,
        field: &mut f32,
        name: &'static str,
        unit: Unit,
        range: RangeInclusive<f32>,
        default: f32,
        summary: &'static str,
    ) {
        let (field, range, summary) = (from_mut(field), range.into_inner(), Summary::new(summary));
        self.elements(field, name, unit, range, default, ParameterShape::ONE, summary);
    }

    /// Declares a real number per axis, such as a gain.
    #[inline(always)]
    pub fn per_axis(
        &mut self,
        field: &mut f32,
        name: &'static str,
        unit: Unit,
        range: RangeInclusive<f32>,
        default: f32,
        summary: &'static str,
    ) {
        let (field, range, summary) = (from_mut(field), range.into_inner(), Summary::new(summary));
        self.elements(field, name, unit, range, default, ParameterShape::AXES, summary);
    }

    /// Declares a whole number that can be changed at any time.
    #[inline(always)]
    pub fn count(
        &mut self,
        field: &mut u32,
        name: &'static str,
        unit: Unit,
        range: RangeInclusive<u32>,
        default: u32,
        summary: &'static str,
    ) {
        self.whole(
            field,
            name,
            unit,
            range.into_inner(),
            default,
            ParameterShape::ONE,
            false,
            Summary::new(summary),
        );
    }

    /// Declares a whole number that sets the size of the module's memory.
    #[inline(always)]
    pub fn structural_count(
        &mut self,
        field: &mut u32,
        name: &'static str,
        unit: Unit,
        range: RangeInclusive<u32>,
        default: u32,
        summary: &'static str,
    ) {
        self.whole(
            field,
            name,
            unit,
            range.into_inner(),
            default,
            ParameterShape::ONE,
            true,
            Summary::new(summary),
        );
    }

    /// Declares a switch that can be changed at any time.
    #[inline(always)]
    pub fn flag(&mut self, field: &mut bool, name: &'static str, default: bool, summary: &'static str) {
        self.switch(field, name, default, ParameterShape::ONE, false, Summary::new(summary));
    }

    /// Declares a switch that changes the module's ports.
    #[inline(always)]
    pub fn structural_flag(
        &mut self,
        field: &mut bool,
        name: &'static str,
        default: bool,
        summary: &'static str,
    ) {
        self.switch(field, name, default, ParameterShape::ONE, true, Summary::new(summary));
    }

    /// Declares a choice that can be changed at any time.
    #[inline(always)]
    pub fn choice<C: Choice>(&mut self, field: &mut C, name: &'static str, summary: &'static str) {
        let index =
            self.named(field.index(), C::NAMES, name, ParameterShape::ONE, false, Summary::new(summary));
        *field = C::from_index(index);
    }

    /// Declares a choice that changes the module's ports.
    #[inline(always)]
    pub fn structural_choice<C: Choice>(&mut self, field: &mut C, name: &'static str, summary: &'static str) {
        let index =
            self.named(field.index(), C::NAMES, name, ParameterShape::ONE, true, Summary::new(summary));
        *field = C::from_index(index);
    }

    /// Declares a list of data types; each command appends one.
    #[inline(always)]
    pub fn types(&mut self, field: &mut TypeList, name: &'static str, summary: &'static str) {
        self.type_list(field, name, Summary::new(summary));
    }

    #[inline(never)]
    fn type_list(&mut self, field: &mut TypeList, name: &'static str, summary: Summary) {
        if !self.is_asked() {
            return;
        }
        if matches!(self.request, Request::Defaults) {
            *field = TypeList::default();
        }
        let last = match self.request {
            Request::Get { entry: Some(entry), .. } => field.get(usize::from(entry)),
            _ => field.last(),
        };
        let (unit, accepts, entries) = (Unit::Any, ParameterType::Types, ParameterShape::ONE);
        let parameter =
            Parameter { name, unit, accepts, entries, default: None, is_structural: true, summary };
        if let Some(Value::Type(signal)) = self.answer(&parameter, last.copied().map(Value::Type))
            && field.push(signal).is_err()
            && let Request::Set(Set { result, .. }) = &mut self.request
        {
            **result = Err(ParameterError::ListFull);
        }
    }

    #[expect(clippy::too_many_arguments, reason = "one line of a parameter list, never called elsewhere")]
    #[inline(never)]
    fn whole(
        &mut self,
        field: &mut u32,
        name: &'static str,
        unit: Unit,
        (min, max): (u32, u32),
        default: u32,
        entries: ParameterShape,
        is_structural: bool,
        summary: Summary,
    ) {
        if !self.is_asked() {
            return;
        }
        let (accepts, default) = (ParameterType::Count { min, max }, Some(Value::Count(default)));
        let parameter = Parameter { name, unit, accepts, entries, default, is_structural, summary };
        if let Some(Value::Count(value)) = self.answer(&parameter, Some(Value::Count(*field))) {
            *field = value;
        }
    }

    #[inline(never)]
    fn switch(
        &mut self,
        field: &mut bool,
        name: &'static str,
        default: bool,
        entries: ParameterShape,
        is_structural: bool,
        summary: Summary,
    ) {
        if !self.is_asked() {
            return;
        }
        let (unit, accepts, default) = (Unit::One, ParameterType::Flag, Some(Value::Flag(default)));
        let parameter = Parameter { name, unit, accepts, entries, default, is_structural, summary };
        if let Some(Value::Flag(value)) = self.answer(&parameter, Some(Value::Flag(*field))) {
            *field = value;
        }
    }

    #[inline(never)]
    fn named(
        &mut self,
        index: u32,
        names: &'static [&'static str],
        name: &'static str,
        entries: ParameterShape,
        is_structural: bool,
        summary: Summary,
    ) -> u32 {
        if !self.is_asked() {
            return index;
        }
        let (unit, accepts, default) = (Unit::One, ParameterType::Choice(names), Some(Value::Choice(0)));
        let parameter = Parameter { name, unit, accepts, entries, default, is_structural, summary };
        match self.answer(&parameter, Some(Value::Choice(u8::try_from(index).unwrap_or(0)))) {
            Some(Value::Choice(index)) => index.into(),
            _ => index,
        }
    }

    /// Advances to the next parameter; returns whether it is requested. In a visit most parameters are not.
    fn is_asked(&mut self) -> bool {
        let mine = self.index;
        self.index = self.index.saturating_add(1);
        match &self.request {
            Request::Defaults => true,
            Request::Get { index, .. } | Request::Set(Set { index, .. }) => *index == mine,
        }
    }

    /// Handles the requested parameter; returns its new value if it is to change.
    fn answer(&mut self, parameter: &Parameter, value: Option<Value>) -> Option<Value> {
        match &mut self.request {
            Request::Defaults => return parameter.default,
            Request::Get { found, .. } => **found = Some((*parameter, value)),
            Request::Set(set) => {
                *set.result = parameter.accepts.admit(set.value);
                if parameter.is_structural && !set.may_restructure {
                    *set.result = Err(ParameterError::WhilePluggedIn);
                }
                if set.result.is_ok() {
                    return Some(set.value);
                }
            }
        }
        None
    }
}
