//! Deduplicated values of a law.

use std::collections::HashMap;

use dimsart_core::online::{CURRENT_AXIS, Opcode, calculate};

/// Index of a value.
pub(super) type Id = usize;

/// Source of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Value {
    /// Its bits.
    Constant(u32),
    Period,
    /// Input and axis, or [`CURRENT_AXIS`].
    Input(u8, u8),
    Parameter(u8, u8),
    State(u8),
    Last(u8, u8),
    /// Opcode and arguments; unused arguments are 0.
    Of(u8, [Id; 3]),
}

/// All values, each after its arguments.
#[derive(Debug, Default)]
pub(super) struct Values {
    list: Vec<Value>,
    known: HashMap<Value, Id>,
}

impl Values {
    pub(super) fn get(&self, id: Id) -> Option<Value> {
        self.list.get(id).copied()
    }

    /// Returns all values with their indices.
    pub(super) fn all(&self) -> impl Iterator<Item = (Id, Value)> {
        self.list.iter().copied().enumerate()
    }

    /// Returns the index of a value and adds it if new.
    pub(super) fn add(&mut self, value: Value) -> Id {
        *self.known.entry(value).or_insert_with(|| {
            self.list.push(value);
            self.list.len() - 1
        })
    }

    pub(super) fn number(&mut self, value: f32) -> Id {
        self.add(Value::Constant(value.to_bits()))
    }

    /// Adds the result of an instruction; constants are folded.
    pub(super) fn of(&mut self, opcode: Opcode, arguments: &[Id]) -> Id {
        let constant = |id: &Id| match self.get(*id) {
            Some(Value::Constant(bits)) => Some(f32::from_bits(bits)),
            _ => None,
        };
        let constants: Option<Vec<f32>> = arguments.iter().map(constant).collect();
        let known =
            constants.and_then(|constants| calculate(opcode, &constants)).filter(|value| value.is_finite());
        if let Some(known) = known {
            return self.number(known);
        }
        let mut of = [0; 3];
        of.iter_mut().zip(arguments).for_each(|(place, argument)| *place = *argument);
        self.add(Value::Of(opcode as u8, of))
    }

    /// Returns the arguments of a value.
    pub(super) fn arguments(&self, id: Id) -> Vec<Id> {
        match self.get(id) {
            Some(Value::Of(number, arguments)) => {
                let count =
                    Opcode::ALL.get(usize::from(number)).map_or(0, |opcode| opcode.fields().len() - 1);
                arguments.into_iter().take(count).collect()
            }
            _ => Vec::new(),
        }
    }

    /// Whether it is equal for all axes, independent of parameters and signals.
    pub(super) fn is_fixed(&self, id: Id) -> bool {
        match self.get(id) {
            Some(Value::Constant(_) | Value::Period) => true,
            Some(Value::Of(..)) => self.arguments(id).into_iter().all(|argument| self.is_fixed(argument)),
            _ => false,
        }
    }

    /// Minimum number of axes of a device.
    pub(super) fn axes(&self) -> u8 {
        let axes = self.list.iter().filter_map(|value| match value {
            Value::Input(_, axis) | Value::Parameter(_, axis) | Value::Last(_, axis)
                if *axis != CURRENT_AXIS =>
            {
                Some(axis + 1)
            }
            _ => None,
        });
        axes.max().unwrap_or(0)
    }
}
