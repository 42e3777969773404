//! The visit of a module's parameters: one list of calls, asked in turn for everything a parameter is for.

mod entries;

use core::ops::RangeInclusive;
use core::slice::from_mut;

use super::{Accepts, Choice, Entries, Parameter, ParameterError, TypeList, Value};
use crate::online::LawParameter;
use crate::signal::{Summary, Unit};

/// Visits a module's parameters, one call per parameter; see the [module docs](super).
#[derive(Debug)]
pub struct Parameters<'a> {
    request: Request<'a>,
    index: u8,
    /// What the program of the module says of the parameter that is asked, if it runs one and that has it.
    of_program: Option<LawParameter>,
}

/// A parameter and its value; of a list that has no such entry, none.
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

// A call and no more for each line of a parameter list: nothing of it is inlined or generic.
impl<'a> Parameters<'a> {
    /// Sets every parameter to its default.
    #[must_use]
    pub(crate) fn defaults() -> Self {
        Self::new(Request::Defaults)
    }

    /// Fills `found` with parameter `index` and its value; of a list with entry `entry`, or the last one, of several
    /// elements with that one, or the first.
    pub(crate) fn get(index: u8, entry: Option<u8>, found: &'a mut Option<Found>) -> Self {
        Self::new(Request::Get { index, entry, found })
    }

    /// Sets parameter `index`; one that has several elements, without one of them, all. `result` starts as
    /// [`ParameterError::Unknown`] and says how it went.
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

    /// Number of the parameter that is asked; none where it is all of them.
    pub(crate) fn asked(&self) -> Option<u8> {
        match &self.request {
            Request::Defaults => None,
            Request::Get { index, .. } | Request::Set(Set { index, .. }) => Some(*index),
        }
    }

    /// What the module's program says of the parameter that is asked.
    pub(crate) fn say_of_program(&mut self, found: Option<LawParameter>) {
        self.of_program = found;
    }

    /// A real number per axis whose range and default are the program's.
    #[inline(never)]
    pub fn of_program(&mut self, field: &mut f32, name: &'static str, summary: &'static str) {
        const UNKNOWN: LawParameter =
            LawParameter { unit: Unit::Any, min: f32::MIN, max: f32::MAX, default: 0.0 };
        let LawParameter { unit, min, max, default } = self.of_program.unwrap_or(UNKNOWN);
        let (field, summary) = (from_mut(field), Summary::new(summary));
        self.elements(field, name, unit, (min, max), default, Entries::AXES, summary);
    }

    fn new(request: Request<'a>) -> Self {
        Self { request, index: 0, of_program: None }
    }

    /// Whether what was visited has changed and is to be kept, which takes parameters that fit together.
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

    /// A real number, the same for all axes.
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
        self.elements(field, name, unit, range, default, Entries::ONE, summary);
    }

    /// A real number per axis, such as a gain: the one of the axis that is visited.
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
        self.elements(field, name, unit, range, default, Entries::AXES, summary);
    }

    /// A whole number that can be changed at any time.
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
            Entries::ONE,
            false,
            Summary::new(summary),
        );
    }

    /// A whole number that decides how much memory the module takes when it is plugged in.
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
        self.whole(field, name, unit, range.into_inner(), default, Entries::ONE, true, Summary::new(summary));
    }

    /// A switch that can be changed at any time.
    #[inline(always)]
    pub fn flag(&mut self, field: &mut bool, name: &'static str, default: bool, summary: &'static str) {
        self.switch(field, name, default, Entries::ONE, false, Summary::new(summary));
    }

    /// A switch that decides which ports the module has.
    #[inline(always)]
    pub fn structural_flag(
        &mut self,
        field: &mut bool,
        name: &'static str,
        default: bool,
        summary: &'static str,
    ) {
        self.switch(field, name, default, Entries::ONE, true, Summary::new(summary));
    }

    /// One of a set of names, changeable at any time.
    #[inline(always)]
    pub fn choice<C: Choice>(&mut self, field: &mut C, name: &'static str, summary: &'static str) {
        let index = self.named(field.index(), C::NAMES, name, Entries::ONE, false, Summary::new(summary));
        *field = C::from_index(index);
    }

    /// One of a set of names that decides which ports the module has.
    #[inline(always)]
    pub fn structural_choice<C: Choice>(&mut self, field: &mut C, name: &'static str, summary: &'static str) {
        let index = self.named(field.index(), C::NAMES, name, Entries::ONE, true, Summary::new(summary));
        *field = C::from_index(index);
    }

    /// A list of data types; each command adds one.
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
        let (unit, accepts, entries) = (Unit::Any, Accepts::Types, Entries::ONE);
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
        entries: Entries,
        is_structural: bool,
        summary: Summary,
    ) {
        if !self.is_asked() {
            return;
        }
        let (accepts, default) = (Accepts::Count { min, max }, Some(Value::Count(default)));
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
        entries: Entries,
        is_structural: bool,
        summary: Summary,
    ) {
        if !self.is_asked() {
            return;
        }
        let (unit, accepts, default) = (Unit::One, Accepts::Flag, Some(Value::Flag(default)));
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
        entries: Entries,
        is_structural: bool,
        summary: Summary,
    ) -> u32 {
        if !self.is_asked() {
            return index;
        }
        let (unit, accepts, default) = (Unit::One, Accepts::Choice(names), Some(Value::Choice(0)));
        let parameter = Parameter { name, unit, accepts, entries, default, is_structural, summary };
        match self.answer(&parameter, Some(Value::Choice(u8::try_from(index).unwrap_or(0)))) {
            Some(Value::Choice(index)) => index.into(),
            _ => index,
        }
    }

    /// Goes on to the next parameter; whether anything is asked of this one. Nearly all of a visit is parameters of which
    /// nothing is.
    fn is_asked(&mut self) -> bool {
        let mine = self.index;
        self.index = self.index.saturating_add(1);
        match &self.request {
            Request::Defaults => true,
            Request::Get { index, .. } | Request::Set(Set { index, .. }) => *index == mine,
        }
    }

    /// Answers for the parameter that is asked; gives the value that it is to have, if it is to change.
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
