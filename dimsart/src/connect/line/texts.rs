//! Texts of answers: characters that a terminal or a scheme would act on are replaced where an answer enters.

use dimsart_core::protocol::decode_response;
use hil_sim::foreign_text::{ends_word, is_hidden};

/// Replaces them in place; the bytes of a text keep their number, and the rest of the content its place.
pub(super) fn make_visible(content: &mut [u8]) {
    let (start, mut hidden) = (content.as_ptr().addr(), Vec::new());
    if let Ok((_, response)) = decode_response(content) {
        response.for_each_text(|text, is_word| {
            // Texts are borrowed from the content.
            let place = text.as_ptr().addr().saturating_sub(start);
            let found = text.char_indices().filter(|(_, found)| match is_word {
                true => ends_word(*found),
                false => is_hidden(*found),
            });
            hidden.extend(found.map(|(at, found)| place + at..place + at + found.len_utf8()));
        });
    }
    for range in hidden {
        content.get_mut(range).unwrap_or_default().fill(b'?');
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dimsart_core::protocol::{
        Accepted, DataTypeText, Identity, MAX_FRAME_BYTES, ModuleText, ParameterText, PortText, Receiver,
        Response, encode_response,
    };
    use dimsart_core::{Direction, Entries, Format, Shape, Stage, Unit};

    const BAD: &str = "a\x1b[2J\nall MOD_ENG CLOSE #\u{202e}\u{200b}";
    const LINE: &str = "a?[2J?all MOD_ENG CLOSE #??????";
    const WORD: &str = "a?[2J?all?MOD_ENG?CLOSE????????";

    fn shown(response: &Response<'_>) -> String {
        let mut frame = [0; MAX_FRAME_BYTES];
        let mut content = Vec::new();
        Receiver::new().take_all(encode_response(response, 7, &mut frame).unwrap(), |found| {
            content = found.to_vec();
        });
        make_visible(&mut content);
        format!("{:?}", decode_response(&content).unwrap())
    }

    #[test]
    fn every_text_of_every_answer_is_visible() {
        let names = ["OFF", BAD].into_iter().collect();
        let parameter = ParameterText {
            name: BAD,
            unit: Unit::One,
            accepts: Accepted::Choice(names),
            entries: Entries::ONE,
            default: None,
            is_structural: false,
        };
        let port = PortText {
            name: BAD,
            direction: Direction::Read,
            stage: Stage::Early,
            is_delayed: false,
            default: None,
            bound: None,
        };
        let data_type =
            DataTypeText { id: 9, name: BAD, unit: Unit::One, format: Format::F32, shape: Shape::Scalar };
        let identity = Identity {
            protocol_version: 13,
            device: BAD,
            image: BAD,
            axes: std::iter::empty().collect(),
            sample_period_s: 1e-3,
        };
        for (response, texts) in [
            (Response::Identity(identity), [LINE, LINE]),
            (Response::Module(ModuleText { name: BAD }), [WORD, "Module"]),
            (Response::Parameter(parameter), [WORD, "\"OFF\""]),
            (Response::Port(port), [WORD, "Port"]),
            (Response::DataType(data_type), [WORD, "DataType"]),
        ] {
            let shown = shown(&response);
            assert!(texts.iter().all(|text| shown.contains(text)), "{shown}");
            assert!(!shown.contains("\\n") && !shown.contains("\\u"), "{shown}");
        }
    }
}
