//! Exceptions of the processor: stacked frames, preemption, sleep, faults, and protection of the stack.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "test helpers, like tests")]

use std::sync::Arc;

use cycles::AccessError;
use cycles::image::{Function, Image, Segment};
use cycles::instruction::{SP, Width, decode_all};
use cycles::processor::{AccessPoint, Bus, Processor, Reset, State};
use cycles::timing::{Column, Profile, Timing};

const FLASH: u32 = 0x0800_0000;
const STACK_TOP: u32 = 0x2000_0400;
const RAM: u32 = 0x2000_0000;
const RAM_BYTES: usize = 0x400;
/// Writing an exception number here clears the line of its interrupt.
const CLEAR: u32 = 0x4000_0000;

const HARD_FAULT: u32 = FLASH + 0x100;
const FIRST: u32 = FLASH + 0x120;
const SECOND: u32 = FLASH + 0x140;
const FLOATING: u32 = FLASH + 0x160;
const MAIN: u32 = FLASH + 0x200;

const ENABLE: u32 = 0xE000_E100;
const PRIORITIES: u32 = 0xE000_E400;
const PROTECTION: u32 = 0xE000_ED94;
const COPROCESSORS: u32 = 0xE000_ED88;

const HANDLERS: &[(u32, &str, &[u16])] = &[
    // movs r0, #9; b .
    (HARD_FAULT, "hard_fault", &[0x2009, 0xE7FE]),
    // mrs r1, ipsr; str r1, [r4]; str r1, [r6]; bx lr
    (FIRST, "first", &[0xF3EF, 0x8105, 0x6021, 0x6031, 0x4770]),
    // mrs r1, ipsr; str r1, [r5]; str r1, [r6]; bx lr
    (SECOND, "second", &[0xF3EF, 0x8105, 0x6029, 0x6031, 0x4770]),
    // mrs r1, ipsr; vmov s0, r1; str r1, [r6]; bx lr
    (FLOATING, "floating", &[0xF3EF, 0x8105, 0xEE00, 0x1A10, 0x6031, 0x4770]),
];

/// Memory and two interrupt lines.
#[derive(Debug)]
struct Chip {
    flash: Vec<u8>,
    ram: Vec<u8>,
    lines: u128,
}

impl Chip {
    fn word(&self, address: u32) -> u32 {
        let at = (address - RAM) as usize;
        u32::from_le_bytes(self.ram[at..at + 4].try_into().unwrap())
    }
}

impl Bus for Chip {
    fn load(&mut self, address: u32, width: Width, _: AccessPoint) -> Result<u32, AccessError> {
        assert_eq!(width, Width::Word);
        let memory = if address < RAM { (&self.flash, FLASH) } else { (&self.ram, RAM) };
        let place = address.wrapping_sub(memory.1) as usize;
        let bytes = memory.0.get(place..).and_then(|rest| rest.first_chunk());
        bytes.map(|bytes| u32::from_le_bytes(*bytes)).ok_or(AccessError::Unmapped { address })
    }

    fn store(&mut self, address: u32, _: Width, value: u32, _: AccessPoint) -> Result<(), AccessError> {
        if address == CLEAR {
            self.lines &= !(1 << (value - 16));
            return Ok(());
        }
        let place = address.wrapping_sub(RAM) as usize;
        let room = self.ram.get_mut(place..).and_then(|rest| rest.first_chunk_mut());
        *room.ok_or(AccessError::Unmapped { address })? = value.to_le_bytes();
        Ok(())
    }

    fn wait(&self, _: u32, _: u64) -> u64 {
        0
    }

    fn advance(&mut self, _: u64) {}

    fn next_event(&self) -> u64 {
        0
    }

    fn lines(&self) -> u128 {
        self.lines
    }

    fn wants_reset(&self, _: u64) -> bool {
        false
    }

    fn reset(&mut self, _: Reset, _: u64) {}
}

