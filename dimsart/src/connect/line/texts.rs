//! Sanitizes texts of answers: replaces characters that a terminal or a scheme would interpret.

use dimsart_link::protocol::decode_response;
use hil_sim::untrusted_text::{is_hidden, is_word_delimiter};

/// Replaces the characters in place; the length of each text is unchanged.
pub(super) fn make_visible(content: &mut [u8]) {
    let (start, mut hidden) = (content.as_ptr().addr(), Vec::new());
    if let Ok((_, response)) = decode_response(content) {
        response.for_each_text(|text, is_word| {
            // Texts are borrowed from the content.
            let place = text.as_ptr().addr().saturating_sub(start);
            let found = text.char_indices().filter(|(_, found)| match is_word {
                true => is_word_delimiter(*found),
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
    use crate::connect::{Device, Timeouts};
    use dimsart_core::{
        DataTypeDescription, Direction, Format, ParameterDescription, ParameterShape,
        ParameterTypeDescription, PortDescription, Shape, Stage, Unit,
    };
    use dimsart_link::protocol::{
        Identity, MAX_FRAME_BYTES, ModuleDescription, PROTOCOL_VERSION, Receiver, Response, decode_request,
        encode_response,
    };
    use std::io::{self, Read, Write};

    const BAD: &str = "a\x1b[2J\nall MOD_ENG CLOSE #\u{202e}\u{200b}";
    const LINE: &str = "a?[2J?all MOD_ENG CLOSE #??????";
    const WORD: &str = "a?[2J?all?MOD_ENG?CLOSE????????";

    fn shown(response: &Response<'_>) -> String {
        let mut frame = [0; MAX_FRAME_BYTES];
        let mut content = Vec::new();
        Receiver::new().push_all(encode_response(response, 7, &mut frame).unwrap(), |found| {
            content = found.to_vec();
        });
        make_visible(&mut content);
        format!("{:?}", decode_response(&content).unwrap())
    }

    /// A device that answers every request with an image of this name.
    #[derive(Debug, Default)]
    struct Robot(Vec<u8>);

    impl Write for Robot {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            Receiver::new().push_all(bytes, |content| {
                let (id, _) = decode_request(content).unwrap();
                let answer =
                    encode_response(&Response::Identity(identity()), id, &mut [0; 300]).map(<[u8]>::to_vec);
                self.0.extend(answer.unwrap());
            });
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl Read for Robot {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            let count = self.0.len().min(buffer.len());
            buffer[..count].copy_from_slice(&self.0[..count]);
            self.0.drain(..count);
            Ok(count)
        }
    }

    fn identity() -> Identity<'static> {
        Identity {
            protocol_version: PROTOCOL_VERSION,
            device: BAD,
            image: BAD,
            axes: std::iter::empty().collect(),
            sample_period_s: 1e-3,
        }
    }

    #[test]
    fn an_image_s_name_adds_no_row_to_a_saved_configuration() {
        let device = Device::identify(Robot::default(), Timeouts::default(), dimsart_modules::ALL).unwrap();
        let text = crate::config::text(device.identity(), "");
        assert!(text.contains(LINE), "{text}");
        assert!(text.lines().all(|line| line.starts_with('#')), "{text}");
        assert!(!text.contains('\x1b'), "{text}");
    }

    #[test]
    fn every_text_of_every_answer_is_visible() {
        let names = ["OFF", BAD].into_iter().collect();
        let parameter = ParameterDescription {
            name: BAD,
            unit: Unit::One,
            accepts: ParameterTypeDescription::Choice(names),
            entries: ParameterShape::ONE,
            default: None,
            is_structural: false,
        };
        let port = PortDescription {
            name: BAD,
            direction: Direction::Read,
            stage: Stage::Early,
            is_delayed: false,
            default: None,
            bound: None,
        };
        let data_type = DataTypeDescription {
            id: 9,
            name: BAD,
            unit: Unit::One,
            format: Format::F32,
            shape: Shape::Scalar,
        };
        for (response, texts) in [
            (Response::Identity(identity()), [LINE, LINE]),
            (Response::Module(ModuleDescription { name: BAD }), [WORD, "Module"]),
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
