//! Follows every path through a function.

use std::collections::{BTreeMap, BTreeSet};

use super::origin::{Origins, Word};
use super::slots::Slots;
use super::{Call, Frame, FrameError, Frames};
use crate::execute::{Flow, execute};
use crate::image::Image;
use crate::image::jump_table;
use crate::instruction::{Condition, FloatUnary, Instruction, LR, Operation, Register, SP, Undecoded};
use crate::state::Registers;

/// Registers that a call may change: R0 to R3, R12 and LR (AAPCS32, 6.1.1).
const SCRATCH: [Register; 6] = [0, 1, 2, 3, 12, LR];
/// Registers that a function must restore.
const RESTORED: std::ops::RangeInclusive<Register> = 4..=11;
/// Maximum nesting of outlined pieces.
const MAX_PIECES: usize = 8;
/// `SYSm` of MSP, PSP and CONTROL.
const STACK_SPECIALS: [u8; 3] = [8, 9, 20];

type Fallible<T> = Result<T, FrameError>;

/// A position on a path: the instruction's address, and the return addresses of the enclosing outlined
/// pieces, outermost first.
type Place = (u32, Vec<u32>);

/// The state at a position.
#[derive(Debug, Clone)]
struct State<'a> {
    registers: Registers<Origins>,
    slots: Slots<'a>,
}

struct Walk<'a> {
    frames: &'a Frames<'a>,
    image: &'a Image,
    frame: Frame,
    states: BTreeMap<Place, State<'a>>,
    waiting: BTreeSet<Place>,
}

pub(super) fn walk(frames: &Frames<'_>, address: u32) -> Fallible<Frame> {
    let image = frames.image;
    let frame = Frame { address, ..Frame::default() };
    let mut walk = Walk { frames, image, frame, states: BTreeMap::new(), waiting: BTreeSet::new() };
    let mut registers = Registers::new(&mut Origins);
    registers.float = [Word::Unknown; 32];
    for (register, word) in (0..).zip(&mut registers.core) {
        *word = if register == SP { Word::Stack(0) } else { Word::Entry(register) };
    }
    let state = State { registers, slots: Slots { image, saved: BTreeMap::new() } };
    walk.reach((address, Vec::new()), state)?;
    while let Some(place) = walk.waiting.pop_first() {
        if let Some(state) = walk.states.get(&place).cloned() {
            walk.step(place, state)?;
        }
    }
    Ok(walk.frame)
}

