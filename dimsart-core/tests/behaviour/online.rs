//! Programs: valid ones are stored, invalid ones are refused and change nothing.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]

use crate::common::IDS;
use dimsart_core::limits::{Capacities, PROGRAM_WORDS};
use dimsart_core::online::{
    CURRENT_AXIS, Header, Instruction, LawParameter, LawRefusal, Opcode, Program, ProgramError, program_crc,
};
use dimsart_core::{Command, CommandError, Cost, Costs, ModuleRef, ParameterError, Unit, Value, types};
use dimsart_link::saved_scheme;
use dimsart_modules::ALL;

use crate::common::{self, Bench};

const MEASURED: common::Types = &[types::POSITION];

fn module(name: &str) -> ModuleRef {
    ALL.module(name).unwrap()
}

/// `force = -gain * position`, with a constant, a state and a name.
fn spring() -> Vec<u32> {
    let instruction = |opcode, fields: &[u8]| Instruction::new(opcode, fields).0;
    let once = [instruction(Opcode::Constant, &[2, 0])];
    let begin = [instruction(Opcode::Input, &[1, 0, CURRENT_AXIS]), instruction(Opcode::Remember, &[0, 1])];
    let tick = [
        instruction(Opcode::Input, &[3, 0, CURRENT_AXIS]),
        instruction(Opcode::Parameter, &[4, 0, CURRENT_AXIS]),
        instruction(Opcode::Multiply, &[3, 3, 4]),
        instruction(Opcode::Multiply, &[3, 3, 2]),
        instruction(Opcode::Output, &[0, 3, CURRENT_AXIS]),
    ];
    let header = Header {
        inputs: 1,
        outputs: 1,
        parameters: 1,
        states: 1,
        constants: 1,
        once: 1,
        begin: 2,
        tick: 5,
        text_bytes: 6,
        ..Header::default()
    };
    let mut words = header.to_words().to_vec();
    words.extend([types::POSITION.first(), types::DES_FORCE.first()].map(|of| u32::from(of.id) | 1 << 16));
    words.extend(LawParameter { unit: Unit::Stiffness, min: 0.0, max: 10.0, default: 2.0 }.to_words());
    words.push((-1.0_f32).to_bits());
    words.extend(once.iter().chain(&begin).chain(&tick));
    words.extend(b"SPRING\0\0".as_chunks::<4>().0.iter().map(|bytes| u32::from_le_bytes(*bytes)));
    words.push(program_crc(&words));
    words
}

/// Changes a word and corrects the CRC.
fn with(place: usize, change: impl Fn(u32) -> u32) -> Vec<u32> {
    let mut words = spring();
    words[place] = change(words[place]);
    let end = words.len() - 1;
    words[end] = program_crc(&words[..end]);
    words
}

fn keep(bench: &mut Bench, number: u8, words: &[u32]) -> Result<(), CommandError> {
    for (place, pair) in (0..).step_by(2).zip(words.chunks(2)) {
        let words = [pair[0], pair.get(1).copied().unwrap_or(0)];
        bench.dimsart.command(Command::UploadLaw { place, words })?;
    }
    bench.dimsart.command(Command::StoreLaw { number, count: u8::try_from(words.len()).unwrap() })
}

fn bench() -> Bench {
    Bench::of(2, MEASURED, &[types::DES_FORCE])
}

#[test]
fn a_program_runs_with_its_default_and_takes_values_in_its_range() {
    let mut bench = bench();
    keep(&mut bench, 1, &spring()).unwrap();
    bench.run("ONLINE_MOD PROGRAM 1\nMOD_ENG MOD_ON ONLINE_MOD");
    assert_eq!(bench.tick(&[1.0, 3.0]), [-2.0, -6.0]);
    bench.rows("ONLINE_MOD P_1[1] 5");
    assert_eq!(bench.tick(&[1.0, 3.0]), [-2.0, -15.0]);
    let refused = bench.order("ONLINE_MOD P_1 11");
    assert_eq!(refused, Err(CommandError::Parameter(ParameterError::OutOfRange)));
    assert_eq!(bench.tick(&[1.0, 3.0]), [-2.0, -15.0]);
    let engine = bench.dimsart.engine_mut();
    assert_eq!(engine.get(module("ONLINE_MOD"), 1, 0), Ok(Value::Real(2.0)));
}

