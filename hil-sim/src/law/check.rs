//! Resolves the names of a law and checks its declarations and assignments.

use dimsart_core::online::{LawParameter, MAX_INPUTS, MAX_OUTPUTS, MAX_PARAMETERS, MAX_STATES};
use dimsart_core::{DataType, Format, Shape, TypeRef, Unit, names, types};
use serde::Deserialize as _;
use serde::de::IntoDeserializer as _;
use serde::de::value::{Error, StrDeserializer};

use super::error::Problem;
use super::syntax::{Axis, Expression, FUNCTIONS, Number, Statement, Word};
use super::{LawPort, NamedParameter};
use crate::schemes::most_similar;

/// A law with valid declarations.
#[derive(Debug)]
pub(super) struct Checked<'s> {
    pub(super) name: Word,
    pub(super) summary: String,
    pub(super) inputs: Vec<LawPort>,
    pub(super) outputs: Vec<LawPort>,
    pub(super) parameters: Vec<NamedParameter>,
    pub(super) states: Vec<State<'s>>,
    /// Statements computed in each tick, in order.
    pub(super) body: Vec<&'s Statement>,
    /// Number of axes, if outputs are assigned axis by axis; `None` if the same law applies to every axis.
    pub(super) coupled_axes: Option<u8>,
}

#[derive(Debug)]
pub(super) struct State<'s> {
    pub(super) name: &'s Word,
    pub(super) first: &'s Expression,
}

/// Kind of a declared name, and its index among the names of this kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Declared {
    Input(u8),
    Output(u8),
    Parameter(u8),
    State(u8),
}

impl Checked<'_> {
    pub(super) fn declared(&self, name: &str) -> Option<Declared> {
        fn place<'n>(mut names: impl Iterator<Item = &'n str>, name: &str) -> Option<u8> {
            names.position(|found| found == name).and_then(|place| u8::try_from(place).ok())
        }
        let input = place(self.inputs.iter().map(|port| port.name.as_str()), name).map(Declared::Input);
        let output = || place(self.outputs.iter().map(|port| port.name.as_str()), name).map(Declared::Output);
        let parameter =
            || place(self.parameters.iter().map(|found| found.name.as_str()), name).map(Declared::Parameter);
        let state =
            || place(self.states.iter().map(|found| found.name.text.as_str()), name).map(Declared::State);
        input.or_else(output).or_else(parameter).or_else(state)
    }

    /// Suggests the most similar name.
    pub(super) fn advice(&self, name: &str, lets: impl Iterator<Item = String>) -> String {
        let mut known: Vec<String> =
            self.inputs.iter().chain(&self.outputs).map(|port| port.name.clone()).collect();
        known.extend(self.parameters.iter().map(|found| found.name.clone()));
        known.extend(self.states.iter().map(|found| found.name.text.clone()));
        known.extend(lets);
        advice(
            name,
            known.iter().map(String::as_str),
            "declare the name first with `in`, `param`, `state` or `let`",
        )
    }

    fn declare(&self, name: &Word) -> Result<(), Problem> {
        let is_function = FUNCTIONS.iter().any(|(function, ..)| *function == name.text);
        if is_function || self.declared(&name.text).is_some() {
            let message = format!("duplicate name `{}`", name.text);
            return Err(Problem::new(name.span.clone(), message, "choose another name"));
        }
        Ok(())
    }
}

