//! Stalls of runs of misaligned instructions, compared with a word-by-word simulation of the fetch unit.
//!
//! Arm, KA8521: a Cortex-M4 fetches aligned words, one per cycle, into a three-word buffer while it has
//! space.
#![expect(clippy::unwrap_used, reason = "test helpers, like tests")]

use cycles::instruction::{Instruction, decode_all};
use cycles::timing::{Column, KnownOperands, Outcome, Pipeline, Profile, Row, Timing};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

const BUFFER_WORDS: usize = 3;
/// Cycles from a fetch until its word can execute: the maximum additional cycles of a jump.
const MAX_LATENCY: usize = 3;
const CODE: u32 = 0x1000;
/// `NOP`; `LDR R1, [R0]`; `ADD.W R12, R1, #1`; `LDR.W R12, [R0]`; `STR.W R1, [R0]`.
const KINDS: [&[u16]; 5] = [&[0xBF00], &[0x6801], &[0xF101, 0x0C01], &[0xF8D0, 0xC000], &[0xF8C0, 0x1000]];

/// Cycles of each instruction.
fn model(timing: Timing, code: &[Instruction]) -> Vec<u32> {
    let mut pipeline = Pipeline::default();
    code.iter()
        .map(|one| timing.cycles(&mut pipeline, one, Outcome::Done, KnownOperands::default()))
        .collect()
}

/// Wait cycles of a chip for instructions with known own cycles, if a word arrives `latency` cycles after its
/// fetch.
fn waits(code: &[Instruction], own: &[u32], latency: usize) -> usize {
    // Arrival time of each word, starting with the first instruction's word.
    let mut comes: Vec<usize> = Vec::new();
    let (mut now, mut waits) = (0, 0);
    let word = |address: u32| usize::try_from((address - CODE) / 4).unwrap();
    for (instruction, own) in code.iter().zip(own) {
        let [first, last, next] = [instruction.address, instruction.next() - 1, instruction.next()].map(word);
        let mut left = *own;
        while left > 0 {
            let is_there = comes.get(last).is_some_and(|comes| *comes <= now);
            let oldest = if is_there { next } else { first };
            if comes.len() < oldest + BUFFER_WORDS {
                comes.push(now + latency);
            }
            left -= u32::from(is_there);
            waits += usize::from(!is_there);
            now += 1;
        }
    }
    waits
}

/// Applies to the upper column; the typical column contains the most common values.
#[test]
fn no_chip_with_a_buffer_of_three_words_stalls_more_often() {
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let mut more_than_likely = 0;
    for _ in 0..50_000 {
        let mut draw = |kinds: usize| random.next_u32() as usize % kinds;
        let length = 1 + draw(12);
        let code: Vec<u16> = (0..length).flat_map(|_| KINDS[draw(KINDS.len())]).copied().collect();
        let bytes: Vec<u8> = code.iter().flat_map(|halfword| halfword.to_le_bytes()).collect();
        let code: Vec<Instruction> =
            decode_all(CODE + 2 * u32::try_from(draw(2)).unwrap(), &bytes).map(Result::unwrap).collect();
        let of = |column| model(Timing::new(Profile::ZeroWait, column), &code);
        let own = model(Timing::new(Profile::ZeroWait, Column::Upper).with_row(Row::MisalignedRun, 0), &code);
        let typical = Timing::new(Profile::ZeroWait, Column::Likely);
        let own_likely = model(typical.with_row(Row::MisalignedRun, 0), &code);
        let stalls = |all: &[u32], own: &[u32]| (all.iter().sum::<u32>() - own.iter().sum::<u32>()) as usize;
        for latency in 1..=MAX_LATENCY {
            // Excludes the cost of the jump there: the first word, and the second word of a misaligned
            // target.
            let after_jump = latency + 1;
            let upper = stalls(&of(Column::Upper), &own);
            assert!(waits(&code, &own, latency) <= after_jump + upper, "{code:?}, latency {latency}");
            let typical = stalls(&of(Column::Likely), &own_likely);
            more_than_likely += usize::from(waits(&code, &own_likely, latency) > after_jump + typical);
        }
    }
    assert!(more_than_likely > 0, "the simulated buffer never stalls more than the typical column");
}