#[test]
fn another_program_begins_with_its_own_defaults() {
    let mut bench = bench();
    keep(&mut bench, 1, &spring()).unwrap();
    keep(&mut bench, 2, &with(8, |_| 7.0_f32.to_bits())).unwrap();
    bench.rows("ONLINE_MOD PROGRAM 1\nONLINE_MOD P_1 5\nONLINE_MOD PROGRAM 2");
    let values =
        |bench: &mut Bench| [0, 1].map(|axis| bench.dimsart.engine_mut().get(module("ONLINE_MOD"), 1, axis));
    assert_eq!(values(&mut bench), [Ok(Value::Real(7.0)); 2]);
    bench.rows("ONLINE_MOD P_1[0] 3\nONLINE_MOD PROGRAM 2");
    assert_eq!(values(&mut bench), [Ok(Value::Real(3.0)), Ok(Value::Real(7.0))], "it has not changed");
}

#[test]
fn what_is_no_program_is_refused_with_its_reason_and_changes_nothing() {
    let mut bench = bench();
    keep(&mut bench, 1, &spring()).unwrap();
    bench.run("ONLINE_MOD PROGRAM 1\nMOD_ENG MOD_ON ONLINE_MOD");
    let version = |word: u32| word & !0xFF | 9;
    let field = |place: u32, value: u32| move |word: u32| word & !(0x3F << place) | value << place;
    let mut damaged = spring();
    damaged[5] ^= 1;
    let mut short = spring();
    short.pop();
    // Words: header 0 to 2, ports 3 and 4, the parameter 5 to 8, the constant 9, instructions 10 to 17.
    let wrong = [
        (damaged, ProgramError::Damaged),
        (short, ProgramError::Damaged),
        (vec![], ProgramError::Size),
        (with(0, version), ProgramError::Version { found: 9 }),
        (with(0, |word| word + (1 << 8)), ProgramError::Size),
        (with(1, |word| word + 9), ProgramError::Size),
        (with(1, |word| word | 1 << 24), ProgramError::Size),
        (with(3, |_| 0x0001_7FFF), ProgramError::Port { port: 0 }),
        (with(4, |_| u32::from(types::LINK_AGE.id) | 1 << 16), ProgramError::Port { port: 1 }),
        (with(4, |word| word & 0xFFFF), ProgramError::Port { port: 1 }),
        (with(5, |_| 200), ProgramError::Parameter { parameter: 0 }),
        (with(6, |_| f32::NAN.to_bits()), ProgramError::Parameter { parameter: 0 }),
        (with(8, |_| 11.0_f32.to_bits()), ProgramError::Parameter { parameter: 0 }),
        (with(9, |_| f32::NAN.to_bits()), ProgramError::Constant { constant: 0 }),
        (with(10, |word| word & !0xFF | 200), ProgramError::Opcode { at: 0 }),
        (with(10, field(14, 1)), ProgramError::Range { at: 0 }),
        (with(10, field(8, 40)), ProgramError::Register { at: 0 }),
        (with(13, field(14, 1)), ProgramError::Range { at: 3 }),
        (with(13, field(20, 5)), ProgramError::Range { at: 3 }),
        (with(15, field(14, 9)), ProgramError::Register { at: 5 }),
        (with(16, field(20, 63)), ProgramError::Register { at: 6 }),
        (
            with(12, |_| Instruction::new(Opcode::Output, &[0, 1, CURRENT_AXIS]).0),
            ProgramError::Place { at: 2 },
        ),
        (
            with(10, |_| Instruction::new(Opcode::Input, &[0, 0, CURRENT_AXIS]).0),
            ProgramError::Place { at: 0 },
        ),
        (with(17, |_| Instruction::new(Opcode::Negate, &[1, 1]).0), ProgramError::Output { output: 0 }),
        // Parameters are in registers only in the sections of an axis.
        (with(10, |_| Instruction::new(Opcode::Negate, &[2, 0]).0), ProgramError::Register { at: 0 }),
        // A program for all axes in one go has no current axis.
        (with(1, |word| word | 1 << 24 | 2 << 16), ProgramError::Place { at: 1 }),
    ];
    for (words, error) in wrong {
        let before = bench.snapshot();
        let refused = keep(&mut bench, 2, &words);
        assert_eq!(refused, Err(CommandError::Law(LawRefusal::Program(error))));
        assert!(!error.to_string().is_empty());
        assert_eq!(bench.snapshot(), before);
        assert_eq!(bench.dimsart.engine().programs().count(), 1);
        assert_eq!(bench.tick(&[1.0, 3.0]), [-2.0, -6.0]);
    }
}

