//! Encodings compared with LLVM's disassembly, and IT blocks, which affect the following instructions.

use cycles::instruction::{
    Arithmetic, Condition, Instruction, ItState, Operand, Operation, Undecoded, decode, decode_all,
};

const ADDRESS: u32 = 0x0800_0000;

fn bytes(halfwords: &[u16]) -> Vec<u8> {
    halfwords.iter().flat_map(|half| half.to_le_bytes()).collect()
}

fn alone(halfwords: &[u16]) -> Result<Instruction, Undecoded> {
    decode(ADDRESS, &bytes(halfwords), ItState::NOT_IN_BLOCK)
}

fn all(halfwords: &[u16]) -> Vec<Instruction> {
    decode_all(ADDRESS, &bytes(halfwords)).map_while(Result::ok).collect()
}

#[test]
fn encodings_match_the_disassembly_of_llvm() {
    let rows = include_str!("encodings.txt").lines().filter(|line| !line.starts_with('#'));
    let mut known = 0;
    for row in rows {
        let (code, text) = row.split_at(9);
        let halfwords: Vec<u16> =
            code.split_whitespace().map(|half| u16::from_str_radix(half, 16).unwrap()).collect();
        let decoded = alone(&halfwords);
        let read = decoded.map_or("?".to_owned(), |instruction| instruction.to_string());
        assert_eq!(read, text.trim(), "{code}");
        if let Ok(instruction) = decoded {
            assert_eq!(usize::from(instruction.bytes), halfwords.len() * 2, "{row}");
            known += 1;
        }
    }
    assert!(known > 1000, "{known} rows");
}

#[test]
fn any_bytes_are_decoded_or_rejected() {
    let blocks = [0xBF08u16, 0xBF1C, 0xBF01];
    for first in 0..=u16::MAX {
        let is_wide = first >= 0xE800;
        for step in 0..if is_wide { 64u32 } else { 1 } {
            let [low, high, ..] = ((step * 0x0404) ^ (u32::from(first) << 3)).to_le_bytes();
            let code = bytes(&[first, u16::from_le_bytes([low, high])]);
            match decode(ADDRESS, &code, ItState::NOT_IN_BLOCK) {
                Ok(instruction) => {
                    assert_eq!(instruction.bytes == 4, is_wide);
                    assert!(!instruction.in_it_block);
                    assert!(!instruction.to_string().is_empty());
                }
                Err(Undecoded::Narrow { .. }) => assert!(!is_wide),
                Err(Undecoded::Wide { .. }) => assert!(is_wide),
                Err(Undecoded::Truncated { .. }) => panic!("four bytes hold any instruction"),
            }
        }
        for block in blocks {
            let code = bytes(&[block, first, first.rotate_left(5)]);
            if let Some(Ok(instruction)) = decode_all(ADDRESS, &code).nth(1) {
                assert!(instruction.in_it_block);
            }
        }
    }
}

/// `ITETE GT` governs four instructions; every second one has the inverse condition.
#[test]
fn an_it_block_gives_its_conditions_in_order() {
    let code = all(&[0xBFCB, 0x1840, 0x1840, 0xF851, 0x0B04, 0x1840, 0x1840]);
    let conditions: Vec<Condition> = code.iter().map(|instruction| instruction.condition).collect();
    let (greater, not) = (Condition::Greater, Condition::LessOrEqual);
    assert_eq!(conditions, [Condition::Always, greater, not, greater, not, Condition::Always]);
    let governed: Vec<bool> = code.iter().map(|instruction| instruction.in_it_block).collect();
    assert_eq!(governed, [false, true, true, true, true, false]);
    assert_eq!(code[0].operation, Operation::IfThen { length: 4 });
    assert_eq!(code[3].to_string(), "ldrgt r0, [r1], #4");
}

/// The same 16 bits are `ADDS` outside of a block and `ADD` inside (A6.7.3); a comparison sets the flags in
/// both cases.
#[test]
fn narrow_arithmetic_does_not_change_the_flags_in_a_block() {
    let code = all(&[0x1840, 0xBF04, 0x1840, 0x4288]);
    assert_eq!(code[0].to_string(), "adds r0, r0, r1");
    assert_eq!(code[2].to_string(), "addeq r0, r0, r1");
    assert!(matches!(code[3].operation, Operation::Arithmetic { d: None, sets_flags: true, .. }));
    assert_eq!(code[3].condition, Condition::Equal);
}

