//! The values of a law, each once.

use std::collections::HashMap;

use dimsart_core::online::{OWN_AXIS, Opcode, calculate};

/// Number of a value.
pub(super) type Id = usize;

/// How a value comes about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Value {
    /// Its bits.
    Constant(u32),
    Period,
    /// Of an axis, or [`OWN_AXIS`].
    Input(u8, u8),
    Parameter(u8, u8),
    State(u8),
    Last(u8, u8),
    /// Opcode number and arguments; of fewer than three, the last ones are 0 and mean nothing.
    Of(u8, [Id; 3]),
}

/// All values, in an order in which each comes behind what it is made of.
#[derive(Debug, Default)]
pub(super) struct Values {
    list: Vec<Value>,
    known: HashMap<Value, Id>,
}

impl Values {
    pub(super) fn get(&self, id: Id) -> Option<Value> {
        self.list.get(id).copied()
    }

    /// Each with its number.
    pub(super) fn all(&self) -> impl Iterator<Item = (Id, Value)> {
        self.list.iter().copied().enumerate()
    }

    /// The number of a value, which is there once.
    pub(super) fn add(&mut self, value: Value) -> Id {
        *self.known.entry(value).or_insert_with(|| {
            self.list.push(value);
            self.list.len() - 1
        })
    }

    pub(super) fn number(&mut self, value: f32) -> Id {
        self.add(Value::Constant(value.to_bits()))
    }

    /// What an instruction makes of values; worked out here if they are all constants.
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

    /// What a value is made of.
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

    /// Whether it is the same for all axes whatever parameters and signals are.
    pub(super) fn is_fixed(&self, id: Id) -> bool {
        match self.get(id) {
            Some(Value::Constant(_) | Value::Period) => true,
            Some(Value::Of(..)) => self.arguments(id).into_iter().all(|argument| self.is_fixed(argument)),
            _ => false,
        }
    }

    /// The fewest axes that a device must have.
    pub(super) fn axes(&self) -> u8 {
        let axes = self.list.iter().filter_map(|value| match value {
            Value::Input(_, axis) | Value::Parameter(_, axis) | Value::Last(_, axis) if *axis != OWN_AXIS => {
                Some(axis + 1)
            }
            _ => None,
        });
        axes.max().unwrap_or(0)
    }
}
