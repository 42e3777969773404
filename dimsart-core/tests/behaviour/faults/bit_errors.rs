//! Bit errors in contents, detected by the CRC-32 alone; other checks are ignored.

use std::collections::BTreeSet;

use dimsart_core::envelope::{Class, HEADER_BYTES, MAX_CONTENT_BYTES, seal, verify};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::{assert_share, below};
use test_requirements::length;

const CHANNEL: u16 = 0x123;
/// 20 bytes and their CRC; and the maximum of a CAN FD frame without length byte.
const SIZES: [usize; 2] = [24, 62];
const CRC_BITS: usize = 32;

/// A content of `bytes` bytes in total.
fn content(bytes: usize) -> Vec<u8> {
    let mut buffer = [0; MAX_CONTENT_BYTES];
    Pcg64Mcg::seed_from_u64(1).fill_bytes(&mut buffer[HEADER_BYTES..bytes]);
    seal(Class::Packet, CHANNEL, 0xABCD, bytes - HEADER_BYTES - 4, &mut buffer).unwrap().to_vec()
}

fn flip(content: &mut [u8], bits: &[usize]) {
    for bit in bits {
        content[bit / 8] ^= 1 << (bit % 8);
    }
}

/// Returns whether these bit errors are detected; restores the content.
fn is_found(content: &mut [u8], bits: &[usize]) -> bool {
    flip(content, bits);
    let found = verify(content, CHANNEL).is_err();
    flip(content, bits);
    found
}

/// Syndrome of a bit: the difference between computed and received CRC if this bit is wrong. It is the same
/// for any content, and the syndrome of several bits is their exclusive or.
fn syndromes(bytes: usize) -> Vec<u32> {
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_AUTOSAR);
    let difference = |content: &[u8]| {
        let (covered, found) = content.split_last_chunk().unwrap();
        let mut digest = crc.digest();
        digest.update(&u32::from(CHANNEL).to_le_bytes());
        digest.update(covered);
        digest.finalize() ^ u32::from_le_bytes(*found)
    };
    let mut content = content(bytes);
    assert_eq!(difference(&content), 0);
    let of_bit = |bit| {
        flip(&mut content, &[bit]);
        let syndrome = difference(&content);
        flip(&mut content, &[bit]);
        syndrome
    };
    (0..8 * bytes).map(of_bit).collect()
}

#[test]
fn every_one_two_and_three_wrong_bits_are_found() {
    let mut content = content(SIZES[0]);
    let mut errors = 0_u64;
    for one in 0..8 * content.len() {
        assert!(is_found(&mut content, &[one]));
        for two in 0..one {
            assert!(is_found(&mut content, &[one, two]));
            assert!((0..two).all(|three| is_found(&mut content, &[one, two, three])), "{one}, {two}");
            errors += 1 + two as u64;
        }
        errors += 1;
    }
    assert_eq!(errors, 192 + 18_336 + 1_161_280);
}

/// 54 870 480 of them in the long run; otherwise those whose first two bits are in one byte.
#[test]
fn every_four_wrong_bits_are_found() {
    let mut content = content(SIZES[0]);
    let is_long = length(0, 1) == 1;
    let mut errors = 0_u64;
    for one in 0..8 * content.len() {
        for two in if is_long { 0 } else { one & !7 }..one {
            for three in 0..two {
                let found = (0..three).all(|four| is_found(&mut content, &[one, two, three, four]));
                assert!(found, "{one}, {two}, {three}");
                errors += three as u64;
            }
        }
    }
    assert!(errors == 54_870_480 || !is_long, "{errors}");
}

/// Two sets of at most three bits with the same syndrome would be an undetected error of at most six bits;
/// their absence proves Hamming distance 7. Sets of two and of three bits prove distance 6. 62 bytes only in
/// the long run.
#[test]
fn up_to_six_wrong_bits_in_24_bytes_and_five_in_62_are_found() {
    let sizes = SIZES.into_iter().zip([7, 6]);
    for (bytes, distance) in sizes.take(if length(0, 1) == 1 { 2 } else { 1 }) {
        let syndromes = syndromes(bytes);
        let mut small = vec![0];
        let mut triples = Vec::new();
        for (one, first) in syndromes.iter().enumerate() {
            small.push(*first);
            for (two, second) in syndromes[..one].iter().enumerate() {
                small.push(first ^ second);
                triples.extend(syndromes[..two].iter().map(|third| first ^ second ^ third));
            }
        }
        small.sort_unstable();
        assert!(small.is_sorted_by(|one, other| one < other), "two sets of at most two bits");
        triples.sort_unstable();
        let mut rest = small.iter().peekable();
        for triple in &triples {
            while rest.next_if(|syndrome| *syndrome < triple).is_some() {}
            assert_ne!(rest.peek(), Some(&triple), "a set of three bits and one of at most two");
        }
        let are_distinct = triples.is_sorted_by(|one, other| one < other);
        assert_eq!(are_distinct, distance == 7, "two sets of three bits");
    }
}