impl<'a> Walk<'a> {
    /// Reaches a position with the state of one path.
    fn reach(&mut self, place: Place, state: State<'a>) -> Fallible<()> {
        let Some(known) = self.states.get_mut(&place) else {
            self.waiting.insert(place.clone());
            self.states.insert(place, state);
            return Ok(());
        };
        let depth = |state: &State<'_>| match state.registers.read(SP) {
            Word::Stack(distance) => -i64::from(distance),
            _ => 0,
        };
        let (bytes, other_bytes) = (depth(known), depth(&state));
        if bytes != other_bytes {
            return Err(FrameError::DepthMismatch {
                place: self.image.location(place.0),
                bytes,
                other_bytes,
            });
        }
        let mut changed = known.slots.join(&state.slots);
        for (word, other) in known.registers.core.iter_mut().zip(state.registers.core) {
            let joined = word.join(other);
            changed |= joined != *word;
            *word = joined;
        }
        for (word, other) in known.registers.float.iter_mut().zip(state.registers.float) {
            let joined = word.join(other);
            changed |= joined != *word;
            *word = joined;
        }
        if changed {
            self.waiting.insert(place);
        }
        Ok(())
    }

    fn step(&mut self, (address, pieces): Place, mut state: State<'a>) -> Fallible<()> {
        let Some(instruction) = self.image.code.get(&address) else { return Err(self.no_code(address)) };
        self.frame.uses_floats |= is_float(&instruction.operation);
        if matches!(instruction.operation, Operation::FloatUnary { operator: FloatUnary::Vsqrt, .. }) {
            self.frame.square_roots.insert(address);
        }
        let next = (instruction.next(), pieces.clone());
        if instruction.condition != Condition::Always {
            self.reach(next.clone(), state.clone())?;
        }
        let Some(flow) = self.execute(instruction, &mut state)? else { return self.reach(next, state) };
        self.follow_stack(instruction, &mut state, pieces.is_empty())?;
        match (flow, instruction.operation) {
            (Flow::Next, _) => self.reach(next, state),
            (Flow::Branch { target, .. }, _) => {
                self.reach(next, state.clone())?;
                self.jump(instruction, target, state, pieces)
            }
            (Flow::Jump(target), Operation::BranchLink { .. }) if self.frames.is_outlined(target) => {
                self.enter_piece(instruction, target, state, pieces)
            }
            (Flow::Jump(target), Operation::BranchLink { .. }) => {
                self.call(instruction, Some(target), state, next)
            }
            (Flow::Jump(target), _) => self.jump(instruction, target, state, pieces),
            (Flow::Indirect(_), Operation::TableBranch { n, half, .. }) => {
                let targets = jump_table::targets(self.image, address, n, half);
                if targets.is_empty() {
                    return Err(self.lost_return(instruction));
                }
                for target in targets {
                    self.reach((target, pieces.clone()), state.clone())?;
                }
                Ok(())
            }
            (Flow::Indirect(word), Operation::BranchLinkRegister { .. }) => {
                self.call(instruction, function(word), state, next)
            }
            (Flow::Indirect(word), _) => self.leave(instruction, word, state, pieces),
            (Flow::Trap, Operation::Undefined(_)) => {
                self.frame.traps.insert(address);
                Ok(())
            }
            (Flow::Trap, _) => self.reach(next, state),
        }
    }

    /// Returns `None` for instructions that only make a register unknown and that `execute` would reject.
    fn execute(&self, instruction: &Instruction, state: &mut State<'a>) -> Fallible<Option<Flow<Origins>>> {
        let lost = match instruction.operation {
            Operation::StoreExclusive { d, .. } | Operation::ReadSpecial { d, .. } => Some(d),
            Operation::FloatStatusRead { t } if t < 15 => Some(t),
            Operation::WriteSpecial { special, .. } if STACK_SPECIALS.contains(&special) => Some(SP),
            Operation::WriteSpecial { .. } | Operation::FloatStatusWrite { .. } => None,
            _ => {
                let State { registers, slots } = state;
                let flow = execute(&mut Origins, registers, slots, instruction);
                let unmodelled =
                    |error| FrameError::Unmodelled { place: self.image.location(instruction.address), error };
                return flow.map(Some).map_err(unmodelled);
            }
        };
        if let Some(register) = lost {
            if register == SP {
                return Err(self.lost_stack(instruction));
            }
            state.registers.write(register, Word::Unknown);
        }
        Ok(None)
    }

    fn follow_stack(
        &mut self,
        instruction: &Instruction,
        state: &mut State<'a>,
        is_own: bool,
    ) -> Fallible<()> {
        match state.registers.read(SP) {
            Word::Stack(distance) => {
                let bytes = u32::try_from(-i64::from(distance)).unwrap_or(0);
                self.frame.bytes = self.frame.bytes.max(bytes);
                if is_own {
                    self.frame.own_bytes = self.frame.own_bytes.max(bytes);
                }
                Ok(())
            }
            Word::Constant(top) if self.image.symbols.get("_stack_start") == Some(&top) => {
                self.frame.restarts_stack = true;
                state.registers.write(SP, Word::Stack(0));
                Ok(())
            }
            _ => Err(self.lost_stack(instruction)),
        }
    }

    /// Continues in the function, in an outlined piece, or for good in another function.
    fn jump(
        &mut self,
        instruction: &Instruction,
        target: u32,
        state: State<'a>,
        pieces: Vec<u32>,
    ) -> Fallible<()> {
        let (from, to) = (self.image.function_at(instruction.address), self.image.function_at(target));
        if from.is_some() && from == to {
            return self.reach((target, pieces), state);
        }
        if self.frames.is_outlined(target) {
            self.frame.outlined_pieces.insert(target);
            return self.reach((target, pieces), state);
        }
        if to.is_some_and(|function| function.address == target) {
            return self.hand_over(instruction, Some(target), state, pieces);
        }
        let place = self.image.location(instruction.address);
        Err(FrameError::JumpIntoFunction { place, target: self.image.location(target) })
    }

    /// Calls an outlined piece, which returns through LR.
    fn enter_piece(
        &mut self,
        instruction: &Instruction,
        target: u32,
        state: State<'a>,
        mut pieces: Vec<u32>,
    ) -> Fallible<()> {
        if pieces.len() >= MAX_PIECES {
            return Err(self.lost_return(instruction));
        }
        pieces.push(instruction.next());
        self.frame.outlined_pieces.insert(target);
        self.reach((target, pieces), state)
    }

    /// Calls a function. Continues after the call if it returns.
    fn call(
        &mut self,
        instruction: &Instruction,
        callee: Option<u32>,
        mut state: State<'a>,
        next: Place,
    ) -> Fallible<()> {
        if !self.note(instruction, callee, &state)? {
            return Ok(());
        }
        forget(&mut state);
        self.reach(next, state)
    }

    /// Records a call. Returns whether it can return.
    fn note(&mut self, instruction: &Instruction, callee: Option<u32>, state: &State<'_>) -> Fallible<bool> {
        let Word::Stack(distance) = state.registers.read(SP) else {
            return Err(self.lost_stack(instruction));
        };
        let depth_bytes = u32::try_from(-i64::from(distance)).unwrap_or(0);
        let call = self.frame.calls.entry(instruction.address).or_insert(Call { depth_bytes, callee });
        call.depth_bytes = call.depth_bytes.max(depth_bytes);
        if call.callee != callee {
            call.callee = None;
        }
        callee.map_or(Ok(true), |callee| self.frames.returns(callee))
    }

    /// Jumps to another function, which returns to LR.
    fn hand_over(
        &mut self,
        instruction: &Instruction,
        callee: Option<u32>,
        mut state: State<'a>,
        pieces: Vec<u32>,
    ) -> Fallible<()> {
        if !self.note(instruction, callee, &state)? {
            return Ok(());
        }
        let back = state.registers.read(LR);
        if back == Word::Entry(LR) {
            return self.end(instruction, &state);
        }
        forget(&mut state);
        match self.piece_left(back, pieces) {
            Some(place) => self.reach(place, state),
            None => Err(self.lost_return(instruction)),
        }
    }

    /// Jumps to an address from a register or memory.
    fn leave(
        &mut self,
        instruction: &Instruction,
        word: Word,
        state: State<'a>,
        pieces: Vec<u32>,
    ) -> Fallible<()> {
        if word == Word::Entry(LR) {
            return self.end(instruction, &state);
        }
        if let Some(place) = self.piece_left(word, pieces.clone()) {
            return self.reach(place, state);
        }
        match (function(word), instruction.operation) {
            (Some(piece), _) if self.frames.is_outlined(piece) => {
                self.frame.outlined_pieces.insert(piece);
                self.reach((piece, pieces), state)
            }
            (callee @ Some(_), _) | (callee @ None, Operation::BranchRegister { .. }) => {
                self.hand_over(instruction, callee, state, pieces)
            }
            _ => Err(self.lost_return(instruction)),
        }
    }

    /// The return position of the innermost piece, if the word is its return address.
    fn piece_left(&self, word: Word, mut pieces: Vec<u32>) -> Option<Place> {
        let back = pieces.pop()?;
        (function(word) == Some(back)).then_some((back, pieces))
    }

    /// Returns to the caller.
    fn end(&mut self, instruction: &Instruction, state: &State<'_>) -> Fallible<()> {
        let place = || self.image.location(instruction.address);
        match state.registers.read(SP) {
            Word::Stack(0) => {}
            Word::Stack(distance) => {
                return Err(FrameError::Unbalanced { place: place(), bytes: -i64::from(distance) });
            }
            _ => return Err(self.lost_stack(instruction)),
        }
        let is_as_before = |register: &Register| state.registers.read(*register) == Word::Entry(*register);
        if let Some(register) = RESTORED.into_iter().find(|register| !is_as_before(register)) {
            return Err(FrameError::NotRestored { place: place(), register });
        }
        self.frame.returns = true;
        Ok(())
    }

    fn no_code(&self, address: u32) -> FrameError {
        let place = self.image.location(address);
        let stands = |undecoded: &&Undecoded| match undecoded {
            Undecoded::Narrow { address: at, .. }
            | Undecoded::Wide { address: at, .. }
            | Undecoded::Truncated { address: at } => *at == address,
        };
        match self.image.undecoded.iter().find(stands) {
            Some(instruction) => FrameError::Undecoded { place, instruction: *instruction },
            None => FrameError::NoCode { place },
        }
    }

    fn lost_stack(&self, instruction: &Instruction) -> FrameError {
        FrameError::UnknownStackPointer { place: self.image.location(instruction.address) }
    }

    fn lost_return(&self, instruction: &Instruction) -> FrameError {
        FrameError::InvalidReturn { place: self.image.location(instruction.address) }
    }
}

/// The function at the address in a word.
fn function(word: Word) -> Option<u32> {
    match word {
        Word::Constant(address) if address & 1 == 1 => Some(address & !1),
        _ => None,
    }
}

/// Clears registers that a call may change.
fn forget(state: &mut State<'_>) {
    for register in SCRATCH {
        state.registers.write(register, Word::Unknown);
    }
    state.registers.float = [Word::Unknown; 32];
}

fn is_float(operation: &Operation) -> bool {
    matches!(
        operation,
        Operation::Float { .. }
            | Operation::FloatUnary { .. }
            | Operation::FloatImmediate { .. }
            | Operation::FloatCompare { .. }
            | Operation::FloatConvert { .. }
            | Operation::FloatLoad { .. }
            | Operation::FloatStore { .. }
            | Operation::FloatLoadMultiple { .. }
            | Operation::FloatStoreMultiple { .. }
            | Operation::FloatFromCore { .. }
            | Operation::FloatToCore { .. }
            | Operation::FloatPairFromCore { .. }
            | Operation::FloatPairToCore { .. }
            | Operation::FloatStatusRead { .. }
            | Operation::FloatStatusWrite { .. }
    )
}
