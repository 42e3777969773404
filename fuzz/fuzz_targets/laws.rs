//! Fuzzes uploaded programs: invalid ones are refused without effect; accepted ones terminate, write only to their ports
//! and command finite forces.
#![no_main]

use std::cell::RefCell;

use dimsart_core::online::{CURRENT_AXIS, Header, Instruction, LawParameter, Opcode, Program, program_crc};
use dimsart_core::{Command, CommandError, Dimsart, ModuleRef, TickResult, Unit, Value, Word, types};
use dimsart_fuzz::{arm, controller};
use dimsart_modules::ALL;
use libfuzzer_sys::fuzz_target;

thread_local! {
    static CONTROLLER: RefCell<(Dimsart, Vec<u32>)> = RefCell::new((controller(), whole()));
}

/// Returns a program with every instruction.
fn whole() -> Vec<u32> {
    let one = |opcode, fields: &[u8]| Instruction::new(opcode, fields).0;
    // Its parameter is in register 0, its states in 1 and 2.
    let once = [one(Opcode::Constant, &[3, 0]), one(Opcode::Period, &[4])];
    let begin = [
        one(Opcode::Last, &[5, 0, CURRENT_AXIS]),
        one(Opcode::Remember, &[0, 5]),
        one(Opcode::Remember, &[1, 3]),
    ];
    let mut tick = vec![
        one(Opcode::Input, &[5, 0, CURRENT_AXIS]),
        one(Opcode::Input, &[6, 0, 1]),
        one(Opcode::Parameter, &[7, 0, 1]),
    ];
    for (opcode, to) in Opcode::ALL.iter().skip(Opcode::Add as usize).zip(8_u8..) {
        tick.push(one(*opcode, &[to, 1 + to % 7, to - 1, 0]));
    }
    tick.extend([one(Opcode::Remember, &[1, 25]), one(Opcode::Output, &[0, 24, CURRENT_AXIS])]);
    let count = |count: usize| u8::try_from(count).unwrap();
    let header = Header {
        inputs: 1,
        outputs: 1,
        parameters: 1,
        states: 2,
        constants: 1,
        axes: 2,
        is_coupled: false,
        once: count(once.len()),
        begin: count(begin.len()),
        tick: count(tick.len()),
        text_bytes: 3,
    };
    let mut words = header.to_words().to_vec();
    words.extend([types::POSITION, types::DES_FORCE].map(|of| u32::from(of.id) | 1 << 16));
    words.extend(LawParameter { unit: Unit::Stiffness, min: -10.0, max: 10.0, default: 2.0 }.to_words());
    words.push(0.75_f32.to_bits());
    words.extend(once.iter().chain(&begin).chain(&tick));
    words.push(u32::from_le_bytes(*b"ANY\0"));
    words.push(program_crc(&words));
    assert!(Program::verify(&words).is_ok());
    words
}

fn keep(dimsart: &mut Dimsart, words: &[u32]) -> Result<(), CommandError> {
    for (place, pair) in (0_u8..=u8::MAX).step_by(2).zip(words.chunks(2)) {
        let words = [pair[0], pair.get(1).copied().unwrap_or(0)];
        dimsart.command(Command::UploadLaw { place, words })?;
    }
    dimsart.command(Command::StoreLaw { number: 1, count: u8::try_from(words.len()).unwrap_or(u8::MAX) })
}

/// Appends a valid CRC, which a fuzzer does not find by chance.
fn sealed(mut words: Vec<u32>) -> Vec<u32> {
    if let Some(crc) = words.pop() {
        words.push(program_crc(&words) ^ u32::from(crc == u32::MAX));
    }
    words
}

fuzz_target!(|bytes: &[u8]| {
    CONTROLLER.with_borrow_mut(|(dimsart, whole)| {
        let Some((mode, bytes)) = bytes.split_first() else { return };
        let words = if mode % 4 == 0 {
            // Arbitrary words.
            bytes.as_chunks().0.iter().map(|bytes| u32::from_le_bytes(*bytes)).collect()
        } else {
            // A program with changed words.
            let mut words = whole.clone();
            for [place, change @ ..] in bytes.as_chunks::<5>().0 {
                let place = usize::from(*place) % words.len();
                words[place] ^= u32::from_le_bytes(*change);
            }
            words
        };
        let words = sealed(words);
        dimsart.connect(arm(), ALL).unwrap();
        let _ = dimsart.command(Command::RemoveLaw { number: 1 });
        let is_program = Program::verify(&words).is_ok();
        assert_eq!(keep(dimsart, &words).is_ok(), is_program);
        assert_eq!(dimsart.engine().programs().count(), usize::from(is_program));
        let Some(ModuleRef { kind, .. }) = ALL.module("ONLINE_MOD") else {
            return;
        };
        let module = ModuleRef { kind, number: 1 };
        dimsart.command(Command::set(module, 0, Value::Count(1))).unwrap();
        let is_plugged_in = dimsart.command(Command::PlugIn(module)).is_ok();
        assert!(is_program || !is_plugged_in);
        let _ = dimsart.command(Command::set(module, 1, Value::Real(-1.5)));
        let runs = dimsart.command(Command::Check).is_ok();
        for position in [0.5, -1e30, f32::MIN_POSITIVE] {
            let mut forces = [Word(0xDEAD); 3];
            let tick = dimsart.tick(&[Word::from(position); 3], &mut forces);
            assert!(forces.iter().all(|force| f32::from_bits(force.0).is_finite()));
            assert!(tick == TickResult::Ran || forces == [Word(0); 3]);
            assert!(runs || tick != TickResult::Ran);
        }
    });
});
