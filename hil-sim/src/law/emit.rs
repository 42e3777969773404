//! Emits the program of a law: orders values and allocates registers.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use dimsart_core::limits::PROGRAM_WORDS;
use dimsart_core::online::{CURRENT_AXIS, Header, Instruction, Opcode, Program, REGISTER_COUNT, program_crc};

use super::Law;
use super::check::Checked;
use super::error::Problem;
use super::lower::Lowered;
use super::values::{Id, Value, Values};

/// Emits the program of a law.
pub(super) fn emit(law: &Checked<'_>, lowered: &Lowered, text: &str) -> Result<Law, Problem> {
    let compiled = |words| Law {
        name: law.name.text.clone(),
        summary: law.summary.clone(),
        inputs: law.inputs.clone(),
        outputs: law.outputs.clone(),
        parameters: law.parameters.clone(),
        words,
    };
    let end = text.trim_end().len();
    // Values that are equal for all axes are computed once, if registers suffice.
    let there = Registers::there(law, &lowered.values);
    let code = Code::of(lowered, &there, true).or_else(|| Code::of(lowered, &there, false));
    let code = code.ok_or_else(|| {
        let message = format!("more than {REGISTER_COUNT} values in use at the same time");
        Problem::new(end..end, message, "split this law in two")
    })?;
    let names = names(law);
    let text_bytes = u8::try_from(names.len()).map_err(|_| {
        Problem::new(law.name.span.clone(), "names exceed 255 bytes in total", "shorten the longest names")
    })?;
    let counts = |count: usize| u8::try_from(count).unwrap_or(u8::MAX);
    let axes = law.coupled_axes.unwrap_or_else(|| lowered.values.axes());
    let header = Header {
        inputs: counts(law.inputs.len()),
        outputs: counts(law.outputs.len()),
        parameters: counts(law.parameters.len()),
        states: counts(law.states.len()),
        constants: counts(code.constants.len()),
        axes,
        is_coupled: law.coupled_axes.is_some(),
        once: counts(code.once.len()),
        begin: counts(code.begin.len()),
        tick: counts(code.tick.len()),
        text_bytes,
    };
    let mut words = header.to_words().to_vec();
    let ports = law.inputs.iter().chain(&law.outputs);
    words.extend(ports.map(|port| u32::from(port.signal.id) | u32::from(port.signal.number) << 16));
    words.extend(law.parameters.iter().flat_map(|found| found.parameter.to_words()));
    words.extend(&code.constants);
    words
        .extend([&code.once, &code.begin, &code.tick].into_iter().flatten().map(|instruction| instruction.0));
    words.extend(names.as_bytes().chunks(4).map(|bytes| {
        let mut word = [0; 4];
        word.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
        u32::from_le_bytes(word)
    }));
    words.push(program_crc(&words));
    if words.len() > PROGRAM_WORDS {
        let message = format!("program has {} words, maximum {PROGRAM_WORDS}", words.len());
        return Err(Problem::new(end..end, message, "shorten the law or its names, or split it in two"));
    }
    match Program::verify(&words) {
        Ok(_) => Ok(compiled(words)),
        Err(error) => Err(Problem::new(end..end, format!("invalid program: {error}"), "simplify the law")),
    }
}

/// One name per line.
fn names(law: &Checked<'_>) -> String {
    let ports = law.inputs.iter().chain(&law.outputs).map(|port| port.name.as_str());
    let parameters = law.parameters.iter().map(|found| found.name.as_str());
    let all: Vec<&str> = [law.name.text.as_str()].into_iter().chain(ports).chain(parameters).collect();
    all.join("\n")
}

/// Instructions and constants.
#[derive(Debug, Default)]
struct Code {
    constants: Vec<u32>,
    once: Vec<Instruction>,
    begin: Vec<Instruction>,
    tick: Vec<Instruction>,
}

/// Actions with values at the end of a section.
#[derive(Debug, Clone, Copy)]
enum Sink {
    Output(u8, u8),
    State(u8),
}

