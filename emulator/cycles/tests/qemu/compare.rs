//! Comparison of a machine with QEMU.

use cycles::Flags;
use cycles::instruction::{Instruction, Operation};
use cycles::machine::Machine;

use super::emulator::{Emulator, State};

/// The Thumb bit of the status register.
const THUMB: u32 = 1 << 24;
/// The saturation flag Q and the lane flags GE.
const DSP_FLAGS: u32 = 0x080F_0000;

/// Runs the emulator until it reaches the machine's address, and copies its registers to the machine.
pub(crate) fn meet(machine: &mut Machine, emulator: &mut Emulator) {
    let begin = machine.next().expect("code").address;
    let state = loop {
        let state = emulator.state();
        let Some(state) = state else { panic!("QEMU never reaches {begin:#010x}: {}", emulator.said) };
        if state.core[15] == begin {
            break state;
        }
    };
    machine.registers.core.copy_from_slice(&state.core);
    machine.registers.float = state.float;
    machine.registers.flags = Flags::from_word(state.xpsr);
    machine.registers.dsp_flags = state.xpsr & DSP_FLAGS;
    machine.registers.float_flags = Flags::from_word(state.fpscr);
}

/// Executes both to a breakpoint or to the return of the machine's function, and compares the whole state
/// after every instruction. Calls `executed` for each instruction and returns their number.
pub(crate) fn lockstep(
    machine: &mut Machine,
    emulator: &mut Emulator,
    mut executed: impl FnMut(&Instruction),
) -> u64 {
    let mut instructions = 0;
    while let Some(instruction) = machine.next().copied() {
        if matches!(instruction.operation, Operation::Breakpoint(_)) {
            break;
        }
        if let Err(error) = machine.step() {
            panic!("{error}, at {instruction:?}");
        }
        executed(&instruction);
        instructions += 1;
        let Some(next) = machine.next() else { break };
        let Some(theirs) = emulator.state() else {
            panic!("QEMU ended after {instruction:?}: {}", emulator.said)
        };
        let ours = state(machine, next, &theirs);
        // The machine does not keep the sticky exception bits.
        let theirs = State { fpscr: theirs.fpscr & 0xF000_0000, ..theirs };
        assert!(ours == theirs, "after {instruction:?}\n{}", difference(&ours, &theirs));
    }
    instructions
}

/// The machine's state in the format of QEMU's log.
fn state(machine: &Machine, next: &Instruction, theirs: &State) -> State {
    let registers = &machine.registers;
    let mut core = registers.core;
    core[15] = next.address;
    // The machine does not keep the number of instructions left in an IT block, only whether it is in a
    // block, and the condition.
    let block =
        if next.in_it_block { (theirs.xpsr & 0x0600_0C00) | (next.condition as u32) << 12 } else { 0 };
    let xpsr = registers.flags.to_word() | registers.dsp_flags | THUMB | block;
    State { core, float: registers.float, xpsr, fpscr: registers.float_flags.to_word() }
}

/// Every register that differs.
fn difference(ours: &State, theirs: &State) -> String {
    let all = |state: &State| [&state.core[..], &state.float, &[state.xpsr, state.fpscr]].concat();
    let names = (0..16).map(|r| format!("R{r}")).chain((0..32).map(|s| format!("S{s}")));
    let names = names.chain(["XPSR".to_owned(), "FPSCR".to_owned()]);
    let both = names.zip(all(ours).into_iter().zip(all(theirs)));
    let lines = both.filter(|(_, (ours, theirs))| ours != theirs);
    lines.map(|(name, (ours, theirs))| format!("{name}: {ours:08x}, in QEMU {theirs:08x}\n")).collect()
}
