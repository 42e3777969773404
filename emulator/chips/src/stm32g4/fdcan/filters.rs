//! Acceptance filtering: the filter lists, then the setting for non-matching frames.

use crate::stm32g4::registers::Registers;

use super::layout::{RXGFC, XIDAM};
use super::message::Message;
use super::ram::{EXTENDED_FILTERS, Ram, STANDARD_FILTERS};

// Bits of RXGFC.
const RRFE: u32 = 0;
const RRFS: u32 = 1;
const ANFE: u32 = 2;
const ANFS: u32 = 4;
const LSS: u32 = 16;
const LSE: u32 = 24;

/// Filter result of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Match {
    /// FIFO for the frame; `None` if the frame is rejected.
    pub(super) fifo: Option<usize>,
    /// Index of the matching filter; `None` for a non-matching frame.
    pub(super) filter: Option<u32>,
    pub(super) has_priority: bool,
}

const REJECTED: Match = Match { fifo: None, filter: None, has_priority: false };

/// Finds the first filter that a frame matches.
pub(super) fn look_up(registers: &Registers, ram: &Ram<'_>, message: &Message) -> Match {
    let (rejects_remote, rest, count) = if message.is_extended {
        (RRFE, ANFE, registers.bits(RXGFC, LSE, 4))
    } else {
        (RRFS, ANFS, registers.bits(RXGFC, LSS, 5))
    };
    if message.is_remote && registers.has(RXGFC, rejects_remote) {
        return REJECTED;
    }
    let found = (0..count).find_map(|place| {
        let action = if message.is_extended {
            extended(ram, place, message.identifier, registers.get(XIDAM))?
        } else {
            standard(ram, place, message.identifier)?
        };
        Some((place, action))
    });
    match found {
        Some((place, action)) => Match {
            fifo: match action {
                1 | 5 => Some(0),
                2 | 6 => Some(1),
                _ => None,
            },
            filter: Some(place),
            has_priority: matches!(action, 4..=6),
        },
        None => Match {
            fifo: [Some(0), Some(1)].into_iter().nth(registers.bits(RXGFC, rest, 2) as usize).flatten(),
            ..REJECTED
        },
    }
}

/// Action of a filter for an identifier; `None` if the filter does not match or is disabled.
fn standard(ram: &Ram<'_>, place: u32, identifier: u32) -> Option<u32> {
    let word = ram.word(STANDARD_FILTERS + 4 * place);
    let (action, first, second) = (word >> 27 & 7, word >> 16 & 0x7FF, word & 0x7FF);
    let matches = match word >> 30 {
        0 => (first..=second).contains(&identifier),
        1 => identifier == first || identifier == second,
        2 => (identifier ^ first) & second == 0,
        _ => false,
    };
    (matches && action != 0).then_some(action)
}

fn extended(ram: &Ram<'_>, place: u32, identifier: u32, mask: u32) -> Option<u32> {
    let begin = EXTENDED_FILTERS + 8 * place;
    let (word, other) = (ram.word(begin), ram.word(begin + 4));
    let (action, first, second) = (word >> 29, word & 0x1FFF_FFFF, other & 0x1FFF_FFFF);
    let masked = identifier & mask;
    let matches = match other >> 30 {
        0 => (first..=second).contains(&masked),
        1 => masked == first || masked == second,
        2 => (masked ^ first) & second == 0,
        _ => (first..=second).contains(&identifier),
    };
    (matches && action != 0).then_some(action)
}