pub(super) fn check<'s>(statements: &'s [Statement], text: &str) -> Result<Checked<'s>, Problem> {
    let Some((Statement::Law { name, summary }, rest)) = statements.split_first() else {
        let help = "start the text with `law NAME \"Description.\"`";
        return Err(Problem::new(0..0, "missing law name", help));
    };
    let mut law = Checked {
        name: name.clone(),
        summary: summary.clone(),
        inputs: Vec::new(),
        outputs: Vec::new(),
        parameters: Vec::new(),
        states: Vec::new(),
        body: Vec::new(),
        coupled_axes: None,
    };
    for statement in rest {
        match statement {
            Statement::Law { name, .. } => {
                let help = "write one law per file, with `law` in its first line";
                return Err(Problem::new(name.span.clone(), "second law in the same file", help));
            }
            Statement::Port { name, is_output, signal } => port(&mut law, name, *is_output, signal)?,
            Statement::Parameter { name, .. } => {
                law.declare(name)?;
                room(name, law.parameters.len(), MAX_PARAMETERS, "parameters")?;
                law.parameters.push(parameter(statement)?);
            }
            Statement::State { name, first } => {
                law.declare(name)?;
                room(name, law.states.len(), MAX_STATES, "states")?;
                law.states.push(State { name, first });
            }
            Statement::Let { name, .. } => {
                law.declare(name)?;
                law.body.push(statement);
            }
            Statement::Assign { .. } => law.body.push(statement),
        }
    }
    assignments(&mut law, text)?;
    Ok(law)
}

fn room(name: &Word, count: usize, most: usize, what: &str) -> Result<(), Problem> {
    if count < most {
        return Ok(());
    }
    let message = format!("more than {most} {what}");
    Err(Problem::new(name.span.clone(), message, "remove a declaration, or split this law in two"))
}

fn port(law: &mut Checked<'_>, name: &Word, is_output: bool, signal: &Word) -> Result<(), Problem> {
    law.declare(name)?;
    let found = data_type(signal)?;
    let all = law.inputs.iter().chain(&law.outputs);
    if let Some(other) = all.into_iter().find(|port| port.signal == found) {
        let message = format!("signal already bound to `{}`", other.name);
        let help =
            format!("use `{}`, or choose another signal of this type, such as {}.2", other.name, signal.text);
        return Err(Problem::new(signal.span.clone(), message, help));
    }
    let (ports, most, what) = if is_output {
        (&mut law.outputs, MAX_OUTPUTS, "outputs")
    } else {
        (&mut law.inputs, MAX_INPUTS, "inputs")
    };
    room(name, ports.len(), most, what)?;
    ports.push(LawPort { name: name.text.clone(), signal: found });
    Ok(())
}

fn data_type(signal: &Word) -> Result<TypeRef, Problem> {
    let takes = |found: &&DataType| found.format == Format::F32 && found.shape == Shape::Vector;
    let found =
        names::split(&signal.text).and_then(|(name, number)| Some((types::find_by_name(name)?, number)));
    let Some((found, number)) = found else {
        let known = types::ALL.iter().filter(takes).map(|found| found.name);
        let help = advice(&signal.text, known, "`dimsart modules` lists the data types");
        return Err(Problem::new(signal.span.clone(), format!("unknown data type {}", signal.text), help));
    };
    if !takes(&found) {
        let message = format!("{} is not a vector with one real number per axis", found.name);
        return Err(Problem::new(
            signal.span.clone(),
            message,
            "laws can only read and write vectors of real \
        numbers",
        ));
    }
    Ok(TypeRef { id: found.id, number })
}

fn parameter(statement: &Statement) -> Result<NamedParameter, Problem> {
    let Statement::Parameter { name, unit, default, range, summary } = statement else {
        return Err(Problem::new(0..0, "not a parameter", ""));
    };
    let unit = match unit {
        None => Unit::One,
        Some(word) => {
            let name: StrDeserializer<'_, Error> = word.text.as_str().into_deserializer();
            Unit::deserialize(name).map_err(|_| {
                let known = UNITS.iter().copied();
                let help = advice(&word.text, known, &format!("units are {}", UNITS.join(", ")));
                Problem::new(word.span.clone(), format!("unknown unit {}", word.text), help)
            })?
        }
    };
    let [min, max] = match range {
        None => [f32::MIN, f32::MAX],
        Some([Number { value: min, .. }, Number { value: max, span }]) => {
            if max < min {
                let help = "write the minimum first";
                return Err(Problem::new(
                    span.clone(),
                    "invalid range: the minimum is above the maximum",
                    help,
                ));
            }
            [*min, *max]
        }
    };
    let value = default.value;
    if !(min..=max).contains(&value) {
        let message = format!("default {value} is outside the range {min} to {max}");
        return Err(Problem::new(default.span.clone(), message, "change the range or the default"));
    }
    let parameter = LawParameter { unit, min, max, default: value };
    Ok(NamedParameter { name: name.text.clone(), parameter, summary: summary.clone() })
}

