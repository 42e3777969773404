//! Results of calls on the machine: return value, cycles, stack, marked functions, and the location of
//! errors.
#![expect(clippy::unwrap_used, clippy::panic, reason = "test helpers, like tests")]

use std::collections::BTreeMap;
use std::sync::Arc;

use cycles::AccessError;
use cycles::ExecuteError;
use cycles::image::{Function, Image, Segment};
use cycles::instruction::{Operation, decode_all};
use cycles::machine::{Call, Machine, MachineError, Stop};
use cycles::timing::{Column, Profile, Timing};

const FLASH: u32 = 0x0800_0000;
const DATA: u32 = 0x2000_1000;
const DATA_IN_FLASH: u32 = FLASH + 0x1000;

const ADD: u32 = FLASH;
const DEEP: u32 = FLASH + 0x20;
const OUTER: u32 = FLASH + 0x40;
const INNER: u32 = OUTER + 0x1A;
const LOAD: u32 = FLASH + 0x80;
const STORE: u32 = FLASH + 0x84;
const PAIR: u32 = FLASH + 0x86;
const JUMP: u32 = FLASH + 0x8A;
const FOREVER: u32 = FLASH + 0x8C;
const SERVICE: u32 = FLASH + 0x8E;
const STATUS: u32 = FLASH + 0x90;
const ENDLESS: u32 = FLASH + 0x94;

/// Functions by address: name, bytes, code.
const FUNCTIONS: &[(u32, &str, &[u16])] = &[
    // adds r0, r0, r1; bx lr
    (ADD, "add", &[0x1840, 0x4770]),
    // push {r4-r7, lr}; sub sp, #16; str r0, [sp, #8]; add sp, #16; pop {r4-r7, pc}
    (DEEP, "deep", &[0xB5F0, 0xB084, 0x9002, 0xB004, 0xBDF0]),
    // push {r4, lr}; movs r4, r0; movs r0, #1; bl inner; movs r0, #2; bl inner; mov r0, r4; pop {r4, lr}; b inner
    (
        OUTER,
        "outer",
        &[
            0xB510, 0x0004, 0x2001, 0xF000, 0xF808, 0x2002, 0xF000, 0xF805, 0x4620, 0xE8BD, 0x4010, 0xF000,
            0xB800,
        ],
    ),
    // subs r0, #1; bne inner; bx lr
    (INNER, "inner", &[0x3801, 0xD1FD, 0x4770]),
    // ldr r0, [r0]; bx lr
    (LOAD, "load", &[0x6800, 0x4770]),
    // str r0, [r0]
    (STORE, "store", &[0x6000]),
    // ldrd r0, r1, [r0]
    (PAIR, "pair", &[0xE9D0, 0x0100]),
    // bx r0
    (JUMP, "jump", &[0x4700]),
    // b forever
    (FOREVER, "forever", &[0xE7FE]),
    // svc #1
    (SERVICE, "service", &[0xDF01]),
    // vmrs r0, fpscr
    (STATUS, "status", &[0xEEF1, 0x0A10]),
    // sub sp, #8; b endless
    (ENDLESS, "endless", &[0xB082, 0xE7FD]),
];

fn image() -> Image {
    let mut image = Image::default();
    for (address, name, halves) in FUNCTIONS {
        let bytes: Vec<u8> = halves.iter().flat_map(|half| half.to_le_bytes()).collect();
        for instruction in decode_all(*address, &bytes) {
            let instruction = instruction.unwrap();
            image.code.insert(instruction.address, instruction);
        }
        let function = Function {
            address: *address,
            bytes: u32::try_from(bytes.len()).unwrap(),
            names: vec![(*name).to_owned()],
        };
        image.functions.insert(*address, function);
        image.segments.push(Segment { address: *address, load_address: *address, bytes, is_writable: false });
    }
    let bytes = vec![1, 2, 3, 4];
    image.segments.push(Segment { address: DATA, load_address: DATA_IN_FLASH, bytes, is_writable: true });
    for (name, address) in [
        ("_stack_end", 0x2000_0000),
        ("_stack_start", 0x2000_1000),
        ("__sdata", DATA),
        ("__euninit", 0x2000_2000),
    ] {
        image.symbols.insert(name.to_owned(), address);
    }
    image
}

fn machine() -> Machine {
    Machine::new(Arc::new(image()), Timing::new(Profile::ZeroWait, Column::Likely)).unwrap()
}