#[test]
fn a_jump_is_the_last_instruction_of_its_block() {
    // BX LR; POP {PC}; BL; LDR PC, [R0]; MOV PC, R0; TBB
    let jumps: [&[u16]; 6] =
        [&[0x4770], &[0xBD00], &[0xF000, 0xF800], &[0xF8D0, 0xF000], &[0x4687], &[0xE8D0, 0xF001]];
    for jump in jumps {
        let last = bytes(&[&[0xBF08], jump].concat());
        assert!(decode_all(ADDRESS, &last).all(|decoded| decoded.is_ok()), "{jump:x?}");
        let first = bytes(&[&[0xBF04], jump, &[0xBF00]].concat());
        assert!(decode_all(ADDRESS, &first).nth(1).unwrap().is_err(), "{jump:x?}");
    }
    // CBZ, IT, conditional B (both sizes), CPSID, MOVS of a register: not allowed in any block.
    for never in [&[0xB100u16][..], &[0xBF08], &[0xD000], &[0xF000, 0x8000], &[0xB672], &[0x0008]] {
        assert!(alone(never).is_ok(), "{never:x?}");
        let last = bytes(&[&[0xBF08], never].concat());
        assert!(decode_all(ADDRESS, &last).nth(1).unwrap().is_err(), "{never:x?}");
    }
}

#[test]
fn a_breakpoint_ignores_the_condition() {
    assert_eq!(all(&[0xBF08, 0xBEAB])[1].condition, Condition::Always);
    assert_eq!(all(&[0xBF08, 0xDE00])[1].condition, Condition::Equal);
}

/// Table A5-11: the four patterns do not change the carry; a rotation sets it to the top bit.
#[test]
fn expanded_immediates_set_the_carry_as_in_the_manual() {
    let operand = |code: [u16; 2]| match alone(&code).unwrap().operation {
        Operation::Move { operand: Operand::Immediate { value, carry }, .. } => (value, carry),
        other => panic!("{other:?}"),
    };
    assert_eq!(operand([0xF04F, 0x00AB]), (0x0000_00AB, None));
    assert_eq!(operand([0xF04F, 0x10AB]), (0x00AB_00AB, None));
    assert_eq!(operand([0xF04F, 0x20AB]), (0xAB00_AB00, None));
    assert_eq!(operand([0xF04F, 0x30AB]), (0xABAB_ABAB, None));
    assert_eq!(operand([0xF04F, 0x402B]), (0xAB00_0000, Some(true)));
    assert_eq!(operand([0xF44F, 0x402B]), (0x0000_AB00, Some(false)));
    assert_eq!(operand([0xF44F, 0x70AB]), (0x0000_0156, Some(false)));
}

#[test]
fn adr_adds_an_immediate_to_the_aligned_program_counter() {
    let Operation::Arithmetic { operator, d, n, .. } = alone(&[0xF2AF, 0x0009]).unwrap().operation else {
        panic!("ADR is arithmetic");
    };
    assert_eq!((operator, d, n), (Arithmetic::Subtract, Some(0), 15));
}

#[test]
fn decoding_ends_at_an_unmodelled_instruction() {
    // NOP, CDP, NOP
    let code = bytes(&[0xBF00, 0xEE00, 0x0000, 0xBF00]);
    let decoded: Vec<_> = decode_all(ADDRESS, &code).collect();
    assert_eq!(decoded.len(), 2);
    assert_eq!(decoded[1], Err(Undecoded::Wide { address: ADDRESS + 2, code: 0xEE00_0000 }));
    assert_eq!(
        decode_all(ADDRESS, &code[..3]).last(),
        Some(Err(Undecoded::Truncated { address: ADDRESS + 2 }))
    );
    assert_eq!(
        decode_all(ADDRESS, &code[..4]).last(),
        Some(Err(Undecoded::Truncated { address: ADDRESS + 2 }))
    );
    assert_eq!(decode_all(ADDRESS, &[]).count(), 0);
}
