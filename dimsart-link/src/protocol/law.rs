//! What a host asks about the laws that a controller keeps.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::refusal::Refusal;
use super::response::{MAX_SIGNAL_WORDS, Response, SignalText};
use dimsart_core::{Engine, Format, Unit};

/// What is asked of the programs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum LawAction {
    /// How the place of this number stands, from 1.
    Look {
        /// The place.
        number: u8,
    },
    /// Words of the program in this place, from one of them on.
    Read {
        /// The place.
        number: u8,
        /// First word wanted; at most 32 come at a time.
        from: u8,
    },
}

/// What is asked about a law. Of a [program](LawAction::Read) as many words as fit, from one of them on.
pub(super) fn answer_law(engine: &Engine, action: LawAction) -> Response<'static> {
    let answer = match action {
        LawAction::Read { number, from } => engine
            .law_words(number)
            .and_then(|words| text_of(words, from.into(), Format::U32, Unit::One))
            .map(Response::Signal),
        LawAction::Look { number } => engine.law(number).map(Response::Law),
    };
    answer.unwrap_or(Response::Refused(Refusal::NotThere))
}

/// The same of a controller without laws.
pub(super) fn refuse_law(_: &Engine, _: LawAction) -> Response<'static> {
    Response::Refused(Refusal::NotUnderstood)
}

pub(super) fn text_of(words: &[u32], from: u16, format: Format, unit: Unit) -> Option<SignalText> {
    let rest = words.get(usize::from(from)..)?;
    let wanted = rest.get(..MAX_SIGNAL_WORDS).unwrap_or(rest);
    Some(SignalText {
        format,
        unit,
        words_in_all: u16::try_from(words.len()).unwrap_or(u16::MAX),
        words: Vec::from_slice(wanted).unwrap_or_default(),
    })
}
