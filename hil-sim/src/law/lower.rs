//! Converts expressions to values: resolves names and separates conditions from numbers.

use std::collections::HashMap;

use dimsart_core::online::{CURRENT_AXIS, Opcode};

use super::check::{Checked, Declared};
use super::error::Problem;
use super::syntax::{Axis, Binary, Expression, FUNCTIONS, Span, Statement, What, Word};
use super::values::{Id, Value, Values};

/// Values that a law computes.
#[derive(Debug, Default)]
pub(super) struct Lowered {
    pub(super) values: Values,
    /// Initial value of each state.
    pub(super) first: Vec<Id>,
    /// Output, axis and value.
    pub(super) outputs: Vec<(u8, u8, Id)>,
    /// State and value.
    pub(super) states: Vec<(u8, Id)>,
}

/// A value, and whether it is a condition instead of a number.
#[derive(Debug, Clone, Copy)]
struct Typed {
    id: Id,
    is_truth: bool,
}

struct Lowering<'l> {
    law: &'l Checked<'l>,
    values: Values,
    /// Names of `let`, and assigned outputs and states.
    named: HashMap<String, Typed>,
    /// Whether the initial values of states are being converted.
    begins: bool,
}

pub(super) fn lower(law: &Checked<'_>) -> Result<Lowered, Problem> {
    let mut lowering = Lowering { law, values: Values::default(), named: HashMap::new(), begins: true };
    let mut lowered = Lowered::default();
    for state in &law.states {
        lowered.first.push(lowering.number(state.first)?);
    }
    lowering.begins = false;
    for statement in &law.body {
        match statement {
            Statement::Let { name, value } => {
                let typed = lowering.expression(value)?;
                if lowering.named.insert(name.text.clone(), typed).is_some() {
                    let message = format!("duplicate name `{}`", name.text);
                    return Err(Problem::new(name.span.clone(), message, "choose another name"));
                }
            }
            Statement::Assign { name, axis, value } => {
                let id = lowering.number(value)?;
                match law.declared(&name.text) {
                    Some(Declared::Output(output)) => {
                        let axis = axis.as_ref().map_or(CURRENT_AXIS, |axis| axis.number);
                        lowered.outputs.push((output, axis, id));
                        lowering.named.insert(key(&name.text, axis), Typed { id, is_truth: false });
                    }
                    Some(Declared::State(state)) => {
                        lowered.states.push((state, id));
                        lowering.named.insert(name.text.clone(), Typed { id, is_truth: false });
                    }
                    _ => {}
                }
            }
            _ => {}
        }
    }
    lowered.values = lowering.values;
    Ok(lowered)
}

/// Name of an assigned output in `named`.
fn key(name: &str, axis: u8) -> String {
    if axis == CURRENT_AXIS { name.to_owned() } else { format!("{name}[{axis}]") }
}