/// Rank over GF(2).
fn rank(mut rows: Vec<u32>) -> usize {
    let mut rank = 0;
    while let Some(row) = rows.pop() {
        if row != 0 {
            rank += 1;
            let pivot = row & row.wrapping_neg();
            rows.iter_mut().filter(|other| **other & pivot != 0).for_each(|other| *other ^= row);
        }
    }
    rank
}

/// No exclusive or of syndromes of 32 consecutive bits is 0, because they are linearly independent: this
/// covers all 2^32 - 1 errors at each position. A UART sends the low bit of a byte first. CAN sends the high
/// bit first, so that consecutive bits on the bus are not consecutive for this CRC: it then detects bursts of
/// 28, and the bus's own CRC the others.
#[test]
fn every_burst_of_32_bits_is_found() {
    for bytes in SIZES {
        let syndromes = syndromes(bytes);
        assert!(syndromes.windows(CRC_BITS).all(|burst| rank(burst.to_vec()) == CRC_BITS));
        let high_first: Vec<u32> = (0..8 * bytes).map(|bit| syndromes[bit ^ 7]).collect();
        assert!(high_first.windows(28).all(|burst| rank(burst.to_vec()) == 28));
    }
}

/// Checks on the decoder that syndromes predict detection: random bursts must be detected, and with the CRC
/// corrected by their syndrome they cannot be.
#[test]
fn the_decoder_finds_exactly_what_has_a_syndrome() {
    let mut random = Pcg64Mcg::seed_from_u64(2);
    for bytes in SIZES {
        let (mut content, syndromes) = (content(bytes), syndromes(bytes));
        for burst in 0..length(100_000, 10_000_000) {
            let (start, pattern) = (below(&mut random, 8 * bytes - CRC_BITS + 1), random.next_u32() | 1);
            let wrong: Vec<usize> =
                (0..CRC_BITS).filter(|bit| pattern >> bit & 1 == 1).map(|bit| start + bit).collect();
            assert!(is_found(&mut content, &wrong), "burst {burst}: {wrong:?}");
            let syndrome = wrong.iter().fold(0, |sum, bit| sum ^ syndromes[*bit]);
            let crc = 8 * bytes - CRC_BITS;
            let turned = (0..CRC_BITS).filter(|bit| syndrome >> bit & 1 == 1).map(|bit| crc + bit);
            let mut all: BTreeSet<usize> = wrong.into_iter().collect();
            for bit in turned {
                if !all.remove(&bit) {
                    all.insert(bit);
                }
            }
            let all: Vec<usize> = all.into_iter().collect();
            assert!(!is_found(&mut content, &all), "burst {burst}: {all:?}");
        }
    }
}

/// Flips each bit with probability 1/2 to 1/16, at least one of them.
fn damage(content: &mut [u8], random: &mut Pcg64Mcg) {
    let sets = 1 + below(random, 4);
    let mut is_damaged = false;
    while !is_damaged {
        for chunk in content.chunks_mut(8) {
            let wrong = (0..sets).fold(u64::MAX, |mask, _| mask & random.next_u64()).to_le_bytes();
            for (byte, wrong) in chunk.iter_mut().zip(wrong) {
                is_damaged |= wrong != 0;
                *byte ^= wrong;
            }
        }
    }
}

/// 10^8 of each size in the long run, of which 2^-32 each, 0.05 in total, are expected to be undetected.
#[test]
fn no_random_damage_passes_the_crc_32() {
    for bytes in SIZES {
        let mut random = Pcg64Mcg::seed_from_u64(3);
        let good = content(bytes);
        for frame in 0..length(1_000_000, 100_000_000) {
            let mut content = good.clone();
            damage(&mut content, &mut random);
            assert!(
                verify(&content, CHANNEL).is_err(),
                "frame {frame} of {bytes} bytes, seed 3: {content:?}"
            );
        }
    }
}

/// Control: a 16-bit CRC passes 2^-16 of the same damage, 1.5e-5. So the CRC detects it.
#[test]
fn the_same_damage_passes_a_crc_16_as_often_as_it_has_to() {
    let crc = crc::Crc::<u16>::new(&crc::CRC_16_IBM_3740);
    let frames = length(1_000_000, 100_000_000);
    for bytes in SIZES {
        let mut random = Pcg64Mcg::seed_from_u64(3);
        let mut good = content(bytes);
        let sum = crc.checksum(&good[..bytes - 2]).to_be_bytes();
        good[bytes - 2..].copy_from_slice(&sum);
        let mut passed = 0;
        for _ in 0..frames {
            let mut content = good.clone();
            damage(&mut content, &mut random);
            let (covered, found) = content.split_last_chunk().unwrap();
            passed += u64::from(crc.checksum(covered) == u16::from_be_bytes(*found));
        }
        assert_share(passed, frames, 1.0 / 65_536.0);
    }
}