/// A processor that runs `main`, with these handlers for interrupts 0 and 1.
fn processor(main: &[u16], handlers: [u32; 2]) -> Processor<Chip> {
    let mut flash = vec![0; 0x400];
    let mut put = |address: u32, bytes: &[u8]| {
        let at = (address - FLASH) as usize;
        flash[at..at + bytes.len()].copy_from_slice(bytes);
    };
    let vectors =
        [(0, STACK_TOP), (1, MAIN | 1), (3, HARD_FAULT | 1), (16, handlers[0] | 1), (17, handlers[1] | 1)];
    for (number, vector) in vectors {
        put(FLASH + 4 * number, &vector.to_le_bytes());
    }
    let mut image = Image::default();
    for (address, name, code) in HANDLERS.iter().copied().chain([(MAIN, "main", main)]) {
        let bytes: Vec<u8> = code.iter().flat_map(|half| half.to_le_bytes()).collect();
        put(address, &bytes);
        image.code.extend(decode_all(address, &bytes).map(|decoded| {
            let instruction = decoded.unwrap();
            (instruction.address, instruction)
        }));
        let function =
            Function { address, bytes: u32::try_from(bytes.len()).unwrap(), names: vec![name.into()] };
        image.functions.insert(address, function);
    }
    image.segments.push(Segment {
        address: FLASH,
        load_address: FLASH,
        bytes: flash.clone(),
        is_writable: false,
    });
    let chip = Chip { flash, ram: vec![0; RAM_BYTES], lines: 0 };
    Processor::new(Arc::new(image), chip, Timing::new(Profile::ZeroWait, Column::Likely)).unwrap()
}

/// str r7, [r0]; str r3, [r2]; b .: enables interrupts and sets their priorities.
const SET_UP: [u16; 3] = [0x6007, 0x6013, 0xE7FE];

/// A processor after [`SET_UP`], with these priorities.
fn set_up(priorities: [u8; 2], handlers: [u32; 2]) -> Processor<Chip> {
    let mut processor = processor(&SET_UP, handlers);
    let [first, second] = priorities;
    let registers = [
        (0, ENABLE),
        (7, 3),
        (2, PRIORITIES),
        (3, u32::from_le_bytes([first, second, 0, 0])),
        (4, RAM),
        (5, RAM + 4),
        (6, CLEAR),
    ];
    for (register, value) in registers {
        processor.registers.write(register, value);
    }
    processor.run_until(20).unwrap();
    processor
}

fn step(processor: &mut Processor<Chip>) {
    processor.step(u64::MAX).unwrap();
}

#[test]
fn a_handler_changes_only_the_memory_it_writes() {
    let mut processor = set_up([0x40, 0x80], [FIRST, SECOND]);
    let before = processor.registers.clone();
    processor.bus.lines = 1;
    let began = processor.cycles();
    step(&mut processor);
    assert_eq!(processor.registers.read(SP), STACK_TOP - 0x20, "R0 to R3, R12, LR, return address, xPSR");
    assert!(processor.cycles() - began > 12);
    processor.run_until(began + 60).unwrap();
    assert!(processor.registers == before);
    assert_eq!(processor.bus.word(RAM), 16);
    // The stacked frame: the return address is in the loop, xPSR has the Thumb bit set.
    assert_eq!(processor.bus.word(STACK_TOP - 8), MAIN + 4);
    assert_eq!(processor.bus.word(STACK_TOP - 4) & 0x0100_01FF, 0x0100_0000);
}

#[test]
fn only_a_more_urgent_interrupt_preempts() {
    for (priorities, is_nested) in [([0x80, 0x40], true), ([0x40, 0x80], false), ([0x40, 0x40], false)] {
        let mut processor = set_up(priorities, [FIRST, SECOND]);
        processor.bus.lines = 1;
        step(&mut processor);
        processor.bus.lines |= 2;
        step(&mut processor);
        let depth = STACK_TOP - processor.registers.read(SP);
        assert_eq!(depth, if is_nested { 0x40 } else { 0x20 }, "{priorities:?}");
        processor.run_until(processor.cycles() + 150).unwrap();
        assert_eq!([RAM, RAM + 4].map(|at| processor.bus.word(at)), [16, 17]);
        assert_eq!(processor.registers.read(SP), STACK_TOP);
    }
}

#[test]
fn tail_chained_handlers_cost_less_than_two_separate_handlers() {
    let cycles = |lines: u128| {
        let mut processor = set_up([0x40, 0x80], [FIRST, SECOND]);
        processor.bus.lines = lines;
        let began = processor.cycles();
        step(&mut processor);
        while processor.registers.read(SP) != STACK_TOP {
            step(&mut processor);
        }
        processor.cycles() - began
    };
    let (one, two) = (cycles(1), cycles(3));
    assert!(two < 2 * one, "{one} {two}");
}

#[test]
fn basepri_masks_interrupts_that_are_not_more_urgent() {
    let mut processor = set_up([0x40, 0x80], [FIRST, SECOND]);
    processor.registers.basepri = 0x80;
    processor.bus.lines = 2;
    processor.run_until(processor.cycles() + 100).unwrap();
    assert_eq!(processor.bus.word(RAM + 4), 0);
    processor.bus.lines |= 1;
    processor.run_until(processor.cycles() + 100).unwrap();
    assert_eq!([RAM, RAM + 4].map(|at| processor.bus.word(at)), [16, 0]);
    processor.registers.basepri = 0;
    processor.run_until(processor.cycles() + 100).unwrap();
    assert_eq!(processor.bus.word(RAM + 4), 17);
}