impl Code {
    /// `None` if registers are insufficient.
    fn of(lowered: &Lowered, there: &Registers, hoists: bool) -> Option<Self> {
        let mut code = Self::default();
        let first =
            (0..).zip(&lowered.first).map(|(state, id)| (Sink::State(state), *id)).collect::<Vec<_>>();
        let outputs = lowered.outputs.iter().map(|(output, axis, id)| (Sink::Output(*output, *axis), *id));
        let states = lowered.states.iter().map(|(state, id)| (Sink::State(*state), *id));
        let tick = outputs.chain(states).collect::<Vec<_>>();
        let mut fixed = there.clone();
        let values = Fused::of(&lowered.values, first.iter().chain(&tick).map(|(_, id)| *id));
        if hoists {
            let roots = values.fixed_roots(first.iter().chain(&tick).map(|(_, id)| *id));
            let order = values.order(roots.iter().copied(), &HashMap::new());
            code.once = fixed.allocate(&values, &order, &roots, &mut code.constants)?;
            fixed.of.retain(|id, _| roots.contains(id) || there.of.contains_key(id));
            fixed.kept = roots;
        }
        // A register is free after the last use of its value on an axis.
        fixed.first = 0;
        for (sinks, section) in [(first, &mut code.begin), (tick, &mut code.tick)] {
            let mut registers = fixed.clone();
            let roots: BTreeSet<Id> = sinks.iter().map(|(_, id)| *id).collect();
            let order = values.order(sinks.iter().map(|(_, id)| *id), &fixed.of);
            *section = registers.allocate(&values, &order, &roots, &mut code.constants)?;
            for (sink, id) in sinks {
                let from = *registers.of.get(&id)?;
                section.push(match sink {
                    Sink::Output(output, axis) => Instruction::new(Opcode::Output, &[output, from, axis]),
                    Sink::State(state) => Instruction::new(Opcode::Remember, &[state, from]),
                });
            }
        }
        Some(code)
    }
}

/// Values, with products fused into their only sum.
struct Fused<'v> {
    values: &'v Values,
    sums: BTreeMap<Id, [Id; 3]>,
}

impl<'v> Fused<'v> {
    fn of(values: &'v Values, roots: impl Iterator<Item = Id>) -> Self {
        let mut uses: HashMap<Id, usize> = HashMap::new();
        let (mut waiting, mut seen): (Vec<Id>, BTreeSet<Id>) = (roots.collect(), BTreeSet::new());
        waiting.iter().for_each(|id| *uses.entry(*id).or_default() += 1);
        while let Some(id) = waiting.pop() {
            if seen.insert(id) {
                for argument in values.arguments(id) {
                    *uses.entry(argument).or_default() += 1;
                    waiting.push(argument);
                }
            }
        }
        let product = |id: Id| match values.get(id) {
            Some(Value::Of(number, [a, b, _])) if number == Opcode::Multiply as u8 => {
                (uses.get(&id) == Some(&1)).then_some([a, b])
            }
            _ => None,
        };
        let mut sums = BTreeMap::new();
        for id in seen {
            let Some(Value::Of(number, [a, b, _])) = values.get(id) else { continue };
            if number != Opcode::Add as u8 {
                continue;
            }
            if let Some([x, y]) = product(a) {
                sums.insert(id, [x, y, b]);
            } else if let Some([x, y]) = product(b) {
                sums.insert(id, [x, y, a]);
            }
        }
        Self { values, sums }
    }

    fn arguments(&self, id: Id) -> Vec<Id> {
        self.sums.get(&id).map_or_else(|| self.values.arguments(id), |of| of.to_vec())
    }

    /// Values that are equal for all axes and constant, and are used by values that are not.
    fn fixed_roots(&self, roots: impl Iterator<Item = Id>) -> BTreeSet<Id> {
        let (mut waiting, mut seen, mut fixed) =
            (roots.collect::<Vec<_>>(), BTreeSet::new(), BTreeSet::new());
        while let Some(id) = waiting.pop() {
            if self.values.is_fixed(id) {
                fixed.insert(id);
            } else if seen.insert(id) {
                waiting.extend(self.arguments(id));
            }
        }
        fixed
    }

    /// All values that the roots depend on, each after its arguments, without existing ones.
    fn order(&self, roots: impl Iterator<Item = Id>, there: &HashMap<Id, u8>) -> Vec<Id> {
        let (mut order, mut seen) = (Vec::new(), BTreeSet::new());
        for root in roots {
            self.visit(root, there, &mut seen, &mut order);
        }
        order
    }

