//! Flash wait states: hand-counted examples with 4 wait states and lines of 8 bytes.

use cycles::instruction::{Instruction, decode_all};
use cycles::timing::{Access, Caches, Column, Flash, KnownOperands, Outcome, Pipeline, Profile, Timing};

const FLASH: u32 = 0x0800_0000;
const RAM: u32 = 0x2000_0000;
const CCM: u32 = 0x1000_0000;
const NOP: u16 = 0xBF00;
/// `ADD.W R12, R1, #1`.
const WIDE: [u16; 2] = [0xF101, 0x0C01];
/// `LDR R1, [R0]`.
const LOAD: u16 = 0x6801;
/// `B` to itself.
const BRANCH: u16 = 0xE7FE;

fn decode(address: u32, halfwords: &[u16]) -> Vec<Instruction> {
    let bytes: Vec<u8> = halfwords.iter().flat_map(|halfword| halfword.to_le_bytes()).collect();
    decode_all(address, &bytes).flatten().collect()
}

fn timing(flash: Flash) -> Timing {
    Timing::new(Profile::Flash(flash), Column::Likely)
}

/// Cycles in the worst cache state.
fn longest(flash: Flash, code: &[Instruction], known: KnownOperands) -> u32 {
    let mut pipeline = Pipeline::default();
    code.iter().map(|i| timing(flash).cycles(&mut pipeline, i, Outcome::Done, known)).sum()
}

/// Cycles with these caches.
fn cached(flash: Flash, caches: &mut Caches, code: &[Instruction], known: KnownOperands) -> u32 {
    let mut pipeline = Pipeline::default();
    code.iter().map(|i| timing(flash).cached_cycles(&mut pipeline, caches, i, Outcome::Done, known)).sum()
}

#[test]
fn straight_code_waits_once_per_line() {
    let code = decode(FLASH, &[NOP; 12]);
    assert_eq!(longest(Flash::STM32G4, &code, KnownOperands::default()), 12 + 3 * 4);
    assert_eq!(cached(Flash::STM32G4, &mut Caches::default(), &code, KnownOperands::default()), 12 + 3 * 4);
}

#[test]
fn an_instruction_across_two_lines_waits_for_both() {
    let code = decode(FLASH + 6, &WIDE);
    assert_eq!(longest(Flash::STM32G4, &code, KnownOperands::default()), 1 + 2 * 4);
}

#[test]
fn code_in_ram_does_not_wait() {
    for address in [RAM, CCM] {
        let code = decode(address, &[NOP; 12]);
        assert_eq!(longest(Flash::STM32G4, &code, KnownOperands::default()), 12);
        assert_eq!(cached(Flash::STM32G4, &mut Caches::default(), &code, KnownOperands::default()), 12);
        let [branch] = decode(address, &[BRANCH])[..] else { panic!("one instruction") };
        let pipeline = &mut Pipeline::default();
        let cycles =
            timing(Flash::STM32G4).cycles(pipeline, &branch, Outcome::Taken, KnownOperands::default());
        assert_eq!(cycles, 3);
    }
}

#[test]
fn a_return_from_ccm_waits_for_its_line() {
    let code = [decode(FLASH, &[NOP; 2]), decode(CCM, &[NOP; 2]), decode(FLASH + 4, &[NOP; 2])].concat();
    assert_eq!(longest(Flash::STM32G4, &code, KnownOperands::default()), 6 + 2 * 4);
}

#[test]
fn a_line_stays_cached_until_as_many_other_lines_were_used() {
    let flash = Flash { instruction_lines: 3, ..Flash::STM32G4 };
    let line = |number: u32| decode(FLASH + 8 * number, &[NOP; 4]);
    let mut caches = Caches::default();
    let mut run = |number| cached(flash, &mut caches, &line(number), KnownOperands::default());
    let waits = [0, 1, 2, 0, 3, 0, 1].map(|number| run(number) - 4);
    // Line 0 is used again before line 3 is read, so line 1 is replaced.
    assert_eq!(waits, [4, 4, 4, 0, 4, 0, 4]);
}

#[test]
fn a_backward_branch_is_at_worst_a_miss_after_a_useless_read_and_hits_in_the_cache() {
    let code = decode(FLASH, &[BRANCH]);
    let [branch] = code.as_slice() else { panic!("one instruction") };
    let (mut pipeline, mut caches) = (Pipeline::default(), Caches::default());
    let timing = timing(Flash::STM32G4);
    // 3 own cycles, the read of its line, and the useless read of the next line.
    let mut again = || timing.cycles(&mut pipeline, branch, Outcome::Taken, KnownOperands::default());
    assert_eq!([again(), again()], [3 + 4 + 4; 2]);
    let mut pipeline = Pipeline::default();
    let mut again =
        || timing.cached_cycles(&mut pipeline, &mut caches, branch, Outcome::Taken, KnownOperands::default());
    assert_eq!([again(), again()], [3 + 4, 3]);
}

#[test]
fn constants_wait_and_variables_do_not() {
    let code = decode(RAM, &[LOAD, NOP]);
    let at =
        |address| KnownOperands { access: Some(Access::at_address(address)), ..KnownOperands::default() };
    assert_eq!(longest(Flash::STM32G4, &code, at(FLASH)), 3 + 4);
    // A word across two lines, with one further access.
    assert_eq!(longest(Flash::STM32G4, &code, at(FLASH + 6)), 3 + 2 * 4 + 1);
    assert_eq!(longest(Flash::STM32G4, &code, at(RAM)), 3);
    assert_eq!(longest(Flash::STM32G4, &code, at(CCM)), 3);
    let between = |min_address, max_address| {
        let access = Access { min_address, max_address, alignment: 4 };
        longest(Flash::STM32G4, &code, KnownOperands { access: Some(access), ..KnownOperands::default() })
    };
    assert_eq!(between(CCM, CCM + 0x7FFC), 3);
    // Addresses after the CCM and before it are flash.
    assert_eq!(between(CCM, CCM + 0x8000), 3 + 2 * 4);
    assert_eq!(between(CCM - 4, CCM + 4), 3 + 2 * 4);
    let unknown = KnownOperands {
        access: Some(Access { min_address: FLASH, max_address: RAM, alignment: 4 }),
        ..KnownOperands::default()
    };
    assert_eq!(longest(Flash::STM32G4, &code, unknown), 3 + 2 * 4);
    let mut caches = Caches::default();
    let mut load = || cached(Flash::STM32G4, &mut caches, &code, at(FLASH));
    assert_eq!([load(), load()], [3 + 4, 3]);
}

#[test]
fn a_prefetched_line_waits_less() {
    let flash = Flash { prefetches: true, ..Flash::STM32G4 };
    let code = decode(FLASH, &[NOP; 8]);
    // The read of the second line takes 5 cycles and starts together with the first line's four instructions,
    // so one cycle remains.
    assert_eq!(cached(flash, &mut Caches::default(), &code, KnownOperands::default()), 8 + 4 + 1);
    // In the worst case, a useless read of 5 cycles precedes both lines.
    assert_eq!(longest(flash, &code, KnownOperands::default()), 8 + 2 * (4 + 5));
}