#[test]
fn a_sleeping_processor_with_masked_interrupts_wakes_without_running_a_handler() {
    // str r7, [r0]; cpsid i; wfi; movs r0, #7; b .
    let mut processor = processor(&[0x6007, 0xB672, 0xBF30, 0x2007, 0xE7FE], [FIRST, SECOND]);
    for (register, value) in [(0, ENABLE), (7, 1), (4, RAM), (6, CLEAR)] {
        processor.registers.write(register, value);
    }
    processor.run_until(100).unwrap();
    assert_eq!(processor.state(), State::Sleeping);
    processor.bus.lines = 1;
    processor.run_until(200).unwrap();
    assert_eq!((processor.state(), processor.registers.read(0)), (State::Running, 7));
    assert_eq!(processor.bus.word(RAM), 0);
}

#[test]
fn float_registers_survive_a_handler_that_uses_them() {
    // str r1, [r0]; vmov s0, r2; str r7, [r3]; b .
    let main = [0x6001, 0xEE00, 0x2A10, 0x601F, 0xE7FE];
    let mut processor = processor(&main, [FLOATING, SECOND]);
    let registers = [(0, COPROCESSORS), (1, 0x00F0_0000), (2, 0x3F80_0000), (3, ENABLE), (7, 1), (6, CLEAR)];
    for (register, value) in registers {
        processor.registers.write(register, value);
    }
    processor.run_until(30).unwrap();
    processor.bus.lines = 1;
    step(&mut processor);
    assert_eq!(processor.registers.read(SP), STACK_TOP - 0x68);
    processor.run_until(processor.cycles() + 10).unwrap();
    processor.run_until(processor.cycles() + 100).unwrap();
    assert_eq!((processor.registers.read_float(0), processor.registers.read(SP)), (0x3F80_0000, STACK_TOP));
}

#[test]
fn a_float_instruction_with_the_unit_disabled_is_a_fault() {
    // vmov s0, r2; b .
    let mut processor = processor(&[0xEE00, 0x2A10, 0xE7FE], [FIRST, SECOND]);
    processor.run_until(30).unwrap();
    assert_eq!((processor.faults().len(), processor.registers.read(0)), (1, 9));
}

#[test]
fn a_fault_calls_its_handler_and_a_fault_there_locks_up() {
    // str r1, [r0]; b .
    let mut processor = processor(&[0x6001, 0xE7FE], [FIRST, SECOND]);
    processor.registers.write(0, 0x3000_0000);
    processor.run_until(50).unwrap();
    let [fault] = processor.faults() else { panic!("{:?}", processor.faults()) };
    assert!((fault.place.as_str(), fault.locks_up) == ("main", false), "{fault:?}");
    assert_eq!(processor.registers.read(0), 9);
    // If the frame has no memory, the hard fault handler runs, and SP is as after stacking the frame
    // (MSTKERR, STKERR).
    let mut processor = set_up([0x40, 0x80], [FIRST, SECOND]);
    processor.registers.write(SP, 0x1000_0000);
    processor.bus.lines = 1;
    processor.run_until(processor.cycles() + 50).unwrap();
    let [fault] = processor.faults() else { panic!("{:?}", processor.faults()) };
    assert!(!fault.locks_up, "{fault:?}");
    assert_eq!((processor.registers.read(0), processor.registers.read(SP)), (9, 0x1000_0000 - 0x20));
}

#[test]
fn a_protected_range_denies_all_access() {
    // str r1, [r0, #8]; str r2, [r0, #12]; str r3, [r0]; str r4, [r5]; str r4, [r6]; b .
    let mut processor = processor(&[0x6081, 0x60C2, 0x6003, 0x602C, 0x6034, 0xE7FE], [FIRST, SECOND]);
    // 32 bytes without access; privileged code has access to everything else.
    let registers = [
        (0, PROTECTION),
        (1, RAM + 0x100),
        (2, 4 << 1 | 1),
        (3, 5),
        (4, 1),
        (5, RAM + 0x120),
        (6, RAM + 0x11C),
    ];
    for (register, value) in registers {
        processor.registers.write(register, value);
    }
    processor.run_until(50).unwrap();
    assert_eq!(processor.bus.word(RAM + 0x120), 1);
    let whys: Vec<String> = processor.faults().iter().map(|fault| fault.cause.to_string()).collect();
    assert_eq!(whys, ["access to protected memory at 0x2000011c"]);
}