    fn visit(&self, id: Id, there: &HashMap<Id, u8>, seen: &mut BTreeSet<Id>, order: &mut Vec<Id>) {
        if there.contains_key(&id) || !seen.insert(id) {
            return;
        }
        for argument in self.arguments(id) {
            self.visit(argument, there, seen, order);
        }
        order.push(id);
    }

    fn instruction(&self, id: Id, to: u8, of: &[u8], constants: &mut Vec<u32>) -> Option<Instruction> {
        if self.sums.contains_key(&id) {
            let [a, b, c] = *of.first_chunk()?;
            return Some(Instruction::new(Opcode::MultiplyAdd, &[to, a, b, c]));
        }
        Some(match self.values.get(id)? {
            Value::Constant(bits) => {
                let place = constants.iter().position(|known| *known == bits).unwrap_or_else(|| {
                    constants.push(bits);
                    constants.len() - 1
                });
                Instruction::new(
                    Opcode::Constant,
                    &[to, u8::try_from(place).ok().filter(|place| *place < 64)?],
                )
            }
            Value::Period => Instruction::new(Opcode::Period, &[to]),
            Value::Input(input, axis) => Instruction::new(Opcode::Input, &[to, input, axis]),
            Value::Parameter(number, axis) => Instruction::new(Opcode::Parameter, &[to, number, axis]),
            // Already in a register.
            Value::State(_) => return None,
            Value::Last(output, axis) => Instruction::new(Opcode::Last, &[to, output, axis]),
            Value::Of(number, _) => {
                let opcode = *Opcode::ALL.get(usize::from(number))?;
                let fields: Vec<u8> = [to].into_iter().chain(of.iter().copied()).collect();
                Instruction::new(opcode, &fields)
            }
        })
    }
}

/// Register allocation of values.
#[derive(Debug, Clone, Default)]
struct Registers {
    of: HashMap<Id, u8>,
    /// Values that stay in their registers.
    kept: BTreeSet<Id>,
    /// First register available for values.
    first: u8,
}

impl Registers {
    /// Allocation at the start of an axis: its parameters, then its states.
    fn there(law: &Checked<'_>, values: &Values) -> Self {
        let parameters = u8::try_from(law.parameters.len()).unwrap_or(u8::MAX);
        let states = u8::try_from(law.states.len()).unwrap_or(u8::MAX);
        let own = if law.coupled_axes.is_some() { 0 } else { CURRENT_AXIS };
        let of = values.all().filter_map(|(id, value)| match value {
            Value::Parameter(number, axis) if axis == own => Some((id, number)),
            Value::State(number) => Some((id, parameters + number)),
            _ => None,
        });
        Self { of: of.collect(), kept: BTreeSet::new(), first: parameters + states }
    }

    fn free(&self) -> Option<u8> {
        (self.first..u8::try_from(REGISTER_COUNT).ok()?)
            .find(|register| !self.of.values().any(|taken| taken == register))
    }

    /// Emits the instructions that compute values in this order; a register is free after the last use of its value,
    /// unless the value is a root.
    fn allocate(
        &mut self,
        values: &Fused<'_>,
        order: &[Id],
        roots: &BTreeSet<Id>,
        constants: &mut Vec<u32>,
    ) -> Option<Vec<Instruction>> {
        let mut last_use: HashMap<Id, usize> = HashMap::new();
        for (place, id) in order.iter().enumerate() {
            for argument in values.arguments(*id) {
                last_use.insert(argument, place);
            }
        }
        let mut instructions = Vec::new();
        for (place, id) in order.iter().enumerate() {
            let arguments = values.arguments(*id);
            let of: Option<Vec<u8>> =
                arguments.iter().map(|argument| self.of.get(argument).copied()).collect();
            let of = of?;
            for argument in arguments {
                let is_done = last_use.get(&argument) == Some(&place);
                if is_done && !roots.contains(&argument) && !self.kept.contains(&argument) {
                    self.of.remove(&argument);
                }
            }
            let to = self.free()?;
            self.of.insert(*id, to);
            instructions.push(values.instruction(*id, to, &of, constants)?);
        }
        Some(instructions)
    }
}
