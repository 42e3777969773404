//! Random instructions from the patterns.

use std::collections::BTreeMap;

use cycles::instruction::decode_all;
use rand_core::Rng;

use crate::program::Writer;

/// Registers that may contain any value.
const FREE: [u16; 10] = [0, 1, 2, 3, 4, 5, 6, 7, 12, 14];

impl Writer {
    pub(super) fn base_and_index(&mut self) -> (u16, u16) {
        let base = self.low_register();
        (base, (base + 1 + self.below(7) as u16) % 8)
    }

    /// Points a base register into RAM and makes an index register small; does not change flags.
    pub(super) fn point(&mut self, base: u16, index: u16) {
        self.put(&[0x4640 | base, 0xF3C0 | index, index << 8 | 5]); // mov base, r8; ubfx index, index, #0, #6
    }

    /// A random instruction of a pattern that is allowed after `block` and does not write the registers
    /// `kept`.
    pub(super) fn drawn(
        &mut self,
        pattern: &str,
        block: &[u16],
        pointers: (u16, u16),
        kept: &[u16],
    ) -> Vec<u16> {
        for _ in 0..20_000 {
            let instruction = self.filled(pattern, pointers, kept);
            let all: Vec<u8> = block.iter().chain(&instruction).flat_map(|half| half.to_le_bytes()).collect();
            let last = decode_all(self.address(), &all).last();
            if matches!(last, Some(Ok(last)) if usize::from(last.bytes) == 2 * instruction.len()) {
                return instruction;
            }
        }
        panic!("found no decodable instruction of {pattern}");
    }

    pub(super) fn filled(&mut self, pattern: &str, (base, index): (u16, u16), kept: &[u16]) -> Vec<u16> {
        let mut fields = BTreeMap::new();
        let letters = pattern.as_bytes();
        let mut halves = Vec::new();
        for (place, letter) in letters.iter().enumerate() {
            let bit = match letter {
                b'0' => 0,
                b'1' => 1,
                b'x' => self.below(2) as u16,
                letter => {
                    let before = letters[..place].iter().rev().take_while(|other| *other == letter).count();
                    let behind = letters[place + 1..].iter().take_while(|other| *other == letter).count();
                    let registers = &FREE[..if before + behind == 2 { 8 } else { FREE.len() }];
                    let register = *fields.entry(*letter).or_insert_with(|| match letter {
                        b'b' => base,
                        b'c' => index,
                        letter => loop {
                            let register = registers[self.random.next_u32() as usize % registers.len()];
                            if !(b"dtu".contains(letter) && kept.contains(&register)) {
                                break register;
                            }
                        },
                    });
                    register >> behind & 1
                }
            };
            if place % 16 == 0 {
                halves.push(0);
            }
            if let Some(half) = halves.last_mut() {
                *half = *half << 1 | bit;
            }
        }
        halves
    }
}
