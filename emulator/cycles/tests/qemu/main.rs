//! Compares the emulated instructions with QEMU: the whole state before each of a million instructions, or of
//! ten million if `LONG_TESTS` is set.
//!
//! Without QEMU, the test is skipped with a message; if `REQUIRE_QEMU` is set, it fails.
#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::indexing_slicing,
    clippy::cast_possible_truncation,
    reason = "helpers of a test, and fields of encodings"
)]

mod compare;
mod control;
mod draw;
mod emulator;
mod encode;
mod kinds;
mod patterns;
mod program;
mod words;

use std::collections::BTreeMap;
use std::env;
use std::io::Write as _;
use std::process::{Command, Stdio};
use std::sync::Arc;

use cycles::image::{Function, Image, Segment};
use cycles::instruction::decode_all;
use cycles::machine::Machine;
use cycles::timing::{Column, Profile, Timing};

use compare::{lockstep, meet};
use emulator::Emulator;
use kinds::{all, kind};
use program::{CODE, Program, RAM, STACK};

#[test]
fn random_instructions_match_qemu() {
    if !has_qemu() {
        return;
    }
    let mut executed = BTreeMap::new();
    let mut instructions = 0;
    let programs = if env::var_os("LONG_TESTS").is_some() { 40 } else { 4 };
    for seed in 1..=programs {
        instructions += compare(&Program::random(seed, 6_000, 20), &mut executed);
    }
    println!("{instructions} instructions: {executed:#?}");
    assert!(instructions >= programs * 250_000, "only {instructions} instructions");
    let missing: Vec<_> = all().filter(|kind| executed.get(kind).is_none_or(|count| *count < 20)).collect();
    assert!(missing.is_empty(), "executed fewer than 20 times: {missing:?}");
}

/// Whether QEMU can start.
fn has_qemu() -> bool {
    let version = Command::new("qemu-system-arm").arg("--version").stdout(Stdio::null()).status();
    let Err(error) = version else { return true };
    assert!(env::var_os("REQUIRE_QEMU").is_none(), "qemu-system-arm: {error}");
    // Unlike `eprintln!`, this is not captured.
    let _ = writeln!(std::io::stderr(), "skipped: comparison with QEMU: {error}");
    false
}

/// Runs a program on both and counts the executed kinds of instructions.
fn compare(program: &Program, executed: &mut BTreeMap<String, u64>) -> u64 {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("program");
    std::fs::write(&file, &program.bytes).unwrap();
    let mut machine = machine(program);
    machine.begin(program.begin, [0; 4]);
    let mut emulator = Emulator::start(&[(file, 0)]);
    meet(&mut machine, &mut emulator);
    assert_eq!(machine.registers.core[13], STACK);
    // Counts by address first: the kind is a string and slow to compute.
    let mut counts: BTreeMap<u32, u64> = BTreeMap::new();
    let instructions = lockstep(&mut machine, &mut emulator, |instruction| {
        *counts.entry(instruction.address).or_default() += 1;
    });
    for (address, count) in counts {
        *executed.entry(kind(&machine.image().code[&address])).or_default() += count;
    }
    instructions
}

/// A machine with a program in its memory.
fn machine(program: &Program) -> Machine {
    let mut code = BTreeMap::new();
    for range in &program.code {
        let bytes = &program.bytes[range.start as usize..range.end as usize];
        for instruction in decode_all(range.start, bytes) {
            let instruction = instruction.unwrap();
            code.insert(instruction.address, instruction);
        }
    }
    let symbols = [
        ("__sdata", 0x2000_0000),
        ("__euninit", 0x2000_8000),
        ("_stack_end", 0x2000_8000),
        ("_stack_start", RAM.end),
    ];
    let function = Function { address: CODE, bytes: 0x10_0000 - CODE, names: vec!["program".into()] };
    let segment = Segment { address: 0, load_address: 0, bytes: program.bytes.clone(), is_writable: false };
    let image = Image {
        segments: vec![segment],
        functions: BTreeMap::from([(CODE, function)]),
        symbols: symbols.map(|(name, address)| (name.to_owned(), address)).into(),
        code,
        ..Image::default()
    };
    Machine::new(Arc::new(image), Timing::new(Profile::ZeroWait, Column::Likely)).unwrap()
}