/// Location and reason of the error of a call.
fn stop(machine: &mut Machine, function: u32, argument: u32) -> (String, Stop) {
    match machine.call(function, [argument, 0, 0, 0]) {
        Err(MachineError::Stopped { place, stop, .. }) => (place, stop),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_call_returns_the_result_and_its_cost() {
    let run = machine().call(ADD, [2, 3, 0, 0]).unwrap();
    assert_eq!((run.result, run.instructions, run.stack_bytes), (5, 2, 0));
    assert!(run.cycles >= 2);
    // A Thumb address with bit 0 set, as in a table of functions.
    assert_eq!(machine().call(ADD | 1, [2, 3, 0, 0]).unwrap(), run);
}

#[test]
fn the_stack_is_measured_to_the_lowest_pointer_and_the_lowest_written_byte() {
    let run = machine().call(DEEP, [7, 0, 0, 0]).unwrap();
    assert_eq!(run.stack_bytes, 5 * 4 + 16);
    assert_eq!(run.stack_written_bytes, 5 * 4 + 8);
    // The next call does not count bytes written by an earlier call.
    let mut machine = machine();
    machine.call(DEEP, [7, 0, 0, 0]).unwrap();
    assert_eq!(machine.call(ADD, [0; 4]).unwrap().stack_written_bytes, 0);
}

#[test]
fn marked_calls_are_reported_in_order_with_tail_calls_and_without_loops() {
    let mut machine = machine();
    machine.record_calls_of([OUTER, INNER]);
    let run = machine.call(OUTER, [3, 0, 0, 0]).unwrap();
    let functions: Vec<u32> = run.calls.iter().map(|call| call.function).collect();
    assert_eq!(functions, [OUTER, INNER, INNER, INNER]);
    // One, two and three iterations; the last call is a tail call and returns for the outer function.
    let instructions: Vec<u64> = run.calls.iter().map(|call| call.instructions).collect();
    assert_eq!(instructions, [run.instructions, 3, 5, 7]);
    assert_eq!(run.instructions, 9 + 3 + 5 + 7);
    let cycles: Vec<u64> = run.calls.iter().map(|call| call.cycles).collect();
    assert_eq!(cycles[0], run.cycles);
    assert!(cycles[1] < cycles[2] && cycles[2] < cycles[3] && cycles[1] + cycles[2] + cycles[3] < cycles[0]);
    let stack: Vec<u32> = run.calls.iter().map(|call: &Call| call.stack_bytes).collect();
    assert_eq!(stack, [8, 0, 0, 0]);
    assert_eq!(machine.call(ADD, [0; 4]).unwrap().calls, []);
}

#[test]
fn memory_is_initialised_from_the_image_and_persists_between_calls() {
    let mut machine = machine();
    let mut load = |address| machine.call(LOAD, [address, 0, 0, 0]).map(|run| run.result);
    assert_eq!(load(DATA), Ok(0x0403_0201));
    assert_eq!(load(DATA_IN_FLASH), Ok(0x0403_0201));
    assert_eq!(load(DATA + 4), Ok(0));
    assert_eq!(load(ADD), Ok(0x4770_1840));
    // Unaligned, which is allowed for single-word loads.
    assert_eq!(load(DATA + 1), Ok(0x0004_0302));
    machine.write(DATA + 4, &[9]).unwrap();
    let twin = machine.clone();
    machine.write(DATA + 4, &[8]).unwrap();
    assert_eq!(machine.call(LOAD, [DATA + 4, 0, 0, 0]).unwrap().result, 8);
    let mut bytes = [0; 2];
    twin.read(DATA + 3, &mut bytes).unwrap();
    assert_eq!(bytes, [4, 9]);
    assert_eq!(machine.write(ADD, &[0]), Err(AccessError::ReadOnly { address: ADD }));
    assert_eq!(machine.read(0, &mut bytes), Err(AccessError::Unmapped { address: 0 }));
}

#[test]
fn unmapped_memory_or_code_stops_the_call_with_its_location() {
    let mut machine = machine();
    let peripheral = 0x4000_0000;
    let (place, reason) = stop(&mut machine, LOAD, peripheral);
    assert_eq!(place, "load");
    assert_eq!(reason, AccessError::Unmapped { address: peripheral }.into());
    // Partly inside, partly outside of RAM.
    assert_eq!(
        stop(&mut machine, LOAD, 0x2000_1FFE).1,
        AccessError::Unmapped { address: 0x2000_1FFE }.into()
    );
    assert_eq!(stop(&mut machine, STORE, ADD).1, AccessError::ReadOnly { address: ADD }.into());
    assert_eq!(stop(&mut machine, PAIR, DATA + 2).1, AccessError::Unaligned { address: DATA + 2 }.into());
    assert_eq!(stop(&mut machine, JUMP, ADD).1, Stop::NotThumb { target: ADD });
    assert_eq!(stop(&mut machine, JUMP, DATA | 1).1, Stop::NoCode);
    // A jump into the middle of an instruction.
    assert_eq!(stop(&mut machine, PAIR + 2, 0).1, Stop::NoCode);
    let operation = Operation::SupervisorCall(1);
    assert_eq!(stop(&mut machine, SERVICE, 0).1, Stop::Trap { operation });
    assert_eq!(stop(&mut machine, STATUS, 0).1, Stop::Execute(ExecuteError::Unmodelled));
    machine.map(peripheral, 8);
    assert_eq!(machine.call(LOAD, [peripheral, 0, 0, 0]).unwrap().result, 0);
}

#[test]
fn an_endless_call_stops_at_the_limit() {
    let mut machine = machine();
    machine.set_max_instructions(1000);
    assert_eq!(stop(&mut machine, FOREVER, 0).1, Stop::StepLimit { instructions: 1000 });
    machine.set_max_instructions(100_000);
    let (place, reason) = stop(&mut machine, ENDLESS, 0);
    assert_eq!(place, "endless");
    assert_eq!(reason, Stop::StackOverflow { pointer: 0x1FFF_FFF8, lowest: 0x2000_0000 });
}

#[test]
fn an_image_without_ram_symbols_is_an_error() {
    let mut image = image();
    image.symbols = BTreeMap::new();
    let error = Machine::new(Arc::new(image), Timing::new(Profile::ZeroWait, Column::Likely)).unwrap_err();
    assert!(error.to_string().contains("_stack_end"), "{error}");
}