#[test]
fn a_program_in_use_is_neither_overwritten_nor_removed() {
    let mut bench = bench();
    keep(&mut bench, 1, &spring()).unwrap();
    bench.rows("ONLINE_MOD PROGRAM 1");
    let in_use = Err(CommandError::Law(LawRefusal::InUse));
    assert_eq!(keep(&mut bench, 1, &with(8, |_| 7.0_f32.to_bits())), in_use);
    assert_eq!(keep(&mut bench, 1, &spring()), Ok(()), "the same words, as after a lost answer");
    let remove = Command::RemoveLaw { number: 1 };
    assert_eq!(bench.dimsart.command(remove), in_use);
    bench.rows("MOD_ENG MOD_CLOSE ONLINE_MOD");
    assert_eq!(bench.dimsart.command(remove), Ok(()));
    assert_eq!(bench.dimsart.engine().law(1).map(|law| law.words), Some(0));
    assert!(bench.order("MOD_ENG MOD_ON ONLINE_MOD").is_ok(), "without a law it does nothing");
    bench.rows("ONLINE_MOD.2 PROGRAM 1");
    assert_eq!(
        bench.order("MOD_ENG MOD_ON ONLINE_MOD.2"),
        Err(CommandError::UnknownLaw(module("ONLINE_MOD.2")))
    );
    let beyond = u8::try_from(Capacities::DEFAULT.programs + 1).unwrap();
    assert_eq!(keep(&mut bench, beyond, &spring()), Err(CommandError::Law(LawRefusal::UnknownNumber)));
    assert_eq!(keep(&mut bench, 0, &spring()), Err(CommandError::Law(LawRefusal::UnknownNumber)));
}

#[test]
fn a_program_is_plugged_in_by_a_transaction_and_another_one_begins_anew() {
    let mut bench = bench();
    keep(&mut bench, 1, &spring()).unwrap();
    bench.run("PCTRL_MOD K_PARAM 1\nPCTRL_MOD PORT_DES_POSITION POSITION\nMOD_ENG MOD_ON PCTRL_MOD");
    assert_eq!(bench.tick(&[1.0, 3.0]), [0.0, 0.0]);
    bench.rows("MOD_ENG BEGIN\nMOD_ENG MOD_OFF PCTRL_MOD\nONLINE_MOD PROGRAM 1\nMOD_ENG MOD_ON ONLINE_MOD");
    assert_eq!(bench.tick(&[1.0, 3.0]), [0.0, 0.0], "the other scheme continues");
    bench.rows("MOD_ENG COMMIT");
    assert_eq!(bench.tick(&[1.0, 3.0]), [-2.0, -6.0]);
}

