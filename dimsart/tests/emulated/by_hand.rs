//! An independent host, without code shared with the tested one.

use std::fs::File;
use std::io::{Read, Write};
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use dimsart_link::exchange::{ExchangeError, Frame, Tag};
use test_requirements::TEST_TIMEOUT;

/// The host's ends of two named pipes.
pub(crate) struct ByHand {
    to_board: File,
    from_board: File,
}

impl ByHand {
    /// Connects with a device of three linear axes.
    pub(crate) fn greet(folder: &Path) -> Self {
        let to_board = File::options().write(true).open(folder.join("to-board")).unwrap();
        let mut line = Self { to_board, from_board: File::open(folder.join("from-board")).unwrap() };
        let mut hello = line.send(&[(Tag::Device, &[0; 3])]);
        let deadline = Instant::now() + TEST_TIMEOUT;
        // A restarting board closes its end for a moment.
        while !line.receive(&mut hello) {
            assert!(Instant::now() < deadline, "no answer");
            thread::sleep(Duration::from_millis(1));
        }
        line
    }

    /// Sends a frame of these sections and returns the answer.
    pub(crate) fn exchange(&mut self, sections: &[(Tag, &[u8])]) -> Frame {
        let mut frame = self.send(sections);
        assert!(self.receive(&mut frame), "the line is closed");
        frame
    }

    /// Returns whether a frame arrives before the end of the stream.
    fn receive(&mut self, frame: &mut Frame) -> bool {
        frame.receive(|bytes| self.from_board.read(bytes).map_err(|_| ExchangeError::SectionOverrun)).unwrap()
    }

    /// Sends a frame without waiting for an answer, and returns it.
    pub(crate) fn send(&mut self, sections: &[(Tag, &[u8])]) -> Frame {
        let mut frame = Frame::new();
        frame.clear();
        for (tag, content) in sections {
            frame.push(*tag, content).unwrap();
        }
        self.to_board.write_all(frame.as_bytes()).unwrap();
        frame
    }
}

/// Returns the content of a frame under a tag.
pub(crate) fn section(frame: &Frame, wanted: Tag) -> Option<Vec<u8>> {
    let mut sections = frame.sections().map(Result::unwrap);
    sections.find(|(tag, _)| *tag == wanted).map(|(_, content)| content.to_vec())
}