impl Lowering<'_> {
    fn number(&mut self, expression: &Expression) -> Result<Id, Problem> {
        let typed = self.expression(expression)?;
        if typed.is_truth {
            let help = "write `if ... then 1 else 0` to convert it to a number";
            return Err(Problem::new(expression.span.clone(), "expected a number, found a condition", help));
        }
        Ok(typed.id)
    }

    fn truth(&mut self, expression: &Expression) -> Result<Id, Problem> {
        let typed = self.expression(expression)?;
        if !typed.is_truth {
            let help = "write a comparison, such as `x > 0`";
            return Err(Problem::new(expression.span.clone(), "expected a condition, found a number", help));
        }
        Ok(typed.id)
    }

    fn expression(&mut self, expression: &Expression) -> Result<Typed, Problem> {
        let id = match &expression.what {
            What::Number(value) => self.values.number(*value),
            What::Name { name, axis } => return self.name(name, axis.as_ref()),
            What::Last { output, axis } => self.last(output, axis.as_ref(), &expression.span)?,
            What::Call { function, arguments } => self.call(function, arguments, &expression.span)?,
            What::Negate(value) => {
                let value = self.number(value)?;
                self.values.of(Opcode::Negate, &[value])
            }
            What::Not(value) => {
                let value = self.truth(value)?;
                return Ok(self.not(value));
            }
            What::Binary { operator, sides } => return self.binary(*operator, sides),
            What::If { parts } => {
                let [condition, yes, no] = &**parts;
                let condition = self.truth(condition)?;
                let (yes, no_value) = (self.expression(yes)?, self.expression(no)?);
                if yes.is_truth != no_value.is_truth {
                    let help = "use numbers in both branches, or conditions in both";
                    return Err(Problem::new(no.span.clone(), "the branches of `if` differ in type", help));
                }
                let id = self.values.of(Opcode::Select, &[condition, yes.id, no_value.id]);
                return Ok(Typed { id, is_truth: yes.is_truth });
            }
        };
        Ok(Typed { id, is_truth: false })
    }

    fn not(&mut self, value: Id) -> Typed {
        let one = self.values.number(1.0);
        Typed { id: self.values.of(Opcode::Subtract, &[one, value]), is_truth: true }
    }

    fn binary(&mut self, operator: Binary, [left, right]: &[Expression; 2]) -> Result<Typed, Problem> {
        let opcode = match operator {
            Binary::And => Opcode::Minimum,
            Binary::Or => Opcode::Maximum,
            Binary::Add => Opcode::Add,
            Binary::Subtract => Opcode::Subtract,
            Binary::Multiply => Opcode::Multiply,
            Binary::Divide => Opcode::Divide,
            Binary::Less | Binary::Greater => Opcode::Less,
            Binary::LessOrEqual | Binary::GreaterOrEqual => Opcode::LessOrEqual,
            Binary::Equal | Binary::NotEqual => Opcode::Equal,
        };
        let (left, right) = match operator {
            Binary::And | Binary::Or => (self.truth(left)?, self.truth(right)?),
            _ => (self.number(left)?, self.number(right)?),
        };
        let is_turned = matches!(operator, Binary::Greater | Binary::GreaterOrEqual);
        let sides = if is_turned { [right, left] } else { [left, right] };
        let id = self.values.of(opcode, &sides);
        let is_number =
            matches!(operator, Binary::Add | Binary::Subtract | Binary::Multiply | Binary::Divide);
        Ok(if operator == Binary::NotEqual { self.not(id) } else { Typed { id, is_truth: !is_number } })
    }

    fn call(&mut self, function: &Word, arguments: &[Expression], span: &Span) -> Result<Id, Problem> {
        let found = FUNCTIONS.iter().find(|(name, ..)| *name == function.text);
        let Some((name, opcode, count)) = found else {
            let all: Vec<&str> = FUNCTIONS.iter().map(|(name, ..)| *name).collect();
            let help = format!("available functions: {} and last", all.join(", "));
            return Err(Problem::new(
                function.span.clone(),
                format!("unknown function `{}`", function.text),
                help,
            ));
        };
        if arguments.len() != *count {
            let message = format!("`{name}` expects {count} argument(s), found {}", arguments.len());
            let help = match *name {
                "atan2" => "write `atan2(y, x)`".to_owned(),
                "clamp" => "write `clamp(value, min, max)`".to_owned(),
                name if *count == 2 => format!("write `{name}(a, b)`"),
                name => format!("write `{name}(x)`"),
            };
            return Err(Problem::new(span.clone(), message, help));
        }
        let mut ids = Vec::new();
        for argument in arguments {
            ids.push(self.number(argument)?);
        }
        Ok(self.values.of(*opcode, &ids))
    }

    fn last(&mut self, output: &Word, axis: Option<&Axis>, span: &Span) -> Result<Id, Problem> {
        if !self.begins {
            let help = "use `last` only as a state's initial value: `state force_before = last(force)`";
            return Err(Problem::new(span.clone(), "`last` is available only when the law starts", help));
        }
        let Some(Declared::Output(number)) = self.law.declared(&output.text) else {
            let message = format!("`{}` is not an output", output.text);
            return Err(Problem::new(
                output.span.clone(),
                message,
                "write the name of an output, such as `last(force)`",
            ));
        };
        let axis = self.axis(output, axis)?;
        Ok(self.values.add(Value::Last(number, axis)))
    }

    /// Axis of a name; without an index, the axis being computed.
    fn axis(&self, name: &Word, axis: Option<&Axis>) -> Result<u8, Problem> {
        match (axis, self.law.coupled_axes) {
            (None, None) => Ok(CURRENT_AXIS),
            (None, Some(_)) => {
                let message = format!("missing axis index of `{}`", name.text);
                let help = format!("this law assigns its outputs axis by axis: write `{}[0]`", name.text);
                Err(Problem::new(name.span.clone(), message, help))
            }
            (Some(axis), Some(axes)) if axis.number >= axes => {
                let help = format!("this law assigns outputs of axes 0 to {}", axes - 1);
                let message = format!("axis {} is out of range", axis.number);
                Err(Problem::new(axis.span.clone(), message, help))
            }
            (Some(axis), _) => Ok(axis.number),
        }
    }

    fn name(&mut self, name: &Word, axis: Option<&Axis>) -> Result<Typed, Problem> {
        let is_number = |id| Ok(Typed { id, is_truth: false });
        let without_axis = |found| match axis {
            None => Ok(found),
            Some(axis) => {
                let message = format!("`{}` has no axis index", name.text);
                Err(Problem::new(axis.span.clone(), message, "write the name without an index"))
            }
        };
        match name.text.as_str() {
            "pi" => {
                return without_axis(Typed {
                    id: self.values.number(core::f32::consts::PI),
                    is_truth: false,
                });
            }
            "period" => return without_axis(Typed { id: self.values.add(Value::Period), is_truth: false }),
            _ => {}
        }
        match self.law.declared(&name.text) {
            Some(Declared::Input(number)) => {
                let axis = self.axis(name, axis)?;
                is_number(self.values.add(Value::Input(number, axis)))
            }
            // Coupled axes share one value of a parameter unless an index is written.
            Some(Declared::Parameter(number)) if axis.is_none() && self.law.coupled_axes.is_some() => {
                is_number(self.values.add(Value::Parameter(number, 0)))
            }
            Some(Declared::Parameter(number)) => {
                let axis = self.axis(name, axis)?;
                is_number(self.values.add(Value::Parameter(number, axis)))
            }
            Some(Declared::State(_)) if self.begins => {
                let help = "initialise a state from inputs, parameters and numbers";
                Err(Problem::new(name.span.clone(), format!("`{}` is not initialised yet", name.text), help))
            }
            Some(Declared::State(number)) => {
                let found = self.named.get(&name.text).copied();
                let found = found
                    .unwrap_or_else(|| Typed { id: self.values.add(Value::State(number)), is_truth: false });
                without_axis(found)
            }
            Some(Declared::Output(_)) => {
                let axis = self.axis(name, axis)?;
                let found = self.named.get(&key(&name.text, axis)).copied();
                found.ok_or_else(|| {
                    let message = format!("`{}` is read before it is assigned", key(&name.text, axis));
                    Problem::new(
                        name.span.clone(),
                        message,
                        "assign the value before this line, or use a `state`",
                    )
                })
            }
            None => match self.named.get(&name.text).copied() {
                Some(found) => without_axis(found),
                None => {
                    let help = self.law.advice(&name.text, self.named.keys().cloned());
                    Err(Problem::new(name.span.clone(), format!("unknown name `{}`", name.text), help))
                }
            },
        }
    }
}
