//! Executes a block: every instruction on every path, and the transitions to the next blocks.

use super::frame::{Call, Frame};
use super::{BoundError, Explorer, MAX_ROUNDS, MAX_STEPS, Node, Reason, Region, State};
use crate::abstraction::{Bit, Word};
use crate::domain::Domain as _;
use crate::execute::{Flow, execute};
use crate::instruction::{Condition, Instruction, Operation, SP};
use crate::timing::{KnownOperands, Outcome};
use crate::values::Values;

/// Maximum number of separate paths within one block (from IT blocks).
const MAX_PATHS: usize = 8;
/// Maximum number of targets of one jump.
const MAX_TARGETS: u64 = 64;

type Fallible<T> = Result<T, BoundError>;

impl Explorer<'_> {
    /// Executes a block until all paths have left it.
    pub(super) fn block(&mut self, mut state: State) -> Fallible<()> {
        let Some(frame) = state.frames.last() else { return Ok(()) };
        let (block, call) = (frame.block, std::rc::Rc::clone(&frame.call));
        let Some(end) = call.flow.blocks.get(&block).map(|block| block.end) else { return Ok(()) };
        if frame.is_new() && self.start.marked.contains(&call.flow.entry) {
            let began = state.cycles;
            let region = Region { function: call.flow.entry, began, cycles: 0, stack_bytes: 0 };
            self.regions.insert(call.key.clone(), region);
        }
        let node = Node { before: state.node, function: call.flow.entry, block, cycles: state.cycles };
        state.node = self.nodes.len();
        self.nodes.push(node);
        let mut address = block;
        let mut states = vec![state];
        loop {
            self.address = address;
            let Some(instruction) = self.start.image.code.get(&address) else {
                let frames = states.first().map_or([].as_slice(), |state| &state.frames);
                return Err(self.error(frames, Reason::NoCode));
            };
            self.visited.insert(address);
            let mut stay = Vec::new();
            for state in states {
                self.instruction(state, instruction, &mut stay)?;
            }
            address = instruction.next();
            if address == end {
                return stay.into_iter().try_for_each(|state| self.go_to(state, address));
            }
            // Within a block, paths stay separate: a branch after an IT block often tests the same condition.
            let is_in_it_block = self.start.image.code.get(&address).is_some_and(|next| next.in_it_block);
            if stay.len() > MAX_PATHS && !is_in_it_block {
                let merged = stay.into_iter().reduce(|left, right| self.merge(left, right));
                stay = merged.into_iter().collect();
            }
            if stay.is_empty() {
                return Ok(());
            }
            states = stay;
        }
    }

    /// Executes an instruction, or skips it if its condition does not hold.
    fn instruction(
        &mut self,
        state: State,
        instruction: &Instruction,
        stay: &mut Vec<State>,
    ) -> Fallible<()> {
        self.steps += 1;
        if self.steps > MAX_STEPS {
            return Err(self.error(&state.frames, Reason::TooLong { steps: MAX_STEPS }));
        }
        if instruction.condition == Condition::Always {
            return self.execute(state, instruction, stay);
        }
        let condition = self.domain.holds(instruction.condition, state.registers.flags);
        let (holds, fails) = self.fork(state, condition);
        if let Some(mut state) = fails {
            self.count(&mut state, instruction, Outcome::Skipped, KnownOperands::default());
            stay.push(state);
        }
        holds.map_or(Ok(()), |state| self.execute(state, instruction, stay))
    }

    /// The paths on which a condition holds, and on which it fails.
    fn fork(&mut self, state: State, bit: Bit) -> (Option<State>, Option<State>) {
        match self.domain.known_bit(bit) {
            Some(true) => (Some(state), None),
            Some(false) => (None, Some(state)),
            None => (self.assume(state.clone(), bit, true), self.assume(state, bit, false)),
        }
    }

    fn assume(&mut self, mut state: State, bit: Bit, truth: bool) -> Option<State> {
        let Bit::Holds(condition, flags) = bit else { return Some(state) };
        std::mem::swap(&mut self.domain.facts, &mut state.facts);
        let left = self.domain.assume(condition, flags, truth);
        std::mem::swap(&mut self.domain.facts, &mut state.facts);
        let left = left?;
        if state.registers.flags == flags {
            state.registers.flags = left;
        }
        Some(state)
    }

    fn execute(
        &mut self,
        mut state: State,
        instruction: &Instruction,
        stay: &mut Vec<State>,
    ) -> Fallible<()> {
        std::mem::swap(&mut self.domain.facts, &mut state.facts);
        let division = match instruction.operation {
            Operation::Divide { n, m, .. } => {
                let [n, m] = [n, m].map(|register| self.domain.known(state.registers.read(register)));
                n.zip(m)
            }
            _ => None,
        };
        state.memory.first_access = None;
        let stack = state.registers.read(SP);
        let flow = execute(self.domain, &mut state.registers, &mut state.memory, instruction);
        let pointer = state.registers.read(SP);
        let pointer = if pointer == stack { Some(None) } else { self.domain.known(pointer).map(Some) };
        std::mem::swap(&mut self.domain.facts, &mut state.facts);
        let flow = flow.map_err(|error| self.error(&state.frames, error.into()))?;
        let Some(pointer) = pointer else { return Err(self.error(&state.frames, Reason::UnknownStack)) };
        if let (Some(pointer), Some(frame)) = (pointer, state.frames.last_mut()) {
            frame.lowest = frame.lowest.min(pointer);
        }
        let known = KnownOperands { division, access: state.memory.first_access };
        match flow {
            Flow::Next => {
                self.count(&mut state, instruction, Outcome::Done, known);
                stay.push(state);
            }
            Flow::Branch { target, taken } => {
                let (taken, not_taken) = self.fork_in(state, taken);
                if let Some(mut state) = not_taken {
                    self.count(&mut state, instruction, Outcome::Done, known);
                    stay.push(state);
                }
                if let Some(mut state) = taken {
                    self.count(&mut state, instruction, Outcome::Taken, known);
                    self.go_to(state, target)?;
                }
            }
            Flow::Jump(target) => {
                self.count(&mut state, instruction, Outcome::Taken, known);
                match instruction.operation {
                    Operation::BranchLink { .. } => self.call(state, target, Some(instruction.next()))?,
                    _ => self.go_to(state, target)?,
                }
            }
            Flow::Indirect(target) => {
                self.count(&mut state, instruction, Outcome::Taken, known);
                self.jump(state, instruction, target)?;
            }
            Flow::Trap => return Err(self.error(&state.frames, Reason::Trap)),
        }
        Ok(())
    }

    /// Like [`fork`](Self::fork), with the facts of the path.
    fn fork_in(&mut self, mut state: State, bit: Bit) -> (Option<State>, Option<State>) {
        std::mem::swap(&mut self.domain.facts, &mut state.facts);
        let known = self.domain.known_bit(bit);
        std::mem::swap(&mut self.domain.facts, &mut state.facts);
        self.fork(state, known.map_or(bit, Bit::Known))
    }

    fn count(&self, state: &mut State, instruction: &Instruction, outcome: Outcome, known: KnownOperands) {
        let cycles = self.start.timing.cycles(&mut state.pipeline, instruction, outcome, known);
        state.cycles += u64::from(cycles);
    }

    /// Jumps to every possible address of a word.
    fn jump(&mut self, mut state: State, instruction: &Instruction, word: Word) -> Fallible<()> {
        std::mem::swap(&mut self.domain.facts, &mut state.facts);
        let targets = self.domain.values(word);
        std::mem::swap(&mut self.domain.facts, &mut state.facts);
        let unknown = Reason::UnknownTarget { lowest: targets.low(), highest: targets.high() };
        if targets.count() > MAX_TARGETS || targets.iter().any(|target| target & 1 == 0) {
            return Err(self.error(&state.frames, unknown));
        }
        for target in targets.iter() {
            let mut state = state.clone();
            std::mem::swap(&mut self.domain.facts, &mut state.facts);
            let is_possible = self.domain.narrow(word, &Values::one(target));
            std::mem::swap(&mut self.domain.facts, &mut state.facts);
            if !is_possible {
                continue;
            }
            let target = target & !1;
            let returns_to = state.frames.iter().rev().find_map(|frame| frame.call.returns_to);
            match instruction.operation {
                Operation::BranchLinkRegister { .. } => self.call(state, target, Some(instruction.next()))?,
                _ if returns_to == Some(target) => self.come_back(state, target)?,
                _ if self.start.image.code.contains_key(&target) => self.go_to(state, target)?,
                _ => return Err(self.error(&state.frames, unknown)),
            }
        }
        Ok(())
    }

    /// Continues at a block of the same function, or in another function that returns in its place.
    pub(super) fn go_to(&mut self, mut state: State, target: u32) -> Fallible<()> {
        let Some(frame) = state.frames.last_mut() else { return Ok(()) };
        if !frame.call.flow.blocks.contains_key(&target) {
            return self.call(state, target, None);
        }
        let before = frame.key();
        let rounds = frame.go_to(target);
        let key = frame.key();
        if rounds > MAX_ROUNDS {
            self.address = target;
            return Err(self.error(&state.frames, Reason::Unbounded { rounds: MAX_ROUNDS }));
        }
        if key <= before {
            return Err(self.error(&state.frames, Reason::Irreducible));
        }
        self.wait(key, state);
        Ok(())
    }

    /// Enters a function.
    pub(super) fn call(&mut self, mut state: State, entry: u32, returns_to: Option<u32>) -> Fallible<()> {
        if state.frames.iter().any(|frame| frame.call.flow.entry == entry) {
            return Err(self.error(&state.frames, Reason::Recursion { function: entry }));
        }
        let mut key = state.frames.last().map_or_else(Vec::new, Frame::key);
        key.push(entry);
        let Some(stack) = self.domain.known(state.registers.read(SP)) else {
            return Err(self.error(&state.frames, Reason::UnknownStack));
        };
        let frame = Frame::new(Call { flow: self.flow(entry), key, returns_to, stack });
        let key = frame.key();
        state.frames.push(frame);
        self.wait(key, state);
        Ok(())
    }

    /// Leaves functions up to and including the function that returns to `target`.
    fn come_back(&mut self, mut state: State, target: u32) -> Fallible<()> {
        while let Some(frame) = state.frames.pop() {
            if let Some(region) = self.regions.get_mut(&frame.call.key) {
                region.cycles = region.cycles.max(state.cycles - region.began);
                region.stack_bytes = region.stack_bytes.max(frame.call.stack.saturating_sub(frame.lowest));
            }
            match state.frames.last_mut() {
                Some(caller) => caller.lowest = caller.lowest.min(frame.lowest),
                None => {
                    let end = match self.end.take() {
                        Some((other, lowest)) => (self.merge(other, state), lowest.min(frame.lowest)),
                        None => (state, frame.lowest),
                    };
                    self.end = Some(end);
                    return Ok(());
                }
            }
            if frame.call.returns_to.is_some() {
                break;
            }
        }
        self.go_to(state, target)
    }
}