#[test]
fn a_law_for_more_axes_than_there_are_is_not_plugged_in() {
    let mut bench = bench();
    // It reads axis 2, so it needs three axes.
    let mut words = with(13, |_| Instruction::new(Opcode::Input, &[3, 0, 2]).0);
    words[1] |= 3 << 16;
    let end = words.len() - 1;
    words[end] = program_crc(&words[..end]);
    keep(&mut bench, 1, &words).unwrap();
    bench.rows("ONLINE_MOD PROGRAM 1");
    let refused = CommandError::Parameter(ParameterError::NoSuchEntry);
    assert_eq!(bench.order("MOD_ENG MOD_ON ONLINE_MOD"), Err(refused));
}

#[test]
fn a_saved_scheme_has_its_laws() {
    let mut bench = bench();
    keep(&mut bench, 2, &spring()).unwrap();
    keep(&mut bench, 1, &with(8, |_| 7.0_f32.to_bits())).unwrap();
    bench.run("ONLINE_MOD PROGRAM 2\nONLINE_MOD P_1[1] 5\nMOD_ENG MOD_ON ONLINE_MOD\nONLINE_MOD.2 PROGRAM 2");
    let saved = saved_scheme::save(bench.dimsart.engine_mut()).unwrap();
    let mut other = Bench::of(2, MEASURED, &[types::DES_FORCE]);
    let fingerprint = saved_scheme::fingerprint(other.dimsart.engine_mut());
    saved_scheme::load(&saved, fingerprint, &mut other.dimsart).unwrap();
    assert_eq!(other.tick(&[1.0, 3.0]), [-2.0, -15.0]);
    let programs: Vec<_> =
        other.dimsart.engine().programs().map(|(number, found)| (number, found.words().to_vec())).collect();
    assert_eq!(programs, [(2, spring())], "only the used programs");
    assert_eq!(saved_scheme::save(other.dimsart.engine_mut()).unwrap(), saved);
}

#[test]
fn a_law_costs_what_its_instructions_do() {
    const LINES: [Cost; 200] = {
        let mut lines = [Cost::new(100, 10); 200];
        let mut place = 1 + ALL.list().len();
        while place < lines.len() {
            lines[place] = Cost::new(7, 0);
            place += 1;
        }
        lines
    };
    let mut bench = bench();
    bench.dimsart.engine_mut().set_costs(Some(Costs::new(&LINES, &IDS)));
    keep(&mut bench, 1, &spring()).unwrap();
    // The module's cost, the instructions that run once before each section, and the instructions of both axes.
    let expected = 120 + 2 * 7 + 2 * 7 * 7;
    assert_eq!(bench.dimsart.engine().law(1).and_then(|law| law.cycles), Some(expected));
    bench.rows("ONLINE_MOD PROGRAM 1");
    let limit = |cycles| core::num::NonZeroU32::new(cycles);
    bench.dimsart.engine_mut().set_cycle_limit(limit(120 + expected - 1));
    let refused = bench.order("MOD_ENG MOD_ON ONLINE_MOD");
    assert!(
        matches!(refused, Err(CommandError::TooSlow { cycles, .. }) if cycles == expected),
        "{refused:?}"
    );
    bench.dimsart.engine_mut().set_cycle_limit(limit(120 + expected));
    bench.rows("MOD_ENG MOD_ON ONLINE_MOD");
}

#[test]
fn a_program_as_long_as_can_be_is_taken() {
    let mut words = spring();
    let crc = words.len() - 1;
    let more = PROGRAM_WORDS - words.len();
    words[2] += u32::try_from(more).unwrap() << 16;
    let end = 18;
    words.splice(end..end, (0..more).map(|_| Instruction::new(Opcode::Absolute, &[3, 1]).0));
    let crc = crc + more;
    words[crc] = program_crc(&words[..crc]);
    assert_eq!(words.len(), PROGRAM_WORDS);
    assert!(Program::verify(&words).is_ok());
    let mut bench = bench();
    keep(&mut bench, 1, &words).unwrap();
    bench.run("ONLINE_MOD PROGRAM 1\nMOD_ENG MOD_ON ONLINE_MOD");
    assert_eq!(bench.tick(&[1.0, 3.0]), [-2.0, -6.0]);
}