/// Names of [`Unit`].
const UNITS: [&str; 15] = [
    "One",
    "Position",
    "Velocity",
    "Force",
    "Stiffness",
    "Damping",
    "IntegralGain",
    "Wave",
    "Energy",
    "Second",
    "Hertz",
    "Tick",
    "Ampere",
    "Volt",
    "Celsius",
];

/// Checks that every output of every axis is assigned once and each state at most once.
fn assignments(law: &mut Checked<'_>, text: &str) -> Result<(), Problem> {
    let mut seen: Vec<(Declared, Option<u8>)> = Vec::new();
    for statement in &law.body {
        let Statement::Assign { name, axis, .. } = statement else { continue };
        let declared = match law.declared(&name.text) {
            Some(declared @ (Declared::Output(_) | Declared::State(_))) => declared,
            Some(_) => {
                let message = format!("cannot assign to `{}`", name.text);
                return Err(Problem::new(
                    name.span.clone(),
                    message,
                    "assign only to outputs and states; use `let` for an intermediate value",
                ));
            }
            None => {
                let help = law.advice(&name.text, std::iter::empty());
                let help = format!("{help}; for a new value, write `let {} = ...`", name.text);
                return Err(Problem::new(name.span.clone(), format!("unknown name `{}`", name.text), help));
            }
        };
        if let (Declared::State(_), Some(Axis { span, .. })) = (declared, axis) {
            let help = "write the name without an index: each axis has its own state";
            return Err(Problem::new(span.clone(), "a state has no axis index", help));
        }
        let axis = axis.as_ref().map(|axis| axis.number);
        if seen.contains(&(declared, axis)) {
            let message = format!("`{}` is assigned twice", name.text);
            return Err(Problem::new(
                name.span.clone(),
                message,
                "keep one assignment; use `let` for intermediate values",
            ));
        }
        seen.push((declared, axis));
    }
    let end = text.trim_end().len();
    if law.outputs.is_empty() {
        let help = "declare an output, such as `out force: DES_FORCE`";
        return Err(Problem::new(end..end, "missing output", help));
    }
    let of_axes = seen.iter().filter_map(|(declared, axis)| axis.map(|axis| (*declared, axis)));
    law.coupled_axes = of_axes.map(|(_, axis)| axis + 1).max();
    for (number, output) in (0..).zip(&law.outputs) {
        let missing = match law.coupled_axes {
            None if seen.contains(&(Declared::Output(number), None)) => None,
            None => Some(output.name.clone()),
            Some(axes) => (0..axes)
                .find(|axis| !seen.contains(&(Declared::Output(number), Some(*axis))))
                .map(|axis| format!("{}[{axis}]", output.name)),
        };
        if let Some(missing) = missing {
            let help = format!("add a line `{missing} = ...`");
            return Err(Problem::new(end..end, format!("`{missing}` is not assigned"), help));
        }
        if law.coupled_axes.is_some() && seen.contains(&(Declared::Output(number), None)) {
            let help =
                format!("add the axis index as in the other assignments, such as `{}[0] = ...`", output.name);
            return Err(Problem::new(
                end..end,
                format!("`{}` is assigned without an axis index", output.name),
                help,
            ));
        }
    }
    Ok(())
}

/// Suggests the known name most similar to a word, or returns `otherwise`.
fn advice<'n>(word: &str, known: impl Iterator<Item = &'n str>, otherwise: &str) -> String {
    let known: Vec<String> = known.map(str::to_owned).collect();
    most_similar(word, &known).map_or_else(|| otherwise.to_owned(), |near| format!("did you mean `{near}`?"))
}
