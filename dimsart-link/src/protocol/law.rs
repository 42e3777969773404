//! Requests about a controller's laws.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::refusal::Refusal;
use super::response::{MAX_SIGNAL_WORDS, Response, SignalWords};
use dimsart_core::{Engine, Format, Unit};

/// Requests about programs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum LawAction {
    /// Reads the state of a slot, numbered from 1.
    Status {
        /// The slot.
        number: u8,
    },
    /// Reads words of a slot's program.
    Read {
        /// The slot.
        number: u8,
        /// First word; a response has at most 32 words.
        from: u8,
    },
}

/// Answers a request about a law. A [read](LawAction::Read) returns as many words as fit.
pub(super) fn answer_law(engine: &Engine, action: LawAction) -> Response<'static> {
    let answer = match action {
        LawAction::Read { number, from } => engine
            .law_words(number)
            .and_then(|words| text_of(words, from.into(), Format::U32, Unit::One))
            .map(Response::Signal),
        LawAction::Status { number } => engine.law(number).map(Response::Law),
    };
    answer.unwrap_or(Response::Refused(Refusal::NotFound))
}

/// The same for a controller without laws.
pub(super) fn refuse_law(_: &Engine, _: LawAction) -> Response<'static> {
    Response::Refused(Refusal::Unsupported)
}

pub(super) fn text_of(words: &[u32], from: u16, format: Format, unit: Unit) -> Option<SignalWords> {
    let rest = words.get(usize::from(from)..)?;
    let wanted = rest.get(..MAX_SIGNAL_WORDS).unwrap_or(rest);
    Some(SignalWords {
        format,
        unit,
        total_words: u16::try_from(words.len()).unwrap_or(u16::MAX),
        words: Vec::from_slice(wanted).unwrap_or_default(),
    })
}
